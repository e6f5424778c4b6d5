//! The metric of shape space at one shape.

use fe_grid::minimise::Silent;
use std::f64::consts::PI;

use fe_grid::{Grid, ScalarField};
use geodesic::boundary_metric::{MetricParams, ShapeMetric, Variation};
use hyperelastic::LameModuli;

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "metric-disk",
        reference: "section 6",
        claim: "The least dissipation of a disk whose boundary moves with the normal velocity cos nθ is \
                2πμ(n+1)/(κ + (n+1)/(n−1)) with κ = (λ+3μ)/(λ+μ), and 2π(λ+μ) for n = 0",
        broken: "the fluid has 1.1 times its λ",
        run: disk,
    },
    Statement {
        name: "metric-ball",
        reference: "section 6",
        claim: "The least dissipation of a ball that grows with the normal velocity one is 2πR(3λ+2μ), and that of \
                the normal velocity P₂(cos θ) is the one of two solid harmonics without shear on the boundary",
        broken: "the fluid has 1.1 times its μ",
        run: in_space,
    },
];

/// A disk that is nowhere symmetric to the grid.
const CENTRE: [f64; 2] = [0.51, 0.497];
const RADIUS: f64 = 0.3;

/// The closed form on a disk: the potentials `φ = A z^(n+1)`, `ψ = B z^(n−1)` of Kolosov and Muskhelishvili, without
/// shear stress on the boundary.
pub(super) fn on_disk(n: u32, LameModuli { lambda, mu }: LameModuli) -> f64 {
    if n == 0 {
        return 2.0 * PI * (lambda + mu);
    }
    let (n, kappa) = (f64::from(n), (lambda + 3.0 * mu) / (lambda + mu));
    2.0 * PI * mu * (n + 1.0) / (kappa + (n + 1.0) / (n - 1.0))
}

/// The closed form on a ball: with the solid harmonic `w` of the degree `n` the velocities are `∇w` and
/// `r²∇w + αxw`, without shear stress on the boundary together.
pub(super) fn on_ball(n: u32, LameModuli { lambda, mu }: LameModuli, radius: f64) -> f64 {
    if n == 0 {
        return 2.0 * PI * radius * (3.0 * lambda + 2.0 * mu);
    }
    let n = f64::from(n);
    let alpha = -2.0 * (n * lambda + (3.0 * n + 1.0) * mu) / ((n + 3.0) * lambda + (n + 5.0) * mu);
    // Of the first velocity to the second, on the unit ball.
    let ratio = -(2.0 * n + alpha) / (2.0 * (n - 1.0));
    let normal = ratio * n + n + alpha;
    let stress = 2.0 * mu * (ratio * n * (n - 1.0) + (n + alpha) * (n + 1.0))
        + lambda * (2.0 * n + alpha * (n + 3.0));
    0.5 * stress / normal * radius * 4.0 * PI / (2.0 * n + 1.0)
}

fn in_space(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let moduli = LameModuli::default();
    let params = MetricParams {
        moduli: LameModuli {
            mu: setting.ingredient(1.0, 1.1) * moduli.mu,
            ..moduli
        },
        tolerance: 1e-3,
        ..MetricParams::default()
    };
    let centre = [CENTRE[0], CENTRE[1], 0.505];
    let level = setting.effort(4, 5);
    let ball = ScalarField::<f64, 3>::from_fn(Grid::dyadic(level), |x| {
        let square: f64 = x.iter().zip(centre).map(|(x, c)| (x - c).powi(2)).sum();
        [RADIUS - square.sqrt()]
    });
    let metric = ShapeMetric::new(&ball, &params)?;
    for (n, quick, full) in [(0, 0.01, 0.004), (2, 0.015, 0.005)] {
        let variation = Variation::Harmonic { degree: n, centre };
        let found = metric.flow(&variation, &mut Silent)?.metric();
        outcome.value(
            format!("G/G exact, n = {n}"),
            found / on_ball(n, moduli, RADIUS),
            1.0,
            setting.effort(quick, full),
            "where the boundary lies in its cells, of which the radius has 4.8 or 9.6",
        );
    }
    Ok(outcome)
}

fn disk(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let moduli = LameModuli::default();
    let params = MetricParams {
        moduli: LameModuli {
            lambda: setting.ingredient(1.0, 1.1) * moduli.lambda,
            ..moduli
        },
        tolerance: 1e-5,
        ..MetricParams::default()
    };
    let levels = 5..=setting.effort(6, 8);
    let metrics = levels
        .clone()
        .map(|level| {
            let disk = ScalarField::<f64, 2>::from_fn(Grid::dyadic(level), |[x, y]| {
                [RADIUS - (x - CENTRE[0]).hypot(y - CENTRE[1])]
            });
            ShapeMetric::new(&disk, &params)
        })
        .collect::<Result<Vec<_>, _>>()?;
    for (n, largest) in [(0, 3e-4), (2, 2e-3), (3, 6e-3)] {
        let variation = Variation::Harmonic {
            degree: n,
            centre: CENTRE,
        };
        let mut errors = Vec::new();
        for (level, metric) in levels.clone().zip(&metrics) {
            let found = metric.flow(&variation, &mut Silent)?.metric();
            let spacing = Grid::<2>::dyadic(level).spacing();
            errors.push((spacing, found / on_disk(n, moduli) - 1.0));
        }
        let last = errors[errors.len() - 1].1;
        outcome.order_at_least(
            format!("|G/G exact − 1|, n = {n}"),
            "h",
            errors,
            1.6,
            "two for smooth boundaries; where the contour lies in its cells adds some noise",
        );
        outcome.value(
            format!("G/G exact on the finest grid, n = {n}"),
            1.0 + last,
            1.0,
            largest,
            "twice the error at 65 nodes a side",
        );
    }
    Ok(outcome)
}
