//! Exponential map, logarithm and parallel transport, and lengths of both directions.

use geodesic::calculus::{FiniteSpace, Ladder, PathSpace};
use geodesic::distances::{PathLengths, richardson};
use geodesic::finite::{Balls, Rule, StereographicSphere, finite_geodesic};

use super::doubling;
use crate::error::VerifyError;
use crate::order::richardson as extrapolated;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::ellipses::{Ellipses, FluidMetric};
use crate::tools::pointwise::law;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "calculus-exponential",
        reference: "section 2, exp",
        claim: "The discrete exponential map tends to that of the sphere with the first order of τ, \
                for the metric at midpoints and at starts of steps",
        broken: "one step too many is made",
        run: exponential,
    },
    Statement {
        name: "calculus-exponential-balls",
        reference: "section 2, exp; section 6",
        claim: "A disk of fluid that is shot grows with constant speed: its radius tends to \
                R₀ + tv, with the first order of τ",
        broken: "the first step is twice as long",
        run: shot_ball,
    },
    Statement {
        name: "calculus-logarithm",
        reference: "section 2, exp⁻¹",
        claim: "The discrete logarithm tends to that of the sphere with the first order of τ",
        broken: "it is that of a path to another point",
        run: logarithm,
    },
    Statement {
        name: "calculus-transport",
        reference: "section 2, parallel transport",
        claim: "Schild's ladder along a geodesic tends to the parallel transport of the sphere, with \
                the second order of τ for the metric at midpoints",
        broken: "the path is the straight line of the chart",
        run: transport,
    },
    Statement {
        name: "distances-both-directions",
        reference: "section 6, symmetry in the limit",
        claim: "The mean of the lengths of both directions has the second order of τ, and \
                extrapolated the fourth",
        broken: "both lengths are those of one direction",
        run: both_directions,
    },
];

const START: [f64; 2] = [0.4, -0.3];
const VELOCITY: [f64; 2] = [-0.5, 0.9];
const VARIATION: [f64; 2] = [0.6, 0.2];

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

const RULES: [(Rule, &str); 2] = [
    (Rule::Midpoint, "metric at midpoints"),
    (Rule::Left, "metric at starts of steps"),
];

fn exponential(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let exact = StereographicSphere::exponential(&START, &VELOCITY);
    for (rule, name) in RULES {
        let sphere = StereographicSphere { rule };
        let mut space = FiniteSpace {
            dissimilarity: &sphere,
        };
        let mut points = Vec::new();
        for k in doubling(16, setting.effort(64, 256)) {
            let tau = 1.0 / k as f64;
            let second = [0, 1].map(|i| START[i] + tau * VELOCITY[i]);
            let steps = k - 1 + setting.ingredient(0, 1);
            let found = space.exponential(&START, &second, steps)?;
            let last = found.last().copied().unwrap_or([f64::NAN; 2]);
            points.push((tau, apart(last, exact)));
        }
        let finest = points[points.len() - 1];
        outcome.order(
            format!("|Exp^K − exp|, {name}"),
            "τ",
            points,
            1.0,
            0.2,
            "the first step is straight in the chart",
        );
        outcome.at_most(
            format!("|Exp^K − exp|/τ at the smallest τ, {name}"),
            finest.1 / finest.0,
            1.0,
            "a half of the acceleration in the chart, which is below one; a step more is the speed of \
             one and more",
        );
    }
    Ok(outcome)
}

fn shot_ball(setting: Setting) -> Result<Outcome, VerifyError> {
    let (radius, speed) = (0.2, 0.15);
    let balls = Balls::<2>::new(law("logdet", 2.0, 1.0)?)?;
    let mut space = FiniteSpace {
        dissimilarity: &balls,
    };
    let mut points = Vec::new();
    for k in doubling(8, setting.effort(32, 128)) {
        let tau = 1.0 / k as f64;
        let second = [radius + setting.ingredient(1.0, 2.0) * tau * speed];
        let found = space.exponential(&[radius], &second, k - 1)?;
        let last = found.last().map_or(f64::NAN, |x| x[0]);
        points.push((tau, last - (radius + speed)));
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "|R_K − (R₀ + v)|",
        "τ",
        points,
        1.0,
        0.2,
        "geodesics of disks grow evenly; W is that of the start of a step, and λ/μ = 2",
    );
    Ok(outcome)
}

fn logarithm(setting: Setting) -> Result<Outcome, VerifyError> {
    let sphere = StereographicSphere {
        rule: Rule::Midpoint,
    };
    let space = FiniteSpace {
        dissimilarity: &sphere,
    };
    let end = StereographicSphere::exponential(&START, &VELOCITY);
    let aim = setting.ingredient(end, [end[0] + 0.05, end[1]]);
    let mut points = Vec::new();
    for k in doubling(16, setting.effort(64, 128)) {
        let path = finite_geodesic(&sphere, START, aim, k)?;
        let found = space.logarithm(&path.points).unwrap_or([f64::NAN; 2]);
        points.push((1.0 / k as f64, apart(found, VELOCITY)));
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "|K(x₁ − x₀) − log|",
        "τ",
        points,
        1.0,
        0.15,
        "half the acceleration of the first step in the chart",
    );
    Ok(outcome)
}

fn transport(setting: Setting) -> Result<Outcome, VerifyError> {
    let sphere = StereographicSphere {
        rule: Rule::Midpoint,
    };
    let mut space = FiniteSpace {
        dissimilarity: &sphere,
    };
    let end = StereographicSphere::exponential(&START, &VELOCITY);
    let exact = StereographicSphere::transport(&START, &end, &VARIATION);
    let mut points = Vec::new();
    for k in doubling(8, setting.effort(32, 64)) {
        let path = if setting.is_broken() {
            let at = |i: usize| i as f64 / k as f64;
            (0..=k)
                .map(|i| [0, 1].map(|j| START[j] + at(i) * (end[j] - START[j])))
                .collect()
        } else {
            finite_geodesic(&sphere, START, end, k)?.points
        };
        let found = space.transport(&path, &VARIATION, Ladder::default())?;
        points.push((1.0 / k as f64, apart(found.unwrap_or([f64::NAN; 2]), exact)));
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "|transported variation − parallel one|",
        "τ",
        points,
        2.0,
        0.2,
        "a symmetric ladder of a symmetric energy",
    );
    Ok(outcome)
}

fn both_directions(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 2.0, 1.0)?;
    let space = Ellipses { law: spec };
    let ends = [[0.2, 0.25], [0.35, 0.15]];
    let metric = FluidMetric {
        moduli: spec.moduli,
    };
    let lengths = doubling(32, 256)
        .into_iter()
        .map(|k| Ok(finite_geodesic(&metric, ends[0], ends[1], k)?.length()))
        .collect::<Result<Vec<f64>, VerifyError>>()?;
    let limit = extrapolated(&lengths, 2.0).value;
    let steps = doubling(8, setting.effort(64, 128));
    let mut found = Vec::new();
    for &k in &steps {
        let there = finite_geodesic(&space, ends[0], ends[1], k)?.length();
        let back = finite_geodesic(&space, ends[1], ends[0], k)?.length();
        let back = setting.ingredient(back, there);
        let lengths = PathLengths::from_fn(2, |i, _| Some(if i == 0 { there } else { back }));
        found.push(lengths.between(0, 1).unwrap_or(f64::NAN));
    }
    let taus: Vec<f64> = steps.iter().map(|k| 1.0 / *k as f64).collect();
    let mut outcome = Outcome::default();
    outcome.order(
        "|mean of both lengths − length|",
        "τ",
        taus.iter()
            .zip(&found)
            .map(|(t, l)| (*t, l - limit))
            .collect(),
        2.0,
        0.2,
        "the terms of first order change their sign with the direction",
    );
    let finer = found
        .windows(2)
        .map(|pair| richardson(pair[0], pair[1], 2) - limit);
    outcome.order(
        "the same, extrapolated",
        "τ",
        taus[1..].iter().copied().zip(finer).collect(),
        4.0,
        0.3,
        "the term of second order is taken out; all odd ones change their sign with the direction",
    );
    Ok(outcome)
}
