//! The optimal velocity of a variation, by an augmented Lagrangian.
//!
//! With the multipliers `p`, constant on the patches of the boundary, every round solves
//!
//! ```text
//! K v + rho B^T B v = rho B^T v_n - B^T p,      p <- p + rho (mean of B v - v_n),
//! ```
//!
//! where `B v` is `v . n` at the points of the boundary. The first rounds, whose multipliers are far from those
//! wanted, solve less exactly.

use super::boundary::BoundaryPoints;
use super::cut::ObjectCells;
use super::energy::{Dissipation, dissipation};
use super::operator::Augmented;
use super::params::MetricParams;
use super::variation::Variation;
use crate::error::GeodesicError;
use fe_grid::minimise::{Control, Ended, Evaluations, Iteration, Memory, Observer, Status};
use fe_grid::{
    CgParams, CgScratch, CgStatus, Field, Grid, ScalarField, compiled_once, conjugate_gradient,
    mutant, vector,
};

/// Residual of the linear systems, relative to the tolerance of the multipliers,
const CG_TOLERANCE: f64 = 1e-2;
/// or to this share of the residual of the round before, if that is larger.
const FORCING: f64 = 0.1;
/// Metric of a motion that is rigid up to errors, relative to `(lambda + 2 mu) int v_n^2` in the unit
/// box.
const NEARLY_RIGID: f64 = 1e-5;
/// Maximal number of iterations of a linear system.
const MOST_ITERATIONS: usize = 500;

/// The metric at one shape.
pub struct ShapeMetric<const D: usize> {
    cells: ObjectCells<D>,
    boundary: BoundaryPoints<D>,
    params: MetricParams,
}

/// The optimal velocity of a variation.
#[derive(Clone, Debug)]
pub struct Flow<const D: usize> {
    /// The velocity at the nodes; only inside the object and in its cells it is that of the fluid. Of
    /// velocities that differ by rigid motions along the boundary, as in a disk, it is the slowest.
    pub velocity: Field<f64, D, D>,
    /// The density of the dissipation at the nodes, zero outside.
    pub density: ScalarField<f64, D>,
    dissipation: Dissipation<D>,
    /// `lambda + 2 mu`.
    stiffness: f64,
    /// Length or area of the boundary.
    pub boundary: f64,
    /// `(int v_n^2)^(1/2)` over the boundary.
    pub variation_norm: f64,
    /// `(int (v . n - v_n)^2)^(1/2)` over the boundary, relative to that of `v_n`; zero for no
    /// variation.
    pub residual: f64,
    /// The same of the means over the patches, which the multipliers bring to zero.
    pub patch_residual: f64,
    /// Energy of the void at its small stiffness, relative to the dissipation in the object; zero
    /// without dissipation.
    pub void_share: f64,
    /// Rounds of the augmented Lagrangian, each an update of the multipliers.
    pub rounds: usize,
    /// Iterations of conjugate gradients in all rounds.
    pub iterations: usize,
    /// Whether the multipliers have converged.
    pub converged: bool,
}

impl<const D: usize> Flow<D> {
    /// `G(v_n, v_n)`.
    pub fn metric(&self) -> f64 {
        self.dissipation.total
    }

    /// Whether the flow deforms the object beyond the tolerances of the solvers. A rigid motion has a
    /// metric of zero, up to errors in which no parts can be distinguished.
    pub fn deforms(&self) -> bool {
        let least = NEARLY_RIGID * self.stiffness * self.variation_norm * self.variation_norm;
        self.dissipation.total > least
    }

    /// The part `int (lambda/2 + mu/d) (tr e)^2` of `G`, by change of volume.
    pub fn volume_part(&self) -> f64 {
        self.dissipation.volume
    }

    /// The part `int mu |e - (tr e)/d|^2` of `G`, by shear.
    pub fn shear_part(&self) -> f64 {
        self.dissipation.total - self.dissipation.volume
    }
}

compiled_once! {
    fn metric_at<'a, D>(
        distance: &'a ScalarField<f64, D>,
        params: &'a MetricParams,
    ) -> Result<ShapeMetric<D>, GeodesicError> = ShapeMetric::at;
}

impl<const D: usize> ShapeMetric<D> {
    /// The metric at the shape `{u > 0}` of a signed distance, positive inside.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] for the parameters;
    /// [`GeodesicError::NotFinite`] and [`GeodesicError::Degenerate`] for the shape.
    pub fn new(
        distance: &ScalarField<f64, D>,
        params: &MetricParams,
    ) -> Result<Self, GeodesicError> {
        metric_at(distance, params)
    }

    fn at(distance: &ScalarField<f64, D>, params: &MetricParams) -> Result<Self, GeodesicError> {
        params.check()?;
        let which = "start";
        if let Some(node) = distance.as_slice().iter().position(|u| !u.is_finite()) {
            return Err(GeodesicError::NotFinite { which, node });
        }
        if distance.as_slice().iter().all(|&u| u <= 0.0) {
            let what = "empty";
            return Err(GeodesicError::Degenerate { which, what });
        }
        Ok(Self {
            cells: ObjectCells::new(distance),
            boundary: BoundaryPoints::new(distance)?,
            params: *params,
        })
    }

    /// The boundary of the shape.
    pub fn boundary(&self) -> &BoundaryPoints<D> {
        &self.boundary
    }

    /// Computes the optimal velocity of a variation. The observer is told of every round, with the residual in
    /// the place of an energy, and may cancel; the result is then that of the last round.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] for a variation that is not finite; [`GeodesicError::Grid`] where
    /// the linear systems are not definite, which happens for extreme parameters.
    pub fn flow(
        &self,
        variation: &Variation<D>,
        observer: &mut dyn Observer,
    ) -> Result<Flow<D>, GeodesicError> {
        flow_of(self, variation, observer)
    }

    /// Computes `G(a, b)`, the bilinear form of the metric, from the flows of both variations.
    pub fn product(&self, a: &Flow<D>, b: &Flow<D>) -> f64 {
        let combined = |sign: f64| {
            let mut sum = a.velocity.clone();
            vector::axpy(sign, b.velocity.as_slice(), sum.as_mut_slice());
            dissipation(&sum, &self.cells, self.params.moduli).total
        };
        0.25 * (combined(1.0) - combined(-1.0))
    }

    fn flow_in(
        &self,
        variation: &Variation<D>,
        observer: &mut dyn Observer,
    ) -> Result<Flow<D>, GeodesicError> {
        let boundary = &self.boundary;
        let wanted: Vec<f64> = boundary.points().iter().map(|p| variation.at(p)).collect();
        if let Some(&value) = wanted.iter().find(|v| !v.is_finite()) {
            return Err(GeodesicError::Parameter {
                name: "the normal velocity",
                expected: "finite",
                value,
            });
        }
        let size = boundary.norm(&wanted);
        let mut state = State::at_rest(self.cells.grid, boundary.n_patches());
        if size > 0.0 {
            self.solve(&wanted, size, &mut state, observer)?;
        } else {
            state.converged = true;
            state.residual = 0.0;
        }
        Ok(self.finished(&state, &wanted, size))
    }

    fn solve(
        &self,
        wanted: &[f64],
        size: f64,
        state: &mut State,
        observer: &mut dyn Observer,
    ) -> Result<(), GeodesicError> {
        let (boundary, params) = (&self.boundary, &self.params);
        if observer.resume().is_some_and(|found| state.restore(found)) {
            return Ok(());
        }
        let operator = Augmented::new(&self.cells, boundary, params)?;
        let mut scratch = CgScratch::default();
        let mut load = vec![0.0; state.velocity.len()];
        while state.rounds < params.max_iterations {
            let forcing = FORCING * state.residual;
            let solver = CgParams {
                relative_tolerance: CG_TOLERANCE * params.tolerance.max(forcing),
                max_iterations: MOST_ITERATIONS,
                ..CgParams::default()
            };
            let points = boundary.points().iter().zip(wanted);
            let pressed: Vec<f64> = points
                .map(|(point, value)| operator.penalty * value - state.multipliers[point.patch])
                .collect();
            load.fill(0.0);
            boundary.add_load(&pressed, 1.0, &mut load);
            let info = conjugate_gradient(
                &operator,
                operator.preconditioner(),
                &load,
                &mut state.velocity,
                &solver,
                &mut scratch,
            )?;
            state.rounds += 1;
            state.iterations += info.iterations;
            let means = boundary.means(&self.defect(&state.velocity, wanted));
            for (multiplier, mean) in state.multipliers.iter_mut().zip(&means) {
                *multiplier += mutant!(operator.penalty, MetricPenalty => 0.0) * mean;
            }
            state.residual = boundary.norm_of_means(&means) / size;
            let solved = info.status == CgStatus::Converged && forcing <= params.tolerance;
            state.converged = solved && state.residual <= params.tolerance;
            let ends = state.converged || state.rounds >= params.max_iterations;
            observer.memory(&state.memory(ends));
            if observer.iteration(&state.iteration()) == Control::Cancel || ends {
                break;
            }
        }
        Ok(())
    }

    /// `v . n - v_n` at the points of the boundary.
    fn defect(&self, velocity: &[f64], wanted: &[f64]) -> Vec<f64> {
        let mut defect = self.boundary.normal_component(velocity);
        vector::axpy(-1.0, wanted, &mut defect);
        defect
    }

    fn finished(&self, state: &State, wanted: &[f64], size: f64) -> Flow<D> {
        let defect = self.boundary.norm(&self.defect(&state.velocity, wanted));
        let mut velocity = Field::zeros(self.cells.grid);
        velocity.as_mut_slice().copy_from_slice(&state.velocity);
        let moduli = self.params.moduli;
        let found = dissipation(&velocity, &self.cells, moduli);
        let relative = |value: f64, to: f64| if to > 0.0 { value / to } else { 0.0 };
        Flow {
            density: found.density(&self.cells),
            stiffness: moduli.lambda + 2.0 * moduli.mu,
            boundary: self.boundary.measure(),
            variation_norm: size,
            residual: relative(defect, size),
            patch_residual: state.residual,
            void_share: relative(
                self.params.void_stiffness * (found.everywhere - found.total).max(0.0),
                found.total,
            ),
            rounds: state.rounds,
            iterations: state.iterations,
            converged: state.converged,
            dissipation: found,
            velocity,
        }
    }
}

/// The state of the augmented Lagrangian.
struct State {
    velocity: Vec<f64>,
    multipliers: Vec<f64>,
    residual: f64,
    rounds: usize,
    iterations: usize,
    converged: bool,
}

impl State {
    fn at_rest<const D: usize>(grid: Grid<D>, patches: usize) -> Self {
        Self {
            velocity: vec![0.0; D * grid.n_nodes()],
            multipliers: vec![0.0; patches],
            residual: 1.0,
            rounds: 0,
            iterations: 0,
            converged: false,
        }
    }

    /// The state for an observer.
    fn iteration(&self) -> Iteration<'_> {
        Iteration {
            iteration: self.rounds,
            energy: self.residual,
            gradient_norm: 0.0,
            step_length: 1.0,
            evaluations: Evaluations {
                gradients: self.iterations,
                ..Evaluations::default()
            },
            x: &self.velocity,
        }
    }

    /// The state for a checkpoint, with the multipliers in the place of a gradient.
    fn memory(&self, ends: bool) -> Memory<'_> {
        let numbers = [
            self.residual,
            self.rounds as f64,
            self.iterations as f64,
            f64::from(u8::from(self.converged)),
        ];
        let status = if self.converged {
            Status::GradientTolerance
        } else {
            Status::MaxIterations
        };
        Memory {
            gradient: (&self.multipliers[..]).into(),
            ended: ends.then_some(Ended {
                status,
                gradient_norm: 0.0,
            }),
            ..Memory::of_result(&self.velocity, numbers.to_vec())
        }
    }

    /// Takes over a state, if it is one of this boundary; returns whether it was the last.
    fn restore(&mut self, memory: Memory<'static>) -> bool {
        let fits = memory.x.len() == self.velocity.len()
            && memory.gradient.len() == self.multipliers.len();
        let [residual, rounds, iterations, converged] = *memory.objective else {
            return false;
        };
        if !fits {
            return false;
        }
        *self = Self {
            velocity: memory.x.into_owned(),
            multipliers: memory.gradient.into_owned(),
            residual,
            rounds: rounds as usize,
            iterations: iterations as usize,
            converged: converged > 0.0,
        };
        memory.ended.is_some()
    }
}

compiled_once! {
    /// The flow of a variation.
    fn flow_of<'a, D>(
        metric: &'a ShapeMetric<D>,
        variation: &'a Variation<D>,
        observer: &'a mut dyn Observer,
    ) -> Result<Flow<D>, GeodesicError> = ShapeMetric::flow_in;
}
