//! The functional with the average eliminated.
//!
//! For fixed deformations the functional is a quadratic form in the average `v`; its minimiser
//! solves the normal equations. The reduced functional `J(phi) = min_v E` depends on the
//! deformations alone, and its derivative is the partial derivative of `E` at the minimiser
//! (envelope theorem). Unknowns are the displacements of all shapes, one after the other.
//!
//! Of several components every one has its own average, eliminated by its own normal equations.

mod minimised;

use crate::common::{self, CommonMotion};
use crate::elastic::{ElasticTerm, add_elastic};
use crate::energy::{Energy, ShapeTerms, Weights};
use crate::equations::solve_equations;
use crate::error::AverageError;
use crate::level::{LevelShapes, shape};
use crate::metric::ShapeMetric;
use crate::params::{AverageParams, BoundaryCondition, Precision};
use crate::result::Rematch;
use crate::rounds::Rounds;
use fe_grid::composition::{Interpolant, MatchDensity, Matching};
use fe_grid::minimise::Evaluation;
use fe_grid::multigrid::WorkSpace;
use fe_grid::scatter::{DistributedSources, NormalEquations, Source};
use fe_grid::stencil::Background;
use fe_grid::vector::change_in_double;
use fe_grid::{
    Assembly, Buffer, CgScratch, Data, Element, Grid, GridError, NumbersMut, Storage,
    certify_below, compiled_once, mutant, parallel,
};
use hyperelastic::{CompiledLaw, FoldBarrier, LawError};
use phasefield::{InterfaceLength, Masked, Mismatch};

/// Relative accuracy of the average; its error enters the energy squared.
const AVERAGE_TOLERANCE: f64 = 1e-7;

/// Lower bound of the energy that tolerances refer to, as a share of the whole: for shapes that differ
/// little, whose elastic energy is below the jumps of a discrete mismatch.
const LEAST_SCALE: f64 = 5e-4;

/// Number of counters in `Objective::memory`.
const N_COUNTERS: usize = 2;

/// The barrier acts at corners whose determinant is below this value.
const BARRIER_ONSET: f64 = FoldBarrier::ONSET;

/// Stiffness of the barrier relative to the objects, or that of the void if the void is stiffer. With the
/// stiffness 1e-4 of the default void the barrier was felt at the bound of the determinant only, where
/// steps are cut: of twenty hands, six horses and twenty-six frames of a dancer the minimisation ended 94,
/// 80 and 44 % of the elastic energy above the minimum (as estimated), and with 3e-3 it ends 20, 23 and 4 %
/// above one that is lower by as much. 1e-3 and 1e-2 do as well; the minima without a corner below the
/// onset are the same.
const BARRIER_STIFFNESS: f64 = 3e-3;

/// The metrics of all shapes.
enum Metric<const D: usize> {
    /// Stored metrics.
    Kept(Vec<ShapeMetric<D>>),
    /// The state from which each metric is recomputed, if there is memory for one metric only.
    Remade { x: Buffer<f64>, average: Vec<f64> },
}

/// The reduced functional on one level.
pub struct AverageObjective<const D: usize> {
    pub(crate) shapes: LevelShapes<D>,
    pub(crate) params: AverageParams,
    pub(crate) law: CompiledLaw<D>,
    pub(crate) weights: Weights,
    /// The average `v`, component by component, also the initial guess of the next solve.
    pub(crate) average: Vec<f64>,
    energy: Energy,
    metric: Metric<D>,
    /// The part of the metric for common motions; none with a prescribed average.
    common: Option<CommonMotion<D>>,
    /// Its regularisation.
    pub(crate) common_regularisation: f64,
    /// Whether the average is prescribed and never solved for.
    pub(crate) fixed: bool,
    /// The rounds of the minimisation so far.
    pub(crate) rounds: Rounds,
    /// The last estimate of the remaining energy.
    pub(crate) found_remaining: Option<f64>,
    /// The shapes that were deformed anew on this level.
    pub(crate) rematched: Vec<Rematch>,
    /// Work space of the multigrid cycles of all shapes.
    work_space: WorkSpace<f32>,
    /// The normal equations of every component of the average.
    pub(crate) equations: Vec<NormalEquations<D>>,
    pub(crate) scratch: CgScratch,
    /// Number of evaluations of one shape's energy.
    pub(crate) shape_evaluations: usize,
    /// Number of iterations of all solves for the average.
    pub(crate) average_iterations: usize,
}

compiled_once! {
    fn functional_of<'a, D>(
        shapes: LevelShapes<D>,
        params: &'a AverageParams,
        average: Vec<f64>,
    ) -> Result<AverageObjective<D>, LawError> = AverageObjective::with_guess;
}

compiled_once! {
    fn evaluate_average<'a, D>(
        objective: &'a mut AverageObjective<D>,
        x: &'a [f64],
        gradient: NumbersMut<'a>,
    ) -> Result<Evaluation, AverageError> = AverageObjective::evaluate_in;
}

compiled_once! {
    fn solve_for_average<'a, D>(
        objective: &'a mut AverageObjective<D>,
        x: &'a [f64],
    ) -> Result<(), GridError> = AverageObjective::solve_average_in;
}

compiled_once! {
    fn metric_of_shape<'a, D>(
        objective: &'a AverageObjective<D>,
        shape: usize,
        average: &'a [f64],
        displacement: &'a [f64],
    ) -> Result<ShapeMetric<D>, GridError> = AverageObjective::shape_metric_in;
}

impl<const D: usize> AverageObjective<D> {
    /// Creates the functional for shapes on a level, with an initial guess of the average, component by
    /// component.
    ///
    /// # Errors
    /// [`LawError`] where there is no law with these parameters.
    ///
    /// # Panics
    /// If the guess does not have one value per node and component.
    pub fn new(
        shapes: LevelShapes<D>,
        params: &AverageParams,
        average: Vec<f64>,
    ) -> Result<Self, LawError> {
        functional_of(shapes, params, average)
    }

    fn with_guess(
        shapes: LevelShapes<D>,
        params: &AverageParams,
        average: Vec<f64>,
    ) -> Result<Self, LawError> {
        let n = shapes.n_shapes();
        let n_components = shapes.n_components();
        assert_eq!(average.len(), n_components * shapes.grid().n_nodes());
        let weights = Weights {
            shapes: params.resolved_weights(n),
            shares: vec![1.0; n],
            mismatch: params.mismatch_weight / mutant!(n as f64, MismatchNotShared => 1.0),
            length: params.resolved_length_weight(),
        };
        let equations = (0..n_components)
            .map(|_| match params.precision_on(shapes.grid()) {
                Precision::Double => NormalEquations::new(*shapes.grid()),
                Precision::Mixed => NormalEquations::in_single(*shapes.grid()),
            })
            .collect();
        Ok(Self {
            shapes,
            law: params.law.compile()?,
            params: params.clone(),
            weights,
            average,
            energy: Energy::default(),
            metric: Metric::Kept(Vec::new()),
            common: None,
            common_regularisation: common::MINIMISATION,
            fixed: false,
            rounds: Rounds::default(),
            found_remaining: None,
            rematched: Vec::new(),
            work_space: WorkSpace::default(),
            equations,
            scratch: CgScratch::default(),
            shape_evaluations: 0,
            average_iterations: 0,
        })
    }

    /// Creates the functional with a prescribed average, onto which shapes are deformed.
    pub(crate) fn onto(
        shapes: LevelShapes<D>,
        params: &AverageParams,
        average: Vec<f64>,
    ) -> Result<Self, LawError> {
        Ok(Self {
            fixed: true,
            ..Self::new(shapes, params, average)?
        })
    }

    /// Multiplies all terms of each shape by its share.
    ///
    /// # Panics
    /// If there is not one share per shape.
    pub(crate) fn with_shares(mut self, shares: &[f64]) -> Self {
        assert_eq!(shares.len(), self.shapes.n_shapes());
        self.weights.shares = shares.to_vec();
        self
    }

    /// Returns the shapes.
    pub fn shapes(&self) -> &LevelShapes<D> {
        &self.shapes
    }

    /// Returns the shapes and drops the functional.
    pub fn into_shapes(self) -> LevelShapes<D> {
        self.shapes
    }

    /// Returns the terms of the last evaluation.
    pub fn energy(&self) -> &Energy {
        &self.energy
    }

    /// Returns the average of the last evaluation, component by component.
    pub fn average(&self) -> &[f64] {
        &self.average
    }

    /// Returns the components of the average.
    pub(crate) fn averages(&self) -> impl Iterator<Item = &[f64]> {
        self.average.chunks_exact(self.grid().n_nodes())
    }

    pub(crate) fn grid(&self) -> &Grid<D> {
        self.shapes.grid()
    }

    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }

    pub(crate) fn params(&self) -> &AverageParams {
        &self.params
    }

    /// Returns the number of unknowns of one displacement.
    pub(crate) fn shape_dim(&self) -> usize {
        D * self.grid().n_nodes()
    }

    /// Returns the smallest determinant at a corner, or a lower bound above the onset of the
    /// barrier; `None` if the determinant bound is violated on some cell.
    pub(crate) fn admissible(&self, displacement: &[f64]) -> Option<f64> {
        let certificate = certify_below(
            self.grid(),
            displacement,
            self.params.min_determinant,
            BARRIER_ONSET,
        );
        certificate.certified.then_some(certificate.min_corner_det)
    }

    /// Returns whether shapes are processed one after the other, which takes less work space.
    pub(crate) fn in_turn(&self) -> bool {
        self.params.storage != Storage::Memory
    }

    /// Returns whether the barrier acts on a deformation.
    pub(crate) fn near_folding(&self, displacement: &[f64]) -> bool {
        let corner = self.admissible(displacement);
        corner.is_none_or(|least| least < BARRIER_ONSET)
    }

    /// Computes the minimiser `v` of the functional for fixed displacements; a prescribed average
    /// is not changed.
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] if the normal equations are not definite, which can only
    /// be due to rounding.
    pub fn solve_average(&mut self, x: &[f64]) -> Result<(), GridError> {
        solve_for_average(self, x)
    }

    fn solve_average_in(&mut self, x: &[f64]) -> Result<(), GridError> {
        if self.fixed {
            return Ok(());
        }
        let rule = self.mismatch_rule(1.0);
        let factor = mutant!(4.0, LengthPotential => 8.0);
        let potential = self.weights.length / (factor * self.shapes.interface_width());
        let background = Background {
            mass: potential,
            stiffness: self.weights.length * self.shapes.interface_width(),
            load: potential,
        };
        let largest_share = self.weights.shares.iter().copied().fold(0.0, f64::max);
        let distributed = Some(DistributedSources {
            distribution: self.shapes.distribution(),
            moment: largest_share * self.weights.mismatch / self.shapes.interface_width()
                * self.grid().cell_volume(),
        });
        let (n_nodes, dim) = (self.grid().n_nodes(), self.shape_dim());
        let averages = self.average.chunks_exact_mut(n_nodes);
        for (c, (average, equations)) in averages.zip(&mut self.equations).enumerate() {
            let coefficients: Vec<Vec<&[f64]>> = (0..self.shapes.n_own())
                .map(|i| self.shapes.match_coefficients(i, c))
                .collect();
            let sources: Vec<Source<'_, f64>> = x
                .chunks_exact(dim)
                .zip(&coefficients)
                .zip(&self.weights.shares[self.shapes.distribution().own()])
                .map(|((displacement, coefficients), share)| Source {
                    displacement,
                    coefficients,
                    weight: *share,
                })
                .collect();
            if self.shapes.seen().is_empty() {
                equations.assemble(&rule, &sources, background, distributed);
            } else {
                equations.assemble(&Masked(rule), &sources, background, distributed);
            }
            let (load, scratch) = (equations.rhs(), &mut self.scratch);
            self.average_iterations +=
                solve_equations(equations, load, average, AVERAGE_TOLERANCE, scratch)?;
        }
        Ok(())
    }

    /// Returns the weighted elastic energy of the last evaluation, subject to a lower bound.
    pub(crate) fn elastic_scale(&self) -> f64 {
        let [elastic, ..] = self.energy.parts;
        elastic.max(LEAST_SCALE * self.energy.objective())
    }

    /// Takes over the record of rounds from what `Objective::memory` has returned.
    pub(crate) fn recall(&mut self, memory: &[f64]) {
        let numbers = memory.get(self.average.len() + N_COUNTERS..);
        self.rounds = Rounds::from_numbers(numbers.unwrap_or_default());
    }

    /// Returns the density of the mismatch for a share of its weight.
    pub(crate) fn mismatch_rule(&self, share: f64) -> Mismatch {
        Mismatch {
            interface_width: self.shapes.interface_width(),
            scale: share * self.weights.mismatch,
        }
    }

    /// Computes the terms of one shape of this process for the present average; `None` if its deformation folds.
    /// The gradient of their weighted sum overwrites `gradient` unless that is empty. `min_corner`
    /// is the result of [`Self::admissible`].
    pub(crate) fn shape_energy(
        &self,
        shape: usize,
        displacement: &[f64],
        min_corner: f64,
        gradient: &mut [f64],
    ) -> Result<Option<ShapeTerms>, AverageError> {
        let grid = *self.grid();
        gradient.fill(0.0);
        let elastic = match self.elastic(shape, displacement, gradient) {
            Ok(value) => value,
            Err(GridError::Inadmissible { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let density = Mismatch {
            interface_width: self.shapes.interface_width(),
            scale: 1.0,
        };
        let mut mismatch = Vec::with_capacity(self.shapes.n_components());
        for part in self.averages().enumerate() {
            mismatch.push(if self.shapes.seen().is_empty() {
                self.mismatch(density, shape, part, displacement, gradient)?
            } else {
                self.mismatch(Masked(density), shape, part, displacement, gradient)?
            });
        }
        let mut barrier = 0.0;
        if min_corner < BARRIER_ONSET {
            barrier = self
                .barrier()
                .value_or_gradient_add(&grid, displacement, gradient)?;
        }
        self.hold_boundary(gradient);
        Ok(Some(ShapeTerms {
            elastic,
            mismatch,
            barrier,
        }))
    }

    /// Computes the mismatch of one component of a shape, with its number and its average, from its
    /// density; adds the weighted gradient to `gradient` unless that is empty.
    fn mismatch<F: MatchDensity>(
        &self,
        density: F,
        shape: usize,
        (component, average): (usize, &[f64]),
        displacement: &[f64],
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        let grid = *self.grid();
        let law = Matching::new(density, Interpolant::new(grid, average));
        let coefficients = self.shapes.match_coefficients(shape, component);
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let matching = Assembly::new(grid, &law, data);
        matching.value_or_gradient_add(displacement, self.mismatch_weight(shape), gradient)
    }

    /// Returns the barrier against folding.
    pub(crate) fn barrier(&self) -> FoldBarrier {
        let n = self.shapes.n_shapes() as f64;
        FoldBarrier {
            weight: self.params.void_stiffness.max(BARRIER_STIFFNESS) * self.params.law.moduli.mu
                / n,
            onset: BARRIER_ONSET,
        }
    }

    fn elastic(
        &self,
        shape: usize,
        displacement: &[f64],
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        let term = ElasticTerm {
            law: &self.law,
            indicator: self.shapes.indicators[shape].as_slice(),
            void_stiffness: self.params.void_stiffness,
            displacement,
            factor: self.elastic_weight(shape),
            gradient,
        };
        add_elastic(term, self.grid())
    }

    /// Returns the weighted energy of one shape.
    pub(crate) fn weigh(&self, shape: usize, terms: &ShapeTerms) -> f64 {
        self.elastic_weight(shape) * terms.elastic
            + self.mismatch_weight(shape) * terms.mismatch.iter().sum::<f64>()
            + terms.barrier
    }

    /// Returns the share of a shape of this process.
    pub(crate) fn share(&self, shape: usize) -> f64 {
        self.weights.shares[self.shapes.distribution().own().start + shape]
    }

    /// Returns the weight of the elastic energy of a shape of this process.
    pub(crate) fn elastic_weight(&self, shape: usize) -> f64 {
        let first = self.shapes.distribution().own().start;
        self.weights.of_elastic(first + shape)
    }

    /// Returns the weight of the mismatch of a shape of this process.
    pub(crate) fn mismatch_weight(&self, shape: usize) -> f64 {
        let first = self.shapes.distribution().own().start;
        self.weights.of_mismatch(first + shape)
    }

    /// Computes the metric of one shape at a state.
    fn shape_metric(
        &self,
        shape: usize,
        average: &[f64],
        displacement: &[f64],
    ) -> Result<ShapeMetric<D>, GridError> {
        metric_of_shape(self, shape, average, displacement)
    }

    fn shape_metric_in(
        &self,
        shape: usize,
        average: &[f64],
        displacement: &[f64],
    ) -> Result<ShapeMetric<D>, GridError> {
        ShapeMetric::new(
            &self.shapes,
            shape,
            &self.params,
            (self.elastic_weight(shape), self.mismatch_weight(shape)),
            average,
            displacement,
            &self.work_space,
        )
    }

    /// Removes the components of a direction that would move a fixed boundary.
    pub(crate) fn hold_boundary<T: Element>(&self, direction: &mut [T]) {
        if self.params.boundary
            == mutant!(BoundaryCondition::Natural, BoundaryFree => self.params.boundary)
        {
            return;
        }
        let grid = *self.grid();
        let n = grid.nodes_per_axis();
        for component in direction.chunks_exact_mut(grid.n_nodes()) {
            for (i, x) in component.iter_mut().enumerate() {
                let node = grid.node(i);
                if (0..D).any(|k| node[k] == 0 || node[k] + 1 == n[k]) {
                    *x = T::default();
                }
            }
        }
    }

    /// Returns the interface lengths of the components of the present average.
    pub(crate) fn lengths(&self) -> Vec<f64> {
        let length = InterfaceLength {
            interface_width: self.shapes.interface_width(),
        };
        let of = |average| length.of(self.grid(), average);
        self.averages().map(of).collect()
    }

    /// Solves for the average and computes all terms; the gradient overwrites `gradient` unless
    /// that is empty.
    pub(crate) fn evaluate<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &mut [T],
    ) -> Result<Evaluation, AverageError> {
        evaluate_average(self, x, T::numbers_mut(gradient))
    }

    /// Computes the energy alone.
    pub(crate) fn evaluate_energy(&mut self, x: &[f64]) -> Result<Evaluation, AverageError> {
        self.evaluate::<f64>(x, &mut [])
    }

    fn evaluate_in(
        &mut self,
        x: &[f64],
        gradient: NumbersMut<'_>,
    ) -> Result<Evaluation, AverageError> {
        match gradient {
            NumbersMut::Double(gradient) => self.evaluate_terms(x, gradient),
            NumbersMut::Single(gradient) => self.evaluate_terms(x, gradient),
        }
    }

    fn evaluate_terms<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &mut [T],
    ) -> Result<Evaluation, AverageError> {
        let dim = self.shape_dim();
        let corners = parallel::map(x.chunks_exact(dim), &|u| self.admissible(u));
        let corners: Option<Vec<f64>> = corners.into_iter().collect();
        let distribution = self.shapes.distribution().clone();
        // All processes go on together.
        if !distribution.all(corners.is_some()) {
            return Ok(Evaluation::Inadmissible);
        }
        let corners = corners.unwrap_or_default();
        self.solve_average(x)?;
        self.shape_evaluations += self.shapes.n_shapes();
        let energy = |i: usize, gradient: &mut [f64]| {
            self.shape_energy(i, shape(x, i, dim), corners[i], gradient)
        };
        let energy_in = |(i, gradient): (usize, &mut [T])| {
            change_in_double(gradient, |gradient| energy(i, gradient))
        };
        let terms: Result<Vec<_>, AverageError> = if gradient.is_empty() {
            parallel::try_map(0..self.shapes.n_own(), &|i| energy(i, &mut []))
        } else if self.in_turn() {
            let parts = gradient.chunks_exact_mut(dim).enumerate();
            parts.map(energy_in).collect()
        } else {
            let parts = gradient.chunks_exact_mut(dim).enumerate();
            parallel::try_map(parts, &energy_in)
        };
        let terms: Option<Vec<ShapeTerms>> = terms?.into_iter().collect();
        if !distribution.all(terms.is_some()) {
            return Ok(Evaluation::Inadmissible);
        }
        let own = terms.unwrap_or_default();
        let terms = ShapeTerms::share(&own, self.shapes.n_components(), &distribution);
        self.energy = Energy::new(&self.weights, &terms, &self.lengths());
        Ok(Evaluation::Value(self.energy.objective()))
    }
}
