//! Shapes on grids.

use fe_grid::{Grid, ScalarField};
use levelset::signed_distance;

use crate::verify::VerifyError;

/// The signed distance of a ball about the middle of the box.
pub fn ball<const D: usize>(grid: Grid<D>, radius: f64) -> ScalarField<f64, D> {
    ScalarField::from_fn(grid, |x| {
        let square: f64 = x.iter().map(|x| (x - 0.5).powi(2)).sum();
        [radius - square.sqrt()]
    })
}

/// The signed distance of an ellipse about the middle of the box, with half-axes along the axes.
///
/// # Errors
/// [`VerifyError::Levelset`] where it does not fit in the box.
pub fn ellipse(grid: Grid<2>, axes: [f64; 2]) -> Result<ScalarField<f64, 2>, VerifyError> {
    let implicit = ScalarField::from_fn(grid, |[x, y]| {
        let scaled = ((x - 0.5) / axes[0]).hypot((y - 0.5) / axes[1]);
        [axes[0].min(axes[1]) * (1.0 - scaled)]
    });
    Ok(signed_distance(&implicit, 0.0)?)
}
