//! Figures in closed form and quadrature, by values that are known.

use fe_grid::Grid;
use shapespace_verify::tools::curves::{lens, rectangle};
use shapespace_verify::tools::quadrature::{Rule, around, disk};
use std::f64::consts::PI;

#[test]
fn lenses_of_close_disks_are_nearly_disks() {
    assert!((lens([0.3, 0.3], 1e-6) - 0.09 * PI).abs() < 1e-6);
    // One disk inside the other but for touching it.
    assert!((lens([0.3, 0.2], 0.1 + 1e-12) - 0.04 * PI).abs() < 1e-5);
}

#[test]
fn distances_of_rectangles_are_positive_inside() {
    let u = rectangle(Grid::dyadic(3), [0.25; 2], [0.75; 2]);
    assert_eq!(u.sample([0.5, 0.5])[0], 0.25);
    assert_eq!(u.sample([0.0, 0.5])[0], -0.25);
    assert!((u.sample([0.0, 0.0])[0] + 0.25 * 2f64.sqrt()).abs() < 1e-15);
}

#[test]
fn polynomials_are_exact() {
    let rule = Rule::gauss(5, -1.0, 2.0);
    // x^9 from -1 to 2.
    assert!((rule.integral(|x| x.powi(9)) - (1024.0 - 1.0) / 10.0).abs() < 1e-10);
    let fine = Rule::composite(3, 4, 0.0, 1.0);
    assert!((fine.integral(f64::exp) - (1f64.exp() - 1.0)).abs() < 1e-11);
    let moment: f64 = disk(6, 0.5).iter().map(|([x, _], w)| w * x * x).sum();
    assert!((moment - PI * 0.5f64.powi(4) / 4.0).abs() < 1e-14);
    assert!((around(8, |t| t.cos().powi(2)) - PI).abs() < 1e-14);
}
