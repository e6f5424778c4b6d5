//! The boundary area of a level set's shape, as a law of the cell engine.

use fe_grid::{CellLaw, Jet, Lane, Point, Reads, mutant};
use levelset::Arctan;

/// The density `H'(u) sqrt(|Du|^2 + rho^2)` of the area `int |D H(u)|`, regularised where `Du`
/// vanishes.
///
/// Source: the lecture notes of Rumpf and Wirth, section 6, `E_area`.
#[derive(Clone, Copy, Debug)]
pub struct BoundaryArea {
    /// The smooth step `H`.
    pub step: Arctan,
    /// The regularisation `rho`.
    pub regularisation: f64,
}

impl BoundaryArea {
    #[inline(always)]
    fn norm<L: Lane, const D: usize>(&self, gradient: &[L; D]) -> L {
        let mut squared = L::splat(self.regularisation * self.regularisation);
        for g in gradient {
            squared = g.mul_add(*g, squared);
        }
        mutant!(squared.sqrt(), AreaHalved => squared.sqrt().scale(0.5))
    }
}

impl Reads for BoundaryArea {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, 1> for BoundaryArea {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, 1>) -> L {
        self.step.derivative(point.value[0]) * self.norm(&point.gradient[0])
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, 1>) -> (L, Jet<L, D, 1>) {
        let norm = self.norm(&point.gradient[0]);
        let slope = self.step.derivative(point.value[0]);
        let mut jet = Jet::zero();
        let bend = self.step.second_derivative(point.value[0]);
        jet.value[0] = mutant!(bend, AreaSlope => L::zero()) * norm;
        let along = slope / norm;
        for k in 0..D {
            jet.gradient[0][k] = point.gradient[0][k] * along;
        }
        (slope * norm, jet)
    }

    /// Second derivative with the slope of the step held fixed: the positive semidefinite part.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, 1>,
        direction: &Jet<L, D, 1>,
    ) -> Jet<L, D, 1> {
        let gradient = &point.gradient[0];
        let norm = self.norm(gradient);
        let along = self.step.derivative(point.value[0]) / norm;
        let mut projected = L::zero();
        for k in 0..D {
            projected = gradient[k].mul_add(direction.gradient[0][k], projected);
        }
        let projected = projected / (norm * norm);
        let mut jet = Jet::zero();
        for k in 0..D {
            let part = direction.gradient[0][k] - gradient[k] * projected;
            jet.gradient[0][k] = part * along;
        }
        jet
    }
}
