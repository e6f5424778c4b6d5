//! Uniform grids with one spacing, and their hierarchies.

use crate::error::GridError;

/// Most nodes of a grid: sizes of a thousand vector fields on it do not overflow.
const MOST_NODES: u64 = 1 << 40;

/// The nodes of a box `[0, (n_0-1) h] x ...` with the same spacing `h` along every axis. Axis 0 is
/// `x`; `x` runs fastest in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    n_nodes: [usize; D],
    spacing: f64,
}

impl<const D: usize> Grid<D> {
    /// Creates a grid of the unit box with `2^level + 1` nodes along every axis.
    ///
    /// # Panics
    /// If these are more than `2^40` nodes.
    pub fn dyadic(level: u32) -> Self {
        // More than the size of any grid.
        Self::cube((1 << level.min(41)) + 1)
    }

    /// Creates a grid of the unit box with `n` nodes along every axis.
    ///
    /// # Panics
    /// If `n < 2`, or for more than `2^40` nodes.
    pub fn cube(n: usize) -> Self {
        assert!(n >= 2, "a grid needs two nodes a side");
        assert!(fits([n; D]), "a grid has at most 2^40 nodes");
        Self {
            n_nodes: [n; D],
            spacing: 1.0 / (n - 1) as f64,
        }
    }

    /// Creates a grid with different numbers of nodes along the axes (`x` first) and one spacing.
    ///
    /// # Errors
    /// [`GridError::TooSmall`] for fewer than two nodes along an axis, [`GridError::TooLarge`] for more
    /// than `2^40` nodes, [`GridError::Spacing`] unless the spacing and the volume of a cell are
    /// positive normal numbers.
    pub fn with_nodes(n_nodes: [usize; D], spacing: f64) -> Result<Self, GridError> {
        if n_nodes.iter().any(|&n| n < 2) {
            return Err(GridError::TooSmall {
                n_nodes: n_nodes.to_vec(),
            });
        }
        if !fits(n_nodes) {
            return Err(GridError::TooLarge {
                n_nodes: n_nodes.to_vec(),
            });
        }
        let grid = Self { n_nodes, spacing };
        if !(spacing > 0.0 && grid.cell_volume().is_normal()) {
            return Err(GridError::Spacing { spacing });
        }
        Ok(grid)
    }

    /// Returns the number of nodes along each axis, `x` first.
    pub fn nodes_per_axis(&self) -> [usize; D] {
        self.n_nodes
    }

    /// Returns the number of cells along each axis, `x` first.
    pub fn cells_per_axis(&self) -> [usize; D] {
        self.n_nodes.map(|n| n - 1)
    }

    /// Returns the distance `h` between neighbouring nodes.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Returns the side lengths of the box.
    pub fn extent(&self) -> [f64; D] {
        self.n_nodes.map(|n| (n - 1) as f64 * self.spacing)
    }

    /// Returns the number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.n_nodes.iter().product()
    }

    /// Returns the number of cells.
    pub fn n_cells(&self) -> usize {
        self.n_nodes.iter().map(|n| n - 1).product()
    }

    /// Returns the volume of a cell, `h^D`.
    pub fn cell_volume(&self) -> f64 {
        self.spacing.powi(D as i32)
    }

    /// Returns the distance in memory between neighbouring nodes along each axis.
    pub fn strides(&self) -> [usize; D] {
        strides(self.n_nodes)
    }

    /// Returns the index of a node in memory.
    pub fn node_index(&self, node: [usize; D]) -> usize {
        let strides = self.strides();
        (0..D).map(|k| node[k] * strides[k]).sum()
    }

    /// Returns the node with an index in memory.
    pub fn node(&self, index: usize) -> [usize; D] {
        unflatten(index, self.n_nodes)
    }

    /// Returns the index of a cell in memory.
    pub fn cell_index(&self, cell: [usize; D]) -> usize {
        let strides = strides(self.cells_per_axis());
        (0..D).map(|k| cell[k] * strides[k]).sum()
    }

    /// Returns the cell with an index in memory.
    pub fn cell(&self, index: usize) -> [usize; D] {
        unflatten(index, self.cells_per_axis())
    }

    /// Returns the coordinates of a node.
    pub fn position(&self, node: [usize; D]) -> [f64; D] {
        node.map(|i| i as f64 * self.spacing)
    }

    /// Returns the grid with twice the spacing on the same box; `None` unless every axis has an
    /// even number of cells.
    pub fn coarser(&self) -> Option<Self> {
        let cells = self.cells_per_axis();
        if cells.iter().any(|&c| c % 2 != 0) {
            return None;
        }
        Some(Self {
            n_nodes: cells.map(|c| c / 2 + 1),
            spacing: 2.0 * self.spacing,
        })
    }

    /// Returns every `k`-th node as a grid of at most so many cells along its longest side. It covers the box, and ends
    /// less than its own spacing beyond it where `k` does not divide the cells.
    ///
    /// # Errors
    /// [`GridError::Spacing`] where the spacing overflows.
    ///
    /// # Panics
    /// If no cells are asked for.
    pub fn thinned(&self, most_cells: usize) -> Result<Self, GridError> {
        let cells = self.cells_per_axis();
        let longest = cells.into_iter().max().unwrap_or(1);
        let every = longest.div_ceil(most_cells);
        let nodes = cells.map(|n| n.div_ceil(every) + 1);
        Self::with_nodes(nodes, every as f64 * self.spacing)
    }

    /// Returns the grid with half the spacing on the same box.
    ///
    /// # Panics
    /// If it has more than `2^40` nodes.
    pub fn finer(&self) -> Self {
        let n_nodes = self.cells_per_axis().map(|c| 2 * c + 1);
        assert!(fits(n_nodes), "a grid has at most 2^40 nodes");
        Self {
            n_nodes,
            spacing: self.spacing / 2.0,
        }
    }

    /// Returns this grid and coarser ones, coarsest first; the coarsest has at least `min_nodes`
    /// nodes along its longest side, unless this grid has fewer.
    pub fn hierarchy(&self, min_nodes: usize) -> Vec<Self> {
        let mut grids = vec![*self];
        while let Some(coarse) = grids[grids.len() - 1].coarser() {
            if coarse.n_nodes.iter().max().is_some_and(|&n| n < min_nodes) {
                break;
            }
            grids.push(coarse);
        }
        grids.reverse();
        grids
    }
}

/// Whether there are not too many nodes.
fn fits<const D: usize>(n_nodes: [usize; D]) -> bool {
    let mut sizes = n_nodes.into_iter();
    let product = sizes.try_fold(1, |product: usize, n| product.checked_mul(n));
    product.is_some_and(|product| product as u64 <= MOST_NODES)
}

fn strides<const D: usize>(sizes: [usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for k in 1..D {
        strides[k] = strides[k - 1] * sizes[k - 1];
    }
    strides
}

fn unflatten<const D: usize>(mut index: usize, sizes: [usize; D]) -> [usize; D] {
    sizes.map(|n| {
        let i = index % n;
        index /= n;
        i
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of nodes and volumes that a number cannot hold are refused, and none is wrapped.
    #[test]
    fn sizes_do_not_overflow() {
        for n_nodes in [[1 << 22; 3], [1 << 32, 1 << 32, 2], [usize::MAX, 2, 2]] {
            let refused = Grid::<3>::with_nodes(n_nodes, 0.1);
            assert!(matches!(refused, Err(GridError::TooLarge { .. })));
        }
        let largest = Grid::<2>::with_nodes([1 << 20; 2], 0.1).unwrap();
        assert_eq!(largest.n_nodes() as u64, MOST_NODES);
        for spacing in [1e-310, 1e-160, 1e160, 1e300, -1.0, f64::NAN] {
            let refused = Grid::<2>::with_nodes([9; 2], spacing);
            assert!(matches!(refused, Err(GridError::Spacing { .. })));
        }
    }

    #[test]
    #[should_panic(expected = "a grid has at most 2^40 nodes")]
    fn a_grid_of_all_bits_is_no_grid() {
        let _ = Grid::<2>::dyadic(64);
    }
}
