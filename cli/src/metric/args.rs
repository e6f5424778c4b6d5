//! Options of `shapespace metric`.

use std::path::PathBuf;

use ::geodesic::boundary_metric::MetricParams;
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::options::{MaskOptions, named};

/// Largest degree of a harmonic.
const MOST_DEGREE: u32 = 64;
/// Largest coordinate of a translation, in sides of the box.
const FARTHEST: f64 = 1e6;

/// Configuration of `shapespace metric`.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct MetricConfig {
    /// Mask of the shape, the object bright: PNG, JPEG, PGM, PBM, PPM, TIFF, BMP, .npy, NIfTI, NRRD or
    /// MetaImage; a closed surface: STL, PLY, OBJ, VTK or VTP; an outline: SVG or CSV.
    #[arg(value_name = "SHAPE")]
    pub shape: PathBuf,
    /// Mask of a second shape: the boundary moves towards it, by the difference of the signed distances.
    #[arg(value_name = "VARIATION")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variation: Option<PathBuf>,
    /// How masks are read, placed and aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Variation of speed one along the normal, everywhere outwards.
    #[arg(long)]
    pub dilation: bool,
    /// Variation by the harmonic of this degree around the centroid: cos(N t) of the angle t from the x
    /// axis, in 3D the Legendre polynomial of degree N of the angle from the z axis.
    #[arg(long, value_name = "N")]
    pub mode: Option<u32>,
    /// Variation by the translation with this velocity, in sides of the box: X,Y or X,Y,Z.
    #[arg(
        long,
        value_name = "X,Y[,Z]",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub translation: Vec<f64>,
    /// Parameters of the metric.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: MetricParams,
}

impl Config for MetricConfig {
    const COMMAND: &'static str = "metric";

    fn may_align(&self) -> bool {
        self.masks.may_align()
    }

    fn check(&self) -> Result<(), CliError> {
        named(Self::COMMAND, "a mask, SHAPE", &self.shape)?;
        let chosen = [
            ("VARIATION", self.variation.is_some()),
            ("--dilation", self.dilation),
            ("--mode", self.mode.is_some()),
            ("--translation", !self.translation.is_empty()),
        ];
        let chosen: Vec<&str> = chosen
            .into_iter()
            .filter_map(|(name, set)| set.then_some(name))
            .collect();
        match chosen[..] {
            [] => {
                return Err(CliError::Missing {
                    command: Self::COMMAND,
                    what: "a variation: a second mask, --dilation, --mode N or --translation X,Y",
                });
            }
            [_] => {}
            [first, second, ..] => {
                return Err(CliError::Option {
                    option: second_option(second),
                    value: format!("with {first}"),
                    remedy: "leave one of the two out: a variation is one motion of the boundary"
                        .into(),
                });
            }
        }
        if let Some(degree) = self.mode {
            allow(degree <= MOST_DEGREE, "mode", &degree, "0 to 64")?;
        }
        let near = |x: &f64| x.is_finite() && x.abs() <= FARTHEST;
        let shown: Vec<String> = self.translation.iter().map(ToString::to_string).collect();
        let usable =
            matches!(self.translation.len(), 0 | 2 | 3) && self.translation.iter().all(near);
        let expected = "two numbers, three for volumes, of at most 1e6";
        allow(usable, "translation", &shown.join(","), expected)?;
        Ok(self.params.check()?)
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        std::iter::once(&mut self.shape)
            .chain(&mut self.variation)
            .collect()
    }
}

/// The name of an option that is not the first of two.
fn second_option(name: &str) -> &'static str {
    match name {
        "--dilation" => "--dilation",
        "--mode" => "--mode",
        _ => "--translation",
    }
}
