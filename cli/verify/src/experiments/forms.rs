//! Geodesics on grids against linear elasticity in closed form, in both forms of a path, and of
//! several components.

use std::f64::consts::PI;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{Form, Geodesic, GeodesicParams, Shape, geodesic, geodesic_between};
use hyperelastic::{LameModuli, LawSpec};
use levelset::signed_distance;

use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::curves::disk_at;
use crate::tools::pointwise::law;
use crate::tools::shapes::ball;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "path-disk-modes",
        reference: "section 6, the metric at a disk",
        claim: "To first order in e the length from a disk to R + e cos nθ is \
                e√(2πμ(n+1)/(κ + (n+1)/(n−1))), κ = (λ+3μ)/(λ+μ)",
        broken: "the law has 1.2 times the μ",
        run: |setting| modes(setting, Form::Lagrangian, &[(2, 1.0), (3, 1.0), (2, 4.0)]),
    },
    Statement {
        name: "path-disk-modes-level-sets",
        reference: "section 6, the metric at a disk",
        claim: "The same for paths of level sets",
        broken: "the law has 1.2 times the μ",
        run: |setting| modes(setting, Form::LevelSets, &[(2, 1.0)]),
    },
    Statement {
        name: "components-dissipation",
        reference: "section 6, multi-component objects",
        claim: "The dissipation of two disks that grow far from each other is the sum of those of \
                each alone",
        broken: "the second disk does not grow",
        run: components,
    },
];

fn params(spec: LawSpec, form: Form) -> GeodesicParams {
    GeodesicParams {
        form,
        steps: 2,
        law: spec,
        tolerance: 1e-6,
        max_iterations: Some(400),
        ..GeodesicParams::default()
    }
}

/// The length to first order over the amplitude, by the potentials `φ = A z^(n+1)`, `ψ = B z^(n−1)` of
/// Kolosov and Muskhelishvili; the boundary is free of shear.
fn length_per_amplitude(moduli: LameModuli, n: u32) -> f64 {
    let LameModuli { lambda, mu } = moduli;
    let (kappa, n) = ((lambda + 3.0 * mu) / (lambda + mu), f64::from(n));
    (2.0 * PI * mu * (n + 1.0) / (kappa + (n + 1.0) / (n - 1.0))).sqrt()
}

fn modes(setting: Setting, form: Form, cases: &[(u32, f64)]) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let (radius, amplitude) = (0.25, 0.02);
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    for &(n, lambda) in cases {
        let spec = law("logdet", lambda, setting.ingredient(1.0, 1.2))?;
        let waved = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
            let (x, y) = (x - 0.5, y - 0.5);
            let angle = f64::from(n) * y.atan2(x);
            [radius + amplitude * angle.cos() - x.hypot(y)]
        });
        let end = signed_distance(&waved, 0.0)?;
        let path = geodesic(&ball(grid, radius), &end, &params(spec, form), &mut Silent)?;
        let expected = amplitude * length_per_amplitude(LameModuli::new(lambda, 1.0)?, n);
        outcome.value(
            format!("L/(e ℓ_n), n = {n}, λ/μ = {lambda}, e = R/12.5"),
            path.length() / expected,
            1.0,
            0.03,
            "terms of e/R, which cancel in both directions but for a hundredth, and the widths of \
             indicator and match",
        );
    }
    Ok(outcome)
}

fn components(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let centres = [[0.27, 0.3], [0.72, 0.68]];
    let radii = [[0.13, 0.17], [0.18, setting.ingredient(0.14, 0.18)]];
    let disks = |end: usize| [0, 1].map(|i| disk_at(grid, centres[i], radii[i][end]));
    let params = params(spec, Form::Lagrangian);
    let [from, to] = [disks(0), disks(1)];
    let both = geodesic_between(
        &Shape::of_components(from.into())?,
        &Shape::of_components(to.into())?,
        &params,
        &mut Silent,
    )?;
    // In closed form 4π(R' − R)² for each.
    let grown = [[0.13, 0.17], [0.18, 0.14f64]];
    let expected: f64 = grown
        .iter()
        .map(|r| 4.0 * PI * (r[1] - r[0]) * (r[1] - r[0]))
        .sum();
    let dissipation = |path: &Geodesic<2>| path.dissipation();
    outcome.value(
        "dissipation of both over 4πΣ(R′ − R)²",
        dissipation(&both) / expected,
        1.0,
        0.06,
        "that of a disk is 2π(λ+μ)(R′ − R)², to two hundredths on a grid, and more for disks of eight \
         spacings",
    );
    outcome.at_least(
        "least overlap of a component with its end",
        both.dice_components.iter().fold(1.0, |a, b| b.min(a)),
        0.98,
        "each reaches its own end",
    );
    Ok(outcome)
}
