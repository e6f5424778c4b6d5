//! Surfaces of 3D objects: closed, oriented, of the right topology and size.

use crate::common::{ball, noise, torus};
use approx::assert_relative_eq;
use fe_grid::{Field, Grid};
use levelset::{BoxEdge, Contour, Moments, contour};
use nalgebra::Matrix3;
use proptest::prelude::*;
use std::collections::HashMap;
use std::f64::consts::PI;

fn surface(field: &Field<f64, 3, 1>, level: f64) -> Contour<3> {
    contour(field, level, BoxEdge::Closed).unwrap()
}

/// Every edge belongs to two triangles, which run through it in opposite directions. (Noise may
/// join two sheets in a saddle of an edge only in the field, never in the surface.)
fn check_manifold(surface: &Contour<3>) {
    let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
    for t in surface.simplices() {
        for k in 0..3 {
            *edges.entry([t[k], t[(k + 1) % 3]]).or_default() += 1;
        }
    }
    for (&[a, b], &n) in &edges {
        assert_eq!(
            n, 1,
            "edge {a}-{b} is run through {n} times in one direction"
        );
        assert_eq!(
            edges.get(&[b, a]),
            Some(&1),
            "edge {a}-{b} has one triangle only"
        );
    }
}

#[test]
fn spheres_and_tori_have_their_euler_numbers() {
    let sphere = surface(&ball::<3>(Grid::cube(20), 0.31), 0.0);
    check_manifold(&sphere);
    assert_eq!(sphere.euler_number(), 2);
    assert_eq!(sphere.n_components(), 1);
    let torus = surface(&torus(Grid::cube(24)), 0.0);
    check_manifold(&torus);
    assert_eq!(torus.euler_number(), 0);
    assert_eq!(torus.n_components(), 1);
}

#[test]
fn crossings_at_nodes_keep_the_surface_closed() {
    // Radius 1/4 and 17 nodes: the sphere passes through nodes exactly.
    let sphere = surface(&ball::<3>(Grid::cube(17), 0.25), 0.0);
    check_manifold(&sphere);
    check_in_single_precision(&sphere);
    assert_eq!(sphere.euler_number(), 2);
}

/// As files have it, in single precision and in millimetres far from the origin: points remain different, and no
/// triangle loses its area.
fn check_in_single_precision(surface: &Contour<3>) {
    let rounded = surface.map(|p| p.map(|x| f64::from((100.0 + 50.0 * x) as f32)));
    let mut points: Vec<_> = rounded
        .points()
        .iter()
        .map(|p| p.map(f64::to_bits))
        .collect();
    points.sort_unstable();
    points.dedup();
    assert_eq!(points.len(), rounded.points().len(), "points meet");
    for simplex in 0..rounded.simplices().len() {
        assert!(
            rounded.size(simplex) > 0.0,
            "{:?}",
            rounded.corners(simplex)
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Zeros at nodes, and values so small that crossings lie next to them.
    #[test]
    fn surfaces_through_nodes_are_closed_manifolds(
        values in proptest::collection::vec(
            prop_oneof![
                Just(0.0), Just(1e-12), Just(-1e-12), Just(1e-5), Just(-1e-5), -1.0..1.0f64,
            ],
            4 * 5 * 4,
        ),
    ) {
        let grid = Grid::<3>::with_nodes([4, 5, 4], 1.0 / 64.0).unwrap();
        let c = surface(&Field::from_vec(grid, values).unwrap(), 0.0);
        prop_assert!(c.is_closed());
        check_manifold(&c);
        check_in_single_precision(&c);
    }
}

#[test]
fn surfaces_of_noise_are_closed_manifolds() {
    for seed in 0..40 {
        let c = surface(&noise::<3>([6, 5, 7], seed), 0.0);
        assert!(c.is_closed());
        check_manifold(&c);
        assert_eq!(c.euler_number() % 2, 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn surfaces_of_masks_are_closed_manifolds(bits in proptest::collection::vec(any::<bool>(), 60)) {
        let data = bits.iter().map(|&b| f64::from(u8::from(b))).collect();
        let grid = Grid::<3>::with_nodes([3, 5, 4], 0.25).unwrap();
        let c = surface(&Field::from_vec(grid, data).unwrap(), 0.5);
        prop_assert!(c.is_closed());
        check_manifold(&c);
    }
}

#[test]
fn one_voxel_is_an_octahedron() {
    let grid = Grid::<3>::with_nodes([3, 3, 3], 1.0).unwrap();
    let mut mask = Field::zeros(grid);
    mask.as_mut_slice()[13] = 1.0;
    let c = surface(&mask, 0.5);
    assert_eq!(c.simplices().len(), 8);
    // Regular octahedron with half-diagonals 1/2: volume 4/3 (1/2)^3.
    let moments = Moments::of_contour(&c).unwrap();
    assert_relative_eq!(moments.volume, 1.0 / 6.0, epsilon = 1e-15);
    assert_relative_eq!(c.perimeter(), 3f64.sqrt(), epsilon = 1e-14);
}

#[test]
fn a_full_box_closes_along_its_faces() {
    let grid = Grid::<3>::with_nodes([4, 3, 5], 0.5).unwrap();
    let c = surface(&Field::from_fn(grid, |_| [1.0]), 0.5);
    assert!(c.is_closed());
    assert_eq!(c.euler_number(), 2);
    let moments = Moments::of_contour(&c).unwrap();
    assert_relative_eq!(moments.volume, 1.5 * 1.0 * 2.0, epsilon = 1e-13);
    let sides = Matrix3::from_diagonal(&[1.5f64, 1.0, 2.0].map(|l| l * l / 12.0).into());
    assert_relative_eq!(moments.covariance, sides, epsilon = 1e-13);
}

/// Errors of area and volume of a ball.
fn ball_errors(n: usize) -> (f64, f64) {
    let c = surface(&ball::<3>(Grid::cube(n), 0.3), 0.0);
    let volume = 4.0 / 3.0 * PI * 0.027;
    (
        (c.perimeter() - 4.0 * PI * 0.09).abs(),
        (Moments::of_contour(&c).unwrap().volume - volume).abs(),
    )
}

#[test]
fn area_and_volume_of_a_ball_converge_with_second_order() {
    let (coarse, fine) = (ball_errors(17), ball_errors(65));
    // Two halvings: order 2 is a factor 16, blurred by the position of the grid.
    assert!(coarse.0 / fine.0 > 11.0, "area {coarse:?} {fine:?}");
    assert!(coarse.1 / fine.1 > 11.0, "volume {coarse:?} {fine:?}");
}
