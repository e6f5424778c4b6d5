//! Fields carried along by a displacement.

use fe_grid::{InverseDeformation, ScalarField, VectorField};

/// `f o (1 + u)^-1` at the nodes, with `outside` where the box has not been deformed to: the
/// indicator of a shape, its signed distance or an image, deformed.
///
/// This is how modes are applied to the average, be it a shape or an image.
///
/// # Panics
/// If both lie on different grids.
pub fn push_forward<const D: usize>(
    field: &ScalarField<f64, D>,
    displacement: &VectorField<f64, D>,
    outside: f64,
) -> ScalarField<f64, D> {
    assert_eq!(field.grid(), displacement.grid());
    InverseDeformation::new(displacement).push_forward(field, outside)
}
