//! The report of a minimiser.

use serde::{Deserialize, Serialize};

/// Status of a minimisation at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The gradient is below the tolerance.
    GradientTolerance,
    /// The decrease of the energy over the last iterations is below the tolerance.
    EnergyTolerance,
    /// The maximal number of iterations was reached.
    MaxIterations,
    /// No step along the last direction decreases the energy: a minimum up to rounding, or the
    /// boundary of the admissible set.
    LineSearchFailed,
    /// The energy does not decrease along `-P g`: the metric is not positive definite there.
    IndefiniteMetric,
    /// The observer cancelled.
    Cancelled,
    /// The energy of the initial state is not finite.
    InadmissibleStart,
}

impl Status {
    /// Returns whether a tolerance was reached.
    pub fn converged(self) -> bool {
        matches!(self, Self::GradientTolerance | Self::EnergyTolerance)
    }
}

/// Numbers of calls of the parts of an objective.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evaluations {
    /// Number of energies without gradient.
    pub values: usize,
    /// Number of energies with gradient.
    pub gradients: usize,
    /// Applications of the inverse metric.
    pub metric_applications: usize,
    /// Times that the metric was made.
    pub metric_builds: usize,
    /// Applications of the Hessian.
    pub hessian_actions: usize,
}

impl Evaluations {
    /// Evaluations of the energy, with or without gradient.
    pub fn energies(&self) -> usize {
        self.values + self.gradients
    }
}

impl std::ops::AddAssign for Evaluations {
    fn add_assign(&mut self, other: Self) {
        self.values += other.values;
        self.gradients += other.gradients;
        self.metric_applications += other.metric_applications;
        self.metric_builds += other.metric_builds;
        self.hessian_actions += other.hessian_actions;
    }
}

/// The record of a minimisation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// How it ended.
    pub status: Status,
    /// Accepted steps.
    pub iterations: usize,
    /// Work done.
    pub evaluations: Evaluations,
    /// The energy at the start and after every accepted step, falling throughout; empty where
    /// the first state is inadmissible.
    pub energies: Vec<f64>,
    /// The gradient at the start in the method's inverse metric, `sqrt(g · P g)`.
    #[serde(skip)]
    pub first_gradient_norm: f64,
    /// The same at the end.
    #[serde(skip)]
    pub gradient_norm: f64,
}

impl Info {
    /// The lowest energy, where the first state is admissible.
    pub fn energy(&self) -> Option<f64> {
        self.energies.last().copied()
    }
}
