//! The linear operator of the augmented Lagrangian, and its preconditioner.

use super::boundary::BoundaryPoints;
use super::cut::ObjectCells;
use super::elements::CutElements;
use super::params::MetricParams;
use crate::error::GeodesicError;
use fe_grid::LinearOperator;
use fe_grid::multigrid::MultigridParams;
use hyperelastic::{Corotational, CorotationalMultigrid, CorotationalOperator};

/// Mass of the fluid in the object, relative to `mu` in the unit box. Of all velocities with the least dissipation,
/// which differ by rigid motions, it selects the slowest; it changes `G` by its square only.
const MASS: f64 = 1e-3;
/// The same in the preconditioner, in single precision: rigid motions are left to the iteration.
const ROUNDED_MASS: f64 = 1e-2;

/// `v -> K v + rho B^T B v`: stiffness of the object and the void, and the penalty at the boundary.
pub(super) struct Augmented<'a, const D: usize> {
    /// Whole cells, and the small stiffness of all others.
    bulk: CorotationalOperator<D>,
    cut: CutElements<D>,
    cycle: CorotationalMultigrid<D>,
    boundary: &'a BoundaryPoints<D>,
    /// The penalty `rho`.
    pub penalty: f64,
}

impl<'a, const D: usize> Augmented<'a, D> {
    /// The operator on the cells of an object.
    ///
    /// # Errors
    /// [`GeodesicError::Grid`] where the form is not definite in single precision.
    pub fn new(
        cells: &ObjectCells<D>,
        boundary: &'a BoundaryPoints<D>,
        params: &MetricParams,
    ) -> Result<Self, GeodesicError> {
        let (grid, moduli) = (cells.grid, params.moduli);
        let law = Corotational {
            moduli,
            regularisation: 0.0,
            rotations: true,
            factored: false,
        };
        let void = params.void_stiffness;
        let penalty = params.penalty * (moduli.lambda + 2.0 * moduli.mu) / grid.spacing();
        let mut exact = vec![vec![0.0; grid.n_cells()]; Corotational::<D>::CELL_DATA];
        let mut rounded = vec![vec![0.0; grid.n_cells()]; Corotational::<D>::CELL_DATA];
        for (cell, &fraction) in cells.fractions.iter().enumerate() {
            // The object's part of cut cells has matrices of its own; the cycle knows fractions only.
            let whole = if fraction < 1.0 { void } else { 1.0 };
            let data = Corotational::<D>::undeformed(whole);
            let weight = fraction + void * (1.0 - fraction);
            let approximate = Corotational::<D>::undeformed(weight);
            for entry in 0..Corotational::<D>::CELL_DATA {
                exact[entry][cell] = data[entry];
                rounded[entry][cell] = approximate[entry] as f32;
            }
            for i in 0..D {
                exact[Corotational::<D>::mass_entry(i, i)][cell] = MASS * moduli.mu * weight;
            }
        }
        for i in 0..D {
            let mass = ROUNDED_MASS * moduli.mu;
            rounded[Corotational::<D>::mass_entry(i, i)].fill(mass as f32);
        }
        // The penalty as a mass of its cells.
        let factor = penalty / grid.cell_volume();
        for point in boundary.points() {
            for i in 0..D {
                for j in i..D {
                    let entry = &mut rounded[Corotational::<D>::mass_entry(i, j)][point.cell];
                    let part = factor * point.weight * point.normal[i] * point.normal[j];
                    *entry += part as f32;
                }
            }
        }
        Ok(Self {
            bulk: CorotationalOperator::new(grid, law, exact),
            cut: CutElements::new(cells, moduli),
            cycle: CorotationalMultigrid::new(grid, law, rounded, MultigridParams::default())?,
            boundary,
            penalty,
        })
    }

    /// One multigrid cycle.
    pub fn preconditioner(&self) -> &dyn LinearOperator {
        &self.cycle
    }
}

impl<const D: usize> LinearOperator for Augmented<'_, D> {
    fn dim(&self) -> usize {
        self.bulk.dim()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        self.bulk.apply_into(x, y);
        self.cut.add_product(x, y);
        let normal = self.boundary.normal_component(x);
        self.boundary.add_load(&normal, self.penalty, y);
    }
}
