//! Errors of this crate.

/// Errors of shapes: fields, contours and measures.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LevelsetError {
    /// No node lies in the object.
    #[error("the object is empty: no value is above the level {level}")]
    EmptyObject {
        /// The level that separates object from background.
        level: f64,
    },
    /// Every node lies in the object.
    #[error("the object fills the box: every value is above the level {level}")]
    FullObject {
        /// The level that separates object from background.
        level: f64,
    },
    /// A value is NaN or infinite.
    #[error("the field is not finite: {value} at node {node:?}")]
    NonFinite {
        /// The node, `x` first.
        node: Vec<usize>,
        /// The value there.
        value: f64,
    },
    /// A level or a width is out of range.
    #[error("{name} is out of range: {value}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// A contour without any segment or triangle.
    #[error("the contour is empty")]
    EmptyContour,
    /// A contour refers to a point that does not exist.
    #[error("simplex {simplex} refers to point {point}, but there are {n_points} points")]
    MissingPoint {
        /// Index of the segment or triangle.
        simplex: usize,
        /// Index of the missing point.
        point: usize,
        /// Number of points.
        n_points: usize,
    },
    /// A point of a contour is NaN or infinite.
    #[error("point {point} of the contour is not finite: {position:?}")]
    NonFinitePoint {
        /// Index of the point.
        point: usize,
        /// Its coordinates.
        position: Vec<f64>,
    },
    /// A contour encloses a negative area or volume.
    #[error(
        "the contour is inside out: the order of the points of its segments or triangles is reversed"
    )]
    InsideOut,
    /// The quantity is defined for closed contours only.
    #[error("the contour is not closed")]
    OpenContour,
    /// Two fields lie on different grids.
    #[error("the grids differ: {left:?} and {right:?} nodes")]
    GridMismatch {
        /// Nodes of the first grid, `x` first.
        left: Vec<usize>,
        /// Nodes of the second grid, `x` first.
        right: Vec<usize>,
    },
    /// A grid or field could not be created.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
}
