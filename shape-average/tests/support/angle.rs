//! The angle between the two arms of a bar, measured on a grid.

use fe_grid::ScalarField;

/// What lies nearer to the joint than this, along an arm, is the bend and belongs to neither arm.
const BEND: f64 = 0.09;
/// An error of the direction by which an arm is cut off falls to a quarter in every round.
const ROUNDS: usize = 10;

/// The inner angle in degrees of a bar that bends in its middle, given by an indicator between 0
/// and 1: 180 for a straight bar, less where the ends turn towards smaller `y`, for a bar that
/// lies roughly along `x`.
///
/// Each arm is fitted by the principal axis of its part of the object, which is cut off square to
/// the arm: found from its own fit, it settles after a few rounds. The joint is where the two
/// lines meet the bisector.
pub fn inner_angle(indicator: &ScalarField<f64, 2>) -> f64 {
    let points = points(indicator);
    let whole = Line::fit(&points, |_| true);
    let mut joint = whole.centre;
    let mut arms = [whole, whole];
    for _ in 0..ROUNDS {
        let [left, right] = arms.map(|arm| arm.direction);
        let across = [left[0] + right[0], left[1] + right[1]];
        let along = |p: [f64; 2], direction: [f64; 2]| dot(sub(p, joint), direction);
        arms = [
            Line::fit(&points, |p| {
                along(p, across) < 0.0 && along(p, left) < -BEND
            }),
            Line::fit(&points, |p| {
                along(p, across) > 0.0 && along(p, right) > BEND
            }),
        ];
        let middle = mean(arms[0].centre, arms[1].centre);
        joint = mean(arms[0].at(middle, across), arms[1].at(middle, across));
    }
    // Both directions point to larger x: the left arm rises by as much as the right one falls.
    let turn = |arm: &Line| arm.direction[1].atan2(arm.direction[0]).to_degrees();
    180.0 - (turn(&arms[0]) - turn(&arms[1]))
}

/// The indicator of a signed distance, with a ramp of one spacing.
pub fn indicator(signed_distance: &ScalarField<f64, 2>) -> ScalarField<f64, 2> {
    let grid = *signed_distance.grid();
    let ramp = |d: &f64| (0.5 + d / grid.spacing()).clamp(0.0, 1.0);
    let values = signed_distance.as_slice().iter().map(ramp).collect();
    ScalarField::from_vec(grid, values).expect("as many values as nodes")
}

/// Points all over the object and their weights: the nodes of a finer grid, so that what is cut
/// away about the joint is cut finely.
fn points(indicator: &ScalarField<f64, 2>) -> Vec<([f64; 2], f64)> {
    let fine = indicator.grid().finer().finer();
    let samples = (0..fine.n_nodes()).map(|i| {
        let position = fine.position(fine.node(i));
        (position, indicator.sample(position)[0])
    });
    samples.filter(|&(_, weight)| weight > 0.0).collect()
}

/// A line through the middle of a set of points, along its longer axis and to larger `x`.
#[derive(Clone, Copy)]
struct Line {
    centre: [f64; 2],
    direction: [f64; 2],
}

impl Line {
    fn fit(points: &[([f64; 2], f64)], chosen: impl Fn([f64; 2]) -> bool) -> Self {
        let chosen: Vec<_> = points.iter().filter(|(p, _)| chosen(*p)).collect();
        let total: f64 = chosen.iter().map(|(_, w)| w).sum();
        let moment = |f: &dyn Fn([f64; 2]) -> f64| {
            chosen.iter().map(|(p, w)| w * f(*p)).sum::<f64>() / total
        };
        let centre = [moment(&|p| p[0]), moment(&|p| p[1])];
        let second = |i: usize, k: usize| moment(&|p| (p[i] - centre[i]) * (p[k] - centre[k]));
        let angle = 0.5 * (2.0 * second(0, 1)).atan2(second(0, 0) - second(1, 1));
        let (sin, cos) = angle.sin_cos();
        let sign = if cos < 0.0 { -1.0 } else { 1.0 };
        Self {
            centre,
            direction: [sign * cos, sign * sin],
        }
    }

    /// The point of the line whose position along `across` is that of `middle`.
    fn at(&self, middle: [f64; 2], across: [f64; 2]) -> [f64; 2] {
        let t = dot(sub(middle, self.centre), across) / dot(self.direction, across);
        [0, 1].map(|k| self.centre[k] + t * self.direction[k])
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn sub(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn mean(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}
