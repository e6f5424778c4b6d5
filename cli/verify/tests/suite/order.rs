//! Slopes and limits of series that are known.

use shapespace_verify::order::{Fit, differences, richardson};

#[test]
fn slopes_of_powers_are_exact_and_noise_shows() {
    let exact: Vec<_> = [1.0, 0.5, 0.25, 0.125]
        .map(|x: f64| (x, 3.0 * x * x))
        .into();
    let fit = Fit::of(&exact).unwrap();
    assert!((fit.slope - 2.0).abs() < 1e-12 && fit.error < 1e-12);
    let mut noisy = exact.clone();
    noisy[1].1 *= 1.5;
    assert!(Fit::of(&noisy).unwrap().error > 0.1);
    assert_eq!(Fit::of(&[(1.0, 0.0), (0.5, 1.0)]), None);
    assert_eq!(Fit::of(&[(1.0, 1.0)]), None);
    assert_eq!(Fit::of(&[(1.0, 1.0), (1.0, 2.0)]), None);
}

#[test]
fn limits_of_series_are_found() {
    let values: Vec<f64> = [1.0, 0.5, 0.25].map(|h: f64| 7.0 + 2.0 * h * h).into();
    let limit = richardson(&values, 2.0);
    assert!((limit.value - 7.0).abs() < 1e-13 && limit.uncertainty < 1e-13);
    let points = differences(&[1.0, 0.5, 0.25], &values);
    assert!((Fit::of(&points).unwrap().slope - 2.0).abs() < 1e-12);
}
