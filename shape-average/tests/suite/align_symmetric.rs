//! Rigid alignment of shapes with symmetries: what fits equally well is not turned, and what a symmetric
//! reference leaves open is decided by the others, or by the components.

use fe_grid::{Distribution, Field, Grid};
use levelset::{BoxEdge, ContourDistance, contour, signed_distance};
use nalgebra::{Rotation2, Rotation3, SMatrix, SVector, Vector3};
use shape_average::align::{
    AlignError, RigidMotion, align_components_to, align_group, align_group_of_components, align_to,
};

/// Turns about the middle of the unit box.
fn about_middle<const D: usize>(rotation: SMatrix<f64, D, D>) -> RigidMotion<D> {
    let middle = SVector::<f64, D>::repeat(0.5);
    RigidMotion::new(rotation, middle - rotation * middle).unwrap()
}

/// The signed distance to the boundary of a mask whose lattice is turned by a motion.
fn of_mask<const D: usize>(
    inside: impl Fn([f64; D]) -> bool,
    nodes: usize,
    turn: &RigidMotion<D>,
    grid: Grid<D>,
) -> Field<f64, D, 1> {
    let mask = Field::from_fn(Grid::<D>::cube(nodes), |x| {
        [f64::from(u8::from(inside(turn.map(x))))]
    });
    let boundary = contour(&mask, 0.5, BoxEdge::Closed).unwrap();
    let boundary = turn.apply_to_contour(&boundary);
    ContourDistance::new(&boundary).unwrap().sample(grid)
}

/// An ellipsoid with three different axes, on which half turns about each of them fit exactly: masks with
/// lattices of other directions and spacings fit it equally well in four poses but for their steps.
#[test]
fn masks_of_a_symmetric_solid_are_not_turned() {
    let inside = |x: [f64; 3]| {
        let axes = [0.36, 0.27, 0.2];
        let squares = (0..3).map(|k| ((x[k] - 0.5) / axes[k]).powi(2));
        squares.sum::<f64>() < 1.0
    };
    let grid = Grid::<3>::dyadic(5);
    let still = RigidMotion::identity();
    let reference = of_mask(inside, 31, &still, grid);
    for (nodes, axis) in [
        (31, [0.0, 0.0, 0.0]),
        (23, [0.0, 0.0, 0.0]),
        (38, [std::f64::consts::FRAC_PI_2, 0.0, 0.0]),
        (33, [0.5, 0.3, -0.2]),
        (26, [-0.9, 0.1, 1.3]),
        (29, [0.1, 2.0, 0.4]),
    ] {
        let turn = about_middle(Rotation3::from_scaled_axis(Vector3::from(axis)).into_inner());
        let other = of_mask(inside, nodes, &turn, grid);
        let found = align_to(&reference, &other).unwrap();
        let degrees = found.motion.angle().to_degrees();
        assert!(degrees < 3.0, "{nodes}, {axis:?}: {degrees}");
    }
}

/// A rod with a ball at each end.
fn dumbbell<const D: usize>(length: f64, radii: [f64; 2], x: [f64; D]) -> f64 {
    let centred: [f64; D] = std::array::from_fn(|k| x[k] - 0.5);
    let across: f64 = centred[1..].iter().map(|c| c * c).sum();
    let ball = |at: f64, radius: f64| radius - ((centred[0] - at).powi(2) + across).sqrt();
    let rod = 0.04 - across.sqrt().max(centred[0].abs() - length + 0.04);
    rod.max(ball(-length, radii[0])).max(ball(length, radii[1]))
}

/// The larger balls come to lie on one side, in whatever order the shapes are given, though a
/// reference with equal balls fits both ways.
fn check_dumbbells<const D: usize>(nodes: usize, orders: &[[usize; 4]]) {
    let grid = Grid::<D>::cube(nodes);
    let dumbbells = [
        (0.22, [0.14, 0.10]),
        (0.18, [0.10, 0.13]),
        (0.21, [0.11, 0.14]),
        (0.19, [0.12, 0.09]),
    ];
    let of = |(length, radii): (f64, [f64; 2])| {
        let field = Field::from_fn(grid, |x| [dumbbell(length, radii, x)]);
        signed_distance(&field, 0.0).unwrap()
    };
    let equal = of((0.2, [0.12, 0.12]));
    for order in orders {
        let shapes = order.map(|i: usize| of(dumbbells[i]));
        let list: Vec<_> = std::iter::once(&equal).chain(&shapes).collect();
        let found = align_group(&list).unwrap();
        let larger = order.iter().zip(&found[1..]).map(|(i, alignment)| {
            let [first, second] = dumbbells[*i].1;
            let mut end = [0.5; D];
            end[0] = if first > second { 0.2 } else { 0.8 };
            alignment.motion.map(end)[0] > 0.5
        });
        let larger: Vec<bool> = larger.collect();
        assert!(larger.iter().all(|side| *side == larger[0]), "{larger:?}");
    }
}

#[test]
fn a_symmetric_reference_does_not_turn_others_against_each_other() {
    check_dumbbells::<2>(
        65,
        &[[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 0, 1, 2]],
    );
    check_dumbbells::<3>(33, &[[0, 1, 2, 3], [3, 0, 1, 2]]);
}

/// A disk of three labelled parts, turned: its outline says nothing, its labels all.
#[test]
fn labels_decide_where_the_outline_does_not() {
    let grid = Grid::<2>::dyadic(6);
    let turns = [0.0, 100.0, -40.0, 171.0f64];
    let motions =
        turns.map(|degrees| about_middle(Rotation2::new(degrees.to_radians()).into_inner()));
    let (mut unions, mut labels) = (Vec::new(), Vec::new());
    for motion in &motions {
        let disk = |x: [f64; 2]| 0.3 - (x[0] - 0.5).hypot(x[1] - 0.5);
        let within = |part: fn([f64; 2]) -> f64| {
            let field = Field::from_fn(grid, |y| {
                let x = motion.map_back(y);
                [disk(x).min(part(x))]
            });
            signed_distance(&field, 0.0).unwrap()
        };
        unions.push(within(|_| 1.0));
        labels.push(within(|x| x[0] - 0.6));
        labels.push(within(|x| (0.6 - x[0]).min(x[1] - 0.45)));
        labels.push(within(|x| (0.6 - x[0]).min(0.45 - x[1])));
    }
    let shapes: Vec<_> = labels.chunks_exact(3).collect();
    let found = align_group_of_components(&shapes, &Distribution::alone(4)).unwrap();
    for (alignment, motion) in found.iter().zip(&motions) {
        let rest = alignment.motion.after(motion).angle().to_degrees();
        assert!(rest < 0.5, "off by {rest} degrees");
    }
    let pair = align_components_to(shapes[0], shapes[1]).unwrap();
    let rest = pair.motion.after(&motions[1]).angle().to_degrees();
    assert!(rest < 0.5, "off by {rest} degrees");
    let fewer = align_components_to(shapes[0], &shapes[1][..2]);
    assert!(matches!(
        fewer,
        Err(AlignError::Components { shape: 1, .. })
    ));
    // The outlines alone stay as they are.
    let alone = align_group(&unions.iter().collect::<Vec<_>>()).unwrap();
    assert!(alone[1].motion.angle().to_degrees() < 5.0);
}
