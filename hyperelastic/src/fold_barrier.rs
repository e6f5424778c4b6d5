//! A barrier against folding, evaluated at the corners of the cells.
//!
//! The Gauss points of an elastic energy are inside the cells: a corner can fold while the energy
//! is finite, and in a soft void the resistance is small. The barrier
//!
//! ```text
//! b(D) = w ln(D / D0)^2 for D < D0,   0 otherwise,   D = det D phi at the corners,
//! ```
//!
//! is twice continuously differentiable except for a bounded jump of its second derivative at the
//! onset `D0`, tends to infinity as `D` tends to zero, and vanishes for deformations whose
//! determinants exceed the onset: it does not change their energy.

use fe_grid::engine::CORNERS;
use fe_grid::{
    Assembly, CellLaw, Data, Grid, GridError, Jet, Lane, Point, Reads, compiled_once, tensor,
};

/// The density `b(det(1 + Du))` for a displacement `u`, summed over the corners of the cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldBarrier {
    /// Weight `w`.
    pub weight: f64,
    /// Onset `D0`.
    pub onset: f64,
}

impl FoldBarrier {
    /// The onset of the barriers of all energies.
    pub const ONSET: f64 = 0.2;

    /// Returns `b` and `b'`.
    #[inline(always)]
    fn density<L: Lane>(&self, det: L) -> (L, L) {
        let active = det.less(L::splat(self.onset));
        let log = det.scale(1.0 / self.onset).ln();
        let log = L::select(active, log, L::zero());
        let slope = log.scale(2.0 * self.weight) / det;
        (
            (log * log).scale(self.weight),
            L::select(active, slope, L::zero()),
        )
    }

    /// The barrier of a displacement on a grid; its gradient is added to `gradient` unless that is
    /// empty. The kernels are compiled with this crate.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where a corner is folded.
    pub fn value_or_gradient_add<const D: usize>(
        &self,
        grid: &Grid<D>,
        displacement: &[f64],
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        add_barrier(self, grid, displacement, gradient)
    }

    /// The Hessian at a displacement applied to a direction; it overwrites `out`. In it the slope
    /// and the curvature are exact: `b'' >= 0` below the onset. The kernels are compiled with this
    /// crate.
    pub fn hessian_action_into<const D: usize>(
        &self,
        grid: &Grid<D>,
        displacement: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) {
        barrier_hessian_into(self, grid, displacement, direction, out);
    }

    /// The positive part of the curvature, `2 w (1 - ln(D/D0)) / D^2` below the onset.
    #[inline(always)]
    pub fn curvature<L: Lane>(&self, det: L) -> L {
        let active = det.less(L::splat(self.onset));
        let log = det.scale(1.0 / self.onset).ln();
        let curvature = (L::one() - log).scale(2.0 * self.weight) / (det * det);
        L::select(active, curvature, L::zero())
    }
}

compiled_once! {
    fn add_barrier<'a, D>(
        law: &'a FoldBarrier,
        grid: &'a Grid<D>,
        displacement: &'a [f64],
        gradient: &'a mut [f64],
    ) -> Result<f64, GridError> = add_barrier_in;
}

fn add_barrier_in<const D: usize>(
    law: &FoldBarrier,
    grid: &Grid<D>,
    displacement: &[f64],
    gradient: &mut [f64],
) -> Result<f64, GridError> {
    let assembly = Assembly::<_, f64, D, D>::new(*grid, law, Data::default());
    assembly.value_or_gradient_add(displacement, 1.0, gradient)
}

compiled_once! {
    fn barrier_hessian_into<'a, D>(
        law: &'a FoldBarrier,
        grid: &'a Grid<D>,
        displacement: &'a [f64],
        direction: &'a [f64],
        out: &'a mut [f64],
    ) = barrier_hessian_into_in;
}

fn barrier_hessian_into_in<const D: usize>(
    law: &FoldBarrier,
    grid: &Grid<D>,
    displacement: &[f64],
    direction: &[f64],
    out: &mut [f64],
) {
    let assembly = Assembly::<_, f64, D, D>::new(*grid, law, Data::default());
    assembly.hessian_action_into(displacement, direction, out);
}

impl Reads for FoldBarrier {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
    const POINT_OFFSET: f64 = CORNERS;
}

impl<const D: usize> CellLaw<D, D> for FoldBarrier {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.density(tensor::determinant(&tensor::add_identity(&point.gradient)))
            .0
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let a = tensor::add_identity(&point.gradient);
        let cofactor = tensor::cofactor(&a);
        let (value, slope) = self.density(tensor::determinant_with(&a, &cofactor));
        (
            value,
            Jet {
                value: [L::zero(); D],
                gradient: tensor::scale(&cofactor, slope),
            },
        )
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let a = tensor::add_identity(&point.gradient);
        let cofactor = tensor::cofactor(&a);
        let det = tensor::determinant_with(&a, &cofactor);
        let along = tensor::contract(&cofactor, &direction.gradient);
        let change = tensor::cofactor_derivative(&a, &direction.gradient);
        let stress = tensor::scale(&cofactor, self.curvature(det) * along);
        let gradient = tensor::add_scaled(&stress, self.density(det).1, &change);
        Jet {
            value: [L::zero(); D],
            gradient,
        }
    }
}
