//! Rows of cells along `x`, with the lanes across the cells of a row.

use super::element::MAX_CORNERS;
use crate::grid::Grid;
use crate::lane::{Element, Lane, MAX_LANES};

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

/// The rows of nodes around a row of cells: one slice for each corner of the face across `x`.
#[derive(Clone, Copy)]
pub(crate) struct NodeRows<'a, T>([&'a [T]; MAX_CORNERS / 2]);

impl<'a, T: Element> NodeRows<'a, T> {
    #[inline(always)]
    pub fn new<const D: usize>(grid: &Grid<D>, field: &'a [T], row: Row) -> Self {
        let nodes = grid.nodes_per_axis()[0];
        let mut rows = [field; MAX_CORNERS / 2];
        for (side, nodes_of_side) in rows.iter_mut().enumerate().take(1 << (D - 1)) {
            *nodes_of_side = &field[first_node(grid, row, 2 * side)..][..nodes];
        }
        Self(rows)
    }

    /// No rows, for fields that nothing is read from.
    pub fn none() -> Self {
        Self([&[]; MAX_CORNERS / 2])
    }

    /// Corner values of the cells `i, i+1, ...`; without meaning in lanes beyond the last cell.
    #[inline(always)]
    pub fn corners<L: Lane<Element = T>, const D: usize>(&self, i: usize) -> [L; MAX_CORNERS] {
        let mut corners = [L::zero(); MAX_CORNERS];
        for side in 0..1 << (D - 1) {
            let nodes = &self.0[side][i..];
            // The same twice: in the first case all loads are whole, which one comparison shows.
            if nodes.len() > L::COUNT {
                corners[2 * side] = L::load(nodes);
                corners[2 * side + 1] = L::load(&nodes[1..]);
            } else {
                corners[2 * side] = L::load(nodes);
                corners[2 * side + 1] = L::load(nodes.get(1..).unwrap_or(&[]));
            }
        }
        corners
    }
}

/// The first cells of the blocks that a row of cells is worked in. The last block is moved back
/// to end with the row where it can be, so that whole registers are read and written; cells that
/// are then visited twice get the same numbers twice.
#[inline(always)]
pub(crate) fn block_starts<L: Lane>(length: usize) -> impl Iterator<Item = usize> {
    let last = length.saturating_sub(L::COUNT);
    (0..length).step_by(L::COUNT).map(move |i| i.min(last))
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
