//! Options that several commands share, and their checks.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use hyperelastic::{LawError, LawSpec};
use serde::{Deserialize, Serialize};

use crate::config::{RUN, allow};
use crate::error::CliError;
use crate::grid::{Counts, counts, in_words, longest};
pub use crate::grid::{Nodes, Sides};
use crate::log::{self, LogFormat};
use crate::numbers::{not_negative, shown};
use crate::progress::Progress;
use shapespace_input::{InputError, ReadOptions, extension_of};

/// Output directory and number of threads of a command.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = RUN)]
pub struct RunOptions {
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Exit with code 0, not 3, where the result is doubtful.
    #[arg(long)]
    pub allow_doubtful: bool,
    /// Use result directories whose arrays have changed since they were written, or that do not
    /// belong together.
    #[arg(long)]
    pub trust: bool,
    /// Show no progress. Standard output has the summary of the result, and standard error has errors.
    #[arg(long, conflicts_with = "log")]
    pub quiet: bool,
    /// Write the progress to standard error as an object of JSON a line, for other programs.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub log: Option<LogFormat>,
}

impl RunOptions {
    /// How the progress of a run is shown.
    pub(crate) fn progress(&self, start: Instant) -> Progress {
        match self.log {
            Some(LogFormat::Json) => Progress::told(Some(log::listener(start))),
            None if self.quiet => Progress::hidden(),
            None => Progress::stderr(),
        }
    }
}

/// Checkpoints of a computation that may take long.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = RUN)]
pub struct CheckpointOption {
    /// Time between checkpoints in minutes, 0 for none. After an interruption the same command
    /// resumes from the last checkpoint, which is kept in OUTPUT.partial until the result is
    /// written; the result is that of a run without interruption.
    #[arg(
        id = "checkpoint",
        long = "checkpoint",
        value_name = "MINUTES",
        default_value_t = 10.0,
        value_parser = not_negative
    )]
    pub minutes: f64,
}

impl CheckpointOption {
    /// No checkpoints.
    pub const NONE: Self = Self { minutes: 0.0 };
}

/// How masks are read, placed and aligned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct MaskOptions {
    /// Number of nodes along the longest side, 129 or another m 2^L + 1, or along each axis, as
    /// 129x65 [default: 129, for volumes 65].
    #[arg(long, value_name = "N|NxN")]
    pub grid: Option<Nodes>,
    /// Distance of neighbouring nodes, instead of a number of nodes: in millimetres for files that
    /// state their place in the world, else in the units of the files, samples of pictures.
    #[arg(long, value_name = "LENGTH", conflicts_with = "grid")]
    pub spacing: Option<f64>,
    /// Box of the grid. The box that fits long or flat shapes has fewer nodes than the cube, at the same
    /// spacing.
    #[arg(id = "box", long = "box", value_enum)]
    #[serde(rename = "box")]
    pub sides: Sides,
    /// Positions and orientations of the shapes before they are aligned [default: physical where
    /// the files of all inputs state their place in the world, centred where those of some do, else
    /// none].
    #[arg(long, value_enum)]
    pub frame: Option<Frame>,
    /// Rigid alignment of the shapes before the computation [default: rigid; none for shapes that
    /// have a common coordinate system: arrays of 2^L + 1 nodes a side, volumes with the same affine
    /// map whose objects lie near each other].
    #[arg(long, value_enum)]
    pub align: Option<Align>,
    /// Sizes of the shapes: as in the files, or scaled to equal area or volume, for pictures taken
    /// from different distances.
    #[arg(long, value_enum)]
    pub size: Size,
    /// Label of the object in label images [default: every label but 0].
    #[arg(long, value_name = "N")]
    pub label: Option<i64>,
    /// The objects are dark, and their background is bright.
    #[arg(long)]
    pub invert: bool,
}

/// Positions and orientations of the shapes before they are aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// As in the world: positions and orientations by the affine maps of the files.
    Physical,
    /// Orientations by the affine maps of files that have one, each object in the middle.
    Centred,
    /// By the axes of the arrays; affine maps are ignored.
    None,
}

/// Rigid alignment of the shapes before the computation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// Keep the shapes where they are placed.
    #[default]
    None,
    /// Rotate and translate the shapes onto each other.
    Rigid,
}

impl MaskOptions {
    /// Checks the options beside `--labels`, which refuses those of masks and others of a command.
    pub(crate) fn check_labels(
        &self,
        labels: bool,
        others: &[(&str, bool)],
    ) -> Result<(), CliError> {
        let own = [("--label", self.label.is_some()), ("--invert", self.invert)];
        let refused = own.iter().chain(others).find(|(_, is_set)| *is_set);
        match refused {
            Some((option, _)) if labels => Err(CliError::Option {
                option: "--labels",
                value: format!("with {option}"),
                remedy: "leave one of the two out".into(),
            }),
            _ => Ok(()),
        }
    }

    /// Whether the shapes could be aligned, and are not.
    pub fn may_align(&self) -> bool {
        self.align != Some(Align::Rigid)
    }

    /// How masks are read.
    pub fn reading(&self) -> ReadOptions {
        ReadOptions {
            label: self.label,
            invert: self.invert,
        }
    }

    /// The number of nodes along the longest side where the box is given by something else, `why`.
    ///
    /// # Errors
    /// [`CliError::Option`] for options of the box, and as `counts`.
    pub fn longest_side<const D: usize>(&self, why: &str) -> Result<usize, CliError> {
        let refused = |option, value: String, remedy| CliError::Option {
            option,
            value,
            remedy: format!("{why}; {remedy}"),
        };
        if self.sides != Sides::Cube {
            let remedy = "leave out --box".to_owned();
            return Err(refused("--box", "fit".into(), remedy));
        }
        if let Some(spacing) = self.spacing {
            let remedy = "give the nodes along the longest side with --grid".to_owned();
            return Err(refused("--spacing", shown(spacing), remedy));
        }
        match counts::<D>(self.grid)? {
            Counts::Cube(nodes) => Ok(nodes),
            Counts::Box(grid) => {
                let remedy = format!(
                    "give the nodes along the longest side, --grid {}",
                    longest(&grid)
                );
                Err(refused("--grid", in_words(&grid), remedy))
            }
        }
    }
}

/// Checks a law in `D` dimensions before any work is done, and completes its moduli where they follow from
/// its coefficients.
///
/// # Errors
/// [`CliError::Parameter`] for moduli that no law has, and [`CliError::Law`] where there is no such law.
pub(crate) fn resolve_law<const D: usize>(spec: &mut LawSpec) -> Result<(), CliError> {
    let resolved = spec.resolved::<D>();
    let checked = resolved.and_then(|resolved| resolved.compile::<D>().map(|_| resolved));
    *spec = checked.map_err(|error| match error {
        // No law has them: another one is no remedy.
        LawError::Moduli { lambda, mu } => {
            let is_lambda = !(0.0..=1e12).contains(&lambda);
            let (name, value, expected) = if is_lambda {
                ("lambda", lambda, "0 to 1e12")
            } else {
                ("mu", mu, "1e-12 to 1e12")
            };
            CliError::Parameter {
                name,
                value: shown(value),
                expected: expected.into(),
            }
        }
        error => CliError::Law {
            law: spec.law.to_string(),
            source: error,
        },
    })?;
    Ok(())
}

/// Relative sizes of the shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// As in the files, in their length units.
    #[default]
    Kept,
    /// Scaled to equal area or volume, for pictures of different resolution.
    Equal,
}

/// Scales of a segmentation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ScaleOptions {
    /// Length over which the image is smoothed away from edges, relative to the longest side
    /// [default: .02, at least three grid spacings].
    #[arg(long, value_name = "SHARE")]
    pub smooth: Option<f64>,
    /// Smallest jump of the grey value that counts as an edge, relative to the range of grey values
    /// of the image [default: .2].
    #[arg(long, value_name = "SHARE")]
    pub contrast: Option<f64>,
}

impl ScaleOptions {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`CliError::Parameter`].
    pub fn check(&self) -> Result<(), CliError> {
        positive("smooth", self.smooth)?;
        positive("contrast", self.contrast)
    }

    /// The smallest jump that counts as an edge.
    pub fn contrast(&self) -> f64 {
        self.contrast.unwrap_or(0.2)
    }

    /// The smoothing length on a grid of this spacing.
    pub fn length(&self, spacing: f64) -> f64 {
        self.smooth.unwrap_or(0.02f64.max(3.0 * spacing))
    }
}

/// Rejects an empty name.
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

/// Checks that a command has so many masks. A folder that does not exist is named.
///
/// # Errors
/// [`CliError::TooFewInputs`], [`InputError::Unreadable`].
pub(crate) fn at_least(
    needed: usize,
    command: &'static str,
    inputs: &[PathBuf],
) -> Result<(), CliError> {
    let found = inputs.len();
    if found >= needed {
        return Ok(());
    }
    for path in inputs.iter().filter(|path| extension_of(path).is_empty()) {
        path.metadata().map_err(|source| InputError::Unreadable {
            path: path.clone(),
            source,
        })?;
    }
    Err(CliError::TooFewInputs {
        command,
        needed,
        found,
    })
}

/// The smallest positive number of an option, and the inverse of the largest: squares of sums of
/// such numbers are finite.
const SMALLEST: f64 = 1e-12;

/// Rejects a number that is not positive, or that is very small or large.
///
/// # Errors
/// [`CliError::Parameter`].
pub(crate) fn positive(name: &'static str, value: Option<f64>) -> Result<(), CliError> {
    let value = value.unwrap_or(1.0);
    let allowed = (SMALLEST..=SMALLEST.recip()).contains(&value);
    allow(
        allowed,
        name,
        &shown(value),
        "a positive number from 1e-12 to 1e12",
    )
}

/// Checks a number of starts, and that none of the options is set that exclude several.
///
/// # Errors
/// [`CliError::Parameter`], and [`CliError::Option`] with the first option that is set.
pub(crate) fn check_starts(
    starts: Option<usize>,
    refused: &[(&'static str, bool)],
) -> Result<(), CliError> {
    let Some(starts) = starts else {
        return Ok(());
    };
    allow((1..=1000).contains(&starts), "starts", &starts, "1 to 1000")?;
    match refused.iter().find(|(_, is_set)| *is_set) {
        Some((option, _)) => Err(CliError::Option {
            option: "--starts",
            value: format!("with {option}"),
            remedy: "leave one of the two out".into(),
        }),
        None => Ok(()),
    }
}
