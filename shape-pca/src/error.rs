//! What can go wrong in this crate.

/// Errors of a principal component analysis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PcaError {
    /// A parameter that is out of range.
    #[error("{name} = {value} is not usable: {expected} is needed")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        value: f64,
    },
    /// Fewer than two shapes.
    #[error("modes of variation need at least two shapes, found {found}")]
    TooFewShapes {
        /// Shapes that were given.
        found: usize,
    },
    /// Fields of different numbers or grids.
    #[error("the {what} of shape {index} lies on another grid than the first, or is missing")]
    Fields {
        /// Which field.
        what: &'static str,
        /// Position of the shape.
        index: usize,
    },
    /// Weights that are no convex combination.
    #[error("{expected} weights, none negative and of sum 1, are needed; found {weights:?}")]
    Weights {
        /// Number of shapes.
        expected: usize,
        /// The weights that were given.
        weights: Vec<f64>,
    },
    /// The average has no inside on its grid.
    #[error("the average has no inside on this grid")]
    EmptyObject,
    /// All shapes are the same: there is no mode.
    #[error("the shapes do not differ from each other: there are no modes of variation")]
    NoVariation,
    /// Scores for modes that do not exist.
    #[error("{found} scores were given for {modes} modes")]
    TooManyScores {
        /// Scores that were given.
        found: usize,
        /// Modes there are.
        modes: usize,
    },
    /// The linear problem could not be solved.
    #[error(
        "the elastic response was not found: residual {residual:e} of the load after {iterations} \
         iterations"
    )]
    NotSolved {
        /// What is left of the load, relative.
        residual: f64,
        /// Iterations.
        iterations: usize,
    },
    /// From the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// From the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
}
