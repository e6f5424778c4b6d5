//! Theorem 6.5 for shapes other than balls: ellipses, and a flow that is not radial.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, Tensor, tensor};
use geodesic::finite::finite_geodesic;
use geodesic::{GeodesicParams, geodesic};
use hyperelastic::LameModuli;

use super::doubling;
use crate::error::VerifyError;
use crate::order::{differences, richardson};
use crate::outcome::{Expectation, Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::ellipses::{Ellipses, FluidMetric};
use crate::tools::matrices::{inverse, minus_identity};
use crate::tools::pointwise::{density, dissipation, law};
use crate::tools::quadrature::{Rule, disk};
use crate::tools::shapes::{ball, ellipse};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "dissipation-ellipses",
        reference: "Theorem 6.5",
        claim: "On discrete geodesics among ellipses that deform affinely Diss_τ tends to the \
                dissipation of the geodesic of the metric ∫ diss, with the first order of τ",
        broken: "the law has 1.1 times the λ of the fluid",
        run: ellipses,
    },
    Statement {
        name: "dissipation-ellipse-shapes",
        reference: "Theorem 6.5, 6.2",
        claim: "On discrete geodesics from a disk to an ellipse, with all deformations allowed, \
                Diss_τ tends to a limit with at least the first order of τ, no more than that of \
                the affine path",
        broken: "λ grows with the number of steps",
        run: ellipse_shapes,
    },
    Statement {
        name: "dissipation-flow",
        reference: "Theorem 6.5",
        claim: "For a smooth flow that is not radial Diss_τ tends to ∫∫ diss[v], with the \
                first order of τ",
        broken: "the law has 1.1 times the λ of the fluid",
        run: flow,
    },
];

fn ellipses(setting: Setting) -> Result<Outcome, VerifyError> {
    let moduli = LameModuli::default();
    let spec = law("logdet", setting.ingredient(1.0, 1.1), 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let (start, end) = ([0.2, 0.2], [0.35, 0.15]);
    let dissipations = |steps: &[usize]| -> Result<Vec<f64>, VerifyError> {
        let space = Ellipses { law: spec };
        steps
            .iter()
            .map(|&k| Ok(finite_geodesic(&space, start, end, k)?.dissipation()))
            .collect()
    };
    let reference: Result<Vec<f64>, VerifyError> = doubling(16, 64)
        .into_iter()
        .map(|k| Ok(finite_geodesic(&FluidMetric { moduli }, start, end, k)?.dissipation()))
        .collect();
    let reference = richardson(&reference?, 2.0);
    let steps = doubling(8, setting.effort(64, 128));
    let found = dissipations(&steps)?;
    let taus: Vec<f64> = steps.iter().map(|&k| 1.0 / k as f64).collect();
    let errors = taus
        .iter()
        .zip(&found)
        .map(|(&tau, d)| (tau, d - reference.value))
        .collect();
    outcome.order(
        "|Diss_τ − Diss|, Diss from the metric of the fluid alone",
        "τ",
        errors,
        1.0,
        0.15,
        "W at the start of a step is no symmetric function of both ends",
    );
    let limit = richardson(&found, 1.0);
    let tolerance = 1e-3 * reference.value;
    outcome.check(
        "Diss_τ, extrapolated to τ = 0",
        limit.value,
        limit.uncertainty,
        Expectation::Value {
            value: reference.value,
            tolerance,
        },
        "the geodesic of the metric, extrapolated; the terms of τ² left are a thousandth",
    );
    Ok(outcome)
}

fn ellipse_shapes(setting: Setting) -> Result<Outcome, VerifyError> {
    let level = setting.effort(5, 6);
    let grid = Grid::<2>::dyadic(level);
    let (start, end) = (ball(grid, 0.25), ellipse(grid, [0.32, 0.2])?);
    let steps = doubling(4, setting.effort(16, 32));
    let spec = law("logdet", 2.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let mut found = Vec::new();
    let mut speed = 0.0;
    for &k in &steps {
        let params = GeodesicParams {
            steps: k,
            law: law(
                "logdet",
                2.0 * setting.ingredient(1.0, 1.0 + k as f64 / 16.0),
                1.0,
            )?,
            tolerance: 1e-6,
            max_iterations: Some(400),
            ..GeodesicParams::default()
        };
        let path = geodesic(&start, &end, &params, &mut Silent)?;
        found.push(path.dissipation());
        speed = path.length().powi(2) / path.dissipation();
    }
    let taus: Vec<f64> = steps.iter().map(|&k| 1.0 / k as f64).collect();
    let points = differences(&taus, &found);
    outcome.order(
        "|Diss_τ − Diss_{τ/2}|",
        "τ",
        points,
        1.0,
        setting.effort(0.5, 0.35),
        "as for ellipses; few steps leave some of the next term",
    );
    let affine = finite_geodesic(
        &Ellipses { law: spec },
        [0.25, 0.25],
        [0.32, 0.2],
        steps[steps.len() - 1],
    )?;
    let LameModuli { lambda, mu } = LameModuli::new(2.0, 1.0)?;
    let kappa = (lambda + 3.0 * mu) / (lambda + mu);
    // The half-axes are R + d ± e: a dilation, which both paths have, and e cos 2θ.
    let (d, e) = (0.01f64, 0.06f64);
    let dilation = 2.0 * (lambda + mu) * d * d;
    let linear = (dilation + 6.0 * mu * e * e / (kappa + 3.0)) / (dilation + 2.0 * mu * e * e);
    outcome.value(
        "Diss_τ over that of the affine path",
        found[found.len() - 1] / affine.dissipation(),
        linear,
        0.01,
        "linear elasticity of the disk under d + e cos 2θ without shear on its boundary, 6μ/(κ + 3) \
         against 2μ of the affine path; half-axes change by a quarter, and grids are a hundredth off",
    );
    outcome.at_least(
        "L²/Diss at the most steps",
        speed,
        0.999,
        "constant speed at the optimum, but for terms of τ²",
    );
    Ok(outcome)
}

/// `ψ_t(X)`, a family of deformations of a disk about the origin that is not radial, affine or even
/// `Dψ_t(X)`.
fn gradient([x, y]: [f64; 2], t: f64) -> Tensor<f64, 2> {
    [
        [
            1.0 + t * t * 0.1 * y,
            t * 0.5 * (2.0 * y).cos() + t * t * 0.1 * x,
        ],
        [t * 0.4 * x + t * t * 0.15 * x.cos(), 1.0 - 0.1 * t],
    ]
}

/// `D ∂_t ψ_t(X)`.
fn velocity_gradient([x, y]: [f64; 2], t: f64) -> Tensor<f64, 2> {
    [
        [t * 0.2 * y, 0.5 * (2.0 * y).cos() + t * 0.2 * x],
        [0.4 * x + t * 0.3 * x.cos(), -0.1],
    ]
}

fn flow(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", setting.ingredient(1.0, 1.1), 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let points = disk(10, 0.5);
    let fluid = LameModuli::default();
    let exact = Rule::gauss(12, 0.0, 1.0).integral(|t| {
        points
            .iter()
            .map(|&(x, w)| {
                let a = gradient(x, t);
                let rate = tensor::product(&velocity_gradient(x, t), &inverse(&a));
                w * tensor::determinant(&a) * dissipation(fluid, &rate)
            })
            .sum()
    });
    let mut errors = Vec::new();
    let steps = doubling(8, setting.effort(64, 256));
    let mut finest = f64::NAN;
    for k in steps {
        let tau = 1.0 / k as f64;
        let mut sum = 0.0;
        for step in 1..=k {
            let (before, after) = ((step - 1) as f64 * tau, step as f64 * tau);
            for &(x, w) in &points {
                let a = gradient(x, before);
                let f = tensor::product(&gradient(x, after), &inverse(&a));
                let volume = w * tensor::determinant(&a);
                sum += volume * density(&spec, &minus_identity(&f))?;
            }
        }
        finest = k as f64 * sum;
        errors.push((tau, finest - exact));
    }
    outcome.order(
        "|Diss_τ − Diss|",
        "τ",
        errors,
        1.0,
        0.15,
        "third derivatives of W and the change of v in a step are terms of τ; Gauss points on the \
         disk are exact to 1e-12",
    );
    outcome.value(
        "Diss_τ/Diss at the smallest τ",
        finest / exact,
        1.0,
        0.01,
        "the error is of order τ, less than a hundredth there",
    );
    Ok(outcome)
}
