//! What can go wrong in this crate.

/// Errors of phase fields.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PhaseFieldError {
    /// A parameter is out of range.
    #[error("{name} must be {expected}, found {value}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// The admissible values, in words.
        expected: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// An image is not a number everywhere.
    #[error("the image is not finite at node {node}")]
    NotFinite {
        /// Position in memory of the node.
        node: usize,
    },
    /// From the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// A shape could not be represented.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
}
