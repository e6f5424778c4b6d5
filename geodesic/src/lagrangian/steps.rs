//! Paths of other numbers of steps as starts.

use super::objective::PathObjective;
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use fe_grid::minimise::Evaluation;
use fe_grid::{Field, ScalarField};

/// Shares of the way to the next deformation that are tried, relative to the one by time.
const SHARES: [f64; 3] = [1.0, 0.5, 0.0];

/// A time between two known deformations: the number of the one before, and the share of the way to the next.
pub(crate) type Between = (usize, f64);

/// The times of so many steps of equal length among known deformations, from the first that is not held on.
pub(super) fn evenly(known: usize, steps: usize, held: bool) -> Vec<Between> {
    let first = usize::from(held);
    let time = |k: usize| (k * known / steps, (k * known % steps) as f64 / steps as f64);
    (first..=steps).map(time).collect()
}

/// Displacements of the deformations of a shape at some times, one after the other.
///
/// Between deformations that press parts together, or turn them, the mean of both may fold, or have an energy that is far
/// above those of the steps, from which a minimiser ends in another valley. Of the shares of the way from one to the
/// next, down to none, the one with the least energy of both parts is taken; none has that of the whole step.
pub(super) fn in_steps<const D: usize>(
    own: &ScalarField<f64, D>,
    motions: &[Field<f64, D, D>],
    times: &[Between],
    held: bool,
    params: &GeodesicParams,
) -> Result<Vec<f64>, GeodesicError> {
    let (dim, first) = (D * own.grid().n_nodes(), usize::from(held));
    let at_rest = vec![0.0; dim];
    let motion = |k: usize| match k.checked_sub(first) {
        Some(k) => motions[k].as_slice(),
        None => &at_rest,
    };
    let ends = [own.clone(), own.clone()];
    let mut two_steps = PathObjective::of_middle(own.clone(), ends, 2, params)?;
    let mut found = Vec::with_capacity(times.len() * dim);
    for &(before, part) in times {
        let from = motion(before);
        if part == 0.0 {
            found.extend_from_slice(from);
            continue;
        }
        let to = motion(before + 1);
        let at = |share: f64| -> Vec<f64> {
            let both = from.iter().zip(to);
            both.map(|(from, to)| from + share * (to - from)).collect()
        };
        let (mut least, mut best) = (f64::INFINITY, None);
        for share in SHARES.map(|share| share * part) {
            let between = at(share);
            let energy = match two_steps.evaluate(&[from, &between, to].concat(), &mut [])? {
                Evaluation::Inadmissible => f64::INFINITY,
                Evaluation::Value(_) => two_steps.energy().step_energies.iter().sum(),
            };
            if energy < least {
                (least, best) = (energy, Some(between));
            }
        }
        found.extend(best.unwrap_or_else(|| at(part)));
    }
    Ok(found)
}
