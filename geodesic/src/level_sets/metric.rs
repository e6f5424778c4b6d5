//! The inverse metric of a path of level sets.
//!
//! A sum of three inverses on parts of the path, each symmetric and not negative:
//!
//! - motions of the inner shapes that keep them matched ([`Transport`]), in the elastic energies
//!   of the steps: with `d_k = v_k - v_{k-1}` it is `K diag(A_k)` under the condition that the
//!   increments add up to zero;
//! - every deformation by itself, in its elastic energy and the Gauss–Newton matrix of its match;
//! - every level set by itself, in the diagonal of the matches on its two sides.
//!
//! The elastic forms are corotational, and inverted by one multigrid cycle each.

use super::transport::{Transport, displacement, level_set};
use crate::metric::{ElasticForm, corotational};
use fe_grid::composition::{Interpolant, Outside};
use fe_grid::multigrid::{Multigrid, MultigridParams, WorkSpace};
use fe_grid::{Grid, GridError, LinearOperator, vector};
use hyperelastic::{Corotational, LameModuli};
use levelset::{Arctan, Step};
use rayon::prelude::*;

/// Least weight of a level set's node, relative to that of a node on the boundary: far from it
/// the match hardly holds the level set, and it should stay.
const LEAST_NODE_WEIGHT: f64 = 0.05;

/// A mass, relative to the stiffness, that holds inner shapes against rigid motions, to which the
/// energy is indifferent but for what the grid makes of them.
const GAUGE_MASS: f32 = 3.0;

/// What the metric is made of.
pub(crate) struct MetricParts<'a, const D: usize> {
    pub grid: Grid<D>,
    pub moduli: LameModuli,
    pub indicator: Step,
    pub match_weight: f64,
    pub step: Arctan,
    pub state: &'a [f64],
    pub steps: usize,
}

type Cycle<const D: usize> = Multigrid<f32, Corotational<D>, D, D>;

/// The inverse metric.
pub(crate) struct LevelSetMetric<const D: usize> {
    grid: Grid<D>,
    steps: usize,
    transport: Transport<D>,
    elastic: Vec<Cycle<D>>,
    matched: Vec<Cycle<D>>,
    /// For every inner level set the inverse weights of its nodes.
    node_inverses: Vec<Vec<f64>>,
}

impl<const D: usize> LevelSetMetric<D> {
    /// The metric at a path.
    pub fn new(parts: &MetricParts<'_, D>) -> Result<Self, GridError> {
        let (grid, steps) = (parts.grid, parts.steps);
        let n = grid.n_nodes();
        let work_space = WorkSpace::default();
        let make = |k: usize, match_weight: f64| {
            let target = &parts.state[level_set(n, D, k)];
            let form = ElasticForm {
                moduli: parts.moduli,
                indicator: parts.indicator,
                step: parts.step,
                stiffness: steps as f64,
                match_weight,
                end: Interpolant::new(grid, target).with_outside(Outside::Falling),
            };
            let start = &parts.state[level_set(n, D, k - 1)];
            let (law, mut cells) =
                corotational(&grid, &form, start, &parts.state[displacement(n, D, k)]);
            if match_weight == 0.0 {
                for i in 0..D {
                    cells[Corotational::<D>::mass_entry(i, i)].fill(GAUGE_MASS * steps as f32);
                }
            }
            let cycle = Multigrid::new(grid, &law, cells, MultigridParams::default())?;
            Ok::<_, GridError>(cycle.with_work_space(work_space.clone()))
        };
        let matched: Result<Vec<_>, _> = (1..=steps)
            .into_par_iter()
            .map(|k| make(k, parts.match_weight))
            .collect();
        let elastic: Result<Vec<_>, _> = (1..=steps)
            .into_par_iter()
            .filter(|_| steps > 1)
            .map(|k| make(k, 0.0))
            .collect();
        let node_inverses = (1..steps)
            .map(|k| {
                let u = &parts.state[level_set(n, D, k)];
                let most = parts.step.derivative(0.0f64).powi(2);
                u.iter()
                    .map(|&u| {
                        let slope = parts
                            .step
                            .derivative(u)
                            .powi(2)
                            .max(LEAST_NODE_WEIGHT * most);
                        1.0 / (4.0 * parts.match_weight * grid.cell_volume() * slope)
                    })
                    .collect()
            })
            .collect();
        Ok(Self {
            grid,
            steps,
            transport: Transport::new(grid, parts.state, steps),
            elastic: elastic?,
            matched: matched?,
            node_inverses,
        })
    }

    /// `out = P gradient`.
    pub fn apply_into(&self, gradient: &[f64], out: &mut [f64]) {
        let n = self.grid.n_nodes();
        out.fill(0.0);
        for k in 1..self.steps {
            let range = level_set(n, D, k);
            let parts = gradient[range.clone()]
                .iter()
                .zip(&self.node_inverses[k - 1]);
            for (o, (g, w)) in out[range].iter_mut().zip(parts) {
                *o = g * w;
            }
        }
        out[n..]
            .par_chunks_exact_mut((D + 1) * n)
            .zip(gradient[n..].par_chunks_exact((D + 1) * n))
            .zip(&self.matched)
            .for_each(|((out, gradient), cycle)| {
                cycle.apply_into(&gradient[..D * n], &mut out[..D * n]);
            });
        if self.steps > 1 {
            let mut velocities = self.transport.transpose(gradient);
            self.velocities(&mut velocities);
            self.transport.apply_add(&velocities, out);
        }
    }

    /// The inverse of the elastic energies for motions of the inner shapes.
    fn velocities(&self, v: &mut [f64]) {
        let dim = D * self.grid.n_nodes();
        let steps = self.steps;
        let count = steps as f64;
        // Forces on the increments: sums from the end, none on the last.
        let mut forces = vec![0.0; steps * dim];
        forces[..(steps - 1) * dim].copy_from_slice(v);
        for k in (0..steps - 1).rev() {
            let (head, tail) = forces.split_at_mut((k + 1) * dim);
            vector::axpy(1.0, &tail[..dim], &mut head[k * dim..]);
        }
        let mut increments = vec![0.0; steps * dim];
        remove_mean(&mut forces, dim, count);
        increments
            .par_chunks_exact_mut(dim)
            .zip(forces.par_chunks_exact(dim))
            .zip(&self.elastic)
            .for_each(|((out, force), cycle)| cycle.apply_into(force, out));
        remove_mean(&mut increments, dim, count);
        let mut sum = vec![0.0; dim];
        for (v, increment) in v.chunks_exact_mut(dim).zip(increments.chunks_exact(dim)) {
            vector::axpy(1.0, increment, &mut sum);
            vector::copy_into(&sum, v);
        }
    }
}

/// Takes the mean of all parts from each.
fn remove_mean(parts: &mut [f64], dim: usize, count: f64) {
    let mut mean = vec![0.0; dim];
    for part in parts.chunks_exact(dim) {
        vector::axpy(1.0 / count, part, &mut mean);
    }
    for part in parts.chunks_exact_mut(dim) {
        vector::axpy(-1.0, &mean, part);
    }
}
