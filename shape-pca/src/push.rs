//! Push-forward of fields by a displacement.

use fe_grid::{InverseDeformation, ScalarField, VectorField};

/// Computes `f o (1 + u)^-1` at the nodes, with the value `outside` at nodes outside the deformed
/// box. The field `f` is the indicator of a shape, its signed distance or an image.
///
/// This applies modes to the average, be it a shape or an image.
///
/// # Panics
/// If the fields lie on different grids.
pub fn push_forward<const D: usize>(
    field: &ScalarField<f64, D>,
    displacement: &VectorField<f64, D>,
    outside: f64,
) -> ScalarField<f64, D> {
    assert_eq!(field.grid(), displacement.grid());
    InverseDeformation::new(displacement).push_forward(field, outside)
}
