//! The metric at a deformation, and its inverse by a multigrid cycle.
//!
//! Close to the diagonal, `d_2 d_2 W(b, b) = -d_2 d_1 W(b, b)` is the elastic form
//!
//! ```text
//! A_b(v, v) = int w J W_,AA(1)[Dv G] : Dv G + nu (1 - chi) |Dv|^2,     G = (Db)^{-1}, J = det Db,
//! ```
//!
//! which has the null space of linear elasticity on the deformed object. The cycle is that of the
//! corotational form: it takes into account the rotation of `Db` in every cell and its volume, not
//! its strain.

use crate::cells::ObjectWeights;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{CellProbe, Data, Element, Grid, Lane, Point, Reads, probe_cells, tensor};
use hyperelastic::{Corotational, LameModuli};

/// Regularisation that makes the form definite, as a fraction of the object's shear modulus. Rigid
/// motions have no other stiffness; they are removed from the result of the cycle.
const REGULARISATION: f64 = 1e-6;

/// Returns the corotational form at a displacement of the object `{level_set > 0}`: the law and its
/// data per cell.
pub(super) fn form<O: Element, const D: usize>(
    grid: &Grid<D>,
    moduli: LameModuli,
    weights: ObjectWeights,
    level_set: &[f64],
    displacement: &[f64],
) -> (Corotational<D>, Vec<Vec<O>>) {
    let law = Corotational {
        moduli,
        regularisation: REGULARISATION * moduli.mu,
        rotations: true,
        factored: false,
    };
    let data = Data {
        coefficients: &[level_set],
        cells: &[],
    };
    let form = DeformedForm {
        weights,
        mu: moduli.mu,
    };
    (law, probe_cells(grid, &form, data, displacement))
}

/// Stiffness and rotation of the cells of a deformed object.
struct DeformedForm {
    weights: ObjectWeights,
    mu: f64,
}

impl Reads for DeformedForm {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for DeformedForm {
    const OUTPUTS: usize = Corotational::<D>::CELL_DATA;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let (elastic, viscous) = self.weights.at(point.coefficient[0]);
        let volume = tensor::determinant(&tensor::add_identity(&point.gradient));
        // A viscosity corresponds to a shear modulus of half its size. Where the void may fold, its
        // volume is not meaningful.
        let solid = L::select(L::zero().less(elastic), elastic * volume, L::zero());
        Corotational::at_point(solid + viscous.scale(0.5 / self.mu), &point.gradient)
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        Corotational::<D>::from_means(means)
    }
}
