//! The energy of all deformations as a function of a further one, for any law. Its kernels are
//! compiled once in this crate for both dimensions; they call the law through a pointer.

use crate::error::PcaError;
use fe_grid::pullback::{Derivatives, Pullback, PullbackSource, pull_back};
use fe_grid::{Grid, compiled_once};
use hyperelastic::{CompiledLaw, WeightedElasticity};

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

compiled_once! {
    /// Evaluates `u -> sum_i c_i int ((1 - delta) chi_i + delta) W(D((1 + u) o phi_i))` at a
    /// displacement (zero if it is empty), with derivatives; see [`fe_grid::pullback`]. At zero the
    /// gradient of one source is the load of its Cauchy stress, `int sigma : Dw`, and the Hessian
    /// is the compound operator.
    ///
    /// # Errors
    /// [`fe_grid::GridError::Inadmissible`] if the composed deformation folds.
    ///
    /// # Panics
    /// If sources or state do not fit the grid.
    pub fn evaluate<'a, D>(
        grid: &'a Grid<D>,
        law: &'a CompiledLaw<D>,
        void_stiffness: f64,
        sources: &'a [Source<'a>],
        state: &'a [f64],
        derivatives: Derivatives,
    ) -> Result<Pullback<D>, PcaError> = evaluate_in;
}

fn evaluate_in<const D: usize>(
    grid: &Grid<D>,
    law: &CompiledLaw<D>,
    void_stiffness: f64,
    sources: &[Source<'_>],
    state: &[f64],
    derivatives: Derivatives,
) -> Result<Pullback<D>, PcaError> {
    let indicators: Vec<[&[f64]; 1]> = sources.iter().map(|s| [s.indicator]).collect();
    let sources: Vec<PullbackSource<'_>> = sources
        .iter()
        .zip(&indicators)
        .map(|(source, coefficients)| PullbackSource {
            weight: source.weight,
            displacement: source.displacement,
            coefficients,
        })
        .collect();
    let law = WeightedElasticity {
        law,
        void_stiffness,
    };
    Ok(pull_back(grid, &law, &sources, state, derivatives)?)
}
