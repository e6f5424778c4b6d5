//! The mean of signed distances in `L2`.
//!
//! Shapes are represented by their signed distances, as elements of a linear space: the mean is the zero
//! level set of the mean of the functions, and the distance of two shapes is that of their functions.
//! Source: M. E. Leventon, W. E. L. Grimson, O. Faugeras: Statistical shape influence in geodesic active
//! contours. CVPR (2000), section 2.1.

use fe_grid::ScalarField;
use levelset::LevelsetError;

/// The signed distance of the set where the mean of these is positive. The mean itself is no distance.
///
/// # Errors
/// [`LevelsetError::EmptyObject`] where it is nowhere positive.
pub(super) fn mean<const D: usize>(
    shapes: &[ScalarField<f64, D>],
) -> Result<ScalarField<f64, D>, LevelsetError> {
    levelset::signed_distance(&mean_function(shapes), 0.0)
}

fn mean_function<const D: usize>(shapes: &[ScalarField<f64, D>]) -> ScalarField<f64, D> {
    let mut sum = ScalarField::zeros(*shapes[0].grid());
    for shape in shapes {
        for (sum, u) in sum.as_mut_slice().iter_mut().zip(shape.as_slice()) {
            *sum += u / shapes.len() as f64;
        }
    }
    sum
}

/// The root of the integral of the squared difference over the box, by the nodes.
pub(super) fn distance<const D: usize>(a: &ScalarField<f64, D>, b: &ScalarField<f64, D>) -> f64 {
    let pairs = a.as_slice().iter().zip(b.as_slice());
    let squares = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    (squares * a.grid().cell_volume()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use fe_grid::Grid;

    /// Half planes whose edges are at .3, .4 and .65 have the half plane at .45 as their mean, and are
    /// as far apart as their edges, in a box of area 1 (each node stands for a cell, those of a side too).
    #[test]
    fn half_planes_are_averaged_as_numbers() {
        let grid = Grid::<2>::cube(65);
        let half = |edge: f64| ScalarField::from_fn(grid, |x: [f64; 2]| [edge - x[0]]);
        let shapes = [0.3, 0.4, 0.65].map(half);
        let found = mean(&shapes).unwrap();
        for x in [[0.1, 0.2], [0.45, 0.9], [0.8, 0.5]] {
            assert_relative_eq!(found.sample(x)[0], 0.45 - x[0], epsilon = 1e-12);
        }
        let apart = distance(&shapes[0], &shapes[2]);
        assert_relative_eq!(apart, 0.35 * 65.0 / 64.0, epsilon = 1e-12);
    }
}
