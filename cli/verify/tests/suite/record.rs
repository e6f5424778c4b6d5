//! How numbers are written.

use shapespace_verify::record::{beside, number};

#[test]
fn numbers_are_short() {
    for (x, text) in [
        (0.0, "0"),
        (1.0, "1"),
        (0.15, "0.15"),
        (std::f64::consts::PI, "3.142"),
        (1234.56, "1235"),
        (1e-12, "1e-12"),
        (1.25e-12, "1.25e-12"),
        (-0.5, "-0.5"),
        (100.0, "100"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(number(x), text);
    }
    for (x, tolerance, text) in [
        (1.00036, 0.01, "1.0004"),
        (0.999_999_999_4, 1e-9, "0.9999999994"),
        (2.0, 1e-12, "2"),
        (2.0, 0.0, "2"),
    ] {
        assert_eq!(beside(x, tolerance), text);
    }
}
