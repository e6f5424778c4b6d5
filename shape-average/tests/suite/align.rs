//! Rigid alignment: known motions are found, mirror images stay mirrored.

use fe_grid::{Distribution, Field, Grid};
use levelset::{BoxEdge, ContourDistance, contour, signed_distance};
use nalgebra::{Matrix2, Rotation2, Rotation3, SMatrix, SVector, Vector2, Vector3};
use proptest::prelude::*;
use shape_average::align::{
    AlignError, Alignment, RigidMotion, align_group, align_group_of_visible, align_to, mismatches,
};

/// The signed distance of a shape, given by a function that is positive inside, after a motion.
fn moved<const D: usize>(
    grid: Grid<D>,
    shape: impl Fn(SVector<f64, D>) -> f64,
    motion: &RigidMotion<D>,
) -> Field<f64, D, 1> {
    let field = Field::from_fn(grid, |y| [shape(motion.map_back(y).into())]);
    signed_distance(&field, 0.0).unwrap()
}

/// Balls of different sizes side by side: no symmetry, not even a mirror image.
fn blob<const D: usize>(x: SVector<f64, D>) -> f64 {
    let at = |centre: [f64; 3], radius: f64| {
        let d2: f64 = (0..D).map(|k| (x[k] - centre[k]).powi(2)).sum();
        radius - d2.sqrt()
    };
    at([0.5, 0.45, 0.5], 0.17)
        .max(at([0.66, 0.5, 0.52], 0.12))
        .max(at([0.42, 0.62, 0.45], 0.1))
        .max(at([0.45, 0.4, 0.66], 0.09))
}

/// The motion that turns about the middle of the unit box, then shifts.
fn about_middle<const D: usize>(rotation: SMatrix<f64, D, D>, shift: [f64; D]) -> RigidMotion<D> {
    let middle = SVector::<f64, D>::repeat(0.5);
    let translation = middle - rotation * middle + SVector::from(shift);
    RigidMotion::new(rotation, translation).unwrap()
}

fn turn(degrees: f64) -> Matrix2<f64> {
    Rotation2::new(degrees.to_radians()).into_inner()
}

/// Whether the alignment undoes a motion: within half a degree, and within 0.2 h of the place
/// where the middle of the shape belongs.
fn check_undone<const D: usize>(found: &Alignment<D>, motion: &RigidMotion<D>, spacing: f64) {
    let rest = found.motion.after(motion);
    let degrees = rest.angle().to_degrees();
    assert!(degrees < 0.5, "off by {degrees} degrees");
    let place = SVector::from(rest.map([0.5; D])) - SVector::repeat(0.5);
    assert!(
        place.norm() < 0.2 * spacing,
        "off by {} h",
        place.norm() / spacing
    );
}

#[test]
fn a_turned_and_shifted_shape_comes_back_in_2d() {
    let grid = Grid::<2>::dyadic(6);
    let reference = moved(grid, blob::<2>, &RigidMotion::identity());
    for degrees in [60.0, -100.0, 180.0] {
        let motion = about_middle(turn(degrees), [0.07, -0.04]);
        let found = align_to(&reference, &moved(grid, blob::<2>, &motion)).unwrap();
        check_undone(&found, &motion, grid.spacing());
        assert!(found.mismatch < 1e-3, "{}", found.mismatch);
    }
}

#[test]
fn a_turned_and_shifted_blob_comes_back_in_3d() {
    let grid = Grid::<3>::dyadic(5);
    let reference = moved(grid, blob::<3>, &RigidMotion::identity());
    for axis in [Vector3::new(0.3, -2.0, 1.1), Vector3::new(-1.5, 0.2, 2.4)] {
        let rotation = Rotation3::from_scaled_axis(axis).into_inner();
        let motion = about_middle(rotation, [0.03, -0.05, 0.04]);
        let found = align_to(&reference, &moved(grid, blob::<3>, &motion)).unwrap();
        check_undone(&found, &motion, grid.spacing());
        assert!(found.mismatch < 3e-3, "{}", found.mismatch);
    }
}

/// A cube with one small bump: its principal moments are nearly equal, its axes mean nothing.
#[test]
fn nearly_equal_moments_do_not_mislead() {
    let shape = |x: Vector3<f64>| {
        let d = x - Vector3::repeat(0.5);
        let cube = 0.2 - d.amax();
        let bump = 0.07 - (d - Vector3::new(0.21, 0.1, 0.05)).norm();
        cube.max(bump)
    };
    let grid = Grid::<3>::dyadic(5);
    let reference = moved(grid, shape, &RigidMotion::identity());
    let rotation = Rotation3::from_scaled_axis(Vector3::new(1.2, 0.5, -0.8)).into_inner();
    let motion = about_middle(rotation, [0.02, 0.0, -0.03]);
    let found = align_to(&reference, &moved(grid, shape, &motion)).unwrap();
    check_undone(&found, &motion, grid.spacing());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn any_angle_and_shift_is_undone(
        degrees in -180.0f64..180.0, x in -0.08f64..0.08, y in -0.08f64..0.08,
    ) {
        let grid = Grid::<2>::cube(49);
        let reference = moved(grid, blob::<2>, &RigidMotion::identity());
        let motion = about_middle(turn(degrees), [x, y]);
        let found = align_to(&reference, &moved(grid, blob::<2>, &motion)).unwrap();
        check_undone(&found, &motion, grid.spacing());
    }

    #[test]
    fn motions_are_a_group(degrees in -180.0f64..180.0, x in -1.0f64..1.0, p in -1.0f64..1.0) {
        let motion = about_middle(turn(degrees), [x, 0.3]);
        let there = motion.map([p, 0.7]);
        let back = motion.map_back(there);
        // A handful of roundings of numbers of size 1.
        prop_assert!((back[0] - p).abs() < 1e-14 && (back[1] - 0.7).abs() < 1e-14);
        let none = motion.inverse().after(&motion);
        prop_assert!(none.angle() < 1e-14 && none.translation().norm() < 1e-14);
        prop_assert!((motion.angle().to_degrees() - degrees.abs()).abs() < 1e-5);
    }
}

#[test]
fn mirror_images_are_not_mirrored_back() {
    // An L, chiral in the plane.
    let ell = |x: Vector2<f64>| {
        let bar = |cx: f64, cy: f64, hx: f64, hy: f64| {
            (hx - (x[0] - cx).abs()).min(hy - (x[1] - cy).abs())
        };
        bar(0.4, 0.5, 0.06, 0.25).max(bar(0.5, 0.31, 0.16, 0.06))
    };
    let mirrored = |x: Vector2<f64>| ell(Vector2::new(1.0 - x[0], x[1]));
    let grid = Grid::<2>::dyadic(6);
    let still = RigidMotion::identity();
    let (a, b) = (moved(grid, ell, &still), moved(grid, mirrored, &still));
    let found = align_to(&a, &b).unwrap();
    let det = found.motion.rotation().determinant();
    assert!((det - 1.0).abs() < 1e-12);
    // The best rotation of the mirror image still misses the foot of the L.
    assert!(found.mismatch > 0.05, "{}", found.mismatch);
    let mirror = Matrix2::new(-1.0, 0.0, 0.0, 1.0);
    assert!(RigidMotion::new(mirror, Vector2::zeros()).is_none());
}

/// A star with `n` arms that differ a little in length, by one long and one short wave.
fn star(n: f64, width: f64) -> impl Fn(Vector2<f64>) -> f64 {
    move |x| {
        let (dx, dy) = (x[0] - 0.5, x[1] - 0.5);
        let angle = dy.atan2(dx);
        let arm = (0.5 + 0.5 * (n * angle).cos()).powf(width);
        let uneven = 1.0 + 0.06 * angle.cos() + 0.03 * (3.0 * angle + 1.0).sin();
        0.12 + 0.22 * arm * uneven - dx.hypot(dy)
    }
}

#[test]
fn stars_with_many_arms_find_their_own_arm() {
    let grid = Grid::<2>::dyadic(6);
    for n in [5.0, 10.0] {
        let reference = moved(grid, star(n, 1.0), &RigidMotion::identity());
        for degrees in [36.0, 100.0, -155.0] {
            let motion = about_middle(turn(degrees), [0.01, -0.02]);
            let found = align_to(&reference, &moved(grid, star(n, 1.0), &motion)).unwrap();
            check_undone(&found, &motion, grid.spacing());
        }
    }
}

#[test]
fn a_group_of_different_stars_meets_in_the_frame_of_the_first() {
    let grid = Grid::<2>::dyadic(6);
    let motions: Vec<_> = [0.0, 50.0, -120.0, 171.0, 88.0]
        .iter()
        .enumerate()
        .map(|(i, &degrees)| about_middle(turn(degrees), [0.01 * i as f64, -0.01]))
        .collect();
    let widths = [0.6, 1.0, 1.5, 0.8, 2.0];
    let shapes: Vec<_> = motions
        .iter()
        .zip(widths)
        .map(|(m, w)| moved(grid, star(10.0, w), m))
        .collect();
    let list: Vec<_> = shapes.iter().collect();
    let found = align_group(&list).unwrap();
    assert_eq!(found[0].motion, RigidMotion::identity());
    for (a, m) in found.iter().zip(&motions) {
        let rest = motions[0].inverse().after(&a.motion.after(m));
        // Arms of different width: the best fit is not the drawn motion to the last digit.
        assert!(
            rest.angle().to_degrees() < 1.0,
            "{}",
            rest.angle().to_degrees()
        );
        let place = Vector2::from(rest.map([0.5, 0.5])) - Vector2::repeat(0.5);
        assert!(place.norm() < 0.5 * grid.spacing());
    }
}

/// A moved shape cut off at a plane of the grid, as it is drawn by who does not know what lies beyond,
/// and the weight that tells: how far the motion found with the weight, and without, is from the one
/// that brings it back, in degrees and spacings.
fn check_cut<const D: usize>(grid: Grid<D>, motion: &RigidMotion<D>, end: f64) {
    let shape = moved(grid, blob::<D>, &RigidMotion::identity());
    let field = Field::from_fn(grid, |y| {
        [blob::<D>(motion.map_back(y).into()).min(end - y[0])]
    });
    let cut = signed_distance(&field, 0.0).unwrap();
    let ramp = 2.0 * grid.spacing();
    let seen = Field::from_fn(grid, |y| [((end - y[0]) / ramp).clamp(0.0, 1.0)]);
    let all = Field::from_fn(grid, |_| [1.0]);
    let off = |found: &[Alignment<D>]| {
        let rest = found[1].motion.after(motion);
        let place = SVector::from(rest.map([0.5; D])) - SVector::repeat(0.5);
        (rest.angle().to_degrees(), place.norm() / grid.spacing())
    };
    let list = [&shape, &cut];
    let found = align_group_of_visible(&list, &[&all, &seen], &Distribution::alone(2)).unwrap();
    let (angle, distance) = off(&found);
    // The distance to the boundary of the cut shape is wrong near the plane, where the ramp begins.
    assert!(angle < 1.0 && distance < 0.5, "{angle} {distance}");
    let (blind_angle, blind_distance) = off(&align_group(&list).unwrap());
    assert!(
        blind_angle > 5.0 * angle && blind_distance > 2.0 * distance,
        "{blind_angle} {blind_distance} instead of {angle} {distance}"
    );
}

#[test]
fn what_was_not_seen_of_a_shape_does_not_move_it() {
    let motion = about_middle(turn(75.0), [0.03, -0.04]);
    check_cut(Grid::<2>::dyadic(6), &motion, 0.56);
    let rotation = Rotation3::from_scaled_axis(Vector3::new(0.3, -0.9, 0.4)).into_inner();
    check_cut(
        Grid::<3>::dyadic(5),
        &about_middle(rotation, [0.03, 0.0, -0.02]),
        0.58,
    );
}

#[test]
fn a_disk_stays_as_it_is() {
    let disk = |x: Vector2<f64>| 0.3 - (x - Vector2::repeat(0.5)).norm();
    let grid = Grid::<2>::cube(41);
    let still = moved(grid, disk, &RigidMotion::identity());
    let motion = about_middle(turn(0.0), [0.05, 0.02]);
    let found = align_to(&still, &moved(grid, disk, &motion)).unwrap();
    check_undone(&found, &motion, grid.spacing());
    // All rotations fit alike: the smallest is taken, none but for rounding.
    assert!(found.motion.angle() < 0.01);
}

#[test]
fn applying_a_motion_moves_the_shape_from_input_to_aligned_coordinates() {
    let grid = Grid::<2>::dyadic(6);
    let u = moved(grid, blob::<2>, &RigidMotion::identity());
    let motion = about_middle(turn(25.0), [0.05, 0.08]);
    let (applied, drawn) = (motion.apply(&u), moved(grid, blob::<2>, &motion));
    let boundary = contour(&u, 0.0, BoxEdge::Closed).unwrap();
    let exact = ContourDistance::new(&motion.apply_to_contour(&boundary)).unwrap();
    let exact = exact.sample(grid);
    for i in 0..grid.n_nodes() {
        // Both contours are off the shape by O(h^2), more at its two concave corners.
        assert!((exact.as_slice()[i] - drawn.as_slice()[i]).abs() < 0.35 * grid.spacing());
        // Interpolation rounds the ridges of the distance, by at most half a cell's diagonal;
        // beyond the box the distance is a lower bound only.
        let near = exact.as_slice()[i].abs() < 0.1;
        let difference = (applied.as_slice()[i] - exact.as_slice()[i]).abs();
        assert!(!near || difference < 0.5 * grid.spacing(), "{difference}");
    }
}

#[test]
fn bad_input_is_named() {
    assert_eq!(align_group::<2>(&[]).unwrap_err(), AlignError::NoShapes);
    let grid = Grid::<2>::cube(17);
    let good = moved(grid, blob::<2>, &RigidMotion::identity());
    let other = moved(Grid::<2>::cube(9), blob::<2>, &RigidMotion::identity());
    assert!(matches!(
        align_group(&[&good, &other]).unwrap_err(),
        AlignError::GridMismatch { shape: 1, .. }
    ));
    let empty = Field::from_fn(grid, |_| [-1.0]);
    assert!(matches!(
        align_group(&[&good, &good, &empty]).unwrap_err(),
        AlignError::Shape { shape: 2, .. }
    ));
    let seen = Field::from_fn(grid, |_| [1.0]);
    let negative = Field::from_fn(grid, |x| [x[0] - 0.1]);
    for (seen, shape) in [
        (vec![&seen], 1),
        (vec![&seen, &seen, &seen], 2),
        (vec![&negative, &seen], 0),
        (vec![&seen, &other], 1),
    ] {
        assert_eq!(
            align_group_of_visible(&[&good, &good], &seen, &Distribution::alone(2)).unwrap_err(),
            AlignError::Masked { shape }
        );
    }
    // Also at a node that no sample reads.
    let good = Field::<f64, 2, 1>::from_fn(Grid::dyadic(9), |x| [blob::<2>(x.into())]);
    let mut spoilt = good.clone();
    spoilt.as_mut_slice()[1] = f64::NAN;
    assert!(matches!(
        align_to(&good, &spoilt).unwrap_err(),
        AlignError::Shape { shape: 1, .. }
    ));
}

#[test]
fn threads_do_not_change_the_bits() {
    let grid = Grid::<2>::cube(33);
    let shapes: Vec<_> = [0.0, 70.0, 200.0]
        .map(|a| moved(grid, star(5.0, 1.0), &about_middle(turn(a), [0.0; 2])))
        .into_iter()
        .collect();
    let list: Vec<_> = shapes.iter().collect();
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| align_group(&list).unwrap())
    };
    assert_eq!(on(1), on(2));
}

/// The mismatches of a moved shape, and of its moved mirror image.
fn check_mirror_images<const D: usize>(grid: Grid<D>, motion: &RigidMotion<D>) {
    let identity = RigidMotion::identity();
    let reference = moved(grid, blob, &identity);
    let turned = moved(grid, blob, motion);
    let image = |mut x: SVector<f64, D>| {
        x[1] = 1.0 - x[1];
        blob(x)
    };
    let reflected = moved(grid, image, motion);
    let [own, other] = mismatches(&reference, &turned).unwrap();
    assert!(own < 0.2 * other, "{own} {other}");
    let [own, other] = mismatches(&reference, &reflected).unwrap();
    assert!(other < 0.2 * own, "{own} {other}");
}

#[test]
fn a_mirror_image_fits_when_it_is_reflected() {
    check_mirror_images(Grid::cube(65), &about_middle(turn(140.0), [0.03, -0.02]));
    let rotation = Rotation3::from_euler_angles(0.4, 0.9, -1.8).into_inner();
    check_mirror_images(Grid::cube(33), &about_middle(rotation, [0.02, 0.01, -0.03]));
}
