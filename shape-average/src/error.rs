//! What can go wrong in this crate.

/// Errors of averages.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AverageError {
    /// Fewer than one shape.
    #[error("an average needs at least one shape")]
    NoShapes,
    /// Shapes on different grids.
    #[error("shape {index} lies on another grid than the first")]
    GridsDiffer {
        /// Position of the shape.
        index: usize,
    },
    /// The weights of what was seen do not fit the shapes.
    #[error("the weight of what was seen of shape {index} is {what}")]
    Seen {
        /// Position of the shape.
        index: usize,
        /// What is wrong with its weight.
        what: &'static str,
    },
    /// A shape has no inside or no outside on the grid.
    #[error("shape {index} is {what} on this grid")]
    Degenerate {
        /// Position of the shape.
        index: usize,
        /// `empty` or `full`.
        what: &'static str,
    },
    /// A signed distance is not a number everywhere.
    #[error("the signed distance of shape {index} is not finite at node {node}")]
    NotFinite {
        /// Position of the shape.
        index: usize,
        /// Position in memory of the node.
        node: usize,
    },
    /// Levels that a caller gave do not fit.
    #[error(
        "level {level} must hold all shapes on a grid of half the spacing of the one before it, \
         and the last on that of the signed distances"
    )]
    Levels {
        /// The level, counted from the coarsest.
        level: usize,
    },
    /// Deformations to start from do not fit the shapes.
    #[error(
        "the deformations to start from must be one for each of the shapes, all finite and on one \
         grid of their hierarchy; {what}"
    )]
    Start {
        /// What was found.
        what: &'static str,
    },
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
    /// Weights that are not a convex combination of the shapes.
    #[error("{expected} weights, none negative and of sum 1, are needed; found {weights:?}")]
    Weights {
        /// Number of shapes.
        expected: usize,
        /// The weights that were given.
        weights: Vec<f64>,
    },
    /// From the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// From the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
    /// From the phase fields.
    #[error(transparent)]
    PhaseField(#[from] phasefield::PhaseFieldError),
    /// From the shapes.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
}
