//! The shapes pushed forward by their deformations, what they have in common, and how well they agree with it.
//!
//! Every process moves and measures its own shapes; the first one collects them.

use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::shapes::Shapes;
use fe_grid::{Distribution, Field, Grid, InverseDeformation, ScalarField, parallel};
use levelset::{BoxEdge, Contour, Hausdorff, LevelsetError, contour, dice_within, hausdorff};

/// If the visible shapes at a point have less total weight than this, all shapes are counted there for the average.
pub const LEAST_VOTE: f64 = 1e-3;
/// Threshold of the visibility mask above which a point counts as visible.
pub(crate) const SEEN: f64 = 0.5;

/// A distance that none is: one of the two shapes has no boundary.
const NO_BOUNDARY: f64 = -1.0;
/// Half-width of the ramp of an indicator, in spacings: both ends of every edge of the grid that the boundary crosses lie
/// within a spacing of it. Between them the indicator is as linear as the distance; a narrower ramp is cut off at one end
/// (one of half a spacing made the area of a rectangle of 36 to 72 spacings 1 % larger). A wider one gives shapes that are
/// not matched a share in where the boundary lies, beside their vote.
const RAMP: f64 = 1.0;
/// Nodes that one thread counts votes at, at least.
const NODES_AT_ONCE: usize = 1024;

/// The pushed-forward shapes of this process.
pub(crate) struct Pushed<const D: usize> {
    /// Signed distances of the whole shapes.
    pub whole: Vec<ScalarField<f64, D>>,
    /// Those of every component, by components; none where there is one.
    pub components: Vec<Vec<ScalarField<f64, D>>>,
    /// Visibility masks; empty if all shapes are fully visible.
    pub seen: Vec<ScalarField<f64, D>>,
}

impl<const D: usize> Pushed<D> {
    /// Moves the shapes of this process by their displacements.
    pub fn new(
        inputs: Shapes<'_, D>,
        shapes: &LevelShapes<D>,
        displacements: &[Field<f64, D, D>],
    ) -> Self {
        let grid = *shapes.grid();
        let far = -grid.extent().iter().fold(0.0f64, |a, &b| a.max(b));
        let own = shapes.distribution().own().zip(displacements).enumerate();
        let moved = parallel::map(own, &|(i, (number, u))| {
            // A cancelled run ends on a coarser grid than that of the inputs.
            let distances = inputs.select([number], |d| d.on_grid(&grid));
            let distances = distances.as_shapes();
            let inverse = InverseDeformation::new(u);
            let push = |distance| inverse.push_forward(distance, far);
            // Outside the box, which is empty, the mask is one.
            let seen = shapes.seen().get(i);
            let seen = seen.map(|seen| inverse.push_forward(seen, 1.0));
            let parts: Vec<_> = distances.parts_of(0).iter().map(push).collect();
            (push(&distances.whole()[0]), parts, seen)
        });
        let n = inputs.n_components();
        let mut components = vec![Vec::new(); if n > 1 { n } else { 0 }];
        let (mut whole, mut seen) = (Vec::new(), Vec::new());
        for (of_shape, parts, mask) in moved {
            whole.push(of_shape);
            seen.extend(mask);
            for (of_component, part) in components.iter_mut().zip(parts) {
                of_component.push(part);
            }
        }
        Self {
            whole,
            components,
            seen,
        }
    }
}

/// What pushed-forward shapes have in common, and how well they agree with it.
pub(crate) struct Common<const D: usize> {
    /// Their weighted mean indicator.
    pub indicator: ScalarField<f64, D>,
    /// Where it is above 1/2.
    pub mask: ScalarField<f64, D>,
    /// Overlap of every shape with the mask.
    pub dice: Vec<f64>,
    /// Distances of their boundaries.
    pub hausdorff: Vec<Option<Hausdorff>>,
}

impl<const D: usize> Common<D> {
    /// Computes the majority of pushed-forward shapes, and the distance of each from it. Shapes and masks are as
    /// [`collected`] returns them. Collective.
    ///
    /// # Errors
    /// Those of the measures.
    pub fn of(
        pushed: &[ScalarField<f64, D>],
        seen: &[ScalarField<f64, D>],
        votes: &[f64],
        grid: &Grid<D>,
        distribution: &Distribution,
    ) -> Result<Self, AverageError> {
        let mut indicator = if distribution.is_first() {
            majority(grid, pushed, seen, votes)
        } else {
            ScalarField::zeros(*grid)
        };
        let communicator = distribution.communicator();
        communicator.broadcast(0, indicator.as_mut_slice());
        let inside = |x: &f64| if *x > 0.5 { 1.0 } else { 0.0 };
        let mask = indicator.as_slice().iter().map(inside).collect();
        let average = contour(&indicator, 0.5, BoxEdge::Open);
        // Those of the first process are the first of all.
        let own = pushed.iter().enumerate().take(distribution.own().len());
        let own = parallel::try_map(own, &|(i, d)| {
            let (dice, distance) = measure(d, &indicator, average.as_ref(), seen.get(i))?;
            let [maximum, percentile, mean] =
                distance.map_or([NO_BOUNDARY; 3], |d| [d.maximum, d.percentile_95, d.mean]);
            Ok::<_, AverageError>([dice, maximum, percentile, mean])
        })?;
        let mut dice = Vec::new();
        let mut distances = Vec::new();
        for [overlap, maximum, percentile_95, mean] in distribution.share(&own) {
            dice.push(overlap);
            distances.push((maximum != NO_BOUNDARY).then_some(Hausdorff {
                maximum,
                percentile_95,
                mean,
            }));
        }
        Ok(Self {
            mask: ScalarField::from_vec(*grid, mask)?,
            indicator,
            dice,
            hausdorff: distances,
        })
    }
}

/// Computes the weighted mean of the indicators of signed distances, each with a ramp about its boundary, so that a
/// tie of two shapes ends half way between their boundaries. At each point the
/// shapes visible there are counted, or all shapes if none is.
fn majority<const D: usize>(
    grid: &Grid<D>,
    pushed: &[ScalarField<f64, D>],
    seen: &[ScalarField<f64, D>],
    weights: &[f64],
) -> ScalarField<f64, D> {
    let slope = 0.5 / (RAMP * grid.spacing());
    let mut mean = ScalarField::zeros(*grid);
    parallel::for_each_mut(mean.as_mut_slice(), NODES_AT_ONCE, &|node, mean| {
        let ramp = |d: &ScalarField<f64, D>| (0.5 + d.as_slice()[node] * slope).clamp(0.0, 1.0);
        let vote = |says: &dyn Fn(usize) -> f64| -> (f64, f64) {
            let votes = pushed.iter().zip(weights).enumerate();
            votes.fold((0.0, 0.0), |(sum, total), (i, (d, w))| {
                (sum + w * says(i) * ramp(d), total + w * says(i))
            })
        };
        let (sum, total) = match seen {
            [] => (0.0, 0.0),
            seen => vote(&|i| seen[i].as_slice()[node]),
        };
        *mean = if total > LEAST_VOTE {
            sum / total
        } else {
            vote(&|_| 1.0).0
        };
    });
    mean
}

/// Measures overlap and distance of a pushed-forward shape and the average on its visible part.
fn measure<const D: usize>(
    pushed: &ScalarField<f64, D>,
    indicator: &ScalarField<f64, D>,
    average: Result<&Contour<D>, &LevelsetError>,
    seen: Option<&ScalarField<f64, D>>,
) -> Result<(f64, Option<Hausdorff>), AverageError> {
    let overlap = match dice_within(pushed, 0.0, indicator, 0.5, seen) {
        // Neither object is visible, or a shape has been pressed into less than a cell and none of the grid's nodes
        // lies inside: the overlap is reported as zero.
        Err(LevelsetError::EmptyObject { .. }) => 0.0,
        found => found?,
    };
    let (Ok(own), Ok(average)) = (contour(pushed, 0.0, BoxEdge::Open), average) else {
        return Ok((overlap, None));
    };
    let distance = match seen {
        None => hausdorff(&own, average),
        Some(seen) => {
            let visible = |whole: &Contour<D>| {
                whole.part(|corners| corners.iter().all(|x| seen.sample(*x)[0] > SEEN))
            };
            hausdorff(&visible(&own), &visible(average))
        }
    };
    Ok((overlap, distance.ok()))
}
