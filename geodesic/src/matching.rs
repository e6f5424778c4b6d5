//! The match of two shapes that level sets describe.

use fe_grid::Lane;
use fe_grid::composition::MatchDensity;
use fe_grid::engine::MAX_COEFFICIENTS;
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
