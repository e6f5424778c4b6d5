//! Conjugate gradients with estimates of the extreme curvatures.
//!
//! Besides the solution they return the extreme Ritz values of the preconditioned operator, which
//! show whether it is positive definite. For this the iteration continues when the curvature of a
//! direction is negative, where the solver of `fe-grid` stops; the iterates are then stationary
//! points in the Krylov space and not minimisers; [`Negative::Stop`] ends it there.

use fe_grid::vector::{axpy, aypx, copy_into, dot, norm};
use nalgebra::{DMatrix, SymmetricEigen};
use serde::Serialize;

/// Report on a linear solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolveReport {
    /// Number of iterations, with one application of the operator each.
    pub iterations: usize,
    /// Residual at the end, relative to the load.
    pub residual: f64,
    /// The smallest Ritz value of the preconditioned operator; positive if all curvatures
    /// encountered are positive.
    #[serde(skip)]
    pub least_curvature: f64,
    /// The largest Ritz value.
    #[serde(skip)]
    pub largest_curvature: f64,
}

impl SolveReport {
    /// As numbers, for a [`Memory`](fe_grid::minimise::Memory).
    pub(crate) fn to_numbers(self) -> [f64; 4] {
        [
            self.iterations as f64,
            self.residual,
            self.least_curvature,
            self.largest_curvature,
        ]
    }

    /// The inverse.
    pub(crate) fn of_numbers([iterations, residual, least, largest]: [f64; 4]) -> Self {
        Self {
            iterations: iterations as usize,
            residual,
            least_curvature: least,
            largest_curvature: largest,
        }
    }
}

/// What to do about a direction of negative curvature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Negative {
    /// Go on to the stationary point.
    PassOver,
    /// Stop before it, or with the first direction: the solution is one of descent.
    Stop,
}

/// Maximal number of iterations used for the Ritz values.
const MAX_RITZ: usize = 400;

/// Solves `A x = b` from zero, with a symmetric `A` and a symmetric positive preconditioner, down
/// to `|b - A x| <= tolerance |b|`.
pub(crate) fn solve(
    operator: impl Fn(&[f64], &mut [f64]),
    preconditioner: impl Fn(&[f64], &mut [f64]),
    b: &[f64],
    tolerance: f64,
    max_iterations: usize,
    negative: Negative,
) -> (Vec<f64>, SolveReport) {
    let size = norm(b);
    let zeros = || vec![0.0; b.len()];
    let (mut x, mut r, mut z, mut p, mut q) = (zeros(), b.to_vec(), zeros(), zeros(), zeros());
    let (mut steps, mut shares) = (Vec::new(), Vec::new());
    let mut report = SolveReport {
        iterations: 0,
        residual: 0.0,
        least_curvature: f64::INFINITY,
        largest_curvature: 0.0,
    };
    if size == 0.0 {
        return (x, report);
    }
    let mut previous = 0.0;
    loop {
        report.residual = norm(&r) / size;
        if report.residual <= tolerance || report.iterations >= max_iterations {
            break;
        }
        preconditioner(&r, &mut z);
        let product = dot(&r, &z);
        if report.iterations == 0 {
            copy_into(&z, &mut p);
        } else {
            shares.push(product / previous);
            aypx(product / previous, &z, &mut p);
        }
        operator(&p, &mut q);
        let curvature = dot(&p, &q);
        // Breakdown: the sign of the curvature is undetermined, or the residual is zero.
        if !(product > 0.0 && curvature.is_finite()) || curvature == 0.0 {
            break;
        }
        if curvature < 0.0 && negative == Negative::Stop {
            if report.iterations == 0 {
                copy_into(&p, &mut x);
            }
            report.least_curvature = curvature;
            return (x, report);
        }
        let step = product / curvature;
        axpy(step, &p, &mut x);
        axpy(-step, &q, &mut r);
        steps.push(step);
        previous = product;
        report.iterations += 1;
    }
    if let Some((least, largest)) = ritz(&steps, &shares) {
        (report.least_curvature, report.largest_curvature) = (least, largest);
    }
    (x, report)
}

/// Computes the extreme eigenvalues of the tridiagonal matrix given by the conjugate-gradient
/// coefficients.
fn ritz(steps: &[f64], shares: &[f64]) -> Option<(f64, f64)> {
    let n = steps.len().min(MAX_RITZ);
    let mut matrix = DMatrix::zeros(n, n);
    for k in 0..n {
        matrix[(k, k)] = 1.0 / steps[k];
        if k > 0 {
            matrix[(k, k)] += shares[k - 1] / steps[k - 1];
            let beside = shares[k - 1].max(0.0).sqrt() / steps[k - 1];
            matrix[(k, k - 1)] = beside;
            matrix[(k - 1, k)] = beside;
        }
    }
    if n == 0 {
        return None;
    }
    let values = SymmetricEigen::new(matrix).eigenvalues;
    Some((values.min(), values.max()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves `D x = b` for a diagonal matrix, in at most ten iterations.
    fn solve_diagonal(diagonal: &[f64], b: &[f64], negative: Negative) -> (Vec<f64>, SolveReport) {
        let apply = |x: &[f64], y: &mut [f64]| {
            for (y, (x, d)) in y.iter_mut().zip(x.iter().zip(diagonal)) {
                *y = d * x;
            }
        };
        solve(apply, |x, y| y.copy_from_slice(x), b, 1e-12, 10, negative)
    }

    #[test]
    fn curvature_of_either_sign_is_met() {
        for least in [0.5, -0.5] {
            let diagonal = [least, 1.0, 2.0, 7.0];
            let b = [1.0, -2.0, 0.5, 1.0];
            let (x, report) = solve_diagonal(&diagonal, &b, Negative::PassOver);
            for ((x, b), d) in x.iter().zip(b).zip(diagonal) {
                assert!((x - b / d).abs() < 1e-10);
            }
            // Four steps span the whole space: the Ritz values are the eigenvalues.
            assert!((report.least_curvature - least).abs() < 1e-9);
            assert!((report.largest_curvature - 7.0).abs() < 1e-9);
        }
    }

    /// Down to a negative curvature the iterates are those of descent; where the first is negative, it is
    /// the first direction.
    #[test]
    fn a_negative_curvature_ends_it_where_that_is_asked_for() {
        for (diagonal, b) in [
            ([1.0, 2.0, -0.1], [1.0, 1.0, 0.5]),
            ([-1.0, -2.0, 0.5], [1.0; 3]),
        ] {
            let (x, report) = solve_diagonal(&diagonal, &b, Negative::Stop);
            assert!(report.least_curvature < 0.0, "{report:?}");
            assert!(dot(&x, &b) > 0.0, "{x:?}");
        }
    }
}
