//! Options of `shapespace extend` and `shapespace transport`.

use std::path::PathBuf;

use ::geodesic::calculus::CalculusParams;
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::options::named;

/// Configuration of `shapespace extend`.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ExtendConfig {
    /// Result directory of `shapespace geodesic` with `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// Number of steps beyond the end [default: the number of steps of the geodesic].
    #[arg(short = 'K', long, value_name = "N")]
    pub steps: Option<usize>,
    /// Solver of the equation of every step.
    #[serde(flatten)]
    #[command(flatten)]
    pub solver: SolverOptions,
}

impl Config for ExtendConfig {
    const COMMAND: &'static str = "extend";

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, GEODESIC, &self.geodesic)?;
        let steps = self.steps.unwrap_or(1);
        allow((1..=1024).contains(&steps), "steps", &steps, "1 to 1024")?;
        self.solver.check()
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.geodesic]
    }
}

/// Configuration of `shapespace transport`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct TransportConfig {
    /// Result directory of `shapespace geodesic` with `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// Mask of a shape near the first shape of the geodesic: with its samples, or with a place in the world, or
    /// coordinates of its own, as that.
    #[arg(value_name = "VARIATION")]
    pub variation: PathBuf,
    /// Number of steps from the first shape to the variation, and from the last shape to its
    /// counterpart.
    #[arg(long, value_name = "N")]
    pub steps: usize,
    /// Label of the object in a label image [default: as for the geodesic].
    #[arg(long, value_name = "N")]
    pub label: Option<i64>,
    /// The object is dark, and its background is bright [default: as for the geodesic].
    #[arg(long)]
    pub invert: bool,
    /// Solver of the equation of every step.
    #[serde(flatten)]
    #[command(flatten)]
    pub solver: SolverOptions,
}

impl Default for TransportConfig {
    fn default() -> Self {
        Self {
            geodesic: PathBuf::new(),
            variation: PathBuf::new(),
            steps: 4,
            label: None,
            invert: false,
            solver: SolverOptions::default(),
        }
    }
}

impl Config for TransportConfig {
    const COMMAND: &'static str = "transport";

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, GEODESIC, &self.geodesic)?;
        named(Self::COMMAND, "a mask, the variation", &self.variation)?;
        let steps = self.steps;
        allow((1..=256).contains(&steps), "steps", &steps, "1 to 256")?;
        self.solver.check()
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.geodesic, &mut self.variation]
    }
}

const GEODESIC: &str = "the directory of a geodesic";

/// Solver of the equation of every step.
#[derive(Clone, Copy, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SolverOptions {
    /// Stopping tolerance: remaining correction relative to the step.
    #[arg(long, value_name = "SHARE")]
    pub tolerance: f64,
    /// Maximum number of iterations per step.
    #[arg(long, value_name = "N")]
    pub max_iterations: usize,
}

impl Default for SolverOptions {
    fn default() -> Self {
        let usual = CalculusParams::default();
        Self {
            tolerance: usual.tolerance,
            max_iterations: usual.max_iterations,
        }
    }
}

impl SolverOptions {
    /// The parameters of the calculus in this metric.
    pub(super) fn params(self, metric: &CalculusParams) -> CalculusParams {
        CalculusParams {
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            ..metric.clone()
        }
    }

    fn check(self) -> Result<(), CliError> {
        Ok(self.params(&CalculusParams::default()).check()?)
    }
}
