//! The contents of `result.json`, and the closing words. What does not exist is left out.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;
use shape_average::joint::{JointEnergy, JointLevel, spread};

use super::Outcome;
use super::plan::Parameters;
use crate::input::GreyRange;
use crate::input::place::FrameTransform;
use crate::report::{CANCELLED, CertificateRecord, name, overall, peak_memory};

/// Everything in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResultRecord<const D: usize> {
    version: &'static str,
    status: &'static str,
    dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    nodes: Vec<usize>,
    images: Vec<ImageRecord<D>>,
    parameters: Parameters,
    energy: EnergyRecord,
    levels: Vec<LevelRecord>,
    certificate: CertificateRecord,
    /// Standard deviation of the images about their mean, averaged over the box: as they are, and
    /// brought onto each other.
    spread_before: f64,
    spread_after: f64,
    seconds: f64,
    /// Of these, the minimisation.
    solver_seconds: f64,
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
}

/// The terms of the energy. Those of the shapes are without weights, those of the images with
/// theirs.
#[derive(Clone, Debug, Serialize)]
struct EnergyRecord {
    total: f64,
    elastic: Vec<f64>,
    mismatch: Vec<f64>,
    length: f64,
    fidelity: Vec<f64>,
    smoothness: Vec<f64>,
    edges: Vec<f64>,
}

impl From<&JointEnergy> for EnergyRecord {
    fn from(energy: &JointEnergy) -> Self {
        let images = &energy.images;
        Self {
            total: energy.total,
            elastic: energy.shapes.elastic.clone(),
            mismatch: energy.shapes.mismatch.clone(),
            length: energy.shapes.length,
            fidelity: images.iter().map(|i| i.fidelity).collect(),
            smoothness: images.iter().map(|i| i.smoothness).collect(),
            edges: images.iter().map(|i| i.edges).collect(),
        }
    }
}

#[derive(Clone, Debug, Serialize)]
struct LevelRecord {
    nodes: Vec<usize>,
    interface_width: f64,
    status: &'static str,
    rounds: usize,
    /// Accepted steps of the deformations.
    steps: usize,
    /// Iterations of conjugate gradients for the images, and for the phase fields.
    system_iterations: [usize; 2],
    /// After the first deformation, and then after every half of a round.
    energies: Vec<f64>,
    energy: EnergyRecord,
    certificate: CertificateRecord,
    seconds: f64,
}

impl From<&JointLevel> for LevelRecord {
    fn from(level: &JointLevel) -> Self {
        Self {
            nodes: level.nodes.clone(),
            interface_width: level.interface_width,
            status: name(level.status),
            rounds: level.rounds,
            steps: level.steps,
            system_iterations: level.system_iterations,
            energies: level.energies.clone(),
            energy: EnergyRecord::from(&level.energy),
            certificate: CertificateRecord::new(&level.certificate),
            seconds: level.seconds,
        }
    }
}

impl<const D: usize> ResultRecord<D> {
    /// The record of an outcome. The time is that until now.
    pub fn new(outcome: &Outcome<D>) -> Self {
        let result = &outcome.result;
        let last = result.levels.last().map(|level| level.status);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: overall(result.status, last),
            dimension: D,
            nodes: result.average.grid().nodes_per_axis().to_vec(),
            images: outcome
                .images
                .iter()
                .map(|image| ImageRecord {
                    path: image.path.clone(),
                    size: image.size.to_vec(),
                    grey: image.range,
                    frame: image.frame,
                })
                .collect(),
            parameters: outcome.parameters.clone(),
            energy: EnergyRecord::from(&result.energy()),
            levels: result.levels.iter().map(LevelRecord::from).collect(),
            certificate: CertificateRecord::new(&result.certificate),
            spread_before: spread(&result.images),
            spread_after: spread(&result.pushed),
            seconds: outcome.start.elapsed().as_secs_f64(),
            solver_seconds: result.seconds,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Whether the user stopped the minimisation.
    pub fn cancelled(&self) -> bool {
        self.status == CANCELLED
    }

    /// Prints a short summary; the last line names the picture.
    pub fn print(&self, target: &Path) {
        let nodes: Vec<String> = self.nodes.iter().map(ToString::to_string).collect();
        let rounds: usize = self.levels.iter().map(|level| level.rounds).sum();
        let file = |name: &str| target.join(name).display().to_string();
        let text = format!(
            "Edges of {} images and their average on {} nodes: {} after {rounds} rounds, {:.1} s\n  \
             energy       {:.6e}\n  \
             images       differ by {:.4} as they are, by {:.4} brought onto each other\n  \
             deformation  {}, determinant at least {:.3e}\n  \
             results      {}\n  \
             picture      {}\n",
            self.images.len(),
            nodes.join(" x "),
            self.status.replace('_', " "),
            self.seconds,
            self.energy.total,
            self.spread_before,
            self.spread_after,
            self.certificate.words(),
            self.certificate.min_det,
            file("result.json"),
            file("average.png"),
        );
        // Nobody is left to be told where standard output is closed.
        let _ = std::io::stdout().write_all(text.as_bytes());
    }
}
