//! The energy of a path of level sets and deformations.

use super::metric::{LevelSetMetric, MetricParts};
use super::state::Layout;
use crate::area::BoundaryArea;
use crate::cells::{ObjectWeights, solid_cells};
use crate::descent::fold_barrier;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::laws::{Kind, StepTerm};
use crate::mismatch::{MismatchWeights, StepMismatch};
use crate::params::GeodesicParams;
use crate::shape::KnownEnds;
use fe_grid::composition::{Interpolant, Outside};
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::scatter::{NormalEquations, Source};
use fe_grid::stencil::Background;
use fe_grid::{
    Assembly, Data, Grid, GridError, Restrained, certify_within, compiled_once, mutant, parallel,
    repair, restrain_together, vector,
};
use hyperelastic::CompiledLaw;
use levelset::{Arctan, Compact, Step};

/// Longest step of the minimiser, in cells.
const LONGEST_STEP: f64 = 1.0;

/// The energy
/// `sum_k K W[phi_k, u_{k-1}] + eta int (H(u_k o phi_k) - H(u_{k-1}))^2 + mu/K int |D H(u_k)|`.
///
/// The state is `u_0, phi_1, u_1, ..., phi_K, u_K`, level sets and displacements at the nodes;
/// `u_0` and `u_K` are fixed. A shape of several components has one level set per component;
/// mismatch and area are summed over all components, and `W` is weighted by their union `max_i
/// u_i`.
pub struct LevelSetObjective<const D: usize> {
    grid: Grid<D>,
    params: GeodesicParams,
    law: CompiledLaw<D>,
    layout: Layout<D>,
    known: KnownEnds<D>,
    indicator: Step,
    step: Arctan,
    energy: PathEnergy,
    metric: Option<LevelSetMetric<D>>,
    equations: NormalEquations<D>,
    /// Whether the end shapes are fixed; otherwise their derivatives are computed, too.
    held: bool,
    /// Work arrays: a level set with a displacement, and the gradient with respect to both.
    pair: Vec<f64>,
    pair_gradient: Vec<f64>,
}

compiled_once! {
    fn evaluate_level_sets<'a, D>(
        objective: &'a mut LevelSetObjective<D>,
        x: &'a [f64],
        gradient: &'a mut [f64],
    ) -> Result<Evaluation, GeodesicError> = LevelSetObjective::evaluate_terms;
}

impl<const D: usize> LevelSetObjective<D> {
    /// Creates the energy on a grid.
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
        let step = Arctan::new(params.mismatch_cells * h)?;
        Self::with_steps(grid, steps, params, indicator, step)
    }

    /// Creates the energy with other smooth steps for the elastic weight and the mismatch.
    ///
    /// # Errors
    /// [`GeodesicError::Law`] if the law cannot be constructed.
    pub fn with_steps(
        grid: Grid<D>,
        steps: usize,
        params: &GeodesicParams,
        indicator: Step,
        step: Arctan,
    ) -> Result<Self, GeodesicError> {
        Ok(Self {
            grid,
            law: params.law.compile()?,
            params: params.clone(),
            layout: Layout {
                nodes: grid.n_nodes(),
                components: 1,
                steps,
            },
            known: KnownEnds::default(),
            indicator,
            step,
            energy: PathEnergy::default(),
            metric: None,
            equations: NormalEquations::new(grid),
            held: true,
            pair: Vec::new(),
            pair_gradient: Vec::new(),
        })
    }

    /// Sets the number of components of the shapes.
    pub fn with_components(mut self, components: usize) -> Self {
        self.layout.components = components;
        self
    }

    /// Sets the visibility of the end shapes.
    pub(crate) fn with_known(mut self, known: KnownEnds<D>) -> Self {
        self.known = known;
        self
    }

    /// Enables the derivatives with respect to the first and the last level set.
    pub fn with_free_ends(mut self) -> Self {
        self.held = false;
        self
    }

    fn weights(&self) -> ObjectWeights {
        ObjectWeights {
            indicator: self.indicator,
            void_stiffness: self.params.void_stiffness,
            void_viscosity: self.params.void_viscosity * self.params.law.moduli.mu,
        }
    }

    /// Returns the terms of the last evaluation.
    pub fn energy(&self) -> &PathEnergy {
        &self.energy
    }

    /// Returns the cells of step `k` that must not fold; `None` if these are all cells.
    fn solid_cells(&self, x: &[f64], k: usize) -> Option<Vec<bool>> {
        (self.params.void_stiffness == 0.0).then(|| {
            let union = self.layout.union(x, k - 1);
            solid_cells(&self.grid, &union, self.indicator)
        })
    }

    /// Interpolates deformations towards the identity until they are admissible.
    pub(crate) fn repair(&self, x: &mut [f64]) {
        for k in 1..=self.layout.steps {
            let solid = self.solid_cells(x, k);
            let u = &mut x[self.layout.displacement(k)];
            repair(&self.grid, u, self.params.min_determinant, solid.as_deref());
        }
    }

    fn admissible(&self, x: &[f64], k: usize) -> bool {
        let u = &x[self.layout.displacement(k)];
        let bound = self.params.min_determinant;
        let solid = self.solid_cells(x, k);
        certify_within(&self.grid, u, bound, bound, solid.as_deref()).certified
    }

    /// Computes all terms; the gradient overwrites `gradient` unless that is empty.
    ///
    /// # Errors
    /// [`GeodesicError::Law`] if the law cannot be constructed.
    pub fn evaluate(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GeodesicError> {
        evaluate_level_sets(self, x, gradient)
    }

    fn evaluate_terms(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GeodesicError> {
        if !parallel::all(1..=self.layout.steps, &|k| self.admissible(x, k)) {
            return Ok(Evaluation::Inadmissible);
        }
        gradient.fill(0.0);
        match self.add_up(x, gradient) {
            Err(GeodesicError::Grid(GridError::Inadmissible { .. })) => {
                Ok(Evaluation::Inadmissible)
            }
            Err(error) => Err(error),
            Ok(energy) => {
                if self.held && !gradient.is_empty() {
                    gradient[self.layout.shape(0)].fill(0.0);
                    gradient[self.layout.shape(self.layout.steps)].fill(0.0);
                }
                self.energy = energy;
                Ok(Evaluation::Value(self.energy.total))
            }
        }
    }

    fn add_up(&mut self, x: &[f64], gradient: &mut [f64]) -> Result<PathEnergy, GeodesicError> {
        let steps = self.layout.steps;
        let mut energy = PathEnergy::default();
        for k in 1..=steps {
            let deformation = self.add_deformation(x, k, gradient)?;
            energy.step_energies.push(deformation);
            energy.barrier += self.add_barrier(x, k, gradient)?;
            let (mut mismatch, mut area) = (0.0, 0.0);
            for component in 0..self.layout.components {
                mismatch += self.add_mismatch(x, k, component, gradient)?;
                area += self.add_area(x, k, component, gradient)?;
            }
            energy.mismatches.push(mismatch);
            energy.areas.push(area);
        }
        let count = steps as f64;
        let per_time = mutant!(count, StepCount => 1.0);
        energy.total = per_time * energy.step_energies.iter().sum::<f64>()
            + energy.barrier
            + self.params.resolved_mismatch_weight() * energy.mismatches.iter().sum::<f64>()
            + self.params.area_weight / mutant!(count, AreaCount => 1.0)
                * energy.areas.iter().sum::<f64>();
        Ok(energy)
    }

    /// Copies a level set and the displacement of step `k` to one array, for laws of both.
    fn lay_out(&mut self, level_set: &[f64], displacement: &[f64], wanted: bool) {
        self.pair.clear();
        self.pair.extend_from_slice(level_set);
        self.pair.extend_from_slice(displacement);
        self.pair_gradient.clear();
        self.pair_gradient
            .resize(if wanted { self.pair.len() } else { 0 }, 0.0);
    }

    /// Adds the energy of step `k`; the derivative with respect to the union is added to the
    /// component that attains it.
    fn add_deformation(
        &mut self,
        x: &[f64],
        k: usize,
        gradient: &mut [f64],
    ) -> Result<f64, GeodesicError> {
        let (n, wanted) = (self.layout.nodes, !gradient.is_empty());
        let shape = mutant!(k - 1, StepShape => k);
        let union = self.layout.union(x, shape);
        self.lay_out(&union, &x[self.layout.displacement(k)], wanted);
        let term = StepTerm {
            kind: Kind::Step,
            law: &self.law,
            weights: self.weights(),
            level_set: &[],
            state: &self.pair,
            factor: self.layout.steps as f64,
            gradient: &mut self.pair_gradient,
        };
        let energy = term.add(&self.grid)?;
        if wanted {
            let by_displacement = &mut gradient[self.layout.displacement(k)];
            vector::axpy(1.0, &self.pair_gradient[n..], by_displacement);
            // Where components are equal, the first is chosen: one of the subgradients.
            let mut open = vec![true; if self.layout.components > 1 { n } else { 0 }];
            for component in 0..self.layout.components {
                let range = self.layout.level_set(k - 1, component);
                if self.layout.components == 1 {
                    vector::axpy(1.0, &self.pair_gradient[..n], &mut gradient[range]);
                    continue;
                }
                let own = &x[range.clone()];
                for (node, by_level_set) in gradient[range].iter_mut().enumerate() {
                    if open[node] && own[node] == union[node] {
                        *by_level_set += self.pair_gradient[node];
                        open[node] = false;
                    }
                }
            }
        }
        Ok(energy)
    }

    fn add_barrier(&self, x: &[f64], k: usize, gradient: &mut [f64]) -> Result<f64, GridError> {
        if self.params.void_stiffness == 0.0 {
            return Ok(0.0);
        }
        let law = fold_barrier(&self.params);
        let range = self.layout.displacement(k);
        let part = part(gradient, &range);
        law.value_or_gradient_add(&self.grid, &x[range], part)
    }

    fn add_area(
        &self,
        x: &[f64],
        k: usize,
        component: usize,
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        let law = BoundaryArea {
            step: self.step,
            regularisation: self.params.area_regularisation,
        };
        let assembly = Assembly::<_, f64, D, 1>::new(self.grid, &law, Data::default());
        let range = self.layout.level_set(k, component);
        let part = part(gradient, &range);
        let weight = self.params.area_weight / self.layout.steps as f64;
        assembly.value_or_gradient_add(&x[range], weight, part)
    }

    fn add_mismatch(
        &mut self,
        x: &[f64],
        k: usize,
        component: usize,
        gradient: &mut [f64],
    ) -> Result<f64, GridError> {
        let (n, wanted) = (self.layout.nodes, !gradient.is_empty());
        let (before, after) = (
            self.layout.level_set(k - 1, component),
            self.layout.level_set(k, component),
        );
        let displacement = self.layout.displacement(k);
        self.lay_out(&x[before.clone()], &x[displacement.clone()], wanted);
        let other = Interpolant::new(self.grid, &x[after.clone()]).with_outside(Outside::Falling);
        let visibility = self.known.in_step(k, self.layout.steps);
        let weight = self.params.resolved_mismatch_weight();
        let law = StepMismatch {
            step: self.step,
            other,
            visibility,
        };
        let (state, by_state) = (&self.pair, &mut self.pair_gradient);
        // The number of components is a type parameter: one more than the dimension.
        let mismatch = if D == 2 {
            let assembly = Assembly::<_, f64, D, 3>::new(self.grid, &law, Data::default());
            assembly.value_or_gradient_add(state, weight, by_state)
        } else {
            let assembly = Assembly::<_, f64, D, 4>::new(self.grid, &law, Data::default());
            assembly.value_or_gradient_add(state, weight, by_state)
        }?;
        if wanted {
            vector::axpy(1.0, &self.pair_gradient[..n], &mut gradient[before.clone()]);
            let by_displacement = &mut gradient[displacement.clone()];
            vector::axpy(1.0, &self.pair_gradient[n..], by_displacement);
            if k < self.layout.steps || !self.held {
                let rule = MismatchWeights {
                    step: self.step,
                    other,
                    visibility,
                };
                let source = Source {
                    displacement: &x[displacement],
                    coefficients: &[&x[before]],
                    weight: 1.0,
                };
                self.equations
                    .assemble(&rule, &[source], Background::default(), None);
                vector::axpy(weight, self.equations.rhs(), &mut gradient[after]);
            }
        }
        Ok(mismatch)
    }
}

/// Returns a part of a gradient; empty if the gradient is not needed.
fn part<'a>(gradient: &'a mut [f64], range: &std::ops::Range<usize>) -> &'a mut [f64] {
    if gradient.is_empty() {
        gradient
    } else {
        &mut gradient[range.clone()]
    }
}

impl<const D: usize> Objective for LevelSetObjective<D> {
    type Error = GeodesicError;

    fn dim(&self) -> usize {
        self.layout.len()
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

    /// Shortens the whole step, and damps all its parts by the same factor if one would fold, as
    /// they are coupled.
    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), GeodesicError> {
        let longest = vector::max_abs(direction);
        let bound = LONGEST_STEP * self.grid.spacing();
        if longest > bound {
            vector::scale(bound / longest, direction);
        }
        let steps = self.layout.steps;
        let solid: Vec<_> = (1..=steps).map(|k| self.solid_cells(x, k)).collect();
        let deformations: Vec<_> = (1..=steps)
            .map(|k| Restrained {
                displacement: &x[self.layout.displacement(k)],
                range: self.layout.displacement(k),
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
            mismatch_weight: self.params.resolved_mismatch_weight(),
            barrier: fold_barrier(&self.params),
            step: self.step,
            known: &self.known,
            state: x,
            layout: self.layout,
        })?);
        Ok(())
    }
}
