//! Contours of 2D objects: closedness, orientation, saddles, the edge of the box.

use crate::common::{ball, noise};
use approx::assert_relative_eq;
use fe_grid::{Field, Grid, VectorField};
use levelset::{BoxEdge, Contour, LevelsetError, Moments, contour};
use nalgebra::{Matrix2, Rotation2, Vector2};

fn mask(rows: &[&str]) -> Field<f64, 2, 1> {
    let grid = Grid::with_nodes([rows[0].len(), rows.len()], 1.0).unwrap();
    let data = rows.iter().flat_map(|r| r.bytes());
    let data = data.map(|b| f64::from(u8::from(b == b'#'))).collect();
    Field::from_vec(grid, data).unwrap()
}

fn closed(field: &Field<f64, 2, 1>, level: f64) -> Contour<2> {
    contour(field, level, BoxEdge::Closed).unwrap()
}

#[test]
fn one_pixel_is_a_diamond() {
    let c = contour(&mask(&["...", ".#.", "..."]), 0.5, BoxEdge::Open).unwrap();
    let curves = c.polylines();
    assert_eq!(curves.len(), 1);
    assert!(curves[0].closed);
    assert_eq!(curves[0].points.len(), 4);
    let moments = Moments::of_contour(&c).unwrap();
    // Diagonals of length 1: area 1/2, and positive, as the object lies to the left.
    assert_relative_eq!(moments.volume, 0.5, epsilon = 1e-15);
    assert_relative_eq!(moments.centroid, Vector2::new(1.0, 1.0), epsilon = 1e-15);
    assert_relative_eq!(c.perimeter(), 4.0 * 0.5f64.sqrt(), epsilon = 1e-15);
}

/// A displacement that is linear in the cell of each corner moves the corners by itself, and back.
#[test]
fn contours_are_displaced_by_multiples_of_fields() {
    let square = closed(&mask(&["....", ".##.", ".##.", "...."]), 0.5);
    let shear = VectorField::from_fn(Grid::with_nodes([4, 4], 1.0).unwrap(), |[x, y]| {
        [0.5 * y, -0.25 * x]
    });
    let moved = square.displaced(&shear, 0.5);
    assert_eq!(moved.simplices(), square.simplices());
    for (p, q) in square.points().iter().zip(moved.points()) {
        assert_relative_eq!(q[0], p[0] + 0.25 * p[1], epsilon = 1e-15);
        assert_relative_eq!(q[1], p[1] - 0.125 * p[0], epsilon = 1e-15);
    }
    assert_eq!(square.displaced(&shear, 0.0), square);
    for (p, q) in square
        .points()
        .iter()
        .zip(square.displaced(&shear, 1.0).points())
    {
        assert_eq!(shear.image(*p), *q);
    }
}

#[test]
fn pixels_that_touch_by_a_corner_stay_apart() {
    let c = closed(&mask(&["....", ".#..", "..#.", "...."]), 0.5);
    assert_eq!(c.polylines().len(), 2);
    // A grey saddle above the level joins them.
    let mut grey = mask(&["....", ".#..", "..#.", "...."]);
    for v in grey.as_mut_slice() {
        *v = v.max(0.3);
    }
    assert_eq!(closed(&grey, 0.5).polylines().len(), 1);
}

#[test]
fn a_hole_is_a_second_curve() {
    let c = closed(&mask(&[".....", ".###.", ".#.#.", ".###.", "....."]), 0.5);
    assert_eq!(c.polylines().len(), 2);
    // A 3 x 3 block with its corners cut, less the diamond around the background pixel.
    let area = Moments::of_contour(&c).unwrap().volume;
    assert_relative_eq!(area, 9.0 - 4.0 * 0.125 - 0.5, epsilon = 1e-14);
}

#[test]
fn an_object_at_the_edge_of_the_box_is_open_or_closed() {
    let half = mask(&["##..", "##..", "##.."]);
    let open = contour(&half, 0.5, BoxEdge::Open).unwrap();
    assert!(!open.is_closed());
    assert_eq!(open.polylines().len(), 1);
    assert!(!open.polylines()[0].closed);
    assert_eq!(Moments::of_contour(&open), Err(LevelsetError::OpenContour));
    let whole = closed(&half, 0.5);
    assert!(whole.is_closed());
    // The box from x = 0 to 1.5 and y = 0 to 2.
    let moments = Moments::of_contour(&whole).unwrap();
    assert_relative_eq!(moments.volume, 3.0, epsilon = 1e-14);
    assert_relative_eq!(whole.perimeter(), 7.0, epsilon = 1e-14);
    // A full box closes along all its edges.
    let full = closed(&mask(&["##", "##"]), 0.5);
    assert_relative_eq!(
        Moments::of_contour(&full).unwrap().volume,
        1.0,
        epsilon = 1e-14
    );
}

#[test]
fn contours_of_noise_are_closed_and_strung_together_whole() {
    for seed in 0..50 {
        let field = noise::<2>([8, 11], seed);
        let c = closed(&field, 0.05);
        assert!(c.is_closed(), "seed {seed}");
        let curves = c.polylines();
        assert!(curves.iter().all(|p| p.closed));
        let n: usize = curves.iter().map(|p| p.points.len()).sum();
        assert_eq!(n, c.simplices().len(), "seed {seed}");
        let open = contour(&field, 0.05, BoxEdge::Open).unwrap();
        let lengths = open.polylines().into_iter();
        let n: usize = lengths
            .map(|p| p.points.len() - usize::from(!p.closed))
            .sum();
        assert_eq!(n, open.simplices().len(), "seed {seed}");
    }
}

/// Errors of area and perimeter of a disk.
fn disk_errors(n: usize) -> (f64, f64) {
    let c = closed(&ball::<2>(Grid::cube(n), 0.3), 0.0);
    let area = std::f64::consts::PI * 0.09;
    let perimeter = std::f64::consts::TAU * 0.3;
    (
        (Moments::of_contour(&c).unwrap().volume - area).abs(),
        (c.perimeter() - perimeter).abs(),
    )
}

#[test]
fn area_and_perimeter_of_a_disk_converge_with_second_order() {
    let (coarse, fine) = (disk_errors(33), disk_errors(129));
    // Two halvings: order 2 is a factor 16, blurred by the position of the grid.
    assert!(coarse.0 / fine.0 > 10.0, "{coarse:?} {fine:?}");
    assert!(coarse.1 / fine.1 > 10.0, "{coarse:?} {fine:?}");
}

#[test]
fn moments_of_a_polygon_are_exact() {
    // The rectangle [0, 3] x [0, 1]: covariance diag(9, 1)/12, turned by 30 degrees.
    let corners = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
    let sides = vec![[0, 1], [1, 2], [2, 3], [3, 0]];
    let rectangle = Contour::new(corners, sides).unwrap();
    let turn = Rotation2::new(std::f64::consts::FRAC_PI_6).into_inner();
    let shift = Vector2::new(10.0, -4.0);
    let moments = Moments::of_contour(&rectangle.transformed(&turn, &shift)).unwrap();
    assert_relative_eq!(moments.volume, 3.0, epsilon = 1e-13);
    let centroid = turn * Vector2::new(1.5, 0.5) + shift;
    assert_relative_eq!(moments.centroid, centroid, epsilon = 1e-13);
    let straight = Matrix2::new(9.0, 0.0, 0.0, 1.0) / 12.0;
    let expected = turn * straight * turn.transpose();
    assert_relative_eq!(moments.covariance, expected, epsilon = 1e-12);
    // A reflected copy still has its inside to the left.
    let mirror = Matrix2::new(-1.0, 0.0, 0.0, 1.0);
    let reflected = rectangle.transformed(&mirror, &shift);
    assert_relative_eq!(
        Moments::of_contour(&reflected).unwrap().volume,
        3.0,
        epsilon = 1e-13
    );
}

#[test]
fn bad_contours_are_named() {
    assert_eq!(
        Contour::new(vec![[0.0, 0.0]], vec![[0, 1]]),
        Err(LevelsetError::MissingPoint {
            simplex: 0,
            point: 1,
            n_points: 1
        })
    );
    assert!(matches!(
        Contour::new(vec![[0.0, f64::NAN]], Vec::<[u32; 2]>::new()),
        Err(LevelsetError::NonFinitePoint { point: 0, .. })
    ));
}
