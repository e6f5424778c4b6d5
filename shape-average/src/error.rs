//! Errors of this crate.

/// Errors of averages.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AverageError {
    /// There are no shapes.
    #[error("an average needs at least one shape")]
    NoShapes,
    /// The shapes lie on different grids.
    #[error("shape {index} lies on another grid than the first")]
    GridsDiffer {
        /// Index of the shape.
        index: usize,
    },
    /// The signed distances of components are more or fewer than the shapes have.
    #[error(
        "{shapes} shapes of {components} components have {expected} signed distances of components, \
         found {found}",
        expected = shapes * components
    )]
    Components {
        /// Number of shapes.
        shapes: usize,
        /// Number of components of each, at least one.
        components: usize,
        /// Number of signed distances found.
        found: usize,
    },
    /// The visibility masks do not fit the shapes.
    #[error("the weight of what was seen of shape {index} is {what}")]
    Masked {
        /// Index of the shape.
        index: usize,
        /// What is wrong with its mask.
        what: &'static str,
    },
    /// A shape has no inside or no outside on the grid.
    #[error("shape {index} is {what} on this grid")]
    Degenerate {
        /// Index of the shape.
        index: usize,
        /// `empty` or `full`.
        what: &'static str,
    },
    /// A signed distance is not finite at a node.
    #[error("the signed distance of shape {index} is not finite at node {node}")]
    NotFinite {
        /// Index of the shape.
        index: usize,
        /// Index of the node, in memory order.
        node: usize,
    },
    /// A mask was given for a signed distance.
    #[error(
        "shape {index} is a mask, not a signed distance: compute that with `levelset::signed_distance`"
    )]
    Mask {
        /// Index of the shape.
        index: usize,
    },
    /// A drawing of edges has none, or nothing else.
    #[error("image {index} has no edges: it is nowhere above one half, or everywhere")]
    NoEdges {
        /// Index of the image.
        index: usize,
    },
    /// Levels given by the caller do not fit.
    #[error(
        "level {level} must hold all shapes on a grid of half the spacing of the one before it, \
         and the last on that of the signed distances"
    )]
    Levels {
        /// Index of the level, counted from the coarsest.
        level: usize,
    },
    /// Initial deformations do not fit the shapes.
    #[error(
        "the deformations to start from must be one for each of the shapes, all finite and on one \
         grid of their hierarchy; {what}"
    )]
    Start {
        /// What was found instead.
        what: &'static str,
    },
    /// Something that only one process can do was asked of several.
    #[error("{what} runs on one process, and there are {processes}")]
    Distributed {
        /// What.
        what: &'static str,
        /// The number of processes.
        processes: usize,
    },
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
    /// The weights are not a convex combination of the shapes.
    #[error("{expected} weights, none negative and of sum 1, are needed; found {weights:?}")]
    Weights {
        /// Number of shapes.
        expected: usize,
        /// The given weights.
        weights: Vec<f64>,
    },
    /// An error of the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// An error of the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
    /// An error of the phase fields.
    #[error(transparent)]
    PhaseField(#[from] phasefield::PhaseFieldError),
    /// An error of the level sets.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
    /// An error of the alignment.
    #[error(transparent)]
    Align(#[from] crate::align::AlignError),
}

impl AverageError {
    /// The same error about another shape, where it is one about a shape.
    pub(crate) fn of_shape(self, index: usize) -> Self {
        match self {
            Self::GridsDiffer { .. } => Self::GridsDiffer { index },
            Self::NotFinite { node, .. } => Self::NotFinite { index, node },
            Self::Degenerate { what, .. } => Self::Degenerate { index, what },
            other => other,
        }
    }
}
