//! The median: minimises the sum of square roots of the shapes' energies by iteratively reweighted
//! averages.
//!
//! The root is taken of all terms of a shape, `e_i = lambda_i W_i + gamma/n (F_i - min F_i)`,
//! including the mismatch: otherwise a shape that cannot be deformed onto the others would still
//! attract the average through its mismatch. Each term is `2 sqrt(e0) (sqrt(e_i + s^2) - s)` with
//! `s^2 = e0/100`, smooth at zero, and with slope about one where `e_i` equals the reference `e0`.
//!
//! The root is concave, hence bounded by its tangent. If the terms are multiplied by the slopes of
//! the roots at the last average, the next average decreases the sum of roots at least as much as
//! its own functional, for any minimiser (majorisation-minimisation).

use crate::energy::Energy;
use crate::error::AverageError;
use crate::floor::{energies_above, floors};
use crate::hierarchy::{Levels, solve_levels};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean};
use crate::quiet::Quiet;
use crate::reached::Reached;
use crate::result::AverageResult;
use crate::shapes::Shapes;
use fe_grid::minimise::Observer;
use fe_grid::{Field, mutant};
use std::time::Instant;

/// Smoothing at zero: `s^2` as a fraction of the reference energy.
const SMOOTHING: f64 = 0.01;
/// Lower bound of the reference energy, relative to the shear modulus: that of a strain of 0.001.
const LEAST_REFERENCE: f64 = 1e-6;
/// Maximal number of iterations after the first.
const ROUNDS: usize = 30;
/// The iteration ends when the sum of roots decreases by less than this fraction of its reducible
/// part, which excludes the floors and the length.
const TOLERANCE: f64 = 1e-3;

/// Data of the sum of roots.
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
    /// Returns the energies `e_i` of the shapes.
    fn energies(&self, energy: &Energy) -> Vec<f64> {
        energies_above(&self.floors, &self.weights, self.mismatch, energy)
    }

    /// Returns the sum of `2 sqrt(e0) (sqrt(e_i + s^2) - s)`, the floors and the length.
    fn total(&self, energy: &Energy) -> f64 {
        let smoothing = SMOOTHING * self.reference;
        let root = |e: f64| {
            // The difference of the roots, evaluated without cancellation.
            2.0 * self.reference.sqrt() * e / ((e + smoothing).sqrt() + smoothing.sqrt())
        };
        let roots: f64 = self.energies(energy).into_iter().map(root).sum();
        roots + self.floor(energy)
    }

    /// Returns the part of the total without the roots: the floors and the length.
    fn floor(&self, energy: &Energy) -> f64 {
        self.mismatch * self.floors.iter().sum::<f64>() + energy.parts[2]
    }

    fn excess(&self, total: f64, energy: &Energy) -> f64 {
        total - self.floor(energy)
    }

    /// Returns the slopes of the terms.
    fn slopes(&self, energy: &Energy) -> Vec<f64> {
        let smoothing = SMOOTHING * self.reference;
        let slope = |e: f64| {
            let ratio = self.reference / (e + smoothing);
            mutant!(ratio.sqrt(), MedianSlope => ratio)
        };
        self.energies(energy).into_iter().map(slope).collect()
    }
}

/// Computes the median of shapes.
///
/// # Errors
/// Those of the average.
pub(crate) fn solve<const D: usize>(
    shapes: Shapes<'_, D>,
    levels: Vec<LevelShapes<D>>,
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<Option<AverageResult<D>>, AverageError> {
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
        weights: params.resolved_weights(shapes.len()),
        mismatch: params.mismatch_weight / shapes.len() as f64,
    };
    let known: Vec<&[f64]> = known.iter().map(Field::as_slice).collect();
    let problem = Levels::new(levels.clone(), &arithmetic).from(known.clone());
    let plain = solve_levels(problem, &mut Quiet(observer))?;
    if plain.cancelled() {
        return plain.into_result(shapes, start);
    }
    let mut energies = roots.energies(&plain.energy());
    energies.sort_unstable_by(f64::total_cmp);
    // Identical shapes have zero energy; any reference will do.
    let middle = energies[energies.len() / 2].max(LEAST_REFERENCE * params.law.moduli.mu);
    roots.reference = params.median_reference.unwrap_or(middle);
    // The first iteration restarts on the coarsest level, as outliers may have moved the mean far
    // from the median.
    let problem = Levels::new(levels, &arithmetic)
        .shared(roots.slopes(&plain.energy()))
        .from(known);
    let mut found = solve_levels(problem, observer)?;
    let [mean, first] = [&plain, &found].map(|minimum| roots.total(&minimum.energy()));
    let mut rounds = vec![mean, first];
    if first > mean && !found.cancelled() {
        // The coarse levels led to a worse minimum: the iteration continues from the mean.
        found = round(&finest, &arithmetic, &roots, &plain, observer)?;
        rounds[1] = roots.total(&found.energy());
    }
    // The vectors of the mean are not needed any more.
    drop(plain);
    for _ in 0..ROUNDS {
        let (before, last) = (rounds[rounds.len() - 2], rounds[rounds.len() - 1]);
        if found.cancelled() || before - last <= TOLERANCE * roots.excess(last, &found.energy()) {
            break;
        }
        let mut next = round(&finest, &arithmetic, &roots, &found, observer)?;
        rounds.push(roots.total(&next.energy()));
        let mut reports = std::mem::take(&mut found.reports);
        reports.append(&mut next.reports);
        next.reports = reports;
        found = next;
    }
    let total = roots.total(&found.energy());
    let result = found.into_result(shapes, start)?;
    Ok(result.map(|mut result| {
        result.energy.total = total;
        result.rounds = rounds;
        result
    }))
}

/// Computes one more average on the finest level, weighted by the slopes at the last one.
fn round<const D: usize>(
    finest: &[LevelShapes<D>],
    params: &AverageParams,
    roots: &Roots,
    last: &Reached<D>,
    observer: &mut dyn Observer,
) -> Result<Reached<D>, AverageError> {
    let problem = Levels::new(finest.to_vec(), params)
        .shared(roots.slopes(&last.energy()))
        .from(last.displacements());
    solve_levels(problem, &mut Quiet(observer))
}
