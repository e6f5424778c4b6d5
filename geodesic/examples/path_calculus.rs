//! The tables of `docs/path-calculus.md`: errors of exponential map, logarithm and transport for
//! paths of more and more steps, and the orders by which they fall.
//!
//! `cargo run --release -p viscous-geodesic --example path_calculus`

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::calculus::{
    CalculusParams, DeformationSpace, FiniteSpace, Ladder, PathSpace, logarithm, shoot, transport,
};
use geodesic::finite::{Balls, Rule, StereographicSphere, finite_geodesic};
use geodesic::{GeodesicError, GeodesicParams};
use hyperelastic::LawSpec;
use levelset::signed_distance;

const STEPS: [usize; 4] = [2, 4, 8, 16];
/// Steps of what errors on shapes are measured against.
const REFERENCE: usize = 64;
/// Errors below this are those of the solvers.
const SOLVERS: f64 = 1e-6;
/// Start, velocity and variation on the sphere.
const START: [f64; 2] = [0.9, -0.3];
const VELOCITY: [f64; 2] = [-0.7, 0.8];
const VARIATION: [f64; 2] = [0.5, 0.4];

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    println!("| | K = 2 | 4 | 8 | 16 | order |");
    println!("|---|---|---|---|---|---|");
    sphere(Rule::Midpoint, "midpoint rule")?;
    sphere(Rule::Left, "left rule")?;
    balls::<2>("disks")?;
    balls::<3>("balls")?;
    shapes()
}

/// A row with the order of the last two errors.
fn row(name: &str, errors: &[f64]) {
    let cells: Vec<String> = errors.iter().map(|error| format!("{error:.2e}")).collect();
    let order = (errors[errors.len() - 2] / errors[errors.len() - 1]).log2();
    // What is left of the solvers has no order.
    let order = if errors.iter().all(|&error| error < SOLVERS) {
        "–".to_owned()
    } else {
        format!("{order:.2}")
    };
    println!("| {name} | {} | {order} |", cells.join(" | "));
}

fn rows(name: &str, error: impl Fn(usize) -> Outcome<f64>) -> Outcome<()> {
    let errors: Outcome<Vec<f64>> = STEPS.into_iter().map(error).collect();
    row(name, &errors?);
    Ok(())
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn sphere(rule: Rule, name: &str) -> Outcome<()> {
    let sphere = StereographicSphere { rule };
    let space = || FiniteSpace {
        dissimilarity: &sphere,
    };
    let end = StereographicSphere::exponential(&START, &VELOCITY);
    rows(&format!("sphere, {name}: Exp"), |steps| {
        let mut space = space();
        let second = space.combination(1.0, &START, 1.0 / steps as f64, &VELOCITY);
        let rest = space.exponential(&START, &second, steps - 1)?;
        Ok(distance(*rest.last().ok_or("no step")?, end))
    })?;
    rows(&format!("sphere, {name}: Log"), |steps| {
        let path = finite_geodesic(&sphere, START, end, steps)?;
        let found = space().logarithm(&path.points).ok_or("no step")?;
        Ok(distance(found, VELOCITY))
    })?;
    for symmetric in [false, true] {
        let rungs = if symmetric { "symmetric" } else { "one-sided" };
        rows(&format!("sphere, {name}: transport, {rungs}"), |steps| {
            let circle: Vec<[f64; 2]> = (0..=steps)
                .map(|k| k as f64 / steps as f64)
                .map(|t| StereographicSphere::exponential(&START, &VELOCITY.map(|v| t * v)))
                .collect();
            let exact = StereographicSphere::transport(&START, &end, &VARIATION);
            let ladder = Ladder {
                symmetric,
                ..Ladder::default()
            };
            let found = space().transport(&circle, &VARIATION, ladder)?;
            Ok(distance(found.ok_or("no rung")?, exact))
        })?;
    }
    Ok(())
}

/// Balls that grow from the radius .2, by .1 in unit time at first.
fn balls<const D: usize>(name: &str) -> Outcome<()> {
    let balls = Balls::<D>::new(LawSpec::default())?;
    let (start, speed, power) = (0.2f64, 0.1, D as f64 / 2.0);
    let exact = (start.powf(power) + power * start.powf(power - 1.0) * speed).powf(1.0 / power);
    rows(&format!("{name}, radius: Exp"), |steps| {
        let mut space = FiniteSpace {
            dissimilarity: &balls,
        };
        let second = start + speed / steps as f64;
        let rest = space.exponential(&[start], &[second], steps - 1)?;
        Ok((rest.last().ok_or("no step")?[0] - exact).abs())
    })
}

/// A disk that becomes a bent ellipse.
fn shapes() -> Outcome<()> {
    let grid = Grid::<2>::cube(33);
    let start = ScalarField::from_fn(grid, |[x, y]| [0.22 - (x - 0.5).hypot(y - 0.5)]);
    let implicit = ScalarField::from_fn(grid, |[x, y]| {
        let (x, y) = (x - 0.5, y - 0.5 - 0.5 * (x - 0.5).powi(2));
        [0.19 * (1.0 - (x / 0.28).hypot(y / 0.19))]
    });
    let end = signed_distance(&implicit, 0.0)?;
    let params = CalculusParams {
        tolerance: 1e-8,
        ..CalculusParams::default()
    };
    let log = |steps| -> Result<_, GeodesicError> {
        let sharp = GeodesicParams {
            steps,
            tolerance: 1e-11,
            max_iterations: Some(2000),
            ..GeodesicParams::default()
        };
        logarithm(&start, &end, &sharp, &mut Silent)
    };
    let mut silent = Silent;
    let space = DeformationSpace::new(&start, &params, 0, &mut silent)?;
    // Distances of deformations over the matter, up to a rigid motion, as shares of the motion.
    let zero = Field::zeros(grid);
    let far = |a: &Field<f64, 2, 2>, b: &Field<f64, 2, 2>| {
        let difference = space.combination(1.0, &space.nearest(a, b), -1.0, b);
        space.norm(&difference) / space.norm(&space.combination(1.0, b, -1.0, &zero))
    };
    let finest = log(REFERENCE / 2)?;
    let exp = |steps: usize| -> Outcome<Field<f64, 2, 2>> {
        let shot = shoot(&start, &finest.velocity, steps, &params, &mut Silent)?;
        let last = shot
            .pieces
            .last()
            .and_then(|piece| piece.displacements.last());
        Ok(last.ok_or("no step")?.clone())
    };
    let reference = exp(REFERENCE)?;
    rows("disk to ellipse: Exp", |steps| {
        Ok(far(&exp(steps)?, &reference))
    })?;
    rows("disk to ellipse: Log", |steps| {
        // What is free is a rigid motion of the first deformation, not of the velocity.
        let share = 1.0 / steps as f64;
        let asked = space.combination(share, &finest.velocity, 0.0, &zero);
        Ok(far(&log(steps)?.path.displacements[0], &asked))
    })?;
    rows("disk to ellipse: Exp of the same K after Log", |steps| {
        let found = log(steps)?;
        let shot = shoot(&start, &found.velocity, steps, &params, &mut Silent)?;
        Ok(far(
            &shot.pieces[0].displacements[steps - 1],
            &found.path.displacements[steps - 1],
        ))
    })?;
    let squeeze = Field::from_fn(grid, |[x, y]| [0.2 * (x - 0.5), -0.2 * (y - 0.5)]);
    for symmetric in [false, true] {
        let rungs = if symmetric { "symmetric" } else { "one-sided" };
        let ladder = Ladder {
            symmetric,
            ..Ladder::default()
        };
        let carry = |steps: usize| -> Outcome<Field<f64, 2, 2>> {
            // Every path is a part of the finest one, so that all have the same end.
            let stride = finest.path.displacements.len() / steps;
            let path: Vec<_> = (1..=steps)
                .map(|k| finest.path.displacements[stride * k - 1].clone())
                .collect();
            let found = transport(&start, &path, &squeeze, ladder, &params, &mut Silent)?;
            Ok(found.variation.ok_or("no rung")?)
        };
        let exact = carry(REFERENCE / 2)?;
        rows(&format!("disk to ellipse: transport, {rungs}"), |steps| {
            Ok(far(&carry(steps)?, &exact))
        })?;
    }
    Ok(())
}
