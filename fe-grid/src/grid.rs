//! Uniform grids of one spacing, and the hierarchy over them.

use crate::error::GridError;

/// Nodes of a box `[0, (n_0-1) h] x ...`, the same spacing `h` along every axis. Axis 0 is `x`,
/// and `x` runs fastest in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    n_nodes: [usize; D],
    spacing: f64,
}

impl<const D: usize> Grid<D> {
    /// `2^level + 1` nodes a side of the unit box.
    pub fn dyadic(level: u32) -> Self {
        Self::cube((1 << level) + 1)
    }

    /// `n` nodes a side of the unit box.
    ///
    /// # Panics
    /// If `n < 2`.
    pub fn cube(n: usize) -> Self {
        assert!(n >= 2, "a grid needs two nodes a side");
        Self {
            n_nodes: [n; D],
            spacing: 1.0 / (n - 1) as f64,
        }
    }

    /// A box with its own number of nodes along each axis (`x` first) and one spacing.
    ///
    /// # Errors
    /// [`GridError::TooSmall`] with fewer than two nodes along an axis,
    /// [`GridError::Spacing`] where the spacing is not positive and finite.
    pub fn with_nodes(n_nodes: [usize; D], spacing: f64) -> Result<Self, GridError> {
        if n_nodes.iter().any(|&n| n < 2) {
            return Err(GridError::TooSmall {
                n_nodes: n_nodes.to_vec(),
            });
        }
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(GridError::Spacing { spacing });
        }
        Ok(Self { n_nodes, spacing })
    }

    /// Number of nodes along each axis, `x` first.
    pub fn nodes_per_axis(&self) -> [usize; D] {
        self.n_nodes
    }

    /// Number of cells along each axis, `x` first.
    pub fn cells_per_axis(&self) -> [usize; D] {
        self.n_nodes.map(|n| n - 1)
    }

    /// Distance `h` of neighbouring nodes.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Side lengths of the box.
    pub fn extent(&self) -> [f64; D] {
        self.n_nodes.map(|n| (n - 1) as f64 * self.spacing)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.n_nodes.iter().product()
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.n_nodes.iter().map(|n| n - 1).product()
    }

    /// Volume of a cell, `h^D`.
    pub fn cell_volume(&self) -> f64 {
        self.spacing.powi(D as i32)
    }

    /// Distance in memory of neighbours along each axis.
    pub fn strides(&self) -> [usize; D] {
        strides(self.n_nodes)
    }

    /// Position in memory of a node.
    pub fn node_index(&self, node: [usize; D]) -> usize {
        let strides = self.strides();
        (0..D).map(|k| node[k] * strides[k]).sum()
    }

    /// The node at a position in memory.
    pub fn node(&self, index: usize) -> [usize; D] {
        unflatten(index, self.n_nodes)
    }

    /// Position in memory of a cell.
    pub fn cell_index(&self, cell: [usize; D]) -> usize {
        let strides = strides(self.cells_per_axis());
        (0..D).map(|k| cell[k] * strides[k]).sum()
    }

    /// The cell at a position in memory.
    pub fn cell(&self, index: usize) -> [usize; D] {
        unflatten(index, self.cells_per_axis())
    }

    /// Coordinates of a node.
    pub fn position(&self, node: [usize; D]) -> [f64; D] {
        node.map(|i| i as f64 * self.spacing)
    }

    /// The grid of twice the spacing on the same box, where every axis has an even number of
    /// cells, at least two.
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

    /// The grid of half the spacing on the same box.
    pub fn finer(&self) -> Self {
        Self {
            n_nodes: self.cells_per_axis().map(|c| 2 * c + 1),
            spacing: self.spacing / 2.0,
        }
    }

    /// This grid and its coarser ones, coarsest first, down to one whose longest side has no
    /// fewer than `min_nodes` nodes.
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
