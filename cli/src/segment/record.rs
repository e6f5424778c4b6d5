//! The contents of `result.json`, and the summary. Missing values are left out.

use std::time::Instant;

use fe_grid::minimise::Status;
use levelset::{connected_components, enclosed_volume};
use phasefield::segmentation::{SegmentationEnergy, SegmentationLevel, Weights};
use serde::Serialize;

use super::args::SegmentConfig;
use super::compute::Found;
use crate::doubts::named;
use crate::numbers::plural;
use crate::report::{self, first_failure, overall, unless_cancelled};
use crate::shapes::{InputRecord, SizeRecord};
use crate::summary::Summary;

/// The contents of `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<SegmentConfig, Images<'a, D>, D>;

/// The results of all images.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Images<'a, const D: usize> {
    images: Vec<ImageRecord<'a, D>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_dice: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
struct ImageRecord<'a, const D: usize> {
    #[serde(flatten)]
    input: &'a InputRecord<D>,
    status: String,
    /// Nodes along each axis of the arrays, `x` first.
    nodes: Vec<usize>,
    weights: Weights,
    energy: SegmentationEnergy,
    /// Length (area) of the edges according to the phase field, in the unit box: of a disk 1.12 to 1.31 times its
    /// circumference, on 65 to 385 nodes a side.
    edge_length: f64,
    /// Number of connected regions between the edges, of a thousandth of the image or more.
    regions: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<ObjectRecord>,
    levels: &'a [SegmentationLevel],
}

#[derive(Clone, Debug, Serialize)]
struct ObjectRecord {
    /// The file of its mask.
    mask: String,
    /// The file of its outline or its surface.
    boundary: String,
    /// In grey values of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    threshold: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    separation: Option<f64>,
    #[serde(flatten)]
    size: SizeRecord,
    /// Share of the boundary that does not lie on an edge of the image.
    off_edges: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    dice: Option<f64>,
    /// Distance of the boundary to the true one, in the length units of the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_distance_input_units: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    percentile_95_input_units: Option<f64>,
}

/// Pieces smaller than this, relative to the image, are not counted as regions.
const LEAST_REGION: f64 = 1e-3;

impl<'a, const D: usize> ImageRecord<'a, D> {
    fn new(found: &'a Found<D>) -> Self {
        let (placed, result) = (&found.placed, &found.result);
        let pieces = connected_components(&result.phase_field, 0.5).sizes;
        let least = LEAST_REGION * result.phase_field.as_slice().len() as f64;
        let weights = found.params.weights;
        let scale = placed.input.frame.scale();
        let object = found.object.as_ref().map(|object| {
            let volume = enclosed_volume(&object.outline).unwrap_or(0.0);
            let truth = object.truth.as_ref();
            let files = &placed.files;
            let extension = if D == 2 { "csv" } else { "stl" };
            ObjectRecord {
                mask: format!("{}.npy", files.mask),
                boundary: format!("{}.{extension}", files.boundary),
                threshold: object.threshold.map(|t| placed.range.number(t)),
                separation: object.separation,
                size: SizeRecord::new::<D>(volume, Some(scale)),
                off_edges: object.off_edges,
                dice: truth.map(|t| t.dice),
                mean_distance_input_units: truth.map(|t| t.distance[0] / scale),
                percentile_95_input_units: truth.map(|t| t.distance[1] / scale),
            }
        });
        Self {
            input: &placed.input,
            status: overall(result.status, result.levels.last().map(|l| l.status)),
            nodes: result.image.grid().nodes_per_axis().to_vec(),
            weights,
            energy: result.energy(),
            edge_length: result.energy().edges / weights.edges,
            regions: pieces.iter().filter(|&&n| n as f64 >= least).count(),
            object,
            levels: &result.levels,
        }
    }
}

/// The record of all images. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    config: &SegmentConfig,
    found: &'a [Found<D>],
    start: Instant,
) -> Record<'a, D> {
    let images: Vec<ImageRecord<'a, D>> = found.iter().map(ImageRecord::new).collect();
    let overlaps = images
        .iter()
        .map(|i| i.object.as_ref().and_then(|o| o.dice));
    let overlaps: Option<Vec<f64>> = overlaps.collect();
    let any = found.iter().any(|f| f.result.status == Status::Cancelled);
    let status = first_failure(images.iter().map(|image| &*image.status));
    let status = unless_cancelled(any, status);
    let numbered = found.iter().enumerate();
    let doubts = numbered.flat_map(|(i, f)| f.doubts().into_iter().map(move |d| d.about(i)));
    let names = found.iter().map(|f| &*f.placed.input.name);
    let doubts = named(&doubts.collect::<Vec<_>>(), names);
    let found = Images {
        mean_dice: overlaps
            .filter(|o| !o.is_empty())
            .map(|o| o.iter().sum::<f64>() / o.len() as f64),
        images,
    };
    Record::new(status, None, config, found, doubts, start)
}

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>) -> Summary {
    let images = &record.body.images;
    let (n, seconds) = (images.len(), record.seconds);
    let title = format!(
        "Edges of {n} image{}: {}, {seconds:.1} s",
        plural(n),
        record.state()
    );
    let mut summary = Summary::new(record, "segment.png", title);
    for image in images {
        let object = match &image.object {
            Some(ObjectRecord {
                dice: Some(dice), ..
            }) => format!("object found, Dice {dice:.4}"),
            Some(_) => "object found".into(),
            None => "no object".into(),
        };
        summary.text(format!(
            "  {}: edges of length {:.3}, {} region{}, {object}",
            image.input.path.display(),
            image.edge_length,
            image.regions,
            plural(image.regions),
        ));
    }
    if let Some(dice) = record.body.mean_dice {
        summary.line("overlap", format!("Dice {dice:.4} on average"));
    }
    summary
}
