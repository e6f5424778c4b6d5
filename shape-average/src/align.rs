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
//!
//! A symmetric reference fits several poses of a shape equally well. Of a group the poses are then
//! chosen together: those that fit each other best.
//!
//! Of shapes of several components, such as labels, the differences of all components are added.

mod agreement;
mod indicator;
mod matching;
mod poses;
mod reflection;
mod starts;
mod steepness;

use fe_grid::{Distribution, Field, compiled_once, parallel};
use levelset::{Compact, LevelsetError};
use nalgebra::{SMatrix, SVector};

use indicator::{Indicator, Masked};
pub use levelset::RigidMotion;
use matching::{Matching, Pose};
pub use poses::poses;
pub use reflection::{mismatches, reflected_mismatch};

/// Nodes a side of the coarse and the fine set of sample nodes. Coarse in 3D, where nodes are
/// many and rotations too.
const COARSE_NODES: [usize; 2] = [65, 21];
const FINE_NODES: [usize; 2] = [257, 49];
/// Number of starts refined on the coarse nodes, and of these on the fine ones.
const N_COARSE: usize = 12;
/// Coarse minima whose value exceeds the best one by this factor are not refined further.
const HOPELESS: f64 = 1.5;
/// Number of good poses of each shape among which those of a group are chosen.
const N_GROUP: usize = 6;
/// Rounds in which each shape is aligned to the group's mean; the second seldom changes anything.
const ROUNDS: usize = 2;
/// The rounds end when no shape is turned by more than this angle, in radians.
const SETTLED: f64 = 2e-3;
/// Two minima count as equal, and the smaller rotation is chosen, where their mismatches differ by no more than
/// `NOISE` and `TIE` times the smaller one, or twice `NOISE`: masks of one ellipsoid with voxels of a tenth to two
/// fifths of its axes have mismatches of .004 to .03, and its four equal poses differ by up to .0018.
const TIE: f64 = 0.15;
/// See [`TIE`].
const NOISE: f64 = 1e-3;
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
    /// The shapes have different numbers of components.
    #[error("shape {shape} has {found} components, the first one {expected}")]
    Components {
        /// Index of the shape.
        shape: usize,
        /// Number of components of the first shape.
        expected: usize,
        /// Number of components of this shape.
        found: usize,
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

compiled_once! {
    /// Computes the rigid motions by which one shape fits another one well: that of [`align_to`] first, then those
    /// whose mismatch is at most half as much again, the least one first; at most six.
    ///
    /// # Errors
    /// As for [`align_to`].
    pub fn good_alignments<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<Vec<Alignment<D>>, AlignError> = good_alignments_in;
}

fn align_to_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<Alignment<D>, AlignError> {
    Ok(good_alignments_in(reference, moving)?[0])
}

fn good_alignments_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<Vec<Alignment<D>>, AlignError> {
    let shapes = checked(&[reference, moving], &[])?;
    let target = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    let fits = target.fits(&shapes[1], None);
    fits.map_err(|source| at(1, source))
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
    align_masked(&checked(shapes, seen)?, distribution)
}

compiled_once! {
    /// Computes the rigid motions that align a group of shapes of several components each, as
    /// [`align_group_of_visible`] does; the differences of all components are added.
    ///
    /// # Errors
    /// [`AlignError`], with the number of the shape.
    pub fn align_group_of_components<'a, D>(
        shapes: &'a [&'a [Field<f64, D, 1>]],
        distribution: &'a Distribution,
    ) -> Result<Vec<Alignment<D>>, AlignError> = align_components_in;
}

compiled_once! {
    /// Computes the rigid motion that maps a shape of several components onto another one, as [`align_to`] does: the
    /// differences of all components are added.
    ///
    /// # Errors
    /// [`AlignError`]; the reference is reported as shape 0, the moving one as shape 1.
    pub fn align_components_to<'a, D>(
        reference: &'a [Field<f64, D, 1>],
        moving: &'a [Field<f64, D, 1>],
    ) -> Result<Alignment<D>, AlignError> = align_components_to_in;
}

fn align_components_to_in<const D: usize>(
    reference: &[Field<f64, D, 1>],
    moving: &[Field<f64, D, 1>],
) -> Result<Alignment<D>, AlignError> {
    let [reference, moving] = &with_components(&[reference, moving])?[..] else {
        return Err(AlignError::NoShapes);
    };
    let target = Target::new(std::slice::from_ref(reference), &[RigidMotion::identity()])?;
    let fits = target.fits(moving, None);
    Ok(fits.map_err(|source| at(1, source))?[0])
}

fn align_components_in<const D: usize>(
    shapes: &[&[Field<f64, D, 1>]],
    distribution: &Distribution,
) -> Result<Vec<Alignment<D>>, AlignError> {
    align_masked(&with_components(shapes)?, distribution)
}

/// Returns shapes given by the signed distances of their components, after checking these.
fn with_components<'a, const D: usize>(
    shapes: &[&'a [Field<f64, D, 1>]],
) -> Result<Vec<Masked<'a, D>>, AlignError> {
    let expected = shapes.first().map_or(0, |components| components.len());
    let other = shapes
        .iter()
        .position(|components| components.len() != expected);
    if let Some(shape) = other {
        let found = shapes[shape].len();
        return Err(AlignError::Components {
            shape,
            expected,
            found,
        });
    }
    let all: Vec<_> = shapes.iter().flat_map(|components| *components).collect();
    check(&all, &[], expected)?;
    let shapes = shapes
        .iter()
        .map(|components| Masked::new(*components, None));
    Ok(shapes.collect())
}

fn align_masked<const D: usize>(
    shapes: &[Masked<'_, D>],
    distribution: &Distribution,
) -> Result<Vec<Alignment<D>>, AlignError> {
    let first = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    let mut fits = align_each(&first, shapes, &vec![None; shapes.len()], distribution)?;
    // The reference stays as it is.
    fits[0].truncate(1);
    let mut found = first.agree(shapes, &fits)?;
    for _ in 0..if shapes.len() > 2 { ROUNDS } else { 0 } {
        let motions: Vec<_> = found.iter().map(|a| a.motion).collect();
        let mean = Target::new(shapes, &motions)?;
        let known: Vec<_> = motions.iter().copied().map(Some).collect();
        let fits = align_each(&mean, shapes, &known, distribution)?;
        found = fits.iter().map(|fits| fits[0]).collect();
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

/// Returns the good motions of every shape, the preferred one first. Each process computes those of its own
/// shapes.
fn align_each<const D: usize>(
    target: &Target<D>,
    shapes: &[Masked<'_, D>],
    motions: &[Option<RigidMotion<D>>],
    distribution: &Distribution,
) -> Result<Vec<Vec<Alignment<D>>>, AlignError> {
    let own = parallel::try_map(distribution.own(), &|i| {
        let fits = target.fits(&shapes[i], motions[i]);
        let fits = fits.map_err(|source| at(i, source))?;
        let mut numbers = [[0.0; NUMBERS]; N_GROUP];
        for (numbers, fit) in numbers.iter_mut().zip(&fits) {
            *numbers = fit.to_numbers();
        }
        Ok((fits.len().min(N_GROUP), numbers))
    });
    let own = own?;
    let counts: Vec<[f64; 1]> = own.iter().map(|(n, _)| [*n as f64]).collect();
    let counts = distribution.share(&counts);
    let mut fits = vec![Vec::with_capacity(N_GROUP); shapes.len()];
    for place in 0..N_GROUP {
        let own: Vec<_> = own.iter().map(|(_, numbers)| numbers[place]).collect();
        let all = distribution.share(&own);
        for ((fits, numbers), [n]) in fits.iter_mut().zip(all).zip(&counts) {
            if place < *n as usize {
                fits.push(Alignment::from_numbers(numbers));
            }
        }
    }
    Ok(fits)
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
    check(shapes, seen, 1)?;
    let masked = shapes.iter().enumerate().map(|(i, shape)| {
        let weight = seen.get(i).copied();
        // A mask that is one everywhere is dropped.
        let weight = weight.filter(|weight| weight.as_slice().iter().any(|&w| w < 1.0));
        Masked::new([*shape], weight)
    });
    Ok(masked.collect())
}

/// Checks signed distances, a number of `components` for every shape, and visibility masks.
fn check<const D: usize>(
    distances: &[&Field<f64, D, 1>],
    seen: &[&Field<f64, D, 1>],
    components: usize,
) -> Result<(), AlignError> {
    let Some(first) = distances.first() else {
        return Err(AlignError::NoShapes);
    };
    if !seen.is_empty() && seen.len() != distances.len() {
        return Err(AlignError::Masked {
            shape: seen.len().min(distances.len()),
        });
    }
    for (i, distance) in distances.iter().enumerate() {
        let shape = i / components.max(1);
        if distance.grid() != first.grid() {
            return Err(AlignError::GridMismatch {
                shape,
                expected: first.grid().nodes_per_axis().to_vec(),
                found: distance.grid().nodes_per_axis().to_vec(),
            });
        }
        if let Some(bad) = distance.as_slice().iter().position(|v| !v.is_finite()) {
            let node = distance.grid().node(bad).to_vec();
            let value = distance.as_slice()[bad];
            return Err(at(shape, LevelsetError::NonFinite { node, value }));
        }
        if let Some(weight) = seen.get(i) {
            let inside = |w: &f64| (0.0..=1.0).contains(w);
            if weight.grid() != first.grid() || !weight.as_slice().iter().all(inside) {
                return Err(AlignError::Masked { shape });
            }
        }
    }
    Ok(())
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
        let moved: Vec<_> = shapes.iter().zip(motions.iter().copied()).collect();
        let mean = |n_nodes: usize| -> Result<Indicator<D>, LevelsetError> {
            let nodes = shapes[0].parts[0].distance.grid().thinned(n_nodes - 1)?;
            let step = Compact::new(HALF_WIDTH * nodes.spacing())?;
            Indicator::mean(&moved, nodes, step)
        };
        let mean = |n_nodes| mean(n_nodes).map_err(|e| at(0, e));
        Ok(Self {
            coarse: mean(COARSE_NODES[dim])?,
            fine: mean(FINE_NODES[dim])?,
        })
    }

    /// Computes the motions of a shape that fit well, at most [`N_GROUP`]: the preferred one first, then by
    /// their mismatch. `known` is an additional start.
    ///
    /// The preferred one is, of those that fit best but for the noise of masks, the one of smallest
    /// rotation, or the nearest to the known one.
    fn fits(
        &self,
        shape: &Masked<'_, D>,
        known: Option<RigidMotion<D>>,
    ) -> Result<Vec<Alignment<D>>, LevelsetError> {
        let coarse = Matching::new(&self.coarse, shape)?;
        let preferred = match known {
            Some(motion) => coarse.pose(&motion),
            None => coarse.centred(SMatrix::identity()),
        };
        let scored = scored(&coarse);
        let separation = starts::SEPARATION[usize::from(D == 3)];
        let chosen = distinct(Some(preferred), &scored, separation, N_COARSE + 1);
        let mut refined = parallel::map(&chosen, &|pose| coarse.refine(pose));
        let start = refined[0];
        refined.sort_by(|a, b| a.0.total_cmp(&b.0));
        let worst = HOPELESS * refined[0].0 + coarse.absolute(NOISE);
        let start = (start.0 <= worst).then_some(start.1);
        refined.retain(|r| r.0 <= worst);
        let chosen = distinct(start, &refined, separation, N_GROUP);
        let fine = Matching::new(&self.fine, shape)?;
        let mut refined = parallel::map(&chosen, &|pose| fine.refine(pose));
        let least = refined.iter().map(|r| r.0).fold(f64::INFINITY, f64::min);
        let noise = fine.absolute(NOISE);
        let best = least + noise + (TIE * least).min(noise);
        let tied = |value: f64| value <= best;
        refined.sort_by(|a, b| {
            let away = |pose: &Pose<D>| pose.angle_to(&preferred);
            match (tied(a.0), tied(b.0)) {
                (true, true) => away(&a.1).total_cmp(&away(&b.1)),
                (true, false) => std::cmp::Ordering::Less,
                (false, true) => std::cmp::Ordering::Greater,
                (false, false) => a.0.total_cmp(&b.0),
            }
        });
        let worst = HOPELESS * least + noise;
        refined.retain(|r| r.0 <= worst);
        let fits = refined.iter().map(|(value, pose)| Alignment {
            motion: fine.motion(pose),
            mismatch: fine.relative(*value),
        });
        Ok(fits.collect())
    }

    /// Chooses one of the good motions of every shape, such that the shapes fit each other best.
    fn agree(
        &self,
        shapes: &[Masked<'_, D>],
        fits: &[Vec<Alignment<D>>],
    ) -> Result<Vec<Alignment<D>>, AlignError> {
        let motions: Vec<Vec<RigidMotion<D>>> = fits
            .iter()
            .map(|fits| fits.iter().map(|fit| fit.motion).collect())
            .collect();
        let (nodes, step) = (*self.coarse.nodes(), self.coarse.step);
        let chosen = agreement::choose(shapes, &motions, nodes, step)?;
        let found = fits.iter().zip(chosen).map(|(fits, choice)| fits[choice]);
        Ok(found.collect())
    }
}

/// Returns the starts of a search with their differences, the least one first.
fn scored<const D: usize>(matching: &Matching<'_, D>) -> Vec<(f64, Pose<D>)> {
    let mut scored = parallel::map(starts::rotations(matching), &|rotation| {
        let pose = matching.centred(rotation);
        (matching.difference(&pose), pose)
    });
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    scored
}

/// Returns a pose, if any, and the first ones of a sorted list, at most `n_most`, that differ pairwise by more
/// than an angle.
fn distinct<const D: usize>(
    first: Option<Pose<D>>,
    sorted: &[(f64, Pose<D>)],
    separation: f64,
    n_most: usize,
) -> Vec<Pose<D>> {
    let mut chosen: Vec<Pose<D>> = first.into_iter().collect();
    for (_, pose) in sorted {
        if chosen.len() < n_most && chosen.iter().all(|other| pose.angle_to(other) > separation) {
            chosen.push(*pose);
        }
    }
    chosen
}
