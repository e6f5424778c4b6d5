//! What a minimiser reports.

use serde::Serialize;

/// How a minimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The gradient is as small as asked.
    GradientTolerance,
    /// The energy hardly fell over the last iterations.
    EnergyTolerance,
    /// All iterations were used.
    MaxIterations,
    /// No step along the last direction lowers the energy: a minimum up to rounding, or a wall.
    LineSearchFailed,
    /// The energy does not fall along `-P g`: the metric is not positive definite there.
    IndefiniteMetric,
    /// The observer asked to stop.
    Cancelled,
    /// There is no finite energy at the first state.
    InadmissibleStart,
}

impl Status {
    /// Whether a tolerance was reached.
    pub fn converged(self) -> bool {
        matches!(self, Self::GradientTolerance | Self::EnergyTolerance)
    }
}

/// How often the parts of an objective were called.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Evaluations {
    /// Energies without gradient.
    pub values: usize,
    /// Energies with gradient.
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
