//! Options of `shapespace extend` and `shapespace transport`.

use std::path::PathBuf;

use ::geodesic::calculus::CalculusParams;
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::config::{Config, Configured, allow};
use crate::error::CliError;
use crate::options::{RunOptions, named};

/// Options of `shapespace extend`.
#[derive(Clone, Debug, Args)]
pub struct ExtendArgs {
    /// What is computed.
    #[command(flatten)]
    pub config: Configured<ExtendConfig>,
    /// What the results do not depend on.
    #[command(flatten)]
    pub run: RunOptions,
}

/// What `shapespace extend` computes.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ExtendConfig {
    /// Directory of a geodesic of `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// Steps beyond the end [default: as many as the geodesic has].
    #[arg(long, value_name = "N")]
    pub steps: Option<usize>,
    /// How each equation is solved.
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

/// Options of `shapespace transport`.
#[derive(Clone, Debug, Args)]
pub struct TransportArgs {
    /// What is computed.
    #[command(flatten)]
    pub config: Configured<TransportConfig>,
    /// What the results do not depend on.
    #[command(flatten)]
    pub run: RunOptions,
}

/// What `shapespace transport` computes.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct TransportConfig {
    /// Directory of a geodesic of `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// A shape near the geodesic's first, a mask of the same size.
    #[arg(value_name = "VARIATION")]
    pub variation: PathBuf,
    /// Steps from the first shape to the variation, and from the last to its counterpart.
    #[arg(long, value_name = "N")]
    pub steps: usize,
    /// In a label image, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N")]
    pub label: Option<i64>,
    /// How each equation is solved.
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

/// How the equation of every step is solved.
#[derive(Clone, Copy, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SolverOptions {
    /// A step is found when the correction that is left is this share of it.
    #[arg(long, value_name = "SHARE")]
    pub tolerance: f64,
    /// Most iterations of one step.
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
    /// The same in a metric.
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
