//! Paths of other numbers of steps and on other grids, from a path that is known.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{
    Domain, DomainChoice, Form, Geodesic, GeodesicParams, Shape, geodesic_between, geodesic_near,
};
use levelset::signed_distance;

/// A disk whose boundary has waves.
fn flower(nodes: usize, waves: f64, height: f64) -> Shape<2> {
    let implicit = ScalarField::<f64, 2>::from_fn(Grid::cube(nodes), |[x, y]| {
        let (x, y) = (x - 0.5, y - 0.5);
        [0.26 + height * (waves * y.atan2(x)).cos() - x.hypot(y)]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn params(steps: usize, domain: DomainChoice) -> GeodesicParams {
    GeodesicParams {
        steps,
        domain,
        tolerance: 1e-5,
        ..GeodesicParams::default()
    }
}

/// Paths from others are those that are computed by themselves, on every domain.
#[test]
fn paths_from_fewer_steps_and_coarser_grids_are_minimal() {
    let pair = |nodes| [flower(nodes, 2.0, 0.05), flower(nodes, 3.0, 0.04)];
    for (choice, domain) in [
        (DomainChoice::Start, Domain::Start),
        (DomainChoice::End, Domain::End),
        (DomainChoice::Middle, Domain::Middle),
    ] {
        let alone = |nodes, steps| -> Geodesic<2> {
            let [start, end] = pair(nodes);
            geodesic_between(&start, &end, &params(steps, choice), &mut Silent).unwrap()
        };
        let mut known = alone(33, 2);
        assert_eq!(known.domain, Some(domain));
        for (nodes, steps) in [(33, 4), (33, 2), (17, 2), (33, 2)] {
            let ([start, end], params) = (pair(nodes), params(steps, choice));
            let path = geodesic_near(&start, &end, &known, &params, &mut Silent);
            let path = path.unwrap().unwrap();
            assert_eq!(path.domain, Some(domain));
            assert_eq!(path.displacements.len(), steps);
            let case = format!("{choice:?}, {nodes} nodes, {steps} steps");
            let status = path.status;
            assert!(
                path.end_reached() && status.converged(),
                "{case}: {status:?}"
            );
            // Minimal up to the tolerance: the dissipation of either is above the minimum by about a thousandth.
            let other = alone(nodes, steps);
            let [found, expected] = [&path, &other].map(Geodesic::dissipation);
            let difference = found / expected - 1.0;
            assert!(difference.abs() < 4e-3, "{case}: {found} {expected}");
            known = path;
        }
    }
}

#[test]
fn paths_of_level_sets_are_no_start() {
    let [start, end] = [flower(17, 2.0, 0.05), flower(17, 3.0, 0.04)];
    let params = params(2, DomainChoice::Better);
    let level_sets = GeodesicParams {
        form: Form::LevelSets,
        max_iterations: Some(2),
        ..params.clone()
    };
    let path = geodesic_between(&start, &end, &level_sets, &mut Silent).unwrap();
    let found = geodesic_near(&start, &end, &path, &params, &mut Silent);
    assert!(found.unwrap().is_none());
}
