//! Rigid prealignment: moves shapes onto each other before they are compared elastically.
//!
//! Shapes are signed distances on one grid, positive inside. A [`RigidMotion`] maps **input
//! coordinates to aligned coordinates**, `y = R x + t` with a proper rotation `R`: a mirrored
//! shape is never mirrored back.
//!
//! The motion of a shape minimises the squared difference of smoothed indicators
//!
//! `int (H(u(R^T (y - t))) - I(y))^2 dy`,
//!
//! with `H` a compact step of half-width two cells and `I` the indicator of the reference. It has
//! many local minima, so the search uses many starts: the centroids coincide, and the rotation is
//! the identity, one that aligns the principal axes (four in 2D, all 24 proper assignments in 3D,
//! equal moments included), or one of an even covering of all rotations. All starts are scored on a
//! coarse set of nodes; the best distinct ones are refined by Levenberg-Marquardt steps, first on
//! these nodes, then on finer ones. Of equally good motions the one of smallest rotation is chosen.

mod matching;
mod motion;
mod poses;
mod reflection;
mod starts;
mod steepness;

use fe_grid::{Distribution, Field, compiled_once, parallel};
use levelset::{Compact, LevelsetError};
use nalgebra::{SMatrix, SVector};

use matching::{Indicator, Masked, Matching, Pose, thinned};
pub use motion::RigidMotion;
pub use poses::poses;
pub use reflection::mismatches;

/// Nodes a side of the coarse and the fine set of sample nodes. Coarse in 3D, where nodes are
/// many and rotations too.
const COARSE_NODES: [usize; 2] = [65, 21];
const FINE_NODES: [usize; 2] = [257, 49];
/// Number of starts refined on the coarse nodes, and of these on the fine ones.
const N_COARSE: usize = 12;
const N_FINE: usize = 3;
/// Coarse minima whose value exceeds the best one by this factor are not refined further.
const HOPELESS: f64 = 1.5;
/// Rounds in which each shape is aligned to the group's mean; the second seldom changes anything.
const ROUNDS: usize = 2;
/// The rounds end when no shape is turned by more than this angle, in radians.
const SETTLED: f64 = 2e-3;
/// Relative difference up to which two minima count as equal; the smaller rotation is then chosen.
const TIE: f64 = 1e-3;
/// Number of numbers of an alignment in 3D.
const NUMBERS: usize = 13;
/// Half-width of the smoothed indicator, in spacings of the sample nodes.
const HALF_WIDTH: f64 = 2.0;

/// Errors of the alignment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AlignError {
    /// There is no shape to align.
    #[error("there is no shape to align")]
    NoShapes,
    /// The shapes lie on different grids.
    #[error("shape {shape} has a grid of {found:?} nodes, the first one {expected:?}")]
    GridMismatch {
        /// Index of the shape.
        shape: usize,
        /// Nodes of the first shape's grid, `x` first.
        expected: Vec<usize>,
        /// Nodes of this shape's grid, `x` first.
        found: Vec<usize>,
    },
    /// A shape is empty or not finite.
    #[error("shape {shape}: {source}")]
    Shape {
        /// Index of the shape.
        shape: usize,
        /// The cause.
        source: LevelsetError,
    },
    /// The visibility mask of a shape is missing, lies on another grid, or has values outside
    /// `[0, 1]`.
    #[error("shape {shape}: what was seen of it must be given by weights from 0 to 1 on its grid")]
    Masked {
        /// Index of the shape.
        shape: usize,
    },
}

/// The rigid motion found for a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment<const D: usize> {
    /// From input coordinates to aligned coordinates.
    pub motion: RigidMotion<D>,
    /// Remaining mismatch: the squared difference of the indicators divided by the sum of their
    /// squares; 0 for equal shapes, 1 for disjoint ones.
    pub mismatch: f64,
}

compiled_once! {
    /// Computes the rigid motion that maps the shape `moving` onto the shape `reference`, both
    /// given as signed distances on one grid.
    ///
    /// # Errors
    /// [`AlignError`]; the reference is reported as shape 0, the moving one as shape 1.
    pub fn align_to<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<Alignment<D>, AlignError> = align_to_in;
}

fn align_to_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<Alignment<D>, AlignError> {
    let shapes = checked(&[reference, moving], &[])?;
    let target = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    target
        .align(shapes[1], None)
        .map_err(|source| at(1, source))
}

/// Computes the rigid motions that align a group of fully visible shapes, given as signed distances
/// on one grid; see [`align_group_of_visible`].
///
/// # Errors
/// [`AlignError`].
pub fn align_group<const D: usize>(
    shapes: &[&Field<f64, D, 1>],
) -> Result<Vec<Alignment<D>>, AlignError> {
    align_group_of_visible(shapes, &[], &Distribution::alone(shapes.len()))
}

compiled_once! {
    /// Computes the rigid motions that align a group of partially visible shapes, given as signed
    /// distances on one grid. `seen` is empty, or has one visibility mask per shape on the same
    /// grid, 1 where the shape is visible and 0 where it is hidden. The difference is measured
    /// where both a shape and its target are visible. The first shape, preferably a fully visible
    /// one, is the reference and has the identity as its motion.
    ///
    /// All shapes are aligned to the first; then each in turn to the mean of the indicators of all,
    /// so that the result does not depend on peculiarities of the first shape. (This alternation of
    /// mean and motions, generalised Procrustes analysis, never increases the sum of squared
    /// differences from the mean.)
    ///
    /// # Errors
    /// [`AlignError`].
    ///
    /// With a distribution of the shapes to several processes, each aligns its own; all are given all
    /// shapes, and have all motions afterwards. Collective.
    pub fn align_group_of_visible<'a, D>(
        shapes: &'a [&'a Field<f64, D, 1>],
        seen: &'a [&'a Field<f64, D, 1>],
        distribution: &'a Distribution,
    ) -> Result<Vec<Alignment<D>>, AlignError> = align_group_in;
}

fn align_group_in<const D: usize>(
    shapes: &[&Field<f64, D, 1>],
    seen: &[&Field<f64, D, 1>],
    distribution: &Distribution,
) -> Result<Vec<Alignment<D>>, AlignError> {
    let shapes = checked(shapes, seen)?;
    let first = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    let mut found = align_each(&first, &shapes, &vec![None; shapes.len()], distribution)?;
    for _ in 0..if shapes.len() > 2 { ROUNDS } else { 0 } {
        let motions: Vec<_> = found.iter().map(|a| a.motion).collect();
        let mean = Target::new(&shapes, &motions)?;
        let known: Vec<_> = motions.iter().copied().map(Some).collect();
        found = align_each(&mean, &shapes, &known, distribution)?;
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
    shapes: &[Masked<'_, D>],
    motions: &[Option<RigidMotion<D>>],
    distribution: &Distribution,
) -> Result<Vec<Alignment<D>>, AlignError> {
    let own = parallel::try_map(distribution.own(), &|i| {
        let found = target.align(shapes[i], motions[i]).map_err(|e| at(i, e))?;
        Ok(found.to_numbers())
    });
    let all = distribution.share(&own?).into_iter();
    Ok(all.map(Alignment::from_numbers).collect())
}

impl<const D: usize> Alignment<D> {
    /// The mismatch, the translation and the rotation, as numbers that another process understands.
    pub fn to_numbers(self) -> [f64; NUMBERS] {
        let mut numbers = [0.0; NUMBERS];
        let translation = self.motion.translation().iter();
        let motion = translation.chain(self.motion.rotation().iter());
        let all = std::iter::once(&self.mismatch).chain(motion);
        for (number, x) in numbers.iter_mut().zip(all) {
            *number = *x;
        }
        numbers
    }

    /// The inverse of [`Self::to_numbers`].
    pub fn from_numbers([mismatch, motion @ ..]: [f64; NUMBERS]) -> Self {
        let (translation, rotation) = motion.split_at(D);
        let rotation = SMatrix::from_column_slice(&rotation[..D * D]);
        Self {
            motion: RigidMotion::from_parts(rotation, SVector::from_column_slice(translation)),
            mismatch,
        }
    }
}

fn at(shape: usize, source: LevelsetError) -> AlignError {
    AlignError::Shape { shape, source }
}

/// Returns the shapes with their visibility masks, after checking both.
fn checked<'a, const D: usize>(
    shapes: &[&'a Field<f64, D, 1>],
    seen: &[&'a Field<f64, D, 1>],
) -> Result<Vec<Masked<'a, D>>, AlignError> {
    let Some(first) = shapes.first() else {
        return Err(AlignError::NoShapes);
    };
    if !seen.is_empty() && seen.len() != shapes.len() {
        return Err(AlignError::Masked {
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
                return Err(AlignError::Masked { shape: i });
            }
        }
        // A mask that is one everywhere is dropped.
        let weight = weight.filter(|weight| weight.as_slice().iter().any(|&w| w < 1.0));
        list.push(Masked {
            distance: shape,
            weight,
            steepness: steepness::steepness(shape),
        });
    }
    Ok(list)
}

/// The target of an alignment: the mean indicator of some shapes, at two resolutions.
struct Target<const D: usize> {
    coarse: Indicator<D>,
    fine: Indicator<D>,
}

impl<const D: usize> Target<D> {
    /// Computes the mean of shapes under their motions.
    fn new(shapes: &[Masked<'_, D>], motions: &[RigidMotion<D>]) -> Result<Self, AlignError> {
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

    /// Computes the best motion of a shape; `known` is an additional start.
    fn align(
        &self,
        shape: Masked<'_, D>,
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

/// Returns the first poses of a sorted list that differ pairwise by more than an angle.
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
