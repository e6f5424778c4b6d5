//! Definitions 6.1 and 6.2: properties that lengths of discrete paths share with distances.

use fe_grid::Grid;
use fe_grid::minimise::Silent;
use geodesic::finite::{Balls, Dissimilarity, finite_geodesic};
use geodesic::{GeodesicParams, geodesic};
use hyperelastic::LawSpec;

use super::doubling;
use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::ellipses::{Ellipses, FluidMetric};
use crate::tools::matrices::Sequence;
use crate::tools::pointwise::law;
use crate::tools::shapes::ellipse_at;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "length-dissipation",
        reference: "Definition 6.1",
        claim: "L² ≤ Diss on every path, and on discrete geodesics speeds become equal: Diss − L² \
                falls as τ²",
        broken: "the path is run through with growing speed",
        run: cauchy_schwarz,
    },
    Statement {
        name: "length-minimal",
        reference: "Definition 6.2, Theorem 6.3",
        claim: "The discrete geodesic has less energy than every path near it, and no step folds",
        broken: "the path is the straight line between the ends",
        run: minimal,
    },
    Statement {
        name: "length-symmetry",
        reference: "Definition 6.1, 6.2",
        claim: "√𝒲 is not symmetric in its two shapes; the length becomes so with the first order \
                of τ",
        broken: "𝒲 is that of the metric at midpoints, which is symmetric",
        run: symmetry,
    },
    Statement {
        name: "length-triangle",
        reference: "Definition 6.1, 6.2",
        claim: "√𝒲 violates the triangle inequality; the length satisfies it in the limit, with the \
                first order of τ",
        broken: "the direct way is that of a law with 0.6 times the λ",
        run: triangle,
    },
    Statement {
        name: "length-same-hessian",
        reference: "Lemma 6.4, Theorem 6.5",
        claim: "Laws with the same second derivative at the identity have the same continuous \
                length, whatever their growth",
        broken: "the second law has 1.1 times the μ of the first",
        run: same_hessian,
    },
    Statement {
        name: "length-volume-preservation",
        reference: "section 6, λ/μ = 0.01, 1, 100",
        claim: "The larger λ/μ, the better shapes on a geodesic preserve their volume",
        broken: "λ and μ are exchanged",
        run: volume_preservation,
    },
    Statement {
        name: "length-rigid-motions",
        reference: "section 6, rigid body motions",
        claim: "Between a shape and the same, turned or moved, the geodesic has no length",
        broken: "the law is that of linear elasticity",
        run: rigid_motions,
    },
];

const START: [f64; 2] = [0.2, 0.25];
const END: [f64; 2] = [0.35, 0.15];

fn space() -> Result<Ellipses, VerifyError> {
    Ok(Ellipses {
        law: law("logdet", 2.0, 1.0)?,
    })
}

/// Energies of the steps of a path.
fn energies<const N: usize>(space: &impl Dissimilarity<N>, points: &[[f64; N]]) -> Vec<f64> {
    points
        .windows(2)
        .map(|p| space.value(&p[0], &p[1]))
        .collect()
}

/// `K sum W - (sum sqrt W)^2`.
fn gap(energies: &[f64]) -> f64 {
    let length: f64 = energies.iter().map(|w| w.sqrt()).sum();
    // As a sum of squares, which loses no digits where all steps are equal.
    let mean = length / energies.len() as f64;
    let spread: f64 = energies.iter().map(|w| (w.sqrt() - mean).powi(2)).sum();
    energies.len() as f64 * spread
}

fn on_line(t: f64) -> [f64; 2] {
    [0, 1].map(|i| START[i] + t * (END[i] - START[i]))
}

fn cauchy_schwarz(setting: Setting) -> Result<Outcome, VerifyError> {
    let space = space()?;
    let mut outcome = Outcome::with_law::<2>(space.law, &[])?;
    let mut points = Vec::new();
    for k in doubling(8, setting.effort(64, 128)) {
        let path = if setting.is_broken() {
            (0..=k)
                .map(|i| on_line((i as f64 / k as f64).powi(2)))
                .collect()
        } else {
            finite_geodesic(&space, START, END, k)?.points
        };
        points.push((1.0 / k as f64, gap(&energies(&space, &path))));
    }
    outcome.order(
        "Diss − L²",
        "τ",
        points,
        2.0,
        0.15,
        "speeds differ by terms of order τ, of which squares are summed",
    );
    // The figures of the program are those of the definition.
    let path = finite_geodesic(&space, START, END, 8)?;
    let mut points = path.points.clone();
    if setting.is_broken() {
        points = (0..=8)
            .map(|i| on_line((f64::from(i) / 8.0).powi(2)))
            .collect();
    }
    let w = energies(&space, &points);
    outcome.value(
        "L over Σ√𝒲_k of the points of the path",
        path.length() / w.iter().map(|w| w.sqrt()).sum::<f64>(),
        1.0,
        1e-12,
        "the definition",
    );
    outcome.value(
        "Diss over KΣ𝒲_k of the points of the path",
        path.dissipation() / (8.0 * w.iter().sum::<f64>()),
        1.0,
        1e-12,
        "the definition",
    );
    Ok(outcome)
}

fn minimal(setting: Setting) -> Result<Outcome, VerifyError> {
    let space = space()?;
    let mut outcome = Outcome::with_law::<2>(space.law, &[Requirement::Barrier])?;
    let k = 8;
    let points = if setting.is_broken() {
        (0..=k)
            .map(|i| on_line(f64::from(i) / f64::from(k)))
            .collect()
    } else {
        finite_geodesic(&space, START, END, k as usize)?.points
    };
    let energy = |points: &[[f64; 2]]| energies(&space, points).iter().sum::<f64>();
    let least = energy(&points);
    let mut numbers = Sequence::new(8);
    let mut gain = f64::INFINITY;
    for size in [1e-2, 1e-3, 1e-4] {
        for _ in 0..200 {
            let mut other = points.clone();
            for point in &mut other[1..k as usize] {
                for x in point {
                    *x += size * numbers.between(-1.0, 1.0);
                }
            }
            gain = gain.min((energy(&other) - least) / (size * size * least));
        }
    }
    outcome.at_least(
        "least (E − E_geodesic)/(s² E) of 600 paths at distances s of 1e-2 to 1e-4",
        gain,
        1.0,
        "a minimum with positive curvature: the second variation is 1/a² of the half-axes, and more",
    );
    let folds = points
        .windows(2)
        .map(|p| p[1][0] * p[1][1] / (p[0][0] * p[0][1]))
        .fold(f64::INFINITY, f64::min);
    outcome.at_least(
        "least det Dφ_k",
        folds,
        0.98,
        "areas of ellipses between those of the ends, which differ by a twentieth",
    );
    Ok(outcome)
}

/// The length of a geodesic.
fn length<const N: usize>(
    space: &impl Dissimilarity<N>,
    start: [f64; N],
    end: [f64; N],
    steps: usize,
) -> Result<f64, VerifyError> {
    Ok(finite_geodesic(space, start, end, steps)?.length())
}

fn symmetry(setting: Setting) -> Result<Outcome, VerifyError> {
    let space = space()?;
    let mut outcome = Outcome::with_law::<2>(space.law, &[])?;
    if setting.is_broken() {
        let moduli = space.law.moduli;
        asymmetry(&FluidMetric { moduli }, setting, &mut outcome)?;
    } else {
        asymmetry(&space, setting, &mut outcome)?;
    }
    Ok(outcome)
}

/// The differences between both directions, of lengths and of one step.
fn asymmetry(
    space: &impl Dissimilarity<2>,
    setting: Setting,
    outcome: &mut Outcome,
) -> Result<(), VerifyError> {
    let mut points = Vec::new();
    for k in doubling(4, setting.effort(64, 128)) {
        let there = length(space, START, END, k)?;
        let back = length(space, END, START, k)?;
        points.push((1.0 / k as f64, 2.0 * (there - back) / (there + back)));
    }
    outcome.order(
        "|L(A, B) − L(B, A)| over their mean",
        "τ",
        points,
        1.0,
        0.15,
        "the terms of order τ change their sign with the direction",
    );
    let [there, back] = [
        space.value(&START, &END).sqrt(),
        space.value(&END, &START).sqrt(),
    ];
    outcome.at_least(
        "|√𝒲(A, B) − √𝒲(B, A)| over their mean",
        2.0 * (there - back).abs() / (there + back),
        0.01,
        "not symmetric, by far more than rounding",
    );
    Ok(())
}

fn triangle(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 2.0, 1.0)?;
    let balls = Balls::<2>::new(spec)?;
    let direct_balls = Balls::<2>::new(law("logdet", setting.ingredient(2.0, 1.2), 1.0)?)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    // On one geodesic, where the limit is an equality.
    let (small, middle, large) = ([0.15], [0.225], [0.3]);
    let mut points = Vec::new();
    for k in doubling(16, setting.effort(128, 256)) {
        let direct = length(&direct_balls, small, large, k)?;
        let over = length(&balls, small, middle, k)? + length(&balls, middle, large, k)?;
        points.push((1.0 / k as f64, direct / over - 1.0));
    }
    outcome.order(
        "|L(A, C)/(L(A, B) + L(B, C)) − 1|, three disks",
        "τ",
        points,
        1.0,
        0.15,
        "the limit is a distance, and additive on one geodesic",
    );
    let root = |balls: &Balls<2>, a: [f64; 1], b: [f64; 1]| balls.value(&a, &b).sqrt();
    let over = root(&balls, small, middle) + root(&balls, middle, large);
    outcome.at_least(
        "√𝒲(A, C)/(√𝒲(A, B) + √𝒲(B, C))",
        root(&direct_balls, small, large) / over,
        1.01,
        "the detour is shorter, by far more than rounding",
    );
    Ok(outcome)
}

fn same_hessian(setting: Setting) -> Result<Outcome, VerifyError> {
    let first = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(first, &[Requirement::StressFree])?;
    for other in ["power", "inverse:logdet"] {
        let second = law(other, 1.0, setting.ingredient(1.0, 1.1))?;
        let mut points = Vec::new();
        for k in doubling(16, setting.effort(64, 128)) {
            let at = |law: LawSpec| -> Result<f64, VerifyError> {
                Ok(finite_geodesic(&Ellipses { law }, START, END, k)?.length())
            };
            let (one, two) = (at(first)?, at(second)?);
            points.push((1.0 / k as f64, two / one - 1.0));
        }
        outcome.order(
            format!("|L({other})/L(logdet) − 1|"),
            "τ",
            points,
            1.0,
            0.2,
            "third derivatives differ, which is a term of order τ; exponents of 9 make the next \
             terms larger than usual",
        );
    }
    Ok(outcome)
}

fn volume_preservation(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let (start, end) = ([0.35, 0.15], [0.15, 0.35]);
    let mut changes = Vec::new();
    for ratio in [0.01, 1.0, 100.0] {
        let (lambda, mu) = setting.ingredient((ratio, 1.0), (1.0, ratio));
        let space = Ellipses {
            law: law("logdet", lambda, mu)?,
        };
        let path = finite_geodesic(&space, start, end, 16)?;
        let area = start[0] * start[1];
        let change = |p: &[f64; 2]| (p[0] * p[1] / area - 1.0).abs();
        changes.push(path.points.iter().map(change).fold(0.0, f64::max));
    }
    let [soft, even, hard] = [changes[0], changes[1], changes[2]];
    outcome.at_most(
        "largest change of the area on the way, λ/μ = 100",
        hard,
        0.01,
        "in the limit of large λ/μ no volume changes",
    );
    outcome.at_least(
        "that change at λ/μ = 1 over that at 100",
        even / hard,
        10.0,
        "a hundred times the stiffness, all but linear",
    );
    outcome.at_least(
        "that change at λ/μ = 0.01 over that at 1",
        soft / even,
        1.2,
        "more freedom still, though μ holds the volume as well",
    );
    Ok(outcome)
}

fn rigid_motions(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law(setting.ingredient("logdet", "linear"), 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let axes = [0.25, 0.15];
    let start = ellipse_at(grid, axes, [0.5; 2], 0.0)?;
    for (what, end) in [
        ("turned by 0.4", ellipse_at(grid, axes, [0.5; 2], 0.4)?),
        (
            "moved by (0.06, −0.03)",
            ellipse_at(grid, axes, [0.56, 0.47], 0.0)?,
        ),
    ] {
        let params = GeodesicParams {
            steps: 2,
            law: spec,
            tolerance: 1e-6,
            max_iterations: Some(400),
            ..GeodesicParams::default()
        };
        let path = geodesic(&start, &end, &params, &mut Silent)?;
        outcome.at_most(
            format!("length of the geodesic to the ellipse {what}"),
            path.length(),
            4e-3,
            "an ellipse on a grid, and the same turned, are a hundredth of a spacing apart; a stretch \
             by a tenth has the length .06",
        );
    }
    Ok(outcome)
}
