//! The Gauss–Newton metric of a path on its start domain.
//!
//! In the increments `d_k = psi_k - psi_{k-1}` the Hessian of the path is, for moderate strains,
//! block diagonal but for the match of the last deformation, which is the sum of all of them:
//!
//! ```text
//! H = K diag(A_1, ..., A_K) + eta (1 1^T) x M,
//! ```
//!
//! with the elastic forms `A_k` and the Gauss–Newton matrix `M` of the match. With one form `A`
//! for all steps, taken at the end of the path, the common increment of all steps and the
//! differences between them decouple:
//!
//! ```text
//! H^-1 = (1 1^T / K^2) x (A + eta M)^-1 + (1 - 1 1^T / K) x (K A)^-1,
//! ```
//!
//! each inverse one multigrid cycle on a corotational form. It is symmetric and positive definite
//! for any two such cycles.

use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::multigrid::{Multigrid, MultigridParams, WorkSpace};
use fe_grid::{
    CellProbe, Data, Grid, GridError, Lane, LinearOperator, Point, Reads, probe_cells, tensor,
    vector,
};
use hyperelastic::{Corotational, LameModuli, polar_rotation};
use levelset::Step;
use rayon::prelude::*;

use crate::HeavisideMatch;

/// Share of the void's stiffness that regularises the metric.
const REGULARISATION: f64 = 1e-3;
/// Least stiffness of the void in the metric: the void has to give way without folding.
const METRIC_VOID_STIFFNESS: f64 = 0.1;

/// What the metric is made of.
pub(crate) struct MetricParts<'a, const D: usize> {
    pub grid: Grid<D>,
    pub moduli: LameModuli,
    pub indicator: Step,
    pub match_weight: f64,
    pub density: HeavisideMatch,
    /// The level set of the start shape.
    pub start: &'a [f64],
    /// The level set of the end shape.
    pub end: Interpolant<'a, f64, D>,
    pub steps: usize,
}

type Cycle<const D: usize> = Multigrid<f32, Corotational<D>, D, D>;

/// The inverse metric.
pub(crate) struct PathMetric<const D: usize> {
    common: Cycle<D>,
    differences: Option<Cycle<D>>,
    steps: usize,
}

impl<const D: usize> PathMetric<D> {
    /// The metric at the displacement of the last deformation.
    pub fn new(parts: &MetricParts<'_, D>, last: &[f64]) -> Result<Self, GridError> {
        let law = Corotational {
            moduli: parts.moduli,
            regularisation: REGULARISATION * METRIC_VOID_STIFFNESS,
        };
        let work_space = WorkSpace::default();
        let make = |match_weight| {
            let probe = PathProbe {
                indicator: parts.indicator,
                density: parts.density,
                match_weight,
                end: parts.end,
            };
            let coefficients = [parts.start];
            let data = Data {
                coefficients: &coefficients,
                cells: &[],
            };
            let cells = probe_cells(&parts.grid, &probe, data, last);
            let cycle = Multigrid::new(parts.grid, &law, cells, MultigridParams::default())?;
            Ok::<_, GridError>(cycle.with_work_space(work_space.clone()))
        };
        Ok(Self {
            common: make(parts.match_weight)?,
            differences: (parts.steps > 1).then(|| make(0.0)).transpose()?,
            steps: parts.steps,
        })
    }

    /// `out = H^-1 gradient`, for the displacements of all deformations.
    pub fn apply_into(&self, gradient: &[f64], out: &mut [f64]) {
        let steps = self.steps;
        let dim = gradient.len() / steps;
        // The gradient by the increments: sums from the end.
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
            out.par_chunks_exact_mut(dim)
                .zip(solved.par_chunks_exact_mut(dim))
                .for_each(|(part, solved)| {
                    vector::axpy(-1.0 / count, &total, part);
                    differences.apply_into(part, solved);
                });
            total.fill(0.0);
            for part in solved.chunks_exact(dim) {
                vector::axpy(1.0 / count, part, &mut total);
            }
            out.par_chunks_exact_mut(dim)
                .zip(solved.par_chunks_exact(dim))
                .for_each(|(out, solved)| {
                    for (((out, s), mean), c) in out.iter_mut().zip(solved).zip(&total).zip(&common)
                    {
                        *out = (s - mean) / count + c / (count * count);
                    }
                });
        } else {
            vector::copy_into(&common, out);
        }
        // From increments back to deformations.
        for k in 1..steps {
            let (head, tail) = out.split_at_mut(k * dim);
            vector::axpy(1.0, &head[(k - 1) * dim..], &mut tail[..dim]);
        }
    }
}

/// The data of [`Corotational`] at the last deformation of a path.
struct PathProbe<'a, const D: usize> {
    indicator: Step,
    density: HeavisideMatch,
    match_weight: f64,
    end: Interpolant<'a, f64, D>,
}

impl<const D: usize> Reads for PathProbe<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for PathProbe<'_, D> {
    const OUTPUTS: usize = Corotational::<D>::CELL_DATA;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let mut out = [L::zero(); MAX_CELL_DATA];
        let chi = self.indicator.value(point.coefficient[0]);
        let void = L::splat(METRIC_VOID_STIFFNESS);
        out[0] = chi.mul_add(L::one() - void, void);
        for i in 0..D {
            for k in 0..D {
                out[1 + i * D + k] = point.gradient[i][k];
            }
        }
        if self.match_weight > 0.0 {
            let mut deformed = point.position;
            for k in 0..D {
                deformed[k] += point.value[k];
            }
            let (s, slope) = self.end.sample(&deformed);
            let (_, _, curvature) = self.density.derivatives(s, &point.coefficient);
            let curvature = curvature.scale(self.match_weight);
            for i in 0..D {
                for j in i..D {
                    out[Corotational::<D>::mass_entry(i, j)] = curvature * slope[i] * slope[j];
                }
            }
        }
        out
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, mut means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        let mut gradient = tensor::zero::<L, D>();
        for i in 0..D {
            for k in 0..D {
                gradient[i][k] = means[1 + i * D + k];
            }
        }
        let rotation = polar_rotation(&tensor::add_identity(&gradient));
        for i in 0..D {
            for k in 0..D {
                means[1 + i * D + k] = rotation[i][k] * means[0];
            }
        }
        means
    }
}
