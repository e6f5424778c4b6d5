//! Modes of finite displacements.

use crate::support::{blob, three};
use fe_grid::minimise::Silent;
use fe_grid::operators::MassStiffness;
use fe_grid::vector::{axpy, dot, max_abs, max_abs_difference};
use fe_grid::{Field, Grid, InverseDeformation, LinearOperator, UniformOperator, VectorField};
use shape_pca::{
    Average, Compound, Pca, PcaParams, Source, Variation, object_product, representation,
};

fn params() -> PcaParams {
    PcaParams {
        variation: Variation::Displacement,
        ..PcaParams::default()
    }
}

/// The rotation in the plane of the first two axes, about the centre of the box and then moved.
fn turned<const D: usize>(grid: Grid<D>, angle: f64, shift: f64) -> VectorField<f64, D> {
    let (sin, cos) = angle.sin_cos();
    Field::from_fn(grid, |x| {
        let mut u = [shift; D];
        let (a, b) = (x[0] - 0.5, x[1] - 0.5);
        u[0] += cos * a - sin * b - a;
        u[1] += sin * a + cos * b - b;
        u
    })
}

fn represented<const D: usize>(average: &Average<D>, source: Source<'_>) -> VectorField<f64, D> {
    let compound = Compound::new(average, &params()).unwrap();
    representation(&compound, source).unwrap().0
}

/// A shape in another place is no variation, whatever the angle.
#[test]
fn rigid_motions_are_no_variation() {
    fn check<const D: usize>(grid: Grid<D>) {
        let average = three(grid);
        let chi = blob(grid, 0.2);
        for angle in [0.0, 0.7, -2.0, 3.1] {
            let motion = turned(grid, angle, 0.02);
            let u = represented(
                &average,
                Source {
                    weight: 1.0,
                    displacement: motion.as_slice(),
                    indicator: chi.as_slice(),
                },
            );
            // Positions are of order one and found to 1e-13.
            assert!(max_abs(u.as_slice()) < 1e-11, "{angle}");
        }
    }
    check(Grid::<2>::dyadic(4));
    check(Grid::<3>::dyadic(3));
}

/// The displaced nodes are the shape itself, moved rigidly; elsewhere the displacement is harmonic.
#[test]
fn the_average_is_displaced_to_the_shape() {
    fn check<const D: usize>(grid: Grid<D>) {
        let average = three(grid);
        let compound = Compound::new(&average, &params()).unwrap();
        let laplace = UniformOperator::new(
            grid,
            MassStiffness {
                mass: 0.0,
                stiffness: 1.0,
            },
        );
        for i in 0..average.n_shapes() {
            let (u, _) = representation(&compound, average.source(i)).unwrap();
            let inverse = InverseDeformation::new(&average.displacements()[i]);
            let object = average.object().as_slice();
            let inside: Vec<usize> = (0..grid.n_nodes()).filter(|&k| object[k] >= 0.5).collect();
            let place = |node: usize| {
                let x = grid.position(grid.node(node));
                let u = u.at(node);
                std::array::from_fn::<_, D, _>(|k| x[k] - u[k])
            };
            let distance = |p: [f64; D], q: [f64; D]| {
                let squares = p.iter().zip(q).map(|(p, q)| (p - q).powi(2));
                squares.sum::<f64>().sqrt()
            };
            for pair in inside.windows(2).chain(inside.chunks(7)) {
                let (a, b) = (pair[0], pair[pair.len() - 1]);
                let own = distance(inverse.position(a).unwrap(), inverse.position(b).unwrap());
                assert!((distance(place(a), place(b)) - own).abs() < 1e-12);
            }
            // Far from the object nothing is held.
            let mut force = vec![0.0; grid.n_nodes()];
            for k in 0..D {
                laplace.apply_into(u.component(k), &mut force);
                let size = max_abs(&force);
                for node in (0..grid.n_nodes()).filter(|&node| object[node] == 0.0) {
                    let x = grid.position(grid.node(node));
                    let radius = distance(x, [0.5; D]);
                    if radius > 0.48 {
                        assert!(force[node].abs() < 1e-6 * size, "{x:?} {}", force[node]);
                    }
                }
            }
        }
    }
    check(Grid::<2>::dyadic(5));
    check(Grid::<3>::dyadic(3));
}

/// The modes span the displacements, whose mean belongs to every shape.
#[test]
fn modes_give_the_shapes_back() {
    let grid = Grid::<2>::dyadic(5);
    let average = three(grid);
    let compound = Compound::new(&average, &params()).unwrap();
    let pca = Pca::new(&average, &compound, usize::MAX, &mut Silent).unwrap();
    assert_eq!(pca.modes.rank(), 2);
    for (i, scores) in pca.training.iter().enumerate() {
        let (u, _) = representation(&compound, average.source(i)).unwrap();
        let made = pca.space.synthesise(&scores.scores).unwrap();
        let size = max_abs(u.as_slice());
        assert!(max_abs_difference(made.as_slice(), u.as_slice()) < 1e-8 * size);
        let mut centred = pca.displacements[i].as_slice().to_vec();
        axpy(1.0, pca.space.mean.as_slice(), &mut centred);
        assert!(max_abs_difference(&centred, u.as_slice()) < 1e-14);
    }
}

/// For small deformations, the response to the stress of a stretch is the stretch itself.
#[test]
fn both_variations_agree_where_deformations_are_small() {
    let grid = Grid::<2>::dyadic(5);
    let chi = blob(grid, 0.3);
    let onto = |s: f64| Field::from_fn(grid, |x: [f64; 2]| [s * (x[0] - 0.5), 0.0]);
    let average = Average::new(
        vec![onto(0.02), onto(-0.02)],
        vec![chi.clone(), chi.clone()],
        vec![0.5; 2],
    )
    .unwrap();
    let of = |variation| {
        let params = PcaParams {
            variation,
            void_stiffness: 1e-6,
            ..PcaParams::default()
        };
        let compound = Compound::new(&average, &params).unwrap();
        representation(&compound, average.source(0)).unwrap().0
    };
    let [stress, finite] = [Variation::Stress, Variation::Displacement].map(of);
    let size = |u: &[f64]| dot(u, &object_product(average.object(), u)).sqrt();
    let mut difference = stress.as_slice().to_vec();
    axpy(-1.0, finite.as_slice(), &mut difference);
    let relative = size(&difference) / size(finite.as_slice());
    // Terms of second order in the strain of .02, and the soft edge of the object, a fifth of its radius wide, in
    // which the void has a share. A factor or a sign would be far beyond.
    assert!(relative < 0.1, "{relative}");
}
