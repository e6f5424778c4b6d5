//! Options of `shapespace figure`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};
use shape_average::AverageParams;

use crate::config::{Config, Configured};
use crate::error::CliError;
use crate::options::{MaskOptions, RunOptions};

/// Options of `shapespace figure`.
#[derive(Clone, Debug, Args)]
pub struct FigureArgs {
    /// What is shown.
    #[arg(value_enum)]
    pub name: FigureName,
    /// On what it is shown.
    #[command(flatten)]
    pub config: Configured<FigureConfig>,
    /// Options that other commands have, too.
    #[command(flatten)]
    pub run: RunOptions,
}

/// The shapes and averages of a figure.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct FigureConfig {
    /// Masks to show it on, as for an average [default: shapes that the program draws].
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// How masks are read and placed.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// The law of the averages.
    #[serde(flatten)]
    #[command(flatten)]
    pub law: LawSpec,
    /// Stiffness outside the objects, relative to theirs.
    #[arg(long)]
    pub void_stiffness: f64,
    /// A level of an average ends when five iterations lower the energy's excess over the least
    /// possible mismatch by less than this share.
    #[arg(long, value_name = "SHARE")]
    pub tolerance: f64,
    /// Most iterations on a level of an average.
    #[arg(long, value_name = "N")]
    pub max_iterations: usize,
}

impl Default for FigureConfig {
    fn default() -> Self {
        let usual = AverageParams::default();
        Self {
            inputs: Vec::new(),
            masks: MaskOptions::default(),
            law: usual.law,
            void_stiffness: usual.void_stiffness,
            tolerance: 1e-5,
            max_iterations: usual.max_iterations,
        }
    }
}

impl FigureConfig {
    /// The same as an average takes it.
    pub(super) fn params(&self) -> AverageParams {
        AverageParams {
            law: self.law,
            void_stiffness: self.void_stiffness,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            ..AverageParams::default()
        }
    }
}

impl Config for FigureConfig {
    const COMMAND: &'static str = "figure";

    fn check(&self) -> Result<(), CliError> {
        Ok(self.params().check(self.inputs.len())?)
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        self.inputs.iter_mut().collect()
    }
}

/// Figures and tables about averages and modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FigureName {
    /// Averages on the way from one shape to another, and between three.
    Weights,
    /// Mean and median where the last fifth of the shapes is of another kind.
    Median,
    /// The stresses in the average, and how well they balance with more mismatch weight and finer
    /// grids.
    ForceBalance,
    /// The void soft, stiffer, and as stiff as the object.
    ElasticDomain,
    /// Materials that keep lengths against materials that keep volumes.
    Stiffness,
    /// Averages of more and more of the shapes.
    AddingShapes,
    /// From small to large weights of the mismatch.
    MismatchWeight,
    /// Deformations by large angles, and what they need.
    LargeBends,
    /// A part of one shape hidden, with and without knowledge of that.
    MissingParts,
    /// A law against its inverse model.
    InverseModel,
    /// The mode of two shapes with pins at different places.
    Pins,
    /// Modes by both inner products, with and without the stress in the average, of both materials.
    Modes,
}

impl FigureName {
    /// Fewest shapes that can show it.
    pub(super) fn fewest(self) -> usize {
        match self {
            Self::Median => 5,
            _ => 2,
        }
    }
}
