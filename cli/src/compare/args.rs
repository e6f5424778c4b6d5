//! Options of `shapespace compare`.

use std::path::PathBuf;

use clap::Args;
use serde::{Deserialize, Serialize};
use shape_pca::groups::Relabelling;

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::groups::{self, Wanted};
use crate::options::named;

/// Most relabellings.
const MOST: usize = 1_000_000;

/// Configuration of `shapespace compare`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct CompareConfig {
    /// Result directory of `shapespace pca` or `shapespace distances`.
    #[arg(value_name = "RESULT")]
    pub result: PathBuf,
    /// Table of the shapes as CSV with a header: the first column has their names or files, others their
    /// groups and covariates. Lines of other shapes are ignored. Or 'folder' or 'prefix': the folder of each
    /// file, or the beginning of its name, is its group.
    #[arg(long, value_name = "FILE.csv")]
    pub groups: PathBuf,
    /// Column of the groups [default: group, or class where there is none].
    #[arg(long, value_name = "NAME")]
    pub column: Option<String>,
    /// Columns of covariates, such as ages [default: every other column of numbers].
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub covariates: Vec<String>,
    /// Number of modes that are compared [default: those with at least 1 % of the variance].
    #[arg(long, value_name = "M")]
    pub modes: Option<usize>,
    /// Number of random relabellings; all different ones where there are no more, as of up to seven and seven
    /// shapes by default.
    #[arg(long, value_name = "N")]
    pub permutations: usize,
    /// Seed of the random relabellings.
    #[arg(long, value_name = "SEED")]
    pub seed: u64,
    /// False discovery rate up to which a point of the boundary counts as different.
    #[arg(long, value_name = "RATE")]
    pub discovery_rate: f64,
    /// Result directory of the average, if it has been moved.
    #[arg(long, value_name = "DIR")]
    pub average: Option<PathBuf>,
}

impl Default for CompareConfig {
    fn default() -> Self {
        let Relabelling { permutations, seed } = Relabelling::default();
        Self {
            result: PathBuf::new(),
            groups: PathBuf::new(),
            column: None,
            covariates: Vec::new(),
            modes: None,
            permutations,
            seed,
            discovery_rate: 0.05,
            average: None,
        }
    }
}

impl CompareConfig {
    /// The groups and covariates that are asked for.
    pub(super) fn wanted(&self) -> Wanted<'_> {
        Wanted {
            groups: &self.groups,
            column: self.column.as_deref(),
            covariates: &self.covariates,
        }
    }

    pub(super) fn relabelling(&self) -> Relabelling {
        Relabelling {
            permutations: self.permutations,
            seed: self.seed,
        }
    }
}

impl Config for CompareConfig {
    const COMMAND: &'static str = "compare";

    fn check(&self) -> Result<(), CliError> {
        named(
            Self::COMMAND,
            "the directory of modes or distances",
            &self.result,
        )?;
        named(Self::COMMAND, "a table after --groups", &self.groups)?;
        allow(self.modes != Some(0), "modes", &0, "at least 1")?;
        allow(
            (19..=MOST).contains(&self.permutations),
            "permutations",
            &self.permutations,
            "19 to 1000000: fewer cannot give a p-value of .05",
        )?;
        allow(
            self.discovery_rate > 0.0 && self.discovery_rate < 1.0,
            "discovery_rate",
            &self.discovery_rate,
            "above 0, below 1",
        )
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let table = groups::file(&mut self.groups);
        let own = std::iter::once(&mut self.result).chain(table);
        own.chain(&mut self.average).collect()
    }
}
