//! Paths of other numbers of steps as starts.

use super::objective::PathObjective;
use super::starts::refine_time;
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use fe_grid::minimise::Evaluation;
use fe_grid::{Field, ScalarField};

/// Shares of the way to the next deformation that are tried, relative to the one by time.
const SHARES: [f64; 3] = [1.0, 0.5, 0.0];

/// Displacements of the deformations of a shape in so many steps, interpolated in time, one after the other.
///
/// Between deformations that press parts together, or turn them, the mean of both may fold, or have an energy that is far
/// above those of the steps, from which a minimiser ends in another valley. Of the shares of the way from one to the
/// next, down to none, the one with the least energy of both parts is taken; none has that of the whole step.
pub(super) fn in_steps<const D: usize>(
    own: &ScalarField<f64, D>,
    motions: &[Field<f64, D, D>],
    held: bool,
    params: &GeodesicParams,
) -> Result<Vec<f64>, GeodesicError> {
    let (dim, first) = (D * own.grid().n_nodes(), usize::from(held));
    let (steps, count) = (motions.len() - 1 + first, params.steps);
    let known: Vec<f64> = motions.iter().flat_map(Field::as_slice).copied().collect();
    let mut refined = refine_time(&known, dim, [steps, count], held);
    let at_rest = vec![0.0; dim];
    let motion = |k: usize| match k.checked_sub(first) {
        Some(k) => motions[k].as_slice(),
        None => &at_rest,
    };
    let ends = [own.clone(), own.clone()];
    let mut two_steps = PathObjective::of_middle(own.clone(), ends, 2, params)?;
    for (k, u) in refined.chunks_exact_mut(dim).enumerate() {
        let (before, part) = ((k + first) * steps / count, (k + first) * steps % count);
        if part == 0 {
            continue;
        }
        let [from, to] = [motion(before), motion(before + 1)];
        let mut least = f64::INFINITY;
        for share in SHARES.map(|share| share * part as f64 / count as f64) {
            let between = from
                .iter()
                .zip(to)
                .map(|(from, to)| from + share * (to - from));
            let between: Vec<f64> = between.collect();
            let found = two_steps.evaluate(&[from, &between, to].concat(), &mut [])?;
            let energy = match found {
                Evaluation::Inadmissible => f64::INFINITY,
                Evaluation::Value(_) => two_steps.energy().step_energies.iter().sum(),
            };
            if energy < least {
                least = energy;
                u.copy_from_slice(&between);
            }
        }
    }
    Ok(refined)
}
