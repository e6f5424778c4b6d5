//! The inverse model, in which the deformations from the average to the shapes cost energy: the
//! average is the same up to the second power of the strain.

use crate::support::run;
use crate::support::shapes::ball;
use fe_grid::Grid;
use hyperelastic::LawSpec;
use levelset::Moments;
use shape_average::AverageParams;

/// The radius of the average of two disks of radii `.25 (1 - s)` and `.25 (1 + s)`.
fn radius(law: &str, strain: f64) -> f64 {
    let grid = Grid::<2>::dyadic(6);
    let disks = [-1.0, 1.0].map(|sign| ball(grid, [0.5; 2], 0.25 * (1.0 + sign * strain)));
    let params = AverageParams {
        law: LawSpec {
            law: law.parse().unwrap(),
            ..LawSpec::default()
        },
        tolerance: 5e-5,
        ..AverageParams::default()
    };
    let area = Moments::of_density(&run(&disks, &params).average_indicator)
        .unwrap()
        .volume;
    (area / std::f64::consts::PI).sqrt()
}

#[test]
fn inverse_averages_differ_by_the_second_power_of_the_strain() {
    let gaps = [0.2, 0.4].map(|s| radius("inverse:logdet", s) - radius("logdet", s));
    // The inverse model charges the compression of the larger disk to the area of the average, which
    // is smaller: the average is larger, by a tenth of a spacing at these strains.
    assert!(gaps[1] > 0.0015, "{gaps:?}");
    let order = (gaps[1] / gaps[0]).log2();
    // Radii are known to a fiftieth of a spacing, which is an eighth of the smaller gap.
    assert!((order - 2.0).abs() < 0.5, "{order} {gaps:?}");
}
