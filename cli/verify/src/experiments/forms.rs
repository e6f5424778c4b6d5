//! Geodesics on grids against linear elasticity in closed form, in both forms of a path, and of
//! several components.

use std::f64::consts::PI;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{
    DomainChoice, Form, GeodesicParams, Shape, geodesic, geodesic_between, geodesic_near,
};
use hyperelastic::{LameModuli, LawSpec};
use levelset::signed_distance;

use super::metric::{on_ball, on_disk};
use crate::error::VerifyError;
use crate::order::{differences, richardson};
use crate::outcome::{Expectation, Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::curves::disk_at;
use crate::tools::pointwise::law;
use crate::tools::shapes::{ball, ellipse};

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
        name: "path-ball-mode",
        reference: "section 6, the metric at a ball",
        claim: "To first order in e the length from a ball to R + e P₂(cos θ) is that of linear \
                elasticity under this displacement along the normals, without shear on the boundary",
        broken: "the law has 1.2 times the μ",
        run: ball_mode,
    },
    Statement {
        name: "path-forms",
        reference: "section 6, both forms of a path",
        claim: "Paths of level sets and paths of deformations of the start shape have the same length \
                where the topology does not change",
        broken: "the law of the level sets has 1.1 times the μ",
        run: both_forms,
    },
    Statement {
        name: "path-middle",
        reference: "section 6, both forms of a path",
        claim: "A path has the same length whichever shape of it is deformed: its start, its end, or one between both \
                that is carried to either",
        broken: "the other two have to arrive with a third of the weight",
        run: on_each_domain,
    },
    Statement {
        name: "path-doubled",
        reference: "section 6, K → 2K",
        claim: "Lengths of paths of K, 2K, 4K … steps, each started from the one before, change with the first \
                order of 1/K, and are those of paths of as many steps that start from nothing",
        broken: "the end shape grows with every doubling",
        run: doubled,
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
        let expected = amplitude * on_disk(n, LameModuli::new(lambda, 1.0)?).sqrt();
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

fn ball_mode(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, setting.ingredient(1.0, 1.2))?;
    let mut outcome = Outcome::with_law::<3>(spec, &[Requirement::StressFree])?;
    let grid = Grid::<3>::dyadic(setting.effort(4, 5));
    let (radius, amplitude) = (0.28, 0.03);
    let waved = ScalarField::<f64, 3>::from_fn(grid, |x| {
        let x = x.map(|x| x - 0.5);
        let r = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let cosine = if r > 0.0 { x[2] / r } else { 0.0 };
        [radius + amplitude * (1.5 * cosine * cosine - 0.5) - r]
    });
    let params = GeodesicParams {
        steps: 1,
        tolerance: 1e-4,
        ..params(spec, Form::Lagrangian)
    };
    let end = signed_distance(&waved, 0.0)?;
    let path = geodesic(&ball(grid, radius), &end, &params, &mut Silent)?;
    let expected = amplitude * on_ball(2, LameModuli::new(1.0, 1.0)?, radius).sqrt();
    outcome.value(
        "L/(e ℓ₂), e = R/9",
        path.length() / expected,
        1.0,
        setting.effort(0.07, 0.04),
        "terms of e/R, and the widths of indicator and match, where the radius is four and a half or nine \
         spacings",
    );
    Ok(outcome)
}

fn both_forms(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let (from, to) = (ball(grid, 0.22), ellipse(grid, [0.3, 0.2])?);
    let length = |form: Form, mu: f64| -> Result<f64, VerifyError> {
        let params = params(law("logdet", 1.0, mu)?, form);
        Ok(geodesic(&from, &to, &params, &mut Silent)?.length())
    };
    outcome.value(
        "length of a path of level sets over that of deformations of the start shape, two steps",
        length(Form::LevelSets, setting.ingredient(1.0, 1.1))? / length(Form::Lagrangian, 1.0)?,
        1.0,
        setting.effort(0.012, 0.004),
        "the same limit; their matches have other widths",
    );
    Ok(outcome)
}

fn on_each_domain(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let (from, to) = (ball(grid, 0.22), ellipse(grid, [0.3, 0.2])?);
    let length = |domain: DomainChoice, weight: f64| -> Result<f64, VerifyError> {
        let usual = params(LawSpec::default(), Form::Lagrangian);
        let params = GeodesicParams {
            domain,
            mismatch_weight: weight * usual.mismatch_weight,
            ..usual
        };
        Ok(geodesic(&from, &to, &params, &mut Silent)?.length())
    };
    let of_start = length(DomainChoice::Start, 1.0)?;
    for (domain, what) in [
        (DomainChoice::End, "end"),
        (DomainChoice::Middle, "shape between both"),
    ] {
        outcome.value(
            format!(
                "length on the domain of the {what} over that on the domain of the start, two steps"
            ),
            length(domain, setting.ingredient(1.0, 0.3))? / of_start,
            1.0,
            setting.effort(0.008, 0.005),
            "the discretisation in time, and how closely either end is met",
        );
    }
    Ok(outcome)
}

fn components(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let centres = [[0.27, 0.3], [0.72, 0.68]];
    let radii = [[0.15, 0.2], [0.22, setting.ingredient(0.17, 0.22)]];
    // In closed form 4π(R' − R)² for each.
    let grown = [[0.15, 0.2], [0.22, 0.17f64]];
    let expected: f64 = grown
        .iter()
        .map(|r| 4.0 * PI * (r[1] - r[0]) * (r[1] - r[0]))
        .sum();
    let (mut ratios, mut points) = (Vec::new(), Vec::new());
    let mut least = 1.0f64;
    for level in setting.effort(5..=7, 6..=8) {
        let grid = Grid::<2>::dyadic(level);
        let disks = |end: usize| [0, 1].map(|i| disk_at(grid, centres[i], radii[i][end]));
        let [from, to] = [disks(0), disks(1)];
        let both = geodesic_between(
            &Shape::of_components(from.into())?,
            &Shape::of_components(to.into())?,
            &params(spec, Form::Lagrangian),
            &mut Silent,
        )?;
        ratios.push(both.dissipation() / expected);
        points.push((grid.spacing(), both.dissipation() / expected - 1.0));
        least = both.dice_components.iter().fold(least, |a, b| b.min(a));
    }
    outcome.order_at_least(
        "|dissipation of both/(4πΣ(R′ − R)²) − 1|",
        "h",
        points,
        0.6,
        "the widths of indicator and match are numbers of cells, with errors of opposite signs",
    );
    let limit = richardson(&ratios, 1.0);
    outcome.check(
        "dissipation of both over 4πΣ(R′ − R)², extrapolated to h = 0",
        limit.value,
        limit.uncertainty,
        Expectation::Value {
            value: 1.0,
            tolerance: setting.effort(0.015, 0.01),
        },
        "that of a disk is 2π(λ+μ)(R′ − R)²; an order that is still below one leaves a share of the error on the finest grid",
    );
    outcome.at_least(
        "least overlap of a component with its end",
        least,
        0.99,
        "each reaches its own end, to a tenth of a spacing of a radius of five",
    );
    Ok(outcome)
}

fn doubled(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 4.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let start = Shape::new(ball(grid, 0.2));
    let end = |grown: f64| -> Result<Shape<2>, VerifyError> {
        Ok(Shape::new(ellipse(grid, [0.34 + grown, 0.24])?))
    };
    let params = |steps: usize| GeodesicParams {
        law: spec,
        steps,
        domain: DomainChoice::Start,
        tolerance: 1e-7,
        max_iterations: Some(400),
        ..GeodesicParams::default()
    };
    let numbers = [2, 4, 8, 16];
    let mut path = geodesic_between(&start, &end(0.0)?, &params(numbers[0]), &mut Silent)?;
    let mut lengths = vec![path.length()];
    for (doublings, &steps) in numbers.iter().enumerate().skip(1) {
        let grown = setting.ingredient(0.0, 0.01 * doublings as f64);
        let found = geodesic_near(&start, &end(grown)?, &path, &params(steps), &mut Silent)?;
        // Paths of deformations have deformations to start from.
        path = found.unwrap_or(path);
        lengths.push(path.length());
    }
    let steps = numbers.map(|steps| 1.0 / f64::from(steps as u32));
    outcome.order(
        "|L_2K − L_K|",
        "1/K",
        differences(&steps, &lengths),
        1.0,
        0.3,
        "Theorem 6.5; two steps are not in the limit yet",
    );
    let alone = geodesic_between(&start, &end(0.0)?, &params(16), &mut Silent)?;
    outcome.value(
        "length of the path of 16 steps over that of one from nothing",
        lengths[3] / alone.length(),
        1.0,
        1e-3,
        "the same minimum; lengths are minimised to the root of 1e-7",
    );
    Ok(outcome)
}
