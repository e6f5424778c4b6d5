//! The directories of an average and of its modes, read back.

use std::fs;
use std::path::{Path, PathBuf};

use fe_grid::{Grid, ScalarField};
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use shape_average::AverageParams;
use shape_pca::{Average, ModeSpace, PcaParams};

use super::args::Metric;
use crate::error::CliError;
use crate::input::place::FrameTransform;
use crate::options::Align;
use crate::output::numbered;
use crate::results::ResultFields;
use crate::shapes::labels;

/// What is read of the `result.json` of an average.
#[derive(Clone, Debug, Deserialize)]
struct ToldAverage {
    dimension: usize,
    /// Shapes, or images that were averaged with their edges.
    #[serde(alias = "images")]
    input: Vec<ToldInput>,
    parameters: ToldParameters,
}

#[derive(Clone, Debug, Deserialize)]
struct ToldInput {
    path: PathBuf,
    size: Vec<usize>,
    frame: serde_json::Value,
}

#[derive(Clone, Debug, Deserialize)]
struct ToldParameters {
    law: LawName,
    lambda: f64,
    mu: f64,
    mismatch_weight: f64,
    length_weight: f64,
    /// Missing where images were averaged: all of the box is the object.
    void_stiffness: Option<f64>,
    tolerance: Option<f64>,
    max_iterations: Option<usize>,
    #[serde(default)]
    weights: Vec<f64>,
    #[serde(default)]
    align: Align,
}

/// An average with what its directory tells of it.
pub(super) struct GivenAverage<const D: usize> {
    /// Its deformations.
    pub average: Average<D>,
    /// Its phase field.
    pub phase_field: ScalarField<f64, D>,
    /// The average image, where images were averaged.
    pub image: Option<ScalarField<f64, D>>,
    /// Its parameters.
    pub params: AverageParams,
    /// Short names of its shapes.
    pub names: Vec<String>,
    /// Samples of the first input along each axis, and where it lies in the unit box.
    pub frame: (Vec<usize>, FrameTransform<D>),
    /// Whether its shapes were aligned.
    pub align: Align,
}

/// An average of either dimension.
pub(super) enum AnyAverage {
    /// In the plane.
    D2(GivenAverage<2>),
    /// In space.
    D3(GivenAverage<3>),
}

fn unfit_average(directory: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: directory.into(),
        command: "average",
        reason,
    }
}

fn unfit_pca(directory: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: directory.into(),
        command: "pca",
        reason,
    }
}

/// Reads what a `result.json` tells.
fn told<T: DeserializeOwned>(
    directory: &Path,
    unfit: fn(&Path, String) -> CliError,
) -> Result<T, CliError> {
    let text = fs::read(directory.join("result.json")).map_err(|source| {
        unfit(
            directory,
            format!("its result.json cannot be read: {source}"),
        )
    })?;
    serde_json::from_slice(&text)
        .map_err(|error| unfit(directory, format!("its result.json is another's: {error}")))
}

/// Reads the directory of an average.
///
/// # Errors
/// [`CliError::NoResult`] where it is none, and [`CliError::Input`] for an array that cannot be
/// read.
pub(super) fn read_average(directory: &Path) -> Result<AnyAverage, CliError> {
    let told: ToldAverage = told(directory, unfit_average)?;
    match told.dimension {
        2 => given_average(directory, told).map(AnyAverage::D2),
        3 => given_average(directory, told).map(AnyAverage::D3),
        other => Err(unfit_average(
            directory,
            format!("it has {other} dimensions"),
        )),
    }
}

fn given_average<const D: usize>(
    directory: &Path,
    told: ToldAverage,
) -> Result<GivenAverage<D>, CliError> {
    let fields = ResultFields {
        directory,
        unfit: unfit_average,
    };
    let phase_field = fields.scalar::<D>(Path::new("average.npy"))?;
    let grid = *phase_field.grid();
    let of_images = told.parameters.void_stiffness.is_none();
    let delta = told.parameters.void_stiffness.unwrap_or(1.0);
    let image = of_images
        .then(|| fields.scalar::<D>(Path::new("average_image.npy")))
        .transpose()?;
    let (mut displacements, mut indicators) = (Vec::new(), Vec::new());
    for i in 0..told.input.len() {
        displacements.push(fields.displacement(&grid, "deformation", i)?);
        if of_images {
            indicators.push(ScalarField::from_fn(grid, |_| [1.0]));
            continue;
        }
        let mut weight = fields.numbered_scalar::<D>("weight", i)?;
        for x in weight.as_mut_slice() {
            // Where the void is as stiff as the object, all of the box is the object.
            *x = if delta < 1.0 {
                (*x - delta) / (1.0 - delta)
            } else {
                1.0
            };
        }
        indicators.push(weight);
    }
    let nowhere = || unfit_average(directory, "it does not say where its inputs lie".into());
    let first = told.input.first().ok_or_else(nowhere)?;
    let frame = serde_json::from_value(first.frame.clone()).map_err(|_| nowhere())?;
    let paths: Vec<&Path> = told
        .input
        .iter()
        .map(|input| input.path.as_path())
        .collect();
    let names = labels(&paths);
    let size = first.size.clone();
    let p = told.parameters;
    let n = told.input.len();
    let weights = if p.weights.is_empty() {
        vec![1.0 / n as f64; n]
    } else {
        p.weights
    };
    let usual = AverageParams::default();
    let params = AverageParams {
        law: LawSpec {
            law: p.law,
            moduli: LameModuli {
                lambda: p.lambda,
                mu: p.mu,
            },
        },
        mismatch_weight: p.mismatch_weight,
        length_weight: Some(p.length_weight),
        void_stiffness: delta,
        tolerance: p.tolerance.unwrap_or(usual.tolerance),
        max_iterations: p.max_iterations.unwrap_or(usual.max_iterations),
        ..usual
    };
    Ok(GivenAverage {
        average: Average::new(displacements, indicators, weights)?,
        phase_field,
        image,
        params,
        names,
        frame: (size, frame),
        align: p.align,
    })
}

impl<const D: usize> GivenAverage<D> {
    /// Parameters of an analysis of this average.
    pub fn pca_params(&self, metric: Metric, at_rest: bool, tolerance: f64) -> PcaParams {
        PcaParams {
            law: self.params.law,
            void_stiffness: self.params.void_stiffness,
            metric: match metric {
                Metric::L2 => shape_pca::Metric::L2,
                Metric::Hessian => shape_pca::Metric::Hessian,
            },
            at_rest,
            tolerance,
            ..PcaParams::default()
        }
    }
}

/// What is read of the `result.json` of an analysis.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct ToldPca {
    /// Where the average lies.
    average: PathBuf,
    metric: Metric,
    prestressed: bool,
    tolerance: f64,
    n_modes: usize,
    eigenvalues: Vec<f64>,
}

/// The modes of an average.
pub(super) struct GivenPca<const D: usize> {
    /// The average.
    pub average: GivenAverage<D>,
    /// Its modes.
    pub space: ModeSpace<D>,
}

/// Modes of either dimension.
pub(super) enum AnyPca {
    /// In the plane.
    D2(GivenPca<2>),
    /// In space.
    D3(GivenPca<3>),
}

/// Reads the directory of an analysis, and that of its average.
///
/// # Errors
/// As [`read_average`]; [`CliError::NoResult`] for modes of images, which are not made of boundaries.
pub(super) fn read_pca(directory: &Path, average: Option<&Path>) -> Result<AnyPca, CliError> {
    let told: ToldPca = told(directory, unfit_pca)?;
    match read_average(average.unwrap_or(&told.average))? {
        AnyAverage::D2(average) => given_pca(directory, &told, average).map(AnyPca::D2),
        AnyAverage::D3(average) => given_pca(directory, &told, average).map(AnyPca::D3),
    }
}

fn given_pca<const D: usize>(
    directory: &Path,
    told: &ToldPca,
    average: GivenAverage<D>,
) -> Result<GivenPca<D>, CliError> {
    let fields = ResultFields {
        directory,
        unfit: unfit_pca,
    };
    if average.image.is_some() {
        return Err(unfit_pca(
            directory,
            "its modes are those of images, and shapes are asked for".into(),
        ));
    }
    let grid: Grid<D> = *average.average.grid();
    let modes: Result<Vec<_>, CliError> = (0..told.n_modes)
        .map(|j| fields.vector(&grid, &numbered("mode", j, "npy")))
        .collect();
    if told.eigenvalues.len() < told.n_modes {
        return Err(unfit_pca(
            directory,
            "it has fewer eigenvalues than modes".into(),
        ));
    }
    let space = ModeSpace {
        params: average.pca_params(told.metric, !told.prestressed, told.tolerance),
        object: average.average.object().clone(),
        mean: fields.vector(&grid, Path::new("mean_displacement.npy"))?,
        eigenvalues: told.eigenvalues[..told.n_modes].to_vec(),
        fields: modes?,
        n_shapes: average.average.n_shapes(),
    };
    Ok(GivenPca { average, space })
}
