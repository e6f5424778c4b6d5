//! Geodesics in both directions.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{
    Domain, DomainChoice, Geodesic, GeodesicParams, Shape, geodesic_between, geodesics_both_ways,
};
use levelset::signed_distance;

fn ellipse(axes: [f64; 2]) -> Shape<2> {
    let implicit = ScalarField::from_fn(Grid::dyadic(5), |[x, y]| {
        [axes[0].min(axes[1]) * (1.0 - ((x - 0.5) / axes[0]).hypot((y - 0.5) / axes[1]))]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn params(steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        tolerance: 1e-6,
        ..GeodesicParams::default()
    }
}

fn evaluations(path: &Geodesic<2>) -> usize {
    let levels = path.levels.iter();
    levels.map(|level| level.info.evaluations.energies()).sum()
}

/// The path back is the one that is found without the path there, on the domain of that, for less.
#[test]
fn the_path_back_is_minimal_by_itself() {
    let (start, end) = (ellipse([0.2, 0.2]), ellipse([0.32, 0.16]));
    let params = params(2);
    let [forth, back] = geodesics_both_ways(&start, &end, &params, &mut Silent).unwrap();
    assert!(forth.end_reached() && back.end_reached());
    let domains = [forth.domain.unwrap(), back.domain.unwrap()];
    assert!(
        domains.contains(&Domain::Start) && domains.contains(&Domain::End),
        "{domains:?}"
    );
    let on_domain = GeodesicParams {
        domain: match domains[1] {
            Domain::Start => DomainChoice::Start,
            Domain::End => DomainChoice::End,
            Domain::Middle => DomainChoice::Middle,
        },
        ..params.clone()
    };
    let alone = geodesic_between(&end, &start, &on_domain, &mut Silent).unwrap();
    // Both are minima to 1e-6 of the energy, of which the path has more than a half.
    let same = back.length() / alone.length() - 1.0;
    assert!(same.abs() < 2e-3, "{same}");
    assert!((back.energy.total / alone.energy.total - 1.0).abs() < 1e-3);
    assert!(
        2 * evaluations(&back) < evaluations(&alone),
        "{}",
        evaluations(&back)
    );
    // The law of the path back is the inverse one: the lengths are those of different functionals.
    let asymmetry = back.length() / forth.length() - 1.0;
    assert!(asymmetry.abs() > 5e-3, "{asymmetry}");
}

/// Lengths of both directions differ by the discretisation in time, which is of first order.
#[test]
fn both_directions_tend_to_one_length() {
    let (start, end) = (ellipse([0.2, 0.2]), ellipse([0.32, 0.16]));
    let asymmetries = [1, 2, 4].map(|steps| {
        let paths = geodesics_both_ways(&start, &end, &params(steps), &mut Silent).unwrap();
        let [forth, back] = paths.map(|path| path.length());
        2.0 * (back - forth).abs() / (back + forth)
    });
    for pair in asymmetries.windows(2) {
        // Halved, or nearly so: steps of this size have terms of higher order.
        assert!((0.3..0.7).contains(&(pair[1] / pair[0])), "{asymmetries:?}");
    }
}
