//! Restriction of a step such that a deformation stays injective.
//!
//! A step that folds a few cells is not shortened everywhere by [`restrain_together`]: it is damped
//! around these cells, over a distance that grows with the step, so that the damping itself does not
//! fold other cells. [`shorten_together`] shortens it everywhere.

use crate::certificate::{certify_within, violations};
use crate::compiled_once;
use crate::grid::Grid;
use crate::nearest::squared_distances;
use crate::parallel;
use crate::vector;
use std::ops::Range;

/// Maximal number of rounds of local damping; afterwards the whole step is shortened.
const LOCAL_ROUNDS: usize = 12;
/// Maximal number of halvings of the whole step; afterwards it is zero.
const GLOBAL_ROUNDS: usize = 20;
/// Factor of one round at the cells that fold.
const DAMPING: f64 = 0.5;
/// Minimal distance in cells up to which the step is damped around a fold; three times the length
/// of the step is added.
const LEAST_REACH: f64 = 2.0;
/// If more than this fraction of all cells fold, the whole step is shortened.
const MOST_VIOLATIONS: f64 = 0.05;

/// A deformation that must not fold.
pub struct Restrained<'a> {
    /// Its displacement.
    pub displacement: &'a [f64],
    /// The range of the change of the displacement in the step.
    pub range: Range<usize>,
    /// The cells that must not fold; `None` for all.
    pub within: Option<&'a [bool]>,
}

/// Damps `step` such that `det D(id + u + step)` exceeds `threshold` on the cells that `within`
/// marks, or on all cells, provided that `det D(id + u)` does.
///
/// # Panics
/// If displacement and step do not have `D` components of the grid.
pub fn restrain_step<const D: usize>(
    grid: &Grid<D>,
    displacement: &[f64],
    step: &mut [f64],
    threshold: f64,
    within: Option<&[bool]>,
) {
    let only = Restrained {
        displacement,
        range: 0..step.len(),
        within,
    };
    restrain_together(grid, &[only], step, threshold);
}

compiled_once! {
    /// Like [`restrain_step`] for a step that changes several deformations and other nodal fields:
    /// the factor at a node is the same for all of them, so that coupled changes are damped
    /// together.
    ///
    /// # Panics
    /// If a displacement or a range does not have `D` components of the grid, or the length of the
    /// step is not a multiple of the number of nodes.
    pub fn restrain_together<'a, D>(
        grid: &'a Grid<D>,
        deformations: &'a [Restrained<'a>],
        step: &'a mut [f64],
        threshold: f64,
    ) = restrain_in;
}

fn restrain_in<const D: usize>(
    grid: &Grid<D>,
    deformations: &[Restrained<'_>],
    step: &mut [f64],
    threshold: f64,
) {
    let n = grid.n_nodes();
    assert_eq!(step.len() % n, 0);
    let most = (MOST_VIOLATIONS * grid.n_cells() as f64) as usize;
    for round in 0..LOCAL_ROUNDS {
        let folding: Vec<Vec<usize>> = parallel::map(deformations, &|d| {
            violations(grid, &trial(grid, d, step), threshold, d.within)
        });
        if folding.iter().all(Vec::is_empty) {
            return;
        }
        if folding.iter().any(|cells| cells.len() > most) {
            vector::scale(DAMPING, step);
            continue;
        }
        let mut factor = vec![1.0; n];
        for (deformation, cells) in deformations.iter().zip(&folding) {
            let longest = longest(grid, &step[deformation.range.clone()], cells);
            let reach = LEAST_REACH + round as f64 + 3.0 * longest;
            damp(grid, cells, reach, &mut factor);
        }
        for component in step.chunks_exact_mut(n) {
            for (s, f) in component.iter_mut().zip(&factor) {
                *s *= f;
            }
        }
    }
    shorten_in(grid, deformations, step, threshold);
}

compiled_once! {
    /// Like [`restrain_together`], but the whole step is halved until no deformation folds, so that it
    /// keeps its direction; it is zero if twenty times do not suffice.
    ///
    /// # Panics
    /// As for [`restrain_together`].
    pub fn shorten_together<'a, D>(
        grid: &'a Grid<D>,
        deformations: &'a [Restrained<'a>],
        step: &'a mut [f64],
        threshold: f64,
    ) = shorten_in;
}

fn shorten_in<const D: usize>(
    grid: &Grid<D>,
    deformations: &[Restrained<'_>],
    step: &mut [f64],
    threshold: f64,
) {
    assert_eq!(step.len() % grid.n_nodes(), 0);
    for _ in 0..GLOBAL_ROUNDS {
        let holds = parallel::all(deformations, &|d| {
            let trial = trial(grid, d, step);
            certify_within(grid, &trial, threshold, threshold, d.within).certified
        });
        if holds {
            return;
        }
        vector::scale(0.5, step);
    }
    step.fill(0.0);
}

/// The displacement after a step.
fn trial<const D: usize>(grid: &Grid<D>, deformation: &Restrained<'_>, step: &[f64]) -> Vec<f64> {
    let mut trial = vec![0.0; D * grid.n_nodes()];
    add(
        deformation.displacement,
        &step[deformation.range.clone()],
        &mut trial,
    );
    trial
}

fn add(u: &[f64], step: &[f64], out: &mut [f64]) {
    for ((o, u), s) in out.iter_mut().zip(u).zip(step) {
        *o = u + s;
    }
}

/// Returns the largest component of a step at the first corners of some cells, in units of the
/// spacing.
fn longest<const D: usize>(grid: &Grid<D>, step: &[f64], cells: &[usize]) -> f64 {
    let n = grid.n_nodes();
    let largest = cells.iter().map(|&cell| {
        let node = grid.node_index(grid.cell(cell));
        (0..D).map(|k| step[k * n + node].abs()).fold(0.0, f64::max)
    });
    largest.fold(0.0, f64::max) / grid.spacing()
}

/// Reduces a factor to [`DAMPING`] at the cells; it increases linearly to one over `reach` cells.
fn damp<const D: usize>(grid: &Grid<D>, cells: &[usize], reach: f64, factor: &mut [f64]) {
    if cells.is_empty() {
        return;
    }
    let nodes = grid.nodes_per_axis();
    // A step that is not finite reaches everything.
    let longest = nodes.into_iter().max().unwrap_or(0);
    let radius = (reach.ceil() as usize).min(longest);
    // The nodes about the cells that can be nearer than `reach`.
    let (mut first, mut last) = (nodes, [0; D]);
    for cell in cells.iter().map(|&cell| grid.cell(cell)) {
        for k in 0..D {
            first[k] = first[k].min(cell[k].saturating_sub(radius));
            last[k] = last[k].max((cell[k] + 1 + radius).min(nodes[k] - 1));
        }
    }
    let count: [usize; D] = std::array::from_fn(|k| last[k] + 1 - first[k]);
    let about = |node: [usize; D]| {
        (0..D)
            .rev()
            .fold(0, |i, k| i * count[k] + node[k] - first[k])
    };
    let mut squared = vec![f64::INFINITY; count.iter().product()];
    for cell in cells.iter().map(|&cell| grid.cell(cell)) {
        for corner in 0..1 << D {
            squared[about(std::array::from_fn(|k| cell[k] + (corner >> k & 1)))] = 0.0;
        }
    }
    squared_distances(count, &mut squared);
    for (mut code, squared) in squared.into_iter().enumerate() {
        let node = std::array::from_fn(|k| {
            let i = first[k] + code % count[k];
            code /= count[k];
            i
        });
        let share = (f64::sqrt(squared) / reach).min(1.0);
        let damped = DAMPING + (1.0 - DAMPING) * share;
        let index = grid.node_index(node);
        factor[index] = f64::min(factor[index], damped);
    }
}
