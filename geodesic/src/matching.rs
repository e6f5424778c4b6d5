//! The match of two shapes that level sets describe.

use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::PointWeights;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, tensor};
use levelset::Arctan;

/// The density `(H(s) - H(c))^2` of a composed level set `s = u_B o psi` and the level set `c` of
/// the other shape (coefficient 0), with the smooth step `H(x) = 1/2 + atan(x/epsilon)/pi`.
///
/// Source: the lecture notes of Rumpf and Wirth, section 6, `E_match`.
#[derive(Clone, Copy, Debug)]
pub struct HeavisideMatch {
    /// The step `H`.
    pub step: Arctan,
}

impl MatchDensity for HeavisideMatch {
    const COEFFICIENTS: usize = 1;

    #[inline(always)]
    fn value<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L {
        let difference = self.step.value(s) - self.step.value(coefficient[0]);
        difference * difference
    }

    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        let difference = self.step.value(s) - self.step.value(coefficient[0]);
        let slope = self.step.derivative(s);
        (
            difference * difference,
            (difference * slope).scale(2.0),
            (slope * slope).scale(2.0),
        )
    }
}

/// The match of a displaced level set, measured in part where the deformation ends:
/// `((1 - theta) + theta det(1 + Dw)) (H(v(x + w(x))) - H(u(x)))^2` for a displacement `w`.
///
/// At `theta = 0` the match is the volume of what differs on the start domain, at `theta = 1` on
/// the end domain. There the void that a shape closes up costs nothing once it has no volume, and
/// the boundary of the shape itself is driven, wherever it is.
#[derive(Clone, Copy)]
pub struct MeasuredMatch<'a, const D: usize> {
    /// The density of the match.
    pub density: HeavisideMatch,
    /// The level set `v`.
    pub other: Interpolant<'a, f64, D>,
    /// The share `theta`.
    pub deformed_share: f64,
}

impl<const D: usize> MeasuredMatch<'_, D> {
    #[inline(always)]
    fn sample<L: Lane>(&self, point: &Point<L, D, D>) -> (L, [L; D]) {
        let mut position = point.position;
        for k in 0..D {
            position[k] += point.value[k];
        }
        self.other.sample(&position)
    }

    /// Void that is folded over has no volume.
    #[inline(always)]
    fn measure<L: Lane>(&self, volume: L) -> L {
        volume.max(L::zero()).mul_add(
            L::splat(self.deformed_share),
            L::splat(1.0 - self.deformed_share),
        )
    }
}

impl<const D: usize> Reads for MeasuredMatch<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for MeasuredMatch<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        let (s, _) = self.sample(point);
        let volume = tensor::determinant(&tensor::add_identity(&point.gradient));
        self.density.value(s, &point.coefficient) * self.measure(volume)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let (s, slope) = self.sample(point);
        let deformed = tensor::add_identity(&point.gradient);
        let cofactor = tensor::cofactor(&deformed);
        let volume = tensor::determinant_with(&deformed, &cofactor);
        let measure = self.measure(volume);
        let (value, derivative, _) = self.density.derivatives(s, &point.coefficient);
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = derivative * measure * slope[k];
        }
        let pressure = L::select(
            L::zero().less(volume),
            value.scale(self.deformed_share),
            L::zero(),
        );
        jet.gradient = tensor::scale(&cofactor, pressure);
        (value * measure, jet)
    }

    /// That of Gauss and Newton, with the measure held.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let (s, slope) = self.sample(point);
        let volume = tensor::determinant(&tensor::add_identity(&point.gradient));
        let (_, _, curvature) = self.density.derivatives(s, &point.coefficient);
        let mut along = slope[0] * direction.value[0];
        for k in 1..D {
            along = slope[k].mul_add(direction.value[k], along);
        }
        let along = along * curvature * self.measure(volume);
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = along * slope[k];
        }
        jet
    }
}

/// The match `(H(v(x + w(x))) - H(u(x)))^2` of a level set `v` with a level set `u` under a
/// displacement `w`, as a law for the unknowns `u` and `w` (`M = 1 + D` components).
#[derive(Clone, Copy)]
pub struct StepMatch<'a, const D: usize> {
    /// The step `H`.
    pub step: Arctan,
    /// The level set `v` of the other shape.
    pub other: Interpolant<'a, f64, D>,
}

impl<const D: usize> StepMatch<'_, D> {
    #[inline(always)]
    fn sample<L: Lane, const M: usize>(&self, point: &Point<L, D, M>) -> (L, [L; D]) {
        // A constant of the type, but callers choose it at run time.
        assert!(M > D);
        let mut position = point.position;
        for k in 0..D {
            position[k] += point.value[k + 1];
        }
        self.other.sample(&position)
    }
}

impl<const D: usize> Reads for StepMatch<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize, const M: usize> CellLaw<D, M> for StepMatch<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
        let (s, _) = self.sample(point);
        let difference = self.step.value(s) - self.step.value(point.value[0]);
        difference * difference
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
        let (s, slope) = self.sample(point);
        let difference = self.step.value(s) - self.step.value(point.value[0]);
        let twice = difference.scale(2.0);
        let by_other = twice * self.step.derivative(s);
        let mut jet = Jet::zero();
        jet.value[0] = -(twice * self.step.derivative(point.value[0]));
        for k in 0..D {
            jet.value[k + 1] = by_other * slope[k];
        }
        (difference * difference, jet)
    }

    /// That of Gauss and Newton.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M> {
        let (s, slope) = self.sample(point);
        let by_other = self.step.derivative(s);
        let by_own = self.step.derivative(point.value[0]);
        let mut change = -(by_own * direction.value[0]);
        for k in 0..D {
            change = (by_other * slope[k]).mul_add(direction.value[k + 1], change);
        }
        let twice = change.scale(2.0);
        let mut jet = Jet::zero();
        jet.value[0] = -(twice * by_own);
        for k in 0..D {
            jet.value[k + 1] = twice * by_other * slope[k];
        }
        jet
    }
}

/// What the match scatters to the nodes of the composed level set `v`: its derivative by them, and
/// the weights of the Gauss–Newton matrix. Coefficient 0 is the level set `u`.
#[derive(Clone, Copy)]
pub struct MatchWeights<'a, const D: usize> {
    /// The step `H`.
    pub step: Arctan,
    /// The level set `v`.
    pub other: Interpolant<'a, f64, D>,
}

impl<const D: usize> Reads for MatchWeights<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> PointWeights<D> for MatchWeights<'_, D> {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, deformed: &[L; D]) -> (L, L) {
        let (s, _) = self.other.sample(deformed);
        let difference = self.step.value(s) - self.step.value(point.coefficient[0]);
        let slope = self.step.derivative(s);
        ((slope * slope).scale(2.0), (difference * slope).scale(2.0))
    }
}
