//! The mismatch between two shapes given by level sets.

use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::PointWeights;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, mutant};
use levelset::Arctan;

/// The density `(H(s) - H(c))^2` of a composed level set `s = u_B o psi` and the level set `c` of
/// the other shape (coefficient 0), with the smooth step `H(x) = 1/2 + atan(x/epsilon)/pi`.
///
/// Source: the lecture notes of Rumpf and Wirth, section 6, `E_match`.
#[derive(Clone, Copy, Debug)]
pub struct HeavisideMismatch {
    /// The step `H`.
    pub step: Arctan,
}

impl MatchDensity for HeavisideMismatch {
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

/// Visibility weight of a mismatch: the product of a weight on the start domain and a weight on the
/// end domain, both between 0 and 1; a missing weight is one. For a shape that only has to be
/// covered, mismatches of one sign count.
#[derive(Clone, Copy)]
pub struct Visibility<'a, const D: usize> {
    /// The weight at a point of the start domain.
    pub start: Option<Interpolant<'a, f64, D>>,
    /// The weight at the deformed point.
    pub end: Option<Interpolant<'a, f64, D>>,
    /// Weights of a mismatch where the composed level set is lower than the other, and where it is
    /// higher: `[1, 0]` requires it to cover the other, `[0, 1]` to be covered.
    pub sides: [f64; 2],
}

impl<const D: usize> Default for Visibility<'_, D> {
    fn default() -> Self {
        Self {
            start: None,
            end: None,
            sides: [1.0; 2],
        }
    }
}

impl<const D: usize> Visibility<'_, D> {
    /// Returns the weight of a mismatch, by its sign.
    #[inline(always)]
    pub(crate) fn side<L: Lane>(&self, difference: L) -> L {
        let [lower, higher] = self.sides.map(L::splat);
        let (lower, higher) = mutant!((lower, higher), SidesSwapped => (higher, lower));
        L::select(difference.less(L::zero()), lower, higher)
    }

    /// Returns the weight, and its derivative with respect to the deformed position.
    #[inline(always)]
    pub(crate) fn weight<L: Lane>(&self, position: &[L; D], deformed: &[L; D]) -> (L, [L; D]) {
        let own = match &self.start {
            Some(weight) => weight.sample(position).0,
            None => L::one(),
        };
        match &self.end {
            Some(weight) => {
                let (value, mut slope) = weight.sample(deformed);
                for s in &mut slope {
                    *s *= own;
                }
                (own * value, slope)
            }
            None => (own, [L::zero(); D]),
        }
    }
}

/// The mismatch `omega (H(v(x + w(x))) - H(u(x)))^2` of a level set `v` under a displacement `w`
/// with a level set `u` (coefficient 0), with the visibility weight `omega`.
#[derive(Clone, Copy)]
pub struct ComposedMismatch<'a, const D: usize> {
    /// The density of the mismatch.
    pub density: HeavisideMismatch,
    /// The level set `v`.
    pub other: Interpolant<'a, f64, D>,
    /// The weight `omega`.
    pub visibility: Visibility<'a, D>,
}

/// A composed level set at a point, and the weight of the mismatch there.
struct Composed<L, const D: usize> {
    value: L,
    slope: [L; D],
    weight: L,
    weight_slope: [L; D],
}

/// Evaluates the composed level set and the weight at the deformed point.
#[inline(always)]
fn compose<L: Lane, const D: usize>(
    other: &Interpolant<'_, f64, D>,
    visibility: &Visibility<'_, D>,
    position: &[L; D],
    displacement: impl Fn(usize) -> L,
) -> Composed<L, D> {
    let mut deformed = *position;
    for k in 0..D {
        deformed[k] += displacement(k);
    }
    let (value, slope) = other.sample(&deformed);
    let (weight, weight_slope) = visibility.weight(position, &deformed);
    Composed {
        value,
        slope,
        weight,
        weight_slope,
    }
}

impl<const D: usize> ComposedMismatch<'_, D> {
    #[inline(always)]
    fn sample<L: Lane>(&self, point: &Point<L, D, D>) -> Composed<L, D> {
        compose(&self.other, &self.visibility, &point.position, |k| {
            point.value[k]
        })
    }
}

impl<const D: usize> Reads for ComposedMismatch<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for ComposedMismatch<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        let at = self.sample(point);
        let step = self.density.step;
        let difference = step.value(at.value) - step.value(point.coefficient[0]);
        difference * difference * at.weight * self.visibility.side(difference)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let at = self.sample(point);
        let (value, derivative, _) = self.density.derivatives(at.value, &point.coefficient);
        // The derivative has the sign of the mismatch, as the step is increasing.
        let side = self.visibility.side(derivative);
        let (value, derivative) = (value * side, derivative * side * at.weight);
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = value.mul_add(at.weight_slope[k], derivative * at.slope[k]);
        }
        (value * at.weight, jet)
    }

    /// Gauss-Newton approximation, with the weight held fixed.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let at = self.sample(point);
        let (_, derivative, curvature) = self.density.derivatives(at.value, &point.coefficient);
        let curvature = curvature * self.visibility.side(derivative);
        let mut along = at.slope[0] * direction.value[0];
        for k in 1..D {
            along = at.slope[k].mul_add(direction.value[k], along);
        }
        let along = along * curvature * at.weight;
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = along * at.slope[k];
        }
        jet
    }
}

/// The mismatch `omega (H(v(x + w(x))) - H(u(x)))^2` of a level set `v` with a level set `u` under
/// a displacement `w`, as a law for the unknowns `u` and `w` (`M = 1 + D` components), with the
/// visibility weight `omega`.
#[derive(Clone, Copy)]
pub struct StepMismatch<'a, const D: usize> {
    /// The step `H`.
    pub step: Arctan,
    /// The level set `v` of the other shape.
    pub other: Interpolant<'a, f64, D>,
    /// The weight `omega`.
    pub visibility: Visibility<'a, D>,
}

impl<const D: usize> StepMismatch<'_, D> {
    #[inline(always)]
    fn sample<L: Lane, const M: usize>(&self, point: &Point<L, D, M>) -> Composed<L, D> {
        // A type parameter, but chosen by callers at run time.
        assert!(M > D);
        compose(&self.other, &self.visibility, &point.position, |k| {
            point.value[k + 1]
        })
    }
}

impl<const D: usize> Reads for StepMismatch<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize, const M: usize> CellLaw<D, M> for StepMismatch<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
        let at = self.sample(point);
        let difference = self.step.value(at.value) - self.step.value(point.value[0]);
        let weight = mutant!(at.weight, MatchHalved => at.weight.scale(0.5));
        difference * difference * weight * self.visibility.side(difference)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
        let at = self.sample(point);
        let difference = self.step.value(at.value) - self.step.value(point.value[0]);
        let counted = difference * self.visibility.side(difference);
        let square = difference * counted;
        let twice = counted.scale(2.0) * at.weight;
        let by_other = twice * self.step.derivative(at.value);
        let mut jet = Jet::zero();
        let own = twice * self.step.derivative(point.value[0]);
        jet.value[0] = mutant!(-own, MatchOwnSlope => own);
        for k in 0..D {
            jet.value[k + 1] = square.mul_add(at.weight_slope[k], by_other * at.slope[k]);
        }
        let weight = mutant!(at.weight, MatchHalved => at.weight.scale(0.5));
        (square * weight, jet)
    }

    /// Gauss-Newton approximation, with the weight held fixed.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M> {
        let at = self.sample(point);
        let by_other = self.step.derivative(at.value);
        let by_own = self.step.derivative(point.value[0]);
        let mut change = -(by_own * direction.value[0]);
        for k in 0..D {
            change = (by_other * at.slope[k]).mul_add(direction.value[k + 1], change);
        }
        let difference = self.step.value(at.value) - self.step.value(point.value[0]);
        let twice = change.scale(2.0) * at.weight * self.visibility.side(difference);
        let mut jet = Jet::zero();
        jet.value[0] = -(twice * by_own);
        for k in 0..D {
            jet.value[k + 1] = twice * by_other * at.slope[k];
        }
        jet
    }
}

/// Contributions of the mismatch at the nodes of the composed level set `v`: its derivative with
/// respect to them, and the weights of the Gauss–Newton matrix. Coefficient 0 is the level set `u`.
#[derive(Clone, Copy)]
pub struct MismatchWeights<'a, const D: usize> {
    /// The step `H`.
    pub step: Arctan,
    /// The level set `v`.
    pub other: Interpolant<'a, f64, D>,
    /// The visibility weight `omega`.
    pub visibility: Visibility<'a, D>,
}

impl<const D: usize> Reads for MismatchWeights<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> PointWeights<D> for MismatchWeights<'_, D> {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, deformed: &[L; D]) -> (L, L) {
        let (s, _) = self.other.sample(deformed);
        let (weight, _) = self.visibility.weight(&point.position, deformed);
        let difference = self.step.value(s) - self.step.value(point.coefficient[0]);
        let weight = weight * self.visibility.side(difference);
        let slope = self.step.derivative(s);
        (
            (slope * slope).scale(2.0) * weight,
            (difference * slope).scale(2.0) * weight,
        )
    }
}
