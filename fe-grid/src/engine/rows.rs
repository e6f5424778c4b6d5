//! Rows of cells along `x`, with the lanes across the cells of a row.

use super::element::MAX_CORNERS;
use crate::{Element, Grid, Lane, MAX_LANES};

/// A row of cells: its index along `y` and along `z` (zero in two dimensions).
pub(crate) type Row = [usize; 2];

/// The rows of one layer of cells along the last axis, in order.
#[inline(always)]
pub(crate) fn rows_of_layer<const D: usize>(
    grid: &Grid<D>,
    layer: usize,
) -> impl Iterator<Item = Row> + use<D> {
    let rows = if D == 3 { grid.cells_per_axis()[1] } else { 1 };
    (0..rows).map(move |row| if D == 3 { [row, layer] } else { [layer, 0] })
}

/// Position in memory of the first cell of a row.
#[inline(always)]
pub(crate) fn first_cell<const D: usize>(grid: &Grid<D>, row: Row) -> usize {
    let cells = grid.cells_per_axis();
    (row[1] * cells[1] + row[0]) * cells[0]
}

/// Position in memory of the first node of a row of cells, on the side that the bits of corner
/// `c` beyond the first say.
#[inline(always)]
pub(crate) fn first_node<const D: usize>(grid: &Grid<D>, [j, k]: Row, c: usize) -> usize {
    let n = grid.nodes_per_axis();
    let j = j + (c >> 1 & 1);
    if D == 3 {
        ((k + (c >> 2)) * n[1] + j) * n[0]
    } else {
        j * n[0]
    }
}

/// Corner values of the cells `i, i+1, ...` of a row, zero beyond its end.
#[inline(always)]
pub(crate) fn gather<T: Element, L: Lane<Element = T>, const D: usize>(
    grid: &Grid<D>,
    field: &[T],
    row: Row,
    i: usize,
) -> [L; MAX_CORNERS] {
    let length = grid.cells_per_axis()[0];
    let mut corners = [L::zero(); MAX_CORNERS];
    for c in 0..1 << D {
        let start = first_node(grid, row, c) + (c & 1);
        corners[c] = L::load(&field[start + i..start + length]);
    }
    corners
}

/// `0, 1, 2, ...` across the lanes.
#[inline(always)]
pub(crate) fn iota<L: Lane>() -> L {
    let mut numbers = [L::Element::default(); MAX_LANES];
    for (i, x) in numbers.iter_mut().enumerate() {
        *x = L::Element::from_f64(i as f64);
    }
    L::load(&numbers)
}
