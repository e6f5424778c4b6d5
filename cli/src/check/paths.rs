//! The energies of the steps of a geodesic, its length, and the determinants of its deformations, recomputed from its arrays.

use std::path::Path;

use ::geodesic::lagrangian::{Domain, PathObjective};
use ::geodesic::level_sets::LevelSetObjective;
use ::geodesic::{Form, GeodesicParams, PathEnergy, certificate_inside};
use fe_grid::minimise::Evaluation;
use fe_grid::{Grid, ScalarField};
use serde::Deserialize;

use super::{Findings, NEGLIGIBLE};
use crate::error::CliError;
use crate::geodesic::GeodesicConfig;
use crate::numbers::shown;
use crate::output::numbered;
use crate::report::Record;
use crate::results::{ResultFields, read_record};

/// What the record of a geodesic says about its steps.
#[derive(Deserialize)]
struct Steps {
    step_energies: Vec<f64>,
    length: Option<f64>,
    dissipation: Option<f64>,
    #[serde(default)]
    domain: Domain,
    certificate: Option<Determinant>,
}

/// What is read of a certificate.
#[derive(Deserialize)]
struct Determinant {
    min_det: f64,
}

/// What the arrays of a path give.
struct Found {
    /// The least determinant inside the object of the deformations that were minimised: those that are composed of them,
    /// and sampled at nodes, may fold in the void.
    least: f64,
    /// The energy of the path; `None` where a deformation is not admissible.
    energy: Option<PathEnergy>,
}

/// Compares the energies of all steps, the length, the dissipation and the least determinant with those that the record
/// states.
///
/// # Errors
/// [`CliError::NoGeodesic`] for another record, and those of reading arrays.
pub(super) fn check_steps<const D: usize>(
    directory: &Path,
    findings: &mut Findings,
) -> Result<(), CliError> {
    let unfit = |directory: &Path, reason| CliError::NoGeodesic {
        path: directory.into(),
        reason,
    };
    let record: Record<GeodesicConfig, Steps, D> =
        read_record(directory).map_err(|reason| unfit(directory, reason))?;
    let Steps {
        step_energies: stated,
        length,
        dissipation,
        domain,
        certificate,
    } = record.body;
    if stated.is_empty() {
        return Ok(());
    }
    // An interrupted path has fewer steps than requested.
    let params = GeodesicParams {
        steps: stated.len(),
        ..record.parameters.params
    };
    let fields = ResultFields::new(directory, unfit, true)?;
    let found = match params.form {
        Form::Lagrangian => of_motions::<D>(&fields, domain, &params)?,
        Form::LevelSets => of_level_sets::<D>(&fields, &params)?,
    };
    match certificate {
        Some(stated) => findings.compare("determinant".into(), found.least, stated.min_det),
        None => findings.add("determinant", shown(found.least), found.least > 0.0),
    }
    match found.energy {
        Some(found) => {
            if let Some(stated) = dissipation {
                findings.compare("dissipation".into(), found.dissipation(), stated);
            }
            if let Some(stated) = length {
                let (what, negligible) = ("length".into(), NEGLIGIBLE.sqrt());
                findings.compare_above(negligible, what, found.length(), stated);
            }
            for (k, (found, stated)) in found.step_energies.into_iter().zip(stated).enumerate() {
                findings.compare(format!("energy of step {}", k + 1), found, stated);
            }
        }
        None => findings.add("step energies", "a deformation folds", false),
    }
    Ok(())
}

/// Those of deformations of the shape on whose domain the path was computed.
fn of_motions<const D: usize>(
    fields: &ResultFields<'_>,
    domain: Domain,
    params: &GeodesicParams,
) -> Result<Found, CliError> {
    let start: ScalarField<f64, D> = fields.numbered_scalar("shape", 0)?;
    let grid = *start.grid();
    let end = shape(fields, &grid, params.steps)?;
    let (kind, first, params) = match domain {
        Domain::Start => ("psi", 1, params.clone()),
        Domain::End => ("backward", 1, params.inverted()),
        Domain::Middle => ("middle", 0, params.clone()),
    };
    let (mut objective, own) = match domain {
        Domain::Middle => {
            let name = Path::new("middle_shape.npy");
            let own: ScalarField<f64, D> = fields.scalar(name)?;
            if *own.grid() != grid {
                return Err(fields.wrong_size(name));
            }
            let ends = [start, end];
            let objective = PathObjective::of_middle(own.clone(), ends, params.steps, &params)?;
            (objective, own)
        }
        Domain::Start | Domain::End => {
            let [own, other] = domain.order(start, end);
            let objective = PathObjective::new(own.clone(), other, params.steps, &params)?;
            (objective, own)
        }
    };
    let (mut motions, mut least) = (Vec::new(), f64::INFINITY);
    for k in first..=params.steps {
        let motion = fields.displacement(&grid, kind, k)?;
        least = least.min(certificate_inside(&own, &motion).min_det);
        motions.extend_from_slice(motion.as_slice());
    }
    let value = objective.evaluate(&motions, &mut [])?;
    let mut energy = objective.energy().clone();
    if domain == Domain::End {
        energy.step_energies.reverse();
    }
    Ok(Found {
        least,
        energy: (value != Evaluation::Inadmissible).then_some(energy),
    })
}

/// The level set of a shape on this grid.
fn shape<const D: usize>(
    fields: &ResultFields<'_>,
    grid: &Grid<D>,
    k: usize,
) -> Result<ScalarField<f64, D>, CliError> {
    let shape = fields.numbered_scalar("shape", k)?;
    if shape.grid() == grid {
        return Ok(shape);
    }
    Err(fields.wrong_size(&numbered("shape", k, "npy")))
}

/// Those of level sets that are deformed into each other.
fn of_level_sets<const D: usize>(
    fields: &ResultFields<'_>,
    params: &GeodesicParams,
) -> Result<Found, CliError> {
    let first: ScalarField<f64, D> = fields.numbered_scalar("shape", 0)?;
    let grid = *first.grid();
    let mut state = first.as_slice().to_vec();
    let (mut before, mut least) = (first, f64::INFINITY);
    for k in 1..=params.steps {
        let step = fields.displacement(&grid, "deformation", k)?;
        least = least.min(certificate_inside(&before, &step).min_det);
        before = shape(fields, &grid, k)?;
        state.extend_from_slice(step.as_slice());
        state.extend_from_slice(before.as_slice());
    }
    let mut energy = LevelSetObjective::new(grid, params.steps, params)?;
    let value = energy.evaluate(&state, &mut [])?;
    Ok(Found {
        least,
        energy: (value != Evaluation::Inadmissible).then(|| energy.energy().clone()),
    })
}
