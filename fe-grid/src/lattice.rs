//! Points at regular distances in the box of a grid.

use crate::grid::Grid;

/// Points in a box at regular distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice<const D: usize> {
    /// Number of points along each axis.
    pub(crate) count: [usize; D],
    /// Number of points in a spacing of the grid.
    per_cell: f64,
    /// Position of the first point, in distances of points.
    first: f64,
}

impl<const D: usize> Lattice<D> {
    /// The nodes of a grid.
    pub(crate) fn nodes(grid: &Grid<D>) -> Self {
        Self {
            count: grid.nodes_per_axis(),
            per_cell: 1.0,
            first: 0.0,
        }
    }

    /// The midpoints of the `parts^D` equal parts of every cell.
    pub fn midpoints(grid: &Grid<D>, parts: usize) -> Self {
        Self {
            count: grid.cells_per_axis().map(|n| n * parts),
            per_cell: parts as f64,
            first: 0.5,
        }
    }

    /// Returns the number of points.
    pub fn n_points(&self) -> usize {
        self.count.iter().product()
    }

    /// Returns the coordinates of a point in spacings of the grid, by its index in memory order.
    pub fn point(&self, mut index: usize) -> [f64; D] {
        std::array::from_fn(|k| {
            let i = index % self.count[k];
            index /= self.count[k];
            self.coordinate(i)
        })
    }

    /// Index of the first point that is not below a coordinate in spacings, along an axis.
    #[inline(always)]
    pub(crate) fn not_below(&self, coordinate: f64) -> f64 {
        coordinate.mul_add(self.per_cell, -self.first).ceil()
    }

    /// Index of the last point that is not above a coordinate in spacings, along an axis.
    #[inline(always)]
    pub(crate) fn not_above(&self, coordinate: f64) -> f64 {
        coordinate.mul_add(self.per_cell, -self.first).floor()
    }

    /// Coordinate of a point in spacings.
    #[inline(always)]
    pub(crate) fn coordinate(&self, index: usize) -> f64 {
        (index as f64 + self.first) / self.per_cell
    }

    /// Index of a point in memory order.
    #[inline(always)]
    pub(crate) fn index(&self, point: [usize; D]) -> usize {
        (0..D)
            .rev()
            .fold(0, |index, k| index * self.count[k] + point[k])
    }
}
