//! The directory of a geodesic, read back.

use std::fs;
use std::path::{Path, PathBuf};

use ::geodesic::GeodesicParams;
use ::geodesic::calculus::CalculusParams;
use fe_grid::{Field, ScalarField};
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::Deserialize;

use super::args::SolverArgs;
use crate::error::CliError;
use crate::geodesic::Form;
use crate::input::place::FrameTransform;
use crate::results::ResultFields;
use crate::shapes::labels;

/// What is read of `result.json`.
#[derive(Clone, Debug, Deserialize)]
struct Told {
    dimension: usize,
    input: Vec<ToldInput>,
    parameters: ToldParameters,
    step_energies: Vec<f64>,
}

#[derive(Clone, Debug, Deserialize)]
struct ToldInput {
    path: PathBuf,
    size: Vec<usize>,
    frame: serde_json::Value,
    alignment: Option<ToldAlignment>,
}

#[derive(Clone, Debug, Deserialize)]
struct ToldAlignment {
    rotation: Vec<Vec<f64>>,
    translation: Vec<f64>,
}

#[derive(Clone, Debug, Deserialize)]
struct ToldParameters {
    form: Form,
    tolerance: f64,
    max_iterations: usize,
    law: LawName,
    lambda: f64,
    mu: f64,
    match_weight: f64,
    void_stiffness: f64,
    void_viscosity: f64,
    match_cells: f64,
    indicator_cells: f64,
    coarsest_nodes: usize,
}

/// A geodesic of deformations of one start shape.
pub(super) struct Given<const D: usize> {
    /// Signed distances of the shapes.
    pub level_sets: Vec<ScalarField<f64, D>>,
    /// Displacements of the deformations of each shape into the next.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Displacements of the deformations of the first shape into every other.
    pub motions: Vec<Field<f64, D, D>>,
    /// Energies of the steps.
    pub energies: Vec<f64>,
    /// Names of start and end in pictures.
    pub names: [String; 2],
    /// Parameters of the geodesic.
    pub params: GeodesicParams,
    /// Where the start mask lies.
    pub home: Home<D>,
}

/// Where the start mask lies in the unit box.
#[derive(Clone, Debug)]
pub(super) struct Home<const D: usize> {
    /// Samples along each axis, `x` first.
    pub size: [usize; D],
    /// From samples to the unit box.
    pub frame: FrameTransform<D>,
    /// What was done after that: a rotation, row by row, and a shift.
    pub motion: Option<([[f64; D]; D], [f64; D])>,
}

/// A geodesic of either dimension.
pub(super) enum AnyGiven {
    /// In the plane.
    D2(Given<2>),
    /// In space.
    D3(Given<3>),
}

/// Reads the directory of a geodesic.
///
/// # Errors
/// [`CliError::NoGeodesic`] where it is none, or one of level sets, and [`CliError::Input`] for an
/// array that cannot be read.
pub(super) fn read(directory: &Path) -> Result<AnyGiven, CliError> {
    let file = directory.join("result.json");
    let text = fs::read(&file).map_err(|source| {
        unfit(
            directory,
            format!("its result.json cannot be read: {source}"),
        )
    })?;
    let form = serde_json::from_slice::<serde_json::Value>(&text)
        .ok()
        .and_then(|told| told["parameters"]["form"].as_str().map(str::to_owned));
    if form.as_deref() == Some("level_sets") {
        return Err(unfit(
            directory,
            "its path is one of level sets, which have no common start domain".into(),
        ));
    }
    let told: Told = serde_json::from_slice(&text)
        .map_err(|error| unfit(directory, format!("its result.json is another's: {error}")))?;
    match told.dimension {
        2 => given(directory, &told).map(AnyGiven::D2),
        3 => given(directory, &told).map(AnyGiven::D3),
        other => Err(unfit(directory, format!("it has {other} dimensions"))),
    }
}

fn unfit(directory: &Path, reason: String) -> CliError {
    CliError::NoGeodesic {
        path: directory.into(),
        reason,
    }
}

fn given<const D: usize>(directory: &Path, told: &Told) -> Result<Given<D>, CliError> {
    let [start, end] = told.input.as_slice() else {
        return Err(unfit(directory, "it has not two inputs".into()));
    };
    let steps = told.step_energies.len();
    if steps == 0 || told.parameters.form != Form::Lagrangian {
        return Err(unfit(directory, "it has no steps".into()));
    }
    let fields = ResultFields { directory, unfit };
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
    let names = labels(&[&start.path, &end.path]);
    Ok(Given {
        level_sets,
        displacements,
        motions,
        energies: told.step_energies.clone(),
        names: std::array::from_fn(|i| names[i].clone()),
        params: told.parameters.geodesic_params(steps),
        home: home(start)
            .ok_or_else(|| unfit(directory, "it does not say where its start lies".into()))?,
    })
}

fn home<const D: usize>(start: &ToldInput) -> Option<Home<D>> {
    let motion = match &start.alignment {
        None => None,
        Some(alignment) => {
            let mut rotation = [[0.0; D]; D];
            for (row, told) in rotation.iter_mut().zip(&alignment.rotation) {
                *row = told.as_slice().try_into().ok()?;
            }
            Some((rotation, alignment.translation.as_slice().try_into().ok()?))
        }
    };
    Some(Home {
        size: start.size.as_slice().try_into().ok()?,
        frame: serde_json::from_value(start.frame.clone()).ok()?,
        motion,
    })
}

impl ToldParameters {
    fn geodesic_params(&self, steps: usize) -> GeodesicParams {
        GeodesicParams {
            steps,
            law: LawSpec {
                law: self.law,
                moduli: LameModuli {
                    lambda: self.lambda,
                    mu: self.mu,
                },
            },
            match_weight: self.match_weight,
            void_stiffness: self.void_stiffness,
            void_viscosity: self.void_viscosity,
            match_cells: self.match_cells,
            indicator_cells: self.indicator_cells,
            coarsest_nodes: self.coarsest_nodes,
            tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            ..GeodesicParams::default()
        }
    }
}

impl<const D: usize> Given<D> {
    /// The parameters of the calculus in the metric of the geodesic.
    pub fn calculus_params(&self, solver: &SolverArgs) -> CalculusParams {
        CalculusParams {
            tolerance: solver.tolerance,
            max_iterations: solver.max_iterations as usize,
            ..CalculusParams::from(&self.params)
        }
    }

    /// Nodes a side.
    pub fn nodes(&self) -> usize {
        self.level_sets[0].grid().nodes_per_axis()[0]
    }
}
