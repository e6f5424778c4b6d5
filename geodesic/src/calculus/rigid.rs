//! Rigid motions of deformations: the null space of the energy of a step.
//!
//! `W(a, b)` does not change if `a` and `b` are composed with any two rigid motions, so a geodesic
//! of two steps determines its unknown deformation up to one. It is chosen in the least squares
//! sense over the matter of the object:
//!
//! - a midpoint is moved as near as possible to the mean of its neighbours;
//! - an extension repeats the rigid motion of the preceding step: `rig(b, c) = rig(a, b)`, where
//!   `rig(a, b)` is the rigid motion that brings `a` nearest to `b`. A rigid rotation and
//!   translation is thus continued; no frame is preferred, and the choice is symmetric in time.

use fe_grid::{Field, Grid, ScalarField};
use levelset::rigid_motion::angle_between;
use nalgebra::{SMatrix, SVector};

/// The rigid motion `y -> rotation y + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RigidMotion<const D: usize> {
    rotation: SMatrix<f64, D, D>,
    shift: SVector<f64, D>,
}

/// Mass distribution at the nodes of a grid.
pub(super) struct Matter<const D: usize> {
    grid: Grid<D>,
    /// Fraction of the mass at every node.
    shares: Vec<f64>,
}

impl<const D: usize> Matter<D> {
    /// Creates the distribution from a density at the nodes, which is positive somewhere.
    pub fn new(grid: Grid<D>, density: Vec<f64>) -> Self {
        let mass: f64 = density.iter().sum();
        let shares = density.into_iter().map(|m| m / mass).collect();
        Self { grid, shares }
    }

    /// Returns the root mean square of a displacement.
    pub fn norm(&self, displacement: &[f64]) -> f64 {
        let n = self.shares.len();
        let squares = displacement.chunks_exact(n).map(|component| {
            let pairs = component.iter().zip(&self.shares);
            pairs.map(|(u, share)| share * u * u).sum::<f64>()
        });
        squares.sum::<f64>().sqrt()
    }

    fn place(&self, displacement: &[f64], node: usize) -> SVector<f64, D> {
        let n = self.shares.len();
        let x = self.grid.position(self.grid.node(node));
        SVector::from_fn(|k, _| x[k] + displacement[k * n + node])
    }

    fn centre(&self, displacement: &[f64]) -> SVector<f64, D> {
        self.sum(|node| self.place(displacement, node))
    }

    fn sum<const C: usize>(
        &self,
        term: impl Fn(usize) -> SMatrix<f64, D, C>,
    ) -> SMatrix<f64, D, C> {
        let mut sum = SMatrix::zeros();
        for (node, &share) in self.shares.iter().enumerate() {
            if share > 0.0 {
                sum += term(node) * share;
            }
        }
        sum
    }

    /// Computes the rigid motion that brings one deformation, given by its displacement, nearest to
    /// another.
    ///
    /// Source: Kabsch, *A solution for the best rotation to relate two sets of vectors* (1976).
    pub fn fit(&self, from: &[f64], to: &[f64]) -> RigidMotion<D> {
        let (a, b) = (self.centre(from), self.centre(to));
        let covariance: SMatrix<f64, D, D> =
            self.sum(|node| (self.place(to, node) - b) * (self.place(from, node) - a).transpose());
        let rotation = nearest_rotation(&covariance);
        RigidMotion {
            rotation,
            shift: b - rotation * a,
        }
    }

    /// Applies a rigid motion to a deformation.
    pub fn apply(&self, motion: &RigidMotion<D>, displacement: &mut [f64]) {
        let n = self.shares.len();
        for node in 0..n {
            let x = self.grid.position(self.grid.node(node));
            let y = motion.rotation * self.place(displacement, node) + motion.shift;
            for k in 0..D {
                displacement[k * n + node] = y[k] - x[k];
            }
        }
    }

    /// Returns infinitesimal rigid motions of a deformation, orthonormal over the matter.
    pub fn modes(&self, displacement: &[f64]) -> Vec<Vec<f64>> {
        let n = self.shares.len();
        let centre = self.centre(displacement);
        let mut modes: Vec<Vec<f64>> = Vec::new();
        let mut add = |mut mode: Vec<f64>| {
            for other in &modes {
                self.remove(other, &mut mode);
            }
            let size = self.norm(&mode);
            if size > 0.0 {
                for x in &mut mode {
                    *x /= size;
                }
                modes.push(mode);
            }
        };
        for k in 0..D {
            let mut mode = vec![0.0; D * n];
            mode[k * n..(k + 1) * n].fill(1.0);
            add(mode);
        }
        for i in 0..D {
            for k in 0..i {
                let mut mode = vec![0.0; D * n];
                for node in 0..n {
                    let y = self.place(displacement, node) - centre;
                    mode[i * n + node] = y[k];
                    mode[k * n + node] = -y[i];
                }
                add(mode);
            }
        }
        modes
    }

    /// Removes from a displacement its component along a mode.
    pub fn remove(&self, mode: &[f64], displacement: &mut [f64]) {
        let n = self.shares.len();
        let mut share = 0.0;
        for (u, m) in displacement.chunks_exact(n).zip(mode.chunks_exact(n)) {
            for ((u, m), mass) in u.iter().zip(m).zip(&self.shares) {
                share += mass * u * m;
            }
        }
        for (u, m) in displacement.iter_mut().zip(mode) {
            *u -= share * m;
        }
    }
}

/// The angle of the rotation that is nearest to a deformation of a shape, given by its signed distance (positive inside)
/// on the same grid, in degrees; `None` where no node is inside.
pub(crate) fn rotation_degrees<const D: usize>(
    shape: &ScalarField<f64, D>,
    displacement: &Field<f64, D, D>,
) -> Option<f64> {
    let density = shape
        .as_slice()
        .iter()
        .map(|u| f64::from(u8::from(*u > 0.0)));
    let density: Vec<f64> = density.collect();
    if density.iter().all(|share| *share == 0.0) {
        return None;
    }
    let matter = Matter::new(*shape.grid(), density);
    let identity = vec![0.0; displacement.as_slice().len()];
    let rotation = matter.fit(&identity, displacement.as_slice()).rotation;
    Some(angle_between(&rotation, &SMatrix::identity()).to_degrees())
}

impl<const D: usize> RigidMotion<D> {
    /// Returns the motion that gives this one when it is repeated so many times.
    pub fn root(&self, times: usize) -> Self {
        let share = 1.0 / times as f64;
        let rotation = power(&self.rotation, share);
        // `s = (1 + R + ... + R^(n - 1)) s_1`; rotations by less than a full turn have no other root of one.
        let mut sum = SMatrix::<f64, D, D>::zeros();
        let mut turned = SMatrix::identity();
        for _ in 0..times {
            sum += turned;
            turned *= rotation;
        }
        let shift = sum
            .try_inverse()
            .map_or(self.shift * share, |inverse| inverse * self.shift);
        Self { rotation, shift }
    }

    /// Returns the composition of the inverse of another motion with this one.
    pub fn after_inverse_of(&self, other: &Self) -> Self {
        let rotation = self.rotation * other.rotation.transpose();
        Self {
            rotation,
            shift: self.shift - rotation * other.shift,
        }
    }
}

/// Returns the rotation about the same axis by a share of the angle.
fn power<const D: usize>(rotation: &SMatrix<f64, D, D>, share: f64) -> SMatrix<f64, D, D> {
    const { assert!(D == 2 || D == 3) };
    if D == 2 {
        let angle = share * rotation[(1, 0)].atan2(rotation[(0, 0)]);
        let part = nalgebra::Rotation2::new(angle);
        return SMatrix::from_fn(|i, j| part[(i, j)]);
    }
    let matrix = nalgebra::Matrix3::from_fn(|i, j| rotation[(i, j)]);
    let part = nalgebra::Rotation3::from_matrix_unchecked(matrix).powf(share);
    SMatrix::from_fn(|i, j| part[(i, j)])
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
    let c = nalgebra::Matrix3::from_fn(|i, j| c[(i, j)]);
    let svd = c.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return SMatrix::identity();
    };
    // The smallest singular value changes its sign if the factor is a reflection.
    let mut flip = nalgebra::Matrix3::identity();
    let least = svd.singular_values.imin();
    flip[(least, least)] = (u * v).determinant().signum();
    let rotation = u * flip * v;
    SMatrix::from_fn(|i, j| rotation[(i, j)])
}
