//! Finite loads: the nonlinear elastic response of the compound object.
//!
//! For fixed deformations `phi_i` and a load `f` the displacement `w` minimises
//!
//! ```text
//! E[w] = sum_i lambda_i W_i[(1 + w) o phi_i] - F_0 . w - f . w,   int_O w = 0, int_O x cross w = 0.
//! ```
//!
//! With `f = delta int sigma_k : D.` and `w = delta u` this is `E_k[delta, u]` of Lemma 5.1, whose
//! limit for `delta -> 0` is the linear response. `F_0 = sum_i lambda_i int sigma_i : D.` is the
//! load of the average's own stresses: it is zero in the theory, and in a computed average it
//! balances the forces of the mismatch and of the interface length. It is subtracted, so that
//! `w = 0` is in equilibrium without a load.

use crate::average::Average;
use crate::compound::{Source, evaluate};
use crate::error::PcaError;
use crate::operator::{Compound, multiply};
use fe_grid::minimise::{
    Evaluation, Info, Minimiser, NewtonCgParams, Objective, Observer, SecondOrder, Status, Stopping,
};
use fe_grid::pullback::{Derivatives, Pullback};
use fe_grid::stencil::BlockStencil;
use fe_grid::vector::{axpy, dot};
use fe_grid::{Field, GridError, VectorField, compiled_once, mutant};

compiled_once! {
    fn respond<'a, D>(
        problem: &'a Finite<'a, D>,
        load: &'a [f64],
        observer: &'a mut dyn Observer,
    ) -> Result<(VectorField<f64, D>, FiniteReport), PcaError> = Finite::response;
}

/// The nonlinear elastic problem of an average.
pub struct Finite<'a, const D: usize> {
    compound: &'a Compound<D>,
    sources: Vec<Source<'a>>,
    void_stiffness: f64,
    /// Number of steps in which a load is applied.
    pub load_steps: usize,
    /// Relative tolerance of an iteration, with respect to the work of the load.
    pub tolerance: f64,
}

/// Report on a nonlinear solve.
#[derive(Clone, Debug, PartialEq)]
pub struct FiniteReport {
    /// Records of the minimiser for every load step.
    pub steps: Vec<Info>,
    /// Fraction of the load that was reached: below one if a step failed.
    pub share: f64,
}

impl<'a, const D: usize> Finite<'a, D> {
    /// Creates the problem of an average and its operator.
    pub fn new(average: &'a Average<D>, compound: &'a Compound<D>) -> Self {
        let (sources, void_stiffness) = average.compound_sources(compound.params());
        Self {
            compound,
            sources,
            void_stiffness,
            load_steps: 1,
            tolerance: 1e-10,
        }
    }

    /// Computes the response to a load. The observer may cancel; the state that has been reached is returned then.
    ///
    /// # Errors
    /// Those of the law and of the grid layer. Failure to converge is not an error; it is reported.
    ///
    /// # Panics
    /// If the load does not have `D` components of the grid.
    pub fn respond(
        &self,
        load: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<(VectorField<f64, D>, FiniteReport), PcaError> {
        assert_eq!(load.len(), D * self.compound.grid().n_nodes());
        respond(self, load, observer)
    }

    fn response(
        &self,
        load: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<(VectorField<f64, D>, FiniteReport), PcaError> {
        let grid = *self.compound.grid();
        let mut w = vec![0.0; load.len()];
        let mut report = FiniteReport {
            steps: Vec::new(),
            share: 0.0,
        };
        for step in 1..=self.load_steps.max(1) {
            let share = step as f64 / self.load_steps.max(1) as f64;
            let mut objective = Loaded {
                problem: self,
                load,
                share,
                hessian: None,
            };
            let mut next = w.clone();
            let minimiser = NewtonCgParams {
                max_inner_iterations: 400,
                max_forcing: 0.1,
                stopping: Stopping {
                    relative_gradient: self.tolerance,
                    relative_decrement: 0.0,
                    relative_energy: 0.0,
                    max_iterations: 60,
                    ..Stopping::default()
                },
                ..NewtonCgParams::default()
            };
            let info = minimiser.minimise(&mut objective, &mut next, observer)?;
            let cancelled = info.status == Status::Cancelled;
            // A load of zero is reached without a step.
            let reached = info.iterations > 0 || info.status.converged();
            report.steps.push(info);
            if !reached {
                break;
            }
            w = next;
            if cancelled {
                break;
            }
            report.share = share;
        }
        self.compound.rigid().constrain(&mut w);
        Ok((Field::from_vec(grid, w)?, report))
    }

    fn evaluate(
        &self,
        w: &[f64],
        derivatives: Derivatives,
    ) -> Result<Option<Pullback<D>>, PcaError> {
        let found = evaluate(
            self.compound.grid(),
            self.compound.law(),
            self.void_stiffness,
            &self.sources,
            w,
            derivatives,
        );
        match found {
            Ok(found) => Ok(Some(found)),
            Err(PcaError::Grid(GridError::Inadmissible { .. })) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// The energy under a fraction of a load.
struct Loaded<'a, const D: usize> {
    problem: &'a Finite<'a, D>,
    load: &'a [f64],
    share: f64,
    hessian: Option<BlockStencil<D, D>>,
}

impl<const D: usize> Loaded<'_, D> {
    fn work(&self, w: &[f64]) -> f64 {
        dot(self.problem.compound.imbalance(), w) + self.share * dot(self.load, w)
    }
}

impl<const D: usize> Objective for Loaded<'_, D> {
    type Error = PcaError;

    fn dim(&self) -> usize {
        self.load.len()
    }

    fn value_and_gradient(
        &mut self,
        w: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, PcaError> {
        let Some(found) = self.problem.evaluate(w, Derivatives::Gradient)? else {
            return Ok(Evaluation::Inadmissible);
        };
        gradient.copy_from_slice(&found.gradient);
        let share = mutant!(-1.0, ImbalanceKept => 0.0);
        axpy(share, self.problem.compound.imbalance(), gradient);
        axpy(-self.share, self.load, gradient);
        self.problem.compound.rigid().balance(gradient);
        Ok(Evaluation::Value(found.value - self.work(w)))
    }

    fn value(&mut self, w: &[f64]) -> Result<Evaluation, PcaError> {
        let found = self.problem.evaluate(w, Derivatives::Value)?;
        Ok(found.map_or(Evaluation::Inadmissible, |found| {
            Evaluation::Value(found.value - self.work(w))
        }))
    }

    fn apply_inverse_metric(&mut self, gradient: &[f64], out: &mut [f64]) -> Result<(), PcaError> {
        self.problem.compound.precondition_into(gradient, out);
        Ok(())
    }

    /// The Hessian is evaluated at the same state as the metric.
    fn update_metric(&mut self, w: &[f64]) -> Result<(), PcaError> {
        // The old one is freed first; two at a time would double the memory.
        self.hessian = None;
        let found = self.problem.evaluate(w, Derivatives::Hessian)?;
        self.hessian = found
            .and_then(|found| found.hessian)
            .map(|(matrix, _)| matrix);
        Ok(())
    }
}

impl<const D: usize> SecondOrder for Loaded<'_, D> {
    fn hessian_action(
        &mut self,
        w: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), PcaError> {
        if self.hessian.is_none() {
            self.update_metric(w)?;
        }
        match &self.hessian {
            Some(matrix) => multiply(matrix, direction, out),
            None => out.fill(0.0),
        }
        self.problem.compound.rigid().balance(out);
        Ok(())
    }
}
