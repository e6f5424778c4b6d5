//! Options that several commands share, and what is checked about them.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::{Deserialize, Serialize};

use crate::error::CliError;
use crate::numbers::positive;

/// Fewest nodes a side.
const FEWEST_NODES: usize = 9;

/// Options of every command that computes with the shapes of masks.
#[derive(Clone, Debug, Args)]
pub struct CommonArgs {
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Nodes a side, 2^L + 1 [default: 129, for volumes 65].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// Most iterations on a level.
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub max_iterations: u32,
    /// Law of the elastic material; "inverse:..." is its inverse model.
    #[arg(long, value_name = "LAW", default_value_t, value_parser = laws())]
    pub law: LawName,
    /// First Lame modulus.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub lambda: f64,
    /// Second Lame modulus, the shear modulus.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub mu: f64,
    /// Stiffness outside the objects, theirs being 1.
    #[arg(long, default_value_t = 1e-4, value_parser = positive)]
    pub void_stiffness: f64,
    /// Alignment of the shapes before anything else.
    #[arg(long, value_enum, default_value_t)]
    pub align: Align,
    /// In label images, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Option<i64>,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// How edges and smoothness are weighed, wherever images are segmented.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct ScaleArgs {
    /// Length over which the image is smoothed away from its edges, as a share of the longest side
    /// [default: .02, and no less than three spacings of the grid].
    #[arg(long, value_name = "SHARE", value_parser = positive)]
    pub smooth: Option<f64>,
    /// Least jump of the grey value that is an edge, as a share of the range of the image
    /// [default: .2].
    #[arg(long, value_name = "SHARE", value_parser = positive)]
    pub contrast: Option<f64>,
}

impl ScaleArgs {
    /// The least jump of an edge.
    pub fn contrast(&self) -> f64 {
        self.contrast.unwrap_or(0.2)
    }

    /// The length of smoothing on a grid of this spacing.
    pub fn length(&self, spacing: f64) -> f64 {
        self.smooth.unwrap_or(0.02f64.max(3.0 * spacing))
    }
}

/// Alignment of the shapes before anything else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// The shapes stay as they are placed.
    #[default]
    None,
    /// The shapes are turned and moved onto each other.
    Rigid,
}

/// The names of all laws.
fn laws() -> impl TypedValueParser<Value = LawName> {
    let names: Vec<String> = LawName::all().map(|law| law.to_string()).collect();
    PossibleValuesParser::new(names).try_map(|name| name.parse::<LawName>())
}

impl CommonArgs {
    /// What a command does that is given nothing but a place for its results.
    pub fn usual(output: PathBuf) -> Self {
        Self {
            output,
            grid: None,
            max_iterations: 100,
            law: LawName::default(),
            lambda: 1.0,
            mu: 1.0,
            void_stiffness: 1e-4,
            align: Align::default(),
            label: None,
            threads: None,
        }
    }

    /// The nodes a side in `D` dimensions.
    ///
    /// # Errors
    /// [`CliError::Option`] for numbers that are not of the form `2^L + 1`, too few or too many.
    pub fn nodes<const D: usize>(&self) -> Result<usize, CliError> {
        let (usual, most) = if D == 2 { (129, 4097) } else { (65, 513) };
        let nodes = self.grid.unwrap_or(usual);
        check_nodes(nodes, most)?;
        Ok(nodes)
    }

    /// The law with its moduli. It is found out now what a computation would refuse after all
    /// inputs are read.
    ///
    /// # Errors
    /// [`CliError::Law`] where there is no such law, [`CliError::Option`] for a void that is too
    /// stiff.
    pub fn material<const D: usize>(&self) -> Result<LawSpec, CliError> {
        let spec = LawSpec {
            law: self.law,
            moduli: LameModuli {
                lambda: self.lambda,
                mu: self.mu,
            },
        };
        spec.compile::<D>().map_err(|error| CliError::Law {
            law: self.law.to_string(),
            source: error,
        })?;
        if self.void_stiffness > 1.0 {
            return Err(CliError::Option {
                option: "--void-stiffness",
                value: self.void_stiffness.to_string(),
                remedy: "the void is no stiffer than the object, which has 1; try 1e-4".into(),
            });
        }
        Ok(spec)
    }
}

/// Whether a grid of so many nodes a side can be made coarser again and again.
///
/// # Errors
/// [`CliError::Option`] with the nearest number that can.
pub(crate) fn check_nodes(nodes: usize, most: usize) -> Result<(), CliError> {
    let cells = nodes.saturating_sub(1);
    if cells.is_power_of_two() && (FEWEST_NODES..=most).contains(&nodes) {
        return Ok(());
    }
    let near = cells.clamp(FEWEST_NODES - 1, most - 1).next_power_of_two() + 1;
    Err(CliError::Option {
        option: "--grid",
        value: nodes.to_string(),
        remedy: format!(
            "the grid needs 2^L + 1 nodes a side, from {FEWEST_NODES} to {most}; try --grid {near}"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_two_to_a_power_plus_one() {
        assert!(check_nodes(9, 513).is_ok());
        assert!(check_nodes(513, 513).is_ok());
        for (wrong, hint) in [(0, "9"), (5, "9"), (64, "65"), (100, "129"), (5000, "513")] {
            match check_nodes(wrong, 513) {
                Err(CliError::Option { remedy, .. }) => {
                    assert!(remedy.ends_with(&format!("--grid {hint}")), "{remedy}");
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
