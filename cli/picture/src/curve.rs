//! Polylines in pictures.

/// A line in unit-box coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its points.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}
