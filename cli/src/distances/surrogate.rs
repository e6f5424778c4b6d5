//! Cheap numbers that grow with the lengths of paths: elastic lengths of single steps on a coarse grid.
//!
//! The surrogate of a pair is `sqrt W` of one step from the shape of the smaller number to the other, by
//! the law and the weights of the paths, at the position of the pair, and in the common scale of lengths.
//! It is computed once for every pair that may be needed, and stored row by row (`surrogates/ROW.json`).

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use ::geodesic::{Form, GeodesicParams, Shape, geodesic_between};
use fe_grid::{Grid, parallel};
use serde::{Deserialize, Serialize};

use super::compute::Task;
use crate::error::CliError;

/// The folder of stored rows.
const SURROGATES: &str = "surrogates";
/// Cells along the longest side of their grid.
const MOST_CELLS: usize = 32;
const FEWEST_CELLS: usize = 16;
/// The rank of numbers is sought, not their digits.
const TOLERANCE: f64 = 1e-3;
const MAX_ITERATIONS: usize = 50;

/// The surrogates of pairs, as far as they have one.
pub(super) type Surrogates = HashMap<[usize; 2], f64>;

/// A row that is stored.
#[derive(Serialize, Deserialize)]
struct Row {
    /// The first shape of all pairs.
    first: usize,
    /// The other shapes.
    others: Vec<usize>,
    /// The surrogates of those of them that have one.
    values: Vec<(usize, f64)>,
}

impl Row {
    fn new(pairs: &[[usize; 2]], values: Vec<Option<f64>>) -> Self {
        let others: Vec<usize> = pairs.iter().map(|pair| pair[1]).collect();
        let known = others.iter().copied().zip(values);
        Self {
            first: pairs[0][0],
            values: known
                .filter_map(|(other, value)| Some((other, value?)))
                .collect(),
            others,
        }
    }

    /// Whether it is the row of these pairs.
    fn is_of(&self, pairs: &[[usize; 2]]) -> bool {
        let own = self.others.iter().map(|&other| [self.first, other]);
        own.eq(pairs.iter().copied())
    }
}

/// The grid of surrogates: with twice the spacing of this one, or more, down to at most [`MOST_CELLS`]
/// cells, but with no fewer than [`FEWEST_CELLS`].
fn coarse<const D: usize>(grid: &Grid<D>) -> Grid<D> {
    let cells = |grid: &Grid<D>| grid.cells_per_axis().into_iter().max().unwrap_or(0);
    let mut found = *grid;
    while let Some(next) = found.coarser() {
        let enough = cells(&found) <= MOST_CELLS && found != *grid;
        if enough || cells(&next) < FEWEST_CELLS {
            break;
        }
        found = next;
    }
    found
}

/// The surrogates of these pairs, which are sorted; `None` if interrupted. Finished rows are stored.
///
/// # Errors
/// Those of files.
pub(super) fn surrogates<const D: usize>(
    task: &Task<'_, D>,
    pairs: &[[usize; 2]],
) -> Result<Option<Surrogates>, CliError> {
    let session = task.session;
    let params = GeodesicParams {
        form: Form::Lagrangian,
        steps: 1,
        tolerance: task.config.params.tolerance.max(TOLERANCE),
        max_iterations: Some(MAX_ITERATIONS),
        ..task.config.params.clone()
    };
    let grid = coarse(&task.pairs.grid);
    let work = task.store.work();
    work.folder(SURROGATES)?;
    let (done, all) = (AtomicUsize::new(0), pairs.len());
    let mut found = Surrogates::new();
    for pairs in pairs.chunk_by(|a, b| a[0] == b[0]) {
        let name = name(pairs[0][0]);
        let stored = work.get::<Row>(&name).filter(|row| row.is_of(pairs));
        let row = if let Some(row) = stored {
            done.fetch_add(pairs.len(), Ordering::Relaxed);
            row
        } else {
            let values = parallel::map(pairs, &|&pair| {
                let done = done.fetch_add(1, Ordering::Relaxed);
                let words = format!("estimating {done} of {all} pairs");
                session.progress.stage(words);
                one_step(task, &grid, pair, &params)
            });
            if session.interrupt.asked() {
                return Ok(None);
            }
            let row = Row::new(pairs, values);
            work.put(&name, &row)?;
            row
        };
        let values = row.values.iter();
        found.extend(values.map(|&(other, value)| ([row.first, other], value)));
    }
    Ok(Some(found))
}

/// The length of a single step; `None` for shapes that the coarse grid does not resolve.
fn one_step<const D: usize>(
    task: &Task<'_, D>,
    grid: &Grid<D>,
    [i, j]: [usize; 2],
    params: &GeodesicParams,
) -> Option<f64> {
    if task.session.interrupt.asked() {
        return None;
    }
    let fields = task.pairs.sampled(i, j, *grid).ok()?;
    let [start, end] = fields.map(Shape::new);
    let mut observer = task.session.interrupt.clone();
    let path = geodesic_between(&start, &end, params, &mut observer).ok()?;
    let unit = task.pairs.magnification(i, j).powi(D as i32).sqrt();
    Some(path.length() / unit).filter(|length| length.is_finite())
}

fn name(row: usize) -> PathBuf {
    PathBuf::from(SURROGATES).join(format!("{row:03}.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_without_a_surrogate_are_stored_as_such() {
        let pairs = [[2, 5], [2, 6], [2, 9]];
        let row = Row::new(&pairs, vec![Some(0.5), None, Some(0.25)]);
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("002.json");
        // Files have no nulls.
        crate::output::write_json(&file, &row).unwrap();
        let text = std::fs::read_to_string(file).unwrap();
        let read: Row = serde_json::from_str(&text).unwrap();
        assert_eq!(read.values, [(5, 0.5), (9, 0.25)]);
        assert!(read.is_of(&pairs) && !read.is_of(&pairs[1..]) && !read.is_of(&pairs[..2]));
        assert!(!read.is_of(&[[1, 5], [1, 6], [1, 9]]));
    }

    #[test]
    fn surrogates_have_a_coarse_grid() {
        for (nodes, expected) in [(257, 33), (129, 33), (65, 33), (33, 17), (17, 17), (97, 25)] {
            let found = coarse(&Grid::<2>::cube(nodes));
            assert_eq!(found.nodes_per_axis(), [expected; 2], "{nodes}");
            assert_eq!(found.extent(), Grid::<2>::cube(nodes).extent());
        }
    }
}
