//! Options of `shapespace geodesic`.

use std::path::PathBuf;

use ::geodesic::{DomainChoice, Form, GeodesicParams};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::options::{MaskOptions, check_starts, named};

/// Configuration of `shapespace geodesic`.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct GeodesicConfig {
    /// Mask of the first shape, the object bright: PNG, JPEG, PGM, PBM, PPM, TIFF, BMP, .npy, NIfTI,
    /// NRRD or MetaImage; closed surfaces: STL, PLY, OBJ, VTK or VTP; outlines: SVG or CSV.
    #[arg(value_name = "START")]
    pub start: PathBuf,
    /// Mask of the last shape.
    #[arg(value_name = "END")]
    pub end: PathBuf,
    /// How masks are read, placed and aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Input in whose world coordinates the results lie, by its path or its file name [default: the
    /// first].
    #[arg(long, value_name = "INPUT")]
    pub like: Option<PathBuf>,
    /// Inputs are label images: every label but 0 is a component, which is mapped onto the
    /// component of the same label.
    #[arg(long)]
    pub labels: bool,
    /// Shape that may be partially hidden, at unknown places: only its visible part has to be
    /// covered.
    #[arg(long, value_enum, value_name = "SHAPE")]
    pub occluded: Option<Occluded>,
    /// Visibility mask of the start shape, of the size of START, bright where the shape is visible;
    /// the mismatch is not counted elsewhere.
    #[arg(long, value_name = "MASK")]
    pub valid_start: Option<PathBuf>,
    /// Visibility mask of the end shape, of the size of END, bright where the shape is visible; the
    /// mismatch is not counted elsewhere.
    #[arg(long, value_name = "MASK")]
    pub valid_end: Option<PathBuf>,
    /// Minimise from N starts: the usual one, other poses of the start shape on the end shape and smooth
    /// random deformations. The result is the shortest path that arrives; all that were found are listed, and
    /// there is a doubt where another one is almost as short.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[arg(long, value_name = "N")]
    pub starts: Option<usize>,
    /// Compute the path again with half and a quarter of the steps, and on grids of twice and four times the
    /// spacing, and give its length and dissipation error bars from both.
    #[arg(long)]
    pub error_bars: bool,
    /// Parameters of the path.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: GeodesicParams,
}

/// The shape that may be partially hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Occluded {
    /// The start shape.
    Start,
    /// The end shape.
    End,
    /// Both shapes.
    Both,
}

impl GeodesicConfig {
    /// Whether a part of a shape may be hidden.
    pub(super) fn hides(&self) -> bool {
        self.occluded.is_some() || self.valid_start.is_some() || self.valid_end.is_some()
    }
}

impl Config for GeodesicConfig {
    const COMMAND: &'static str = "geodesic";

    fn may_align(&self) -> bool {
        self.masks.may_align()
    }

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, "a mask, START", &self.start)?;
        named(Self::COMMAND, "two masks, START and END", &self.end)?;
        self.masks.check_labels(
            self.labels,
            &[
                ("--valid-start", self.valid_start.is_some()),
                ("--valid-end", self.valid_end.is_some()),
            ],
        )?;
        for (which, option, valid) in [
            (Occluded::Start, "--valid-start", &self.valid_start),
            (Occluded::End, "--valid-end", &self.valid_end),
        ] {
            let hidden = self.occluded == Some(which) || self.occluded == Some(Occluded::Both);
            if hidden && valid.is_some() {
                return Err(CliError::Option {
                    option: "--occluded",
                    value: format!("with {option}"),
                    remedy: format!(
                        "leave one of the two out: {option} states where that shape is hidden"
                    ),
                });
            }
        }
        // Several starts are those of paths on the domain of the start shape, between shapes that are visible.
        check_starts(
            self.starts,
            &[
                ("--form level-sets", self.params.form == Form::LevelSets),
                ("--domain end", self.params.domain == DomainChoice::End),
                ("--occluded", self.occluded.is_some()),
                ("--valid-start", self.valid_start.is_some()),
                ("--valid-end", self.valid_end.is_some()),
            ],
        )?;
        if self.error_bars {
            let level_sets = self.params.form == Form::LevelSets;
            for (value, given) in [
                ("with --form level-sets", level_sets),
                ("with a shape that is partly hidden", self.hides()),
            ] {
                if given {
                    return Err(CliError::Option {
                        option: "--error-bars",
                        value: value.into(),
                        remedy: "leave one of the two out: coarser paths start from the deformations of a \
                                 path of one domain"
                            .into(),
                    });
                }
            }
        }
        check_path(&self.params)?;
        check_form(&self.params)
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let ends = [&mut self.start, &mut self.end].into_iter();
        ends.chain(&mut self.valid_start)
            .chain(&mut self.valid_end)
            .collect()
    }
}

/// Checks the parameters of a path.
///
/// # Errors
/// [`CliError::Parameter`].
pub(crate) fn check_path(params: &GeodesicParams) -> Result<(), CliError> {
    allow(
        (1..=256).contains(&params.steps),
        "steps",
        &params.steps,
        "1 to 256",
    )?;
    let iterations = params.resolved_max_iterations();
    allow(iterations > 0, "max_iterations", &iterations, "at least 1")?;
    Ok(params.check()?)
}

/// Rejects options that paths of the other form have.
///
/// # Errors
/// [`CliError::Option`].
pub(crate) fn check_form(params: &GeodesicParams) -> Result<(), CliError> {
    let usual = GeodesicParams::default();
    let of_other: &[(&'static str, bool)] = match params.form {
        Form::Lagrangian => &[("--area-weight", params.area_weight != usual.area_weight)],
        Form::LevelSets => &[
            ("--domain", params.domain != usual.domain),
            (
                "--deformed-share",
                params.deformed_share != usual.deformed_share,
            ),
        ],
    };
    let Some((option, _)) = of_other.iter().find(|(_, given)| *given) else {
        return Ok(());
    };
    let (value, remedy) = match params.form {
        Form::Lagrangian => (
            "with --form lagrangian",
            "leave it out, or choose --form level-sets: paths of one domain have no area term",
        ),
        Form::LevelSets => (
            "with --form level-sets",
            "leave it out, or choose --form lagrangian: paths of level sets have no domain",
        ),
    };
    Err(CliError::Option {
        option,
        value: value.into(),
        remedy: remedy.into(),
    })
}
