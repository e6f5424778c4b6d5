//! Transfer between a grid and the grid with half its spacing.
//!
//! The spaces are nested: prolongation expresses a coarse function exactly in the fine basis.
//! Restriction is its transpose and acts on functionals (gradients, residuals); nodal functions are
//! restricted by [`inject_into`]. All operations proceed axis by axis.

use crate::grid::Grid;
use crate::lane::Element;
use crate::parallel;

/// Minimal number of values per task.
const MIN_PARALLEL: usize = 4096;

/// Prolongs a coarse nodal field of any number of components to the fine grid.
///
/// # Panics
/// If `coarse` and `fine` do not have the same number of components on the two grids.
pub fn prolong_into<T: Element, const D: usize>(
    coarse_grid: &Grid<D>,
    coarse: &[T],
    fine: &mut [T],
) {
    let mut sizes = coarse_grid.nodes_per_axis();
    let fine_sizes = coarse_grid.finer().nodes_per_axis();
    let components = coarse.len() / coarse_grid.n_nodes();
    assert_eq!(components * coarse_grid.n_nodes(), coarse.len());
    assert_eq!(components * coarse_grid.finer().n_nodes(), fine.len());
    let mut current = coarse.to_vec();
    // The fastest axis first, as it has no rows that can be processed at a time: the array is still
    // small.
    for k in 0..D {
        let inner: usize = sizes[..k].iter().product();
        let (n, m) = (sizes[k], fine_sizes[k]);
        let half = T::from_f64(0.5);
        let mut next = vec![T::default(); current.len() / n * m];
        let source = &current;
        let work = |line: usize, out: &mut [T]| {
            let source = &source[line * n * inner..(line + 1) * n * inner];
            for (j, row) in out.chunks_exact_mut(inner).enumerate() {
                let low = &source[j / 2 * inner..][..inner];
                if j % 2 == 0 {
                    row.copy_from_slice(low);
                } else {
                    let high = &source[(j / 2 + 1) * inner..][..inner];
                    for ((r, &a), &b) in row.iter_mut().zip(low).zip(high) {
                        *r = (a + b) * half;
                    }
                }
            }
        };
        let lines = MIN_PARALLEL.div_ceil(m * inner);
        parallel::for_each_chunk(&mut next, m * inner, lines, &work);
        current = next;
        sizes[k] = m;
    }
    fine.copy_from_slice(&current);
}

/// Applies the transpose of [`prolong_into`].
///
/// # Panics
/// If `coarse` and `fine` do not have the same number of components on the two grids.
pub fn restrict_into<T: Element, const D: usize>(
    coarse_grid: &Grid<D>,
    fine: &[T],
    coarse: &mut [T],
) {
    let mut sizes = coarse_grid.finer().nodes_per_axis();
    let coarse_sizes = coarse_grid.nodes_per_axis();
    let components = coarse.len() / coarse_grid.n_nodes();
    assert_eq!(components * coarse_grid.n_nodes(), coarse.len());
    assert_eq!(components * coarse_grid.finer().n_nodes(), fine.len());
    let half = T::from_f64(0.5);
    let mut buffer: Option<Vec<T>> = None;
    // The fastest axis last, when the array is small.
    for k in (0..D).rev() {
        let inner: usize = sizes[..k].iter().product();
        let (n, m) = (sizes[k], coarse_sizes[k]);
        let source: &[T] = buffer.as_deref().unwrap_or(fine);
        let mut next = vec![T::default(); source.len() / n * m];
        let work = |line: usize, out: &mut [T]| {
            let source = &source[line * n * inner..(line + 1) * n * inner];
            for (j, row) in out.chunks_exact_mut(inner).enumerate() {
                let own = &source[2 * j * inner..][..inner];
                row.copy_from_slice(own);
                if j > 0 {
                    for (r, &a) in row.iter_mut().zip(&source[(2 * j - 1) * inner..][..inner]) {
                        *r += a * half;
                    }
                }
                if j + 1 < m {
                    for (r, &b) in row.iter_mut().zip(&source[(2 * j + 1) * inner..][..inner]) {
                        *r += b * half;
                    }
                }
            }
        };
        let lines = MIN_PARALLEL.div_ceil(n * inner);
        parallel::for_each_chunk(&mut next, m * inner, lines, &work);
        buffer = Some(next);
        sizes[k] = m;
    }
    coarse.copy_from_slice(buffer.as_deref().unwrap_or(fine));
}

/// Copies the values of a fine nodal field at the nodes of the coarse grid.
///
/// # Panics
/// If `coarse` and `fine` do not have the same number of components on the two grids.
pub fn inject_into<T: Element, const D: usize>(
    coarse_grid: &Grid<D>,
    fine: &[T],
    coarse: &mut [T],
) {
    let fine_grid = coarse_grid.finer();
    let (n, m) = (coarse_grid.n_nodes(), fine_grid.n_nodes());
    assert_eq!(coarse.len() / n, fine.len() / m);
    for (coarse, fine) in coarse.chunks_exact_mut(n).zip(fine.chunks_exact(m)) {
        for (i, x) in coarse.iter_mut().enumerate() {
            *x = fine[fine_grid.node_index(coarse_grid.node(i).map(|j| 2 * j))];
        }
    }
}

/// Computes the means of cell data over the `2^D` children of every coarse cell.
///
/// # Panics
/// If there is not one value per cell of the fine grid.
pub fn average_cells<T: Element, const D: usize>(coarse_grid: &Grid<D>, fine: &[T]) -> Vec<T> {
    let fine_grid = coarse_grid.finer();
    assert_eq!(fine.len(), fine_grid.n_cells());
    let share = 1.0 / f64::from(1u32 << D);
    let mut means = vec![T::default(); coarse_grid.n_cells()];
    parallel::for_each_chunk(&mut means, MIN_PARALLEL, 1, &|chunk, means| {
        for (i, mean) in means.iter_mut().enumerate() {
            let cell = coarse_grid.cell(chunk * MIN_PARALLEL + i);
            let sum: f64 = (0..1usize << D)
                .map(|c| {
                    let child = std::array::from_fn(|k| 2 * cell[k] + (c >> k & 1));
                    fine[fine_grid.cell_index(child)].to_f64()
                })
                .sum();
            *mean = T::from_f64(share * sum);
        }
    });
    means
}
