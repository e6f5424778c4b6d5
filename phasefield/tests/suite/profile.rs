//! The profile and its closed forms, by quadrature across a flat boundary.

use approx::assert_relative_eq;
use fe_grid::{Field, Grid};
use levelset::signed_distance;
use phasefield::profile::{MISMATCH_FLOOR, MISMATCH_MATCHED, MISMATCH_UNMATCHED};
use phasefield::{ElasticWeight, PhaseFieldError, Profile};
use proptest::prelude::*;

/// Integral of a function of the signed distance: Simpson's rule on both sides of the kink, out
/// to where the profile's tail, `exp(-20)` squared, is below rounding.
fn across(width: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (n, reach) = (4000, 40.0 * width);
    let h = reach / f64::from(n);
    let side = |sign: f64| -> f64 {
        (0..=n)
            .map(|i| {
                let weight = match i {
                    0 => 1.0,
                    i if i == n => 1.0,
                    i if i % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                weight * f(sign * h * f64::from(i))
            })
            .sum()
    };
    (side(-1.0) + side(1.0)) * h / 3.0
}

fn mismatch(width: f64, w: impl Fn(f64) -> f64, v: impl Fn(f64) -> f64) -> f64 {
    across(width, |d| {
        let (w, v) = (w(d), v(d));
        (w * w * (1.0 - v).powi(2) + v * v * (1.0 - w).powi(2)) / width
    })
}

/// Simpson with a step of width/100: error of order (1/100)^4 / 180, and the tail.
const QUADRATURE: f64 = 1e-8;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn mismatch_has_its_closed_forms(width in 1e-3f64..1.0) {
        let profile = Profile::new(width).unwrap();
        let v = |d: f64| profile.value(d);
        let unmatched = mismatch(width, |_| 1.0, v);
        prop_assert!((unmatched - MISMATCH_UNMATCHED).abs() < QUADRATURE, "{unmatched}");
        let matched = mismatch(width, v, v);
        prop_assert!((matched - MISMATCH_MATCHED).abs() < QUADRATURE, "{matched}");
        let best = |d: f64| {
            let v = v(d);
            v * v / (v * v + (1.0 - v).powi(2))
        };
        let floor = mismatch(width, best, v);
        prop_assert!((floor - MISMATCH_FLOOR).abs() < QUADRATURE, "{floor}");
    }

    #[test]
    fn profile_has_unit_length_and_is_optimal(width in 1e-3f64..1.0, bump in -1.0f64..1.0) {
        let profile = Profile::new(width).unwrap();
        // The profile plus `t d^2 exp(-|d|/width)`, which vanishes on the boundary.
        let length = |t: f64| across(width, |d| {
            let (s, sign) = (d.abs() / width, if d < 0.0 { -1.0 } else { 1.0 });
            let v = profile.value(d) + t * s * s * (-s).exp();
            let slope = sign * ((-s / 2.0).exp() / 2.0 + t * (2.0 * s - s * s) * (-s).exp()) / width;
            width * slope * slope + (v - 1.0).powi(2) / (4.0 * width)
        });
        prop_assert!((length(0.0) - 1.0).abs() < QUADRATURE);
        prop_assert!(length(bump) >= length(0.0) - QUADRATURE);
    }

    #[test]
    fn weight_is_compact_and_rises(width in 1e-3f64..1.0, d in -3.0f64..3.0, delta in 0.0f64..1.0) {
        let weight = ElasticWeight::new(width, delta).unwrap();
        let kappa = weight.value(d * width);
        prop_assert!((delta..=1.0).contains(&kappa) || (kappa - 1.0).abs() < 1e-15);
        prop_assert!(weight.value((d + 0.1) * width) >= kappa - 1e-15);
        if d >= 2.0 {
            prop_assert!((kappa - 1.0).abs() < 1e-15);
        }
        if d <= -2.0 {
            prop_assert_eq!(kappa, delta);
        }
    }
}

#[test]
fn phase_field_of_a_disk() {
    let grid = Grid::<2>::dyadic(6);
    let disk = Field::from_fn(grid, |[x, y]| [0.3 - (x - 0.5).hypot(y - 0.5)]);
    let distance = signed_distance(&disk, 0.0).unwrap();
    let width = 2.0 * grid.spacing();
    let v = Profile::new(width).unwrap().phase_field(&distance);
    let kappa = ElasticWeight::new(width, 1e-4)
        .unwrap()
        .weight_field(&distance);
    let chi = ElasticWeight::new(width, 1e-4)
        .unwrap()
        .indicator_field(&distance);
    for (i, &d) in distance.as_slice().iter().enumerate() {
        assert_relative_eq!(
            v.as_slice()[i],
            1.0 - (-d.abs() / (2.0 * width)).exp(),
            epsilon = 1e-15
        );
        assert_relative_eq!(
            kappa.as_slice()[i],
            1e-4 + 0.9999 * chi.as_slice()[i],
            epsilon = 1e-15
        );
    }
    // The centre lies deep inside, the corner deep outside.
    assert_eq!(chi.sample([0.5, 0.5])[0], 1.0);
    assert_eq!(kappa.sample([0.0, 0.0])[0], 1e-4);
}

#[test]
fn bad_parameters_are_named() {
    for width in [0.0, -1.0, f64::NAN] {
        let Err(PhaseFieldError::Parameter { name, .. }) = Profile::new(width) else {
            panic!("a width of {width} must be an error");
        };
        assert_eq!(name, "interface_width");
        assert!(ElasticWeight::new(width, 0.1).is_err());
    }
    assert!(ElasticWeight::new(0.1, -0.1).is_err());
    assert!(ElasticWeight::new(0.1, 1.1).is_err());
}
