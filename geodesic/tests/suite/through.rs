//! Paths from the way through a third shape.

use fe_grid::minimise::{Control, Iteration, Observer, Silent};
use fe_grid::{Grid, ScalarField};
use geodesic::{
    Domain, Form, GeodesicParams, Shape, geodesic_between, geodesics_both_ways, geodesics_through,
};
use levelset::signed_distance;

fn field<const D: usize>(level: u32, u: impl Fn([f64; D]) -> f64 + Sync) -> Shape<D> {
    let implicit = ScalarField::from_fn(Grid::dyadic(level), |x: [f64; D]| [u(x.map(|c| c - 0.5))]);
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn ellipsoid<const D: usize>(level: u32, axes: [f64; D]) -> Shape<D> {
    let least = axes.into_iter().fold(f64::INFINITY, f64::min);
    field(level, |x: [f64; D]| {
        let squares = (0..D).map(|k| (x[k] / axes[k]).powi(2));
        least * (1.0 - squares.sum::<f64>().sqrt())
    })
}

fn params(steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        ..GeodesicParams::default()
    }
}

/// Wherever the way leads, through a shape on the path or far from it: the same valley has the same path.
#[test]
fn the_third_shape_is_left() {
    let (start, end) = (ellipsoid(5, [0.2, 0.2]), ellipsoid(5, [0.32, 0.16]));
    let known = geodesics_both_ways(&start, &end, &params(4), &mut Silent).unwrap();
    let known = known.map(|path| path.length());
    for axes in [[0.26, 0.18], [0.32, 0.32]] {
        let through = ellipsoid(5, axes);
        let part = |to| {
            let path = geodesic_between(&through, to, &params(4), &mut Silent).unwrap();
            path.length()
        };
        let way = part(&start) + part(&end);
        let found = geodesics_through(&start, &through, &end, &params(4), &mut Silent).unwrap();
        for (path, known) in found.unwrap().iter().zip(known) {
            assert!(path.end_reached() && path.certificate.certified);
            assert_eq!(path.domain, Some(Domain::Middle));
            let ratio = path.length() / known;
            // Lengths by the domain of an end differ by the asymmetry, 2 % with four steps.
            assert!((ratio - 1.0).abs() < 0.02, "{axes:?} {ratio}");
            // The way through the larger disk is much longer.
            let most = if axes[1] < 0.25 { 1.02 } else { 0.7 };
            let share = path.length() / way;
            assert!(share < most, "{axes:?} {share}");
        }
    }
}

#[test]
fn solids_and_one_step() {
    let [start, through, end] =
        [[0.2, 0.2, 0.2], [0.25, 0.2, 0.17], [0.3, 0.2, 0.16]].map(|axes| ellipsoid(4, axes));
    for steps in [1, 3] {
        let params = params(steps);
        let known = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        let found = geodesics_through(&start, &through, &end, &params, &mut Silent).unwrap();
        let [there, back] = found.unwrap();
        assert_eq!(there.energy.step_energies.len(), steps);
        for path in [there, back] {
            assert!(path.end_reached() && path.certificate.certified);
            // One step: the asymmetry is of first order in the steps.
            let ratio = path.length() / known.length();
            assert!((ratio - 1.0).abs() < 0.12 / steps as f64, "{steps} {ratio}");
        }
    }
}

/// What has no deformations of one shape has no such path.
#[test]
fn there_is_nothing_for_level_sets() {
    let shapes = [[0.2, 0.2], [0.22, 0.2], [0.25, 0.2]].map(|axes| ellipsoid(4, axes));
    let params = GeodesicParams {
        form: Form::LevelSets,
        ..params(2)
    };
    let found = geodesics_through(&shapes[0], &shapes[1], &shapes[2], &params, &mut Silent);
    assert!(found.unwrap().is_none());
}

/// Cancels after so many iterations.
struct Impatient(usize);

impl Observer for Impatient {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        self.0 = self.0.saturating_sub(1);
        if self.0 == 0 {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

/// In the first part, in the second one, in their sum: there is no path, or the state that was reached.
#[test]
fn a_way_can_be_cancelled() {
    let shapes = [[0.2, 0.2], [0.26, 0.18], [0.32, 0.16]].map(|axes| ellipsoid(5, axes));
    let [start, through, end] = &shapes;
    let mut found = Vec::new();
    for iterations in [1, 10, 60, 120, 160, usize::MAX] {
        let observer = &mut Impatient(iterations);
        let path = geodesics_through(start, through, end, &params(2), observer).unwrap();
        found.push(path.is_some());
    }
    assert!(!found[0] && found[found.len() - 1], "{found:?}");
    assert!(found.is_sorted(), "{found:?}");
}
