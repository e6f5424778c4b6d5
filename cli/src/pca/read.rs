//! Reads the directories of an average and of its modes.

use std::path::{Path, PathBuf};

use fe_grid::{Grid, ScalarField};
use serde::Deserialize;
use shape_average::{AverageParams, Mean, Solver};
use shape_pca::{Average, ModeSpace, PcaParams, SampleSize};

use super::args::PcaConfig;
use super::components::{
    StoredComponent, StoredLabels, follow, phase_field_name, phase_field_names,
};
use crate::average::AverageConfig;
use crate::doubts::DoubtRecord;
use crate::error::CliError;
use crate::integrity::Sums;
use crate::options::{Align, Frame, Size};
use crate::output::names::VISIBILITY;
use crate::output::numbered;
use crate::report::Record;
use crate::results::{ResultFields, read_dimension, read_record};
use crate::shapes::{InputRecord, ResultPlace, WorldFrame};
use shapespace_input::ReadOptions;
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::frame::FrameTransform;

/// An average and its record.
pub(crate) struct StoredAverage<const D: usize> {
    /// Its deformations.
    pub average: Average<D>,
    /// Its phase field.
    pub phase_field: ScalarField<f64, D>,
    /// The average image, for averages of images.
    pub image: Option<ScalarField<f64, D>>,
    /// Its components; none of shapes of one.
    pub components: Vec<StoredComponent<D>>,
    /// The phase fields of its shapes, all components of the first before those of the second; none for
    /// averages of images, medians, and shapes that are partly hidden.
    pub phase_fields: Vec<ScalarField<f64, D>>,
    /// Its parameters.
    pub params: AverageParams,
    /// Short names of its shapes.
    pub names: Vec<String>,
    /// The files of its shapes.
    pub files: Vec<PathBuf>,
    /// Samples of the first input along each axis, and its placement in the unit box.
    pub frame: (Vec<usize>, FrameTransform<D>),
    /// Its shapes, as volumes in the world are written for them.
    pub inputs: Vec<InputRecord<D>>,
    /// The world of its shapes, if they have one.
    pub world: Option<WorldFrame<D>>,
    /// The coordinates of its boundaries.
    pub place: ResultPlace<D>,
    /// How its shapes were placed; missing in results of earlier versions.
    pub placing: Option<Frame>,
    /// How its masks were read.
    pub read_options: ReadOptions,
    /// Whether its shapes were aligned.
    pub align: Align,
    /// The largest mismatch of its shapes after that; 0 where they were not aligned.
    pub mismatch: f64,
    /// Whether its shapes were scaled to equal sizes.
    pub size: Size,
    /// The doubts about it.
    pub doubts: Vec<DoubtRecord>,
    /// The checksums of its inputs, as far as they are known.
    pub input_sums: Vec<Option<String>>,
    /// The checksums of its arrays.
    pub sums: Sums,
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

/// Reads the directory of an average.
///
/// # Errors
/// [`CliError::NoResult`] for any other directory, [`CliError::Input`] for an array that cannot be
/// read, and [`CliError::Damaged`] for one that has changed, unless it is trusted.
pub(crate) fn read_average(
    directory: &Path,
    trust: bool,
) -> Result<Dim<StoredAverage<2>, StoredAverage<3>>, CliError> {
    let dimension = read_dimension(directory).map_err(|reason| unfit_average(directory, reason))?;
    Ok(per_dimension!(dimension, () => stored_average(directory, trust)?))
}

fn stored_average<const D: usize>(
    directory: &Path,
    trust: bool,
) -> Result<StoredAverage<D>, CliError> {
    let unfit = |reason| unfit_average(directory, reason);
    let record: Record<AverageConfig, StoredLabels, D> = read_record(directory).map_err(unfit)?;
    let config = record.parameters;
    let fields = ResultFields::new(directory, unfit_average, trust)?;
    let phase_field = fields.scalar::<D>(Path::new("average.npy"))?;
    let grid = *phase_field.grid();
    // For averages of images, the whole box is the object.
    let delta = if config.joint {
        1.0
    } else {
        config.params.void_stiffness
    };
    let image = config
        .joint
        .then(|| fields.scalar::<D>(Path::new("average_image.npy")))
        .transpose()?;
    let (mut displacements, mut indicators) = (Vec::new(), Vec::new());
    let n = record.input.len();
    let complete =
        !config.joint && config.valid.is_empty() && config.params.mean == Mean::Arithmetic;
    let with_phase_fields = if complete { n } else { 0 };
    let components: Vec<StoredComponent<D>> = record.body.read(&fields)?;
    let names = (0..with_phase_fields).flat_map(|i| phase_field_names(i, components.len()));
    let phase_fields = names
        .map(|name| fields.scalar::<D>(Path::new(&name)))
        .collect::<Result<Vec<_>, _>>()?;
    for i in 0..n {
        displacements.push(fields.displacement(&grid, "deformation", i)?);
        if config.joint {
            indicators.push(ScalarField::from_fn(grid, |_| [1.0]));
            continue;
        }
        let mut weight = fields.numbered_scalar::<D>("weight", i)?;
        for x in weight.as_mut_slice() {
            // If the void is as stiff as the object, the whole box is the object.
            *x = if delta < 1.0 {
                (*x - delta) / (1.0 - delta)
            } else {
                1.0
            };
        }
        indicators.push(weight);
    }
    let visible = if config.valid.is_empty() { 0 } else { n };
    if visible > 0 && !directory.join(numbered(VISIBILITY, 0, "npy")).is_file() {
        let reason = "it has no visibility masks (visibility_000.npy): compute the average again";
        return Err(unfit(reason.into()));
    }
    let visibility = (0..visible).map(|i| fields.numbered_scalar::<D>(VISIBILITY, i));
    let visibility = visibility.collect::<Result<Vec<_>, _>>()?;
    let first = record.input.first();
    let first =
        first.ok_or_else(|| unfit("it does not state the placement of its inputs".into()))?;
    let weights = config.weights()?;
    let params = AverageParams {
        void_stiffness: delta,
        weights: None,
        mean: Mean::Arithmetic,
        median_reference: None,
        solver: Solver::Lbfgs,
        ..config.params
    };
    Ok(StoredAverage {
        average: Average::of_visible(displacements, indicators, visibility, weights)?,
        phase_field,
        image,
        components,
        phase_fields,
        params,
        names: record
            .input
            .iter()
            .map(|input| input.name.clone())
            .collect(),
        files: record
            .input
            .iter()
            .map(|input| input.path.clone())
            .collect(),
        frame: (first.size.clone(), first.frame),
        world: WorldFrame::of_inputs(&record.input),
        place: ResultPlace::of_inputs(&record.input),
        placing: config.masks.frame,
        read_options: config.masks.reading(),
        align: config.masks.align.unwrap_or_default(),
        mismatch: {
            let aligned = record.input.iter().filter_map(|i| i.alignment);
            aligned.map(|a| a.mismatch).fold(0.0, f64::max)
        },
        size: config.masks.size,
        doubts: record.doubts,
        input_sums: record.input.iter().map(|i| i.sha256.clone()).collect(),
        sums: fields.sums().clone(),
        inputs: record.input,
    })
}

impl<const D: usize> StoredAverage<D> {
    /// Takes the deformations and the phase field of the continued average from the directory of its
    /// modes.
    fn continue_from(&mut self, fields: &ResultFields<'_>) -> Result<(), CliError> {
        let grid = *self.average.grid();
        let displacements = (0..self.average.n_shapes())
            .map(|i| fields.displacement(&grid, "deformation", i))
            .collect::<Result<Vec<_>, _>>()?;
        let continued = self.average.with(displacements)?;
        follow(&mut self.components, [&self.average, &continued]);
        for (c, component) in self.components.iter_mut().enumerate() {
            component.phase_field = fields.scalar(Path::new(&phase_field_name(c)))?;
        }
        self.average = continued;
        self.phase_field = fields.scalar::<D>(Path::new("average.npy"))?;
        Ok(())
    }

    /// Parameters of an analysis of this average, with the material of the average.
    pub fn pca_params(&self, params: PcaParams) -> PcaParams {
        PcaParams {
            law: self.params.law,
            void_stiffness: self.params.void_stiffness,
            ..params
        }
    }
}

/// The record of the modes.
#[derive(Clone, Debug, Deserialize)]
struct StoredModes {
    n_modes: usize,
    eigenvalues: Vec<f64>,
    /// The checksum of the average.
    #[serde(default)]
    average_sum: Option<String>,
    /// Whether the average was continued.
    #[serde(default)]
    continuation: Option<StoredContinuation>,
    #[serde(default)]
    quality: Option<StoredQuality>,
}

/// The quality of the modes.
#[derive(Clone, Debug, Deserialize)]
struct StoredQuality {
    #[serde(default)]
    generalisation: Vec<f64>,
}

/// The record of the continuation of an average.
#[derive(Clone, Debug, Deserialize)]
struct StoredContinuation {
    continued: bool,
}

/// The modes of an average.
pub(crate) struct StoredPca<const D: usize> {
    /// The average.
    pub average: StoredAverage<D>,
    /// Its modes.
    pub space: ModeSpace<D>,
    /// Root mean square of the distances of training shapes from the modes of the others, all of them.
    pub left_out_error: Option<f64>,
    /// The doubts about them.
    pub doubts: Vec<DoubtRecord>,
}

impl<const D: usize> StoredAverage<D> {
    /// Whether its masks were label images of several components, and how they were read.
    pub fn reading(&self) -> (bool, ReadOptions) {
        (!self.components.is_empty(), self.read_options)
    }
}

impl<const D: usize> StoredPca<D> {
    /// The memory of its arrays, in bytes.
    pub fn bytes(&self) -> u64 {
        let average = &self.average;
        let components = 2 * average.components.len();
        // With the object, for the modes too, the phase fields and the mean displacement.
        let scalars = average.average.n_shapes() + average.phase_fields.len() + components + 3;
        let displacements = average.average.n_shapes() + self.space.fields.len() + 1;
        let numbers = (scalars + D * displacements) * self.space.object.grid().n_nodes();
        (size_of::<f64>() * numbers) as u64
    }
}

/// Reads the directory of an analysis, and that of its average.
///
/// # Errors
/// As [`read_average`]; [`CliError::NoResult`] for modes of images, which have no boundaries.
pub(crate) fn read_pca(
    directory: &Path,
    average: Option<&Path>,
    trust: bool,
) -> Result<Dim<StoredPca<2>, StoredPca<3>>, CliError> {
    let dimension = read_dimension(directory).map_err(|reason| unfit_pca(directory, reason))?;
    Ok(per_dimension!(dimension, () => stored_pca(directory, average, trust)?))
}

/// The average of modes: where it was, or beside the modes if both were moved. The checksum of its record tells whether
/// it is the same.
fn found_again(modes: &Path, average: &Path) -> PathBuf {
    let beside = || Some(modes.parent()?.join(average.file_name()?));
    let moved = beside().filter(|path| !average.exists() && path.exists());
    moved.unwrap_or_else(|| average.into())
}

fn stored_pca<const D: usize>(
    directory: &Path,
    average: Option<&Path>,
    trust: bool,
) -> Result<StoredPca<D>, CliError> {
    let unfit = |reason: &str| unfit_pca(directory, reason.into());
    let record: Record<PcaConfig, StoredModes, D> =
        read_record(directory).map_err(|reason| unfit(&reason))?;
    let Record {
        parameters: config,
        body: modes,
        doubts,
        ..
    } = record;
    let average = average.map_or_else(|| found_again(directory, &config.average), PathBuf::from);
    let dimension = read_dimension(&average).map_err(|reason| {
        let remedy = "if it has been moved, put it beside the modes, or name it with --average where that is an option";
        unfit_average(&average, format!("{reason}; {remedy}"))
    })?;
    if dimension.dimension() != D {
        return Err(unfit_average(&average, format!("its shapes are not {D}D")));
    }
    let stored = stored_average::<D>(&average, trust)?;
    let named = modes.average_sum.as_deref();
    stored.sums.is(named, &average, directory)?;
    let mut average = stored;
    let fields = ResultFields::new(directory, unfit_pca, trust)?;
    if modes.continuation.as_ref().is_some_and(|c| c.continued) {
        average.continue_from(&fields)?;
    }
    if average.image.is_some() {
        return Err(unfit(
            "its modes are those of images, which have no boundaries",
        ));
    }
    let grid: Grid<D> = *average.average.grid();
    let mut found = Vec::new();
    for j in 0..modes.n_modes {
        found.push(fields.vector(&grid, &numbered("mode", j, "npy"))?);
    }
    if modes.eigenvalues.len() < modes.n_modes {
        return Err(unfit("it has fewer eigenvalues than modes"));
    }
    let space = ModeSpace {
        params: average.pca_params(config.params),
        object: average.average.object().clone(),
        mean: fields.vector(&grid, Path::new("mean_displacement.npy"))?,
        eigenvalues: modes.eigenvalues[..modes.n_modes].to_vec(),
        fields: found,
        sample: SampleSize::of_weights(average.average.weights()),
    };
    let quality = modes.quality.as_ref();
    Ok(StoredPca {
        average,
        space,
        left_out_error: quality.and_then(|quality| quality.generalisation.last().copied()),
        doubts,
    })
}
