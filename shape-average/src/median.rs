//! The median: the sum of roots of the shapes' energies, by averages whose terms are reweighted.
//!
//! Of every shape the root is taken of all that is its own,
//! `e_i = lambda_i W_i + gamma/n (F_i - min F_i)`: a shape that cannot be deformed onto the others
//! would otherwise pull by its mismatch. Each term is `2 sqrt(e0) (sqrt(e_i + s^2) - s)` with
//! `s^2 = e0/100`, smooth at zero, and of slope about one where `e_i` is the reference `e0`.
//!
//! The root is concave: it lies below its tangent. With terms multiplied by the slopes of the roots
//! at the last average, the next average therefore lowers the sum of roots at least as much as its
//! own functional, whatever that is lowered by (majorisation and minimisation).

use crate::energy::Energy;
use crate::error::AverageError;
use crate::hierarchy::{Levels, solve_levels};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean};
use crate::quiet::Quiet;
use crate::result::AverageResult;
use fe_grid::composition::{Interpolant, Matching};
use fe_grid::minimise::{Observer, Status};
use fe_grid::{Assembly, Data, Field, GridError};
use phasefield::{LeastMismatch, Seen};
use std::time::Instant;

/// Smoothing at zero: `s^2` as a share of the reference energy.
const SMOOTHING: f64 = 0.01;
/// Least reference energy: that of a strain of a thousandth.
const LEAST_REFERENCE: f64 = 1e-6;
/// Most rounds after the first.
const ROUNDS: usize = 30;
/// Rounds end when the sum of roots falls by less than this share of what it can fall by: all but
/// the floors and the length.
const TOLERANCE: f64 = 1e-3;

/// A sum of roots.
struct Roots {
    /// `e0`.
    reference: f64,
    /// `min F_i`.
    floors: Vec<f64>,
    /// `lambda_i`.
    weights: Vec<f64>,
    /// `gamma / n`.
    mismatch: f64,
}

impl Roots {
    /// The energies `e_i` of the shapes.
    fn energies(&self, energy: &Energy) -> Vec<f64> {
        let own = |i: usize| {
            let excess = (energy.mismatch[i] - self.floors[i]).max(0.0);
            self.weights[i] * energy.elastic[i] + self.mismatch * excess
        };
        (0..self.floors.len()).map(own).collect()
    }

    /// `sum_i 2 sqrt(e0) (sqrt(e_i + s^2) - s)`, the floors and the length.
    fn total(&self, energy: &Energy) -> f64 {
        let smoothing = SMOOTHING * self.reference;
        let root = |e: f64| {
            // The difference of the roots, without cancellation.
            2.0 * self.reference.sqrt() * e / ((e + smoothing).sqrt() + smoothing.sqrt())
        };
        let roots: f64 = self.energies(energy).into_iter().map(root).sum();
        roots + self.floor(energy)
    }

    /// What does not come from the roots: the floors, and the length.
    fn floor(&self, energy: &Energy) -> f64 {
        self.mismatch * self.floors.iter().sum::<f64>() + energy.parts[2]
    }

    fn excess(&self, total: f64, energy: &Energy) -> f64 {
        total - self.floor(energy)
    }

    /// The slopes of the terms.
    fn slopes(&self, energy: &Energy) -> Vec<f64> {
        let smoothing = SMOOTHING * self.reference;
        let slope = |e: f64| (self.reference / (e + smoothing)).sqrt();
        self.energies(energy).into_iter().map(slope).collect()
    }
}

/// The median of shapes.
///
/// # Errors
/// Those of the average.
pub(crate) fn solve<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    levels: Vec<LevelShapes<D>>,
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let arithmetic = AverageParams {
        mean: Mean::Arithmetic,
        ..params.clone()
    };
    let finest: Vec<LevelShapes<D>> = levels.last().cloned().into_iter().collect();
    let mut roots = Roots {
        reference: 1.0,
        floors: finest
            .iter()
            .map(floors)
            .collect::<Result<Vec<_>, _>>()?
            .concat(),
        weights: params.resolved_weights(signed_distances.len()),
        mismatch: params.mismatch_weight / signed_distances.len() as f64,
    };
    let problem = Levels::new(levels.clone(), &arithmetic).from(known);
    let plain = solve_levels(signed_distances, problem, start, &mut Quiet(observer))?;
    if cancelled(&plain) {
        return Ok(plain);
    }
    let mut energies = roots.energies(&plain.energy);
    energies.sort_unstable_by(f64::total_cmp);
    // Shapes that are all the same have no energy to refer to, and any will do.
    let middle = energies[energies.len() / 2].max(LEAST_REFERENCE);
    roots.reference = params.median_reference.unwrap_or(middle);
    // The first round begins on the coarsest level again: what the outliers have done to the mean
    // may be far from the median.
    let problem = Levels::new(levels, &arithmetic)
        .shared(roots.slopes(&plain.energy))
        .from(known);
    let mut found = solve_levels(signed_distances, problem, start, observer)?;
    found.rounds.push(roots.total(&plain.energy));
    found.rounds.push(roots.total(&found.energy));
    if found.rounds[1] > found.rounds[0] && !cancelled(&found) {
        // Coarse levels led elsewhere: then it goes on from the mean.
        let (rounds, mean) = (vec![found.rounds[0]], plain);
        found = round(
            signed_distances,
            &finest,
            &arithmetic,
            &roots,
            &mean,
            observer,
        )?;
        found.rounds = [rounds, found.rounds].concat();
    }
    for _ in 0..ROUNDS {
        let rounds = found.rounds.as_slice();
        let (before, last) = (rounds[rounds.len() - 2], rounds[rounds.len() - 1]);
        if cancelled(&found) || before - last <= TOLERANCE * roots.excess(last, &found.energy) {
            break;
        }
        let (rounds, mut reports) = (found.rounds.clone(), found.levels.clone());
        let next = round(
            signed_distances,
            &finest,
            &arithmetic,
            &roots,
            &found,
            observer,
        )?;
        reports.extend(next.levels.clone());
        found = next;
        found.rounds = [rounds, found.rounds].concat();
        found.levels = reports;
    }
    found.energy.total = roots.total(&found.energy);
    found.seconds = start.elapsed().as_secs_f64();
    Ok(found)
}

/// One more average on the finest level, with the slopes at the last one; its rounds hold its own
/// sum of roots alone.
fn round<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    finest: &[LevelShapes<D>],
    params: &AverageParams,
    roots: &Roots,
    last: &AverageResult<D>,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let problem = Levels::new(finest.to_vec(), params)
        .shared(roots.slopes(&last.energy))
        .from(&last.displacements);
    let quiet = &mut Quiet(observer);
    let mut next = solve_levels(signed_distances, problem, Instant::now(), quiet)?;
    next.rounds.push(roots.total(&next.energy));
    Ok(next)
}

fn cancelled<const D: usize>(result: &AverageResult<D>) -> bool {
    let last = result.levels.last();
    last.is_some_and(|level| level.status == Status::Cancelled)
}

/// The least mismatch that each shape can have with any field at all.
fn floors<const D: usize>(shapes: &LevelShapes<D>) -> Result<Vec<f64>, GridError> {
    let grid = *shapes.grid();
    let rest = vec![0.0; D * grid.n_nodes()];
    let density = LeastMismatch {
        interface_width: shapes.interface_width(),
    };
    let floor = |i: usize| {
        let coefficients = shapes.match_coefficients(i);
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let field = Interpolant::new(grid, shapes.phase_fields[i].as_slice());
        if shapes.seen().is_empty() {
            Assembly::new(grid, &Matching::new(density, field), data).value(&rest)
        } else {
            Assembly::new(grid, &Matching::new(Seen(density), field), data).value(&rest)
        }
    };
    (0..shapes.n_shapes()).map(floor).collect()
}
