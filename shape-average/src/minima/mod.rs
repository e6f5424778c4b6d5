//! Several minima of the functional: from different starts, told apart, with their curvatures.
//!
//! The functional is not convex in the deformations. A minimiser finds the minimum in whose valley it
//! begins; whether there is another one, lower or as low, shows only from other starts. [`starts`] makes
//! them, [`Minima`] collects where they end.

mod curvature;
mod rigid;
mod starts;

use crate::align::align_to;
use crate::error::AverageError;
use crate::params::AverageParams;
use crate::result::AverageResult;
use fe_grid::minimise::{Curvature, Status};
use fe_grid::{Field, ScalarField};
use levelset::{BoxEdge, Cause, Contour, Doubt, Hausdorff, contour, hausdorff, signed_distance};
use serde::Serialize;

pub use starts::{Start, StartKind, starts};

/// States closer than this, see [`Minimum::state_distance`], are one minimum.
const SAME_STATE: f64 = 0.03;
/// Of states in one minimum the first is kept, unless another one's energy is lower by more than this
/// share of the elastic energy: the minimiser's own limit of the remaining energy.
const RESOLVED: f64 = 0.01;
/// Averages whose boundaries are farther apart than this many spacings somewhere, in their best common
/// position, have different shapes.
const SAME_SHAPE: f64 = 1.0;

/// A minimum that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Minimum {
    /// The functional.
    pub energy: f64,
    /// Weighted elastic energy.
    pub elastic: f64,
    /// Weighted mismatch.
    pub mismatch: f64,
    /// Weighted interface length.
    pub length: f64,
    /// The energy above that of the lowest minimum, relative to the elastic energy of that one.
    pub excess: f64,
    /// `None` where it could not be computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_eigenvalue: Option<Curvature>,
    /// Starts that ended here, from 1.
    pub starts: Vec<usize>,
    /// How the minimiser ended.
    pub status: Status,
    /// Distance from the lowest minimum: of the positions to which the points of all objects are mapped,
    /// root mean square, relative to the size of the average, after the rigid motion of all shapes
    /// together that makes it least. Minima with averages of the same shape may have other
    /// correspondences.
    pub state_distance: f64,
    /// Distance of the boundary of the average from that of the lowest minimum, in the position that
    /// aligns the two. `None` at the lowest itself, and if one has no boundary.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub boundary_distance: Option<Hausdorff>,
    /// Whether the average has another shape than that of the lowest minimum.
    pub other_shape: bool,
}

/// What is kept of a minimum.
struct Kept<const D: usize> {
    minimum: Minimum,
    displacements: Vec<Field<f64, D, D>>,
    /// The average: 1 inside.
    indicator: ScalarField<f64, D>,
}

/// The minima of an average found so far.
pub struct Minima<'a, const D: usize> {
    params: &'a AverageParams,
    kept: Vec<Kept<D>>,
    /// The lowest result, and its place in the list.
    lowest: Option<(usize, AverageResult<D>)>,
    starts: usize,
}

impl<'a, const D: usize> Minima<'a, D> {
    /// Creates an empty collection for averages with these parameters.
    pub fn new(params: &'a AverageParams) -> Self {
        Self {
            params,
            kept: Vec::new(),
            lowest: None,
            starts: 0,
        }
    }

    /// Adds the result from the next start. One that ends in a known minimum is counted there; the first
    /// result of a minimum is kept, unless a later one is lower by more than a hundredth of the elastic
    /// energy. Cancelled results are not minima, and kept only where there is no other. Returns whether the
    /// result is the lowest now.
    ///
    /// # Errors
    /// Those of the functional.
    pub fn add(&mut self, result: AverageResult<D>) -> Result<bool, AverageError> {
        self.starts += 1;
        let last = result.levels.last().map(|level| level.status);
        if last == Some(Status::Cancelled) {
            let first = self.lowest.is_none();
            if first {
                self.lowest = Some((usize::MAX, result));
            }
            return Ok(first);
        }
        let weights = self.params.resolved_weights(result.displacements.len());
        let known = self.kept.iter().position(|kept| {
            let states = (&result.displacements[..], &kept.displacements[..]);
            rigid::state_distance(&result.shapes, &weights, states.0, states.1) <= SAME_STATE
        });
        let [elastic, mismatch, length] = result.energy.parts;
        let energy = result.energy.total;
        let starts = match known {
            None => vec![self.starts],
            Some(place) => {
                let minimum = &mut self.kept[place].minimum;
                minimum.starts.push(self.starts);
                if energy >= minimum.energy - RESOLVED * result.energy.elastic_scale() {
                    return Ok(false);
                }
                minimum.starts.clone()
            }
        };
        let curvature = curvature::at(&result, self.params, &weights)?;
        let new = Kept {
            minimum: Minimum {
                energy,
                elastic,
                mismatch,
                length,
                excess: 0.0,
                least_eigenvalue: curvature,
                starts,
                status: result.status,
                state_distance: 0.0,
                boundary_distance: None,
                other_shape: false,
            },
            displacements: result.displacements.clone(),
            indicator: result.average_indicator.clone(),
        };
        let place = known.unwrap_or(self.kept.len());
        if place < self.kept.len() {
            self.kept[place] = new;
        } else {
            self.kept.push(new);
        }
        // Of minima that the minimiser cannot tell apart by their energies the first is the result, which
        // is that of the usual start if it is one of them.
        let lower = self.lowest.as_ref().is_none_or(|(_, lowest)| {
            energy < lowest.energy.total - RESOLVED * lowest.energy.elastic_scale()
        });
        if lower {
            self.lowest = Some((place, result));
        }
        Ok(lower)
    }

    /// The lowest result and all minima, its own first and then by their energies, with their distances from
    /// it. Of minima whose energies differ by less than a hundredth of the elastic energy, the first that was
    /// added counts as the lowest. `None` if nothing was added.
    ///
    /// # Errors
    /// Those of the alignment of averages.
    pub fn finish(self) -> Result<Option<(AverageResult<D>, Vec<Minimum>)>, AverageError> {
        let Some((place, lowest)) = self.lowest else {
            return Ok(None);
        };
        let weights = self.params.resolved_weights(lowest.displacements.len());
        let mut list: Vec<Minimum> = Vec::with_capacity(self.kept.len());
        let mut chosen = None;
        let best = self.kept.get(place).map(|kept| kept.minimum.energy);
        let outline = Outline::of(&lowest.average_indicator);
        for (i, kept) in self.kept.into_iter().enumerate() {
            let mut minimum = kept.minimum;
            if let Some(best) = best.filter(|_| i != place) {
                minimum.excess = (minimum.energy - best) / lowest.energy.elastic_scale();
                let states = (&kept.displacements[..], &lowest.displacements[..]);
                minimum.state_distance =
                    rigid::state_distance(&lowest.shapes, &weights, states.0, states.1);
                minimum.boundary_distance = match (&outline, Outline::of(&kept.indicator)) {
                    (Some(lowest), Some(own)) => own.distance(lowest)?,
                    _ => None,
                };
                let spacing = lowest.average.grid().spacing();
                minimum.other_shape = minimum
                    .boundary_distance
                    .is_none_or(|distance| distance.maximum > SAME_SHAPE * spacing);
            }
            if i == place {
                chosen = Some(minimum);
            } else {
                list.push(minimum);
            }
        }
        list.sort_by(|a, b| a.energy.total_cmp(&b.energy));
        list.splice(0..0, chosen);
        Ok(Some((lowest, list)))
    }
}

/// The doubts about a list of minima, the lowest first: another one of almost the same energy whose average
/// has another shape, and a lowest one that is a saddle point.
pub fn doubts(minima: &[Minimum]) -> Vec<Doubt> {
    let others = minima.iter().skip(1).filter(|m| m.other_shape);
    let nearest = others.map(|m| m.excess).min_by(f64::total_cmp);
    let ambiguous = nearest.and_then(|excess| Doubt::check(Cause::Ambiguous, excess));
    let curvature = minima.first().and_then(|lowest| lowest.least_eigenvalue);
    let saddle = curvature.as_ref().and_then(Doubt::saddle);
    ambiguous.into_iter().chain(saddle).collect()
}

/// The boundary of an average.
struct Outline<const D: usize> {
    distance: ScalarField<f64, D>,
    contour: Contour<D>,
}

impl<const D: usize> Outline<D> {
    /// `None` for an average without a boundary.
    fn of(indicator: &ScalarField<f64, D>) -> Option<Self> {
        Some(Self {
            distance: signed_distance(indicator, 0.5).ok()?,
            contour: contour(indicator, 0.5, BoxEdge::Closed).ok()?,
        })
    }

    /// The distance from another boundary, in the best position.
    fn distance(&self, other: &Self) -> Result<Option<Hausdorff>, AverageError> {
        let motion = align_to(&other.distance, &self.distance)?.motion;
        Ok(hausdorff(&motion.apply_to_contour(&self.contour), &other.contour).ok())
    }
}
