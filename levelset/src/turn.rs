//! Rotations of a shape as a whole after which it overlaps much more with another one.
//!
//! They cost nothing under laws that are frame indifferent. Minimisers that begin with the identity follow rotations up to
//! some 45 degrees; where the other shape lies upside down, they end in a deformation that bends the shape the short way.
//! Rotations that cover all others are tried by the overlap with the other shape on a coarse grid, and the best one is
//! improved by small ones.
//!
//! Shapes of different outlines overlap little in any pose: a C on its back and a U are bent alike, but one is round and the
//! other is not. Where paths may begin is told by their overlap with blurred boundaries ([`Turn::several`]).

use crate::continued::Continued;
use crate::measures::Moments;
use crate::rigid_motion::{RigidMotion, angle_between, covering_rotations, plane_rotation};
use fe_grid::ScalarField;
use nalgebra::{SMatrix, SVector};

/// Most cells along an axis of the grid on which overlaps are measured (2D, 3D).
const MEASURED_CELLS: [usize; 2] = [24, 16];
/// Shapes with at most this mismatch fit each other as they are.
const FITTING: f64 = 0.05;
/// A rotation is clearly better if its mismatch is at most this share of that without one.
const CLEARLY_LESS: f64 = 0.7;
/// Width of a blurred boundary, relative to the side of a cube of the shape's volume.
const BLUR: f64 = 0.7;
/// Rotations in a list have at most this multiple of the blurred mismatch without one, and at least this angle between them,
/// in radians.
const SIMILAR: f64 = 1.1;
const APART: f64 = 0.6;
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
    /// The one after which a shape overlaps most with another one; that by no angle where it fits so. The larger shape is
    /// scaled to the volume of the smaller one for this. Both are given by their signed distances (positive inside), on any
    /// grids of one box. `None` for shapes without an inside.
    pub fn best(from: &ScalarField<f64, D>, to: &ScalarField<f64, D>) -> Option<Self> {
        let fit = Fit::new(from, to, None)?;
        let as_it_is = fit.mismatch(&SMatrix::identity());
        let mut best = (as_it_is, SMatrix::identity());
        if as_it_is > FITTING {
            for rotation in covering_rotations() {
                let mismatch = fit.mismatch(&rotation);
                if mismatch < best.0 {
                    best = (mismatch, rotation);
                }
            }
            best = fit.improved(best);
        }
        Some(fit.turn(best, as_it_is))
    }

    /// The rotations, at most `most`, after which a shape looks more like another one than after others nearby, the best
    /// first: by the overlap with blurred boundaries, which tells how parts lie also where outlines differ. They are by more
    /// than half a radian apart from each other and from none; none are much worse than none, and none differ from another
    /// by a rotation that maps one of the shapes to itself. Shapes that fit as they are have none.
    pub fn several(from: &ScalarField<f64, D>, to: &ScalarField<f64, D>, most: usize) -> Vec<Self> {
        let Some(fit) = Fit::new(from, to, Some(BLUR)) else {
            return Vec::new();
        };
        let as_it_is = fit.mismatch(&SMatrix::identity());
        if as_it_is <= FITTING {
            return Vec::new();
        }
        let onto_itself = [from, to].map(|shape| Fit::new(shape, shape, None));
        let [Some(first), Some(second)] = onto_itself else {
            return Vec::new();
        };
        let all = covering_rotations().into_iter();
        let mut all: Vec<_> = all.map(|r| (fit.mismatch(&r), r)).collect();
        all.retain(|(mismatch, _)| *mismatch <= SIMILAR * as_it_is);
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let none = SMatrix::identity();
        let (mut known, mut list) = (vec![none], Vec::<Self>::new());
        for tried in all {
            let is_known = |rotation: &SMatrix<f64, D, D>| {
                known
                    .iter()
                    .any(|other| angle_between(other, rotation) < APART)
            };
            if list.len() == most {
                break;
            }
            if is_known(&tried.1) {
                continue;
            }
            let best = fit.improved(tried);
            let is_the_same = |other: &SMatrix<f64, D, D>| {
                let back = other.transpose();
                let apart = [
                    first.mismatch(&(back * best.1)),
                    second.mismatch(&(best.1 * back)),
                ];
                apart.iter().any(|mismatch| *mismatch <= FITTING)
            };
            let mut listed = list.iter().map(|turn| turn.motion.rotation());
            // On the slope of another minimum, or the same but for a symmetry.
            if !is_known(&best.1) && !is_the_same(&none) && !listed.any(is_the_same) {
                list.push(fit.turn(best, as_it_is));
            }
            known.extend([tried.1, best.1]);
        }
        list
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
    /// the centres in one place, and after the rotation. Boundaries are blurred for one of several.
    pub fn mismatches(&self) -> [f64; 2] {
        self.mismatches
    }

    /// A share of it: the shape is turned by this share of the angle, and its centre moved by this share of its way.
    pub fn part(&self, share: f64) -> RigidMotion<D> {
        self.motion.part(share, self.centre)
    }
}

/// Two shapes of one volume on a coarse grid, of which the first is turned onto the second.
struct Fit<const D: usize> {
    own: ScalarField<f64, D>,
    /// Indicator of the other one.
    other: ScalarField<f64, D>,
    centres: [SVector<f64, D>; 2],
    /// Width of the boundaries.
    width: f64,
}

impl<const D: usize> Fit<D> {
    /// Both are given by their signed distances. Boundaries are as wide as a cell, or have a width relative to the side of a
    /// cube of the smaller volume.
    fn new(
        from: &ScalarField<f64, D>,
        to: &ScalarField<f64, D>,
        blur: Option<f64>,
    ) -> Option<Self> {
        let most_cells = MEASURED_CELLS[usize::from(D == 3)];
        let grid = &from.grid().thinned(most_cells).ok()?;
        let [own, other] = [from, to].map(|shape| shape.on_grid(grid));
        let moments = |u| Moments::of_density(&indicator(u, grid.spacing())).ok();
        let [from, to] = [moments(&own)?, moments(&other)?];
        let side = from.volume.min(to.volume).powf(1.0 / D as f64);
        // The ratio of their lengths.
        let ratio = (to.volume / from.volume).powf(1.0 / D as f64);
        let width = blur.map_or(grid.spacing(), |blur| blur * side);
        let other = shrunk(other, to.centroid, 1.0 / ratio);
        Some(Self {
            own: shrunk(own, from.centroid, ratio),
            other: indicator(&other, width),
            centres: [from.centroid, to.centroid],
            width,
        })
    }

    /// The rotation with the translation of the shape's centre to that of the other one.
    fn motion(&self, rotation: &SMatrix<f64, D, D>) -> RigidMotion<D> {
        let [centre, moved] = self.centres;
        RigidMotion::from_parts(*rotation, moved - rotation * centre)
    }

    fn mismatch(&self, rotation: &SMatrix<f64, D, D>) -> f64 {
        let turned = self.motion(rotation).apply(&self.own);
        mismatch(&indicator(&turned, self.width), &self.other)
    }

    /// A rotation of less mismatch nearby.
    fn improved(
        &self,
        (mut least, mut best): (f64, SMatrix<f64, D, D>),
    ) -> (f64, SMatrix<f64, D, D>) {
        let mut angle = FIRST_ANGLE;
        for _ in 0..=HALVINGS {
            for to in 1..D {
                for from in 0..to {
                    for angle in [angle, -angle] {
                        let rotation = plane_rotation(from, to, angle) * best;
                        let found = self.mismatch(&rotation);
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

    /// A rotation with its mismatch, and that without one.
    fn turn(&self, (mismatch, rotation): (f64, SMatrix<f64, D, D>), as_it_is: f64) -> Turn<D> {
        Turn {
            motion: self.motion(&rotation),
            centre: self.centres[0].into(),
            mismatches: [as_it_is, mismatch],
        }
    }
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

/// The volume of the symmetric difference of two shapes, relative to that of their union, from their indicators.
fn mismatch<const D: usize>(a: &ScalarField<f64, D>, b: &ScalarField<f64, D>) -> f64 {
    let (mut apart, mut together) = (0.0, 0.0);
    for (a, b) in a.as_slice().iter().zip(b.as_slice()) {
        apart += (a - b).abs();
        together += a.max(*b);
    }
    apart / together
}

/// One inside of a shape and zero outside, with a boundary of some width, from its signed distance. With that of a cell, it
/// is about the share of the cell around a node that lies inside.
fn indicator<const D: usize>(distance: &ScalarField<f64, D>, width: f64) -> ScalarField<f64, D> {
    let mut indicator = distance.clone();
    for value in indicator.as_mut_slice() {
        *value = (0.5 + *value / width).clamp(0.0, 1.0);
    }
    indicator
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Grid;

    fn between(from: &ScalarField<f64, 3>, to: &ScalarField<f64, 3>) -> Option<Turn<3>> {
        Turn::best(from, to).filter(Turn::clearly_better)
    }

    /// Rotations that map one of the shapes to itself lead to no other pose: every one for a ball, half a turn for a bar.
    #[test]
    fn symmetries_are_no_other_poses() {
        let grid = Grid::<2>::cube(33);
        let cuboid = |x: [f64; 2], low: [f64; 2], high: [f64; 2]| {
            let outside = (0..2).map(|k| (low[k] - x[k]).max(x[k] - high[k]));
            -outside.fold(f64::NEG_INFINITY, f64::max)
        };
        let bracket = ScalarField::from_fn(grid, |x| {
            [cuboid(x, [0.3, 0.3], [0.75, 0.45]).max(cuboid(x, [0.3, 0.3], [0.45, 0.8]))]
        });
        let bar = ScalarField::from_fn(grid, |x| [cuboid(x, [0.2, 0.42], [0.8, 0.58])]);
        let disk = ScalarField::from_fn(grid, |[x, y]| [0.25 - (x - 0.5).hypot(y - 0.5)]);
        for ends in [[&disk, &bracket], [&bracket, &disk], [&bar, &disk]] {
            assert!(Turn::several(ends[0], ends[1], 3).is_empty());
        }
        for ends in [[&bar, &bracket], [&bracket, &bar]] {
            let list = Turn::several(ends[0], ends[1], 3);
            assert!(!list.is_empty());
            let mut known = vec![SMatrix::identity()];
            for turn in list {
                for other in &known {
                    let apart = angle_between(other, turn.motion.rotation());
                    assert!(apart < 0.9 * std::f64::consts::PI, "{apart}");
                }
                known.push(*turn.motion.rotation());
            }
        }
    }

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
            let turn = between(&start, &end).unwrap();
            let apart = angle_between(turn.motion.rotation(), &rotation);
            assert!(apart < 0.05, "{rotation}: {apart}");
            // Small ones are no others than none.
            let several = Turn::several(&start, &end, 3);
            let first = several
                .first()
                .map(|turn| angle_between(turn.motion.rotation(), &rotation));
            assert_eq!(first.is_none(), turn.motion.angle() < APART);
            assert!(
                first.is_none_or(|apart| apart < 0.05),
                "{rotation}: {first:?}"
            );
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
        assert!(between(&start, &start).is_none());
        assert!(Turn::several(&start, &start, 3).is_empty());
        // Sizes do not hide a rotation.
        let right = RigidMotion::from_parts(half_turn, middle - half_turn * middle);
        for scale in [0.75, 1.2] {
            let small = |x: [f64; 3]| bracket(x.map(|x| 0.5 + (x - 0.5) / scale));
            let end = ScalarField::from_fn(grid, |x| [scale * small(right.map_back(x))]);
            let turn = between(&start, &end).unwrap();
            assert!(angle_between(turn.motion.rotation(), &half_turn) < 0.1);
        }
    }
}
