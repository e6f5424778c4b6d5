//! Errors of this crate.

/// Errors of a principal component analysis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PcaError {
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
    /// There are fewer than two shapes.
    #[error("modes of variation need at least two shapes, found {found}")]
    TooFewShapes {
        /// Number of given shapes.
        found: usize,
    },
    /// Fields differ in number, or lie on different grids.
    #[error("the {what} of shape {index} is missing or on another grid than the first")]
    Fields {
        /// Name of the field.
        what: &'static str,
        /// Index of the shape.
        index: usize,
    },
    /// A field is not finite.
    #[error("the {what} of shape {index} is not finite")]
    NotFinite {
        /// Name of the field.
        what: &'static str,
        /// Index of the shape.
        index: usize,
    },
    /// A visibility mask has values that are no shares.
    #[error("the visibility mask of shape {index} has values outside of 0 to 1")]
    Visibility {
        /// Index of the shape.
        index: usize,
    },
    /// The weights are not a convex combination of the shapes.
    #[error("expected {expected} nonnegative weights with sum 1, found {weights:?}")]
    Weights {
        /// Number of shapes.
        expected: usize,
        /// The given weights.
        weights: Vec<f64>,
    },
    /// The average object is empty on its grid.
    #[error("the average is empty on this grid")]
    EmptyObject,
    /// All shapes are equal: there is no mode.
    #[error("the shapes do not differ from each other: there are no modes of variation")]
    NoVariation,
    /// There are more scores than modes.
    #[error("expected at most {modes} scores, found {found}")]
    TooManyScores {
        /// Number of given scores.
        found: usize,
        /// Number of modes.
        modes: usize,
    },
    /// The linear solver did not converge.
    #[error(
        "the elastic response was not found: residual {residual:e} of the load after {iterations} \
         iterations"
    )]
    NotSolved {
        /// Relative residual.
        residual: f64,
        /// Number of iterations.
        iterations: usize,
    },
    /// An error of the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// An error of the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
}
