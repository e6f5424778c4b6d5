//! Numbers of parts, holes and tunnels.

use levelset::fe_grid::{Field, Grid};
use levelset::signed_distance;
use levelset::topology::{Topology, parts_and_holes, tunnels};

/// Two balls, one of them hollow, with a cavity of a radius.
fn hollow<const D: usize>(grid: Grid<D>, radius: f64) -> Field<f64, D, 1> {
    let distance = |x: [f64; D], centre: f64| {
        let square: f64 = (1..D).map(|k| (x[k] - 0.5).powi(2)).sum();
        (square + (x[0] - centre).powi(2)).sqrt()
    };
    let field = Field::from_fn(grid, |x| {
        let first = (0.2 - distance(x, 0.28)).min(distance(x, 0.28) - radius);
        [first.max(0.12 - distance(x, 0.75))]
    });
    signed_distance(&field, 0.0).unwrap()
}

fn check_topology<const D: usize>(grid: Grid<D>) {
    let h = grid.spacing();
    let whole = hollow(grid, 0.0);
    let deep = |distance, depth: f64| -> [usize; 2] { parts_and_holes(distance, [depth])[0] };
    let other_parts_and_holes =
        |a: &Field<f64, D, 1>, b: &Field<f64, D, 1>| Topology::of(a).differences(&Topology::of(b));
    assert_eq!(deep(&whole, 2.0 * h), [2, 0]);
    let ring = hollow(grid, 3.2 * h);
    assert_eq!(deep(&ring, 2.0 * h), [2, 1]);
    // Neither the cavity nor the smaller ball is so deep; the first ball is where it is solid.
    assert_eq!(deep(&whole, 0.15), [1, 0]);
    assert_eq!(other_parts_and_holes(&whole, &ring), 1);
    assert_eq!(other_parts_and_holes(&ring, &whole), 1);
    assert_eq!(other_parts_and_holes(&ring, &hollow(grid, 4.0 * h)), 0);
    // A cavity too shallow to count is no difference either way.
    assert_eq!(other_parts_and_holes(&whole, &hollow(grid, 1.2 * h)), 0);
    assert_eq!(other_parts_and_holes(&ring, &hollow(grid, 1.2 * h)), 0);
}

#[test]
fn parts_and_holes_are_counted() {
    check_topology(Grid::<2>::dyadic(6));
    check_topology(Grid::<3>::dyadic(6));
}

/// A ring of a radius and a thickness, or the part of it where `x + gap` is at most half of the box.
fn ring(grid: Grid<3>, radius: f64, thickness: f64, gap: f64) -> Field<f64, 3, 1> {
    let field = Field::from_fn(grid, |x| {
        let [x, y, z] = x.map(|x| x - 0.5);
        let around = (x * x + y * y).sqrt() - radius;
        let tube = thickness - (around * around + z * z).sqrt();
        // The gap lies at the right.
        let cut = if x > 0.0 && gap > 0.0 {
            y.abs() - gap
        } else {
            1.0
        };
        [tube.min(cut)]
    });
    signed_distance(&field, 0.0).unwrap()
}

#[test]
fn tunnels_are_counted() {
    let grid = Grid::<3>::dyadic(5);
    let h = grid.spacing();
    let (closed, open) = (ring(grid, 0.28, 0.11, 0.0), ring(grid, 0.28, 0.11, 1.6 * h));
    assert_eq!([tunnels(&closed, 0.0), tunnels(&open, 0.0)], [1, 0]);
    let of = |field: &Field<f64, 3, 1>| Topology::of(field);
    assert_eq!(of(&closed).differences(&of(&open)), 1);
    assert_eq!(of(&open).differences(&of(&closed)), 1);
    // Too thin to be resolved, and a tunnel that closes when the boundary moves outwards.
    let thin = ring(grid, 0.28, 0.9 * h, 0.0);
    assert_eq!(tunnels(&thin, 0.0), 1);
    assert_eq!(of(&thin).differences(&of(&open)), 0);
    let narrow = ring(grid, 0.11 + 0.9 * h, 0.11, 0.0);
    assert_eq!(tunnels(&narrow, 0.0), 1);
    assert_eq!(of(&narrow).differences(&of(&open)), 0);
    // Two tunnels, a cavity, and two parts.
    let many = Field::from_fn(grid, |x| {
        let [x, y, z] = x;
        let square = |x: f64, y: f64| (x - y).abs();
        let hole = |at: f64| square(x, at).max(square(y, 0.5)) - 0.06;
        let plate = 0.4 - square(x, 0.5).max(square(y, 0.5)).max(square(z, 0.4) + 0.3);
        let cavity = square(x, 0.5).max(square(y, 0.25)).max(square(z, 0.4)) - 0.04;
        let part = 0.06 - square(x, 0.5).max(square(y, 0.5)).max(square(z, 0.8));
        [plate.min(hole(0.3)).min(hole(0.7)).min(cavity).max(part)]
    });
    assert_eq!(tunnels(&many, 0.0), 2);
    assert_eq!(parts_and_holes(&many, [0.0])[0], [2, 1]);
}

/// In the plane the formula of Euler counts the holes.
#[test]
fn holes_of_the_plane_are_tunnels() {
    let grid = Grid::<2>::dyadic(6);
    for n in 0..5 {
        let field = Field::from_fn(grid, |[x, y]| {
            let disk = 0.4 - ((x - 0.5).powi(2) + (y - 0.5).powi(2)).sqrt();
            let hole = |i: usize| {
                let turn = i as f64;
                let centre = [0.5 + 0.2 * turn.cos(), 0.5 + 0.2 * turn.sin()];
                ((x - centre[0]).powi(2) + (y - centre[1]).powi(2)).sqrt() - 0.05
            };
            [(0..n).map(hole).fold(disk, f64::min)]
        });
        assert_eq!(tunnels(&field, 0.0), n);
        assert_eq!(parts_and_holes(&field, [0.0])[0], [1, n]);
    }
}
