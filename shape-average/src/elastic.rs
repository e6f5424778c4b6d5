//! The elastic energy of one shape. Its kernels are compiled once in this crate for both
//! dimensions; they call the law through a pointer.

use crate::error::AverageError;
use crate::params::AverageParams;
use fe_grid::{Assembly, Data, Grid, GridError, compiled_once};
use hyperelastic::{CompiledLaw, WeightedElasticity};

/// The energy `int ((1 - delta) chi + delta) W(1 + Du)` of a displacement `u`.
pub(crate) struct ElasticTerm<'a, const D: usize> {
    /// The law `W`.
    pub law: &'a CompiledLaw<D>,
    /// The indicator `chi` at the nodes.
    pub indicator: &'a [f64],
    /// The stiffness `delta`.
    pub void_stiffness: f64,
    /// The displacement, component by component (`D` times the number of nodes).
    pub displacement: &'a [f64],
    /// Factor of the gradient.
    pub factor: f64,
    /// Array that the gradient is added to; empty if the gradient is not needed.
    pub gradient: &'a mut [f64],
}

/// Computes the elastic energy of a shape, `int ((1 - delta) chi + delta) W(1 + Du)`, of its
/// displacement `u` and indicator `chi` at the nodes, with the law and the void stiffness of the
/// parameters. Energies of results are these.
///
/// # Errors
/// [`AverageError`] where there is no such law, or where the density is not finite.
///
/// # Panics
/// If the indicator and the displacement do not have one and `D` values per node.
pub fn elastic_energy<const D: usize>(
    params: &AverageParams,
    grid: &Grid<D>,
    indicator: &[f64],
    displacement: &[f64],
) -> Result<f64, AverageError> {
    let law = params.law.compile()?;
    let term = ElasticTerm {
        law: &law,
        indicator,
        void_stiffness: params.void_stiffness,
        displacement,
        factor: 1.0,
        gradient: &mut [],
    };
    Ok(add_elastic(term, grid)?)
}

compiled_once! {
    /// Computes the energy on a grid and adds its gradient times the factor.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite.
    pub(crate) fn add_elastic<'a, D>(
        term: ElasticTerm<'a, D>,
        grid: &'a Grid<D>,
    ) -> Result<f64, GridError> = add_elastic_in;
}

fn add_elastic_in<const D: usize>(
    term: ElasticTerm<'_, D>,
    grid: &Grid<D>,
) -> Result<f64, GridError> {
    let ElasticTerm {
        law,
        indicator,
        void_stiffness,
        displacement,
        factor,
        gradient,
    } = term;
    let law = WeightedElasticity {
        law,
        void_stiffness,
    };
    let data = Data {
        coefficients: &[indicator],
        cells: &[],
    };
    let assembly = Assembly::new(*grid, &law, data);
    assembly.value_or_gradient_add(displacement, factor, gradient)
}

compiled_once! {
    /// Computes the Hessian of the energy at its displacement, applied to a direction; it
    /// overwrites the array of the gradient. The factor is not applied.
    pub(crate) fn elastic_hessian_into<'a, D>(
        term: ElasticTerm<'a, D>,
        direction: &'a [f64],
        grid: &'a Grid<D>,
    ) = elastic_hessian_into_in;
}

fn elastic_hessian_into_in<const D: usize>(
    term: ElasticTerm<'_, D>,
    direction: &[f64],
    grid: &Grid<D>,
) {
    let ElasticTerm {
        law,
        indicator,
        void_stiffness,
        displacement,
        gradient,
        ..
    } = term;
    let law = WeightedElasticity {
        law,
        void_stiffness,
    };
    let data = Data {
        coefficients: &[indicator],
        cells: &[],
    };
    let assembly = Assembly::new(*grid, &law, data);
    assembly.hessian_action_into(displacement, direction, gradient);
}
