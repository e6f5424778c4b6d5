//! Errors of this crate.

use std::path::PathBuf;

/// Errors of grids, fields and solvers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// Fewer than two nodes along an axis.
    #[error("a grid needs at least two nodes along every axis, found {n_nodes:?}")]
    TooSmall {
        /// The nodes along each axis, `x` first.
        n_nodes: Vec<usize>,
    },
    /// More nodes than any computation has memory for.
    #[error("a grid has at most 2^40 nodes, found {n_nodes:?}")]
    TooLarge {
        /// The nodes along each axis, `x` first.
        n_nodes: Vec<usize>,
    },
    /// The spacing is not a positive number, or so small or large that the volume of a cell is zero or infinite.
    #[error(
        "the grid spacing must be positive and finite, as must the volume of a cell, found {spacing}"
    )]
    Spacing {
        /// The spacing that was asked for.
        spacing: f64,
    },
    /// A field has the wrong number of values.
    #[error("a field of this grid has {expected} numbers, found {found}")]
    Length {
        /// Numbers that the grid asks for.
        expected: usize,
        /// Numbers that were given.
        found: usize,
    },
    /// A pointwise law has no finite value at a state: the deformation folds over there.
    #[error("the state is not admissible in cell {cell}: the energy density is not finite")]
    Inadmissible {
        /// Position in memory of the cell.
        cell: usize,
    },
    /// A temporary file for a long vector cannot be made.
    #[error("no room for {bytes} bytes in a temporary file in '{}': {reason}", folder.display())]
    Spill {
        /// The folder.
        folder: PathBuf,
        /// Size of the file.
        bytes: u64,
        /// The reason reported by the operating system.
        reason: String,
    },
    /// Numbers that have to be finite are not.
    #[error("the {what} is not finite")]
    NotFinite {
        /// What they are.
        what: &'static str,
    },
    /// A linear solver met an operator that is not positive definite.
    #[error(
        "the operator is not positive definite: curvature {curvature:e} in iteration {iteration}"
    )]
    NotPositiveDefinite {
        /// The curvature found.
        curvature: f64,
        /// Iteration in which it was found; 0 also where the operator was looked at before any.
        iteration: usize,
    },
}
