//! Shapes of one or several components, and their smoothed indicators on coarser grids.

use fe_grid::vector::axpy;
use fe_grid::{Field, Grid};
use levelset::{Compact, Continued, LevelsetError, Moments, RigidMotion};

use super::steepness::steepness;

/// Weight below which a mean counts as unknown.
const LEAST_WEIGHT: f64 = 1e-3;
/// One of the components of a shape.
pub(super) struct Part<'a, const D: usize> {
    /// Its signed distance.
    pub(super) distance: Continued<'a, D>,
    /// The largest rate at which its distance changes.
    pub(super) steepness: f64,
}

/// A shape of one or several components, and its visibility mask.
pub(super) struct Masked<'a, const D: usize> {
    pub(super) parts: Vec<Part<'a, D>>,
    /// Visibility mask, from 1 (visible) to 0 (hidden); `None` if all of the shape is visible.
    weight: Option<&'a Field<f64, D, 1>>,
}

impl<'a, const D: usize> Masked<'a, D> {
    pub(super) fn new(
        components: impl IntoIterator<Item = &'a Field<f64, D, 1>>,
        weight: Option<&'a Field<f64, D, 1>>,
    ) -> Self {
        let parts = components.into_iter().map(|distance| Part {
            distance: Continued::new(distance),
            steepness: steepness(distance),
        });
        Self {
            parts: parts.collect(),
            weight,
        }
    }

    pub(super) fn is_masked(&self) -> bool {
        self.weight.is_some()
    }
}

impl<const D: usize> Masked<'_, D> {
    /// Returns the visibility of a point, as a weight. It is one outside the box, which is empty.
    pub(super) fn weight(&self, x: &[f64; D]) -> f64 {
        let Some(weight) = self.weight else {
            return 1.0;
        };
        let extent = weight.grid().extent();
        if (0..D).all(|k| (0.0..=extent[k]).contains(&x[k])) {
            weight.sample(*x)[0]
        } else {
            1.0
        }
    }
}

/// The smoothed indicators of a target's components at the sample nodes of a coarser grid.
pub(super) struct Indicator<const D: usize> {
    pub(super) parts: Vec<Field<f64, D, 1>>,
    /// Weights of the values, from 0 (unknown) to 1 (known).
    pub(super) weights: Field<f64, D, 1>,
    pub(super) step: Compact,
    /// Of the sum of all components.
    pub(super) moments: Moments<D>,
}

impl<const D: usize> Indicator<D> {
    /// Computes the mean indicators of moved shapes on one grid at given sample nodes, over the shapes that
    /// are visible there. All have the same components.
    pub(super) fn mean(
        moved: &[(&Masked<'_, D>, RigidMotion<D>)],
        nodes: Grid<D>,
        step: Compact,
    ) -> Result<Self, LevelsetError> {
        let n_parts = moved.first().map_or(0, |(shape, _)| shape.parts.len());
        let mean = |part: usize| -> Field<f64, D, 2> {
            Field::from_fn(nodes, |y| {
                let (mut sum, mut total) = (0.0, 0.0);
                for (shape, motion) in moved {
                    let x = motion.map_back(y);
                    let weight = shape.weight(&x);
                    sum += weight * step.value(shape.parts[part].distance.value(&x));
                    total += weight;
                }
                if total > LEAST_WEIGHT {
                    [sum / total, total.min(1.0)]
                } else {
                    [0.0; 2]
                }
            })
        };
        let mut parts = Vec::with_capacity(n_parts);
        let mut weights = Field::zeros(nodes);
        for part in 0..n_parts {
            let both = mean(part);
            parts.push(Field::from_vec(nodes, both.component(0).to_vec())?);
            weights = Field::from_vec(nodes, both.component(1).to_vec())?;
        }
        let mut all = Field::zeros(nodes);
        for part in &parts {
            axpy(1.0, part.as_slice(), all.as_mut_slice());
        }
        let moments = Moments::of_density(&all)?;
        Ok(Self {
            parts,
            weights,
            step,
            moments,
        })
    }

    pub(super) fn nodes(&self) -> &Grid<D> {
        self.weights.grid()
    }

    /// The values of all components at all nodes, one component after the other.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.parts.iter().flat_map(Field::as_slice).copied()
    }

    /// The weights of these values.
    pub(super) fn weights(&self) -> impl Iterator<Item = f64> {
        let weights = self.parts.iter().flat_map(|_| self.weights.as_slice());
        weights.copied()
    }
}
