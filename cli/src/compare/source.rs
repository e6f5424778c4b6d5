//! The result whose shapes are compared.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use shapespace_input::dimension::{Dim, per_dimension};

use super::CompareConfig;
use crate::doubts::DoubtRecord;
use crate::error::CliError;
use crate::groups::{self, Known, Labelled};
use crate::integrity::Sums;
use crate::pca::{StoredPca, read_pca};
use crate::results::{command_in, read_contents};
use crate::session::PlanOf;

/// What is known of the shapes.
pub(super) enum Kind<const D: usize> {
    /// Modes of variation, and the scores of the shapes.
    Modes(Box<StoredPca<D>>, StoredScores),
    /// The distances between them.
    Distances(Vec<Vec<f64>>),
}

/// A result and the groups of its shapes.
pub(crate) struct Compared<const D: usize> {
    pub(super) kind: Kind<D>,
    /// The names of its shapes.
    pub(super) names: Vec<String>,
    pub(super) labelled: Labelled,
    /// The doubts about it.
    pub(super) doubts: Vec<DoubtRecord>,
    /// The checksums of the files of its shapes, as far as they are known.
    pub(super) sums: Vec<Option<String>>,
}

/// The scores in the record of an analysis.
#[derive(Deserialize)]
pub(super) struct StoredScores {
    shapes: Vec<String>,
    pub scores: Vec<Vec<f64>>,
    /// Number of modes that are not negligible.
    pub degrees_of_freedom: usize,
}

#[derive(Deserialize)]
struct StoredDistances {
    dimension: usize,
    input: Vec<Named>,
    distances: Matrix,
    #[serde(default)]
    doubts: Vec<DoubtRecord>,
}

#[derive(Deserialize)]
struct Named {
    name: String,
    path: PathBuf,
    #[serde(default)]
    sha256: Option<String>,
}

#[derive(Deserialize)]
struct Matrix {
    #[serde(default)]
    matrix: Vec<Vec<Option<f64>>>,
}

fn unfit(directory: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: directory.into(),
        command: "pca` or `shapespace distances",
        reason,
    }
}

/// Reads the result and the table.
///
/// # Errors
/// [`CliError::NoResult`] for other directories, and those of the table and of reading modes.
pub(super) fn read(config: &CompareConfig, trust: bool) -> Result<PlanOf<CompareConfig>, CliError> {
    let directory = &config.result;
    match command_in(directory).as_deref() {
        Some("distances") => {
            // No array is read that would be verified with the record.
            Sums::of(directory, trust)?;
            distances(config)
        }
        Some("score" | "average" | "geodesic") => {
            let reason = "its shapes have neither scores of one analysis nor distances";
            Err(unfit(directory, reason.into()))
        }
        None => Err(unfit(
            directory,
            "it has no result.json of a command".into(),
        )),
        Some(_) => {
            let modes = read_pca(directory, config.average.as_deref(), trust)?;
            Ok(per_dimension!(modes, modes => of_modes(config, modes)?))
        }
    }
}

fn of_modes<const D: usize>(
    config: &CompareConfig,
    modes: StoredPca<D>,
) -> Result<Compared<D>, CliError> {
    let scores: StoredScores =
        read_contents(&config.result).map_err(|reason| unfit(&config.result, reason))?;
    let n = modes.average.names.len();
    if scores.scores.len() != n || scores.shapes.len() != n {
        let reason = "its scores are not those of the shapes of its average";
        return Err(unfit(&config.result, reason.into()));
    }
    let available = modes.space.fields.len();
    if let Some(wanted) = config.modes
        && wanted > available
    {
        return Err(CliError::Option {
            option: "--modes",
            value: wanted.to_string(),
            remedy: format!("the result has {available} modes: give this number or a smaller one"),
        });
    }
    let known = Known {
        names: &scores.shapes,
        files: &modes.average.files,
    };
    Ok(Compared {
        labelled: groups::read(&config.wanted(), &known)?,
        names: scores.shapes.clone(),
        doubts: modes.doubts.clone(),
        sums: modes.average.input_sums.clone(),
        kind: Kind::Modes(Box::new(modes), scores),
    })
}

fn distances(config: &CompareConfig) -> Result<PlanOf<CompareConfig>, CliError> {
    let directory = &config.result;
    if let Some(modes) = config.modes {
        return Err(CliError::Option {
            option: "--modes",
            value: modes.to_string(),
            remedy: "leave it out: this is a result of `shapespace distances`, which has no modes"
                .into(),
        });
    }
    if let Some(covariate) = config.covariates.first() {
        return Err(CliError::Option {
            option: "--covariates",
            value: covariate.clone(),
            remedy: "leave it out: this is a result of `shapespace distances`, and regressions need the scores of \
                     `shapespace pca`"
                .into(),
        });
    }
    if let Some(average) = &config.average {
        return Err(CliError::Option {
            option: "--average",
            value: average.display().to_string(),
            remedy:
                "leave it out: this is a result of `shapespace distances`, which has no average"
                    .into(),
        });
    }
    let found: StoredDistances =
        read_contents(directory).map_err(|reason| unfit(directory, reason))?;
    let dimension = found.dimension;
    let sums: Vec<Option<String>> = found.input.iter().map(|i| i.sha256.clone()).collect();
    let (names, files): (Vec<String>, Vec<PathBuf>) =
        found.input.into_iter().map(|i| (i.name, i.path)).unzip();
    let known = Known {
        names: &names,
        files: &files,
    };
    let labelled = groups::read(&config.wanted(), &known)?;
    let rows = found.distances.matrix.into_iter();
    let matrix: Option<Vec<Vec<f64>>> = rows.map(|row| row.into_iter().collect()).collect();
    let matrix = matrix
        .filter(|matrix| matrix.len() == names.len())
        .ok_or_else(|| {
            let reason = "some of its distances are missing: a comparison needs all of them";
            unfit(directory, reason.into())
        })?;
    let dimension = match dimension {
        2 => Dim::D2(()),
        3 => Dim::D3(()),
        other => return Err(unfit(directory, format!("it has {other} dimensions"))),
    };
    Ok(per_dimension!(dimension, () => Compared {
        kind: Kind::Distances(matrix.clone()),
        names: names.clone(),
        labelled: labelled.clone(),
        doubts: found.doubts.clone(),
        sums,
    }))
}
