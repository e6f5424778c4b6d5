//! From the options to a validated plan.

use fe_grid::ScalarField;
use phasefield::segmentation::{SegmentationParams, Weights};
use shape_average::joint::{DRAWN_EDGE, Edges, JointParams};

use super::super::args::AverageConfig;
use super::super::plan::fingerprint;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::options::{Frame, Nodes, resolve_law};
use crate::progress::Progress;
use crate::shapes::{InputRecord, input_like, labels, oriented, placeless_like};
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::frame::FrameTransform;
use shapespace_input::place::{nodal_values, whole_frames};
use shapespace_input::whole::{centred_views, physical_views, reach};
use shapespace_input::{GreyRange, Image, Sources};

/// Weight of the edge length of an image, relative to the mismatch weight: with a smaller weight,
/// dissimilar images lose their individual features (docs/study/joint.md).
const EDGE_WEIGHT: f64 = 2.0;

/// Why the box of the grid is not one of the options.
const BOX: &str = "the box of averages of images is that of the images";

/// Largest ratio of extents allowed between the image that leads and any other, per axis; in the world,
/// where others may be larger, that of its extent to the part of it that another covers.
const MAX_RATIO: f64 = 1.5;

/// Images that are read, placed and checked, and the parameters of the computation.
pub(crate) struct JointPlan<const D: usize> {
    pub images: Vec<InputRecord<D>>,
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
    Ok(per_dimension!(images, images => plan(images, ranges, config)?))
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    ranges: Vec<GreyRange>,
    mut config: AverageConfig,
) -> Result<JointPlan<D>, CliError> {
    resolve_law::<D>(&mut config.params.law)?;
    let nodes = config.masks.longest_side::<D>(BOX)?;
    let leading = input_like(&config.inputs, config.like.as_deref())?;
    let (images, rule) = oriented(images, &config.masks)?;
    config.masks.frame = Some(rule);
    if let Some(like) = config.like.as_ref().filter(|_| rule == Frame::None) {
        return Err(placeless_like(like));
    }
    let images = &images[..];
    let (frames, grid) = match rule {
        Frame::Physical => physical_views(images, leading, nodes)?,
        Frame::Centred => centred_views(images, leading, nodes)?,
        Frame::None => whole_frames(images, nodes)?,
    };
    check_views(images, &frames, (leading, rule))?;
    let nodal: Result<Vec<_>, _> = images
        .iter()
        .zip(&frames)
        .map(|(image, frame)| nodal_values(image, frame, grid))
        .collect();
    let nodal = nodal?;
    let params = complete(&mut config, nodes, grid.spacing())?;
    if params.edges == Edges::Given {
        check_drawings(images, &nodal)?;
    }
    let names = labels(&images.iter().map(|i| i.path.as_path()).collect::<Vec<_>>());
    let (read, images) = (images, images.iter().zip(names).zip(ranges).zip(frames));
    Ok(JointPlan {
        images: images
            .enumerate()
            .map(|(number, (((image, name), range), frame))| {
                let mut input = InputRecord::of_image(image, name, range, frame);
                input.leads = number == leading && frame.in_world();
                input
            })
            .collect(),
        nodal,
        fingerprint: fingerprint(&config, read, None, &[]),
        config,
        params,
    })
}

/// Whether all images show about the same extent as the one that leads or, in the world, most of its field
/// of view.
///
/// # Errors
/// [`CliError::Option`] for one that does not.
fn check_views<const D: usize>(
    images: &[Image<D>],
    frames: &[FrameTransform<D>],
    (leading, rule): (usize, Frame),
) -> Result<(), CliError> {
    let view = |i: usize| reach(&images[i], &frames[i]);
    let side = |view: [f64; 2]| view[1] - view[0];
    let room = view(leading);
    let fits = |i: &usize| {
        let mut pairs = view(*i).into_iter().zip(room);
        pairs.all(|(own, room)| {
            // Equal sides may differ by rounding.
            let (length, most) = (side(room), MAX_RATIO * (1.0 + 1e-9));
            if rule == Frame::Physical {
                let common = [f64::max(own[0], room[0]), f64::min(own[1], room[1])];
                length <= most * side(common)
            } else {
                side(own) <= most * length && length <= most * side(own)
            }
        })
    };
    let Some(other) = (0..images.len()).find(|i| !fits(i)) else {
        return Ok(());
    };
    let [path, lead] = [other, leading].map(|i| images[i].path.display());
    Err(if rule == Frame::Physical {
        CliError::Option {
            option: "--frame",
            value: "physical".into(),
            remedy: format!(
                "in the world, '{path}' shows less than two thirds of the field of view of '{lead}' \
                 along an axis; use --frame centred, or --like for another field of view"
            ),
        }
    } else {
        CliError::Option {
            option: "--joint",
            value: path.to_string(),
            remedy: format!(
                "all images need about the extent of '{lead}', in the units of their files"
            ),
        }
    })
}

/// Whether drawings have lines that the grid resolves, bright on dark.
///
/// # Errors
/// [`CliError::Option`] for one that has none, or that is bright for the most part.
fn check_drawings<const D: usize>(
    images: &[Image<D>],
    nodal: &[ScalarField<f64, D>],
) -> Result<(), CliError> {
    for (image, values) in images.iter().zip(nodal) {
        let values = values.as_slice();
        let bright = values.iter().filter(|value| **value > DRAWN_EDGE).count();
        let remedy = match bright {
            0 => {
                "there is no line on this grid: draw lines wider than a cell, or use a finer --grid"
            }
            _ if 2 * bright > values.len() => {
                "most of it is bright: edges are bright lines on a dark ground, so invert the drawing"
            }
            _ => continue,
        };
        return Err(CliError::Option {
            option: "--edges given",
            value: format!("with '{}'", image.path.display()),
            remedy: remedy.into(),
        });
    }
    Ok(())
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
    let found = config.edges.unwrap_or_default();
    config.edges = Some(found);
    config.masks.grid = Some(Nodes::Cube(nodes));
    config.params.length_weight = Some(config.params.resolved_length_weight());
    let usual = JointParams::default();
    Ok(JointParams {
        average: config.params.clone(),
        segmentation: SegmentationParams {
            weights: Weights::for_scales(edges, smooth, contrast)?,
            ..usual.segmentation
        },
        edges: found,
        // A round counts as five iterations of an average.
        tolerance: usual.tolerance * (config.params.tolerance / usual.average.tolerance),
        max_rounds: config.params.max_iterations,
        ..usual
    })
}
