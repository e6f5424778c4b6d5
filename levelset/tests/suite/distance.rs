//! Signed distances against brute force and closed forms.

use crate::common::{ball, brute_force, noise};
use fe_grid::random::SplitMix64;
use fe_grid::{Field, Grid};
use levelset::{BoxEdge, Contour, ContourDistance, LevelsetError, contour, signed_distance};
use proptest::prelude::*;

/// Distances are differences of coordinates of size 1: a few roundings of 1e-16 each, taken
/// under a square root near zero.
const ROUNDING: f64 = 1e-13;

/// Every node against the minimum over all simplices of the contour, and the sign of the field.
fn check_exact<const D: usize>(field: &Field<f64, D, 1>, level: f64) {
    let distance = signed_distance(field, level).unwrap();
    let reference = contour(field, level, BoxEdge::Open).unwrap();
    for (index, &u) in distance.as_slice().iter().enumerate() {
        let point = field.grid().position(field.grid().node(index));
        let expected = brute_force(&reference, point);
        assert!(
            (u.abs() - expected).abs() < ROUNDING,
            "node {point:?}: {u} against {expected}"
        );
        if expected > ROUNDING {
            assert_eq!(
                u > 0.0,
                field.as_slice()[index] > level,
                "sign at {point:?}"
            );
        }
    }
}

#[test]
fn distances_are_exact_at_every_node() {
    check_exact(&noise::<2>([9, 12], 1), 0.0);
    check_exact(&noise::<3>([5, 6, 7], 2), 0.1);
    check_exact(&ball::<2>(Grid::cube(17), 0.3), 0.0);
    check_exact(&ball::<3>(Grid::cube(9), 0.3), 0.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn distances_of_random_masks_are_exact(bits in proptest::collection::vec(any::<bool>(), 63)) {
        let n_inside = bits.iter().filter(|&&b| b).count();
        prop_assume!(n_inside > 0 && n_inside < bits.len());
        let data: Vec<f64> = bits.iter().map(|&b| f64::from(u8::from(b))).collect();
        let plane = Grid::<2>::with_nodes([9, 7], 0.125).unwrap();
        check_exact(&Field::from_vec(plane, data.clone()).unwrap(), 0.5);
        let space = Grid::<3>::with_nodes([3, 7, 3], 0.5).unwrap();
        check_exact(&Field::from_vec(space, data).unwrap(), 0.5);
    }

    #[test]
    fn distances_are_one_lipschitz(seed in 0u64..1000) {
        let distance = signed_distance(&noise::<2>([11, 11], seed), 0.0).unwrap();
        let grid = *distance.grid();
        let u = distance.as_slice();
        for index in 0..grid.n_nodes() {
            let node = grid.node(index);
            for k in 0..2 {
                if node[k] + 1 < grid.nodes_per_axis()[k] {
                    let step = (u[index + grid.strides()[k]] - u[index]).abs();
                    prop_assert!(step <= grid.spacing() + ROUNDING);
                }
            }
        }
    }
}

#[test]
fn a_mask_is_cut_in_the_middle_between_pixels() {
    // A half plane of pixels: the contour is the line half-way between columns 3 and 4.
    let grid = Grid::<2>::cube(9);
    let mask = Field::from_fn(grid, |[x, _]| [f64::from(u8::from(x < 0.45))]);
    let distance = signed_distance(&mask, 0.5).unwrap();
    for (index, &u) in distance.as_slice().iter().enumerate() {
        let x = grid.position(grid.node(index))[0];
        assert!((u - (3.5 / 8.0 - x)).abs() < ROUNDING);
    }
}

/// Largest error of the distance to a ball, from a level set that is no distance.
fn ball_error<const D: usize>(n: usize) -> f64 {
    let grid = Grid::<D>::cube(n);
    let squares = Field::from_fn(grid, |x| {
        let r2: f64 = x.iter().map(|t| (t - 0.47).powi(2)).sum();
        [0.09 - r2]
    });
    let distance = signed_distance(&squares, 0.0).unwrap();
    let errors = distance.as_slice().iter().enumerate().map(|(index, u)| {
        let x = grid.position(grid.node(index));
        let r = x.iter().map(|t| (t - 0.47).powi(2)).sum::<f64>().sqrt();
        // Inside, beyond the centre of curvature, errors of the contour add up: stay near.
        if r > 0.1 { (u - (0.3 - r)).abs() } else { 0.0 }
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn distances_of_a_level_set_converge_with_second_order() {
    let plane = (ball_error::<2>(33), ball_error::<2>(65));
    let space = (ball_error::<3>(17), ball_error::<3>(33));
    for (coarse, fine) in [plane, space] {
        let order = (coarse / fine).log2();
        // Linear interpolation on edges: order 2; the position of the grid blurs the rate.
        assert!(order > 1.6, "order {order}: {coarse:e}, {fine:e}");
    }
    assert!(plane.1 < 0.3 / 64.0 / 64.0 * 4.0);
}

#[test]
fn bad_fields_are_named() {
    let grid = Grid::<2>::cube(4);
    let with = |value: f64| Field::<f64, 2, 1>::from_fn(grid, |_| [value]);
    assert_eq!(
        signed_distance(&with(0.0), 0.0),
        Err(LevelsetError::EmptyObject { level: 0.0 })
    );
    assert_eq!(
        signed_distance(&with(1.0), 0.0),
        Err(LevelsetError::FullObject { level: 0.0 })
    );
    let mut spoilt = with(1.0);
    spoilt.as_mut_slice()[6] = f64::NAN;
    let Err(LevelsetError::NonFinite { node, value }) = signed_distance(&spoilt, 0.5) else {
        panic!("a NaN must be an error");
    };
    assert_eq!(node, [2, 1]);
    assert!(value.is_nan());
    assert!(signed_distance(&with(1.0), f64::NAN).is_err());
}

#[test]
fn an_empty_contour_has_no_distance() {
    let nothing = levelset::Contour::<3>::new(Vec::new(), Vec::new()).unwrap();
    assert_eq!(
        ContourDistance::new(&nothing).unwrap_err(),
        LevelsetError::EmptyContour
    );
}

/// The sign from the contour alone against the sign of the field, at the nodes.
fn check_sign<const D: usize>(field: &Field<f64, D, 1>, level: f64) {
    let grid = *field.grid();
    let boundary = contour(field, level, BoxEdge::Closed).unwrap();
    let distance = ContourDistance::new(&boundary).unwrap();
    let sampled = distance.sample(grid);
    for (index, &u) in sampled.as_slice().iter().enumerate() {
        let point = grid.position(grid.node(index));
        assert_eq!(u, distance.signed_distance(point));
        if u.abs() > ROUNDING {
            assert_eq!(
                u > 0.0,
                field.as_slice()[index] > level,
                "at {point:?}: {u}"
            );
        }
    }
}

#[test]
fn the_contour_knows_inside_from_outside() {
    for seed in 0..20 {
        check_sign(&noise::<2>([9, 7], seed), 0.0);
        check_sign(&noise::<3>([5, 4, 6], seed), 0.0);
    }
    check_sign(&ball::<2>(Grid::cube(17), 0.25), 0.0);
    check_sign(&ball::<3>(Grid::cube(9), 0.25), 0.0);
}

#[test]
fn slivers_do_not_turn_the_sign() {
    // Values just above the level at object nodes make slivers around these nodes.
    for tiny in [1e-6, 1e-9, 1e-12, 1e-15] {
        let mut field = noise::<3>([5, 5, 5], 7);
        for (i, v) in field.as_mut_slice().iter_mut().enumerate() {
            if i % 3 == 0 && *v > 0.0 {
                *v = tiny;
            }
        }
        let boundary = contour(&field, 0.0, BoxEdge::Closed).unwrap();
        let distance = ContourDistance::new(&boundary).unwrap();
        let grid = *field.grid();
        for (index, &v) in field.as_slice().iter().enumerate() {
            let u = distance.signed_distance(grid.position(grid.node(index)));
            if u.abs() > 1e-3 {
                assert_eq!(u > 0.0, v > 0.0, "node {index}, tiny {tiny}: {u}");
            }
        }
    }
}

/// A pyramid whose tip is a triangle of the size of rounding errors, turned inside out by them.
#[test]
fn a_tip_folded_by_rounding_does_not_turn_the_sign() {
    let tiny = 1e-15;
    let points = vec![
        [0.1, 0.1, 0.1],
        [0.9, 0.1, 0.1],
        [0.1, 0.9, 0.1],
        [0.3, 0.3, 0.6],
        [0.3, 0.3 + tiny, 0.6],
        [0.3 + tiny, 0.3, 0.6],
    ];
    let simplices = vec![
        [0, 2, 1],
        [3, 4, 5],
        [0, 1, 4],
        [0, 4, 3],
        [1, 2, 5],
        [1, 5, 4],
        [2, 0, 3],
        [2, 3, 5],
    ];
    let pyramid = Contour::new(points, simplices).unwrap();
    assert!(pyramid.is_closed());
    let distance = ContourDistance::new(&pyramid).unwrap();
    for [x, y, z] in [
        [0.3, 0.3, 0.7],
        [0.31, 0.3, 0.65],
        [0.3, 0.32, 0.9],
        [0.29, 0.29, 0.62],
    ] {
        assert!(distance.signed_distance([x, y, z]) < 0.0, "{x} {y} {z}");
    }
    assert!(distance.signed_distance([0.3, 0.3, 0.3]) > 0.0);
}

/// A ball with slivers all over: every triangle is cut in three at a point next to one of its corners.
fn splintered() -> Contour<3> {
    let field = ball(Grid::<3>::cube(13), 0.3);
    let whole = contour(&field, 0.0, BoxEdge::Open).unwrap();
    let mut points = whole.points().to_vec();
    let mut triangles = Vec::new();
    for [a, b, c] in whole.simplices() {
        let new = points.len();
        let [pa, pb, pc] = [a, b, c].map(|i| points[*i as usize]);
        let near = |k: usize| pa[k] + 1e-11 * (pb[k] + pc[k] - 2.0 * pa[k]);
        points.push(std::array::from_fn(near));
        let new = new.try_into().unwrap();
        triangles.extend([[*a, *b, new], [*b, *c, new], [*c, *a, new]]);
    }
    Contour::new(points, triangles).unwrap()
}

#[test]
fn sides_are_right_where_all_normals_about_a_corner_are_unreliable() {
    let contour = splintered();
    assert!(contour.is_closed());
    let distance = ContourDistance::new(&contour).unwrap();
    let mut random = SplitMix64::new(3);
    for _ in 0..3000 {
        let point: [f64; 3] = std::array::from_fn(|_| random.between(0.1, 0.9));
        let radius = point.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt();
        // Chords of a twelfth of the box are within a hundredth of the sphere.
        if (radius - 0.3).abs() > 0.01 {
            assert_eq!(
                distance.signed_distance(point) > 0.0,
                radius < 0.3,
                "{point:?}"
            );
        }
    }
}

/// Many points at once have the distances that they have alone, near the contour and far outside of its box.
fn check_many<const D: usize>(n: usize) {
    let field = ball(Grid::<D>::cube(n), 0.3);
    let contour = contour(&field, 0.0, BoxEdge::Open).unwrap();
    let distance = ContourDistance::new(&contour).unwrap();
    // More than one run of a thread, with a last packet that is not full.
    let mut random = SplitMix64::new(11);
    let points: Vec<[f64; D]> = (0..2500)
        .map(|_| std::array::from_fn(|_| random.between(-2.0, 3.0)))
        .collect();
    let all = distance.signed_distances(&points);
    assert_eq!(all.len(), points.len());
    for (point, found) in points.iter().zip(all) {
        let alone = distance.signed_distance(*point);
        assert!(
            (found - alone).abs() < ROUNDING * (1.0 + alone.abs()),
            "{point:?}: {found} {alone}"
        );
    }
    assert!(distance.signed_distances(&[]).is_empty());
}

#[test]
fn points_together_have_the_distances_that_they_have_alone() {
    check_many::<2>(33);
    check_many::<3>(17);
}

#[test]
fn a_contour_from_a_fine_image_is_sampled_on_a_coarse_grid() {
    let image = ball::<2>(Grid::cube(129), 0.3);
    let boundary = contour(&image, 0.0, BoxEdge::Closed).unwrap();
    // Half the size, moved to the side.
    let moved = boundary.map(|[x, y]| [0.5 * x + 0.2, 0.5 * y + 0.1]);
    let grid = Grid::<2>::cube(17);
    let sampled = ContourDistance::new(&moved).unwrap().sample(grid);
    for (index, &u) in sampled.as_slice().iter().enumerate() {
        let [x, y] = grid.position(grid.node(index));
        let expected = 0.15 - (x - 0.45).hypot(y - 0.35);
        // Chords of the circle lie inside it by at most h^2/(8 r) = 2.5e-5, halved; crossings
        // of a distance on grid lines are off by as much.
        assert!((u - expected).abs() < 3e-5, "{u} {expected}");
    }
}

#[test]
fn threads_do_not_change_the_bits() {
    let field = noise::<3>([9, 9, 9], 3);
    let on = |n| test_support::on_threads(n, || signed_distance(&field, 0.0).unwrap());
    assert_eq!(on(1), on(3));
}

/// Wall time on the sizes that the program works with, generous for a busy machine.
#[test]
fn distances_are_fast() {
    let start = std::time::Instant::now();
    signed_distance(&ball::<2>(Grid::cube(257), 0.3), 0.0).unwrap();
    let plane = start.elapsed().as_secs_f64();
    let start = std::time::Instant::now();
    signed_distance(&crate::common::bumpy::<3>(Grid::cube(65)), 0.0).unwrap();
    let space = start.elapsed().as_secs_f64();
    println!("257^2: {plane:.3} s, 65^3: {space:.3} s");
    assert!(plane < 2.0 && space < 8.0, "{plane} {space}");
}
