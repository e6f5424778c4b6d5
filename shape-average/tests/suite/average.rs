//! Averages of shapes whose average is known, and properties that every average has.

use crate::support::angle::{indicator, inner_angle};
use crate::support::run;
use crate::support::shapes::{ball, bar};
use fe_grid::vector::max_abs;
use fe_grid::{Grid, ScalarField};
use levelset::Moments;
use shape_average::align::align_group;
use shape_average::{AverageParams, AverageResult};
use std::f64::consts::{FRAC_PI_3, PI};
use test_support::golden_section;

#[track_caller]
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    println!("{what}: {found}");
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found}, not {expected} +- {tolerance}"
    );
}

/// The measure itself, on bars of known angle, turned ones included: the principal axis of an arm
/// of a few cells' width is off by up to half a degree.
#[test]
fn angles_of_bars_are_measured() {
    for angle in [118.0, 132.5, 147.0, 163.0, 180.0] {
        for turn in [0.0, 0.2, -0.3] {
            let bar = bar(Grid::dyadic(6), angle, turn);
            near("angle", inner_angle(&indicator(&bar)), angle, 0.5);
        }
    }
}

/// The average bends as expected, and both images of the inputs bend like the average.
fn check_angles(weights: Option<Vec<f64>>, expected: f64) {
    let params = AverageParams {
        weights,
        ..AverageParams::default()
    };
    let bars = [180.0, 118.0].map(|angle| bar(Grid::dyadic(6), angle, 0.0));
    let result = run(&bars, &params);
    let angle = inner_angle(&result.average_indicator);
    near("average", angle, expected, 4.0);
    for pushed in &result.pushed {
        near("image", inner_angle(&indicator(pushed)), angle, 3.0);
    }
    // The corners of the ends are as sharp as the grid allows.
    assert!(result.mean_dice() > 0.97);
}

/// About half-way between 180 and 118 degrees; the tolerances are those of published averages.
#[test]
fn the_average_of_two_bars_bends_half_way() {
    check_angles(None, 147.0);
}

#[test]
fn weights_draw_the_average_to_a_shape() {
    check_angles(Some(vec![0.25, 0.75]), 132.0);
    check_angles(Some(vec![0.75, 0.25]), 163.0);
}

/// `W(q 1)` of the default law with both moduli one.
fn dilation_energy(q: f64, dim: f64) -> f64 {
    0.5 * dim * q * q + 0.25 * q.powf(2.0 * dim) - 1.5 * dim * q.ln() - 0.5 * dim - 0.25
}

/// The radius that minimises `sum_i R_i^D W(R/R_i)`.
fn average_radius(radii: [f64; 2], dim: f64) -> f64 {
    let energy = |radius: f64| -> f64 {
        let terms = radii.map(|r| r.powf(dim) * dilation_energy(radius / r, dim));
        terms.iter().sum()
    };
    golden_section(radii, energy)
}

/// Volume of the average against the closed form without void and interface width. The
/// tolerances are a tenth and a seventh of a spacing.
#[test]
fn the_average_of_two_balls_is_the_ball_between() {
    fn check<const D: usize>(grid: Grid<D>, unit_volume: f64, tolerance: f64) -> f64 {
        let balls = [0.2, 0.3].map(|radius| ball(grid, [0.5; D], radius));
        let result = run(&balls, &AverageParams::default());
        let moments = Moments::of_density(&result.average_indicator).unwrap();
        let radius = (moments.volume / unit_volume).powf(1.0 / D as f64);
        let expected = average_radius([0.2, 0.3], D as f64);
        near("radius", radius, expected, tolerance);
        for k in 0..D {
            near("centre", moments.centroid[k], 0.5, 1e-3);
        }
        expected
    }
    let exact = check(Grid::<2>::dyadic(6), PI, 0.0015);
    near("closed form", exact, 0.24975, 5e-6);
    check(Grid::<3>::dyadic(5), 4.0 / 3.0 * PI, 0.0045);
}

#[test]
fn identical_shapes_stay_where_they_are() {
    fn largest(
        result: &AverageResult<2>,
        where_: impl Fn(f64) -> bool,
        d: &ScalarField<f64, 2>,
    ) -> f64 {
        let mut largest = 0.0f64;
        for u in &result.displacements {
            for (i, d) in d.as_slice().iter().enumerate() {
                if where_(*d) {
                    largest = largest.max(max_abs(&u.at(i)));
                }
            }
        }
        largest
    }
    let shape = bar(Grid::dyadic(6), 118.0, 0.1);
    let shapes = vec![shape.clone(); 3];
    let result = run(&shapes, &AverageParams::default());
    // In the soft void the discrete interface costs a little less when it is stretched, which is
    // no part of the shape.
    let inside = largest(&result, |d| d >= 0.0, &shape);
    assert!(inside < 1e-3);
    assert_eq!(result.mean_dice(), 1.0);
}

/// A turned input is turned back by the alignment, to a small part of a degree, and sampled
/// anew: the elastic energy, a small number, keeps two digits.
#[test]
fn a_turned_input_costs_the_same_after_alignment() {
    let grid = Grid::<2>::dyadic(6);
    let energy = |turn: f64| {
        let shapes = [bar(grid, 180.0, 0.0), bar(grid, 118.0, turn)];
        let motions = align_group(&[&shapes[0], &shapes[1]]).unwrap();
        let aligned = [0, 1].map(|i| motions[i].motion.apply(&shapes[i]));
        let result = run(&aligned, &AverageParams::default());
        result.energy.elastic.iter().sum::<f64>()
    };
    let (straight, turned) = (energy(0.0), energy(FRAC_PI_3));
    near("energy", turned / straight, 1.0, 0.02);
}
