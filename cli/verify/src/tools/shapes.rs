//! Shapes on grids.

use fe_grid::{Grid, ScalarField};
use levelset::signed_distance;

use crate::error::VerifyError;

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
    ellipse_at(grid, axes, [0.5; 2], 0.0)
}

/// The signed distance of an ellipse about a centre, turned by an angle.
///
/// # Errors
/// [`VerifyError::Levelset`] where it does not fit in the box.
pub fn ellipse_at(
    grid: Grid<2>,
    axes: [f64; 2],
    centre: [f64; 2],
    angle: f64,
) -> Result<ScalarField<f64, 2>, VerifyError> {
    let (sin, cos) = angle.sin_cos();
    let implicit = ScalarField::from_fn(grid, |x| {
        let r = [x[0] - centre[0], x[1] - centre[1]];
        let (a, b) = (cos * r[0] + sin * r[1], cos * r[1] - sin * r[0]);
        // The distance to first order: exact at the boundary, so that no grid shifts it. At the centre
        // both size and slope vanish, and the distance is the smaller half-axis.
        let size = (a / axes[0]).hypot(b / axes[1]);
        let slope = (a / (axes[0] * axes[0])).hypot(b / (axes[1] * axes[1]));
        let radius = if slope > 0.0 {
            size / slope
        } else {
            axes[0].min(axes[1])
        };
        [(1.0 - size) * radius]
    });
    Ok(signed_distance(&implicit, 0.0)?)
}

/// The signed distance of the union of thick segments, each given by its ends and its radius.
///
/// # Errors
/// [`VerifyError::Levelset`] where it does not fit in the box.
pub fn segments(
    grid: Grid<2>,
    parts: &[([f64; 2], [f64; 2], f64)],
) -> Result<ScalarField<f64, 2>, VerifyError> {
    let implicit = ScalarField::from_fn(grid, |[x, y]| {
        let part = |(a, b, radius): &([f64; 2], [f64; 2], f64)| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            let along = along.clamp(0.0, 1.0);
            radius - (x - a[0] - along * dx).hypot(y - a[1] - along * dy)
        };
        [parts.iter().map(part).fold(f64::MIN, f64::max)]
    });
    Ok(signed_distance(&implicit, 0.0)?)
}

/// The signed distance of a ball that is stretched along the first axis: half-axes `along`, and
/// `across` in all other directions.
///
/// # Errors
/// [`VerifyError::Levelset`] where it does not fit in the box.
pub fn spheroid<const D: usize>(
    grid: Grid<D>,
    along: f64,
    across: f64,
) -> Result<ScalarField<f64, D>, VerifyError> {
    let implicit = ScalarField::from_fn(grid, |x| {
        let (mut size, mut slope) = (0.0, 0.0);
        for (k, x) in x.iter().enumerate() {
            let axis = if k == 0 { along } else { across };
            size += ((x - 0.5) / axis).powi(2);
            slope += ((x - 0.5) / (axis * axis)).powi(2);
        }
        let (size, slope) = (size.sqrt(), slope.sqrt());
        // As for ellipses.
        let radius = if slope > 0.0 { size / slope } else { across };
        [(1.0 - size) * radius]
    });
    Ok(signed_distance(&implicit, 0.0)?)
}
