//! From the options to a validated plan.

use std::path::Path;

use fe_grid::{Grid, ScalarField};
use phasefield::segmentation::{SegmentationParams, Weights};

use super::args::{SegmentConfig, wrong_truth};
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::grid::check_nodes;
use crate::shapes::{InputRecord, file_names, labels};
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::place::{nodal_values, whole_frame};
use shapespace_input::{GreyRange, Image, ReadOptions, Sources};

/// An image on its grid.
pub(crate) struct Placed<const D: usize> {
    pub image: Image<D>,
    pub input: InputRecord<D>,
    /// Names of the files of its object, without extension.
    pub files: ObjectFiles,
    pub range: GreyRange,
    pub nodal: ScalarField<f64, D>,
    /// The true object.
    pub truth: Option<Image<D>>,
}

/// Names of the files of an object, which are inputs of other commands and have the name of their image.
pub(crate) struct ObjectFiles {
    pub mask: String,
    /// The outline or the surface.
    pub boundary: String,
}

/// Images that are read, placed and checked, and the parameters of the computation.
pub(crate) struct SegmentPlan<const D: usize> {
    pub images: Vec<Placed<D>>,
    /// The configuration with all defaults resolved except those that depend on the size of an
    /// image.
    pub config: SegmentConfig,
    pub fingerprint: Fingerprint,
}

/// Reads, places and validates the images.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_segment(
    config: SegmentConfig,
    sources: &Sources,
) -> Result<Dim<SegmentPlan<2>, SegmentPlan<3>>, CliError> {
    let (images, ranges) = sources.read_grey_images(&config.inputs)?;
    Ok(per_dimension!(images, images => plan(images, ranges, sources, config)?))
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    ranges: Vec<GreyRange>,
    sources: &Sources,
    mut config: SegmentConfig,
) -> Result<SegmentPlan<D>, CliError> {
    let truth = read_truth(&images, sources, &config)?;
    let hashes = images.iter().map(hash).collect();
    let paths: Vec<&Path> = images.iter().map(|image| image.path.as_path()).collect();
    let names = labels(&paths);
    let masks = file_names("mask", &paths);
    let boundaries = file_names(if D == 2 { "outline" } else { "surface" }, &paths);
    let files = masks.into_iter().zip(boundaries);
    let files = files.map(|(mask, boundary)| ObjectFiles { mask, boundary });
    let named: Vec<_> = names.into_iter().zip(files).collect();
    let placed = images.into_iter().zip(ranges).zip(named).zip(truth);
    let placed: Result<Vec<_>, CliError> = placed
        .map(|(((image, range), (name, files)), truth)| {
            let nodes = nodes(&image, config.grid)?;
            let (frame, grid) = whole_frame(&image, nodes)?;
            Ok(Placed {
                nodal: nodal_values(&image, &frame, grid)?,
                input: InputRecord::of_image(&image, name, range, frame),
                files,
                range,
                image,
                truth,
            })
        })
        .collect();
    config.scales.contrast = Some(config.scales.contrast());
    let mut fingerprint = Fingerprint::new(&config, hashes);
    fingerprint.leave_out("truth");
    Ok(SegmentPlan {
        images: placed?,
        fingerprint,
        config,
    })
}

/// Reads the masks of the true objects: one per image, or `None` for each.
fn read_truth<const D: usize>(
    images: &[Image<D>],
    sources: &Sources,
    config: &SegmentConfig,
) -> Result<Vec<Option<Image<D>>>, CliError> {
    let Some(first) = config.truth.first() else {
        return Ok(vec![None; images.len()]);
    };
    let wrong = |path: &Path, remedy| wrong_truth(path.display().to_string(), remedy);
    let masks: Option<Vec<Image<D>>> = sources
        .read_images(&config.truth, &ReadOptions::default())?
        .of_type();
    let Some(masks) = masks else {
        let remedy = "give masks with as many axes as the images";
        return Err(wrong(first, remedy.into()));
    };
    let mut pairs = images.iter().zip(&masks);
    if let Some((image, mask)) = pairs.find(|(image, mask)| image.size != mask.size) {
        let remedy = format!("it needs the size of '{}'", image.path.display());
        return Err(wrong(&mask.path, remedy));
    }
    Ok(masks.into_iter().map(Some).collect())
}

/// The number of nodes along the longest side of an image: the configured one, or the smallest
/// `2^L + 1` not below the number of samples, with an upper bound.
fn nodes<const D: usize>(image: &Image<D>, asked: Option<usize>) -> Result<usize, CliError> {
    let usual = if D == 2 { 513 } else { 129 };
    if let Some(nodes) = asked {
        check_nodes::<D>(nodes)?;
        return Ok(nodes);
    }
    let samples = image.size.into_iter().fold(9, usize::max);
    Ok(((samples - 1).next_power_of_two() + 1).min(usual))
}

impl SegmentConfig {
    /// The parameters of a segmentation on a grid.
    ///
    /// # Errors
    /// None in practice: the options are positive numbers.
    pub(super) fn params<const D: usize>(
        &self,
        grid: &Grid<D>,
    ) -> Result<SegmentationParams, CliError> {
        let length = self.scales.length(grid.spacing());
        Ok(SegmentationParams {
            weights: Weights::for_scales(1.0, length, self.scales.contrast())?,
            ..self.params
        })
    }
}
