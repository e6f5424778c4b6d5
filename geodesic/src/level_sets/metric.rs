//! The inverse metric of a path of level sets.
//!
//! A sum of three inverses on parts of the path, each symmetric and positive semidefinite:
//!
//! - motions of the inner shapes that keep them matched ([`Transport`]), in the elastic energies
//!   of the steps: with `d_k = v_k - v_{k-1}` it is `K diag(A_k)` under the condition that the
//!   increments add up to zero;
//! - every deformation by itself, in its elastic energy and the Gauss–Newton matrix of its
//!   mismatch;
//! - the level sets by themselves, in their mismatches ([`Residual`]).
//!
//! The elastic forms are those of the deformed cells, and inverted by one multigrid cycle each.

use super::residual::Residual;
use super::state::Layout;
use super::transport::Transport;
use crate::metric::{ComposedLevel, ElasticForm, corotational};
use crate::shape::KnownEnds;
use fe_grid::composition::{Interpolant, Outside};
use fe_grid::multigrid::{MultigridParams, WorkSpace};
use fe_grid::{Grid, GridError, LinearOperator, parallel, vector};
use hyperelastic::{Corotational, CorotationalMultigrid, FoldBarrier, LameModuli};
use levelset::{Arctan, Step};

/// A mass, relative to the shear modulus, that controls rigid motions of the inner shapes, under which
/// the energy is invariant up to discretisation errors.
const GAUGE_MASS: f64 = 3.0;

/// Directions common to several parts are counted several times; the sum is scaled by this factor,
/// so that full steps are not too long.
const SHARE: f64 = 0.4;

/// The data of the metric.
pub(crate) struct MetricParts<'a, const D: usize> {
    pub grid: Grid<D>,
    pub moduli: LameModuli,
    pub indicator: Step,
    pub mismatch_weight: f64,
    pub barrier: FoldBarrier,
    pub step: Arctan,
    pub known: &'a KnownEnds<D>,
    pub state: &'a [f64],
    pub layout: Layout<D>,
}

/// The inverse metric.
pub(crate) struct LevelSetMetric<const D: usize> {
    layout: Layout<D>,
    transport: Transport<D>,
    elastic: Vec<CorotationalMultigrid<D>>,
    deformations: Vec<CorotationalMultigrid<D>>,
    residual: Residual<D>,
}

impl<const D: usize> LevelSetMetric<D> {
    /// Computes the metric at a path.
    pub fn new(parts: &MetricParts<'_, D>) -> Result<Self, GridError> {
        let (grid, layout) = (parts.grid, parts.layout);
        let steps = layout.steps;
        let work_space = WorkSpace::default();
        let make = |k: usize, mismatch_weight: f64| {
            let visibility = parts.known.in_step(k, steps);
            let composed: Vec<_> = (0..layout.components)
                .map(|i| ComposedLevel {
                    end: Interpolant::new(grid, &parts.state[layout.level_set(k, i)])
                        .with_outside(Outside::Falling),
                    visibility,
                    share: 1.0,
                })
                .collect();
            let form = ElasticForm {
                moduli: parts.moduli,
                indicator: parts.indicator,
                step: parts.step,
                stiffness: steps as f64,
                void_stiffness: Corotational::<D>::LEAST_VOID_STIFFNESS,
                barrier: parts.barrier,
                mismatch_weight,
                composed: &composed,
                carried: &[],
                attraction: 0.0,
            };
            let start = layout.union(parts.state, k - 1);
            let displacement = &parts.state[layout.displacement(k)];
            let (law, mut cells) = corotational(&grid, &form, &start, displacement);
            if mismatch_weight == 0.0 {
                let mass = GAUGE_MASS * steps as f64 * parts.moduli.mu;
                for i in 0..D {
                    cells[Corotational::<D>::mass_entry(i, i)].fill(mass as f32);
                }
            }
            let cycle = CorotationalMultigrid::new(grid, law, cells, MultigridParams::default())?;
            Ok::<_, GridError>(cycle.with_work_space(work_space.clone()))
        };
        let deformations = parallel::try_map(1..=steps, &|k| make(k, parts.mismatch_weight));
        let moving = if steps > 1 { steps } else { 0 };
        let elastic = parallel::try_map(1..=moving, &|k| make(k, 0.0));
        let weight = parts.mismatch_weight * grid.cell_volume();
        Ok(Self {
            layout,
            transport: Transport::new(grid, layout, parts.state),
            elastic: elastic?,
            deformations: deformations?,
            residual: Residual::new(layout, parts.state, parts.step, weight),
        })
    }

    /// Computes `out = P gradient`.
    pub fn apply_into(&self, gradient: &[f64], out: &mut [f64]) {
        let (n, steps) = (self.layout.nodes, self.layout.steps);
        out.fill(0.0);
        let (first, stride) = (self.layout.components * n, self.layout.stride());
        let parts = out[first..].chunks_exact_mut(stride);
        let parts = parts.zip(gradient[first..].chunks_exact(stride));
        parallel::for_each(parts.zip(&self.deformations), &|(
            (out, gradient),
            cycle,
        )| {
            cycle.apply_into(&gradient[..D * n], &mut out[..D * n]);
        });
        if steps > 1 {
            let mut velocities = self.transport.transpose(gradient);
            self.velocities(&mut velocities);
            self.transport.apply_add(&velocities, out);
        }
        self.residual.apply_add(gradient, out);
        vector::scale(SHARE, out);
    }

    /// Applies the inverse of the elastic energies for motions of the inner shapes.
    fn velocities(&self, v: &mut [f64]) {
        let dim = D * self.layout.nodes;
        let steps = self.layout.steps;
        let count = steps as f64;
        // Forces on the increments: sums from the end, zero on the last.
        let mut forces = vec![0.0; steps * dim];
        forces[..(steps - 1) * dim].copy_from_slice(v);
        for k in (0..steps - 1).rev() {
            let (head, tail) = forces.split_at_mut((k + 1) * dim);
            vector::axpy(1.0, &tail[..dim], &mut head[k * dim..]);
        }
        let mut increments = vec![0.0; steps * dim];
        remove_mean(&mut forces, dim, count);
        let parts = increments.chunks_exact_mut(dim);
        let parts = parts.zip(forces.chunks_exact(dim)).zip(&self.elastic);
        parallel::for_each(parts, &|((out, force), cycle)| {
            cycle.apply_into(force, out);
        });
        remove_mean(&mut increments, dim, count);
        let mut sum = vec![0.0; dim];
        for (v, increment) in v.chunks_exact_mut(dim).zip(increments.chunks_exact(dim)) {
            vector::axpy(1.0, increment, &mut sum);
            vector::copy_into(&sum, v);
        }
    }
}

/// Subtracts the mean of all parts from each.
fn remove_mean(parts: &mut [f64], dim: usize, count: f64) {
    let mut mean = vec![0.0; dim];
    for part in parts.chunks_exact(dim) {
        vector::axpy(1.0 / count, part, &mut mean);
    }
    for part in parts.chunks_exact_mut(dim) {
        vector::axpy(-1.0, &mean, part);
    }
}
