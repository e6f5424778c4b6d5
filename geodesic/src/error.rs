//! Errors of this crate.

/// Errors of geodesics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeodesicError {
    /// The two shapes lie on different grids.
    #[error("the two shapes lie on different grids")]
    GridsDiffer,
    /// A shape has no inside or no outside on the grid.
    #[error("the {which} shape is {what} on this grid")]
    Degenerate {
        /// `start` or `end`.
        which: &'static str,
        /// `empty` or `full`.
        what: &'static str,
    },
    /// The two shapes have different numbers of components, or one has none.
    #[error("the start shape has {start} components, but the end shape has {end}")]
    Components {
        /// Number of components of the start shape.
        start: usize,
        /// Number of components of the end shape.
        end: usize,
    },
    /// A signed distance is not finite at a node.
    #[error("the signed distance of the {which} shape is not finite at node {node}")]
    NotFinite {
        /// `start` or `end`.
        which: &'static str,
        /// Index of the node, in memory order.
        node: usize,
    },
    /// A mask was given for a signed distance.
    #[error(
        "the {which} shape is a mask, not a signed distance: compute that with `levelset::signed_distance`"
    )]
    Mask {
        /// `start` or `end`.
        which: &'static str,
    },
    /// A visibility weight is not between 0 and 1.
    #[error("the visibility weight of the {which} shape is not between 0 and 1 at node {node}")]
    Weight {
        /// `start` or `end`.
        which: &'static str,
        /// Index of the node, in memory order.
        node: usize,
    },
    /// Any difference of the two shapes may be a hidden part of one of them.
    #[error(
        "parts of both shapes may be hidden anywhere, so that nothing is known about one from the other"
    )]
    BothHidden,
    /// There is no shape between both on whose domain a path could be computed.
    #[error("there is no shape between both: they lie apart, or a part of one is hidden")]
    Middle,
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
    /// Deformations to start from do not fit the path.
    #[error(
        "the deformations to start from are not as many as the steps, or not on a grid of the hierarchy"
    )]
    Given,
    /// The law is not frame indifferent, as the calculus requires.
    #[error("the law {law} is not frame indifferent, as the calculus requires")]
    FrameDependent {
        /// The law.
        law: hyperelastic::LawName,
    },
    /// An error of the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// An error of the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
    /// An error of the level sets.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
}
