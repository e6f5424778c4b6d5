//! The input of an analysis: an average and its deformations.

use crate::compound::Source;
use crate::error::PcaError;
use crate::params::PcaParams;
use fe_grid::communicator::Communicator;
use fe_grid::vector::axpy;
use fe_grid::{Distribution, Field, Grid, InverseDeformation, ScalarField, VectorField, mutant};
use shape_average::{AverageParams, AverageResult, LEAST_VOTE};
use std::sync::Arc;

/// Deformations of shapes onto their average.
#[derive(Clone, Debug)]
pub struct Average<const D: usize> {
    grid: Grid<D>,
    displacements: Vec<VectorField<f64, D>>,
    indicators: Vec<ScalarField<f64, D>>,
    /// Visibility masks; empty if all shapes are fully visible.
    visibility: Vec<ScalarField<f64, D>>,
    weights: Vec<f64>,
    object: ScalarField<f64, D>,
    /// One minus the indicator of the object.
    outside: Vec<f64>,
    /// The zero displacement.
    rest: Vec<f64>,
    /// Which shapes this process does the work of.
    distribution: Distribution,
}

impl<const D: usize> Average<D> {
    /// Creates the input from displacements `phi_i - id`, indicators of the objects (1 inside, 0
    /// outside, 1/2 on the boundary) and weights `lambda_i`. If the object is the whole box, as for
    /// images, the indicators are one everywhere.
    ///
    /// # Errors
    /// [`PcaError`] for fewer than two shapes, fields that do not fit or are not finite, and weights that
    /// are not a convex combination.
    pub fn new(
        displacements: Vec<VectorField<f64, D>>,
        indicators: Vec<ScalarField<f64, D>>,
        weights: Vec<f64>,
    ) -> Result<Self, PcaError> {
        Self::of_visible(displacements, indicators, Vec::new(), weights)
    }

    /// The same of shapes of which parts are hidden, with a visibility mask of every shape (1 where it is
    /// visible, 0 elsewhere), or with none: where some shapes are visible, the others do not count for the
    /// average object.
    ///
    /// # Errors
    /// As [`Average::new`].
    pub fn of_visible(
        displacements: Vec<VectorField<f64, D>>,
        indicators: Vec<ScalarField<f64, D>>,
        visibility: Vec<ScalarField<f64, D>>,
        weights: Vec<f64>,
    ) -> Result<Self, PcaError> {
        let alone = Distribution::alone(displacements.len());
        Self::over(alone, displacements, indicators, visibility, weights)
    }

    /// The same on several processes. Collective.
    fn over(
        distribution: Distribution,
        displacements: Vec<VectorField<f64, D>>,
        indicators: Vec<ScalarField<f64, D>>,
        visibility: Vec<ScalarField<f64, D>>,
        weights: Vec<f64>,
    ) -> Result<Self, PcaError> {
        let n = displacements.len();
        if n < 2 {
            return Err(PcaError::TooFewShapes { found: n });
        }
        let grid = *displacements[0].grid();
        if let Some(index) = displacements.iter().position(|u| *u.grid() != grid) {
            let what = "deformation";
            return Err(PcaError::Fields { what, index });
        }
        let what = "indicator";
        if indicators.len() != n {
            let index = indicators.len().min(n);
            return Err(PcaError::Fields { what, index });
        }
        if let Some(index) = indicators.iter().position(|chi| *chi.grid() != grid) {
            return Err(PcaError::Fields { what, index });
        }
        let what = "visibility mask";
        if !visibility.is_empty() && visibility.len() != n {
            let index = visibility.len().min(n);
            return Err(PcaError::Fields { what, index });
        }
        if let Some(index) = visibility.iter().position(|eta| *eta.grid() != grid) {
            return Err(PcaError::Fields { what, index });
        }
        if let Some(index) = visibility.iter().position(|eta| !is_share(eta.as_slice())) {
            return Err(PcaError::Visibility { index });
        }
        let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
        let wrong = displacements.iter().position(|u| !finite(u.as_slice()));
        if let Some(index) = wrong {
            let what = "deformation";
            return Err(PcaError::NotFinite { what, index });
        }
        if let Some(index) = indicators.iter().position(|chi| !finite(chi.as_slice())) {
            return Err(PcaError::NotFinite { what, index });
        }
        let sum: f64 = weights.iter().sum();
        let bad = |w: &f64| w.is_nan() || *w < 0.0;
        if weights.len() != n || weights.iter().any(bad) || (sum - 1.0).abs() > 1e-9 {
            let expected = n;
            return Err(PcaError::Weights { expected, weights });
        }
        // The indicator of a shape in the average and, where parts are hidden, behind it its visibility and both together.
        let nodes = grid.n_nodes();
        let pushed = |i: usize| {
            let inverse = InverseDeformation::new(&displacements[i]);
            let mut all = inverse.push_forward(&indicators[i], 0.0).into_vec();
            if let Some(visibility) = visibility.get(i) {
                // Outside of the box, which is empty, a shape is visible.
                all.extend(inverse.push_forward(visibility, 1.0).as_slice());
                for node in 0..nodes {
                    all.push(all[node] * all[nodes + node]);
                }
            }
            all
        };
        let parts = if visibility.is_empty() { 1 } else { 3 };
        let mut object = weighted_sum(&distribution, &weights, parts * nodes, &pushed);
        let seen = object.split_off(nodes);
        let (votes, inside) = seen.split_at(seen.len() / 2);
        for (object, (inside, votes)) in object.iter_mut().zip(inside.iter().zip(votes)) {
            if *votes > LEAST_VOTE {
                *object = inside / votes;
            }
        }
        let object = ScalarField::from_vec(grid, object)?;
        if !object.as_slice().iter().any(|&x| x > 0.5) {
            return Err(PcaError::EmptyObject);
        }
        Ok(Self {
            grid,
            distribution,
            displacements,
            indicators,
            visibility,
            weights,
            outside: object.as_slice().iter().map(|x| 1.0 - x).collect(),
            rest: vec![0.0; D * grid.n_nodes()],
            object,
        })
    }

    /// Creates the input from the result of an average.
    ///
    /// # Errors
    /// Those of [`Average::new`].
    pub fn of_result(result: &AverageResult<D>, params: &AverageParams) -> Result<Self, PcaError> {
        let n = result.displacements.len();
        Self::of_visible(
            result.displacements.clone(),
            result.shapes.indicators.clone(),
            result.shapes.seen().to_vec(),
            params.resolved_weights(n),
        )
    }

    /// Lets several processes work on the analysis together, each on some of the shapes: all have the same
    /// average and call the same functions with it, and all have their results, with the same bits on any
    /// number of processes.
    #[must_use]
    pub fn distributed(self, communicator: Arc<dyn Communicator>) -> Self {
        Self {
            distribution: Distribution::over(communicator, self.n_shapes()),
            ..self
        }
    }

    /// The same shapes with other displacements.
    ///
    /// # Errors
    /// Those of [`Average::new`].
    pub fn with(&self, displacements: Vec<VectorField<f64, D>>) -> Result<Self, PcaError> {
        Self::over(
            self.distribution.clone(),
            displacements,
            self.indicators.clone(),
            self.visibility.clone(),
            self.weights.clone(),
        )
    }

    /// Displacements of all shapes, given those of the shapes of this process. Collective.
    ///
    /// # Errors
    /// [`fe_grid::GridError`] for displacements of another size.
    pub(crate) fn share_displacements(
        &self,
        own: Vec<Vec<f64>>,
    ) -> Result<Vec<VectorField<f64, D>>, PcaError> {
        let dim = D * self.grid.n_nodes();
        let all = self.distribution.share_vectors(own, dim).into_iter();
        let all = all.map(|u| VectorField::from_vec(self.grid, u));
        Ok(all.collect::<Result<_, _>>()?)
    }

    /// Returns the distribution of the shapes to processes.
    pub fn distribution(&self) -> &Distribution {
        &self.distribution
    }

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns the number of shapes.
    pub fn n_shapes(&self) -> usize {
        self.displacements.len()
    }

    /// Returns the weights `lambda_i`.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Returns the displacements `phi_i - id`.
    pub fn displacements(&self) -> &[Field<f64, D, D>] {
        &self.displacements
    }

    /// Returns the indicators of the objects.
    pub fn indicators(&self) -> &[ScalarField<f64, D>] {
        &self.indicators
    }

    /// Returns the smooth indicator of the average object, `sum_i lambda_i chi_i o phi_i^-1`, where parts are
    /// hidden `sum_i lambda_i (eta_i chi_i) o phi_i^-1 / sum_i lambda_i eta_i o phi_i^-1` with the visibility masks
    /// `eta_i`; its level 1/2 is the average shape.
    pub fn object(&self) -> &ScalarField<f64, D> {
        &self.object
    }

    /// Returns the energies of all shapes, as sources of the compound operator.
    pub fn sources(&self) -> Vec<Source<'_>> {
        (0..self.n_shapes())
            .map(|i| Source {
                weight: self.weights[i],
                ..self.source(i)
            })
            .collect()
    }

    /// Returns the energies that form the compound object, with the corresponding void stiffness:
    /// those of all shapes, or of the average without prestress; a void without prestress is a
    /// separate source.
    pub(crate) fn compound_sources(&self, params: &PcaParams) -> (Vec<Source<'_>>, f64) {
        let at_rest = |weight, indicator| Source {
            weight,
            displacement: &self.rest,
            indicator,
        };
        if mutant!(params.at_rest, PrestressMissing => true) {
            return (
                vec![at_rest(1.0, self.object.as_slice())],
                params.void_stiffness,
            );
        }
        let mut sources = self.sources();
        if !params.void_at_rest {
            return (sources, params.void_stiffness);
        }
        sources.push(at_rest(params.void_stiffness, &self.outside));
        (sources, 0.0)
    }

    /// Returns the energy of one shape, with weight one.
    ///
    /// # Panics
    /// If there is no such shape.
    pub fn source(&self, i: usize) -> Source<'_> {
        Source {
            weight: 1.0,
            displacement: self.displacements[i].as_slice(),
            indicator: self.indicators[i].as_slice(),
        }
    }
}

fn is_share(values: &[f64]) -> bool {
    values.iter().all(|x| (0.0..=1.0).contains(x))
}

/// The weighted sum of a vector of every shape. Collective.
fn weighted_sum(
    distribution: &Distribution,
    weights: &[f64],
    len: usize,
    of_shape: &dyn Fn(usize) -> Vec<f64>,
) -> Vec<f64> {
    let mut sum = vec![0.0; len];
    if distribution.is_alone() {
        // One after the other: they take no memory together.
        for (i, weight) in weights.iter().enumerate() {
            axpy(*weight, &of_shape(i), &mut sum);
        }
    } else {
        let own = distribution.own().map(of_shape).collect();
        let all = distribution.share_vectors(own, len);
        for (weight, x) in weights.iter().zip(&all) {
            axpy(*weight, x, &mut sum);
        }
    }
    sum
}
