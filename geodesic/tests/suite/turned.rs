//! Rigid motions cost nothing, also those that no minimiser finds from the identity.

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::{GeodesicParams, Shape, geodesic_between};
use levelset::rigid_motion::plane_rotation;
use levelset::{RigidMotion, signed_distance};
use nalgebra::SVector;

fn shape<const D: usize>(nodes: usize, inside: &dyn Fn([f64; D]) -> f64) -> Shape<D> {
    let implicit = ScalarField::<f64, D>::from_fn(Grid::cube(nodes), |x| [inside(x)]);
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn cuboid<const D: usize>(x: [f64; D], low: [f64; D], high: [f64; D]) -> f64 {
    let outside = (0..D).map(|k| (low[k] - x[k]).max(x[k] - high[k]));
    -outside.fold(f64::NEG_INFINITY, f64::max)
}

/// The length of the path from a shape to itself, turned by some degrees in the plane of two axes about the middle;
/// and how far the points of the shape end from where they are turned to, root mean square.
fn path<const D: usize>(
    nodes: usize,
    inside: &dyn Fn([f64; D]) -> f64,
    [from, to]: [usize; 2],
    degrees: f64,
    params: &GeodesicParams,
) -> (f64, f64) {
    let rotation = plane_rotation::<D>(from, to, degrees.to_radians());
    let middle = SVector::from([0.5; D]);
    let motion = RigidMotion::from_parts(rotation, middle - rotation * middle);
    let start = shape(nodes, inside);
    let end = shape(nodes, &|x| inside(motion.map_back(x)));
    let path = geodesic_between(&start, &end, params, &mut Silent).unwrap();
    assert!(path.end_reached(), "{degrees}");
    let found = path.rotation_degrees.unwrap();
    assert!((found - degrees).abs() < 4.0, "{found}, not {degrees}");
    let last: &Field<f64, D, D> = &path.motions[params.steps - 1];
    let grid = *last.grid();
    let nodes = (0..grid.n_nodes()).filter(|&node| start.components()[0].as_slice()[node] > 0.0);
    let squares: Vec<f64> = nodes
        .map(|node| {
            let goal = motion.map(grid.position(grid.node(node)));
            let found = last.deformed(node);
            (0..D).map(|k| (goal[k] - found[k]).powi(2)).sum::<f64>()
        })
        .collect();
    let apart = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    (path.length(), apart)
}

/// Lengths that are almost zero take many iterations to be known to a share of themselves.
fn params(steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        max_iterations: Some(30),
        ..GeodesicParams::default()
    }
}

/// Without a rotation to start with, these paths are .26, .020, .27 and .40 long.
#[test]
fn letters_are_turned() {
    let ell = |x| cuboid(x, [0.3, 0.22], [0.45, 0.78]).max(cuboid(x, [0.3, 0.22], [0.7, 0.37]));
    let tee = |x| cuboid(x, [0.42, 0.22], [0.58, 0.78]).max(cuboid(x, [0.25, 0.65], [0.75, 0.78]));
    for (inside, degrees) in [
        (&ell as &dyn Fn([f64; 2]) -> f64, 180.0),
        (&ell, 30.0),
        (&tee, 90.0),
        (&tee, 180.0),
    ] {
        let (length, apart) = path(33, inside, [0, 1], degrees, &params(4));
        // By 30 degrees corners lie elsewhere in their cells, and are fitted.
        assert!(length < 0.018, "{degrees}: {length}");
        assert!(apart < 0.02, "{degrees}: {apart}");
    }
}

/// A round C and an angular U overlap little in any pose: blurred they are alike. The path that bends one into the other
/// without a rotation is .38 long.
#[test]
fn shapes_of_different_outlines_are_turned() {
    let ring = |x: [f64; 2]| {
        let [x, y] = [x[0] - 0.5, x[1] - 0.5];
        let ring = 0.07 - (x.hypot(y) - 0.22).abs();
        ring.min(x.hypot(y) * ((y.atan2(x)).abs() - 0.5))
    };
    let angular = |x| {
        let legs = cuboid(x, [0.3, 0.25], [0.44, 0.75]).max(cuboid(x, [0.56, 0.25], [0.7, 0.75]));
        legs.max(cuboid(x, [0.3, 0.25], [0.7, 0.37]))
    };
    let [start, end] = [shape(33, &ring), shape(33, &angular)];
    for [start, end] in [[&start, &end], [&end, &start]] {
        let path = geodesic_between(start, end, &params(2), &mut Silent).unwrap();
        assert!(path.end_reached());
        let turned = path.rotation_degrees.unwrap();
        assert!((turned - 90.0).abs() < 15.0, "{turned}");
        assert!(path.length() < 0.3, "{}", path.length());
    }
}

#[test]
fn solids_are_turned() {
    let bracket = |x| {
        let foot = cuboid(x, [0.25, 0.3, 0.3], [0.75, 0.7, 0.5]);
        foot.max(cuboid(x, [0.25, 0.3, 0.3], [0.45, 0.5, 0.75]))
    };
    let (length, apart) = path(17, &bracket, [0, 2], 180.0, &params(2));
    assert!(length < 0.02, "{length}");
    assert!(apart < 0.02, "{apart}");
}
