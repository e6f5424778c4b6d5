//! The dissipation of a step under whatever law the parameters name.
//!
//! All laws are compiled here for both dimensions, once: what is generic ends at functions that
//! are not, so that crates which use geodesics do not compile every law again.

use crate::PathDissipation;
use fe_grid::{Assembly, Data, Grid, GridError};
use hyperelastic::{LawError, LawSpec, LawVisitor, StoredEnergy};
use levelset::Step;

/// The dissipation of one step of a path on its start domain; see [`PathDissipation`].
pub(crate) struct StepTerm<'a> {
    /// The law `W`.
    pub law: &'a LawSpec,
    /// The smooth indicator.
    pub indicator: Step,
    /// Stiffness of the void.
    pub void_stiffness: f64,
    /// Viscosity of the void.
    pub void_viscosity: f64,
    /// The level set of the start shape at the nodes.
    pub level_set: &'a [f64],
    /// The displacements of `psi_{k-1}` and `psi_k`, one after the other.
    pub displacements: &'a [f64],
    /// A factor of the gradient.
    pub factor: f64,
    /// What the gradient by both displacements is added to; empty where it is not wanted.
    pub gradient: &'a mut [f64],
}

impl StepTerm<'_> {
    /// The dissipation on a grid; its gradient times the factor is added.
    ///
    /// # Errors
    /// [`LawError`] where there is no such law; [`GridError::Inadmissible`] in the inner result
    /// where the density is not finite.
    pub fn add<const D: usize>(self, grid: &Grid<D>) -> Result<Result<f64, GridError>, LawError> {
        const { assert!(D == 2 || D == 3) };
        let (nodes, spacing) = (grid.nodes_per_axis(), grid.spacing());
        if D == 2 {
            match Grid::with_nodes([nodes[0], nodes[1]], spacing) {
                Ok(grid) => add_in_the_plane(self, grid),
                Err(error) => Ok(Err(error)),
            }
        } else {
            match Grid::with_nodes([nodes[0], nodes[1], nodes[D - 1]], spacing) {
                Ok(grid) => add_in_space(self, grid),
                Err(error) => Ok(Err(error)),
            }
        }
    }
}

#[inline(never)]
fn add_in_the_plane(term: StepTerm<'_>, grid: Grid<2>) -> Result<Result<f64, GridError>, LawError> {
    term.law.visit(Visitor::<2, 4> { grid, term })
}

#[inline(never)]
fn add_in_space(term: StepTerm<'_>, grid: Grid<3>) -> Result<Result<f64, GridError>, LawError> {
    term.law.visit(Visitor::<3, 6> { grid, term })
}

struct Visitor<'a, const D: usize, const M: usize> {
    grid: Grid<D>,
    term: StepTerm<'a>,
}

impl<const D: usize, const M: usize> LawVisitor<D> for Visitor<'_, D, M> {
    type Output = Result<f64, GridError>;

    fn visit<W: StoredEnergy<D>>(self, law: W) -> Self::Output {
        let law = PathDissipation {
            law,
            indicator: self.term.indicator,
            void_stiffness: self.term.void_stiffness,
            void_viscosity: self.term.void_viscosity,
        };
        let data = Data {
            coefficients: &[self.term.level_set],
            cells: &[],
        };
        let assembly = Assembly::<_, f64, D, M>::new(self.grid, &law, data);
        if self.term.gradient.is_empty() {
            assembly.value(self.term.displacements)
        } else {
            let term = self.term;
            assembly.value_and_gradient_add(term.displacements, term.factor, term.gradient)
        }
    }
}
