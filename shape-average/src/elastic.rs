//! The elastic energy of one shape, under whatever law the parameters name.
//!
//! All laws are compiled here for both dimensions, once ([`fe_grid::dimension`]), so that crates
//! which use the average do not compile every law again.

use fe_grid::{Assembly, CellLaw, Data, Grid, GridError, compiled_once};
use hyperelastic::{LawError, LawSpec, LawVisitor, StoredEnergy, WeightedElasticity};

/// The energy `int ((1 - delta) chi + delta) W(1 + Du)` of a displacement `u`.
pub(crate) struct ElasticTerm<'a> {
    /// The law `W`.
    pub law: &'a LawSpec,
    /// The indicator `chi` at the nodes.
    pub indicator: &'a [f64],
    /// The stiffness `delta`.
    pub void_stiffness: f64,
    /// The displacement, component by component.
    pub displacement: &'a [f64],
    /// A factor of the gradient.
    pub factor: f64,
    /// What the gradient is added to; empty where it is not wanted.
    pub gradient: &'a mut [f64],
}

impl ElasticTerm<'_> {
    /// The energy on a grid; its gradient times the factor is added.
    ///
    /// # Errors
    /// [`LawError`] where there is no such law; [`GridError::Inadmissible`] in the inner result
    /// where the density is not finite.
    pub fn add<const D: usize>(self, grid: &Grid<D>) -> Result<Result<f64, GridError>, LawError> {
        of_law(self, *grid)
    }
}

compiled_once! {
    /// The energy under the law of the term.
    fn of_law<'a, D>(
        term: ElasticTerm<'a>,
        grid: Grid<D>,
    ) -> Result<Result<f64, GridError>, LawError> = visit_law;
}

fn visit_law<const D: usize>(
    term: ElasticTerm<'_>,
    grid: Grid<D>,
) -> Result<Result<f64, GridError>, LawError> {
    term.law.visit(Visitor { grid, term })
}

struct Visitor<'a, const D: usize> {
    grid: Grid<D>,
    term: ElasticTerm<'a>,
}

impl<const D: usize> LawVisitor<D> for Visitor<'_, D> {
    type Output = Result<f64, GridError>;

    fn visit<W: StoredEnergy<D>>(self, law: W) -> Self::Output {
        let law = WeightedElasticity {
            law,
            void_stiffness: self.term.void_stiffness,
        };
        let data = Data {
            coefficients: &[self.term.indicator],
            cells: &[],
        };
        let assembly = Assembly::new(self.grid, &law, data);
        value_or_gradient(
            &assembly,
            self.term.displacement,
            self.term.factor,
            self.term.gradient,
        )
    }
}

/// The energy of a law; `factor` times its gradient is added to `gradient` unless that is empty.
pub(crate) fn value_or_gradient<F: CellLaw<D, D>, const D: usize>(
    assembly: &Assembly<'_, F, f64, D, D>,
    displacement: &[f64],
    factor: f64,
    gradient: &mut [f64],
) -> Result<f64, GridError> {
    if gradient.is_empty() {
        assembly.value(displacement)
    } else {
        assembly.value_and_gradient_add(displacement, factor, gradient)
    }
}
