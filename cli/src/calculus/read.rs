//! Reads the directory of a geodesic.

use std::path::Path;

use ::geodesic::calculus::CalculusParams;
use ::geodesic::lagrangian::Domain;
use ::geodesic::{Form, GeodesicParams};
use fe_grid::{Field, Grid, ScalarField};
use serde::Deserialize;

use super::args::SolverOptions;
use crate::doubts::DoubtRecord;
use crate::error::CliError;
use crate::geodesic::GeodesicConfig;
use crate::report::Record;
use crate::results::{ResultFields, read_dimension, read_record};
use crate::shapes::InputRecord;
use shapespace_input::ReadOptions;
use shapespace_input::dimension::{Dim, per_dimension};

/// The record of the steps of a geodesic.
#[derive(Clone, Debug, Deserialize)]
struct Steps {
    step_energies: Vec<f64>,
    #[serde(default)]
    domain: Domain,
}

/// A geodesic of deformations of one start shape.
pub(crate) struct StoredGeodesic<const D: usize> {
    /// Signed distances of the shapes.
    pub level_sets: Vec<ScalarField<f64, D>>,
    /// Displacements of the deformations of each shape into the next.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Displacements of the deformations of the first shape into every other.
    pub motions: Vec<Field<f64, D, D>>,
    /// The displacement of the deformation of the last shape into the one before, where the path was computed on
    /// the domain of its end.
    pub before_end: Option<Field<f64, D, D>>,
    /// Energies of the steps.
    pub energies: Vec<f64>,
    /// The doubts about it.
    pub doubts: Vec<DoubtRecord>,
    /// Names of start and end in pictures.
    pub names: [String; 2],
    /// Parameters of the geodesic.
    pub params: GeodesicParams,
    /// How the masks were read.
    pub read_options: ReadOptions,
    /// Start and end.
    pub inputs: Vec<InputRecord<D>>,
}

/// Reads the directory of a geodesic.
///
/// # Errors
/// [`CliError::NoGeodesic`] for another directory, or for a geodesic of level sets, and
/// [`CliError::Input`] for an array that cannot be read.
pub(crate) fn read(
    directory: &Path,
    trust: bool,
) -> Result<Dim<StoredGeodesic<2>, StoredGeodesic<3>>, CliError> {
    let dimension = read_dimension(directory).map_err(|reason| unfit(directory, reason))?;
    Ok(per_dimension!(dimension, () => stored(directory, trust)?))
}

fn unfit(directory: &Path, reason: String) -> CliError {
    CliError::NoGeodesic {
        path: directory.into(),
        reason,
    }
}

fn stored<const D: usize>(directory: &Path, trust: bool) -> Result<StoredGeodesic<D>, CliError> {
    let record: Record<GeodesicConfig, Steps, D> =
        read_record(directory).map_err(|reason| unfit(directory, reason))?;
    let masks = &record.parameters.masks;
    let read_options = masks.reading();
    let (params, energies) = (record.parameters.params, record.body.step_energies);
    if params.form == Form::LevelSets {
        return Err(unfit(
            directory,
            "its path is one of level sets, which have no common start domain".into(),
        ));
    }
    let [start, end] = record.input.as_slice() else {
        return Err(unfit(directory, "it does not have two inputs".into()));
    };
    let steps = energies.len();
    if steps == 0 {
        return Err(unfit(directory, "it has no steps".into()));
    }
    let fields = ResultFields::new(directory, unfit, trust)?;
    let mut level_sets = vec![fields.numbered_scalar::<D>("shape", 0)?];
    let grid = *level_sets[0].grid();
    let (mut displacements, mut motions) = (Vec::new(), Vec::new());
    for k in 1..=steps {
        level_sets.push(fields.numbered_scalar("shape", k)?);
        displacements.push(fields.displacement(&grid, "deformation", k)?);
        motions.push(fields.displacement(&grid, "psi", k)?);
    }
    if level_sets.iter().any(|u| *u.grid() != grid) {
        return Err(unfit(directory, "its shapes lie on different grids".into()));
    }
    let before_end = match record.body.domain {
        Domain::Start | Domain::Middle => None,
        Domain::End => Some(fields.displacement(&grid, "backward", 1)?),
    };
    let names = [start, end].map(|input| input.name.clone());
    Ok(StoredGeodesic {
        level_sets,
        displacements,
        motions,
        before_end,
        energies,
        doubts: record.doubts,
        names,
        // An interrupted path has fewer steps than requested.
        params: GeodesicParams { steps, ..params },
        read_options,
        inputs: record.input,
    })
}

impl<const D: usize> StoredGeodesic<D> {
    /// The parameters of the calculus in the metric of the geodesic.
    pub fn calculus_params(&self, solver: SolverOptions) -> CalculusParams {
        solver.params(&CalculusParams::from(&self.params))
    }

    /// The memory of so many numbers a node, in bytes.
    pub fn bytes(&self, numbers: usize) -> u64 {
        (size_of::<f64>() * numbers * self.grid().n_nodes()) as u64
    }

    /// The memory of the signed distances, and of the displacements between the shapes.
    pub fn shapes_bytes(&self) -> u64 {
        self.bytes(self.level_sets.len() + D * self.displacements.len())
    }

    /// The grid of all fields.
    pub fn grid(&self) -> &Grid<D> {
        self.level_sets[0].grid()
    }
}
