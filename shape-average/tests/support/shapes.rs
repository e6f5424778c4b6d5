//! Signed distances of simple shapes, from functions that are positive inside.

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Moments, contour, signed_distance};

/// The signed distance, positive inside, of the object where a function is positive.
pub fn shape<const D: usize>(
    grid: Grid<D>,
    function: impl Fn([f64; D]) -> f64,
) -> ScalarField<f64, D> {
    let field = ScalarField::from_fn(grid, |x| [function(x)]);
    signed_distance(&field, 0.0).expect("the object lies in the box")
}

/// A disk or ball.
pub fn ball<const D: usize>(grid: Grid<D>, centre: [f64; D], radius: f64) -> ScalarField<f64, D> {
    shape(grid, |x| radius - distance(x, centre))
}

/// An ellipse or ellipsoid about the middle of the box, turned about it in the plane of the first
/// two axes (radians); the function is its distance to first order.
pub fn ellipsoid<const D: usize>(grid: Grid<D>, radii: [f64; D], turn: f64) -> ScalarField<f64, D> {
    shape(grid, |x| {
        let y = turned(x, -turn);
        let scaled = |power: i32| -> f64 {
            let terms = (0..D).map(|k| ((y[k] - 0.5) / radii[k].powi(power)).powi(2));
            terms.sum::<f64>().sqrt()
        };
        let (size, slope) = (scaled(1), scaled(2));
        if size < 1e-9 {
            // The middle itself, where the ratio has no value: as deep as the object is.
            return radii.iter().copied().fold(f64::INFINITY, f64::min);
        }
        (1.0 - size) * size / slope
    })
}

/// A bar of two arms, each .3 long and .12 wide, rounded off where they meet under an inner
/// angle in degrees, the joint at larger `y`; its centroid lies in the middle of the box. 180
/// degrees give a rectangle.
pub fn bar(grid: Grid<2>, angle: f64, turn: f64) -> ScalarField<f64, 2> {
    let about = |joint: f64| {
        move |x: [f64; 2]| {
            let [x, y] = turned(x, -turn);
            bar_function([x - 0.5, y - joint], angle)
        }
    };
    // The centroid is found on a fine grid, for the same shape in whatever grid.
    let fine = ScalarField::<f64, 2>::from_fn(Grid::dyadic(8), |x| [about(0.5)(turned(x, turn))]);
    let outline = contour(&fine, 0.0, BoxEdge::Closed).expect("finite values");
    let centroid = Moments::of_contour(&outline)
        .expect("a closed contour")
        .centroid;
    shape(grid, about(1.0 - centroid[1]))
}

/// The distance of a bar whose joint is the origin, near its boundary.
fn bar_function([x, y]: [f64; 2], angle: f64) -> f64 {
    let (sin, cos) = (0.5 * angle).to_radians().sin_cos();
    // The left arm is the mirror image of the right one, which points along (sin, -cos).
    let x = x.abs();
    let (along, across) = (x * sin - y * cos, x * cos + y * sin);
    let (out, side) = ((along - 0.15).abs() - 0.15, across.abs() - 0.06);
    let arm = -(out.max(0.0).hypot(side.max(0.0)) + out.max(side).min(0.0));
    arm.max(0.06 - x.hypot(y))
}

/// A point turned about the middle of the box, in the plane of the first two axes.
pub fn turned<const D: usize>(x: [f64; D], angle: f64) -> [f64; D] {
    let (sin, cos) = angle.sin_cos();
    let (a, b) = (x[0] - 0.5, x[1] - 0.5);
    let mut y = x;
    (y[0], y[1]) = (0.5 + cos * a - sin * b, 0.5 + sin * a + cos * b);
    y
}

fn distance<const D: usize>(x: [f64; D], y: [f64; D]) -> f64 {
    (0..D).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt()
}
