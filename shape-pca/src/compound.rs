//! The energy of all deformations as a function of a further one, under whatever law is asked for.
//!
//! All laws are compiled here for both dimensions, once: what is generic ends at two functions
//! that are not, so that crates which use this one do not compile every law again.

use crate::error::PcaError;
use fe_grid::pullback::{Derivatives, Pullback, PullbackSource, pull_back};
use fe_grid::{Grid, GridError};
use hyperelastic::{LawSpec, LawVisitor, StoredEnergy, WeightedElasticity};
use std::any::Any;

/// One deformation with its weight and the indicator of its object.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Factor of the energy.
    pub weight: f64,
    /// Displacement, component by component.
    pub displacement: &'a [f64],
    /// Indicator of the object at the nodes.
    pub indicator: &'a [f64],
}

/// `u -> sum_i c_i int ((1 - delta) chi_i + delta) W(D((1 + u) o phi_i))` at a displacement (zero
/// where it is empty), with derivatives; see [`fe_grid::pullback`]. At zero the gradient of one
/// source is the load of its Cauchy stress, `int sigma : Dw`, and the Hessian is the compound
/// operator.
///
/// # Errors
/// [`PcaError::Law`] where there is no such law, [`GridError::Inadmissible`] where the composed
/// deformation folds.
///
/// # Panics
/// If sources or state do not fit the grid.
pub fn evaluate<const D: usize>(
    grid: &Grid<D>,
    law: &LawSpec,
    void_stiffness: f64,
    sources: &[Source<'_>],
    state: &[f64],
    derivatives: Derivatives,
) -> Result<Pullback<D>, PcaError> {
    const { assert!(D == 2 || D == 3) };
    let (nodes, spacing) = (grid.nodes_per_axis(), grid.spacing());
    let task = Task {
        void_stiffness,
        sources,
        state,
        derivatives,
    };
    let found: Box<dyn Any> = if D == 2 {
        Box::new(in_the_plane(
            law,
            Grid::with_nodes([nodes[0], nodes[1]], spacing)?,
            task,
        )?)
    } else {
        let grid = Grid::with_nodes([nodes[0], nodes[1], nodes[D - 1]], spacing)?;
        Box::new(in_space(law, grid, task)?)
    };
    // The box holds what was made for the dimension `D`.
    let found: Box<Pullback<D>> = found.downcast().expect("one dimension, one type");
    Ok(*found)
}

#[inline(never)]
fn in_the_plane(law: &LawSpec, grid: Grid<2>, task: Task<'_>) -> Result<Pullback<2>, PcaError> {
    Ok(law.visit(Visitor { grid, task })??)
}

#[inline(never)]
fn in_space(law: &LawSpec, grid: Grid<3>, task: Task<'_>) -> Result<Pullback<3>, PcaError> {
    Ok(law.visit(Visitor { grid, task })??)
}

struct Task<'a> {
    void_stiffness: f64,
    sources: &'a [Source<'a>],
    state: &'a [f64],
    derivatives: Derivatives,
}

struct Visitor<'a, const D: usize> {
    grid: Grid<D>,
    task: Task<'a>,
}

impl<const D: usize> LawVisitor<D> for Visitor<'_, D> {
    type Output = Result<Pullback<D>, GridError>;

    fn visit<W: StoredEnergy<D>>(self, law: W) -> Self::Output {
        let law = WeightedElasticity {
            law,
            void_stiffness: self.task.void_stiffness,
        };
        let indicators: Vec<[&[f64]; 1]> =
            self.task.sources.iter().map(|s| [s.indicator]).collect();
        let sources: Vec<PullbackSource<'_>> = self
            .task
            .sources
            .iter()
            .zip(&indicators)
            .map(|(source, coefficients)| PullbackSource {
                weight: source.weight,
                displacement: source.displacement,
                coefficients,
            })
            .collect();
        pull_back(
            &self.grid,
            &law,
            &sources,
            self.task.state,
            self.task.derivatives,
        )
    }
}
