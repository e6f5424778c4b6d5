//! Energies are proportional to the moduli and weights, whose unit is free.

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::{Form, Geodesic, GeodesicParams, Shape, geodesic_between};
use hyperelastic::{LameModuli, LawSpec};
use levelset::signed_distance;

/// An ellipse with these half axes, off the middle.
fn ellipse(levels: u32, [a, b]: [f64; 2]) -> Shape<2> {
    let implicit = ScalarField::from_fn(Grid::dyadic(levels), |[x, y]: [f64; 2]| {
        [1.0 - ((x - 0.48) / a).hypot((y - 0.51) / b)]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

/// The path with all moduli and weights times a factor.
fn scaled(ends: &[Shape<2>; 2], params: &GeodesicParams, factor: f64) -> Geodesic<2> {
    let LameModuli { lambda, mu } = params.law.moduli;
    let params = GeodesicParams {
        law: LawSpec {
            moduli: LameModuli::new(factor * lambda, factor * mu).unwrap(),
            ..params.law
        },
        mismatch_weight: factor * params.mismatch_weight,
        area_weight: factor * params.area_weight,
        ..params.clone()
    };
    geodesic_between(&ends[0], &ends[1], &params, &mut Silent).unwrap()
}

/// A power of two changes exponents and no other bit of any number, so that both runs make the same
/// decisions: a constant that is not relative to the moduli or weights would change them.
fn check(ends: &[Shape<2>; 2], params: &GeodesicParams) {
    let one = scaled(ends, params, 1.0);
    for power in [-20, 20] {
        let factor = 2.0f64.powi(power);
        let other = scaled(ends, params, factor);
        assert_eq!(other.status, one.status);
        assert!(other.displacements == one.displacements, "2^{power}");
        assert!(other.level_sets == one.level_sets, "2^{power}");
        let dissipation = factor * one.energy.dissipation();
        assert_eq!(other.energy.dissipation(), dissipation, "2^{power}");
    }
}

#[test]
fn paths_of_a_domain_have_no_unit() {
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    check(&[ellipse(5, [0.35, 0.2]), ellipse(5, [0.25, 0.3])], &params);
    // Too light a mismatch, so that rounds follow.
    let light = GeodesicParams {
        mismatch_weight: 1.0,
        ..params
    };
    check(&[ellipse(4, [0.13; 2]), ellipse(4, [0.3; 2])], &light);
}

#[test]
fn paths_of_level_sets_have_no_unit() {
    let params = GeodesicParams {
        form: Form::LevelSets,
        steps: 2,
        flow_nodes: 17,
        ..GeodesicParams::default()
    };
    check(&[ellipse(4, [0.35, 0.2]), ellipse(4, [0.25, 0.3])], &params);
}

/// The mismatch outweighs the dissipation by more digits than a number of the metric has.
#[test]
fn mismatches_of_any_weight_are_minimised() {
    let ends = [ellipse(4, [0.35, 0.2]), ellipse(4, [0.25, 0.3])];
    for mismatch_weight in [1e-12, 1e6, 1e9, 1e12] {
        for form in [Form::Lagrangian, Form::LevelSets] {
            let params = GeodesicParams {
                form,
                steps: 2,
                mismatch_weight,
                flow_nodes: 17,
                ..GeodesicParams::default()
            };
            let path = geodesic_between(&ends[0], &ends[1], &params, &mut Silent).unwrap();
            let mut numbers = path.displacements.iter().flat_map(Field::as_slice);
            assert!(numbers.all(|x| x.is_finite()), "{mismatch_weight:e}");
            let dissipation = path.energy.dissipation();
            assert!(dissipation.is_finite(), "{mismatch_weight:e}");
            // A disk that is stretched by a third moves; without a mismatch nothing does. Level sets
            // start from a flow and descend from it slowly without one.
            if mismatch_weight > 1.0 || form == Form::Lagrangian {
                assert_eq!(dissipation > 1e-3, mismatch_weight > 1.0, "{dissipation}");
            }
        }
    }
}
