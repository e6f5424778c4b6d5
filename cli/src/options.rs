//! Options that several commands share, and what is checked about them.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

use crate::config::allow;
use crate::error::CliError;

/// Fewest nodes a side.
const FEWEST_NODES: usize = 9;

/// Where the results of a command go, and what they do not depend on.
#[derive(Clone, Debug, Args)]
pub struct RunOptions {
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// How masks are read and placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct MaskOptions {
    /// Nodes a side, 2^L + 1 [default: 129, for volumes 65].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// Alignment of the shapes before anything else.
    #[arg(long, value_enum)]
    pub align: Align,
    /// In label images, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N")]
    pub label: Option<i64>,
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

impl MaskOptions {
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
}

/// Finds out now whether a computation in `D` dimensions would refuse a law after all inputs are
/// read.
///
/// # Errors
/// [`CliError::Law`] where there is no such law.
pub(crate) fn check_law<const D: usize>(spec: &LawSpec) -> Result<(), CliError> {
    let compiled = spec.compile::<D>().map(drop);
    compiled.map_err(|error| CliError::Law {
        law: spec.law.to_string(),
        source: error,
    })
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

/// Sizes of shapes beside each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// In the length units of the files.
    #[default]
    Kept,
    /// All of the same area or volume: for pictures of other resolution.
    Equal,
}

/// How edges and smoothness are weighed, wherever images are segmented.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ScaleOptions {
    /// Length over which the image is smoothed away from its edges, as a share of the longest side
    /// [default: .02, and no less than three spacings of the grid].
    #[arg(long, value_name = "SHARE")]
    pub smooth: Option<f64>,
    /// Least jump of the grey value that is an edge, as a share of the range of the image
    /// [default: .2].
    #[arg(long, value_name = "SHARE")]
    pub contrast: Option<f64>,
}

impl ScaleOptions {
    /// Checks the numbers that are given.
    ///
    /// # Errors
    /// [`CliError::Parameter`].
    pub fn check(&self) -> Result<(), CliError> {
        positive("smooth", self.smooth)?;
        positive("contrast", self.contrast)
    }

    /// The least jump of an edge.
    pub fn contrast(&self) -> f64 {
        self.contrast.unwrap_or(0.2)
    }

    /// The length of smoothing on a grid of this spacing.
    pub fn length(&self, spacing: f64) -> f64 {
        self.smooth.unwrap_or(0.02f64.max(3.0 * spacing))
    }
}

/// Refuses an empty name.
///
/// # Errors
/// [`CliError::Missing`].
pub(crate) fn named(
    command: &'static str,
    what: &'static str,
    path: &Path,
) -> Result<(), CliError> {
    if path.as_os_str().is_empty() {
        return Err(CliError::Missing { command, what });
    }
    Ok(())
}

/// Refuses a number that is given and not positive.
///
/// # Errors
/// [`CliError::Parameter`].
pub(crate) fn positive(name: &'static str, value: Option<f64>) -> Result<(), CliError> {
    let value = value.unwrap_or(1.0);
    allow(
        value > 0.0 && value.is_finite(),
        name,
        &value,
        "a positive number",
    )
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
