//! The energy of one image and its phase field beside a given average.

use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads};
use phasefield::Mismatch;
use phasefield::segmentation::AmbrosioTortorelli;

/// The energy `E_AT[u_i, v_i] + gamma F[v o phi_i, v_i]` as a density of `(u_i, v_i)`. Coefficient
/// 0 is the image, the next `D` are the displacement at which the average is evaluated.
///
/// The mismatch is symmetric in its two phase fields, so the density used for the deformations,
/// which has `v_i` as its coefficient, is the same with the roles exchanged.
pub(super) struct JointDensity<'a, const D: usize> {
    pub segmentation: AmbrosioTortorelli,
    pub mismatch: Mismatch,
    pub average: Interpolant<'a, f64, D>,
}

impl<const D: usize> JointDensity<'_, D> {
    /// Returns the average at a point, as the coefficients of the mismatch.
    #[inline(always)]
    fn seen<L: Lane>(&self, point: &Point<L, D, 2>) -> [L; MAX_COEFFICIENTS] {
        let mut deformed = point.position;
        for k in 0..D {
            deformed[k] += point.coefficient[1 + k];
        }
        let mut coefficient = [L::zero(); MAX_COEFFICIENTS];
        coefficient[0] = self.average.sample(&deformed).0;
        coefficient
    }
}

impl<const D: usize> Reads for JointDensity<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1 + D;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, 2> for JointDensity<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, 2>) -> L {
        let mismatch = self.mismatch.value(point.value[1], &self.seen(point));
        self.segmentation.value(point) + mismatch
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, 2>) -> (L, Jet<L, D, 2>) {
        let (value, mut flux) = self.segmentation.gradient(point);
        let (mismatch, slope, _) = self.mismatch.derivatives(point.value[1], &self.seen(point));
        flux.value[1] += slope;
        (value + mismatch, flux)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, 2>,
        direction: &Jet<L, D, 2>,
    ) -> Jet<L, D, 2> {
        let mut flux = self.segmentation.hessian_action(point, direction);
        let (_, _, curvature) = self.mismatch.derivatives(point.value[1], &self.seen(point));
        flux.value[1] = curvature.mul_add(direction.value[1], flux.value[1]);
        flux
    }
}
