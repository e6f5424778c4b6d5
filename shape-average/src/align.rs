//! Rigid prealignment: shapes moved onto each other before they are compared elastically.
//!
//! Shapes are signed distances on one grid, positive inside. A [`RigidMotion`] maps **input
//! coordinates to aligned coordinates**, `y = R x + t` with a proper rotation `R`: a mirrored
//! shape is never mirrored back.
//!
//! The motion of a shape minimises the squared difference of smoothed indicators
//!
//! `int (H(u(R^T (y - t))) - I(y))^2 dy`,
//!
//! with `H` a compact step of half-width two cells and `I` the indicator of the reference. Its
//! many local minima are met by many starts: centroid on centroid, with the rotations that
//! bring principal axes onto each other (four in 2D, all 24 proper assignments in 3D, equal
//! moments included), none at all, and an even covering of all rotations. All are scored on a
//! coarse set of nodes; the best distinct ones are refined by Levenberg-Marquardt steps, first
//! there, then on finer nodes. Among equally good ones the smallest rotation wins.

mod matching;
mod motion;
mod starts;

use fe_grid::Field;
use fe_grid::{compiled_once, parallel};
use levelset::{Compact, LevelsetError};

use matching::{Indicator, Matching, Pose, Seen, thinned};
pub use motion::RigidMotion;

/// Nodes a side of the coarse and the fine set of sample nodes. Coarse in 3D, where nodes are
/// many and rotations too.
const COARSE_NODES: [usize; 2] = [65, 21];
const FINE_NODES: [usize; 2] = [257, 49];
/// Starts refined on the coarse nodes, and of these on the fine ones.
const N_COARSE: usize = 12;
const N_FINE: usize = 3;
/// Coarse minima this many times worse than the best one are not refined further.
const HOPELESS: f64 = 1.5;
/// Rounds of a group against its mean; the second seldom moves anything.
const ROUNDS: usize = 2;
/// A round that turns no shape by more than this, in radians, is the last.
const SETTLED: f64 = 2e-3;
/// Differences within this share count as equal, and the smaller rotation is taken.
const TIE: f64 = 1e-3;
/// Half-width of the smoothed indicator, in spacings of the sample nodes.
const HALF_WIDTH: f64 = 2.0;

/// Errors of the alignment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AlignError {
    /// Nothing to align.
    #[error("there is no shape to align")]
    NoShapes,
    /// Shapes on different grids.
    #[error("shape {shape} has a grid of {found:?} nodes, the first one {expected:?}")]
    GridMismatch {
        /// Position of the shape.
        shape: usize,
        /// Nodes of the first shape's grid, `x` first.
        expected: Vec<usize>,
        /// Nodes of this shape's grid, `x` first.
        found: Vec<usize>,
    },
    /// A shape that is empty or not finite.
    #[error("shape {shape}: {source}")]
    Shape {
        /// Position of the shape.
        shape: usize,
        /// What is wrong with it.
        source: LevelsetError,
    },
    /// What was seen of a shape is missing, on another grid, or not given by weights.
    #[error("shape {shape}: what was seen of it must be given by weights from 0 to 1 on its grid")]
    Seen {
        /// Position of the shape.
        shape: usize,
    },
}

/// The motion found for a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment<const D: usize> {
    /// From input coordinates to aligned coordinates.
    pub motion: RigidMotion<D>,
    /// What is left: the squared difference of the indicators over the sum of their squares, 0
    /// for equal shapes, 1 for disjoint ones.
    pub mismatch: f64,
}

compiled_once! {
    /// The motion that brings the shape `moving` onto the shape `reference`, both given as signed
    /// distances on one grid.
    ///
    /// # Errors
    /// [`AlignError`]; the reference counts as shape 0, the moving one as shape 1.
    pub fn align_to<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<Alignment<D>, AlignError> = aligned;
}

fn aligned<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<Alignment<D>, AlignError> {
    let shapes = checked(&[reference, moving], &[])?;
    let target = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    target
        .align(shapes[1], None)
        .map_err(|source| at(1, source))
}

/// The motions that bring a group of shapes onto each other, given as signed distances on one grid:
/// [`align_group_of_seen`] where everything was seen.
///
/// # Errors
/// [`AlignError`].
pub fn align_group<const D: usize>(
    shapes: &[&Field<f64, D, 1>],
) -> Result<Vec<Alignment<D>>, AlignError> {
    align_group_of_seen(shapes, &[])
}

compiled_once! {
    /// The motions that bring a group of shapes onto each other, given as signed distances on one
    /// grid, of which not everything was seen: `seen` has none, or one field a shape on the same
    /// grid, 1 where it was seen and 0 where it was not. The difference is that of what was seen of
    /// both a shape and what it is moved onto. The first shape, best one that was seen whole, stays
    /// where it is, with the identity as its motion.
    ///
    /// All shapes are aligned to the first; then each in turn to the mean of the indicators of all,
    /// so that what the first shape lacks or has too much of does not decide. (This alternation of
    /// mean and motions, generalised Procrustes analysis, never increases the sum of squared
    /// differences from the mean.)
    ///
    /// # Errors
    /// [`AlignError`].
    pub fn align_group_of_seen<'a, D>(
        shapes: &'a [&'a Field<f64, D, 1>],
        seen: &'a [&'a Field<f64, D, 1>],
    ) -> Result<Vec<Alignment<D>>, AlignError> = aligned_group;
}

fn aligned_group<const D: usize>(
    shapes: &[&Field<f64, D, 1>],
    seen: &[&Field<f64, D, 1>],
) -> Result<Vec<Alignment<D>>, AlignError> {
    let shapes = checked(shapes, seen)?;
    let first = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    let mut found = align_each(&first, &shapes, &vec![None; shapes.len()])?;
    for _ in 0..if shapes.len() > 2 { ROUNDS } else { 0 } {
        let motions: Vec<_> = found.iter().map(|a| a.motion).collect();
        let mean = Target::new(&shapes, &motions)?;
        let known: Vec<_> = motions.iter().copied().map(Some).collect();
        found = align_each(&mean, &shapes, &known)?;
        let turns = found.iter().zip(&motions);
        if turns.fold(0.0, |t, (a, m)| {
            f64::max(t, a.motion.after(&m.inverse()).angle())
        }) < SETTLED
        {
            break;
        }
    }
    let back = found[0].motion.inverse();
    for alignment in &mut found {
        alignment.motion = back.after(&alignment.motion);
    }
    found[0].motion = RigidMotion::identity();
    Ok(found)
}

fn align_each<const D: usize>(
    target: &Target<D>,
    shapes: &[Seen<'_, D>],
    motions: &[Option<RigidMotion<D>>],
) -> Result<Vec<Alignment<D>>, AlignError> {
    let shapes = shapes.iter().zip(motions).enumerate();
    parallel::try_map(shapes, &|(i, (shape, known))| {
        target.align(*shape, *known).map_err(|e| at(i, e))
    })
}

fn at(shape: usize, source: LevelsetError) -> AlignError {
    AlignError::Shape { shape, source }
}

/// The shapes with what was seen of them, after a look at both.
fn checked<'a, const D: usize>(
    shapes: &[&'a Field<f64, D, 1>],
    seen: &[&'a Field<f64, D, 1>],
) -> Result<Vec<Seen<'a, D>>, AlignError> {
    let Some(first) = shapes.first() else {
        return Err(AlignError::NoShapes);
    };
    if !seen.is_empty() && seen.len() != shapes.len() {
        return Err(AlignError::Seen {
            shape: seen.len().min(shapes.len()),
        });
    }
    let mut list = Vec::with_capacity(shapes.len());
    for (i, shape) in shapes.iter().enumerate() {
        if shape.grid() != first.grid() {
            return Err(AlignError::GridMismatch {
                shape: i,
                expected: first.grid().nodes_per_axis().to_vec(),
                found: shape.grid().nodes_per_axis().to_vec(),
            });
        }
        if let Some(bad) = shape.as_slice().iter().position(|v| !v.is_finite()) {
            let node = shape.grid().node(bad).to_vec();
            let value = shape.as_slice()[bad];
            return Err(at(i, LevelsetError::NonFinite { node, value }));
        }
        let weight = seen.get(i).copied();
        if let Some(weight) = weight {
            let inside = |w: &f64| (0.0..=1.0).contains(w);
            if weight.grid() != first.grid() || !weight.as_slice().iter().all(inside) {
                return Err(AlignError::Seen { shape: i });
            }
        }
        // Where all was seen nobody has to look.
        let weight = weight.filter(|weight| weight.as_slice().iter().any(|&w| w < 1.0));
        list.push(Seen {
            distance: shape,
            weight,
        });
    }
    Ok(list)
}

/// What shapes are aligned to: the mean indicator of some shapes, at two resolutions.
struct Target<const D: usize> {
    coarse: Indicator<D>,
    fine: Indicator<D>,
}

impl<const D: usize> Target<D> {
    /// The mean of shapes under their motions.
    fn new(shapes: &[Seen<'_, D>], motions: &[RigidMotion<D>]) -> Result<Self, AlignError> {
        let dim = usize::from(D == 3);
        let moved: Vec<_> = shapes.iter().zip(motions).map(|(s, m)| (*s, *m)).collect();
        let mean = |n_nodes: usize| -> Result<Indicator<D>, LevelsetError> {
            let nodes = thinned(shapes[0].distance.grid(), n_nodes)?;
            let step = Compact::new(HALF_WIDTH * nodes.spacing())?;
            Indicator::mean(&moved, nodes, step)
        };
        let mean = |n_nodes| mean(n_nodes).map_err(|e| at(0, e));
        Ok(Self {
            coarse: mean(COARSE_NODES[dim])?,
            fine: mean(FINE_NODES[dim])?,
        })
    }

    /// The best motion of a shape; `known` is a motion to start from besides all others.
    fn align(
        &self,
        shape: Seen<'_, D>,
        known: Option<RigidMotion<D>>,
    ) -> Result<Alignment<D>, LevelsetError> {
        let coarse = Matching::new(&self.coarse, shape)?;
        let mut scored: Vec<(f64, Pose<D>)> = starts::rotations(&coarse)
            .into_iter()
            .map(|rotation| coarse.centred(rotation))
            .chain(known.map(|m| coarse.pose(&m)))
            .map(|pose| (coarse.difference(&pose), pose))
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let chosen = distinct(&scored, starts::SEPARATION, N_COARSE);
        let mut refined: Vec<_> = chosen.iter().map(|pose| coarse.refine(pose)).collect();
        refined.sort_by(|a, b| a.0.total_cmp(&b.0));
        let worst = HOPELESS * refined[0].0;
        refined.retain(|r| r.0 <= worst);
        let chosen = distinct(&refined, starts::SEPARATION, N_FINE);
        let fine = Matching::new(&self.fine, shape)?;
        let refined: Vec<_> = chosen.iter().map(|pose| fine.refine(pose)).collect();
        let least = refined.iter().map(|r| r.0).fold(f64::INFINITY, f64::min);
        let best = refined
            .iter()
            .filter(|r| r.0 <= least * (1.0 + TIE) + f64::MIN_POSITIVE)
            .min_by(|a, b| a.1.turn().total_cmp(&b.1.turn()))
            .unwrap_or(&refined[0]);
        Ok(Alignment {
            motion: fine.motion(&best.1),
            mismatch: fine.relative(best.0),
        })
    }
}

/// The first poses of a sorted list of which no two are within an angle of each other.
fn distinct<const D: usize>(
    sorted: &[(f64, Pose<D>)],
    separation: [f64; 2],
    n_most: usize,
) -> Vec<Pose<D>> {
    let least = separation[usize::from(D == 3)];
    let mut chosen: Vec<Pose<D>> = Vec::new();
    for (_, pose) in sorted {
        if chosen.len() < n_most && chosen.iter().all(|other| pose.angle_to(other) > least) {
            chosen.push(*pose);
        }
    }
    chosen
}
