//! Paths on the domain of a shape between both ends.

use fe_grid::minimise::{Evaluation, Objective, Silent};
use fe_grid::{Grid, ScalarField};
use geodesic::lagrangian::{LagrangianPath, PathObjective, lagrangian_path, lagrangian_path_back};
use geodesic::{
    Domain, DomainChoice, Geodesic, GeodesicError, GeodesicParams, Known, Shape, geodesic_between,
};
use levelset::signed_distance;
use std::f64::consts::PI;

fn field<const D: usize>(level: u32, u: impl Fn([f64; D]) -> f64 + Sync) -> ScalarField<f64, D> {
    let implicit = ScalarField::from_fn(Grid::dyadic(level), |x: [f64; D]| [u(x.map(|c| c - 0.5))]);
    signed_distance(&implicit, 0.0).unwrap()
}

fn ball<const D: usize>(level: u32, radius: f64) -> ScalarField<f64, D> {
    field(level, |x| {
        radius - x.iter().map(|c| c * c).sum::<f64>().sqrt()
    })
}

fn params(steps: usize, domain: DomainChoice) -> GeodesicParams {
    GeodesicParams {
        steps,
        domain,
        ..GeodesicParams::default()
    }
}

/// A thick line from one point to another.
fn stroke([x, y]: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share = ((x - from[0]) * along[0] + (y - from[1]) * along[1]) / square;
    let share = share.clamp(0.0, 1.0);
    0.065 - (x - from[0] - share * along[0]).hypot(y - from[1] - share * along[1])
}

fn union_of(x: [f64; 2], strokes: &[[[f64; 2]; 2]]) -> f64 {
    let all = strokes.iter().map(|[from, to]| stroke(x, *from, *to));
    all.fold(f64::NEG_INFINITY, f64::max)
}

/// Two upright legs, joined at the top.
fn arch() -> Shape<2> {
    let (a, b) = (0.27, 0.3);
    let strokes = [[[-a, -b], [-a, b]], [[a, -b], [a, b]], [[-a, b], [a, b]]];
    Shape::new(field(6, |x| union_of(x, &strokes)))
}

/// Two upright legs, joined by a V: three notches, where the arch has one.
fn legs() -> Shape<2> {
    let (a, b) = (0.27, 0.3);
    let strokes = [
        [[-a, -b], [-a, b]],
        [[a, -b], [a, b]],
        [[-a, -b], [0.0, 0.12]],
        [[a, -b], [0.0, 0.12]],
    ];
    Shape::new(field(6, |x| union_of(x, &strokes)))
}

/// The gradient of the energy with both mismatches, against differences; and the metric is symmetric and positive.
#[test]
fn gradients_and_the_metric_of_both_ends() {
    let params = params(2, DomainChoice::Middle);
    let own: ScalarField<f64, 2> = ball(4, 0.24);
    let ends = [ball(4, 0.2), ball(4, 0.28)];
    let mut objective = PathObjective::of_middle(own, ends, 2, &params).unwrap();
    let dim = objective.dim();
    assert_eq!(dim, 3 * 2 * 17 * 17);
    let wave = |frequency: f64, scale: f64| -> Vec<f64> {
        let values = (0..dim).map(|i| scale * (frequency * i as f64).sin());
        values.collect()
    };
    let (x, direction) = (wave(0.37, 2e-3), wave(1.3, 1.0));
    let mut gradient = vec![0.0; dim];
    objective.value_and_gradient(&x, &mut gradient).unwrap();
    let energy = objective.energy().clone();
    assert_eq!(energy.mismatches.len(), 2);
    assert!(energy.mismatches.iter().all(|m| *m > 1e-3), "{energy:?}");
    let mut at = |step: f64| {
        let moved = x.iter().zip(&direction);
        let moved: Vec<f64> = moved.map(|(x, d)| x + step * d).collect();
        match objective.value(&moved).unwrap() {
            Evaluation::Value(value) => value,
            Evaluation::Inadmissible => panic!("a fold"),
        }
    };
    let step = 1e-6;
    let difference = (at(step) - at(-step)) / (2.0 * step);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let derivative = dot(&gradient, &direction);
    // The mismatch on the domains of the ends has kinks.
    assert!(
        (difference / derivative - 1.0).abs() < 1e-3,
        "{difference} {derivative}"
    );

    objective.update_metric(&x).unwrap();
    let mut apply = |v: &[f64]| {
        let mut out = vec![0.0; dim];
        objective.apply_inverse_metric(v, &mut out).unwrap();
        out
    };
    let (a, b) = (wave(0.7, 1.0), wave(2.1, 1.0));
    let (pa, pb) = (apply(&a), apply(&b));
    let scale = (dot(&a, &pa) * dot(&b, &pb)).sqrt();
    assert!(dot(&a, &pa) > 0.0 && dot(&b, &pb) > 0.0);
    // Cycles are in single precision.
    assert!((dot(&a, &pb) - dot(&b, &pa)).abs() < 1e-4 * scale);
}

/// The length of a growing disk or ball, `sqrt(4 pi)` times the change of the radius in the plane with
/// `lambda = mu = 1`, as on the domains of its ends.
#[test]
fn growing_disks_have_their_length() {
    let exact = 0.08 * (4.0 * PI).sqrt();
    let [start, end] = [0.2, 0.28].map(|radius| Shape::<2>::new(ball(6, radius)));
    let length = |domain| {
        let params = GeodesicParams {
            tolerance: 1e-6,
            ..params(4, domain)
        };
        let found = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        assert!(found.end_reached(), "{:?}", found.arrival);
        found.length()
    };
    let lengths = [DomainChoice::Start, DomainChoice::End, DomainChoice::Middle].map(length);
    for length in lengths {
        assert!((length / exact - 1.0).abs() < 0.02, "{lengths:?} {exact}");
    }
}

#[test]
fn growing_balls_are_deformations_of_one_between() {
    let [start, end] = [0.22, 0.3].map(|radius| Shape::<3>::new(ball(4, radius)));
    let length = |domain| {
        let found = geodesic_between(&start, &end, &params(2, domain), &mut Silent).unwrap();
        assert!(found.end_near() && found.certificate.certified);
        found.length()
    };
    let [on_start, between] = [DomainChoice::Start, DomainChoice::Middle].map(length);
    assert!(
        (between / on_start - 1.0).abs() < 0.05,
        "{between} {on_start}"
    );
}

/// What a result says about its path, as of other domains.
fn check_consistent(found: &Geodesic<2>) {
    let steps = found.displacements.len();
    assert_eq!(found.domain, Some(Domain::Middle));
    let middle = found.middle.as_ref().unwrap();
    assert_eq!(middle.motions.len(), steps + 1);
    assert_eq!(found.motions.len(), steps);
    assert_eq!(found.level_sets.len(), steps + 1);
    assert_eq!(found.energy.step_energies.len(), steps);
    assert!(found.backward_motions.is_empty() && found.certificate.certified);
    assert!(found.length().powi(2) <= found.dissipation() * (1.0 + 1e-12));
}

/// Notches that open on the way are half open in the middle: the path is shorter than those on the domains of its ends,
/// from whose smooth boundaries they have to be drawn, and it is found by default.
#[test]
fn notches_open_from_the_middle() {
    let path =
        |domain| geodesic_between(&arch(), &legs(), &params(2, domain), &mut Silent).unwrap();
    let usual = path(DomainChoice::Better);
    check_consistent(&usual);
    assert!(
        usual.end_reached(),
        "{} {:?}",
        usual.dice_end,
        usual.arrival
    );
    let ends = [DomainChoice::Start, DomainChoice::End].map(path);
    let reached = ends.iter().filter(|other| other.end_reached());
    let least = reached.map(Geodesic::length).fold(f64::INFINITY, f64::min);
    // By 8 %, where this was written.
    assert!(
        least.is_finite() && usual.length() < 0.95 * least,
        "{} {least}",
        usual.length()
    );
}

/// The path back begins as the one there in reverse.
#[test]
fn the_path_back_is_that_there_in_reverse() {
    let ends = || [0.22, 0.28].map(|radius| Shape::<2>::new(ball(5, radius)));
    let [start, end] = ends();
    let params = params(2, DomainChoice::Middle);
    let there = lagrangian_path(&start, &end, &params, &mut Silent).unwrap();
    let back = lagrangian_path_back(&end, &start, &there, &params, &mut Silent);
    let back = back.unwrap().unwrap();
    assert_eq!(
        (there.domain, back.domain),
        (Domain::Middle, Domain::Middle)
    );
    let energies = |path: &LagrangianPath<2>| path.levels[path.levels.len() - 1].energy.clone();
    let (forth, reverse) = (energies(&there), energies(&back));
    // The law is not that of the inverse deformations: the energies of large steps differ.
    for (a, b) in forth
        .step_energies
        .iter()
        .zip(reverse.step_energies.iter().rev())
    {
        assert!((a / b - 1.0).abs() < 0.2, "{forth:?} {reverse:?}");
    }
    assert!(back.levels.len() == 1 && there.levels.len() > 1);
}

#[test]
fn hidden_shapes_have_no_shape_between() {
    let start = Shape::<2>::new(ball(5, 0.2)).with_known(Known::Inside);
    let end = Shape::new(ball(5, 0.25));
    let params = params(2, DomainChoice::Middle);
    let found = geodesic_between(&start, &end, &params, &mut Silent);
    assert!(matches!(found, Err(GeodesicError::Middle)));
}
