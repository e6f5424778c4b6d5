//! Options of `shapespace pca`, `shapespace synthesize` and `shapespace score`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Deserialize, Serialize};
use shape_pca::{Metric, PcaParams, Variation};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::groups::{self, Wanted};
use crate::numbers::shown;
use crate::options::{Align, Size, named};
use shapespace_input::Kinds;

/// The largest score, in standard deviations.
const MOST_DEVIATIONS: f64 = 1000.0;

/// Configuration of `shapespace pca`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct PcaConfig {
    /// Result directory of `shapespace average`.
    #[arg(value_name = "AVERAGE")]
    pub average: PathBuf,
    /// Maximum number of modes [default: all].
    #[arg(long, value_name = "M")]
    pub modes: Option<usize>,
    /// Largest score of the drawn shapes, in standard deviations.
    #[arg(long, value_name = "A")]
    pub amplitude: f64,
    /// Table of the shapes as CSV with a header, 'folder' or 'prefix', as for `shapespace compare`: shapes at their
    /// scores are drawn in the colours of their groups. The modes do not depend on it.
    #[arg(long, value_name = "FILE.csv")]
    pub groups: Option<PathBuf>,
    /// Column of the groups [default: group, or class where there is none].
    #[arg(long, value_name = "NAME")]
    pub column: Option<String>,
    /// Use the average as it is. Without this option an average whose stresses do not balance is moved
    /// until they do: all its deformations are followed by the same further one, of least elastic energy.
    #[arg(long)]
    pub keep_average: bool,
    /// Parameters of the analysis.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: PcaParams,
}

impl Default for PcaConfig {
    fn default() -> Self {
        Self {
            average: PathBuf::new(),
            modes: None,
            amplitude: 2.0,
            groups: None,
            column: None,
            keep_average: false,
            params: PcaParams::default(),
        }
    }
}

impl PcaConfig {
    /// The groups that are asked for.
    pub(super) fn wanted(&self) -> Option<Wanted<'_>> {
        Some(Wanted {
            groups: self.groups.as_deref()?,
            column: self.column.as_deref(),
            covariates: &[],
        })
    }
}

impl Config for PcaConfig {
    const COMMAND: &'static str = "pca";

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, "the directory of an average", &self.average)?;
        allow(self.modes != Some(0), "modes", &0, "at least 1")?;
        let amplitude = self.amplitude;
        allow(
            amplitude > 0.0 && amplitude <= MOST_DEVIATIONS,
            "amplitude",
            &shown(amplitude),
            &format!("above 0, at most {MOST_DEVIATIONS}"),
        )?;
        if let (Some(column), None) = (&self.column, &self.groups) {
            return Err(CliError::Option {
                option: "--column",
                value: column.clone(),
                remedy: "name its table with --groups, too".into(),
            });
        }
        let elastic =
            self.params.variation == Variation::Stress || self.params.metric == Metric::Hessian;
        if self.params.at_rest && !elastic {
            return Err(CliError::Option {
                option: "--at-rest",
                value: "with --variation displacement and --metric l2".into(),
                remedy: "leave it out: nothing is elastic in this analysis".into(),
            });
        }
        Ok(self.params.check()?)
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let table = self.groups.as_mut().and_then(groups::file);
        std::iter::once(&mut self.average).chain(table).collect()
    }
}

/// Configuration of `shapespace synthesize`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SynthesizeConfig {
    /// Result directory of `shapespace pca`.
    #[arg(value_name = "PCA")]
    pub pca: PathBuf,
    /// Scores in the first modes, in standard deviations.
    #[arg(
        long,
        value_name = "S,S,..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub scores: Vec<f64>,
    /// Solve the nonlinear elastic problem under the load of the modes, instead of displacing the
    /// average by the linear combination of modes.
    #[arg(long)]
    pub nonlinear: bool,
    /// Number of load steps, with --nonlinear.
    #[arg(long, value_name = "N")]
    pub load_steps: usize,
    /// Result directory of the average, if it has been moved.
    #[arg(long, value_name = "DIR")]
    pub average: Option<PathBuf>,
}

impl Default for SynthesizeConfig {
    fn default() -> Self {
        Self {
            pca: PathBuf::new(),
            scores: Vec::new(),
            nonlinear: false,
            load_steps: 4,
            average: None,
        }
    }
}

impl Config for SynthesizeConfig {
    const COMMAND: &'static str = "synthesize";

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, "the directory of modes", &self.pca)?;
        if self.scores.is_empty() {
            let (command, what) = (Self::COMMAND, "--scores, such as --scores 2,-1");
            return Err(CliError::Missing { command, what });
        }
        let in_range = |s: &f64| s.abs() <= MOST_DEVIATIONS;
        let numbers = self.scores.iter().all(in_range);
        let scores: Vec<String> = self.scores.iter().copied().map(shown).collect();
        let expected = format!("numbers from -{MOST_DEVIATIONS} to {MOST_DEVIATIONS}");
        allow(numbers, "scores", &scores.join(","), &expected)?;
        let steps = self.load_steps;
        allow(
            (1..=1000).contains(&steps),
            "load_steps",
            &steps,
            "1 to 1000",
        )
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        std::iter::once(&mut self.pca)
            .chain(&mut self.average)
            .collect()
    }
}

/// Configuration of `shapespace score`.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ScoreConfig {
    /// Masks of new shapes, in the formats of `shapespace average`.
    #[arg(value_name = "NEW")]
    pub inputs: Vec<PathBuf>,
    /// Result directory of `shapespace pca`.
    #[arg(long, value_name = "PCA")]
    pub pca: PathBuf,
    /// Rigid alignment of a new shape with the average [default: as for the shapes of the average].
    #[arg(long, value_enum)]
    pub align: Option<Align>,
    /// Size of a new shape relative to those of the average [default: as for the shapes of the
    /// average].
    #[arg(long, value_enum)]
    pub size: Option<Size>,
    /// Label of the object in label images [default: as for the shapes of the average].
    #[arg(long, value_name = "N")]
    pub label: Option<i64>,
    /// The object is dark, and its background is bright [default: as for the shapes of the average].
    #[arg(long)]
    pub invert: bool,
    /// Result directory of the average, if it has been moved.
    #[arg(long, value_name = "DIR")]
    pub average: Option<PathBuf>,
}

impl Config for ScoreConfig {
    const COMMAND: &'static str = "score";

    fn may_align(&self) -> bool {
        self.align != Some(Align::Rigid)
    }

    fn check(&self) -> Result<(), CliError> {
        let first = self.inputs.first().map_or(Path::new(""), PathBuf::as_path);
        named(Self::COMMAND, "a mask", first)?;
        named(
            Self::COMMAND,
            "the directory of modes after --pca",
            &self.pca,
        )
    }

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        vec![(&mut self.inputs, Kinds::Masks)]
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let directories = std::iter::once(&mut self.pca).chain(&mut self.average);
        self.inputs.iter_mut().chain(directories).collect()
    }
}
