//! Rigid motions of all shapes together, which the functional does not resist.

use crate::level::LevelShapes;
use fe_grid::random::noise;
use fe_grid::vector::scale;
use fe_grid::{Field, Motion, mutant, object_mass};
use nalgebra::DMatrix;

/// Seed of the factors of rotations.
const SEED: u64 = 7;

/// Mass of the void relative to its stiffness, both relative to the object: so light that the void has no soft
/// modes of its own.
const VOID_MASS: f64 = 1e-2;

/// The mass of the objects, for every component, such that the whole mass of a component is one.
pub(super) fn mass<const D: usize>(
    shapes: &LevelShapes<D>,
    weights: &[f64],
    void_stiffness: f64,
) -> Vec<f64> {
    let indicators: Vec<&[f64]> = shapes.indicators.iter().map(Field::as_slice).collect();
    object_mass::<D>(&indicators, weights, VOID_MASS * void_stiffness)
}

/// Rotations of the shapes against each other, one for each plane: those of all together
/// ([`rigid_motions`]), with another factor for every shape. Where shapes are almost symmetric, nothing resists them.
pub(super) fn turns<const D: usize>(motions: &[Motion], n_shapes: usize) -> Vec<Vec<f64>> {
    let rotations = &motions[D..];
    let factors = noise(n_shapes * rotations.len(), SEED);
    let turn = |(rotation, factors): (&Motion, &[f64])| {
        let mut turn = rotation.values.clone();
        let parts = turn.chunks_exact_mut(rotation.values.len() / n_shapes);
        for (part, factor) in parts.zip(factors) {
            scale(*factor, part);
        }
        turn
    };
    let pairs = rotations.iter().zip(factors.chunks_exact(n_shapes));
    pairs.map(turn).collect()
}

/// How far two states are apart, up to a rigid motion of all shapes together: the least root of the mean
/// of `|R a_i(x) + t - b_i(x)|^2` over the points `x` of all objects, over proper rotations `R` and
/// translations `t`, relative to that of `|b_i(x) - mean b|^2`, the size of the average.
///
/// It is small where the averages have the same shape and the same points of the objects are mapped onto each
/// other.
///
/// Source: Umeyama, *Least-squares estimation of transformation parameters between two point patterns*
/// (1991).
pub(super) fn state_distance<const D: usize>(
    shapes: &LevelShapes<D>,
    weights: &[f64],
    a: &[Field<f64, D, D>],
    b: &[Field<f64, D, D>],
) -> f64 {
    let grid = *shapes.grid();
    let points = || {
        let shape = |i: usize| {
            let mass = shapes.indicators[i].as_slice();
            let inside = (0..grid.n_nodes()).filter(|&node| mass[node] > 0.0);
            inside.map(move |node| (i, node, weights[i] * mass[node]))
        };
        (0..a.len()).flat_map(shape)
    };
    let mut total = 0.0;
    let mut means = [[0.0; D]; 2];
    for (i, node, mass) in points() {
        total += mass;
        let places = [&a[i], &b[i]].map(|u| u.deformed(node));
        for (mean, place) in means.iter_mut().zip(places) {
            for k in 0..D {
                mean[k] += mass * place[k];
            }
        }
    }
    for mean in means.iter_mut().flatten() {
        *mean /= total;
    }
    let mut covariance = DMatrix::<f64>::zeros(D, D);
    let mut sizes = [0.0; 2];
    for (i, node, mass) in points() {
        let [a, b]: [[f64; D]; 2] = {
            let places = [&a[i], &b[i]].map(|u| u.deformed(node));
            std::array::from_fn(|s| std::array::from_fn(|k| places[s][k] - means[s][k]))
        };
        for k in 0..D {
            sizes[0] += mass * a[k] * a[k];
            sizes[1] += mass * b[k] * b[k];
            for l in 0..D {
                covariance[(k, l)] += mass * b[k] * a[l];
            }
        }
    }
    // The best rotation turns the singular vectors onto each other, all but the last without reflection.
    let negative = covariance.determinant() < 0.0;
    let mut singular: Vec<f64> = covariance.singular_values().iter().copied().collect();
    singular.sort_by(f64::total_cmp);
    if negative {
        singular[0] = -singular[0];
    }
    let overlap: f64 = singular.iter().sum();
    let square = sizes[0] + sizes[1] - 2.0 * overlap;
    let size = mutant!(sizes[1], StateSize => total);
    (square.max(0.0) / size).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::AverageParams;
    use fe_grid::vector::{dot, multiply_into};
    use fe_grid::{Grid, rigid_motions};

    /// An ellipse beside the middle, and a bent one.
    fn shapes(grid: Grid<2>) -> LevelShapes<2> {
        let ellipse = |bend: f64| {
            Field::from_fn(grid, |[x, y]| {
                let y = y - 0.45 - bend * (x - 0.4).powi(2);
                [0.15 * (1.0 - ((x - 0.4) / 0.3).hypot(y / 0.15))]
            })
        };
        LevelShapes::new(
            grid,
            &[ellipse(0.0), ellipse(0.5)],
            &AverageParams::default(),
        )
        .unwrap()
    }

    fn states(grid: Grid<2>, of: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Field<f64, 2, 2>> {
        let displaced = |bend: f64| {
            Field::from_fn(grid, |[x, y]| {
                let moved = of([x + 0.05 * y, y - bend * x * x]);
                [moved[0] - x, moved[1] - y]
            })
        };
        vec![displaced(0.0), displaced(0.2)]
    }

    fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
        let (sin, cos) = angle.sin_cos();
        [cos * x - sin * y + 0.1, sin * x + cos * y - 0.3]
    }

    #[test]
    fn states_are_compared_up_to_rigid_motions_but_not_reflections() {
        let grid = Grid::<2>::dyadic(5);
        let (shapes, weights) = (shapes(grid), [0.3, 0.7]);
        let plain = states(grid, |x| x);
        let distance = |a: &[_], b: &[_]| state_distance(&shapes, &weights, a, b);
        for angle in [0.0, 1.0, 3.0, -2.0] {
            let moved = states(grid, |x| turned(x, angle));
            assert!(distance(&plain, &moved) < 1e-7);
            assert!(distance(&moved, &plain) < 1e-7);
        }
        // Twice as large: as far from it as half of it is large, and as far as it is large.
        let double = states(grid, |x| x.map(|x| 2.0 * x));
        assert!((distance(&double, &plain) - 1.0).abs() < 1e-6);
        assert!((distance(&plain, &double) - 0.5).abs() < 1e-6);
        let reflected = states(grid, |[x, y]| turned([x, -y], 0.4));
        assert!(distance(&plain, &reflected) > 0.3);
        // One shape turned against the other.
        let mixed = [
            plain[0].clone(),
            states(grid, |x| turned(x, 3.0))[1].clone(),
        ];
        assert!(distance(&plain, &mixed) > 0.5);
    }

    /// The mass of a translation by one is one, rotations about the centre are orthogonal to translations, and
    /// turns against each other are not rotations of all.
    #[test]
    fn motions_have_the_mass_of_the_objects() {
        let grid = Grid::<2>::dyadic(5);
        let (shapes, weights) = (shapes(grid), [0.3, 0.7]);
        let mass = mass(&shapes, &weights, 1e-6);
        let all = rigid_motions(&states(grid, |x| x), &mass, 0);
        let turns = turns::<2>(&all, 2);
        assert_eq!((all.len(), turns.len()), (3, 1));
        let turned = Motion {
            first: 0,
            values: turns[0].clone(),
        };
        let product = |a: &Motion, b: &Motion| {
            let (a, b) = (&a.values, &b.values);
            let mut image = vec![0.0; a.len()];
            multiply_into(&mass, b, &mut image);
            dot(a, &image)
        };
        assert!((product(&all[0], &all[0]) - 1.0).abs() < 1e-4);
        assert!(product(&all[0], &all[1]).abs() < 1e-12);
        for translation in &all[..2] {
            assert!(product(translation, &all[2]).abs() < 1e-5);
        }
        let cosine = product(&all[2], &turned).powi(2)
            / (product(&all[2], &all[2]) * product(&turned, &turned));
        assert!(cosine < 0.9, "{cosine}");
    }
}
