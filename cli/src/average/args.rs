//! Options of `shapespace average`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Deserialize, Serialize};
use shape_average::joint::{Edges, JointParams};
use shape_average::{AverageParams, Mean, Solver};

use super::views;
use crate::config::{Config, Configured, RUN, allow};
use crate::error::CliError;
use crate::numbers::shown;
use crate::options::{
    Align, CheckpointOption, MaskOptions, RunOptions, ScaleOptions, Size, at_least, check_starts,
    positive,
};
use shapespace_input::Kinds;
use shapespace_input::bytes::bytes;

/// Options of `shapespace average`.
#[derive(Clone, Debug, Args)]
pub struct AverageArgs {
    /// Parameters of the computation.
    #[command(flatten)]
    pub config: Configured<AverageConfig>,
    /// Options that do not influence the results.
    #[command(flatten)]
    pub run: AverageRun,
}

/// Options that do not influence the results.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = RUN)]
pub struct AverageRun {
    /// Options shared with other commands.
    #[command(flatten)]
    pub common: RunOptions,
    /// When the state is stored.
    #[command(flatten)]
    pub checkpoint: CheckpointOption,
    /// Memory limit, such as 4GiB or 500MB [default: the free memory]. Data that exceed it are kept
    /// in temporary files next to the output, or in TMPDIR; inputs that exceed it are refused. The
    /// results do not depend on it.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub memory: Option<u64>,
}

/// Configuration of `shapespace average`.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct AverageConfig {
    /// Input masks, the object bright: PNG, JPEG, PGM, PBM, PPM, TIFF, BMP, .npy, NIfTI, NRRD or
    /// MetaImage; closed surfaces: STL, PLY, OBJ, VTK or VTP; outlines: SVG or CSV. A folder, or a
    /// pattern in quotes, stands for its files.
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// How masks are read, placed and aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Input in whose world coordinates the results lie, by its path or its file name [default: the
    /// first].
    #[arg(long, value_name = "INPUT")]
    pub like: Option<PathBuf>,
    /// Inputs are label images: every label but 0 is a component, which is deformed onto the component of
    /// the same label of the average. One deformation moves all components of an input.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[arg(long)]
    pub labels: bool,
    /// Visibility masks, one per input and of its size, bright where the input is visible; 'all'
    /// for an input that is completely visible. Elsewhere an input is not compared with the
    /// average.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[arg(long, value_name = "MASK", num_args = 1..)]
    pub valid: Vec<PathBuf>,
    /// Start from the deformations of an earlier average of the same inputs in the same order, on
    /// this grid or a coarser one; it may have been interrupted or have other parameters.
    #[arg(long, value_name = "DIR")]
    pub start: Option<PathBuf>,
    /// Compute averages for a range of weights: N weights on a line for two shapes, a triangle with
    /// N on a side for three.
    #[arg(long, value_name = "N")]
    pub sweep: Option<usize>,
    /// Estimate the errors of energies, of the volume and of the boundary by repeating the computation on
    /// grids of twice and four times the spacing.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[arg(long)]
    pub error_bars: bool,
    /// Minimise from N starts: the usual one, other poses of the shapes and smooth random deformations. The
    /// result is the lowest minimum; all are listed, with the least curvature at each, and there is a
    /// doubt where another one with another average is almost as low.
    #[arg(long, value_name = "N")]
    pub starts: Option<usize>,
    /// Inputs are grey images of similar size: segment and average them simultaneously. The default
    /// of --boundary is then identity.
    #[arg(long)]
    pub joint: bool,
    /// Scales of the segmentation, with --joint.
    #[serde(flatten)]
    #[command(flatten)]
    pub scales: ScaleOptions,
    /// With --joint: weight of the edge length of an image, relative to the mismatch weight
    /// [default: 2].
    #[arg(long, value_name = "SHARE")]
    pub edge_weight: Option<f64>,
    /// With --joint: where edges come from. Those of 'separate', of every image by itself, and of 'given',
    /// whose inputs are drawings of edges, bright on dark, are held while they are averaged [default: together].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[arg(long, value_enum, value_name = "SOURCE")]
    pub edges: Option<Edges>,
    /// Parameters of the average.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: AverageParams,
}

impl Config for AverageConfig {
    const COMMAND: &'static str = "average";

    fn base(&self) -> Option<Self> {
        self.joint.then(|| Self {
            joint: true,
            params: JointParams::default().average,
            ..Self::default()
        })
    }

    fn may_align(&self) -> bool {
        !self.joint && self.masks.may_align()
    }

    fn may_start(&self) -> bool {
        let other = self.joint || self.labels || self.error_bars || self.sweep.is_some();
        !other && self.params.mean == Mean::Arithmetic
    }

    fn check(&self) -> Result<(), CliError> {
        let n = self.inputs.len();
        at_least(2, Self::COMMAND, &self.inputs)?;
        if self.joint {
            self.check_joint()?;
        } else {
            self.check_masks()?;
        }
        self.scales.check()?;
        positive("edge_weight", self.edge_weight)?;
        let iterations = self.params.max_iterations;
        allow(iterations > 0, "max_iterations", &iterations, "at least 1")?;
        if let Some(reference) = self.params.median_reference
            && self.params.mean != Mean::Median
        {
            return Err(CliError::Option {
                option: "--median-reference",
                value: shown(reference),
                remedy: "it goes with --mean median: add that, or leave it out".into(),
            });
        }
        let weights = self.weights().map(Some)?;
        let params = self.params.clone();
        Ok(AverageParams { weights, ..params }.check(n)?)
    }

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        let kinds = if self.joint {
            Kinds::Images
        } else {
            Kinds::Masks
        };
        let mut lists = vec![(&mut self.inputs, kinds)];
        // The word that stands for a mask may be the name of a folder, too.
        if !self.valid.iter().any(|path| path == Path::new(views::ALL)) {
            lists.push((&mut self.valid, Kinds::Images));
        }
        lists
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let valid = self.valid.iter_mut();
        let valid = valid.filter(|path| path.as_path() != Path::new(views::ALL));
        self.inputs
            .iter_mut()
            .chain(valid)
            .chain(&mut self.start)
            .collect()
    }
}

/// The error for an option of grey images with masks.
fn of_images_only(option: &'static str, value: String) -> CliError {
    CliError::Option {
        option,
        value,
        remedy: "it is for grey images: add --joint, or leave it out".into(),
    }
}

impl AverageConfig {
    fn check_masks(&self) -> Result<(), CliError> {
        let of_images = [
            ("--smooth", self.scales.smooth),
            ("--contrast", self.scales.contrast),
            ("--edge-weight", self.edge_weight),
        ];
        for (option, value) in of_images {
            if let Some(value) = value {
                return Err(of_images_only(option, shown(value)));
            }
        }
        if self.edges.is_some() {
            return Err(of_images_only("--edges", "of masks".into()));
        }
        views::check(&self.valid, self.inputs.len())?;
        self.check_labels()?;
        self.check_starts()?;
        let Some(side) = self.sweep else {
            return Ok(());
        };
        allow((2..=65).contains(&side), "sweep", &side, "2 to 65")?;
        let (value, remedy) = if self.inputs.len() > 3 {
            let value = format!("of {} masks", self.inputs.len());
            let remedy = "give two masks for a line of averages, or three for a triangle";
            (value, remedy)
        } else if self.error_bars {
            ("with --error-bars".into(), "leave one of the two out")
        } else if self.params.weights.is_some() {
            ("with --weights".into(), "leave one of the two out")
        } else if self.start.is_some() {
            ("with --start".into(), "leave one of the two out")
        } else {
            return Ok(());
        };
        Err(CliError::Option {
            option: "--sweep",
            value,
            remedy: remedy.into(),
        })
    }

    fn check_labels(&self) -> Result<(), CliError> {
        self.masks.check_labels(
            self.labels,
            &[
                ("--sweep", self.sweep.is_some()),
                ("--error-bars", self.error_bars),
                ("--starts", self.starts.is_some()),
            ],
        )
    }

    fn check_starts(&self) -> Result<(), CliError> {
        let zero = |weights: &Vec<f64>| weights.contains(&0.0);
        check_starts(
            self.starts,
            &[
                ("--sweep", self.sweep.is_some()),
                ("--error-bars", self.error_bars),
                ("--mean median", self.params.mean != Mean::Arithmetic),
                (
                    "--weights with a zero",
                    self.params.weights.as_ref().is_some_and(zero),
                ),
            ],
        )
    }

    fn check_joint(&self) -> Result<(), CliError> {
        let refused = [
            ("--weights", self.params.weights.is_some()),
            ("--align rigid", self.masks.align == Some(Align::Rigid)),
            ("--size equal", self.masks.size == Size::Equal),
            ("--label", self.masks.label.is_some()),
            ("--labels", self.labels),
            ("--invert", self.masks.invert),
            ("--solver descent", self.params.solver != Solver::Lbfgs),
            ("--mean median", self.params.mean != Mean::Arithmetic),
            ("--valid", !self.valid.is_empty()),
            ("--sweep", self.sweep.is_some()),
            ("--error-bars", self.error_bars),
            ("--starts", self.starts.is_some()),
        ];
        match refused.into_iter().find(|(_, is_set)| *is_set) {
            Some((option, _)) => Err(not_joint(option)),
            None => Ok(()),
        }
    }

    /// The weights of the shapes: the configured ones, divided by their sum, or equal ones.
    ///
    /// # Errors
    /// [`CliError`] for weights of another number, below zero, or that do not add up to one.
    pub(crate) fn weights(&self) -> Result<Vec<f64>, CliError> {
        let shapes = self.inputs.len();
        let equal = vec![1.0 / shapes as f64; shapes];
        let Some(weights) = self
            .params
            .weights
            .as_ref()
            .filter(|weights| **weights != equal)
        else {
            return Ok(equal);
        };
        if weights.len() != shapes {
            return Err(CliError::WeightCount {
                expected: shapes,
                found: weights.len(),
            });
        }
        let allowed = |w: &&f64| **w >= 0.0 && w.is_finite();
        if let Some(wrong) = weights.iter().find(|w| !allowed(w)) {
            return Err(CliError::Option {
                option: "--weights",
                value: shown(*wrong),
                remedy: "weights must not be negative and must add up to 1".into(),
            });
        }
        let sum: f64 = weights.iter().sum();
        let normalised = weights.iter().map(|w| w / sum);
        // Weights typed with six digits, such as .333333 three times, are meant to add up to 1.
        if (sum - 1.0).abs() > 1e-5 {
            return Err(CliError::WeightSum {
                sum,
                normalised: if sum > 0.0 {
                    normalised.collect()
                } else {
                    Vec::new()
                },
            });
        }
        Ok(normalised.collect())
    }
}

/// The error for an option that cannot be combined with `--joint`.
pub(super) fn not_joint(option: &str) -> CliError {
    CliError::Option {
        option: "--joint",
        value: format!("with {option}"),
        remedy: format!(
            "leave out {option}: all images are averaged completely and as they are, with equal weights"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weights(given: &[f64], shapes: usize) -> Result<Vec<f64>, CliError> {
        let given = (!given.is_empty()).then(|| given.to_vec());
        AverageConfig {
            inputs: vec!["a.npy".into(); shapes],
            params: AverageParams {
                weights: given,
                ..AverageParams::default()
            },
            ..AverageConfig::default()
        }
        .weights()
    }

    #[test]
    fn weights_are_checked_and_completed() {
        assert_eq!(weights(&[], 4).unwrap(), [0.25; 4]);
        assert_eq!(weights(&[0.25, 0.75], 2).unwrap(), [0.25, 0.75]);
        let thirds = weights(&[0.333333; 3], 3).unwrap();
        assert!((thirds.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        // Their sum is not exactly one, but equal weights are not normalised.
        let sixths = [1.0 / 6.0; 6];
        assert_eq!(weights(&sixths, 6).unwrap(), sixths);
        assert!(matches!(
            weights(&[1.0], 2),
            Err(CliError::WeightCount { .. })
        ));
        assert!(matches!(
            weights(&[0.5, 0.6], 2),
            Err(CliError::WeightSum { .. })
        ));
        assert!(matches!(
            weights(&[-0.5, 1.5], 2),
            Err(CliError::Option { .. })
        ));
        assert!(matches!(
            weights(&[0.0, 0.0], 2),
            Err(CliError::WeightSum { .. })
        ));
    }
}
