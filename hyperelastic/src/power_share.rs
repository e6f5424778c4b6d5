//! Distribution of the shear modulus over the two norm terms of a power law.

use crate::error::{LawError, require};
use crate::moduli::LameModuli;

/// A lower bound of `lambda` that is linear in the share `t` of the `|A|^p` term:
/// `mu (t bound_at_norm + (1-t) bound_at_cofactor)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShareProblem {
    pub law: &'static str,
    pub moduli: LameModuli,
    pub bound_at_norm: f64,
    pub bound_at_cofactor: f64,
    /// Whether `lambda` may equal the bound.
    pub attained: bool,
}

impl ShareProblem {
    /// Returns the bound for a share.
    pub fn bound(&self, share: f64) -> f64 {
        let mix = share * self.bound_at_norm + (1.0 - share) * self.bound_at_cofactor;
        self.moduli.mu * mix
    }

    fn admits(&self, share: f64) -> bool {
        let (lambda, bound) = (self.moduli.lambda, self.bound(share));
        bound < lambda || (self.attained && bound == lambda)
    }
}

/// Returns the requested share if it is admissible; by default the middle of the admissible ones.
pub(crate) fn choose_share(problem: &ShareProblem, wish: Option<f64>) -> Result<f64, LawError> {
    let refused = |norm_share: f64| LawError::LambdaBelowBound {
        law: problem.law,
        lambda: problem.moduli.lambda,
        bound: problem.bound(norm_share),
        norm_share,
    };
    if let Some(share) = wish {
        let inside = (0.0..=1.0).contains(&share);
        require(inside, problem.law, "share", share, "between 0 and 1")?;
        return if problem.admits(share) {
            Ok(share)
        } else {
            Err(refused(share))
        };
    }
    match (problem.admits(0.0), problem.admits(1.0)) {
        (true, true) => Ok(0.5),
        (true, false) => Ok(0.5 * crossing(problem)),
        (false, true) => Ok(0.5 * (1.0 + crossing(problem))),
        (false, false) if problem.bound(0.0) < problem.bound(1.0) => Err(refused(0.0)),
        (false, false) => Err(refused(1.0)),
    }
}

/// Returns the share whose bound is `lambda`; the two ends lie on different sides of it.
fn crossing(problem: &ShareProblem) -> f64 {
    let (at_cofactor, at_norm) = (problem.bound(0.0), problem.bound(1.0));
    ((problem.moduli.lambda - at_cofactor) / (at_norm - at_cofactor)).clamp(0.0, 1.0)
}
