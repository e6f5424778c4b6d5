//! Rigid motions of shapes, and rotations.

use crate::continued::Continued;
use crate::contour::Contour;
use fe_grid::{Field, Grid};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion};
use std::f64::consts::{SQRT_2, TAU};

/// Number of angles of the even covering in 2D: every three degrees, twelve per period of a star
/// with ten arms.
const N_ANGLES: usize = 120;
/// Number of rotations of the even covering in 3D, about 25 degrees from each other.
const N_ROTATIONS: usize = 360;

/// A proper rigid motion `y = R x + t` from input coordinates `x` to aligned coordinates `y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion<const D: usize> {
    rotation: SMatrix<f64, D, D>,
    translation: SVector<f64, D>,
}

impl<const D: usize> RigidMotion<D> {
    /// Creates the motion with rotation `R` and translation `t`; `None` if `R` is not a proper
    /// rotation (`R^T R = 1` to 1e-9, `det R > 0`).
    pub fn new(rotation: SMatrix<f64, D, D>, translation: SVector<f64, D>) -> Option<Self> {
        let skewed = (rotation.transpose() * rotation - SMatrix::identity()).norm();
        let proper = skewed < 1e-9 && determinant(&rotation) > 0.0;
        let finite = translation.iter().all(|x| x.is_finite());
        (proper && finite).then_some(Self {
            rotation,
            translation,
        })
    }

    /// Creates a motion from a matrix that is a rotation by construction; it is not checked.
    pub fn from_parts(rotation: SMatrix<f64, D, D>, translation: SVector<f64, D>) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// Returns the identity.
    pub fn identity() -> Self {
        Self {
            rotation: SMatrix::identity(),
            translation: SVector::zeros(),
        }
    }

    /// Returns the rotation `R`.
    pub fn rotation(&self) -> &SMatrix<f64, D, D> {
        &self.rotation
    }

    /// Returns the translation `t`, in the unit of the coordinates.
    pub fn translation(&self) -> &SVector<f64, D> {
        &self.translation
    }

    /// Returns the angle of the rotation, in radians, in `[0, pi]`.
    pub fn angle(&self) -> f64 {
        angle_between(&self.rotation, &SMatrix::identity())
    }

    /// Maps a point from input coordinates to aligned coordinates.
    pub fn map(&self, x: [f64; D]) -> [f64; D] {
        (self.rotation * SVector::from(x) + self.translation).into()
    }

    /// Maps a point from aligned coordinates to input coordinates.
    pub fn map_back(&self, y: [f64; D]) -> [f64; D] {
        (self.rotation.transpose() * (SVector::from(y) - self.translation)).into()
    }

    /// Returns the motion from aligned to input coordinates.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// Returns the composition: first `first`, then this motion.
    pub fn after(&self, first: &Self) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }

    /// Returns a share of the motion: the rotation by this share of its angle about its axis, with the point
    /// `centre` moved by this share of its way. With 1 it is the motion, with 0 the identity.
    pub fn part(&self, share: f64, centre: [f64; D]) -> Self {
        // A rotation of the plane is one of space about the third axis. Quaternions know the axis of half a
        // turn, too, whose matrix is symmetric.
        let whole = Matrix3::from_fn(|i, j| {
            if i < D && j < D {
                self.rotation[(i, j)]
            } else {
                f64::from(u8::from(i == j))
            }
        });
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(whole));
        let part = rotation.powf(share).to_rotation_matrix();
        let rotation = SMatrix::<f64, D, D>::from_fn(|i, j| part[(i, j)]);
        let (from, to) = (SVector::from(centre), SVector::from(self.map(centre)));
        let translation = from + (to - from) * share - rotation * from;
        Self {
            rotation,
            translation,
        }
    }

    /// Returns the motion that gives this one when it is repeated so many times, at least once.
    pub fn root(&self, times: usize) -> Self {
        let times = times.max(1);
        let share = 1.0 / times as f64;
        let rotation = self.part(share, [0.0; D]).rotation;
        // `t = (1 + R + ... + R^(n - 1)) t_1`; rotations by less than a full turn have no other root of one.
        let mut sum = SMatrix::<f64, D, D>::zeros();
        let mut turned = SMatrix::identity();
        for _ in 0..times {
            sum += turned;
            turned *= rotation;
        }
        let translation = sum
            .try_inverse()
            .map_or(self.translation * share, |inverse| {
                inverse * self.translation
            });
        Self {
            rotation,
            translation,
        }
    }

    /// Returns the displacement `R x + t - x` at the nodes of a grid.
    pub fn displacement(&self, grid: Grid<D>) -> Field<f64, D, D> {
        Field::from_fn(grid, |x| {
            let y = self.map(x);
            std::array::from_fn(|k| y[k] - x[k])
        })
    }

    /// Transforms a signed distance to aligned coordinates: `u'(y) = u(R^T (y - t))` at every node
    /// of its grid, by multilinear interpolation; outside the box `u` decreases with the distance
    /// from it. If the contour is available, the distance to its image
    /// ([`RigidMotion::apply_to_contour`]) is exact.
    pub fn apply(&self, signed_distance: &Field<f64, D, 1>) -> Field<f64, D, 1> {
        let distance = Continued::new(signed_distance);
        Field::from_fn(*signed_distance.grid(), |y| {
            [distance.value(&self.map_back(y))]
        })
    }

    /// Transforms a contour to aligned coordinates.
    pub fn apply_to_contour(&self, contour: &Contour<D>) -> Contour<D> {
        contour.transformed(&self.rotation, &self.translation)
    }
}

/// Returns all rotations that map coordinate axes to coordinate axes: 4 in 2D, 24 in 3D, of which every rotation has one
/// within 45 and 63 degrees.
pub fn axis_rotations<const D: usize>() -> impl Iterator<Item = SMatrix<f64, D, D>> {
    let orders = (0..D.pow(D as u32))
        .map(|code| -> [usize; D] { std::array::from_fn(|k| code / D.pow(k as u32) % D) });
    let permutations = orders.filter(|order| (0..D).all(|axis| order.contains(&axis)));
    let signed = permutations.flat_map(|order| (0..1usize << D).map(move |signs| (order, signs)));
    signed
        .map(|(order, signs)| {
            SMatrix::from_fn(|i, j| {
                let sign = if signs >> j & 1 == 1 { -1.0 } else { 1.0 };
                if order[j] == i { sign } else { 0.0 }
            })
        })
        .filter(|m| determinant(m) > 0.0)
}

/// Returns rotations that cover the rotation group evenly: 119 in 2D, of which every rotation but the identity has one within
/// a degree and a half, and 360 in 3D, some 25 degrees from each other.
pub fn covering_rotations<const D: usize>() -> Vec<SMatrix<f64, D, D>> {
    if D == 2 {
        return (1..N_ANGLES)
            .map(|i| plane_rotation(0, 1, TAU * i as f64 / N_ANGLES as f64))
            .collect();
    }
    (0..N_ROTATIONS).map(spiral).collect()
}

/// Returns one point of a spiral through the unit quaternions, as a rotation: M. Alexa,
/// *Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3)*, CVPR 2022.
fn spiral<const D: usize>(i: usize) -> SMatrix<f64, D, D> {
    /// The positive root of `x^4 = x + 4`.
    const PSI: f64 = 1.533_751_168_755_204_3;
    let s = i as f64 + 0.5;
    let t = s / N_ROTATIONS as f64;
    let (inner, outer) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (TAU * s / SQRT_2, TAU * s / PSI);
    let (x, y) = (inner * alpha.sin(), inner * alpha.cos());
    let (z, w) = (outer * beta.sin(), outer * beta.cos());
    let rows = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    SMatrix::from_fn(|i, j| rows[i][j])
}

/// Returns the angle, in `[0, pi]`, between two rotations in `D = 2` or `3` dimensions:
/// `|R - S|_F = 2 sqrt 2 sin(angle/2)` in both.
pub fn angle_between<const D: usize>(r: &SMatrix<f64, D, D>, s: &SMatrix<f64, D, D>) -> f64 {
    let chord = (r - s).norm() / (2.0 * std::f64::consts::SQRT_2);
    2.0 * chord.min(1.0).asin()
}

/// Returns the rotation by an angle in the plane of two axes, from the first towards the second.
pub fn plane_rotation<const D: usize>(from: usize, to: usize, angle: f64) -> SMatrix<f64, D, D> {
    let mut r = SMatrix::identity();
    let (sin, cos) = angle.sin_cos();
    r[(from, from)] = cos;
    r[(to, to)] = cos;
    r[(to, from)] = sin;
    r[(from, to)] = -sin;
    r
}

/// Computes the determinant for `D = 2, 3`, by expansion along the first row.
pub fn determinant<const D: usize>(m: &SMatrix<f64, D, D>) -> f64 {
    if D == 2 {
        return m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(1, 0)];
    }
    (0..3)
        .map(|j| {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            m[(0, j)] * (m[(1, k)] * m[(2, l)] - m[(1, l)] * m[(2, k)])
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of them once, and none else.
    #[test]
    fn axes_are_mapped_to_axes() {
        fn check<const D: usize>(n: usize) {
            let all: Vec<_> = axis_rotations::<D>().collect();
            assert_eq!(all.len(), n);
            for (i, r) in all.iter().enumerate() {
                assert!((r.transpose() * r - SMatrix::identity()).norm() < 1e-13);
                assert!((determinant(r) - 1.0).abs() < 1e-13);
                assert!(r.iter().all(|x| [-1.0, 0.0, 1.0].contains(x)));
                assert!(!all[..i].contains(r));
            }
        }
        check::<2>(4);
        check::<3>(24);
    }

    #[test]
    fn coverings_are_rotations_and_leave_no_gap() {
        fn check<const D: usize>(n: usize, gap: f64) {
            let list = covering_rotations::<D>();
            assert_eq!(list.len(), n);
            for r in &list {
                assert!((r.transpose() * r - SMatrix::identity()).norm() < 1e-13);
                assert!((determinant(r) - 1.0).abs() < 1e-13);
            }
            // Rotations far from the list itself: products of its elements.
            for (i, a) in list.iter().enumerate() {
                let probe = a * list[(7 * i + 3) % list.len()];
                let near = list.iter().map(|r| angle_between(r, &probe));
                assert!(near.fold(f64::INFINITY, f64::min) < gap);
            }
        }
        check::<2>(N_ANGLES - 1, 3.01f64.to_radians());
        check::<3>(N_ROTATIONS, 35f64.to_radians());
    }

    /// Two halves of a motion are the motion, also of half a turn.
    #[test]
    fn halves_of_a_motion_make_the_whole() {
        let whole = |rotation: SMatrix<f64, 3, 3>| {
            RigidMotion::new(rotation, SVector::from([0.3, -0.1, 0.2])).unwrap()
        };
        let tilted = plane_rotation::<3>(0, 1, 0.7) * plane_rotation::<3>(1, 2, 2.0);
        let half_turn = plane_rotation::<3>(0, 2, std::f64::consts::PI);
        for rotation in [SMatrix::identity(), tilted, half_turn] {
            let (motion, centre) = (whole(rotation), [0.4, 0.5, 0.7]);
            let first = motion.part(0.5, centre);
            let second = motion.part(0.5, motion.map(centre));
            // The second half begins where the first has moved the centre to.
            let again = second.rotation * first.rotation;
            assert!((again - motion.rotation).norm() < 1e-12, "{again}");
            assert!((first.angle() - 0.5 * motion.angle()).abs() < 1e-7);
            let [to, half] = [motion.map(centre), first.map(centre)];
            for k in 0..3 {
                assert!((half[k] - 0.5 * (centre[k] + to[k])).abs() < 1e-12);
            }
            assert!((motion.part(1.0, centre).rotation - rotation).norm() < 1e-12);
        }
        let plane = RigidMotion::new(plane_rotation::<2>(0, 1, -3.0), SVector::zeros()).unwrap();
        let third = plane.part(1.0 / 3.0, [0.5, 0.5]);
        assert!((third.rotation - plane_rotation::<2>(0, 1, -1.0)).norm() < 1e-12);
    }
}
