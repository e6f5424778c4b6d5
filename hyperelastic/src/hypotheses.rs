//! Hypotheses satisfied by a law, which determine the theorems that apply to a computation.

use serde::{Deserialize, Serialize};

/// Exponents of the lower growth bound,
/// `W(A) >= c (|A|^norm + |cof A|^cofactor + det^expansion + det^-compression) - C`.
///
/// They hold for the law as a function of `A` alone: a term in `|A|` also bounds the cofactor
/// matrix and the determinant. Zero means no growth of that kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// Exponent `p` of `|A|`.
    pub norm: f64,
    /// Exponent `q` of `|cof A|`.
    pub cofactor: f64,
    /// Exponent `r` of `det A`, for large determinants.
    pub expansion: f64,
    /// Exponent `s` of `1 / det A`, as the determinant tends to zero.
    pub compression: f64,
}

impl Growth {
    /// Increases the exponents of separate terms by those implied by the others:
    /// `|cof A| <= |A|^(d-1)` and `det A <= |A|^d`, both up to a constant, likewise
    /// `det A <= |cof A|^(d/(d-1))`, and `|A| = |cof A|` in 2D.
    pub(crate) fn completed(self, dimension: usize) -> Self {
        let d = dimension as f64;
        let norm = if dimension == 2 {
            self.norm.max(self.cofactor)
        } else {
            self.norm
        };
        let cofactor = self.cofactor.max(norm / (d - 1.0));
        Self {
            norm,
            cofactor,
            expansion: self.expansion.max(norm / d).max(cofactor * (d - 1.0) / d),
            compression: self.compression,
        }
    }
}

/// The hypotheses of the theory on a density, and whether they hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "a list of independent yes-or-no answers"
)]
pub struct Hypotheses {
    /// Spatial dimension, 2 or 3.
    pub dimension: usize,
    /// `W(QA) = W(A)` for every rotation `Q`.
    pub frame_indifferent: bool,
    /// `W(AQ) = W(A)` for every rotation `Q`.
    pub isotropic: bool,
    /// `W(1) = 0` and `W_,A(1) = 0`.
    pub stress_free: bool,
    /// `W(A)` is a convex function of `(A, cof A, det A)`.
    pub polyconvex: bool,
    /// `W` tends to infinity as `det A` tends to 0 from above, and is infinite below.
    pub barrier: bool,
    /// `W > 0` away from the rotations.
    pub minimum_on_rotations: bool,
    /// Lower growth bound.
    pub growth: Growth,
}

impl Hypotheses {
    /// Creates the hypotheses of an isotropic, polyconvex law with a barrier and its minimum, zero,
    /// on the rotations; `growth` lists the terms of the law.
    pub(crate) fn of_polyconvex(dimension: usize, growth: Growth) -> Self {
        Self {
            dimension,
            frame_indifferent: true,
            isotropic: true,
            stress_free: true,
            polyconvex: true,
            barrier: true,
            minimum_on_rotations: true,
            growth: growth.completed(dimension),
        }
    }

    /// Returns whether Theorem 4.2 (existence of the elastic average) applies: polyconvexity and
    /// growth in `|A|` with an exponent larger than the dimension.
    pub fn existence_theorem(&self) -> bool {
        self.polyconvex && self.growth.norm > self.dimension as f64
    }

    /// Returns whether Theorem 4.7 (existence of the phase-field average with homeomorphic
    /// deformations) applies: `p, q > d`, `r > 1` and `s > (d-1) q / (q-d)`.
    ///
    /// The theorem is stated for `d = 3`; for `d = 2` this is the same argument with the 2D
    /// exponents (Ball, Global invertibility of Sobolev functions, 1981).
    pub fn homeomorphism_theorem(&self) -> bool {
        let d = self.dimension as f64;
        let Growth {
            norm,
            cofactor,
            expansion,
            compression,
        } = self.growth;
        self.polyconvex
            && norm > d
            && cofactor > d
            && expansion > 1.0
            && compression > (d - 1.0) * cofactor / (cofactor - d)
    }
}
