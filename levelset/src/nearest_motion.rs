//! The rigid motion that is nearest to a deformation.

use crate::measures::Moments;
use crate::rigid_motion::RigidMotion;
use fe_grid::{Field, ScalarField};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector};

/// Nodes whose second largest variance (in 2D the largest) is less than this share of the squared spacing lie on a line or
/// in a point, up to rounding, and do not determine a rotation.
const LEAST_VARIANCE: f64 = 0.01;

impl<const D: usize> RigidMotion<D> {
    /// The motion that brings points nearest to others, in the mean of the squared distances with these masses. Of several
    /// rotations, such as those of a single point, one is chosen. There is mass somewhere.
    ///
    /// Source: Kabsch, *A solution for the best rotation to relate two sets of vectors* (1976).
    pub fn nearest(
        points: impl Iterator<Item = (f64, SVector<f64, D>, SVector<f64, D>)> + Clone,
    ) -> Self {
        let mut mass = 0.0;
        let [mut a, mut b] = [SVector::<f64, D>::zeros(); 2];
        for (m, from, to) in points.clone() {
            mass += m;
            a += from * m;
            b += to * m;
        }
        let [a, b] = [a / mass, b / mass];
        let mut covariance = SMatrix::<f64, D, D>::zeros();
        for (m, from, to) in points {
            covariance += (to - b) * (from - a).transpose() * m;
        }
        let rotation = nearest_rotation(&covariance);
        Self::from_parts(rotation, b - rotation * a)
    }

    /// The motion that is nearest to a deformation, given by its displacement, of a shape, given by its signed distance
    /// (positive inside) on the same grid; `None` where the nodes inside do not determine a rotation.
    ///
    /// # Panics
    /// If the grids differ.
    pub fn nearest_to_deformation(
        shape: &ScalarField<f64, D>,
        displacement: &Field<f64, D, D>,
    ) -> Option<Self> {
        let grid = *shape.grid();
        assert_eq!(grid, *displacement.grid());
        let share = |u: &f64| f64::from(u8::from(*u > 0.0));
        let shares = shape.as_slice().iter().map(share).collect();
        let shares = ScalarField::from_vec(grid, shares).ok()?;
        let spread = Moments::of_density(&shares).ok()?.covariance;
        // In descending order.
        let variances = DMatrix::from_column_slice(D, D, spread.as_slice()).singular_values();
        let determined = variances[D - 2] > LEAST_VARIANCE * grid.spacing().powi(2);
        let inside = shape.as_slice().iter().enumerate();
        let inside = inside.filter(|(_, u)| **u > 0.0).map(|(node, _)| node);
        let place = move |node| SVector::from(grid.position(grid.node(node)));
        let moved = |node| (1.0, place(node), SVector::from(displacement.deformed(node)));
        determined.then(|| Self::nearest(inside.map(moved)))
    }
}

/// Returns the rotation `R` that maximises `R : C`.
fn nearest_rotation<const D: usize>(c: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    const { assert!(D == 2 || D == 3) };
    if D == 2 {
        let (cosine, sine) = (c[(0, 0)] + c[(1, 1)], c[(1, 0)] - c[(0, 1)]);
        let size = cosine.hypot(sine);
        if size == 0.0 {
            return SMatrix::identity();
        }
        let mut rotation = SMatrix::<f64, D, D>::identity() * (cosine / size);
        rotation[(1, 0)] = sine / size;
        rotation[(0, 1)] = -sine / size;
        return rotation;
    }
    // Conversion to a constant dimension: the compiler does not know that `D` is three.
    let c = Matrix3::from_fn(|i, j| c[(i, j)]);
    let svd = c.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return SMatrix::identity();
    };
    // The smallest singular value changes its sign if the factor is a reflection.
    let mut flip = Matrix3::identity();
    let least = svd.singular_values.imin();
    flip[(least, least)] = (u * v).determinant().signum();
    let rotation = u * flip * v;
    SMatrix::from_fn(|i, j| rotation[(i, j)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid_motion::plane_rotation;
    use fe_grid::Grid;

    /// A motion is found from what it does to a shape, with a strain of no rotation after it; points and lines of space
    /// determine none.
    #[test]
    fn motions_are_found_from_what_they_do() {
        fn check<const D: usize>(rotation: SMatrix<f64, D, D>) {
            let grid = Grid::<D>::cube(9);
            let motion = RigidMotion::from_parts(rotation, SVector::from_element(0.1));
            // Symmetric about its middle, so that the stretch does not turn it.
            let distance = |x: [f64; D], half: [f64; D]| {
                let inside = (0..D).map(|k| half[k] - (x[k] - 0.5).abs());
                [inside.fold(f64::INFINITY, f64::min)]
            };
            let block = ScalarField::from_fn(grid, |x| {
                distance(x, std::array::from_fn(|k| 0.2 + 0.1 * k as f64))
            });
            let stretch = |x: [f64; D]| -> [f64; D] {
                std::array::from_fn(|k| 0.5 + (1.0 + 0.3 * k as f64) * (x[k] - 0.5))
            };
            let displacement = Field::from_fn(grid, |x| {
                let y = motion.map(stretch(x));
                std::array::from_fn(|k| y[k] - x[k])
            });
            let found = RigidMotion::nearest_to_deformation(&block, &displacement).unwrap();
            assert!((found.rotation() - rotation).norm() < 1e-12, "{found:?}");
            assert!((found.translation() - motion.translation()).norm() < 1e-12);
            // One node, a line of nodes, and none.
            let thin = |n: usize| {
                let half = std::array::from_fn(|k| if k < n { 0.3 } else { 0.01 });
                let shape = ScalarField::from_fn(grid, |x| distance(x, half));
                RigidMotion::nearest_to_deformation(&shape, &displacement).is_some()
            };
            assert_eq!([thin(0), thin(1)], [false, D == 2]);
            let none = ScalarField::from_fn(grid, |_| [-1.0]);
            assert!(RigidMotion::nearest_to_deformation(&none, &displacement).is_none());
        }
        check::<2>(plane_rotation(0, 1, 2.9));
        check::<3>(plane_rotation(0, 1, 2.5) * plane_rotation(1, 2, -1.2));
    }
}
