//! From the options to a checked plan.

use fe_grid::{Grid, ScalarField};
use phasefield::segmentation::{SegmentationParams, Weights};
use serde::Serialize;

use super::args::{Object, SegmentArgs};
use crate::error::CliError;
use crate::input::place::{FrameTransform, nodal_values, whole_frame};
use crate::input::{AnyImages, GreyRange, Image, ReadOptions, read_grey_images, read_images};
use crate::options::{ScaleArgs, check_nodes};
use crate::output::ResultDir;
use crate::shapes::labels;

/// All parameters, with nothing left to choose but what depends on the size of an image.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Parameters {
    pub object: Object,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    pub classes: u32,
    pub largest: bool,
    pub contrast: f64,
    /// Interface width on every level, in spacings.
    pub interface_cells: f64,
    /// `k_eps` over the square of the interface width.
    pub edge_conductance: f64,
    pub tolerance: f64,
    pub max_alternations: u32,
    #[serde(skip)]
    pub scales: ScaleArgs,
}

/// An image on its grid.
pub(super) struct Placed<const D: usize> {
    pub image: Image<D>,
    /// Label in pictures.
    pub name: String,
    pub range: GreyRange,
    pub frame: FrameTransform<D>,
    pub nodal: ScalarField<f64, D>,
    /// The true object.
    pub truth: Option<Image<D>>,
}

/// Images that are read, placed and checked, and what is to be done with them.
pub(super) struct SegmentPlan<const D: usize> {
    pub images: Vec<Placed<D>>,
    pub parameters: Parameters,
}

/// A plan of either dimension.
pub(super) enum AnyPlan {
    D2(SegmentPlan<2>),
    D3(SegmentPlan<3>),
}

/// Reads, places and checks everything.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_segment(args: &SegmentArgs) -> Result<AnyPlan, CliError> {
    ResultDir::check(&args.output)?;
    let by_grey = matches!(args.object, Object::Bright | Object::Dark);
    if args.threshold.is_some() && !by_grey {
        return Err(CliError::Option {
            option: "--threshold",
            value: args.threshold.unwrap_or_default().to_string(),
            remedy: "it goes with --object bright or dark: leave one of the two out".into(),
        });
    }
    if !matches!(args.truth.len(), n if n == 0 || n == args.inputs.len()) {
        return Err(wrong_truth(
            format!("{} masks", args.truth.len()),
            format!("give one for each of the {} images", args.inputs.len()),
        ));
    }
    let truth = if args.truth.is_empty() {
        None
    } else {
        Some(read_images(&args.truth, &ReadOptions::default())?)
    };
    let (images, ranges) = read_grey_images(&args.inputs)?;
    match (images, truth) {
        (AnyImages::D2(images), None) => plan(images, ranges, Vec::new(), args).map(AnyPlan::D2),
        (AnyImages::D3(images), None) => plan(images, ranges, Vec::new(), args).map(AnyPlan::D3),
        (AnyImages::D2(images), Some(AnyImages::D2(truth))) => {
            plan(images, ranges, truth, args).map(AnyPlan::D2)
        }
        (AnyImages::D3(images), Some(AnyImages::D3(truth))) => {
            plan(images, ranges, truth, args).map(AnyPlan::D3)
        }
        _ => Err(wrong_truth(
            args.truth[0].display().to_string(),
            "give masks with as many axes as the images".into(),
        )),
    }
}

fn wrong_truth(value: String, remedy: String) -> CliError {
    CliError::Option {
        option: "--truth",
        value,
        remedy,
    }
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    ranges: Vec<GreyRange>,
    truth: Vec<Image<D>>,
    args: &SegmentArgs,
) -> Result<SegmentPlan<D>, CliError> {
    for (image, mask) in images.iter().zip(&truth) {
        if image.size != mask.size {
            return Err(wrong_truth(
                mask.path.display().to_string(),
                format!("it needs the size of '{}'", image.path.display()),
            ));
        }
    }
    let names = labels(&images.iter().map(|i| i.path.as_path()).collect::<Vec<_>>());
    let mut truth: Vec<Option<Image<D>>> = truth.into_iter().map(Some).collect();
    truth.resize(images.len(), None);
    let usual = SegmentationParams::default();
    let placed = images.into_iter().zip(ranges).zip(names).zip(truth);
    let placed: Result<Vec<_>, CliError> = placed
        .map(|(((image, range), name), truth)| {
            let nodes = nodes(&image, args.grid)?;
            let (frame, grid) = whole_frame(&image, nodes)?;
            Ok(Placed {
                nodal: nodal_values(&image, &frame, grid)?,
                image,
                name,
                range,
                frame,
                truth,
            })
        })
        .collect();
    Ok(SegmentPlan {
        images: placed?,
        parameters: Parameters {
            object: args.object,
            threshold: args.threshold,
            classes: args.classes,
            largest: args.largest,
            contrast: args.scales.contrast(),
            interface_cells: usual.interface_cells,
            edge_conductance: usual.edge_conductance,
            tolerance: usual.tolerance,
            max_alternations: args.max_alternations,
            scales: args.scales,
        },
    })
}

/// The nodes along the longest side of an image: as asked for, or the least `2^L + 1` that are no
/// fewer than its samples, with a bound.
fn nodes<const D: usize>(image: &Image<D>, asked: Option<usize>) -> Result<usize, CliError> {
    let (usual, most) = if D == 2 { (513, 4097) } else { (129, 513) };
    if let Some(nodes) = asked {
        check_nodes(nodes, most)?;
        return Ok(nodes);
    }
    let samples = image.size.into_iter().fold(9, usize::max);
    Ok(((samples - 1).next_power_of_two() + 1).min(usual))
}

impl Parameters {
    /// The same as a segmentation takes them, on a grid.
    ///
    /// # Errors
    /// None in practice: the options are positive numbers.
    pub fn params<const D: usize>(&self, grid: &Grid<D>) -> Result<SegmentationParams, CliError> {
        let length = self.scales.length(grid.spacing());
        Ok(SegmentationParams {
            weights: Weights::for_scales(1.0, length, self.contrast)?,
            interface_cells: self.interface_cells,
            edge_conductance: self.edge_conductance,
            tolerance: self.tolerance,
            max_iterations: self.max_alternations as usize,
            ..SegmentationParams::default()
        })
    }
}
