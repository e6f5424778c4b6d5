//! Rotations of a shape as a whole after which it overlaps much more with another one.
//!
//! They cost nothing under laws that are frame indifferent. Minimisers that begin with the identity follow rotations up to
//! some 45 degrees; where the other shape lies upside down, they end in a deformation that bends the shape the short way.
//! Rotations that cover all others are tried by the overlap with the other shape on a coarse grid, and the best one is
//! improved by small ones.

use crate::continued::Continued;
use crate::measures::Moments;
use crate::rigid_motion::{RigidMotion, covering_rotations, plane_rotation};
use fe_grid::ScalarField;
use nalgebra::{SMatrix, SVector};

/// Most cells along an axis of the grid on which overlaps are measured (2D, 3D).
const MEASURED_CELLS: [usize; 2] = [24, 16];
/// Shapes with at most this mismatch fit each other as they are.
const FITTING: f64 = 0.05;
/// A rotation is tried whose mismatch is at most this share of that without one.
const CLEARLY_LESS: f64 = 0.7;
/// The first of the small rotations, and how often the angle is halved: from eleven degrees to a sixth of one.
const FIRST_ANGLE: f64 = 0.2;
const HALVINGS: usize = 6;

/// A rotation of a shape about its centre, which moves to the centre of another shape.
#[derive(Clone, Copy, Debug)]
pub struct Turn<const D: usize> {
    motion: RigidMotion<D>,
    centre: [f64; D],
    mismatches: [f64; 2],
}

impl<const D: usize> Turn<D> {
    /// The one after which a shape overlaps much more with another one than after the translation alone, if there is
    /// one. Both are given by their signed distances (positive inside), on any grids of one box.
    pub fn between(from: &ScalarField<f64, D>, to: &ScalarField<f64, D>) -> Option<Self> {
        Self::best(from, to).filter(Self::clearly_better)
    }

    /// The one after which a shape overlaps most with another one; that by no angle where it fits so. The larger shape is
    /// scaled to the volume of the smaller one for this. `None` for shapes without an inside.
    pub fn best(from: &ScalarField<f64, D>, to: &ScalarField<f64, D>) -> Option<Self> {
        let most_cells = MEASURED_CELLS[usize::from(D == 3)];
        let grid = &from.grid().thinned(most_cells).ok()?;
        let [own, other] = [from, to].map(|shape| shape.on_grid(grid));
        let moments = |u| Moments::of_density(&shares(u)).ok();
        let [from, to] = [moments(&own)?, moments(&other)?];
        let [centre, moved] = [from.centroid, to.centroid];
        // The ratio of their lengths.
        let ratio = (to.volume / from.volume).powf(1.0 / D as f64);
        let own = shrunk(own, centre, ratio);
        let other = shares(&shrunk(other, moved, 1.0 / ratio));
        let about = |rotation: SMatrix<f64, D, D>| {
            let translation = moved - rotation * centre;
            RigidMotion::from_parts(rotation, translation)
        };
        let judged = |rotation| mismatch(&shares(&about(rotation).apply(&own)), &other);
        let as_it_is = judged(SMatrix::identity());
        let mut best = (as_it_is, SMatrix::identity());
        if as_it_is > FITTING {
            for rotation in covering_rotations() {
                let mismatch = judged(rotation);
                if mismatch < best.0 {
                    best = (mismatch, rotation);
                }
            }
            best = improved(best, &judged);
        }
        let (mismatch, rotation) = best;
        Some(Self {
            motion: about(rotation),
            centre: centre.into(),
            mismatches: [as_it_is, mismatch],
        })
    }

    /// Whether the shapes overlap much more after it than after the translation alone.
    pub fn clearly_better(&self) -> bool {
        let [as_it_is, turned] = self.mismatches;
        as_it_is > FITTING && turned <= CLEARLY_LESS * as_it_is
    }

    /// The rotation, with the translation of the shape's centre to that of the other one.
    pub fn motion(&self) -> &RigidMotion<D> {
        &self.motion
    }

    /// The volume in which both shapes differ, relative to that of their union, at equal volumes and on a coarse grid: with
    /// the centres in one place, and after the rotation.
    pub fn mismatches(&self) -> [f64; 2] {
        self.mismatches
    }

    /// A share of it: the shape is turned by this share of the angle, and its centre moved by this share of its way.
    pub fn part(&self, share: f64) -> RigidMotion<D> {
        self.motion.part(share, self.centre)
    }
}

/// A rotation of less mismatch nearby.
fn improved<const D: usize>(
    (mut least, mut best): (f64, SMatrix<f64, D, D>),
    mismatch: &dyn Fn(SMatrix<f64, D, D>) -> f64,
) -> (f64, SMatrix<f64, D, D>) {
    let mut angle = FIRST_ANGLE;
    for _ in 0..=HALVINGS {
        for to in 1..D {
            for from in 0..to {
                for angle in [angle, -angle] {
                    let rotation = plane_rotation(from, to, angle) * best;
                    let found = mismatch(rotation);
                    if found < least {
                        (least, best) = (found, rotation);
                    }
                }
            }
        }
        angle *= 0.5;
    }
    (least, best)
}

/// A shape scaled about its centre by a ratio below one, from its signed distance; as it is for other ratios.
fn shrunk<const D: usize>(
    distance: ScalarField<f64, D>,
    centre: SVector<f64, D>,
    ratio: f64,
) -> ScalarField<f64, D> {
    if ratio >= 1.0 {
        return distance;
    }
    let own = Continued::new(&distance);
    ScalarField::from_fn(*distance.grid(), |x| {
        let from = centre + (SVector::from(x) - centre) / ratio;
        [ratio * own.value(&from.into())]
    })
}

/// The volume of the symmetric difference of two shapes, relative to that of their union, from their shares of cells.
fn mismatch<const D: usize>(a: &ScalarField<f64, D>, b: &ScalarField<f64, D>) -> f64 {
    let (mut apart, mut together) = (0.0, 0.0);
    for (a, b) in a.as_slice().iter().zip(b.as_slice()) {
        apart += (a - b).abs();
        together += a.max(*b);
    }
    apart / together
}

/// About the shares of the cells around the nodes that lie in a shape, from its signed distances.
fn shares<const D: usize>(distance: &ScalarField<f64, D>) -> ScalarField<f64, D> {
    let (grid, mut shares) = (distance.grid(), distance.clone());
    for share in shares.as_mut_slice() {
        *share = (0.5 + *share / grid.spacing()).clamp(0.0, 1.0);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid_motion::angle_between;
    use fe_grid::Grid;

    /// A bracket, which no rotation maps to itself, is found in every position.
    #[test]
    fn turned_shapes_are_found() {
        let grid = Grid::<3>::cube(17);
        let bracket = |x: [f64; 3]| {
            let cuboid = |low: [f64; 3], high: [f64; 3]| {
                let outside = (0..3).map(|k| (low[k] - x[k]).max(x[k] - high[k]));
                -outside.fold(f64::NEG_INFINITY, f64::max)
            };
            let foot = cuboid([0.3, 0.3, 0.3], [0.75, 0.7, 0.45]);
            let arm = cuboid([0.3, 0.3, 0.3], [0.45, 0.45, 0.8]);
            foot.max(arm)
        };
        let start = ScalarField::from_fn(grid, |x| [bracket(x)]);
        let middle = SVector::from([0.5; 3]);
        let tilted = plane_rotation(0, 1, 2.5) * plane_rotation(1, 2, -1.2);
        let half_turn = plane_rotation(0, 2, std::f64::consts::PI);
        for rotation in [tilted, half_turn, plane_rotation(1, 2, 0.4)] {
            let right = RigidMotion::from_parts(rotation, middle - rotation * middle);
            let end = ScalarField::from_fn(grid, |x| [bracket(right.map_back(x))]);
            let turn = Turn::between(&start, &end).unwrap();
            let apart = angle_between(turn.motion.rotation(), &rotation);
            assert!(apart < 0.05, "{rotation}: {apart}");
            for share in [0.5, 1.0] {
                let half = turn.part(share).angle() - share * turn.motion.angle();
                assert!(half.abs() < 1e-9);
            }
            let last = turn.part(1.0);
            let inside = |node: &usize| start.as_slice()[*node] > 0.0;
            for node in (0..grid.n_nodes()).filter(inside) {
                let from = grid.position(grid.node(node));
                let (to, found) = (right.map(from), last.map(from));
                assert!((0..3).all(|k| (to[k] - found[k]).abs() < 0.4 * grid.spacing()));
            }
        }
        assert!(Turn::between(&start, &start).is_none());
        // Sizes do not hide a rotation.
        let right = RigidMotion::from_parts(half_turn, middle - half_turn * middle);
        for scale in [0.75, 1.2] {
            let small = |x: [f64; 3]| bracket(x.map(|x| 0.5 + (x - 0.5) / scale));
            let end = ScalarField::from_fn(grid, |x| [scale * small(right.map_back(x))]);
            let turn = Turn::between(&start, &end).unwrap();
            assert!(angle_between(turn.motion.rotation(), &half_turn) < 0.1);
        }
    }
}
