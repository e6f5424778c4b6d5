//! Rectangles and disks with their exact distances, and figures of theirs in closed form.

use fe_grid::{Grid, ScalarField};

/// The signed distance of a disk about a centre, positive inside.
pub fn disk_at(grid: Grid<2>, centre: [f64; 2], radius: f64) -> ScalarField<f64, 2> {
    ScalarField::from_fn(grid, |[x, y]| {
        [radius - (x - centre[0]).hypot(y - centre[1])]
    })
}

/// The signed distance of a rectangle between two corners, positive inside.
pub fn rectangle(grid: Grid<2>, low: [f64; 2], high: [f64; 2]) -> ScalarField<f64, 2> {
    ScalarField::from_fn(grid, |x| {
        let beyond = [0, 1].map(|k| (low[k] - x[k]).max(x[k] - high[k]));
        let outside = beyond.map(|b| b.max(0.0));
        let inside = beyond[0].max(beyond[1]).min(0.0);
        [-(outside[0].hypot(outside[1]) + inside)]
    })
}

/// The area that two disks at a distance have in common, where their boundaries cross.
pub fn lens(radii: [f64; 2], distance: f64) -> f64 {
    let [r, s] = radii;
    let d = distance;
    // Distances of the common chord from both centres.
    let (a, b) = (
        (d * d + r * r - s * s) / (2.0 * d),
        (d * d + s * s - r * r) / (2.0 * d),
    );
    let part = |r: f64, a: f64| r * r * (a / r).acos() - a * (r * r - a * a).sqrt();
    part(r, a) + part(s, b)
}
