//! The calculus on shapes, against the geodesics that it inverts and laws that are known.

use fe_grid::minimise::{Control, Iteration, Observer, Silent};
use fe_grid::{Field, Grid, ScalarField};
use geodesic::calculus::{
    CalculusParams, DeformationSpace, Extension, FiniteSpace, Ladder, PathSpace, SolveStatus,
    at_end, continued, exponential, logarithm, shoot, transport,
};
use geodesic::finite::Balls;
use geodesic::lagrangian::{LagrangianPath, lagrangian_path};
use geodesic::{DomainChoice, GeodesicError, GeodesicParams, Shape, geodesic};
use hyperelastic::LawSpec;
use levelset::{BoxEdge, Cause, Moments, contour, signed_distance};
use nalgebra::{Rotation2, Vector2};
use test_support::on_threads;

fn ball<const D: usize>(nodes: usize, radius: f64) -> ScalarField<f64, D> {
    ScalarField::from_fn(Grid::cube(nodes), |x| {
        let squares = x.iter().map(|x| (x - 0.5).powi(2));
        [radius - squares.sum::<f64>().sqrt()]
    })
}

/// An ellipsoid about the middle, bent upwards.
fn ellipsoid<const D: usize>(nodes: usize, axes: [f64; D], bend: f64) -> ScalarField<f64, D> {
    let implicit = ScalarField::from_fn(Grid::cube(nodes), |x| {
        let mut y = x.map(|x| x - 0.5);
        y[1] -= bend * (y[0] * y[0] - 0.02);
        let squares = y.iter().zip(&axes).map(|(y, a)| (y / a).powi(2));
        let least = axes.iter().copied().fold(1.0, f64::min);
        [least * (1.0 - squares.sum::<f64>().sqrt())]
    });
    signed_distance(&implicit, 0.0).unwrap()
}

/// A path that is stationary nearly to rounding.
fn sharp(steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        domain: DomainChoice::Start,
        tolerance: 1e-11,
        max_iterations: Some(2000),
        ..GeodesicParams::default()
    }
}

fn path<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    steps: usize,
) -> LagrangianPath<D> {
    lagrangian_path(
        &Shape::new(start.clone()),
        &Shape::new(end.clone()),
        &sharp(steps),
        &mut Silent,
    )
    .unwrap()
}

/// The largest distance of two displacements inside a shape.
fn apart<const D: usize>(
    shape: &ScalarField<f64, D>,
    a: &Field<f64, D, D>,
    b: &Field<f64, D, D>,
) -> f64 {
    let mut most = 0.0f64;
    for (node, &u) in shape.as_slice().iter().enumerate() {
        if u > 0.0 {
            let (a, b) = (a.at(node), b.at(node));
            most = (0..D).map(|k| (a[k] - b[k]).abs()).fold(most, f64::max);
        }
    }
    most
}

fn combination<const D: usize>(
    s: f64,
    x: &Field<f64, D, D>,
    t: f64,
    y: &Field<f64, D, D>,
) -> Field<f64, D, D> {
    let sums = x.as_slice().iter().zip(y.as_slice());
    Field::from_vec(*x.grid(), sums.map(|(x, y)| s * x + t * y).collect()).unwrap()
}

/// All deformations of an extension that needed no other start shape.
fn only_piece<const D: usize>(extension: &Extension<D>) -> &[Field<f64, D, D>] {
    assert_eq!(extension.pieces.len(), 1, "{:?}", extension.reports);
    &extension.pieces[0].displacements
}

/// The first step of a geodesic, continued, gives back the rest.
fn check_shooting<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    steps: usize,
) {
    let path = path(start, end, steps);
    let params = CalculusParams::from(&sharp(steps));
    let first = &path.displacements[..1];
    let found = exponential(start, first, steps - 1, &params, &mut Silent).unwrap();
    assert_eq!(found.status(), SolveStatus::Converged);
    assert!(found.certificate.certified, "{:?}", found.certificate);
    let mut silent = Silent;
    let space = DeformationSpace::new(start, &params, 0, &mut silent).unwrap();
    let energies = &path.levels.last().unwrap().energy.step_energies;
    for (k, shot) in only_piece(&found).iter().enumerate() {
        let asked = &path.displacements[k + 1];
        // The path is stationary to the root of 1e-11 of its energy at worst, in a direction that
        // costs something; each equation is solved to 1e-6 of a step of about .02. What costs
        // nothing is a rigid motion.
        let error = apart(start, &space.nearest(shot, asked), asked);
        assert!(error < 1e-6, "{k}: {error}");
        let energy = found.step_energies[k];
        assert!((energy / energies[k + 1] - 1.0).abs() < 1e-5);
    }
    // Few iterations: an equation is nearly linear, and its metric nearly its derivative.
    for report in &found.reports {
        assert!(report.iterations <= 30, "{report:?}");
    }
}

#[test]
fn shooting_gives_back_a_geodesic() {
    check_shooting(&ball::<2>(33, 0.22), &ellipsoid(33, [0.3, 0.18], 0.0), 4);
    check_shooting(
        &ball::<3>(13, 0.24),
        &ellipsoid(13, [0.3, 0.22, 0.2], 0.0),
        2,
    );
}

/// Where everything is scaled, all equations are that of balls, whatever the weights.
fn check_scaling<const D: usize>(shrinking: bool) {
    let start = ball::<D>(if D == 2 { 33 } else { 17 }, 0.25);
    let speed = if shrinking { -0.3 } else { 0.3 };
    let velocity = Field::from_fn(*start.grid(), |x| x.map(|x| speed * (x - 0.5)));
    let steps = 4;
    let params = CalculusParams {
        tolerance: 1e-9,
        ..CalculusParams::default()
    };
    let found = shoot(&start, &velocity, steps, &params, &mut Silent).unwrap();
    let balls = Balls::<D>::new(LawSpec::default()).unwrap();
    let mut space = FiniteSpace {
        dissimilarity: &balls,
    };
    let second = 1.0 + speed / steps as f64;
    let mut scales = vec![second];
    let rest = space.exponential(&[1.0], &[second], steps - 1).unwrap();
    scales.extend(rest.iter().map(|scale| scale[0]));
    for (shot, scale) in only_piece(&found).iter().zip(&scales) {
        let asked = Field::from_fn(*start.grid(), |x| x.map(|x| (scale - 1.0) * (x - 0.5)));
        // The tolerance of four equations; the cycle works in single precision.
        let error = apart(&start, shot, &asked);
        assert!(error < 1e-7, "{scale} {error}");
    }
    // In the plane the radius grows linearly but for O(1/K^2), which is proved of the balls.
    if D == 2 {
        assert!((scales[steps - 1] - 1.0 - speed).abs() < 0.01);
    }
}

#[test]
fn balls_grow_and_shrink_as_balls_do() {
    check_scaling::<2>(false);
    check_scaling::<2>(true);
    check_scaling::<3>(false);
}

#[test]
fn a_geodesic_of_disks_goes_on_to_grow_linearly() {
    let (start, end) = (ball::<2>(65, 0.2), ball::<2>(65, 0.26));
    let steps = 4;
    let path = path(&start, &end, steps);
    let params = CalculusParams::from(&sharp(steps));
    let found = exponential(&start, &path.displacements, steps, &params, &mut Silent).unwrap();
    let (shapes, displacements) = found.shapes().unwrap();
    assert_eq!((shapes.len(), displacements.len()), (steps, steps));
    for (k, shape) in shapes.iter().enumerate() {
        let outline = contour(shape, 0.0, BoxEdge::Closed).unwrap();
        let area = Moments::of_contour(&outline).unwrap().volume;
        let radius = (area / std::f64::consts::PI).sqrt();
        let asked = 0.26 + 0.015 * (k + 1) as f64;
        // A share of a cell of 1/64: the boundary has a width, and ends a little before the end
        // shape, by what the match gives way.
        assert!((radius - asked).abs() < 0.003, "{radius} {asked}");
    }
    let (least, most) = found
        .step_energies
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(a, b), &w| (a.min(w), b.max(w)));
    // Constant speed, up to O(1/K^2).
    assert!(most / least < 1.01, "{:?}", found.step_energies);
}

#[test]
fn exponential_and_logarithm_converge_and_invert_each_other() {
    let (start, end) = (ball::<2>(33, 0.22), ellipsoid(33, [0.3, 0.18], 0.0));
    let log = |steps| logarithm(&start, &end, &sharp(steps), &mut Silent).unwrap();
    let finest = log(16);
    let params = CalculusParams::default();
    let exp = |velocity: &Field<f64, 2, 2>, steps| {
        let shot = shoot(&start, velocity, steps, &params, &mut Silent).unwrap();
        only_piece(&shot)[steps - 1].clone()
    };
    let mut silent = Silent;
    let space = DeformationSpace::new(&start, &params, 0, &mut silent).unwrap();
    let apart = |a: &Field<f64, 2, 2>, b| apart(&start, &space.nearest(a, b), b);
    // The same number of steps: what is shot is the path that the logarithm was read from.
    let coarse = log(4);
    let error = apart(&exp(&coarse.velocity, 4), &coarse.path.displacements[3]);
    assert!(error < 1e-6, "{error}");
    // Another number: O(1/K), from the chord of the first step.
    let reference = exp(&finest.velocity, 64);
    let errors = [2, 4, 8].map(|steps| apart(&exp(&finest.velocity, steps), &reference));
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // The reference has an error of its own, of an eighth of the last.
        assert!((0.8..1.5).contains(&order), "{errors:?}");
    }
    let errors = [2, 4].map(|steps| apart(&log(steps).velocity, &finest.velocity));
    let order = (errors[0] / errors[1]).log2();
    assert!((0.8..1.6).contains(&order), "{errors:?}");
}

#[test]
fn the_frame_does_not_matter() {
    let start = ball::<2>(33, 0.22);
    let end = ellipsoid(33, [0.29, 0.19], 0.6);
    let path = path(&start, &end, 2);
    let params = CalculusParams {
        tolerance: 1e-9,
        ..CalculusParams::default()
    };
    let rotation = Rotation2::new(0.8);
    let turned = |displacement: &Field<f64, 2, 2>| {
        let grid = *displacement.grid();
        let mut out = Field::zeros(grid);
        for node in 0..grid.n_nodes() {
            let (x, u) = (grid.position(grid.node(node)), displacement.at(node));
            let y = rotation * Vector2::new(x[0] + u[0], x[1] + u[1]);
            for k in 0..2 {
                out.component_mut(k)[node] = y[k] + [0.3, -0.2][k] - x[k];
            }
        }
        out
    };
    let mut silent = Silent;
    let mut space = DeformationSpace::new(&start, &params, 0, &mut silent).unwrap();
    let [a, b] = [&path.displacements[0], &path.displacements[1]];
    let c = space.extended(a, b).unwrap().unwrap();
    let own = space.extended(&turned(a), &turned(b)).unwrap().unwrap();
    // Both are solved to 1e-9 of a step; the cycle of the turned path is another.
    let error = apart(&start, &own, &turned(&c));
    assert!(error < 1e-8, "{error}");
    // And the middle of the two is where they came from.
    let middle = space.midpoint(a, &c).unwrap().unwrap();
    let error = apart(&start, &space.nearest(&middle, b), b);
    assert!(error < 1e-7, "{error}");
    let own = space.midpoint(&turned(a), &turned(&c)).unwrap().unwrap();
    let error = apart(&start, &own, &turned(&middle));
    assert!(error < 1e-8, "{error}");
}

#[test]
fn transport_is_linear_nearly_an_isometry_and_keeps_tangents() {
    let (start, end) = (ball::<2>(33, 0.22), ellipsoid(33, [0.28, 0.19], 0.5));
    let steps = 4;
    let path = path(&start, &end, steps);
    let params = CalculusParams {
        tolerance: 1e-8,
        ..CalculusParams::default()
    };
    let carry = |variation: &Field<f64, 2, 2>, symmetric| {
        let ladder = Ladder {
            symmetric,
            ..Ladder::default()
        };
        let motions = &path.displacements;
        let found = transport(&start, motions, variation, ladder, &params, &mut Silent).unwrap();
        assert_eq!(found.status(), SolveStatus::Converged);
        found.variation.unwrap()
    };
    // The tangent: one-sided rungs run along the path itself.
    let zero = Field::zeros(*start.grid());
    let tangent = combination(steps as f64, &path.displacements[0], 0.0, &zero);
    let next = exponential(&start, &path.displacements, 1, &params, &mut Silent).unwrap();
    let last = &path.displacements[steps - 1];
    let ahead = combination(steps as f64, &only_piece(&next)[0], -(steps as f64), last);
    let size = apart(&start, &ahead, &zero);
    let carried = carry(&tangent, false);
    let rigid = |carried: &Field<f64, 2, 2>, asked: &Field<f64, 2, 2>| {
        // Up to a rigid motion of the end, which the rungs choose otherwise than the path.
        let mut silent = Silent;
        let space = DeformationSpace::new(&start, &params, 0, &mut silent).unwrap();
        let small = 1e-3;
        let moved = |v: &Field<f64, 2, 2>| combination(1.0, last, small, v);
        apart(
            &start,
            &space.nearest(&moved(carried), &moved(asked)),
            &moved(asked),
        ) / small
    };
    let error = rigid(&carried, &ahead);
    assert!(error < 0.01 * size, "{error} {size}");

    // Linearity, of symmetric rungs, but for terms of third order.
    let squeeze = Field::from_fn(*start.grid(), |[x, y]| [0.2 * (x - 0.5), -0.2 * (y - 0.5)]);
    let shear = Field::from_fn(*start.grid(), |[x, y]| [0.2 * (y - 0.5), 0.1 * (x - 0.5)]);
    let sum = combination(1.0, &squeeze, 0.5, &shear);
    let (a, b) = (carry(&squeeze, true), carry(&shear, true));
    let together = combination(1.0, &a, 0.5, &b);
    let error = rigid(&carry(&sum, true), &together);
    let size = apart(&start, &together, &zero);
    assert!(error < 0.01 * size, "{error} {size}");

    // Isometry: the energy of a small step, up to what four steps of the path leave.
    let mut silent = Silent;
    let space = DeformationSpace::new(&start, &params, 0, &mut silent).unwrap();
    for (before, after) in [(&squeeze, &a), (&shear, &b)] {
        let small = 1e-2;
        let at_start = combination(small, before, 0.0, &zero);
        let at_end = combination(1.0, last, small, after);
        let energy = |a, b| space.energy(a, b).unwrap().unwrap();
        let ratio = (energy(last, &at_end) / energy(&zero, &at_start)).sqrt();
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}

/// What a path of the end domain was computed as is continued as it is: read from the start shape, it loses what the
/// interpolation takes from details of the size of a cell.
#[test]
fn a_path_of_the_end_domain_is_continued_on_it() {
    let (start, end) = (ball::<2>(33, 0.2), ellipsoid(33, [0.3, 0.15], 1.0));
    let params = GeodesicParams {
        domain: DomainChoice::End,
        ..sharp(3)
    };
    let found = geodesic(&start, &end, &params, &mut Silent).unwrap();
    let last = found.energy.step_energies[2];
    let params = CalculusParams::from(&params);
    let (shape, identity) = (&found.level_sets[3], Field::zeros(*start.grid()));
    let two = [&found.backward_motions[0], &identity];
    let next = continued(shape, two, 2, &params, &mut Silent).unwrap();
    assert_eq!(next.step_energies.len(), 2);
    let from_start = exponential(&start, &found.motions, 1, &params, &mut Silent).unwrap();
    let change = |found: &Extension<2>| (found.step_energies[0] / last - 1.0).abs();
    // A step of a third of the path differs from the next in third order.
    assert!(change(&next) < 0.01, "{}", change(&next));
    assert!(
        change(&from_start) > 3.0 * change(&next),
        "{}",
        change(&from_start)
    );
    // And its shapes go on from the end shape itself.
    let (_, steps) = next.shapes().unwrap();
    let outline = contour(shape, 0.0, BoxEdge::Open).unwrap();
    let moved = outline.points().iter().map(|&p| {
        let u = steps[0].sample(p);
        next.pieces[0].displacements[0].sample(p)[0] - u[0]
    });
    assert!(moved.fold(0.0, |most: f64, off| most.max(off.abs())) < 1e-12);
}

/// A bar that is bent until the void before its ends is used up, and on.
#[test]
fn a_used_up_void_is_renewed() {
    let start = ellipsoid(33, [0.3, 0.12], 0.0);
    let end = ellipsoid(33, [0.28, 0.12], 2.0);
    let steps = 4;
    let path = path(&start, &end, steps);
    let params = CalculusParams::from(&sharp(steps));
    let found = exponential(&start, &path.displacements, 3, &params, &mut Silent).unwrap();
    assert!(found.pieces.len() > 1, "{:?}", found.reports);
    assert_eq!(found.step_energies.len(), 3);
    assert!(found.certificate.certified, "{:?}", found.certificate);
    let last = path.levels.last().unwrap().energy.step_energies[3];
    for energy in &found.step_energies {
        // Interpolation of a boundary layer of four cells leaves its mark on the speed.
        assert!((energy / last - 1.0).abs() < 0.2, "{energy} {last}");
    }
    let (shapes, steps) = found.shapes().unwrap();
    let middle = |shape: &ScalarField<f64, 2>| {
        let outline = contour(shape, 0.0, BoxEdge::Closed).unwrap();
        Moments::of_contour(&outline).unwrap().volume
    };
    // A step carries the outline of a shape onto the next.
    for (k, step) in steps.iter().enumerate().skip(1) {
        let outline = contour(&shapes[k - 1], 0.0, BoxEdge::Open).unwrap();
        let off = outline.points().iter().map(|&p| {
            let u = step.sample(p);
            shapes[k].sample([p[0] + u[0], p[1] + u[1]])[0].abs()
        });
        let h = start.grid().spacing();
        assert!(off.fold(0.0, f64::max) < 0.3 * h);
        assert!((middle(&shapes[k]) / middle(&shapes[k - 1]) - 1.0).abs() < 0.05);
    }
    // A variation is carried over the same end.
    let stretch = Field::from_fn(*start.grid(), |[x, _]| [0.2 * (x - 0.5), 0.0]);
    let ladder = Ladder::default();
    let motions = &path.displacements;
    let carried = transport(&start, motions, &stretch, ladder, &params, &mut Silent).unwrap();
    let variation = carried.variation.unwrap();
    let (shape, variation) = at_end(&start, &motions[3], &variation, &params).unwrap();
    let grown = shoot(&shape, &variation, 2, &params, &mut Silent).unwrap();
    assert!(grown.certificate.certified);
    let (shapes, _) = grown.shapes().unwrap();
    // A stretch of the bar by a fifth, along what is bent now.
    let ratio = middle(&shapes[1]) / middle(&shape);
    assert!((ratio - 1.2).abs() < 0.06, "{ratio}");
}

#[test]
fn threads_do_not_matter() {
    let start = ball::<2>(33, 0.22);
    let velocity = Field::from_fn(*start.grid(), |[x, y]| [0.3 * (x - 0.5), 0.2 * (y - x)]);
    let once = |n| {
        on_threads(n, || {
            let params = CalculusParams::default();
            shoot(&start, &velocity, 3, &params, &mut Silent).unwrap()
        })
    };
    let (one, three) = (once(1), once(3));
    assert_eq!(one.step_energies, three.step_energies);
    assert_eq!(
        only_piece(&one)[2].as_slice(),
        only_piece(&three)[2].as_slice()
    );
}

/// Stops at the given equation.
struct Impatient(usize);

impl Observer for Impatient {
    fn level(&mut self, level: usize, n_levels: usize, _dim: usize) {
        assert!(level < n_levels);
        self.0 = self.0.saturating_sub(1);
    }
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        if self.0 == 0 {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

#[test]
fn an_observer_may_stop() {
    let start = ball::<2>(17, 0.25);
    let velocity = Field::from_fn(*start.grid(), |[x, y]| [0.3 * (x - 0.5), 0.2 * (y - x)]);
    let params = CalculusParams::default();
    let found = shoot(&start, &velocity, 8, &params, &mut Impatient(4)).unwrap();
    assert_eq!(found.status(), SolveStatus::Cancelled);
    // The first is given, and three equations have been solved.
    assert_eq!(only_piece(&found).len(), 4);
    assert_eq!(found.step_energies.len(), 4);
    let motions = only_piece(&found);
    let ladder = Ladder::default();
    let observer = &mut Impatient(2);
    let carried = transport(&start, motions, &velocity, ladder, &params, observer).unwrap();
    assert_eq!(carried.status(), SolveStatus::Cancelled);
    assert!(carried.variation.is_none());
}

#[test]
fn unfit_input_is_refused() {
    let start = ball::<2>(17, 0.25);
    let zero = Field::zeros(*start.grid());
    let params = CalculusParams::default();
    let nothing = exponential(&start, &[], 2, &params, &mut Silent);
    assert!(matches!(nothing, Err(GeodesicError::Parameter { .. })));
    let nothing = shoot(&start, &zero, 0, &params, &mut Silent);
    assert!(matches!(nothing, Err(GeodesicError::Parameter { .. })));
    let other = Field::zeros(Grid::cube(33));
    let elsewhere = exponential(&start, &[other], 2, &params, &mut Silent);
    assert!(matches!(elsewhere, Err(GeodesicError::GridsDiffer)));
    let empty = ScalarField::from_fn(*start.grid(), |_| [-1.0]);
    let none = shoot(&empty, &zero, 2, &params, &mut Silent);
    assert!(matches!(none, Err(GeodesicError::Degenerate { .. })));
    let wrong = CalculusParams {
        tolerance: -1.0,
        ..params.clone()
    };
    let refused = shoot(&start, &zero, 2, &wrong, &mut Silent);
    assert!(matches!(refused, Err(GeodesicError::Parameter { .. })));
    let linear = CalculusParams {
        law: LawSpec {
            law: "linear".parse().unwrap(),
            ..LawSpec::default()
        },
        ..params.clone()
    };
    let refused = shoot(&start, &zero, 2, &linear, &mut Silent);
    assert!(matches!(refused, Err(GeodesicError::FrameDependent { .. })));
    // What stands still stays where it is.
    let still = shoot(&start, &zero, 3, &params, &mut Silent).unwrap();
    assert_eq!(apart(&start, &only_piece(&still)[2], &zero), 0.0);
}

#[test]
fn shapes_that_leave_the_box_are_doubtful() {
    let start = ball::<2>(33, 0.2);
    let params = CalculusParams::default();
    // After three steps the face of the box goes through the middle of the disk.
    let velocity = Field::from_fn(*start.grid(), |_| [0.5, 0.0]);
    let found = shoot(&start, &velocity, 3, &params, &mut Silent).unwrap();
    assert!((found.outside - 0.5).abs() < 0.01, "{}", found.outside);
    let doubts = found.doubts(3, None);
    let doubt = doubts.iter().find(|doubt| doubt.cause == Cause::OutsideBox);
    assert_eq!(doubt.unwrap().figure, found.outside);
    let near = Field::from_fn(*start.grid(), |_| [0.25, 0.0]);
    let found = shoot(&start, &near, 3, &params, &mut Silent).unwrap();
    assert_eq!((found.outside, found.doubts(3, None).len()), (0.0, 0));
}
