//! The time discretisation in finite dimensions: the sphere, springs and dashpots.

use geodesic::finite::{Dashpots, Dissimilarity, Rule, StereographicSphere, finite_geodesic};

use super::doubling;
use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::search::least;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "finite-sphere",
        reference: "section 6, finite dimensions",
        claim: "On the sphere in its stereographic chart discrete geodesics tend to great circles: \
                with the second order of τ for the metric at midpoints, with the first for that at \
                starts of steps",
        broken: "the metric of the chart is multiplied by 1 + x²/20",
        run: sphere,
    },
    Statement {
        name: "finite-springs-dashpots",
        reference: "section 2, springs and dashpots",
        claim: "Springs forget the way on which they were stretched, dashpots do not: their length \
                is that of the way, √(2μ)(1.5 + 0.5) for a detour",
        broken: "springs stand in the place of the dashpots",
        run: springs_and_dashpots,
    },
    Statement {
        name: "finite-mean",
        reference: "section 2, springs or dashpots; section 4, the analogy",
        claim: "The arithmetic mean of lengths has the least energy of springs from all of them, the \
                least dissipation of dashpots, and the least sum of squared lengths of geodesics",
        broken: "one of the springs is twice as stiff",
        run: mean,
    },
    Statement {
        name: "finite-minimisers",
        reference: "section 2, length and dissipation",
        claim: "The path of least dissipation has the least length, and its speed is constant: no \
                path near it is shorter, but others of the same length dissipate more",
        broken: "the path is run through with growing speed",
        run: minimisers,
    },
];

const START: [f64; 2] = [0.9, -0.3];
const END: [f64; 2] = [-0.2, 1.1];

fn sphere(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let exact = StereographicSphere::distance(&START, &END);
    for (rule, name, order) in [
        (Rule::Midpoint, "metric at midpoints", 2.0),
        (Rule::Left, "metric at starts of steps", 1.0),
    ] {
        let sphere = Stretched {
            sphere: StereographicSphere { rule },
            more: setting.ingredient(0.0, 0.05),
        };
        let (mut lengths, mut off) = (Vec::new(), Vec::new());
        for k in doubling(16, setting.effort(64, 128)) {
            let path = finite_geodesic(&sphere, START, END, k)?;
            let tau = 1.0 / k as f64;
            lengths.push((tau, path.length() - exact));
            off.push((tau, path.points.iter().map(off_circle).fold(0.0, f64::max)));
        }
        let reason = "the error of the chart's metric in a step";
        outcome.order(
            format!("|L_τ − L|, {name}"),
            "τ",
            lengths,
            order,
            0.15,
            reason,
        );
        if rule == Rule::Midpoint {
            outcome.order(
                "distance of the points from the great circle",
                "τ",
                off,
                order,
                0.15,
                reason,
            );
        }
    }
    Ok(outcome)
}

/// The sphere with a metric that is multiplied by `1 + more x^2` at the start of a step.
struct Stretched {
    sphere: StereographicSphere,
    more: f64,
}

impl Dissimilarity<2> for Stretched {
    fn value(&self, a: &[f64; 2], b: &[f64; 2]) -> f64 {
        (1.0 + self.more * a[0] * a[0]) * self.sphere.value(a, b)
    }

    fn gradients(&self, a: &[f64; 2], b: &[f64; 2]) -> ([f64; 2], [f64; 2]) {
        let factor = 1.0 + self.more * a[0] * a[0];
        let (by_a, by_b) = self.sphere.gradients(a, b);
        let mut by_a = by_a.map(|x| factor * x);
        by_a[0] += 2.0 * self.more * a[0] * self.sphere.value(a, b);
        (by_a, by_b.map(|x| factor * x))
    }
}

/// Distance of a point from the plane of the great circle.
fn off_circle(x: &[f64; 2]) -> f64 {
    let lift = |x: &[f64; 2]| {
        let s = x[0] * x[0] + x[1] * x[1];
        nalgebra::Vector3::new(2.0 * x[0], 2.0 * x[1], s - 1.0) / (1.0 + s)
    };
    let normal = lift(&START).cross(&lift(&END)).normalize();
    lift(x).dot(&normal).abs()
}

fn springs_and_dashpots(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let viscosity = 0.5;
    let dashpot = Dashpots {
        viscosity,
        ground: 0.0,
    };
    let segment = |length: f64| [0.0, 0.0, length, 0.0];
    let stored = |from: f64, to: f64| dashpot.value(&segment(from), &segment(to)).sqrt();
    let direct = stored(1.0, 2.0);
    // What has been stored in a spring is a matter of its two ends alone.
    let detour = [1.0, 2.5, 2.0];
    let dissipated: f64 = detour.windows(2).map(|p| stored(p[0], p[1])).sum();
    let along = setting.ingredient(dissipated, stored(detour[0], detour[2]));
    let unit = (2.0 * viscosity).sqrt();
    outcome.value(
        "length of the detour 1 → 2.5 → 2 with a dashpot",
        along,
        unit * 2.0,
        1e-12,
        "√(2μ) times the way, up to rounding",
    );
    outcome.value(
        "root of the energy stored in a spring by the same",
        direct,
        unit,
        1e-12,
        "√(2μ) times the difference of the ends",
    );
    // The ground holds what is left of rigid motions.
    let held = Dashpots {
        viscosity,
        ground: 1e-4,
    };
    let path = finite_geodesic(&held, segment(1.0), segment(2.0), setting.effort(8, 16))?;
    outcome.value(
        "length of the geodesic of the dashpot from 1 to 2",
        path.length(),
        unit,
        1e-3,
        "the ground dissipates a ten-thousandth",
    );
    Ok(outcome)
}

fn mean(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let spring = Dashpots {
        viscosity: 0.5,
        ground: 1e-9,
    };
    let lengths = [1.0, 1.3, 2.2];
    let arithmetic = lengths.iter().sum::<f64>() / 3.0;
    let stiffness = [1.0, 1.0, setting.ingredient(1.0, 2.0)];
    let segment = |length: f64| [0.0, 0.0, length, 0.0];
    let stored = |x: f64| {
        let pairs = lengths.iter().zip(stiffness);
        let energies = pairs.map(|(l, k)| k * spring.value(&segment(*l), &segment(x)));
        Ok(energies.sum())
    };
    outcome.value(
        "length of least energy of three springs over the mean",
        least(stored, 1.0, 2.2)? / arithmetic,
        1.0,
        1e-6,
        "a parabola; its minimum is known to the root of rounding",
    );
    let dissipated = |x: f64| -> Result<f64, VerifyError> {
        let mut sum = 0.0;
        for (l, k) in lengths.iter().zip(stiffness) {
            sum += k * finite_geodesic(&spring, segment(*l), segment(x), 4)?
                .length()
                .powi(2);
        }
        Ok(sum)
    };
    outcome.value(
        "length of least sum of squared lengths of geodesics over the mean",
        least(dissipated, 1.0, 2.2)? / arithmetic,
        1.0,
        1e-6,
        "the space is flat: squared lengths are the energies of springs",
    );
    Ok(outcome)
}

fn minimisers(setting: Setting) -> Result<Outcome, VerifyError> {
    let sphere = StereographicSphere {
        rule: Rule::Midpoint,
    };
    let steps = 32;
    let path = finite_geodesic(&sphere, START, END, steps)?;
    let at = |t: f64| {
        let s = t * steps as f64;
        let k = (s as usize).min(steps - 1);
        let r = s - k as f64;
        [0, 1].map(|i| (1.0 - r) * path.points[k][i] + r * path.points[k + 1][i])
    };
    let figures = |points: &[[f64; 2]]| {
        let w: Vec<f64> = points
            .windows(2)
            .map(|p| sphere.value(&p[0], &p[1]))
            .collect();
        let length: f64 = w.iter().map(|w| w.sqrt()).sum();
        (length, w.len() as f64 * w.iter().sum::<f64>())
    };
    let grown = setting.ingredient(1.0, 1.5);
    let run: Vec<[f64; 2]> = (0..=steps)
        .map(|k| at((k as f64 / steps as f64).powf(grown)))
        .collect();
    let (length, dissipation) = figures(&run);
    let mut outcome = Outcome::default();
    outcome.value(
        "dissipation over the squared length",
        dissipation / (length * length),
        1.0,
        1e-4,
        "constant speed but for terms of τ²",
    );
    outcome.value(
        "length over that of the great circle",
        path.length() / StereographicSphere::distance(&START, &END),
        1.0,
        1e-3,
        "the second order of τ = 1/32",
    );
    // Paths beside it are longer, by the square of their distance.
    let mut points = Vec::new();
    for size in [0.08, 0.04, 0.02] {
        let beside: Vec<[f64; 2]> = (0..=steps)
            .map(|k| {
                let t = k as f64 / steps as f64;
                let [x, y] = run[k];
                let bump = size * (std::f64::consts::PI * t).sin();
                [x + 0.7 * bump, y + 0.6 * bump]
            })
            .collect();
        points.push((size, figures(&beside).1 / dissipation - 1.0));
    }
    outcome.order(
        "dissipation of a path beside it, less its own",
        "distance",
        points,
        2.0,
        0.1,
        "stationary, with a positive second variation",
    );
    Ok(outcome)
}
