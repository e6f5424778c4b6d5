//! Restraining a step so that a deformation stays injective.
//!
//! A step that folds a few cells need not be shortened everywhere: it is damped around the cells
//! that would fold, over a distance that grows with the step, so that the damping itself does
//! not fold others.

use crate::certificate::{certify_within, violations};
use crate::grid::Grid;
use crate::parallel;
use std::ops::Range;

/// Rounds of local damping before the whole step is shortened.
const LOCAL_ROUNDS: usize = 12;
/// Halvings of the whole step before it is given up.
const GLOBAL_ROUNDS: usize = 20;
/// Damping of one round at the cells that fold.
const DAMPING: f64 = 0.5;
/// Cells around a fold that are damped, beside three times the step's length in cells.
const LEAST_REACH: f64 = 2.0;
/// More folding cells than this share of all are a matter for a shorter step.
const MOST_VIOLATIONS: f64 = 0.05;

/// A deformation that a step must not fold.
pub struct Restrained<'a> {
    /// Its displacement.
    pub displacement: &'a [f64],
    /// Where the change of the displacement stands in the step.
    pub range: Range<usize>,
    /// The cells that must not fold; all where there is no list.
    pub within: Option<&'a [bool]>,
}

/// Shortens `step` where needed, so that `det D(id + u + step)` exceeds `threshold` on the cells
/// that `within` marks, or on all cells. Where the displacement `u` itself does, the step that is
/// left can be taken.
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

/// Like [`restrain_step`] for a step that changes several deformations, and other nodal fields with
/// them: all fields are damped by the same factor at a node, so that coupled changes remain
/// consistent.
///
/// # Panics
/// If a displacement or a range does not have `D` components of the grid, or the step is no whole
/// number of nodal fields.
pub fn restrain_together<const D: usize>(
    grid: &Grid<D>,
    deformations: &[Restrained<'_>],
    step: &mut [f64],
    threshold: f64,
) {
    let n = grid.n_nodes();
    assert_eq!(step.len() % n, 0);
    let trial = |deformation: &Restrained<'_>, step: &[f64]| {
        let mut trial = vec![0.0; D * n];
        add(
            deformation.displacement,
            &step[deformation.range.clone()],
            &mut trial,
        );
        trial
    };
    let most = (MOST_VIOLATIONS * grid.n_cells() as f64) as usize;
    for round in 0..LOCAL_ROUNDS {
        let folding: Vec<Vec<usize>> = parallel::map(deformations, &|d| {
            violations(grid, &trial(d, step), threshold, d.within)
        });
        if folding.iter().all(Vec::is_empty) {
            return;
        }
        if folding.iter().any(|cells| cells.len() > most) {
            scale(step, DAMPING);
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
    for _ in 0..GLOBAL_ROUNDS {
        let holds = parallel::all(deformations, &|d| {
            certify_within(grid, &trial(d, step), threshold, threshold, d.within).certified
        });
        if holds {
            return;
        }
        scale(step, 0.5);
    }
    step.fill(0.0);
}

fn add(u: &[f64], step: &[f64], out: &mut [f64]) {
    for ((o, u), s) in out.iter_mut().zip(u).zip(step) {
        *o = u + s;
    }
}

fn scale(step: &mut [f64], factor: f64) {
    for s in step {
        *s *= factor;
    }
}

/// The longest step at a first corner of the given cells, in units of the spacing.
fn longest<const D: usize>(grid: &Grid<D>, step: &[f64], cells: &[usize]) -> f64 {
    let n = grid.n_nodes();
    let largest = cells.iter().map(|&cell| {
        let node = grid.node_index(grid.cell(cell));
        (0..D).map(|k| step[k * n + node].abs()).fold(0.0, f64::max)
    });
    largest.fold(0.0, f64::max) / grid.spacing()
}

/// Lowers a factor to [`DAMPING`] at the cells, from one at `reach` cells from them, linearly.
fn damp<const D: usize>(grid: &Grid<D>, cells: &[usize], reach: f64, factor: &mut [f64]) {
    let nodes = grid.nodes_per_axis();
    let radius = reach.ceil() as usize;
    for &cell in cells {
        let cell = grid.cell(cell);
        let first: [usize; D] = std::array::from_fn(|k| cell[k].saturating_sub(radius));
        let count: [usize; D] =
            std::array::from_fn(|k| (cell[k] + 1 + radius).min(nodes[k] - 1) + 1 - first[k]);
        for mut code in 0..count.iter().product() {
            let mut squared = 0.0;
            let node: [usize; D] = std::array::from_fn(|k| {
                let i = first[k] + code % count[k];
                code /= count[k];
                // Distance from the cell, zero at its own corners.
                let away = (cell[k].saturating_sub(i)).max(i.saturating_sub(cell[k] + 1)) as f64;
                squared += away * away;
                i
            });
            let share = (f64::sqrt(squared) / reach).min(1.0);
            let damped = DAMPING + (1.0 - DAMPING) * share;
            let index = grid.node_index(node);
            factor[index] = f64::min(factor[index], damped);
        }
    }
}
