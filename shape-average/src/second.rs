//! A level that is minimised again, from deformations that are better than those in which it ended.

use crate::confirm::View;
use crate::error::AverageError;
use crate::objective::AverageObjective;
use fe_grid::minimise::{Info, LbfgsParams, Minimiser, Observer, Status};

/// Deformations with which a level is minimised again.
pub(crate) trait SecondDeformations<const D: usize> {
    /// Replaces deformations by others with a smaller energy; returns whether there are any. Collective.
    ///
    /// # Errors
    /// Those of the computations.
    fn improve(
        &self,
        objective: &mut AverageObjective<D>,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<bool, AverageError>;
}

/// Minimises, and again if there are second deformations.
///
/// # Errors
/// Those of the minimiser and of the second deformations.
pub(crate) fn minimise_again<const D: usize>(
    params: &LbfgsParams,
    objective: &mut AverageObjective<D>,
    x: &mut [f64],
    second: &dyn SecondDeformations<D>,
    observer: &mut dyn Observer,
) -> Result<Info, AverageError> {
    let first = params.minimise(objective, x, observer)?;
    let goes_on = first.status.converged() || first.status == Status::LineSearchFailed;
    if !goes_on || !second.improve(objective, x, observer)? {
        return Ok(first);
    }
    let resumed = observer.resume();
    let mut later = View {
        observer,
        resumed,
        offset: first.energies.len(),
    };
    let second = params.minimise(objective, x, &mut later)?;
    Ok(joined(first, &second))
}

/// The record of both minimisations; that between them counts as a step.
fn joined(first: Info, second: &Info) -> Info {
    let mut energies = first.energies;
    energies.extend(&second.energies);
    let mut evaluations = first.evaluations;
    evaluations += second.evaluations;
    Info {
        status: second.status,
        iterations: energies.len().saturating_sub(1),
        evaluations,
        energies,
        first_gradient_norm: first.first_gradient_norm,
        gradient_norm: second.gradient_norm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_between_two_minimisations_counts_as_one() {
        let info = |energies: &[f64], status| Info {
            status,
            iterations: energies.len() - 1,
            evaluations: fe_grid::minimise::Evaluations {
                gradients: 2,
                ..Default::default()
            },
            energies: energies.to_vec(),
            first_gradient_norm: energies[0],
            gradient_norm: 0.0,
        };
        let first = info(&[9.0, 7.0], Status::LineSearchFailed);
        let both = joined(first, &info(&[5.0, 4.0, 3.0], Status::EnergyTolerance));
        assert_eq!(both.energies, [9.0, 7.0, 5.0, 4.0, 3.0]);
        assert_eq!((both.iterations, both.evaluations.gradients), (4, 4));
        assert_eq!(both.status, Status::EnergyTolerance);
        assert_eq!(both.first_gradient_norm, 9.0);
    }
}
