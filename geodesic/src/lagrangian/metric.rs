//! The Gauss–Newton metric of a path on its start domain.
//!
//! In the increments `d_k = psi_k - psi_{k-1}` the Hessian of the path is, for moderate strains,
//! block diagonal but for the mismatch of the last deformation, which is the sum of all of them:
//!
//! ```text
//! H = K diag(A_1, ..., A_K) + eta (1 1^T) x M,
//! ```
//!
//! with the elastic forms `A_k` and the Gauss–Newton matrix `M` of the mismatch. With one form `A`
//! for all steps the common increment of all steps and the differences between them decouple:
//!
//! ```text
//! H^-1 = (1 1^T / K^2) x (A + eta M)^-1 + (1 - 1 1^T / K) x (K A)^-1,
//! ```
//!
//! where each inverse is one multigrid cycle on a corotational form. The result is symmetric and
//! positive definite for any two such cycles. The first form is taken at the end of the path, where
//! the mismatch is, and the second behind its middle.
//!
//! On the domain of a shape between both ends, which are both matched, a motion `p` of the whole path is added:
//! with `psi_0 = p - s/2`, `psi_K = p + s/2` and the same `M` at both ends, `s` and `p` decouple,
//!
//! ```text
//! H = (A + eta M / 2) s^2 + 2 eta M p^2,
//! ```
//!
//! and since nothing holds `p` away from the boundary, and a motion there changes nothing, `A` is added with a large factor.

use crate::metric::{ElasticForm, corotational};
use fe_grid::multigrid::{MultigridParams, WorkSpace};
use fe_grid::{Grid, GridError, LinearOperator, parallel, vector};
use hyperelastic::CorotationalMultigrid;

/// The inverse metric.
pub(crate) struct PathMetric<const D: usize> {
    common: CorotationalMultigrid<D>,
    differences: Option<CorotationalMultigrid<D>>,
    /// That of a motion of the whole path, where both ends are matched.
    whole: Option<CorotationalMultigrid<D>>,
    steps: usize,
}

/// Factor of the elastic form of a motion of the whole path: with .05, 500 iterations are not enough where 250 are with 10.
const WHOLE: f64 = 10.0;

impl<const D: usize> PathMetric<D> {
    /// Computes the metric of the object `{start > 0}` at the displacements of a path.
    pub fn new(
        grid: Grid<D>,
        form: &ElasticForm<'_, D>,
        start: &[f64],
        x: &[f64],
        steps: usize,
    ) -> Result<Self, GridError> {
        let make = Self::cycles(grid, form, start);
        let dim = x.len() / steps;
        let deformation = |k: usize| &x[(k - 1) * dim..k * dim];
        Ok(Self {
            common: make(form.mismatch_weight, 1.0, deformation(steps))?,
            differences: (steps > 1)
                .then(|| make(0.0, 1.0, deformation(steps / 2 + 1)))
                .transpose()?,
            whole: None,
            steps,
        })
    }

    /// The metric on the domain of a shape between both ends, of displacements of `psi_0, ..., psi_K`.
    pub fn between(
        grid: Grid<D>,
        form: &ElasticForm<'_, D>,
        own: &[f64],
        x: &[f64],
        steps: usize,
    ) -> Result<Self, GridError> {
        let make = Self::cycles(grid, form, own);
        let dim = x.len() / (steps + 1);
        let middle = &x[steps / 2 * dim..(steps / 2 + 1) * dim];
        let mismatch = form.mismatch_weight;
        Ok(Self {
            common: make(0.5 * mismatch, 1.0, middle)?,
            differences: (steps > 1).then(|| make(0.0, 1.0, middle)).transpose()?,
            whole: Some(make(2.0 * mismatch, WHOLE, middle)?),
            steps,
        })
    }

    /// Makes cycles on the form of an object with a weight of the mismatch, a factor of the stiffness, and at a
    /// displacement; they share their work space.
    fn cycles<'a>(
        grid: Grid<D>,
        form: &'a ElasticForm<'a, D>,
        own: &'a [f64],
    ) -> impl Fn(f64, f64, &[f64]) -> Result<CorotationalMultigrid<D>, GridError> + 'a {
        let work_space = WorkSpace::default();
        move |mismatch_weight, stiffness, displacement| {
            let form = ElasticForm {
                mismatch_weight,
                stiffness: stiffness * form.stiffness,
                ..*form
            };
            let (law, cells) = corotational(&grid, &form, own, displacement);
            let cycle = CorotationalMultigrid::new(grid, law, cells, MultigridParams::default())?;
            Ok(cycle.with_work_space(work_space.clone()))
        }
    }

    /// Computes `out = H^-1 gradient`, for the displacements of all deformations.
    pub fn apply_into(&self, gradient: &[f64], out: &mut [f64]) {
        let Some(whole) = &self.whole else {
            self.apply_to_steps(gradient, out);
            return;
        };
        // x_k = p - s/2 + d_1 + ... + d_k with the sum s of all increments.
        let dim = gradient.len() / (self.steps + 1);
        let mut sum = vec![0.0; dim];
        for part in gradient.chunks_exact(dim) {
            vector::axpy(1.0, part, &mut sum);
        }
        let mut by_steps = gradient[dim..].to_vec();
        // The gradient of all increments lacks half of the sum: that of the last deformation is in each of them.
        let last = by_steps.len() - dim;
        vector::axpy(-0.5, &sum, &mut by_steps[last..]);
        self.apply_to_steps(&by_steps, &mut out[dim..]);
        let mut motion = vec![0.0; dim];
        whole.apply_into(&sum, &mut motion);
        let half = out[out.len() - dim..].to_vec();
        vector::axpy(-0.5, &half, &mut motion);
        out[..dim].fill(0.0);
        for part in out.chunks_exact_mut(dim) {
            vector::axpy(1.0, &motion, part);
        }
    }

    /// The same for increments from a first deformation that is held.
    fn apply_to_steps(&self, gradient: &[f64], out: &mut [f64]) {
        let steps = self.steps;
        let dim = gradient.len() / steps;
        // The gradient with respect to the increments: sums from the end.
        vector::copy_into(gradient, out);
        for k in (0..steps - 1).rev() {
            let (head, tail) = out.split_at_mut((k + 1) * dim);
            vector::axpy(1.0, &tail[..dim], &mut head[k * dim..]);
        }
        let mut total = vec![0.0; dim];
        for part in out.chunks_exact(dim) {
            vector::axpy(1.0, part, &mut total);
        }
        let mut common = vec![0.0; dim];
        self.common.apply_into(&total, &mut common);
        let count = steps as f64;
        if let Some(differences) = &self.differences {
            let mut solved = vec![0.0; out.len()];
            let parts = out.chunks_exact_mut(dim).zip(solved.chunks_exact_mut(dim));
            parallel::for_each(parts, &|(part, solved)| {
                vector::axpy(-1.0 / count, &total, part);
                differences.apply_into(part, solved);
            });
            total.fill(0.0);
            for part in solved.chunks_exact(dim) {
                vector::axpy(1.0 / count, part, &mut total);
            }
            let parts = out.chunks_exact_mut(dim).zip(solved.chunks_exact(dim));
            parallel::for_each(parts, &|(out, solved)| {
                for (((out, s), mean), c) in out.iter_mut().zip(solved).zip(&total).zip(&common) {
                    *out = (s - mean) / count + c / (count * count);
                }
            });
        } else {
            vector::copy_into(&common, out);
        }
        // Conversion from increments to deformations.
        for k in 1..steps {
            let (head, tail) = out.split_at_mut(k * dim);
            vector::axpy(1.0, &head[(k - 1) * dim..], &mut tail[..dim]);
        }
    }
}
