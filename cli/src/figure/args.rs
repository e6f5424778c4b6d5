//! Options of `shapespace figure`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::numbers::positive;
use crate::options::CommonArgs;

/// Options of `shapespace figure`.
#[derive(Clone, Debug, Args)]
pub struct FigureArgs {
    /// What is shown.
    #[arg(value_enum)]
    pub name: FigureName,
    /// Masks to show it on, as for an average [default: shapes that the program draws].
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Options that other commands have, too.
    #[command(flatten)]
    pub common: CommonArgs,
    /// A level of an average ends when five iterations lower the energy's excess over the least
    /// possible mismatch by less than this share.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-5, value_parser = positive)]
    pub tolerance: f64,
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
