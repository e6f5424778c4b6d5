//! Errors of this crate.

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
        /// The given value.
        value: f64,
    },
    /// An image is not finite at a node.
    #[error("the image is not finite at node {node}")]
    NotFinite {
        /// Index of the node, in memory order.
        node: usize,
    },
    /// An error of the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// A shape could not be represented.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
}
