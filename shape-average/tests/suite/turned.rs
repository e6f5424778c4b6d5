//! Averages of shapes that are not aligned: rotations cost nothing.

use crate::support::identity;
use crate::support::shapes::{ellipsoid, shape, turned};
use fe_grid::minimise::{Control, Iteration, Observer, Silent, Status};
use fe_grid::{Grid, ScalarField};
use shape_average::{AverageParams, AverageResult, BoundaryCondition, Mean, average, average_from};

/// A bracket of two rounded bars about the middle of the box, which no rotation maps to itself, turned in the plane by an
/// angle in degrees.
fn bracket<const D: usize>(grid: Grid<D>, degrees: f64) -> ScalarField<f64, D> {
    shape(grid, |x| {
        let y = turned(x, -degrees.to_radians());
        let bar = |from: [f64; 3], to: [f64; 3]| {
            let apart = (0..D).map(|k| (y[k] - y[k].clamp(from[k], to[k])).powi(2));
            0.09 - apart.sum::<f64>().sqrt()
        };
        let foot = bar([0.35, 0.38, 0.45], [0.7, 0.38, 0.45]);
        foot.max(bar([0.35, 0.38, 0.45], [0.35, 0.6, 0.6]))
    })
}

/// The average by default, and that from the identity.
fn both<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    params: &AverageParams,
) -> [AverageResult<D>; 2] {
    let identity = identity(shapes, params);
    let found = average(shapes, params, &mut Silent).unwrap();
    assert!(found.certificate.certified);
    let begun = average_from(shapes, &[], &identity, params, &mut Silent).unwrap();
    [found, begun]
}

/// Of copies that are turned, the average is the shape: what is left of the elastic energy is that of boundaries that lie
/// elsewhere in their cells.
fn check<const D: usize>(grid: Grid<D>, params: &AverageParams) {
    let shapes = [0.0, 180.0, 110.0].map(|degrees| bracket(grid, degrees));
    let [found, begun] = both(&shapes, params).map(|result| result.energy);
    assert!(begun.parts[0] > 0.001, "{begun:?}");
    assert!(found.parts[0] < 0.05 * begun.parts[0], "{found:?}");
    assert!(found.total < begun.total, "{found:?} {begun:?}");
}

#[test]
fn shapes_that_are_turned_are_not_bent() {
    check::<2>(Grid::dyadic(5), &AverageParams::default());
    let median = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    check::<2>(Grid::dyadic(4), &median);
    check::<3>(Grid::dyadic(4), &AverageParams::default());
}

/// Nothing is turned where shapes fit each other as they are, and where the faces of the box are fixed.
#[test]
fn other_averages_begin_with_the_identity() {
    let grid = Grid::<2>::dyadic(5);
    let ellipses =
        [0.0, 20.0, -10.0].map(|turn: f64| ellipsoid(grid, [0.3, 0.15], turn.to_radians()));
    let fixed = AverageParams {
        boundary: BoundaryCondition::Identity,
        ..AverageParams::default()
    };
    let turned = [0.0, 180.0].map(|degrees| bracket(grid, degrees));
    for (shapes, params) in [
        (&ellipses[..], &AverageParams::default()),
        (&turned, &fixed),
    ] {
        let [found, begun] = both(shapes, params);
        assert!(found.displacements == begun.displacements);
    }
}

/// Cancels everything, also what is not reported.
struct Cancel;

impl Observer for Cancel {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        Control::Cancel
    }

    fn between(&mut self) -> Control {
        Control::Cancel
    }
}

#[test]
fn the_comparison_of_starts_is_cancelled() {
    let shapes = [0.0, 180.0].map(|degrees| bracket(Grid::<2>::dyadic(5), degrees));
    let found = average(&shapes, &AverageParams::default(), &mut Cancel).unwrap();
    assert_eq!(found.status, Status::Cancelled);
    assert_eq!(found.levels.len(), 1);
}
