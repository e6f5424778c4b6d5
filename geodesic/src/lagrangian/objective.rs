//! The energy of a path of deformations of one start domain.

use super::matched::{Match, attraction_add};
use super::metric::PathMetric;
use crate::cells::{ObjectWeights, continued, solid_cells};
use crate::descent::fold_barrier;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::laws::{Kind, StepTerm};
use crate::metric::{CarriedLevel, ComposedLevel, ElasticForm};
use crate::mismatch::HeavisideMismatch;
use crate::params::GeodesicParams;
use crate::shape::{ShapeOnGrid, union_of};
use crate::transport::Targets;
use fe_grid::composition::Interpolant;
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::{
    Grid, GridError, Restrained, ScalarField, certify_within, compiled_once, parallel, repair,
    shorten_together, vector,
};
use hyperelastic::{CompiledLaw, FoldBarrier};
use levelset::{Arctan, Compact, Step};

/// Half-width of the step of the mismatch on the end domain, in grid spacings.
const CARRIED_CELLS: f64 = 1.5;
/// Factor of the weight of the barrier against folding. With 1, a quarter of the paths between very
/// different shapes end in a jam of the void before they arrive; from 10 on, few do, and lengths fall.
const BARRIER: f64 = 10.0;
/// Cells with a point in the transition of that step have nodes at most this many spacings beside it.
const AROUND: f64 = 2.0;
/// The length, in distances of neighbouring targets, on which elasticity evens out the targets of nodes.
const BETWEEN_TARGETS: f64 = 3.0;
/// Stiffness of the void in the metric, and factor of the second derivative of the barrier. A step that is
/// too short is corrected by the next pairs, one that folds the void is halved: on 30 paths between six
/// silhouettes at 65^2, .1 and 1 take 29 % more time, and end with 4 % more length.
const METRIC_VOID: f64 = 0.4;
const METRIC_BARRIER: f64 = 4.0;

/// The energy `K sum_k W_k + eta int (H(u_B o psi_K) - H(u_A))^2` on one level. A share of the
/// mismatch is measured at points of the end domain, with a step `H` of finite width. Unknowns are the
/// displacements of `psi_1, ..., psi_K`, one after the other. If the shapes have several
/// components, all components are matched, and their union is the matter.
///
/// On the domain of a shape between both ends ([`PathObjective::of_middle`]), `psi_0` is unknown, too, and is
/// matched with the start shape.
pub struct PathObjective<const D: usize> {
    grid: Grid<D>,
    params: GeodesicParams,
    law: CompiledLaw<D>,
    steps: usize,
    /// The components of the shape of the domain.
    own: Vec<ScalarField<f64, D>>,
    /// What the last deformation carries it to, and the first one where that is unknown, too.
    end: Match<D>,
    start: Option<Match<D>>,
    /// The level set of the union of the components of the start shape.
    union: ScalarField<f64, D>,
    indicator: Step,
    density: HeavisideMismatch,
    carried_step: Compact,
    /// The cells that must not fold: those with a part of the object; `None` if these are all
    /// cells.
    solid: Option<Vec<bool>>,
    energy: PathEnergy,
    metric: Option<PathMetric<D>>,
    /// What attracts the last deformation in place of the end shape.
    targets: Option<Targets<D>>,
    /// Work arrays: the path with the identity in front, and its gradient.
    path: Vec<f64>,
    path_gradient: Vec<f64>,
}

compiled_once! {
    fn energy_between<'a, D>(
        start: ShapeOnGrid<D>,
        end: ShapeOnGrid<D>,
        steps: usize,
        params: &'a GeodesicParams,
    ) -> Result<PathObjective<D>, GeodesicError> = PathObjective::between;
}

compiled_once! {
    fn evaluate_path<'a, D>(
        objective: &'a mut PathObjective<D>,
        x: &'a [f64],
        gradient: &'a mut [f64],
        matched: bool,
    ) -> Result<Evaluation, GeodesicError> = PathObjective::evaluate_terms;
}

compiled_once! {
    fn add_mismatch_gradient<'a, D>(
        objective: &'a mut PathObjective<D>,
        last: &'a [f64],
        factor: f64,
        out: &'a mut [f64],
    ) -> Result<(), GridError> = PathObjective::mismatch_gradient_add_in;
}

impl<const D: usize> PathObjective<D> {
    /// Creates the energy for two shapes given by their level sets on one grid.
    ///
    /// # Errors
    /// [`GeodesicError::GridsDiffer`], and those of the steps.
    pub fn new(
        start: ScalarField<f64, D>,
        end: ScalarField<f64, D>,
        steps: usize,
        params: &GeodesicParams,
    ) -> Result<Self, GeodesicError> {
        let [start, end] = single(start, end)?;
        energy_between(start, end, steps, params)
    }

    /// Creates the energy for two shapes on the grid of a level.
    pub(crate) fn between(
        start: ShapeOnGrid<D>,
        end: ShapeOnGrid<D>,
        steps: usize,
        params: &GeodesicParams,
    ) -> Result<Self, GeodesicError> {
        let h = start.components[0].grid().spacing();
        let indicator = Step::Compact(Compact::new(params.indicator_cells * h)?);
        let density = HeavisideMismatch {
            step: Arctan::new(params.mismatch_cells * h)?,
        };
        Self::assembled(start, end, steps, params, indicator, density)
    }

    /// Creates the energy with other smooth steps for the elastic weight and the mismatch.
    ///
    /// # Errors
    /// [`GeodesicError::GridsDiffer`].
    pub fn with_steps(
        start: ScalarField<f64, D>,
        end: ScalarField<f64, D>,
        steps: usize,
        params: &GeodesicParams,
        indicator: Step,
        density: HeavisideMismatch,
    ) -> Result<Self, GeodesicError> {
        let [start, end] = single(start, end)?;
        Self::assembled(start, end, steps, params, indicator, density)
    }

    fn assembled(
        start: ShapeOnGrid<D>,
        end: ShapeOnGrid<D>,
        steps: usize,
        params: &GeodesicParams,
        indicator: Step,
        density: HeavisideMismatch,
    ) -> Result<Self, GeodesicError> {
        let union = union_of(&start.components);
        let grid = *union.grid();
        let carried_step = Compact::new(CARRIED_CELLS * grid.spacing())?;
        let solid =
            (params.void_stiffness == 0.0).then(|| solid_cells(&grid, union.as_slice(), indicator));
        Ok(Self {
            grid,
            law: params.law.compile()?,
            params: params.clone(),
            steps,
            end: Match::new(&start, end, carried_step, params.deformed_share),
            start: None,
            union,
            indicator,
            density,
            carried_step,
            solid,
            energy: PathEnergy::default(),
            metric: None,
            targets: None,
            path: Vec::new(),
            path_gradient: Vec::new(),
            own: start.components,
        })
    }

    /// Creates the energy on the domain of a shape between both ends, which is deformed into all shapes of the path:
    /// displacements of `K + 1` deformations are unknown.
    ///
    /// # Errors
    /// As for [`PathObjective::new`].
    pub fn of_middle(
        own: ScalarField<f64, D>,
        [start, end]: [ScalarField<f64, D>; 2],
        steps: usize,
        params: &GeodesicParams,
    ) -> Result<Self, GeodesicError> {
        let [_, end] = single(own.clone(), end)?;
        let [own, start] = single(own, start)?;
        Self::from_between(own, [start, end], steps, params)
    }

    /// The energy on the domain of this shape, which lies between both ends, with an unknown deformation into
    /// the start shape in front of the others.
    pub(crate) fn from_between(
        own: ShapeOnGrid<D>,
        [start, end]: [ShapeOnGrid<D>; 2],
        steps: usize,
        params: &GeodesicParams,
    ) -> Result<Self, GeodesicError> {
        let of_start = own.clone();
        let objective = energy_between(own, end, steps, params)?;
        let (step, share) = (objective.carried_step, params.deformed_share);
        Ok(Self {
            start: Some(Match::new(&of_start, start, step, share)),
            ..objective
        })
    }

    /// The energy with the attraction of nodes to targets under the last deformation in place of the mismatch.
    pub(crate) fn towards(self, targets: Targets<D>) -> Self {
        Self {
            targets: Some(targets),
            ..self
        }
    }

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns the number of steps.
    pub fn steps(&self) -> usize {
        self.steps
    }

    fn weights(&self) -> ObjectWeights {
        ObjectWeights {
            indicator: self.indicator,
            void_stiffness: self.params.void_stiffness,
            void_viscosity: self.params.void_viscosity * self.params.law.moduli.mu,
        }
    }

    /// Returns the barrier of every deformation.
    fn barrier(&self) -> FoldBarrier {
        let barrier = fold_barrier(&self.params);
        FoldBarrier {
            weight: BARRIER * barrier.weight,
            ..barrier
        }
    }

    /// Returns the level set of the union of the components of the start shape.
    pub(super) fn level_set(&self) -> &ScalarField<f64, D> {
        &self.union
    }

    /// Returns the indicator of the start shape at all nodes.
    pub(crate) fn indicator(&self) -> Vec<f64> {
        let levels = self.union.as_slice().iter();
        levels.map(|u| self.indicator.value(*u)).collect()
    }

    /// Returns the terms of the last evaluation.
    pub fn energy(&self) -> &PathEnergy {
        &self.energy
    }

    /// Interpolates deformations towards the identity until they are admissible.
    pub(crate) fn repair(&self, x: &mut [f64]) {
        let bound = self.params.min_determinant;
        for u in x.chunks_exact_mut(self.dim_of_step()) {
            repair(&self.grid, u, bound, self.solid.as_deref());
        }
    }

    /// The weight of targets, which hold the object on the length of [`BETWEEN_TARGETS`]; 0 without them.
    fn attraction(&self) -> f64 {
        self.targets.as_ref().map_or(0.0, |targets| {
            self.params.law.moduli.mu / (BETWEEN_TARGETS * targets.spacing).powi(2)
        })
    }

    /// The number of unknown deformations.
    fn unknown(&self) -> usize {
        self.steps + usize::from(self.start.is_some())
    }

    /// The entries of the first deformation of the path where it is the identity.
    fn held(&self) -> usize {
        match self.start {
            Some(_) => 0,
            None => self.dim_of_step(),
        }
    }

    fn dim_of_step(&self) -> usize {
        D * self.grid.n_nodes()
    }

    fn admissible(&self, displacement: &[f64]) -> bool {
        let bound = self.params.min_determinant;
        certify_within(
            &self.grid,
            displacement,
            bound,
            bound,
            self.solid.as_deref(),
        )
        .certified
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
        evaluate_path(self, x, gradient, true)
    }

    /// Computes the gradient of all terms but the mismatch, which are smooth; returns whether the state is
    /// admissible.
    pub(super) fn smooth_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<bool, GeodesicError> {
        let found = evaluate_path(self, x, gradient, false)?;
        Ok(matches!(found, Evaluation::Value(energy) if energy.is_finite()))
    }

    fn evaluate_terms(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
        matched: bool,
    ) -> Result<Evaluation, GeodesicError> {
        let dim = self.dim_of_step();
        if !parallel::all(x.chunks_exact(dim), &|u| self.admissible(u)) {
            return Ok(Evaluation::Inadmissible);
        }
        let wanted = !gradient.is_empty();
        // With the identity in front where the first deformation is not unknown.
        let held = self.held();
        self.path.resize(x.len() + held, 0.0);
        self.path[held..].copy_from_slice(x);
        self.path_gradient
            .resize(if wanted { x.len() + held } else { 0 }, 0.0);
        self.path_gradient.fill(0.0);
        let count = self.steps as f64;
        let mut step_energies = Vec::with_capacity(self.steps);
        for k in 0..self.steps {
            let pair = k * dim..(k + 2) * dim;
            let term = StepTerm {
                kind: Kind::Path,
                law: &self.law,
                weights: self.weights(),
                level_set: self.union.as_slice(),
                state: &self.path[pair.clone()],
                factor: count,
                gradient: if wanted {
                    &mut self.path_gradient[pair]
                } else {
                    &mut []
                },
            };
            match term.add(&self.grid) {
                Ok(energy) => step_energies.push(energy),
                Err(GridError::Inadmissible { .. }) => return Ok(Evaluation::Inadmissible),
                Err(error) => return Err(error.into()),
            }
        }
        let behind = if wanted { self.steps * dim } else { 0 };
        let mut mismatches = vec![0.0];
        if matched {
            mismatches[0] = self.mismatch(At::End, &x[x.len() - dim..], behind)?;
            if self.start.is_some() {
                mismatches.push(self.mismatch(At::Start, &x[..dim], 0)?);
            }
        }
        let mut barrier = 0.0;
        if self.params.void_stiffness > 0.0 {
            let law = self.barrier();
            for (k, u) in x.chunks_exact(dim).enumerate() {
                let own = if wanted {
                    held + k * dim..held + (k + 1) * dim
                } else {
                    0..0
                };
                barrier +=
                    law.value_or_gradient_add(&self.grid, u, &mut self.path_gradient[own])?;
            }
        }
        if wanted {
            vector::copy_into(&self.path_gradient[held..], gradient);
        }
        let total = count * step_energies.iter().sum::<f64>()
            + self.params.resolved_mismatch_weight() * mismatches.iter().sum::<f64>()
            + barrier;
        self.energy = PathEnergy {
            step_energies,
            mismatches,
            areas: Vec::new(),
            barrier,
            total,
        };
        Ok(Evaluation::Value(total))
    }
}

impl<const D: usize> PathObjective<D> {
    /// Adds a multiple of the gradient of the weighted mismatch of the last deformation to `out`.
    pub(super) fn mismatch_gradient_add(
        &mut self,
        last: &[f64],
        factor: f64,
        out: &mut [f64],
    ) -> Result<(), GridError> {
        add_mismatch_gradient(self, last, factor, out)
    }

    fn mismatch_gradient_add_in(
        &mut self,
        last: &[f64],
        factor: f64,
        out: &mut [f64],
    ) -> Result<(), GridError> {
        self.path_gradient.clear();
        self.path_gradient.resize(last.len(), 0.0);
        self.mismatch(At::End, last, 0)?;
        vector::axpy(factor, &self.path_gradient, out);
        Ok(())
    }

    /// Returns the nodes where the mismatch depends on the last deformation, but for the tails of the smooth step:
    /// those around the boundary of the start shape, or all where a part of a shape is hidden.
    pub(super) fn matched_nodes(&self) -> Vec<bool> {
        let reach = self.carried_step.half_width() + AROUND * self.grid.spacing();
        let seen = self.end.known.in_step(1, 1);
        let hidden = seen.start.is_some() || seen.end.is_some();
        let levels = self.union.as_slice().iter();
        levels.map(|u| hidden || u.abs() <= reach).collect()
    }

    /// Computes the mismatch of the deformation at one end of the path, and adds its gradient times its weight to the
    /// path's from the entry `behind` on, unless that is empty.
    fn mismatch(&mut self, at: At, last: &[f64], behind: usize) -> Result<f64, GridError> {
        let attraction = self.attraction();
        let until = self.path_gradient.len().min(behind + last.len());
        let by_last = &mut self.path_gradient[behind..until];
        let matched = match (at, &self.start) {
            (At::Start, Some(start)) => start,
            _ => &self.end,
        };
        let weight = self.params.resolved_mismatch_weight();
        if let Some(targets) = &self.targets {
            return Ok(attraction_add(&self.grid, targets, attraction, last, by_last) / weight);
        }
        let by_composition = (self.density, &self.own[..]);
        let shares = [self.params.deformed_share, weight];
        matched.value_or_gradient_add(&self.grid, by_composition, shares, last, by_last)
    }
}

/// An end of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    Start,
    End,
}

/// Wraps two fully known shapes of one component each.
fn single<const D: usize>(
    start: ScalarField<f64, D>,
    end: ScalarField<f64, D>,
) -> Result<[ShapeOnGrid<D>; 2], GeodesicError> {
    if start.grid() != end.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    Ok([start, end].map(|u| ShapeOnGrid {
        components: vec![u],
        weight: None,
        only_covered: false,
    }))
}

impl<const D: usize> Objective for PathObjective<D> {
    type Error = GeodesicError;

    fn dim(&self) -> usize {
        self.unknown() * self.dim_of_step()
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

    /// The whole step is shortened where one of the deformations would fold. Damping it around the
    /// folds changes its direction: line searches then take half as many evaluations again, and end in
    /// jams of the void.
    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), GeodesicError> {
        let dim = self.dim_of_step();
        let deformations = x.chunks_exact(dim).enumerate();
        let deformations: Vec<_> = deformations
            .map(|(k, displacement)| Restrained {
                displacement,
                range: k * dim..(k + 1) * dim,
                within: self.solid.as_deref(),
            })
            .collect();
        let bound = self.params.min_determinant;
        shorten_together(&self.grid, &deformations, direction, bound);
        Ok(())
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), GeodesicError> {
        self.metric = None;
        let visibility = self.end.known.in_step(1, 1);
        let matched = self.targets.is_none();
        // From between, the metric is that of a path to the shape of the domain itself.
        let ends = match self.start {
            Some(_) => &self.own,
            None => &self.end.components,
        };
        let composed: Vec<_> = ends
            .iter()
            .filter(|_| matched)
            .map(|end| ComposedLevel {
                end: continued(end),
                visibility,
                share: 1.0 - self.params.deformed_share,
            })
            .collect();
        let carried: Vec<_> = self
            .own
            .iter()
            .filter(|_| matched)
            .map(|start| CarriedLevel {
                start: Interpolant::new(self.grid, start.as_slice()),
                step: self.carried_step,
                visibility,
                share: self.params.deformed_share,
            })
            .collect();
        let barrier = self.barrier();
        let form = ElasticForm {
            moduli: self.params.law.moduli,
            indicator: self.indicator,
            step: self.density.step,
            stiffness: 1.0,
            void_stiffness: METRIC_VOID,
            // All intermediate deformations have a barrier, and on average follow the last by half.
            barrier: FoldBarrier {
                weight: 0.5 * self.steps as f64 * METRIC_BARRIER * barrier.weight,
                ..barrier
            },
            mismatch_weight: self.params.resolved_mismatch_weight(),
            composed: &composed,
            carried: &carried,
            attraction: self.attraction(),
        };
        let level_set = self.union.as_slice();
        self.metric = Some(match self.start {
            Some(_) => PathMetric::between(self.grid, &form, level_set, x, self.steps)?,
            None => PathMetric::new(self.grid, &form, level_set, x, self.steps)?,
        });
        Ok(())
    }
}
