//! Several minima from several starts.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{Cause, Doubt};
use shape_average::{
    AverageParams, AverageResult, BoundaryCondition, Minima, Minimum, StartKind, average,
    average_from, doubts_of_minima, starts,
};

use crate::support::shapes::{ellipsoid, shape, turned};

/// The lowest result and all minima from `n` starts.
fn minima_of(
    shapes: &[ScalarField<f64, 2>],
    params: &AverageParams,
    n: usize,
) -> (AverageResult<2>, Vec<Minimum>) {
    let mut minima = Minima::new(params);
    for start in starts(shapes, params, n).unwrap() {
        let found = average_from(shapes, &[], &start.displacements, params, &mut Silent).unwrap();
        minima.add(found).unwrap();
    }
    let (lowest, list) = minima.finish().unwrap().unwrap();
    assert_eq!(lowest.energy.total.to_bits(), list[0].energy.to_bits());
    assert_eq!((list[0].excess, list[0].state_distance), (0.0, 0.0));
    // None is lower by more than what the minimiser resolves.
    assert!(list.iter().all(|minimum| minimum.excess >= -0.01));
    let others = &list[1..];
    assert!(
        others
            .windows(2)
            .all(|pair| pair[0].energy <= pair[1].energy)
    );
    let mut all: Vec<usize> = list.iter().flat_map(|m| m.starts.clone()).collect();
    all.sort_unstable();
    assert_eq!(all, (1..=n).collect::<Vec<_>>());
    println!("{list:#?}");
    (lowest, list)
}

fn ambiguous(minima: &[Minimum]) -> Option<Doubt> {
    let doubts = doubts_of_minima(minima);
    doubts.into_iter().find(|d| d.cause == Cause::Ambiguous)
}

/// A cross with four arms about the middle, the first of another length, turned by an angle in degrees.
fn cross(grid: Grid<2>, first: f64, angle: f64) -> ScalarField<f64, 2> {
    shape(grid, |x| {
        let arm = |k: usize| {
            let length = if k == 0 { first } else { 0.27 };
            let y = turned(x, -(angle + 90.0 * k as f64).to_radians());
            let (along, across) = (y[0] - 0.5, y[1] - 0.5);
            0.06 - (along - along.clamp(0.0, length)).hypot(across)
        };
        (0..4).map(arm).fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Identical squares fit each other in four ways, whose energies differ by rounding and by the tolerance: the
/// result is that of the usual start, and not one whose points are turned by a right angle.
#[test]
fn identical_shapes_stay_as_they_are() {
    let grid = Grid::dyadic(5);
    let square = |x: [f64; 2]| 0.2 - (x[0] - 0.5).abs().max((x[1] - 0.5).abs());
    let shapes = [0; 3].map(|_| shape(grid, square));
    let params = AverageParams::default();
    let (lowest, list) = minima_of(&shapes, &params, 4);
    assert!(list.len() > 1 && list[0].starts.contains(&1));
    let usual = average(&shapes, &params, &mut Silent).unwrap();
    assert!(lowest.displacements == usual.displacements);
}

/// A cross with a long arm and one with a short arm. With the two arms in one place, both have to become as
/// long as the others. It takes half the energy to have them in different places: in two neighbours,
/// of which the short one may lie to the left or to the right of the long one. The averages are mirror
/// images, not to be turned into each other.
#[test]
fn mirror_images_make_a_mean_ambiguous() {
    let grid = Grid::dyadic(6);
    let shapes = [cross(grid, 0.37, 10.0), cross(grid, 0.17, 10.0)];
    // The usual start, a quarter turn, a random one, and the opposite quarter turn or the half turn.
    let (_, minima) = minima_of(&shapes, &AverageParams::default(), 6);
    let usual = minima.iter().find(|m| m.starts.contains(&1)).unwrap();
    assert!(usual.excess > 0.5, "{usual:?}");
    let low: Vec<&Minimum> = minima.iter().filter(|m| m.excess < 0.1).collect();
    assert!(low.len() >= 2, "{minima:?}");
    assert!(
        low.iter()
            .skip(1)
            .all(|m| m.other_shape && m.state_distance > 0.3)
    );
    let doubt = ambiguous(&minima).unwrap();
    assert_eq!(doubt.figure, low[1].excess);
}

/// Two crossed ellipses are one ellipse that is turned, to the left or to the right: minima without elastic
/// energy, whose averages have one shape. The usual start does not break the symmetry: it ends at a square of
/// much energy.
#[test]
fn correspondences_alone_do_not_make_a_mean_ambiguous() {
    let grid = Grid::<2>::dyadic(5);
    let quarter = std::f64::consts::FRAC_PI_2;
    let shapes = [0.0, quarter].map(|turn| ellipsoid(grid, [0.35, 0.17], turn));
    let params = AverageParams::default();
    let (lowest, minima) = minima_of(&shapes, &params, 4);
    assert!(lowest.energy.parts[0] < 1e-4);
    assert_eq!(minima.len(), 3, "{minima:?}");
    assert!(!minima[1].other_shape && minima[1].state_distance > 1.0);
    assert!(minima[1].excess < 0.1);
    assert!(minima[2].other_shape && minima[2].starts.contains(&1));
    assert!(minima[2].elastic > 100.0 * lowest.energy.parts[0]);
    assert_eq!(ambiguous(&minima), None);
    for minimum in &minima[..2] {
        let curvature = minimum.least_eigenvalue.unwrap();
        assert!(curvature.converged && Doubt::saddle(&curvature).is_none());
        // Bending an ellipse of half-axes .35 and .17 along its length takes about 5 in this unit, and the
        // two minima are mirror images.
        assert!((2.0..10.0).contains(&curvature.value), "{curvature:?}");
        let measured = curvature.measured.unwrap();
        assert!(
            (0.5..3.0).contains(&(measured / curvature.value)),
            "{curvature:?}"
        );
    }
}

/// Shapes that differ little have one average from any start, which is that of the usual one to the bit.
#[test]
fn similar_shapes_have_one_minimum() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [[0.35, 0.2], [0.3, 0.23]].map(|radii| ellipsoid(grid, radii, 0.3));
    for boundary in [BoundaryCondition::Natural, BoundaryCondition::Identity] {
        let params = AverageParams {
            boundary,
            ..AverageParams::default()
        };
        let n = if boundary == BoundaryCondition::Natural {
            5
        } else {
            3
        };
        let (lowest, minima) = minima_of(&shapes, &params, n);
        let same = minima.iter().filter(|m| m.state_distance < 0.5);
        assert_eq!(same.count(), 1, "{minima:?}");
        // The half turn of an ellipse is another correspondence.
        assert!(minima.iter().all(|m| !m.other_shape));
        assert_eq!(doubts_of_minima(&minima), []);
        if minima[0].starts.contains(&1) {
            let usual = average(&shapes, &params, &mut Silent).unwrap();
            assert_eq!(usual.displacements, lowest.displacements);
        }
    }
}

/// The doubts follow the figures, not the way in which they came about.
#[test]
fn a_low_other_average_and_a_falling_energy_are_doubts() {
    let grid = Grid::<2>::dyadic(4);
    let shapes = [[0.35, 0.2], [0.3, 0.23]].map(|radii| ellipsoid(grid, radii, 0.3));
    let (_, minima) = minima_of(&shapes, &AverageParams::default(), 1);
    let mut other = minima[0].clone();
    (other.excess, other.other_shape) = (0.05, true);
    let causes = |minima: &[Minimum]| -> Vec<Cause> {
        doubts_of_minima(minima).iter().map(|d| d.cause).collect()
    };
    let mut both = vec![minima[0].clone(), other];
    assert_eq!(causes(&both), [Cause::Ambiguous]);
    if let Some(curvature) = &mut both[0].least_eigenvalue {
        curvature.fall = 0.05;
    }
    assert_eq!(causes(&both), [Cause::Ambiguous, Cause::Saddle]);
    both[1].excess = 0.2;
    assert_eq!(causes(&both), [Cause::Saddle]);
    both[1].excess = 0.0;
    both[1].other_shape = false;
    assert_eq!(causes(&both), [Cause::Saddle]);
}

/// The same starts every time; the first ones of a longer list; none of poses where faces are fixed.
#[test]
fn starts_are_reproducible() {
    let grid = Grid::<2>::dyadic(5);
    let quarter = std::f64::consts::FRAC_PI_2;
    let shapes = [0.0, quarter].map(|turn| ellipsoid(grid, [0.35, 0.17], turn));
    let params = AverageParams::default();
    let list = |n| starts(&shapes, &params, n).unwrap();
    let (long, short) = (list(6), list(3));
    assert_eq!(long.len(), 6);
    for (a, b) in long.iter().zip(&short) {
        assert_eq!((a.kind, &a.displacements), (b.kind, &b.displacements));
    }
    let kinds: Vec<StartKind> = long.iter().map(|start| start.kind).collect();
    let (pose, random) = (StartKind::Pose, StartKind::Random);
    assert_eq!(
        kinds,
        [StartKind::Usual, pose, random, pose, random, random]
    );
    assert!(long[0].displacements.is_empty());
    let held = AverageParams {
        boundary: BoundaryCondition::Identity,
        ..params.clone()
    };
    for start in starts(&shapes, &held, 4).unwrap().iter().skip(1) {
        assert_eq!(start.kind, random);
        let field = &start.displacements[0];
        assert!(field.sample([0.0, 0.3])[0].abs() < 1e-12);
        assert!(field.as_slice().iter().any(|u| u.abs() > 0.01));
    }
}
