//! Theorem 6.5 on balls about one centre, where everything has a closed form.

use std::f64::consts::PI;

use fe_grid::tensor;
use geodesic::finite::{Balls, finite_geodesic};
use hyperelastic::{LameModuli, LawSpec};

use super::doubling;
use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::matrices::stretches;
use crate::tools::pointwise::{density, dissipation, law, response};
use crate::tools::quadrature::Rule;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "dissipation-balls-2d",
        reference: "Theorem 6.5",
        claim: "On the discrete geodesic of disks Diss_τ tends to \
                Diss = 2π(λ+μ)(R₁−R₀)², and the length to √Diss; with the second order of τ where \
                λ = μ, else with the first",
        broken: "the law has 1.1 times the λ of the fluid",
        run: |setting| geodesic_of_balls::<2>(setting),
    },
    Statement {
        name: "dissipation-balls-3d",
        reference: "Theorem 6.5",
        claim: "On the discrete geodesic of balls in space Diss_τ tends to \
                Diss = (6λ+4μ)π(4/9)(R₁^(3/2)−R₀^(3/2))², with the first order of τ; at 9λ = 10μ with \
                the second",
        broken: "the law has 1.1 times the λ of the fluid",
        run: |setting| geodesic_of_balls::<3>(setting),
    },
    Statement {
        name: "dissipation-balls-growing",
        reference: "Theorem 6.5",
        claim: "For balls that grow evenly, which is no geodesic, Diss_τ tends to \
                ∫∫ diss[v] with the first order of τ",
        broken: "the steps are weighed by 1/(2τ) in place of 1/τ",
        run: growing,
    },
];

/// Radii of both ends.
const RADII: [f64; 2] = [0.2, 0.3];

/// The length of the geodesic between two balls.
fn length<const D: usize>(moduli: LameModuli) -> f64 {
    let LameModuli { lambda, mu } = moduli;
    let [r0, r1] = RADII;
    if D == 2 {
        (2.0 * PI * (lambda + mu)).sqrt() * (r1 - r0)
    } else {
        ((6.0 * lambda + 4.0 * mu) * PI).sqrt() * 2.0 / 3.0 * (r1.powf(1.5) - r0.powf(1.5))
    }
}

/// The factor of `τ` in `Diss_τ − Diss` on the geodesic: what a step sees of the third derivative of
/// `W`, and of the metric at its start in place of its middle. The path itself is stationary, so
/// that its own change does not count.
fn leading_error<const D: usize>(moduli: LameModuli) -> f64 {
    let LameModuli { lambda, mu } = moduli;
    let [r0, r1] = RADII;
    if D == 2 {
        // ∫ R′³/R of even growth
        2.0 / 3.0 * PI * (lambda - mu) * (r1 - r0).powi(2) * (r1 / r0).ln()
    } else {
        // ∫ R′³ where R^(3/2) grows evenly
        let change = r1.powf(1.5) - r0.powf(1.5);
        let cubes = 8.0 / 27.0 * change * change * 1.5 * (r1 / r0).ln();
        4.0 / 3.0 * PI * (2.25 * lambda - 2.5 * mu) * cubes
    }
}

fn geodesic_of_balls<const D: usize>(setting: Setting) -> Result<Outcome, VerifyError> {
    let moduli = [LameModuli::new(2.0, 1.0)?, LameModuli::default()];
    let wrong = setting.ingredient(1.0, 1.1);
    let used = |m: LameModuli| law("logdet", wrong * m.lambda, m.mu);
    let mut outcome = Outcome::with_law::<D>(used(moduli[0])?, &[Requirement::StressFree])?;
    let dilation = stretches([2.0; D]);
    let action = response(&used(moduli[0])?, &tensor::zero(), &dilation)?.action;
    let twice = 2.0 * dissipation(moduli[0], &dilation);
    let consistent = (tensor::contract(&action, &dilation) / twice - 1.0).abs() < 1e-10;
    outcome.condition("W_,AA(1) = 2 diss (Lemma 6.4) of dilations", consistent);
    let steps = doubling(8, setting.effort(64, 128));
    for (case, m) in moduli.into_iter().enumerate() {
        let exact = length::<D>(m);
        let balls = Balls::<D>::new(used(m)?)?;
        let leading = leading_error::<D>(m);
        let (mut dissipations, mut remainders, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
        for &k in &steps {
            let path = finite_geodesic(&balls, [RADII[0]], [RADII[1]], k)?;
            let tau = 1.0 / k as f64;
            let off = path.dissipation() - exact * exact;
            dissipations.push((tau, off));
            remainders.push((tau, off - leading * tau));
            lengths.push((tau, path.length() - exact));
        }
        let named = |what: &str| format!("{what}, λ/μ = {}", m.lambda / m.mu);
        let finest = dissipations.last().map_or(f64::NAN, |p| p.1);
        // For λ = μ the first two terms in space have opposite signs and equal size at some τ.
        let order = match (D, case) {
            (_, 0) => Some(1.0),
            (2, _) => Some(2.0),
            _ => None,
        };
        if let Some(order) = order {
            let reason = "the first term of the error that is not zero; the next adds less than .1";
            outcome.order(
                named("|Diss_τ − Diss|"),
                "τ",
                dissipations,
                order,
                0.15,
                reason,
            );
            outcome.order(named("|L_τ − L|"), "τ", lengths, order, 0.15, reason);
        }
        if leading != 0.0 {
            outcome.order(
                named("|Diss_τ − Diss − c₁τ|"),
                "τ",
                remainders,
                2.0,
                0.15,
                "c₁ in closed form: (2/3)π(λ−μ)∫R′³/R in 2D, (4/3)π(9λ/4 − 5μ/2)∫R′³ in 3D",
            );
        }
        outcome.value(
            named("Diss_τ/Diss at the smallest τ"),
            1.0 + finest / (exact * exact),
            1.0,
            0.01,
            "the closed form; a hundredth tells it from a wrong law",
        );
    }
    Ok(outcome)
}

fn growing(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 2.0, 1.0)?;
    let mut outcome = Outcome::with_law::<3>(spec, &[Requirement::StressFree])?;
    let weight = setting.ingredient(1.0, 0.5);
    let exact = [growing_limit::<2>(&spec), growing_limit::<3>(&spec)];
    for (d, exact) in [2, 3].into_iter().zip(exact) {
        let mut points = Vec::new();
        for k in doubling(8, setting.effort(128, 512)) {
            let found = if d == 2 {
                growing_sum::<2>(&spec, k)?
            } else {
                growing_sum::<3>(&spec, k)?
            };
            points.push((1.0 / k as f64, weight * found - exact));
        }
        outcome.order(
            format!("|Diss_τ − Diss| in {d}D"),
            "τ",
            points,
            1.0,
            0.15,
            "the third derivative of W, and the sum over starts of steps; λ/μ = 2",
        );
    }
    Ok(outcome)
}

fn radius(t: f64) -> f64 {
    RADII[0] + t * (RADII[1] - RADII[0])
}

fn volume<const D: usize>(radius: f64) -> f64 {
    let unit = if D == 2 { PI } else { 4.0 / 3.0 * PI };
    unit * radius.powi(D as i32)
}

fn growing_sum<const D: usize>(spec: &LawSpec, steps: usize) -> Result<f64, VerifyError> {
    let mut sum = 0.0;
    for k in 1..=steps {
        let [before, after] = [k - 1, k].map(|k| radius(k as f64 / steps as f64));
        sum += volume::<D>(before) * density(spec, &stretches([after / before; D]))?;
    }
    Ok(steps as f64 * sum)
}

fn growing_limit<const D: usize>(spec: &LawSpec) -> f64 {
    Rule::gauss(20, 0.0, 1.0).integral(|t| {
        let rate = (RADII[1] - RADII[0]) / radius(t);
        let gradient = stretches([1.0 + rate; D]);
        volume::<D>(radius(t)) * dissipation(spec.moduli, &gradient)
    })
}
