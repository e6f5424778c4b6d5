//! Options of `shapespace distances`.

use std::path::{Path, PathBuf};

use ::geodesic::distances::Linkage;
use ::geodesic::{Form, GeodesicParams};
use clap::Args;
use serde::{Deserialize, Serialize};

use super::classes;
use crate::config::{Config, Configured, allow};
use crate::error::CliError;
use crate::geodesic::{check_area, check_path};
use crate::options::{Align, MaskOptions, RunOptions, Size};

/// Options of `shapespace distances`.
#[derive(Clone, Debug, Args)]
pub struct DistancesArgs {
    /// What is computed.
    #[command(flatten)]
    pub config: Configured<DistancesConfig>,
    /// What the results do not depend on.
    #[command(flatten)]
    pub run: RunOptions,
    /// Paths computed at the same time [default: one a thread]; fewer need less memory. The
    /// results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub at_once: Option<u32>,
}

/// What `shapespace distances` computes.
///
/// Shapes are moved onto each other pair by pair unless told otherwise: a length does not depend
/// on where shapes lie, but what a minimiser finds does. Half as many steps as for one path are
/// enough, since the mean of both directions is correct to second order in them.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct DistancesConfig {
    /// Masks: PNG, PGM, PBM, PPM, TIFF, BMP, .npy, .nii or .nii.gz; the object bright.
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// How masks are read and placed; each pair is aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Sizes of the shapes: as the files have them, or all of the same area or volume. Pictures of
    /// things at different distances need the latter.
    #[arg(long, value_enum)]
    pub size: Size,
    /// Compute each path in one direction only, from the earlier to the later shape: half the
    /// work, but distances that are correct to first order in the steps only.
    #[arg(long)]
    pub one_way: bool,
    /// Compute all paths with half as many steps, too, and extrapolate their lengths.
    #[arg(long)]
    pub richardson: bool,
    /// Overlap (Dice) with the end shape from which on a path counts as one to it [default: what
    /// `geodesic` asks for, 0.95 or boundaries a quarter of a spacing apart]. The length of a path
    /// that falls short is too small, and stays marked.
    #[arg(long, value_name = "DICE")]
    pub reached: Option<f64>,
    /// Compute paths that do not reach their end, or fold, once more in this form.
    #[arg(long, value_enum, value_name = "FORM")]
    pub retry: Option<Form>,
    /// What the distance of two clusters is.
    #[arg(long, value_enum)]
    pub linkage: Linkage,
    /// Number of clusters [default: of the classes; without them, where the tree has its widest
    /// gap].
    #[arg(long, value_name = "N")]
    pub clusters: Option<usize>,
    /// Known classes: "folder" or "prefix" for those of the names, or a file of lines
    /// "file,class".
    #[arg(long, value_name = "folder|prefix|FILE")]
    pub classes: Option<PathBuf>,
    /// Parameters of the paths.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: GeodesicParams,
}

impl Default for DistancesConfig {
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            masks: MaskOptions {
                align: Align::Rigid,
                ..MaskOptions::default()
            },
            size: Size::default(),
            one_way: false,
            richardson: false,
            reached: None,
            retry: None,
            linkage: Linkage::default(),
            clusters: None,
            classes: None,
            params: GeodesicParams {
                steps: 4,
                ..GeodesicParams::default()
            },
        }
    }
}

impl Config for DistancesConfig {
    const COMMAND: &'static str = "distances";

    fn check(&self) -> Result<(), CliError> {
        let most = self.inputs.len();
        if most < 2 {
            return Err(CliError::TooFewInputs {
                command: Self::COMMAND,
                needed: 2,
                found: most,
            });
        }
        check_path(&self.params)?;
        if self.retry != Some(Form::LevelSets) {
            check_area(&self.params)?;
        }
        if self.retry == Some(self.params.form) {
            return Err(CliError::Option {
                option: "--retry",
                value: "with the same --form".into(),
                remedy: "name the other form, or leave it out".into(),
            });
        }
        if self.richardson && !self.params.steps.is_multiple_of(2) {
            return Err(CliError::Option {
                option: "--richardson",
                value: format!("with {} steps", self.params.steps),
                remedy: "choose an even number of steps (-K): paths of half as many are computed, \
                         too"
                .into(),
            });
        }
        let reached = self.reached.unwrap_or(1.0);
        let share = reached > 0.0 && reached <= 1.0;
        allow(share, "reached", &reached, "a number above 0 and up to 1")?;
        match self.clusters {
            Some(clusters) if clusters > most => Err(CliError::Option {
                option: "--clusters",
                value: clusters.to_string(),
                remedy: format!("there are {most} shapes, which make no more clusters"),
            }),
            clusters => allow(clusters != Some(0), "clusters", &0, "at least 1"),
        }
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let file = |path: &&mut PathBuf| !classes::NAMED.map(Path::new).contains(&path.as_path());
        let classes = self.classes.iter_mut().filter(file);
        self.inputs.iter_mut().chain(classes).collect()
    }
}

impl DistancesConfig {
    /// Numbers of steps of the paths that make a distance, the one that counts first.
    pub(super) fn steps(&self) -> Vec<usize> {
        let steps = self.params.steps;
        if self.richardson {
            vec![steps, steps / 2]
        } else {
            vec![steps]
        }
    }

    /// The forms of all attempts, first to last.
    pub(super) fn forms(&self) -> impl Iterator<Item = Form> + use<> {
        std::iter::once(self.params.form).chain(self.retry)
    }
}
