//! Linear operators that are applied, not stored, and conjugate gradients.

use crate::error::GridError;
use crate::vector::{
    add_scaled_into, axpy, aypx, copy_into, dot, fill, max_abs, multiply_into, norm, subtract_into,
};

/// A square linear operator; a preconditioner is one too, an approximate inverse.
pub trait LinearOperator: Sync {
    /// Number of unknowns.
    fn dim(&self) -> usize;

    /// Computes `y = A x`; the previous content of `y` is overwritten.
    fn apply_into(&self, x: &[f64], y: &mut [f64]);
}

impl<T: LinearOperator + ?Sized> LinearOperator for &T {
    fn dim(&self) -> usize {
        (**self).dim()
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        (**self).apply_into(x, y);
    }
}

/// The identity: no preconditioning.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Number of unknowns.
    pub dim: usize,
}

impl LinearOperator for Identity {
    fn dim(&self) -> usize {
        self.dim
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        copy_into(x, y);
    }
}

/// Multiplication by a number per unknown.
#[derive(Clone, Debug)]
pub struct Diagonal {
    factors: Vec<f64>,
}

impl Diagonal {
    /// The operator with this diagonal.
    pub fn new(factors: Vec<f64>) -> Self {
        Self { factors }
    }

    /// The Jacobi preconditioner of an operator with this diagonal: its inverse.
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] where an entry is not a positive number.
    pub fn jacobi(diagonal: &[f64]) -> Result<Self, GridError> {
        let bad = |d: &&f64| !(**d > 0.0 && d.is_finite());
        if let Some(&curvature) = diagonal.iter().find(bad) {
            return Err(GridError::NotPositiveDefinite {
                curvature,
                iteration: 0,
            });
        }
        Ok(Self::new(diagonal.iter().map(|d| 1.0 / d).collect()))
    }

    /// The numbers on the diagonal.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }
}

impl LinearOperator for Diagonal {
    fn dim(&self) -> usize {
        self.factors.len()
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        multiply_into(&self.factors, x, y);
    }
}

/// When conjugate gradients stop: `|b - A x| <= max(relative |b|, absolute)`, Euclidean norms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgParams {
    /// Tolerance of the residual, relative to `|b|`.
    pub relative_tolerance: f64,
    /// Absolute tolerance of the residual.
    pub absolute_tolerance: f64,
    /// Maximal number of iterations.
    pub max_iterations: usize,
}

impl Default for CgParams {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-10,
            absolute_tolerance: 0.0,
            max_iterations: 1000,
        }
    }
}

/// Status of the conjugate-gradient iteration at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CgStatus {
    /// The residual is below the tolerance.
    Converged,
    /// The maximal number of iterations was reached.
    MaxIterations,
}

/// Report of a conjugate-gradient solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgInfo {
    /// Number of iterations, with one application of the operator each.
    pub iterations: usize,
    /// `|b - A x|` at the end, by the recursion of the method.
    pub residual: f64,
    /// Status at the end.
    pub status: CgStatus,
}

/// Work space of conjugate gradients: four vectors, reused between solves.
#[derive(Clone, Debug, Default)]
pub struct CgScratch {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
}

impl CgScratch {
    /// Creates the work space for `dim` unknowns.
    pub fn new(dim: usize) -> Self {
        let mut scratch = Self::default();
        scratch.resize(dim);
        scratch
    }

    fn resize(&mut self, dim: usize) {
        for vector in [
            &mut self.residual,
            &mut self.preconditioned,
            &mut self.direction,
            &mut self.image,
        ] {
            vector.resize(dim, 0.0);
        }
    }
}

/// Solves `A x = b` by preconditioned conjugate gradients, starting from the `x` that is given.
///
/// `A` and the preconditioner (which approximates `A^{-1}`) have to be symmetric and positive
/// definite. Not to converge is not an error: [`CgInfo::status`] says so.
///
/// Source: Hestenes and Stiefel, *Methods of conjugate gradients for solving linear systems*
/// (1952).
///
/// # Errors
/// [`GridError::NotPositiveDefinite`] where `p · A p` or `r · P r` is not positive; `x` is then
/// the last iterate before. [`GridError::NotFinite`] where `b` is not finite.
///
/// # Panics
/// If lengths differ.
pub fn conjugate_gradient(
    operator: &dyn LinearOperator,
    preconditioner: &dyn LinearOperator,
    b: &[f64],
    x: &mut [f64],
    params: &CgParams,
    scratch: &mut CgScratch,
) -> Result<CgInfo, GridError> {
    let dim = operator.dim();
    assert_eq!(preconditioner.dim(), dim);
    assert_eq!((b.len(), x.len()), (dim, dim));
    scratch.resize(dim);
    let CgScratch {
        residual: r,
        preconditioned: z,
        direction: p,
        image: q,
    } = scratch;

    let size_of_b = norm(b);
    if !size_of_b.is_finite() {
        return Err(GridError::NotFinite {
            what: "right side of the linear system",
        });
    }
    if size_of_b == 0.0 {
        fill(0.0, x);
        return Ok(finished(0, 0.0, CgStatus::Converged));
    }
    let tolerance = (params.relative_tolerance * size_of_b).max(params.absolute_tolerance);
    start_residual(operator, b, x, q, r);
    let mut size = norm(r);
    let mut previous = 0.0;
    for iteration in 0..params.max_iterations {
        if size <= tolerance {
            return Ok(finished(iteration, size, CgStatus::Converged));
        }
        preconditioner.apply_into(r, z);
        let product = positive(dot(r, z), iteration)?;
        if iteration == 0 {
            copy_into(z, p);
        } else {
            aypx(product / previous, z, p);
        }
        operator.apply_into(p, q);
        let step = product / positive(dot(p, q), iteration)?;
        axpy(step, p, x);
        axpy(-step, q, r);
        size = norm(r);
        previous = product;
    }
    let status = if size <= tolerance {
        CgStatus::Converged
    } else {
        CgStatus::MaxIterations
    };
    Ok(finished(params.max_iterations, size, status))
}

/// `r = b - A x`, without an application where `x` is zero.
fn start_residual(
    operator: &dyn LinearOperator,
    b: &[f64],
    x: &[f64],
    image: &mut [f64],
    r: &mut [f64],
) {
    if max_abs(x) == 0.0 {
        copy_into(b, r);
    } else {
        operator.apply_into(x, image);
        subtract_into(b, image, r);
    }
}

fn positive(curvature: f64, iteration: usize) -> Result<f64, GridError> {
    if curvature > 0.0 && curvature.is_finite() {
        Ok(curvature)
    } else {
        Err(GridError::NotPositiveDefinite {
            curvature,
            iteration,
        })
    }
}

fn finished(iterations: usize, residual: f64, status: CgStatus) -> CgInfo {
    CgInfo {
        iterations,
        residual,
        status,
    }
}

/// Computes `|b - A x|`.
///
/// # Panics
/// If lengths differ.
pub fn residual_norm(operator: &dyn LinearOperator, b: &[f64], x: &[f64]) -> f64 {
    let mut image = vec![0.0; operator.dim()];
    let mut residual = vec![0.0; operator.dim()];
    operator.apply_into(x, &mut image);
    add_scaled_into(b, -1.0, &image, &mut residual);
    norm(&residual)
}
