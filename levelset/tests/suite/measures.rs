//! Overlap, boundary distances, moments by counting, components.

use crate::common::{ball, bumpy, noise};
use approx::assert_relative_eq;
use fe_grid::{Field, Grid};
use levelset::{
    BoxEdge, Contour, LevelsetError, Moments, connected_components, contour, dice, dice_within,
    enclosed_volume, hausdorff, inspect::narrow_gap_share, is_mask, largest_component, mask_volume,
    share_outside,
};
use nalgebra::{SVector, Vector2};

fn disk(n: usize, radius: f64) -> Contour<2> {
    contour(&ball::<2>(Grid::cube(n), radius), 0.0, BoxEdge::Open).unwrap()
}

#[test]
fn dice_counts_nodes() {
    let grid = Grid::<2>::with_nodes([4, 2], 1.0).unwrap();
    let a = Field::from_vec(grid, vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let b = Field::from_vec(grid, vec![0.0, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0, 0.0]).unwrap();
    assert_relative_eq!(dice(&a, 0.5, &b, 5.0).unwrap(), 4.0 / 7.0);
    assert_relative_eq!(dice(&a, 0.5, &a, 0.5).unwrap(), 1.0);
    assert!(matches!(
        dice(&a, 2.0, &b, 10.0),
        Err(LevelsetError::EmptyObject { .. })
    ));
    let other = Field::zeros(Grid::<2>::with_nodes([2, 4], 1.0).unwrap());
    assert!(matches!(
        dice(&a, 0.5, &other, 0.5),
        Err(LevelsetError::GridMismatch { .. })
    ));
    assert_relative_eq!(mask_volume(&a, 0.5), 3.0);
}

#[test]
fn hausdorff_of_shifted_and_scaled_copies() {
    let a = disk(65, 0.3);
    let same = hausdorff(&a, &a).unwrap();
    assert!(same.maximum < 1e-15 && same.mean < 1e-15);
    // A convex outline shifted by s: the farthest point lies s away, in the direction of the
    // shift, to the sagitta of a segment, h^2/(8 r).
    let shifted = a.map(|[x, y]| [x + 0.05, y]);
    let distances = hausdorff(&a, &shifted).unwrap();
    assert_relative_eq!(distances.maximum, 0.05, epsilon = 1.1e-4);
    assert!(distances.mean < distances.percentile_95);
    assert!(distances.percentile_95 <= distances.maximum);
    let larger = a.map(|p| p.map(|x| 0.5 + 1.1 * (x - 0.5)));
    let distances = hausdorff(&a, &larger).unwrap();
    assert_relative_eq!(distances.maximum, 0.03, epsilon = 1.1e-4);
    assert_relative_eq!(distances.percentile_95, 0.03, epsilon = 1.1e-4);
}

#[test]
fn hausdorff_finds_points_between_corners() {
    // The long side of the first triangle is farthest from the second in its middle, where
    // neither has a corner.
    let first = Contour::new(
        vec![[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]],
        vec![[0, 1], [1, 2], [2, 0]],
    );
    let second = Contour::new(
        vec![[0.0, 0.0], [2.0, 2.0], [4.0, 0.0], [2.0, 3.0]],
        vec![[0, 1], [1, 2], [2, 3], [3, 0]],
    );
    let found = hausdorff(&first.unwrap(), &second.unwrap()).unwrap();
    // From the reflex corner (2, 2): both sides of the roof lie 2/sqrt(13) away, as computed from
    // 3 x - 2 y = 0; from (2, 0) the legs lie sqrt(2) away.
    assert_relative_eq!(found.maximum, 2f64.sqrt(), epsilon = 1e-5);
}

#[test]
fn hausdorff_bounds_a_dense_sample() {
    let a = contour(&bumpy::<3>(Grid::cube(17)), 0.0, BoxEdge::Open).unwrap();
    let b = contour(&ball::<3>(Grid::cube(15), 0.28), 0.0, BoxEdge::Open).unwrap();
    let found = hausdorff(&a, &b).unwrap().maximum;
    let to_b = levelset::ContourDistance::new(&b).unwrap();
    let to_a = levelset::ContourDistance::new(&a).unwrap();
    let mut sampled = 0.0f64;
    for (from, to) in [(&a, &to_b), (&b, &to_a)] {
        for c in from.all_corners() {
            for (s, t) in [
                (0.0, 0.0),
                (1.0, 0.0),
                (0.0, 1.0),
                (0.3, 0.3),
                (0.5, 0.5),
                (0.1, 0.6),
            ] {
                let p =
                    std::array::from_fn(|k| c[0][k] * (1.0 - s - t) + c[1][k] * s + c[2][k] * t);
                sampled = sampled.max(to.nearest(p).distance);
            }
        }
    }
    assert!(sampled <= found + 2e-6, "{sampled} {found}");
    // Samples lie within a quarter of a cell of the farthest point.
    assert!(found - sampled < 0.25 / 14.0);
}

#[test]
fn moments_by_counting_agree_with_those_of_the_contour() {
    let field = bumpy::<3>(Grid::cube(33));
    let grid = *field.grid();
    let mask = field
        .as_slice()
        .iter()
        .map(|&v| f64::from(u8::from(v > 0.0)));
    let mask = Field::from_vec(grid, mask.collect()).unwrap();
    let counted = Moments::of_density(&mask).unwrap();
    let exact = Moments::of_contour(&contour(&field, 0.0, BoxEdge::Open).unwrap()).unwrap();
    // A layer of one cell holds 0.37 of the volume; counting errs by a few per cent of it.
    assert_relative_eq!(counted.volume, exact.volume, max_relative = 0.02);
    assert_relative_eq!(
        counted.volume,
        mask_volume(&field, 0.0),
        max_relative = 1e-13
    );
    assert_relative_eq!(counted.centroid, exact.centroid, epsilon = 1e-3);
    assert_relative_eq!(counted.covariance, exact.covariance, epsilon = 2e-4);
    let nothing = Field::<f64, 3, 1>::zeros(grid);
    assert!(Moments::of_density(&nothing).is_err());
}

#[test]
fn moments_of_a_disk() {
    let moments = Moments::of_contour(&disk(129, 0.3)).unwrap();
    assert_relative_eq!(moments.centroid, Vector2::new(0.5, 0.5), epsilon = 1e-12);
    // A disk: r^2/4 along each axis, to the O(h^2) of its polygon.
    let quarter = 0.3f64.powi(2) / 4.0;
    let expected = nalgebra::Matrix2::from_diagonal(&SVector::from([quarter, quarter]));
    assert_relative_eq!(moments.covariance, expected, epsilon = 1e-5);
}

#[test]
fn the_share_outside_of_the_box_is_that_of_a_segment_or_a_cap() {
    let radius = 0.3f64;
    let flat = disk(129, radius);
    let solid = contour(&ball::<3>(Grid::cube(65), radius), 0.0, BoxEdge::Open).unwrap();
    let (pixels, voxels) = (Grid::cube(33), Grid::cube(33));
    assert_eq!(share_outside(&flat, &pixels).unwrap(), 0.0);
    assert_eq!(share_outside(&solid, &voxels).unwrap(), 0.0);
    for (shift, sign) in [(0.25, 1.0), (0.5, -1.0), (0.7, 1.0)] {
        // The distance of the face from the middle of the shape.
        let d = 0.5 - shift;
        let segment = radius.powi(2) * (d / radius).acos() - d * (radius.powi(2) - d * d).sqrt();
        let cap = std::f64::consts::PI * (radius - d).powi(2) * (2.0 * radius + d) / 3.0;
        let expected = [
            segment / (std::f64::consts::PI * radius.powi(2)),
            cap / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)),
        ];
        let found = [
            share_outside(&flat.map(|[x, y]| [x, y + sign * shift]), &pixels),
            share_outside(&solid.map(|[x, y, z]| [x + sign * shift, y, z]), &voxels),
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            // Polygons, and facets across the face: h^2 / r^2 or 6e-4 in 2D and 3e-3 in 3D.
            assert_relative_eq!(found.unwrap(), expected, epsilon = 3e-3);
        }
    }
    let beside = flat.map(|[x, y]| [x + 1.0, y]);
    assert_eq!(share_outside(&beside, &pixels).unwrap(), 1.0);
    // In a corner of the box a quarter of the disk is left.
    let corner = flat.map(|[x, y]| [x + 0.5, y - 0.5]);
    assert_relative_eq!(
        share_outside(&corner, &pixels).unwrap(),
        0.75,
        epsilon = 1e-3
    );
}

#[test]
fn components_are_counted_and_the_largest_kept() {
    let grid = Grid::<2>::with_nodes([5, 3], 1.0).unwrap();
    let picture = [
        1.0, 0.0, 0.0, 1.0, 1.0, //
        0.0, 1.0, 0.0, 0.0, 1.0, //
        0.0, 1.0, 0.0, 0.0, 1.0,
    ];
    let field = Field::from_vec(grid, picture.to_vec()).unwrap();
    let components = connected_components(&field, 0.5);
    assert_eq!(components.sizes, [1, 4, 2]);
    assert_eq!(components.labels[0], 1);
    let largest = largest_component(&field, 0.5).unwrap();
    assert_eq!(
        largest.as_slice(),
        [
            0.0, 0.0, 0.0, 1.0, 1.0, //
            0.0, 0.0, 0.0, 0.0, 1.0, //
            0.0, 0.0, 0.0, 0.0, 1.0,
        ]
    );
    assert!(largest_component(&field, 2.0).is_err());
}

#[test]
fn components_of_a_mask_are_those_of_its_surface() {
    for seed in 0..20 {
        let noisy = noise::<3>([5, 6, 4], seed);
        // Sparse masks, where no component encloses another or has a hole.
        let sparse = noisy
            .as_slice()
            .iter()
            .map(|&v| f64::from(u8::from(v > 0.3)));
        let mask = Field::from_vec(*noisy.grid(), sparse.collect()).unwrap();
        let surface = contour(&mask, 0.5, BoxEdge::Closed).unwrap();
        let n = connected_components(&mask, 0.5).sizes.len();
        assert_eq!(surface.n_components(), n, "seed {seed}");
    }
}

#[test]
fn shapes_that_have_vanished_enclose_nothing() {
    let square = disk(33, 0.3);
    let volume = Moments::of_contour(&square).unwrap().volume;
    assert_eq!(enclosed_volume(&square), Ok(volume));
    let flat = square.map(|[x, _]| [x, 0.0]);
    for vanished in [Contour::default(), flat, square.clone().flipped()] {
        assert_eq!(enclosed_volume(&vanished), Ok(0.0));
    }
    let open = square.part(|corners| corners[0][0] < 0.5);
    assert_eq!(enclosed_volume(&open), Err(LevelsetError::OpenContour));
}

#[test]
fn what_is_no_number_is_refused() {
    let square = disk(33, 0.3);
    for width in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let refused = narrow_gap_share(&square, width);
        assert!(matches!(refused, Err(LevelsetError::Parameter { .. })));
    }
    let unchanged = square.refined(f64::NAN);
    assert_eq!(unchanged.points(), square.points());
    let moments = |contour: &Contour<2>| Moments::of_contour(contour).map(|m| m.volume);
    let nan = square.map(|[x, _]| [x, f64::NAN]);
    let refused = moments(&nan);
    assert!(matches!(
        refused,
        Err(LevelsetError::NonFinitePoint { point: 0, .. })
    ));
    let reflected = square.map(|[x, y]| [-x, y]);
    assert_eq!(moments(&reflected), Err(LevelsetError::InsideOut));
    assert_eq!(
        moments(&square.map(|[x, _]| [x, 0.0])),
        Err(LevelsetError::EmptyContour)
    );
    let field = ball::<2>(Grid::cube(9), 0.3);
    let refused = dice(&field, f64::NAN, &field, 0.0);
    assert!(matches!(refused, Err(LevelsetError::Parameter { .. })));
    let mut weight = Field::from_fn(*field.grid(), |_| [1.0]);
    weight.as_mut_slice()[0] = f64::NAN;
    assert!(dice_within(&field, 0.0, &field, 0.0, Some(&weight)).is_ok());
    weight.as_mut_slice()[40] = f64::NAN;
    let refused = dice_within(&field, 0.0, &field, 0.0, Some(&weight));
    assert!(matches!(refused, Err(LevelsetError::NonFinite { .. })));
}

#[test]
fn masks_are_not_signed_distances() {
    let distance = ball::<2>(Grid::cube(17), 0.3);
    let of = |value: fn(f64) -> f64| {
        let mut field = distance.clone();
        for u in field.as_mut_slice() {
            *u = value(*u);
        }
        is_mask(&field)
    };
    assert!(!of(|u| u));
    assert!(of(|u| f64::from(u8::from(u > 0.0))));
    assert!(of(f64::signum));
    // With shares of cells on the boundary.
    assert!(of(|u| (0.5 + 16.0 * u).clamp(0.0, 1.0)));
    assert!(!of(|u| u.clamp(-0.1, 0.1)));
}
