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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn lenses_of_close_disks_are_nearly_disks() {
        assert!((lens([0.3, 0.3], 1e-6) - 0.09 * PI).abs() < 1e-6);
        // One disk inside the other but for touching it.
        assert!((lens([0.3, 0.2], 0.1 + 1e-12) - 0.04 * PI).abs() < 1e-5);
    }

    #[test]
    fn distances_of_rectangles_are_positive_inside() {
        let u = rectangle(Grid::dyadic(3), [0.25; 2], [0.75; 2]);
        assert_eq!(u.sample([0.5, 0.5])[0], 0.25);
        assert_eq!(u.sample([0.0, 0.5])[0], -0.25);
        assert!((u.sample([0.0, 0.0])[0] + 0.25 * 2f64.sqrt()).abs() < 1e-15);
    }
}
