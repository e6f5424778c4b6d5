//! The energies of a step of a path.
//!
//! Their kernels are compiled once in this crate for both dimensions; they call the law through a
//! pointer.

use crate::cells::ObjectWeights;
use crate::deformation::StepDeformation;
use crate::dissipation::PathDissipation;
use fe_grid::dimension::{self, Routine};
use fe_grid::{Assembly, Data, Grid, GridError};
use hyperelastic::{CompiledLaw, StrainEnergy};
use std::marker::PhantomData;

/// The kind of energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// [`PathDissipation`]: unknowns are the displacements of `psi_{k-1}` and `psi_k`.
    Path,
    /// [`StepDeformation`]: unknowns are the level set and the displacement of `phi_k`.
    Step,
}

/// The energy of one step of a path.
pub(crate) struct StepTerm<'a, const D: usize> {
    /// The kind of energy.
    pub kind: Kind,
    /// The law `W`.
    pub law: &'a CompiledLaw<D>,
    /// The weights of object and void.
    pub weights: ObjectWeights,
    /// The level set of the start shape at the nodes; [`Kind::Path`] only.
    pub level_set: &'a [f64],
    /// The unknowns, one after the other.
    pub state: &'a [f64],
    /// Factor of the gradient.
    pub factor: f64,
    /// Array that the gradient with respect to the unknowns is added to; empty if it is not needed.
    pub gradient: &'a mut [f64],
}

impl<const D: usize> StepTerm<'_, D> {
    /// Computes the energy on a grid and adds its gradient times the factor.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite.
    pub fn add(self, grid: &Grid<D>) -> Result<f64, GridError> {
        dimension::run::<Steps<'_>, D>((self, *grid))
    }
}

/// The numbers of components of both energies, `D + 1` and `2 D`, have to be literals.
struct Steps<'a>(PhantomData<&'a ()>);

impl<'a> Routine for Steps<'a> {
    type Arguments<const D: usize> = (StepTerm<'a, D>, Grid<D>);
    type Output<const D: usize> = Result<f64, GridError>;

    #[inline(never)]
    fn in_the_plane((term, grid): Self::Arguments<2>) -> Self::Output<2> {
        evaluate::<2, 3, 4>(term, grid)
    }

    #[inline(never)]
    fn in_space((term, grid): Self::Arguments<3>) -> Self::Output<3> {
        evaluate::<3, 4, 6>(term, grid)
    }
}

/// Evaluates one of the energies, of `S = D + 1` or `P = 2 D` components.
fn evaluate<const D: usize, const S: usize, const P: usize>(
    term: StepTerm<'_, D>,
    grid: Grid<D>,
) -> Result<f64, GridError> {
    let StepTerm {
        kind,
        law,
        weights,
        level_set,
        state,
        factor,
        gradient,
    } = term;
    match kind {
        Kind::Path => {
            let law = StrainEnergy(PathDissipation { law, weights });
            let data = Data {
                coefficients: &[level_set],
                cells: &[],
            };
            let assembly = Assembly::<_, f64, D, P>::new(grid, &law, data);
            assembly.value_or_gradient_add(state, factor, gradient)
        }
        Kind::Step => {
            let law = StrainEnergy(StepDeformation { law, weights });
            let assembly = Assembly::<_, f64, D, S>::new(grid, &law, Data::default());
            assembly.value_or_gradient_add(state, factor, gradient)
        }
    }
}
