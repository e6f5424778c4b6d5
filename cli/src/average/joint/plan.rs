//! From the options to a validated plan.

use fe_grid::ScalarField;
use phasefield::segmentation::{SegmentationParams, Weights};
use shape_average::joint::JointParams;

use super::super::args::AverageConfig;
use super::super::plan::fingerprint;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::options::{Nodes, resolve_law};
use crate::progress::Progress;
use crate::shapes::{GreyInput, labels};
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::place::{lengths, nodal_values, whole_frames};
use shapespace_input::{GreyRange, Image, Sources};

/// Weight of the edge length of an image, relative to the mismatch weight: with a smaller weight,
/// dissimilar images lose their individual features (docs/study/joint.md).
const EDGE_WEIGHT: f64 = 2.0;

/// Why the box of the grid is not one of the options.
const BOX: &str = "the box of averages of images is that of the images";

/// Largest ratio of extents allowed between the first image and any other, per axis.
const MAX_RATIO: f64 = 1.5;

/// Images that are read, placed and checked, and the parameters of the computation.
pub(crate) struct JointPlan<const D: usize> {
    pub images: Vec<GreyInput<D>>,
    pub nodal: Vec<ScalarField<f64, D>>,
    /// The configuration with all defaults resolved.
    pub config: AverageConfig,
    pub params: JointParams,
    /// The inputs and parameters that the deformations depend on.
    pub fingerprint: Fingerprint,
}

/// Reads, places and validates the images.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_joint(
    config: AverageConfig,
    sources: &Sources,
    progress: &Progress,
) -> Result<Dim<JointPlan<2>, JointPlan<3>>, CliError> {
    progress.stage(format!("reading {} images", config.inputs.len()));
    let (images, ranges) = sources.read_grey_images(&config.inputs)?;
    Ok(per_dimension!(images, images => plan(&images, ranges, config)?))
}

fn plan<const D: usize>(
    images: &[Image<D>],
    ranges: Vec<GreyRange>,
    mut config: AverageConfig,
) -> Result<JointPlan<D>, CliError> {
    let first = &images[0];
    let room = lengths(first);
    let similar = |image: &Image<D>| {
        let own = lengths(image);
        (0..D).all(|k| own[k] <= MAX_RATIO * room[k] && room[k] <= MAX_RATIO * own[k])
    };
    if let Some(other) = images.iter().find(|image| !similar(image)) {
        return Err(CliError::Option {
            option: "--joint",
            value: other.path.display().to_string(),
            remedy: format!(
                "all images need about the extent of '{}', in the units of their files",
                first.path.display()
            ),
        });
    }
    resolve_law::<D>(&mut config.params.law)?;
    let nodes = config.masks.longest_side::<D>(BOX)?;
    let (frames, grid) = whole_frames(images, nodes)?;
    let nodal: Result<Vec<_>, _> = images
        .iter()
        .zip(&frames)
        .map(|(image, frame)| nodal_values(image, frame, grid))
        .collect();
    let params = complete(&mut config, nodes, grid.spacing())?;
    let names = labels(&images.iter().map(|i| i.path.as_path()).collect::<Vec<_>>());
    let (read, images) = (images, images.iter().zip(names).zip(ranges).zip(frames));
    Ok(JointPlan {
        images: images
            .map(|(((image, name), range), frame)| GreyInput::new(image, name, range, frame))
            .collect(),
        nodal: nodal?,
        fingerprint: fingerprint(&config, read, None, &[]),
        config,
        params,
    })
}

/// Resolves the defaults of a configuration, and converts it to the parameters of a joint average.
fn complete(
    config: &mut AverageConfig,
    nodes: usize,
    spacing: f64,
) -> Result<JointParams, CliError> {
    let scales = &mut config.scales;
    let (smooth, contrast) = (scales.length(spacing), scales.contrast());
    let share = config.edge_weight.unwrap_or(EDGE_WEIGHT);
    let edges = share * config.params.mismatch_weight;
    (scales.smooth, scales.contrast) = (Some(smooth), Some(contrast));
    config.edge_weight = Some(share);
    config.masks.grid = Some(Nodes::Cube(nodes));
    config.params.length_weight = Some(config.params.resolved_length_weight());
    let usual = JointParams::default();
    Ok(JointParams {
        average: config.params.clone(),
        segmentation: SegmentationParams {
            weights: Weights::for_scales(edges, smooth, contrast)?,
            ..usual.segmentation
        },
        max_rounds: config.params.max_iterations,
        ..usual
    })
}
