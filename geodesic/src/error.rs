//! What can go wrong in this crate.

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
    /// The two shapes have different numbers of components, or none.
    #[error("the start shape has {start} components, the end shape {end}")]
    Components {
        /// Components of the start shape.
        start: usize,
        /// Components of the end shape.
        end: usize,
    },
    /// A signed distance is not a number everywhere.
    #[error("the signed distance of the {which} shape is not finite at node {node}")]
    NotFinite {
        /// `start` or `end`.
        which: &'static str,
        /// Position in memory of the node.
        node: usize,
    },
    /// A weight of what is known is not between 0 and 1.
    #[error("what is known of the {which} shape weighs less than 0 or more than 1 at node {node}")]
    Weight {
        /// `start` or `end`.
        which: &'static str,
        /// Position in memory of the node.
        node: usize,
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
    /// A law under which rigid motions cost something, where they must not.
    #[error("the law {law} is not frame indifferent, which the calculus asks for")]
    FrameDependent {
        /// The law.
        law: hyperelastic::LawName,
    },
    /// From the grid layer.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// From the laws.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
    /// From the shapes.
    #[error(transparent)]
    Shape(#[from] levelset::LevelsetError),
}
