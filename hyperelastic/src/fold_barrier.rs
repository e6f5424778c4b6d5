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
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, tensor};

/// The density `b(det(1 + Du))` for a displacement `u`, summed over the corners of the cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldBarrier {
    /// Weight `w`.
    pub weight: f64,
    /// Onset `D0`.
    pub onset: f64,
}

impl FoldBarrier {
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

    /// Returns the positive part of the curvature, `2 w (1 - ln(D/D0)) / D^2` below the onset.
    #[inline(always)]
    pub fn curvature<L: Lane>(&self, det: L) -> L {
        let active = det.less(L::splat(self.onset));
        let log = det.scale(1.0 / self.onset).ln();
        let curvature = (L::one() - log).scale(2.0 * self.weight) / (det * det);
        L::select(active, curvature, L::zero())
    }
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
        let gradient = tensor::scale_add(&change, self.density(det).1, &stress);
        Jet {
            value: [L::zero(); D],
            gradient,
        }
    }
}
