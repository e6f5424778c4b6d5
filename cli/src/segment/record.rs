//! The contents of `result.json`, and the closing words. What does not exist is left out.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use fe_grid::minimise::Status;
use levelset::{Moments, connected_components};
use phasefield::segmentation::{SegmentationEnergy, SegmentationLevel};
use serde::Serialize;

use super::compute::Found;
use super::plan::Parameters;
use crate::input::GreyRange;
use crate::input::place::FrameTransform;
use crate::report::{CANCELLED, name, overall, peak_memory};
use crate::shapes::SizeRecord;

/// Everything in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResultRecord<const D: usize> {
    version: &'static str,
    status: &'static str,
    dimension: usize,
    parameters: Parameters,
    images: Vec<ImageRecord<D>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_dice: Option<f64>,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
}

#[derive(Clone, Debug, Serialize)]
struct ImageRecord<const D: usize> {
    path: String,
    /// Samples along each axis, `x` first.
    size: Vec<usize>,
    /// The numbers of the file that are 0 and 1 here.
    grey: GreyRange,
    frame: FrameTransform<D>,
    status: &'static str,
    /// Nodes along each axis of the arrays, `x` first.
    nodes: Vec<usize>,
    weights: WeightsRecord,
    energy: EnergyRecord,
    /// Length (area) of the edges, which the phase field measures, in the unit box.
    edge_length: f64,
    /// Connected pieces that the edges leave, of a thousandth of the image or more.
    regions: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<ObjectRecord>,
    levels: Vec<LevelRecord>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct WeightsRecord {
    fidelity: f64,
    smoothness: f64,
    edges: f64,
}

/// The terms of the energy, with their weights.
#[derive(Clone, Copy, Debug, Serialize)]
struct EnergyRecord {
    total: f64,
    fidelity: f64,
    smoothness: f64,
    edges: f64,
}

impl From<SegmentationEnergy> for EnergyRecord {
    fn from(energy: SegmentationEnergy) -> Self {
        Self {
            total: energy.total,
            fidelity: energy.fidelity,
            smoothness: energy.smoothness,
            edges: energy.edges,
        }
    }
}

#[derive(Clone, Debug, Serialize)]
struct ObjectRecord {
    /// In the numbers of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    threshold: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    separation: Option<f64>,
    #[serde(flatten)]
    size: SizeRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    dice: Option<f64>,
    /// Distance of the boundary to the true one, in the length units of the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_distance_input_units: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    percentile_95_input_units: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
struct LevelRecord {
    nodes: Vec<usize>,
    interface_width: f64,
    edge_conductance: f64,
    status: &'static str,
    iterations: usize,
    /// Iterations of conjugate gradients for the image, and for the phase field.
    system_iterations: [usize; 2],
    energy: EnergyRecord,
    /// Whether no alternation raised the energy.
    monotone: bool,
    seconds: f64,
}

impl From<&SegmentationLevel> for LevelRecord {
    fn from(level: &SegmentationLevel) -> Self {
        Self {
            nodes: level.nodes.clone(),
            interface_width: level.interface_width,
            edge_conductance: level.edge_conductance,
            status: name(level.status),
            iterations: level.iterations,
            system_iterations: level.system_iterations,
            energy: level.energy.into(),
            monotone: level.energies.windows(2).all(|w| w[1] <= w[0]),
            seconds: level.seconds,
        }
    }
}

/// Pieces smaller than this share of the image are no regions.
const LEAST_REGION: f64 = 1e-3;

impl<const D: usize> ImageRecord<D> {
    fn new(found: &Found<D>) -> Self {
        let (placed, result) = (&found.placed, &found.result);
        let pieces = connected_components(&result.phase_field, 0.5).sizes;
        let least = LEAST_REGION * result.phase_field.as_slice().len() as f64;
        let weights = found.params.weights;
        let scale = placed.frame.scale();
        let object = found.object.as_ref().map(|object| {
            let volume = Moments::of_contour(&object.outline).map_or(0.0, |m| m.volume);
            let truth = object.truth.as_ref();
            ObjectRecord {
                threshold: object.threshold.map(|t| placed.range.number(t)),
                separation: object.separation,
                size: SizeRecord::new::<D>(volume, Some(scale)),
                dice: truth.map(|t| t.dice),
                mean_distance_input_units: truth.map(|t| t.distance[0] / scale),
                percentile_95_input_units: truth.map(|t| t.distance[1] / scale),
            }
        });
        Self {
            path: placed.image.path.display().to_string(),
            size: placed.image.size.to_vec(),
            grey: placed.range,
            frame: placed.frame,
            status: overall(result.status, result.levels.last().map(|l| l.status)),
            nodes: result.image.grid().nodes_per_axis().to_vec(),
            weights: WeightsRecord {
                fidelity: weights.fidelity,
                smoothness: weights.smoothness,
                edges: weights.edges,
            },
            energy: result.energy().into(),
            edge_length: result.energy().edges / weights.edges,
            regions: pieces.iter().filter(|&&n| n as f64 >= least).count(),
            object,
            levels: result.levels.iter().map(LevelRecord::from).collect(),
        }
    }
}

impl<const D: usize> ResultRecord<D> {
    /// The record of all images. The time is that until now.
    pub fn new(parameters: &Parameters, found: &[Found<D>], start: Instant) -> Self {
        let images: Vec<ImageRecord<D>> = found.iter().map(ImageRecord::new).collect();
        let overlaps = images
            .iter()
            .map(|i| i.object.as_ref().and_then(|o| o.dice));
        let overlaps: Option<Vec<f64>> = overlaps.collect();
        let bad = images.iter().map(|i| i.status).find(|s| *s != "converged");
        let any = found.iter().any(|f| f.result.status == Status::Cancelled);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: if any {
                CANCELLED
            } else {
                bad.unwrap_or("converged")
            },
            dimension: D,
            parameters: parameters.clone(),
            mean_dice: overlaps
                .filter(|o| !o.is_empty())
                .map(|o| o.iter().sum::<f64>() / o.len() as f64),
            images,
            seconds: start.elapsed().as_secs_f64(),
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Whether the user stopped the computation.
    pub fn cancelled(&self) -> bool {
        self.status == CANCELLED
    }

    /// Prints a short summary; the last line names the picture.
    pub fn print(&self, target: &Path) {
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = self.write_lines(&mut text, target);
        // Nobody is left to be told where standard output is closed.
        let _ = std::io::stdout().write_all(text.as_bytes());
    }

    fn write_lines(&self, text: &mut String, target: &Path) -> std::fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        let (n, status) = (self.images.len(), self.status.replace('_', " "));
        let seconds = self.seconds;
        writeln!(
            text,
            "Edges of {n} image{}: {status}, {seconds:.1} s",
            plural(n)
        )?;
        for image in &self.images {
            let object = match &image.object {
                Some(ObjectRecord {
                    dice: Some(dice), ..
                }) => format!("object found, Dice {dice:.4}"),
                Some(_) => "object found".into(),
                None => "no object".into(),
            };
            writeln!(
                text,
                "  {}: edges of length {:.3}, {} region{}, {object}",
                image.path,
                image.edge_length,
                image.regions,
                plural(image.regions),
            )?;
        }
        if let Some(dice) = self.mean_dice {
            writeln!(text, "  overlap      Dice {dice:.4} on average")?;
        }
        let file = |name: &str| target.join(name).display().to_string();
        writeln!(text, "  results      {}", file("result.json"))?;
        writeln!(text, "  picture      {}", file("segment.png"))
    }
}
