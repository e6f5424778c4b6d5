//! The energy of a path of level sets and deformations.

use super::metric::{LevelSetMetric, MetricParts};
use super::transport::{displacement, level_set};
use crate::cells::{self, solid_cells};
use crate::laws::{Kind, StepTerm, value_or_gradient};
use crate::{BoundaryArea, GeodesicError, GeodesicParams, MatchWeights, ObjectWeights, StepMatch};
use fe_grid::composition::{Interpolant, Outside};
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::scatter::{Background, NormalEquations, Source};
use fe_grid::{
    Assembly, Data, Grid, GridError, Restrained, certify_within, restrain_together, vector,
};
use hyperelastic::FoldBarrier;
use levelset::{Arctan, Compact, Step};
use rayon::prelude::*;

/// The barrier is felt by corners whose determinant is below this.
const BARRIER_ONSET: f64 = 0.2;
/// Longest step of the minimiser, in cells.
const LONGEST_STEP: f64 = 1.0;

/// The terms of the energy, unweighted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LevelSetEnergy {
    /// Energies `W_k` of the steps.
    pub step_energies: Vec<f64>,
    /// Matches of every shape with the next.
    pub mismatches: Vec<f64>,
    /// Boundary areas of the shapes `1, ..., K`.
    pub areas: Vec<f64>,
    /// The barrier that keeps the corners of cells from folding, summed over the steps; zero where
    /// no determinant is below its onset.
    pub barrier: f64,
    /// `K sum W_k + eta sum match_k + mu/K sum area_k`, and the barrier.
    pub total: f64,
}

impl LevelSetEnergy {
    /// The length `sum sqrt W_k` of the path.
    pub fn length(&self) -> f64 {
        cells::length(&self.step_energies)
    }

    /// The dissipation `K sum W_k`.
    pub fn dissipation(&self) -> f64 {
        cells::dissipation(&self.step_energies)
    }
}

/// The energy
/// `sum_k K W[phi_k, u_{k-1}] + eta int (H(u_k o phi_k) - H(u_{k-1}))^2 + mu/K int |D H(u_k)|`.
///
/// The state is `u_0, phi_1, u_1, ..., phi_K, u_K`, level sets and displacements at the nodes;
/// `u_0` and `u_K` are held.
pub struct LevelSetObjective<const D: usize> {
    grid: Grid<D>,
    params: GeodesicParams,
    steps: usize,
    indicator: Step,
    step: Arctan,
    energy: LevelSetEnergy,
    metric: Option<LevelSetMetric<D>>,
    equations: NormalEquations<D>,
    /// Whether the end shapes are held; otherwise their derivatives are given, too.
    held: bool,
}

impl<const D: usize> LevelSetObjective<D> {
    /// The energy on a grid.
    ///
    /// # Errors
    /// Those of the smooth steps.
    pub fn new(
        grid: Grid<D>,
        steps: usize,
        params: &GeodesicParams,
    ) -> Result<Self, GeodesicError> {
        let h = grid.spacing();
        let indicator = Step::Compact(Compact::new(params.indicator_cells * h)?);
        let step = Arctan::new(params.match_cells * h)?;
        Ok(Self::with_steps(grid, steps, params, indicator, step))
    }

    /// The same with other smooth steps for the elastic weight and the match.
    pub fn with_steps(
        grid: Grid<D>,
        steps: usize,
        params: &GeodesicParams,
        indicator: Step,
        step: Arctan,
    ) -> Self {
        Self {
            grid,
            params: params.clone(),
            steps,
            indicator,
            step,
            energy: LevelSetEnergy::default(),
            metric: None,
            equations: NormalEquations::new(grid),
            held: true,
        }
    }

    /// Gives the derivatives by the first and the last level set, too.
    pub fn with_free_ends(mut self) -> Self {
        self.held = false;
        self
    }

    fn weights(&self) -> ObjectWeights {
        ObjectWeights {
            indicator: self.indicator,
            void_stiffness: self.params.void_stiffness,
            void_viscosity: self.params.void_viscosity,
        }
    }

    /// The terms of the last evaluation.
    pub fn energy(&self) -> &LevelSetEnergy {
        &self.energy
    }

    /// The cells of step `k` that must not fold, where not all are.
    pub fn solid_cells(&self, x: &[f64], k: usize) -> Option<Vec<bool>> {
        let n = self.grid.n_nodes();
        let u = &x[level_set(n, D, k - 1)];
        (self.params.void_stiffness == 0.0).then(|| solid_cells(&self.grid, u, self.indicator))
    }

    fn admissible(&self, x: &[f64], k: usize) -> bool {
        let u = &x[displacement(self.grid.n_nodes(), D, k)];
        let bound = self.params.min_determinant;
        let solid = self.solid_cells(x, k);
        certify_within(&self.grid, u, bound, bound, solid.as_deref()).certified
    }

    /// All terms; the gradient overwrites `gradient` unless that is empty.
    ///
    /// # Errors
    /// [`GeodesicError::Law`] where the law cannot be made.
    pub fn evaluate(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GeodesicError> {
        let admissible = (1..=self.steps)
            .into_par_iter()
            .all(|k| self.admissible(x, k));
        if !admissible {
            return Ok(Evaluation::Inadmissible);
        }
        gradient.fill(0.0);
        match self.add_up(x, gradient) {
            Err(GeodesicError::Grid(GridError::Inadmissible { .. })) => {
                Ok(Evaluation::Inadmissible)
            }
            Err(error) => Err(error),
            Ok(energy) => {
                let n = self.grid.n_nodes();
                if self.held && !gradient.is_empty() {
                    gradient[level_set(n, D, 0)].fill(0.0);
                    gradient[level_set(n, D, self.steps)].fill(0.0);
                }
                self.energy = energy;
                Ok(Evaluation::Value(self.energy.total))
            }
        }
    }

    fn add_up(&mut self, x: &[f64], gradient: &mut [f64]) -> Result<LevelSetEnergy, GeodesicError> {
        let n = self.grid.n_nodes();
        let count = self.steps as f64;
        let wanted = !gradient.is_empty();
        let mut energy = LevelSetEnergy::default();
        for k in 1..=self.steps {
            let own = (k - 1) * (D + 1) * n..k * (D + 1) * n;
            let part = |gradient: &mut [f64]| -> std::ops::Range<usize> {
                if gradient.is_empty() {
                    0..0
                } else {
                    own.clone()
                }
            };
            let range = part(gradient);
            let term = StepTerm {
                kind: Kind::Step,
                law: &self.params.law,
                weights: self.weights(),
                level_set: &[],
                state: &x[own.clone()],
                factor: count,
                gradient: &mut gradient[range.clone()],
            };
            energy.step_energies.push(term.add(&self.grid)??);
            let other = &x[level_set(n, D, k)];
            let other = Interpolant::new(self.grid, other).with_outside(Outside::Falling);
            energy
                .mismatches
                .push(self.add_match(&x[own.clone()], other, &mut gradient[range])?);
            if wanted && (k < self.steps || !self.held) {
                let rule = MatchWeights {
                    step: self.step,
                    other,
                };
                let source = Source {
                    displacement: &x[displacement(n, D, k)],
                    coefficients: &[&x[level_set(n, D, k - 1)]],
                };
                self.equations
                    .assemble(&rule, &[source], Background::default());
                let target = &mut gradient[level_set(n, D, k)];
                vector::axpy(
                    self.params.resolved_match_weight(),
                    self.equations.rhs(),
                    target,
                );
            }
            if self.params.void_stiffness > 0.0 {
                let law = FoldBarrier {
                    weight: self.params.void_stiffness * self.params.resolved_match_weight(),
                    onset: BARRIER_ONSET,
                };
                let assembly = Assembly::<_, f64, D, D>::new(self.grid, &law, Data::default());
                let place = displacement(n, D, k);
                let range = if wanted { place.clone() } else { 0..0 };
                energy.barrier +=
                    value_or_gradient(&assembly, &x[place], 1.0, &mut gradient[range])?;
            }
            let law = BoundaryArea {
                step: self.step,
                regularisation: self.params.area_regularisation,
            };
            let assembly = Assembly::<_, f64, D, 1>::new(self.grid, &law, Data::default());
            let range = if wanted { level_set(n, D, k) } else { 0..0 };
            let weight = self.params.area_weight / count;
            let area = value_or_gradient(
                &assembly,
                &x[level_set(n, D, k)],
                weight,
                &mut gradient[range],
            )?;
            energy.areas.push(area);
        }
        energy.total = count * energy.step_energies.iter().sum::<f64>()
            + energy.barrier
            + self.params.resolved_match_weight() * energy.mismatches.iter().sum::<f64>()
            + self.params.area_weight / count * energy.areas.iter().sum::<f64>();
        Ok(energy)
    }

    fn add_match(
        &self,
        state: &[f64],
        other: Interpolant<'_, f64, D>,
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        let law = StepMatch {
            step: self.step,
            other,
        };
        // Components are a constant of the type: one more than the dimension.
        if D == 2 {
            let assembly = Assembly::<_, f64, D, 3>::new(self.grid, &law, Data::default());
            value_or_gradient(
                &assembly,
                state,
                self.params.resolved_match_weight(),
                gradient,
            )
        } else {
            let assembly = Assembly::<_, f64, D, 4>::new(self.grid, &law, Data::default());
            value_or_gradient(
                &assembly,
                state,
                self.params.resolved_match_weight(),
                gradient,
            )
        }
    }
}

impl<const D: usize> Objective for LevelSetObjective<D> {
    type Error = GeodesicError;

    fn dim(&self) -> usize {
        (self.steps * (D + 1) + 1) * self.grid.n_nodes()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GeodesicError> {
        self.evaluate(x, gradient)
    }

    fn value(&mut self, x: &[f64]) -> Result<Evaluation, GeodesicError> {
        self.evaluate(x, &mut [])
    }

    fn apply_inverse_metric(
        &mut self,
        gradient: &[f64],
        out: &mut [f64],
    ) -> Result<(), GeodesicError> {
        match &self.metric {
            Some(metric) => metric.apply_into(gradient, out),
            None => vector::copy_into(gradient, out),
        }
        Ok(())
    }

    /// Shortens the whole step, and damps all its parts alike where one would fold: they belong
    /// together.
    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), GeodesicError> {
        let n = self.grid.n_nodes();
        let longest = vector::max_abs(direction);
        let bound = LONGEST_STEP * self.grid.spacing();
        if longest > bound {
            vector::scale(bound / longest, direction);
        }
        let solid: Vec<_> = (1..=self.steps).map(|k| self.solid_cells(x, k)).collect();
        let deformations: Vec<_> = (1..=self.steps)
            .map(|k| Restrained {
                displacement: &x[displacement(n, D, k)],
                range: displacement(n, D, k),
                within: solid[k - 1].as_deref(),
            })
            .collect();
        let bound = self.params.min_determinant;
        restrain_together(&self.grid, &deformations, direction, bound);
        Ok(())
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), GeodesicError> {
        self.metric = None;
        self.metric = Some(LevelSetMetric::new(&MetricParts {
            grid: self.grid,
            moduli: self.params.law.moduli,
            indicator: self.indicator,
            match_weight: self.params.resolved_match_weight(),
            step: self.step,
            state: x,
            steps: self.steps,
        })?);
        Ok(())
    }
}
