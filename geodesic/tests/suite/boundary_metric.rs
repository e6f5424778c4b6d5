//! The metric at a shape: closed forms on disks, balls and rings with the order of convergence, the
//! properties of a quadratic form, and agreement with the lengths of paths.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::boundary_metric::{
    Flow, MetricParams, ShapeMetric, Variation, estimate, estimate_of_mask,
};
use geodesic::{GeodesicError, GeodesicParams, geodesic};
use hyperelastic::LameModuli;
use levelset::{BoxEdge, Cause, ContourDistance, contour};
use std::f64::consts::PI;

const RADIUS: f64 = 0.3;

/// Not at a node, nor in the middle of a cell.
fn centre<const D: usize>() -> [f64; D] {
    std::array::from_fn(|k| 0.51 - 0.013 * k as f64)
}

fn distance<const D: usize>(x: [f64; D], y: [f64; D]) -> f64 {
    (0..D).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt()
}

fn ball<const D: usize>(nodes: usize, radius: f64) -> ScalarField<f64, D> {
    ScalarField::from_fn(Grid::cube(nodes), |x| [radius - distance(x, centre())])
}

fn params(lambda: f64, mu: f64) -> MetricParams {
    MetricParams {
        moduli: LameModuli { lambda, mu },
        tolerance: 1e-5,
        ..MetricParams::default()
    }
}

fn flow<const D: usize>(
    shape: &ScalarField<f64, D>,
    variation: &Variation<D>,
    params: &MetricParams,
) -> Flow<D> {
    let metric = ShapeMetric::new(shape, params).unwrap();
    let flow = metric.flow(variation, &mut Silent).unwrap();
    assert!(flow.converged, "{} {}", flow.rounds, flow.patch_residual);
    flow
}

fn harmonic<const D: usize>(degree: u32) -> Variation<D> {
    Variation::Harmonic {
        degree,
        centre: centre(),
    }
}

/// `cos(n t)` on a disk. By the potentials `a z^(n+1)` and `b z^(n-1)` of Kolosov and Muskhelishvili
/// without shear stress on the boundary, with `kappa = (lambda + 3 mu)/(lambda + mu)`:
/// `2 pi mu (n + 1) / (kappa + (n + 1)/(n - 1))`.
fn on_disk(n: u32, moduli: LameModuli) -> f64 {
    let LameModuli { lambda, mu } = moduli;
    if n == 0 {
        return 2.0 * PI * (lambda + mu);
    }
    let (n, kappa) = (f64::from(n), (lambda + 3.0 * mu) / (lambda + mu));
    2.0 * PI * mu * (n + 1.0) / (kappa + (n + 1.0) / (n - 1.0))
}

/// `P_l` on a ball: with the solid harmonic `w` the velocities are `grad w` and
/// `r^2 grad w + alpha x w`, without shear stress on the boundary together.
fn on_ball(l: u32, radius: f64, moduli: LameModuli) -> f64 {
    let LameModuli { lambda, mu } = moduli;
    if l == 0 {
        return (6.0 * lambda + 4.0 * mu) * PI * radius;
    }
    let l = f64::from(l);
    let alpha = -2.0 * (l * lambda + (3.0 * l + 1.0) * mu) / ((l + 3.0) * lambda + (l + 5.0) * mu);
    let ratio = -(2.0 * l + alpha) * radius * radius / (2.0 * (l - 1.0));
    let normal = ratio * l * radius.powf(l - 1.0) + (l + alpha) * radius.powf(l + 1.0);
    let of_gradient = 2.0 * mu * l * (l - 1.0) * radius.powf(l - 2.0);
    let of_other = lambda * (2.0 * l + alpha * (l + 3.0)) + 2.0 * mu * (l + alpha) * (l + 1.0);
    let stress = (ratio * of_gradient + of_other * radius.powf(l)) / normal;
    0.5 * stress * radius * radius * 4.0 * PI / (2.0 * l + 1.0)
}

#[test]
fn harmonics_of_a_disk_have_order_two() {
    for (lambda, mu, degree, largest) in [
        (1.0, 1.0, 0, 2e-4),
        (1.0, 1.0, 2, 1e-3),
        (1.0, 1.0, 3, 5e-3),
        (4.0, 0.5, 2, 4e-3),
        (0.0, 1.0, 3, 5e-3),
    ] {
        let params = params(lambda, mu);
        let exact = on_disk(degree, params.moduli);
        let error = |nodes| {
            let found = flow(&ball::<2>(nodes, RADIUS), &harmonic(degree), &params);
            (found.metric() / exact - 1.0).abs()
        };
        let (coarse, fine) = (error(33), error(65));
        assert!(fine < largest, "{lambda} {mu} {degree}: {fine:e}");
        let order = (coarse / fine).log2();
        assert!(order > 1.7, "{lambda} {mu} {degree}: {coarse:e} {fine:e}");
    }
}

#[test]
fn harmonics_of_a_ball_have_their_metric() {
    let params = MetricParams {
        tolerance: 1e-3,
        ..params(1.0, 1.0)
    };
    let error = |nodes, degree| {
        let found = flow(&ball::<3>(nodes, RADIUS), &harmonic(degree), &params);
        found.metric() / on_ball(degree, RADIUS, params.moduli) - 1.0
    };
    let growth = error(17, 0);
    assert!(growth.abs() < 0.01, "{growth:e}");
    let (coarse, fine) = (error(17, 2), error(33, 2));
    assert!(fine.abs() < 3e-3, "{fine:e}");
    assert!((coarse / fine).log2() > 1.3, "{coarse:e} {fine:e}");
}

/// The ring between two radii that grows on both sides: `v_r = a r + b / r`.
#[test]
fn a_ring_and_two_disks_grow() {
    let params = params(1.0, 1.0);
    let (inner, outer) = (0.12, 0.33);
    let ring = ScalarField::<f64, 2>::from_fn(Grid::cube(129), |x| {
        let r = distance(x, centre());
        [(outer - r).min(r - inner)]
    });
    let found = flow(&ring, &Variation::Growth, &params);
    // a outer + b / outer = 1, a inner + b / inner = -1.
    let a = (outer + inner) / (outer * outer - inner * inner);
    let b = outer * (1.0 - a * outer);
    let exact = 4.0 * PI * (outer * outer - inner * inner) * a * a
        + 2.0 * PI * b * b * (inner.powi(-2) - outer.powi(-2));
    let error = found.metric() / exact - 1.0;
    assert!(error.abs() < 3e-3, "{error:e}");

    let disks = ScalarField::<f64, 2>::from_fn(Grid::cube(65), |x| {
        let small = 0.12 - distance(x, [0.75, 0.72]);
        [(0.2 - distance(x, [0.3, 0.35])).max(small)]
    });
    let found = flow(&disks, &Variation::Growth, &params);
    let error = found.metric() / (8.0 * PI) - 1.0;
    assert!(error.abs() < 2e-3, "{error:e}");
    assert!(found.shear_part() < 1e-2 * found.metric());
}

fn ellipse(nodes: usize, turned: f64) -> (ScalarField<f64, 2>, impl Fn([f64; 2]) -> [f64; 2]) {
    let (sine, cosine) = turned.sin_cos();
    let back = move |[x, y]: [f64; 2]| {
        let (x, y) = (x - 0.5, y - 0.5);
        [cosine * x + sine * y, cosine * y - sine * x]
    };
    let drawn = ScalarField::from_fn(Grid::cube(nodes), |x| {
        let [x, y] = back(x);
        [0.2 * (1.0 - (x / 0.36).hypot(y / 0.2))]
    });
    (levelset::signed_distance(&drawn, 0.0).unwrap(), back)
}

fn nodal(nodes: usize, f: impl Fn([f64; 2]) -> f64) -> Variation<2> {
    Variation::Nodal(ScalarField::from_fn(Grid::cube(nodes), |x| [f(x)]))
}

fn translations<const D: usize>(nodes: usize, velocity: [f64; D]) {
    let found = flow(
        &ball::<D>(nodes, RADIUS),
        &Variation::Translation(velocity),
        &params(1.0, 1.0),
    );
    // The tolerance of the solvers, and the mass of the fluid.
    assert!(found.metric() < 5e-6, "{:e}", found.metric());
    assert!(!found.deforms());
    // The translation itself satisfies the condition at the boundary, up to the solvers.
    assert!(found.residual < 1e-4, "{:e}", found.residual);
    let middle = found.velocity.sample([0.45; D]);
    for k in 0..D {
        assert!((middle[k] - velocity[k]).abs() < 1e-3, "{middle:?}");
    }
}

#[test]
fn translations_cost_nothing() {
    translations(33, [0.3, -1.0]);
    translations(17, [0.3, -1.0, 0.5]);
}

#[test]
fn the_metric_is_a_quadratic_form() {
    let nodes = 33;
    let (shape, _) = ellipse(nodes, 0.4);
    let params = params(1.0, 1.0);
    let metric = ShapeMetric::new(&shape, &params).unwrap();
    let flow = |variation: &Variation<2>| metric.flow(variation, &mut Silent).unwrap();
    let (f, g) = (
        |[x, _]: [f64; 2]| (7.0 * x).cos(),
        |[x, y]: [f64; 2]| x * y - 0.2,
    );
    let [a, b] = [flow(&nodal(nodes, f)), flow(&nodal(nodes, g))];
    let sum = flow(&nodal(nodes, |x| f(x) + g(x)));
    let product = metric.product(&a, &b);
    let expected = a.metric() + 2.0 * product + b.metric();
    // Up to the tolerance of the solvers.
    assert!(
        (sum.metric() / expected - 1.0).abs() < 1e-4,
        "{} {expected}",
        sum.metric()
    );
    assert!(product.abs() > 0.05 * (a.metric() * b.metric()).sqrt());
    assert!(product * product < a.metric() * b.metric());
    assert!((metric.product(&b, &a) - product).abs() < 1e-12 * a.metric());
    assert!((metric.product(&a, &a) / a.metric() - 1.0).abs() < 1e-12);
    let twice = flow(&nodal(nodes, |x| -2.0 * f(x)));
    assert!((twice.metric() / (4.0 * a.metric()) - 1.0).abs() < 1e-6);
    let parts = a.volume_part() + a.shear_part();
    assert!((parts / a.metric() - 1.0).abs() < 1e-12 && a.shear_part() > 0.0);
    let none = flow(&nodal(nodes, |_| 0.0));
    assert_eq!(
        (none.metric(), none.residual, none.converged),
        (0.0, 0.0, true)
    );
}

/// Harmonics of different degrees are orthogonal on a disk.
#[test]
fn harmonics_of_a_disk_are_orthogonal() {
    let metric = ShapeMetric::new(&ball::<2>(33, RADIUS), &params(1.0, 1.0)).unwrap();
    let [a, b] = [2, 3].map(|degree| metric.flow(&harmonic(degree), &mut Silent).unwrap());
    let cosine = metric.product(&a, &b) / (a.metric() * b.metric()).sqrt();
    assert!(cosine.abs() < 2e-3, "{cosine:e}");
}

fn scaled<const D: usize>(nodes: usize) {
    let metric = |spacing: f64| {
        let grid = Grid::with_nodes([nodes; D], spacing).unwrap();
        let side = spacing * (nodes - 1) as f64;
        let centre = centre::<D>().map(|c| c * side);
        let shape = ScalarField::from_fn(grid, |x| [RADIUS * side - distance(x, centre)]);
        let variation = Variation::Harmonic { degree: 2, centre };
        flow(&shape, &variation, &params(1.0, 1.0)).metric()
    };
    let h = 1.0 / (nodes - 1) as f64;
    let ratio = metric(2.0 * h) / metric(h);
    // The small mass of the fluid has another share.
    let expected = 2f64.powi(D as i32 - 2);
    assert!((ratio / expected - 1.0).abs() < 1e-3, "{D} {ratio}");
}

/// With the same normal velocity the metric of a shape of twice the size is the same in 2D, and twice
/// as large in 3D.
#[test]
fn the_metric_scales_with_the_size() {
    scaled::<2>(33);
    scaled::<3>(17);
}

#[test]
fn a_turned_shape_has_the_same_metric() {
    let nodes = 65;
    let metric = |turned: f64| {
        let (shape, back) = ellipse(nodes, turned);
        let variation = nodal(nodes, |x| {
            let [x, y] = back(x);
            (9.0 * x).sin() + 20.0 * x * y
        });
        flow(&shape, &variation, &params(1.0, 1.0)).metric()
    };
    let upright = metric(0.0);
    for turned in [0.5, 1.1] {
        let ratio = metric(turned) / upright;
        assert!((ratio - 1.0).abs() < 0.01, "{turned} {ratio}");
    }
}

/// The path between two disks, and the variation of one towards the other.
#[test]
fn short_paths_have_the_length_of_the_metric() {
    let (from, change, nodes) = (0.25, 0.02, 65);
    let [start, end] = [from, from + change].map(|radius| ball::<2>(nodes, radius));
    let variation = Variation::towards(&start, &end).unwrap();
    let found = flow(&start, &variation, &params(1.0, 1.0));
    let exact = change * (4.0 * PI).sqrt();
    assert!((found.metric().sqrt() / exact - 1.0).abs() < 2e-3);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    let path = geodesic(&start, &end, &params, &mut Silent).unwrap();
    // The path may lag behind its end by a fraction of a cell of the two.
    let ratio = path.length() / found.metric().sqrt();
    assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
}

#[test]
fn half_the_grid_gives_the_error() {
    let params = params(1.0, 1.0);
    let found = estimate(&ball::<2>(65, RADIUS), &harmonic(3), &params, &mut Silent).unwrap();
    let exact = on_disk(3, params.moduli);
    let (actual, claimed) = ((found.flow.metric() - exact).abs(), found.error().unwrap());
    assert!(
        claimed > 0.5 * actual && claimed < 2.0 * actual,
        "{claimed} {actual}"
    );
    let extrapolated = found.extrapolated().unwrap();
    assert!((extrapolated - exact).abs() < 0.3 * actual);
    assert_eq!(found.doubts(), []);
    // Ten oscillations in 16 cells.
    let found = estimate(&ball::<2>(17, RADIUS), &harmonic(10), &params, &mut Silent).unwrap();
    assert!(!found.doubts().is_empty());
}

#[test]
fn half_the_samples_give_the_error_of_the_steps_of_a_mask() {
    let params = params(1.0, 1.0);
    let exact = on_disk(2, params.moduli);
    let masked = |samples: usize, radius: f64| {
        let lattice = Grid::<2>::cube(samples + 1);
        let mask = ScalarField::from_fn(lattice, |x| {
            [f64::from(u8::from(distance(x, centre()) < radius))]
        });
        let outline = contour(&mask, 0.5, BoxEdge::Closed).unwrap();
        let u = ContourDistance::new(&outline)
            .unwrap()
            .sample(Grid::cube(65));
        estimate_of_mask(&u, 1.0 / samples as f64, &harmonic(2), &params, &mut Silent).unwrap()
    };
    for samples in [50, 75, 100, 133, 150, 200] {
        let found = masked(samples, RADIUS);
        let actual = (found.flow.metric() - exact).abs();
        let claimed = found.sampling_error.unwrap();
        let grid = found.error().unwrap();
        // The errors of single steps partly cancel, by chance: of eighteen numbers of samples between 50 and
        // 400 both estimates together are .6 of the error at least, and that of the samples, whose coarser
        // boundary is one of a boundary with steps, six times the error of both at most.
        assert!(
            claimed + grid > 0.5 * actual && claimed < 8.0 * (actual + grid),
            "{samples}: {claimed} {grid} {actual}"
        );
        // The error by the grid alone would be no estimate.
        if samples <= 67 {
            assert!(actual > 2.0 * grid, "{actual} {grid}");
        }
        assert_eq!(found.doubts(), []);
    }
    let mut found = masked(50, RADIUS);
    found.sampling_error = Some(0.11 * found.flow.metric());
    let doubts = found.doubts();
    assert_eq!(doubts.len(), 1);
    assert_eq!(doubts[0].cause, Cause::SamplingError);
    let usual = estimate(&ball::<2>(17, RADIUS), &harmonic(2), &params, &mut Silent).unwrap();
    assert_eq!(usual.sampling_error, None);
    let nothing = estimate_of_mask(
        &ball::<2>(17, RADIUS),
        0.0,
        &harmonic(2),
        &params,
        &mut Silent,
    );
    assert!(matches!(nothing, Err(GeodesicError::Parameter { .. })));
}

#[test]
fn what_has_no_metric_is_refused() {
    let disk = ball::<2>(17, RADIUS);
    let usual = MetricParams::default();
    let empty = ball::<2>(17, -1.0);
    let refused = ShapeMetric::new(&empty, &usual).err();
    assert!(matches!(refused, Some(GeodesicError::Degenerate { .. })));
    let mut broken = disk.clone();
    broken.as_mut_slice()[3] = f64::NAN;
    let refused = ShapeMetric::new(&broken, &usual).err();
    assert!(matches!(
        refused,
        Some(GeodesicError::NotFinite { node: 3, .. })
    ));
    let soft = MetricParams {
        void_stiffness: 0.0,
        ..usual
    };
    let refused = ShapeMetric::new(&disk, &soft).err();
    assert!(matches!(refused, Some(GeodesicError::Parameter { .. })));
    let metric = ShapeMetric::new(&disk, &usual).unwrap();
    let refused = metric
        .flow(&nodal(17, |_| f64::INFINITY), &mut Silent)
        .err();
    assert!(matches!(refused, Some(GeodesicError::Parameter { .. })));
    let refused = Variation::towards(&disk, &ball(33, RADIUS)).err();
    assert!(matches!(refused, Some(GeodesicError::GridsDiffer)));
}
