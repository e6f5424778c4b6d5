//! The match of two shapes that level sets describe.

use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::PointWeights;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads};
use levelset::Arctan;

/// The density `(H(s) - H(c))^2` of a composed level set `s = u_B o psi` and the level set `c` of
/// the other shape (coefficient 0), with the smooth step `H(x) = 1/2 + atan(x/epsilon)/pi`.
///
/// Source: the notes, section 6, `E_match`.
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
