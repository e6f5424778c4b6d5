//! The contents of `result.json` of a length.

use std::time::Instant;

use ::geodesic::{Arrival, Geodesic};
use fe_grid::Certificate;
use serde::Serialize;

use super::{LengthConfig, Outcome};
use crate::doubts::named;
use crate::geodesic::path::Path;
use crate::report::{self, CONVERGED, first_failure, overall, unless_cancelled};
use crate::shapes::{BoundaryRecord, Input, common_scale, records_of};
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<const D: usize> = report::Record<LengthConfig, Found, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found {
    /// The path through the given shapes.
    #[serde(flatten)]
    path: Measures,
    /// The steps between every two consecutive shapes.
    pieces: Vec<Piece>,
    /// The geodesic between the first and the last shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    geodesic: Option<Shortest>,
    /// Areas or volumes of all shapes.
    volumes: Vec<f64>,
    /// The worst of all steps.
    certificate: Certificate,
    #[serde(flatten)]
    coordinates: BoundaryRecord,
}

/// Length and dissipation.
#[derive(Clone, Debug, Serialize)]
struct Measures {
    /// `sum sqrt W_k`.
    length: f64,
    /// The same in the length units of the inputs: a length grows as the square root of a volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    length_input_units: Option<f64>,
    /// `N sum W_k` of all `N` steps, at least the square of the length.
    dissipation: f64,
    /// `W_k` of all steps.
    step_energies: Vec<f64>,
}

/// The geodesic between two consecutive shapes.
#[derive(Clone, Debug, Serialize)]
struct Piece {
    length: f64,
    #[serde(flatten)]
    end: PathEnd,
}

/// How a geodesic ends.
#[derive(Clone, Debug, Serialize)]
struct PathEnd {
    /// Whether the shape at its end is reached.
    end_reached: bool,
    /// Dice overlap with that shape.
    dice_end: f64,
    /// Mean distance of the boundaries there, in spacings of the grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_end: Option<f64>,
    /// How closely the boundaries agree there.
    #[serde(skip_serializing_if = "Option::is_none")]
    arrival: Option<Arrival>,
    status: String,
}

/// The geodesic for comparison.
#[derive(Clone, Debug, Serialize)]
struct Shortest {
    #[serde(flatten)]
    path: Measures,
    /// The length of the given path over that of the geodesic.
    #[serde(skip_serializing_if = "Option::is_none")]
    length_ratio: Option<f64>,
    #[serde(flatten)]
    end: PathEnd,
}

impl Measures {
    fn new(step_energies: Vec<f64>, unit: Option<f64>) -> Self {
        let length = step_energies.iter().map(|w| w.max(0.0).sqrt()).sum();
        Self {
            length,
            length_input_units: unit.map(|unit| length / unit.sqrt()),
            dissipation: step_energies.len() as f64 * step_energies.iter().sum::<f64>(),
            step_energies,
        }
    }
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<const D: usize>(
    outcome: &Outcome<D>,
    path: &Path<D>,
    coordinates: BoundaryRecord,
    start: Instant,
) -> Record<D> {
    let Outcome { inputs, given, .. } = outcome;
    // The volume of a unit cube of the inputs in the box.
    let unit = common_scale(inputs.iter().map(Input::scale)).map(|scale| scale.powi(D as i32));
    let measures = Measures::new(given.step_energies(), unit);
    let shortest = outcome.shortest.as_ref().map(|geodesic| {
        let path = Measures::new(geodesic.energy.step_energies.clone(), unit);
        let ratio = measures.length / path.length;
        Shortest {
            length_ratio: Some(ratio).filter(|ratio| ratio.is_finite()),
            path,
            end: PathEnd::of(geodesic),
        }
    });
    let piece = |geodesic: &Geodesic<D>| Piece {
        length: geodesic.length(),
        end: PathEnd::of(geodesic),
    };
    let pieces: Vec<_> = given.pieces.iter().map(piece).collect();
    let ends = pieces.iter().map(|piece| &piece.end);
    let ends = ends.chain(shortest.iter().map(|shortest| &shortest.end));
    let status = first_failure(ends.map(|end| &*end.status));
    let status = unless_cancelled(outcome.interrupted && status == CONVERGED, status);
    let found = Found {
        path: measures,
        pieces,
        geodesic: shortest,
        volumes: path.sizes.clone(),
        certificate: given.certificate(),
        coordinates,
    };
    let grid = outcome.distances[0].grid();
    let doubts = named(&outcome.doubts, inputs.iter().map(|input| &*input.name));
    Record::new(status, Some(grid), &outcome.config, found, doubts, start).of(records_of(inputs))
}

impl PathEnd {
    fn of<const D: usize>(geodesic: &Geodesic<D>) -> Self {
        let last = geodesic.levels.last().map(|level| level.info.status);
        Self {
            end_reached: geodesic.end_reached(),
            dice_end: geodesic.dice_end,
            gap_end: Some(geodesic.gap_end).filter(|gap| gap.is_finite()),
            arrival: geodesic.arrival.filter(Arrival::has_boundaries),
            status: overall(geodesic.status, last),
        }
    }
}

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<D>) -> Summary {
    let found = &record.body;
    let title = format!(
        "Path through {} shapes in {} steps on {} nodes: {}, {:.1} s",
        found.pieces.len() + 1,
        found.path.step_energies.len(),
        record.grid(),
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, "path.png", title);
    let describe = |path: &Measures| {
        format!(
            "{:.6e}, squared {:.3e}, dissipation {:.3e}",
            path.length,
            path.length * path.length,
            path.dissipation
        )
    };
    summary.line("length", describe(&found.path));
    if let Some(shortest) = &found.geodesic {
        summary.line("geodesic", describe(&shortest.path));
        if let Some(ratio) = shortest.length_ratio {
            summary.line("ratio", format!("{ratio:.4}, given path to geodesic"));
        }
    }
    summary.certificate(&found.certificate);
    summary
}
