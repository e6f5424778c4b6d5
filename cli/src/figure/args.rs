//! Options of `shapespace figure`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};
use shape_average::AverageParams;

use crate::config::{Config, Configured};
use crate::error::CliError;
use crate::options::{CheckpointOption, MaskOptions, RunOptions};
use shapespace_input::Kinds;

/// Options of `shapespace figure`.
#[derive(Clone, Debug, Args)]
pub struct FigureArgs {
    /// The figure.
    #[arg(value_enum)]
    pub name: FigureName,
    /// Its shapes and parameters.
    #[command(flatten)]
    pub config: Configured<FigureConfig>,
    /// Options shared with other commands.
    #[command(flatten)]
    pub run: RunOptions,
    /// When checkpoints are stored.
    #[command(flatten)]
    pub checkpoint: CheckpointOption,
}

/// Configuration of `shapespace figure`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct FigureConfig {
    /// Input masks, as for `shapespace average` [default: built-in shapes].
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// How masks are read, placed and aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// The elastic law of the averages.
    #[serde(flatten)]
    #[command(flatten)]
    pub law: LawSpec,
    /// Stiffness of the void outside the objects, relative to the objects.
    #[arg(long)]
    pub void_stiffness: f64,
    /// Stopping tolerance of a level of an average: five iterations lower the energy by less than
    /// this, relative to the excess of the energy over the smallest possible mismatch.
    #[arg(long, value_name = "SHARE")]
    pub tolerance: f64,
    /// Maximum number of iterations per level of an average.
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
            tolerance: 2e-3,
            max_iterations: usual.max_iterations,
        }
    }
}

impl FigureConfig {
    /// The parameters of the averages.
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
    const USAGE: &'static str = "figure NAME";

    fn check(&self) -> Result<(), CliError> {
        Ok(self.params().check(self.inputs.len())?)
    }

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        vec![(&mut self.inputs, Kinds::Masks)]
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        self.inputs.iter_mut().collect()
    }
}

/// Figures and tables about averages, modes and paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FigureName {
    /// Weighted averages between two shapes, and between three.
    Weights,
    /// Mean and median of shapes of which the last fifth are outliers.
    Median,
    /// Stresses in the average, and their balance for increasing mismatch weight and finer grids.
    ForceBalance,
    /// A void that is soft, stiffer, and as stiff as the object.
    ElasticDomain,
    /// Materials that resist changes of length against materials that resist changes of volume.
    Stiffness,
    /// Averages of an increasing number of shapes.
    AddingShapes,
    /// Averages for small to large mismatch weights.
    MismatchWeight,
    /// Deformations by large angles, and the parameters that they require.
    LargeBends,
    /// One shape partially hidden, with and without a visibility mask.
    MissingParts,
    /// A law compared with its inverse model.
    InverseModel,
    /// Shapes as one component each, and as several labelled components.
    Components,
    /// The mode of two shapes with pins at different places.
    Pins,
    /// Modes for both inner products, with and without the stress in the average, for both
    /// materials.
    Modes,
    /// Means and distances of the literature beside those of this program, of plane shapes.
    Related,
    /// Lengths and dissipations of paths of more and more steps, and their limits.
    Steps,
    /// Paths in fluids that keep lengths, and in fluids that keep areas.
    Fluids,
    /// Minima of one average that several starts lead to.
    Minima,
}

impl FigureName {
    /// The smallest and the largest number of shapes for the figure.
    pub(super) fn counts(self) -> [usize; 2] {
        match self {
            Self::Median => [5, usize::MAX],
            Self::Weights => [2, 3],
            _ => [2, usize::MAX],
        }
    }
}
