//! `metric.png`: the optimal flow and the density of its dissipation.

use super::Outcome;
use shapespace_picture::{
    Camera, Canvas, Colour, Curve, INK, Shape, Slice, TileRows, WHITE, heat, mix,
};

const COLUMNS: usize = 2;
/// Arrows along the longest side of the shape.
const ARROWS: usize = 22;
/// Length of the longest arrow, relative to the distance of two.
const LONGEST: f64 = 0.95;
/// Arrows shorter than this share of the longest are not drawn.
const SHORTEST: f64 = 0.03;
/// Share of the values that reach the darkest colour, at corners for example.
const OUTLIERS: f64 = 0.005;

/// The picture of a flow. In 3D, the surface and the plane through its middle.
pub(super) fn picture<const D: usize>(outcome: &Outcome<D>) -> Canvas {
    let flow = &outcome.found.flow;
    let shape = Shape::of(&outcome.outline);
    let camera = Camera::around(std::slice::from_ref(&shape), TileRows::width(COLUMNS));
    let speed = |x: [f64; D]| {
        let v = flow.velocity.sample(x);
        v.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let density = |x: [f64; D]| flow.density.sample(x)[0];
    let inside: Vec<[f64; D]> = nodes_inside(outcome);
    let fastest = upper(inside.iter().map(|&x| speed(x)));
    // A rigid motion has rounding errors only, which are not shown.
    let densest = if flow.deforms() {
        upper(inside.iter().map(|&x| density(x)))
    } else {
        0.0
    };
    let share = |value: f64, most: f64| if most > 0.0 { value / most } else { 0.0 };
    // Arrows have to be seen over the darkest colour.
    let of_speed = |x: [f64; D]| mix(WHITE, heat(share(speed(x), fastest)), 0.6);
    let of_density = |x: [f64; D]| heat(share(density(x), densest));
    let place = |p: &[f64]| std::array::from_fn(|k| p[k]);

    let mut tiles = TileRows::new(COLUMNS);
    let mut moving = camera.shaded(&shape, INK, |p| of_speed(place(p)));
    if let Camera::Flat(window) = &camera {
        for arrow in arrows(outcome, fastest, None) {
            window.outline(&mut moving, &curves(&arrow), 1.1, INK);
        }
    }
    tiles.push(format!("velocity, |v| up to {fastest:.3e}"), moving);
    let dissipating = camera.shaded(&shape, INK, |p| of_density(place(p)));
    tiles.push(format!("dissipation, up to {densest:.3e}"), dissipating);
    if D == 3 {
        let [low, high] = outcome.outline.bounds();
        let slice = Slice::around(&low, &high, TileRows::width(COLUMNS));
        let over = |colour: &dyn Fn([f64; D]) -> Colour| {
            let mut tile = slice.painted(|x| {
                if outcome.distance.sample(x)[0] > 0.0 {
                    colour(x)
                } else {
                    WHITE
                }
            });
            slice.outline(&mut tile, &outcome.outline, 1.2, INK);
            tile
        };
        let mut moving = over(&of_speed);
        for arrow in arrows(outcome, fastest, Some(slice.height())) {
            for line in arrow {
                slice.line(&mut moving, &line, 1.1, INK);
            }
        }
        tiles.push("velocity in the middle plane", moving);
        tiles.push("dissipation in the middle plane", over(&of_density));
    }
    tiles.draw()
}

/// The positions of the nodes in the object; its boundary where it has none.
fn nodes_inside<const D: usize>(outcome: &Outcome<D>) -> Vec<[f64; D]> {
    let (grid, distance) = (outcome.distance.grid(), outcome.distance.as_slice());
    (0..grid.n_nodes())
        .filter(|&node| distance[node] > 0.0)
        .map(|node| grid.position(grid.node(node)))
        .collect()
}

/// Nearly the largest value.
fn upper(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * (1.0 - OUTLIERS)) as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// The lines of an arrow: its shaft and its head.
type Arrow<const D: usize> = [Vec<[f64; D]>; 2];

/// The arrows at the points of a lattice in the object, in the plane at this height in 3D.
fn arrows<const D: usize>(
    outcome: &Outcome<D>,
    fastest: f64,
    height: Option<f64>,
) -> Vec<Arrow<D>> {
    let [low, high] = outcome.outline.bounds();
    let longest = (high[0] - low[0]).max(high[1] - low[1]);
    let spacing = longest / ARROWS as f64;
    if fastest <= 0.0 || spacing <= 0.0 {
        return Vec::new();
    }
    let count = [0, 1].map(|k| ((high[k] - low[k]) / spacing).ceil() as usize + 1);
    let mut found = Vec::new();
    for number in 0..count[0] * count[1] {
        let at = [number % count[0], number / count[0]];
        let mut start = [height.unwrap_or_default(); D];
        for k in 0..2 {
            start[k] = low[k] + (at[k] as f64 + 0.5) * spacing;
        }
        if outcome.distance.sample(start)[0] <= 0.0 {
            continue;
        }
        let velocity = outcome.found.flow.velocity.sample(start);
        let along = [0, 1].map(|k| velocity[k] * LONGEST * spacing / fastest);
        let length = along[0].hypot(along[1]);
        if length < SHORTEST * LONGEST * spacing {
            continue;
        }
        // Both ends at the same distance from the point.
        let place = |forth: f64, aside: f64| {
            let mut point = start;
            point[0] += forth * along[0] - aside * along[1];
            point[1] += forth * along[1] + aside * along[0];
            point
        };
        let tip = place(0.5, 0.0);
        found.push([
            vec![place(-0.5, 0.0), tip],
            vec![place(0.22, 0.15), tip, place(0.22, -0.15)],
        ]);
    }
    found
}

/// An arrow in the plane.
fn curves<const D: usize>(arrow: &Arrow<D>) -> Vec<Curve> {
    let line = |points: &Vec<[f64; D]>| Curve {
        points: points.iter().map(|p| [p[0], p[1]]).collect(),
        closed: false,
    };
    arrow.iter().map(line).collect()
}
