//! From the options to a checked plan.

use std::path::PathBuf;

use fe_grid::ScalarField;
use hyperelastic::LawName;
use phasefield::segmentation::{SegmentationParams, Weights};
use serde::Serialize;
use shape_average::AverageParams;
use shape_average::joint::JointParams;

use super::super::args::{AverageArgs, Boundary, Mean, Solver};
use super::super::checkpoint::fingerprint;
use crate::average::plan::boundary_condition;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::input::place::{FrameTransform, lengths, nodal_values, whole_frames};
use crate::input::{AnyImages, GreyRange, Image, read_grey_images};
use crate::options::Align;
use crate::output::ResultDir;
use crate::shapes::labels;

/// Weight of the length of an image's edges, as a share of the mismatch weight: with less, images that
/// are unlike lose what is their own (docs/study/joint.md).
const EDGE_WEIGHT: f64 = 2.0;

/// How many times as long as the first image others may be, or it as they are, along every axis.
const ALIKE: f64 = 1.5;

/// All parameters of a joint average, with nothing left to choose.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Parameters {
    /// Nodes along the longest side.
    grid: usize,
    law: LawName,
    lambda: f64,
    mu: f64,
    mismatch_weight: f64,
    length_weight: f64,
    /// Length over which images are smoothed.
    smooth: f64,
    /// Least jump of an edge.
    contrast: f64,
    /// Weight of the edges of every image.
    edge_weight: f64,
    /// What follows for the other terms of an image.
    fidelity: f64,
    smoothness: f64,
    interface_width: f64,
    max_rounds: usize,
    boundary: Boundary,
    /// The average whose deformations it began with.
    #[serde(skip_serializing_if = "Option::is_none")]
    start: Option<PathBuf>,
}

/// An image and where it lies.
pub(super) struct PlacedImage<const D: usize> {
    pub path: String,
    /// Label in pictures.
    pub name: String,
    pub size: [usize; D],
    pub range: GreyRange,
    pub frame: FrameTransform<D>,
}

/// Images that are read, placed and checked, and what is to be done with them.
pub(super) struct JointPlan<const D: usize> {
    pub images: Vec<PlacedImage<D>>,
    pub nodal: Vec<ScalarField<f64, D>>,
    pub parameters: Parameters,
    pub params: JointParams,
    /// What the deformations depend on.
    pub fingerprint: Fingerprint,
}

/// A plan of either dimension.
pub(super) enum AnyPlan {
    D2(JointPlan<2>),
    D3(JointPlan<3>),
}

/// Reads, places and checks everything.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_joint(args: &AverageArgs) -> Result<AnyPlan, CliError> {
    ResultDir::check(&args.common.output)?;
    if args.inputs.len() < 2 {
        return Err(CliError::TooFewInputs {
            command: "average",
            needed: 2,
            found: args.inputs.len(),
        });
    }
    let refused = [
        ("--weights", !args.weights.is_empty()),
        ("--align rigid", args.common.align != Align::None),
        ("--label", args.common.label.is_some()),
        ("--solver descent", args.solver != Solver::Lbfgs),
        ("--memory", args.memory.is_some()),
        ("--mean median", args.mean != Mean::Arithmetic),
    ];
    if let Some((option, _)) = refused.into_iter().find(|(_, given)| *given) {
        return Err(CliError::Option {
            option: "--joint",
            value: format!("with {option}"),
            remedy: format!("leave out {option}: images are averaged whole, all alike"),
        });
    }
    let (images, ranges) = read_grey_images(&args.inputs)?;
    match images {
        AnyImages::D2(images) => plan(&images, ranges, args).map(AnyPlan::D2),
        AnyImages::D3(images) => plan(&images, ranges, args).map(AnyPlan::D3),
    }
}

fn plan<const D: usize>(
    images: &[Image<D>],
    ranges: Vec<GreyRange>,
    args: &AverageArgs,
) -> Result<JointPlan<D>, CliError> {
    let first = &images[0];
    let room = lengths(first);
    let alike = |image: &Image<D>| {
        let own = lengths(image);
        (0..D).all(|k| own[k] <= ALIKE * room[k] && room[k] <= ALIKE * own[k])
    };
    if let Some(other) = images.iter().find(|image| !alike(image)) {
        return Err(CliError::Option {
            option: "--joint",
            value: other.path.display().to_string(),
            remedy: format!(
                "all images need about the extent of '{}', in the units of their files",
                first.path.display()
            ),
        });
    }
    let nodes = args.common.nodes::<D>()?;
    let (frames, grid) = whole_frames(images, nodes)?;
    let nodal: Result<Vec<_>, _> = images
        .iter()
        .zip(&frames)
        .map(|(image, frame)| nodal_values(image, frame, grid))
        .collect();
    let smooth = args.scales.length(grid.spacing());
    let params = params::<D>(args, smooth)?;
    let weights = params.segmentation.weights;
    let parameters = Parameters {
        grid: nodes,
        law: args.common.law,
        lambda: args.common.lambda,
        mu: args.common.mu,
        mismatch_weight: args.mismatch_weight,
        length_weight: params.average.resolved_length_weight(),
        smooth,
        contrast: args.scales.contrast(),
        edge_weight: weights.edges,
        fidelity: weights.fidelity,
        smoothness: weights.smoothness,
        interface_width: params.average.interface_cells * grid.spacing(),
        max_rounds: params.max_rounds,
        boundary: boundary(args),
        start: args.start.clone(),
    };
    let names = labels(&images.iter().map(|i| i.path.as_path()).collect::<Vec<_>>());
    let (read, images) = (images, images.iter().zip(names).zip(ranges).zip(frames));
    Ok(JointPlan {
        images: images
            .map(|(((image, name), range), frame)| PlacedImage {
                path: image.path.display().to_string(),
                name,
                size: image.size,
                range,
                frame,
            })
            .collect(),
        nodal: nodal?,
        fingerprint: fingerprint(&parameters, read, &[]),
        parameters,
        params,
    })
}

fn params<const D: usize>(args: &AverageArgs, smooth: f64) -> Result<JointParams, CliError> {
    let usual = JointParams::default();
    let edges = args.edge_weight.unwrap_or(EDGE_WEIGHT) * args.mismatch_weight;
    Ok(JointParams {
        average: AverageParams {
            law: args.common.material::<D>()?,
            mismatch_weight: args.mismatch_weight,
            length_weight: args.length_weight,
            boundary: boundary_condition(boundary(args)),
            ..usual.average
        },
        segmentation: SegmentationParams {
            weights: Weights::for_scales(edges, smooth, args.scales.contrast())?,
            ..usual.segmentation
        },
        max_rounds: args.common.max_iterations as usize,
        ..usual
    })
}

/// What is free to move as a whole drifts to the border, so that this is held unless said otherwise.
fn boundary(args: &AverageArgs) -> Boundary {
    args.boundary.unwrap_or(Boundary::Identity)
}
