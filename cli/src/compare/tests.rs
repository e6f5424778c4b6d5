//! The tests of a comparison.

use fe_grid::{ScalarField, VectorField};
use levelset::{BoxEdge, Contour, ContourDistance, contour, signed_distance};
use shape_pca::groups::{
    Classification, GroupError, Permanova, PointTests, Regression, ScoreTests, classify,
    compare_points, compare_scores, permanova, regress,
};
use shape_pca::{ModeSpace, PcaError};

use super::CompareConfig;
use super::source::{Compared, Kind, StoredScores};
use crate::error::CliError;
use crate::groups::Covariate;

/// The result of a comparison.
pub(crate) struct Outcome<const D: usize> {
    pub(super) compared: Compared<D>,
    pub(super) found: Found<D>,
}

/// What was tested.
pub(super) enum Found<const D: usize> {
    Modes(Box<OfModes<D>>),
    Distances(Permanova),
}

/// The tests of modes.
pub(super) struct OfModes<const D: usize> {
    /// The scores in the modes that were compared.
    pub scores: Vec<Vec<f64>>,
    pub tests: ScoreTests,
    pub classification: Classification,
    /// The boundary of the average.
    pub outline: Contour<D>,
    /// The mean shape of every group.
    pub means: Vec<Predicted<D>>,
    /// The normal displacement of every mean at the points of the boundary, outwards.
    pub displacements: Vec<Vec<f64>>,
    pub points: PointTests,
    pub covariates: Vec<OfCovariate<D>>,
}

/// The regression on a covariate.
pub(super) struct OfCovariate<const D: usize> {
    pub name: String,
    pub regression: Regression,
    /// The least, the mean and the greatest value, and the shapes that it predicts there.
    pub values: [f64; 3],
    pub shapes: Vec<Predicted<D>>,
}

/// A shape of given scores.
pub(super) struct Predicted<const D: usize> {
    pub scores: Vec<f64>,
    pub outline: Contour<D>,
    pub level_set: ScalarField<f64, D>,
}

pub(super) fn compute<const D: usize>(
    config: &CompareConfig,
    compared: Compared<D>,
) -> Result<Outcome<D>, CliError> {
    let groups = &compared.labelled.groups;
    let found = match &compared.kind {
        Kind::Distances(matrix) => Found::Distances(
            permanova(matrix, groups, config.relabelling())
                .map_err(|error| failed(config, &error))?,
        ),
        Kind::Modes(stored, scores) => {
            let found = of_modes(config, &stored.space, scores, &compared)?;
            Found::Modes(Box::new(found))
        }
    };
    Ok(Outcome { compared, found })
}

fn of_modes<const D: usize>(
    config: &CompareConfig,
    space: &ModeSpace<D>,
    stored: &StoredScores,
    compared: &Compared<D>,
) -> Result<OfModes<D>, CliError> {
    let (groups, relabelling) = (&compared.labelled.groups, config.relabelling());
    let usual = stored.degrees_of_freedom.min(space.fields.len());
    let modes = config.modes.unwrap_or(usual);
    let rows = stored.scores.iter();
    let scores: Vec<Vec<f64>> = rows
        .map(|row| row.iter().take(modes).copied().collect())
        .collect();
    let deviations: Vec<f64> = space
        .eigenvalues
        .iter()
        .map(|v| v.max(0.0).sqrt())
        .collect();
    let coordinates: Vec<Vec<f64>> = scores
        .iter()
        .map(|row| row.iter().zip(&deviations).map(|(s, d)| s * d).collect())
        .collect();
    let outline = contour(&space.object, 0.5, BoxEdge::Closed)?;
    let distance = signed_distance(&space.object, 0.5)?;
    let normals = outwards(&outline, &distance);
    let displacement =
        |scores: &[f64]| -> Result<VectorField<f64, D>, PcaError> { space.synthesise(scores) };
    let at_points = |scores: &[f64]| -> Result<Vec<f64>, CliError> {
        let u = displacement(scores)?;
        let points = outline.points().iter().zip(&normals);
        // The shape is `(1 - u)(S)`.
        let along = |(p, n): (&[f64; D], &[f64; D])| {
            let u: [f64; D] = u.sample(*p);
            -(0..D).map(|k| u[k] * n[k]).sum::<f64>()
        };
        Ok(points.map(along).collect())
    };
    let predicted = |scores: Vec<f64>| -> Result<Predicted<D>, CliError> {
        let outline = outline.displaced(&displacement(&scores)?, -1.0);
        let distance = ContourDistance::new(&outline)?;
        Ok(Predicted {
            level_set: distance.sample(*space.object.grid()),
            scores,
            outline,
        })
    };
    let loads: Vec<Vec<f64>> = scores
        .iter()
        .map(|s| at_points(s))
        .collect::<Result<_, _>>()?;
    let means = groups
        .means(&scores)
        .map_err(|error| failed(config, &error))?;
    let displacements = means
        .iter()
        .map(|s| at_points(s))
        .collect::<Result<_, _>>()?;
    let covariates = compared.labelled.covariates.iter();
    let covariates = covariates
        .map(|Covariate { name, values }| {
            let mut regression = regress(&coordinates, values, relabelling)
                .map_err(|error| failed(config, &error))?;
            // From coordinates to scores; modes that are compared vary.
            for numbers in [&mut regression.intercept, &mut regression.slope] {
                for (x, deviation) in numbers.iter_mut().zip(&deviations) {
                    *x /= deviation.max(f64::MIN_POSITIVE);
                }
            }
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let values = [
                least,
                values.iter().sum::<f64>() / values.len() as f64,
                most,
            ];
            let shapes = values.iter().map(|&x| predicted(regression.predict(x)));
            Ok(OfCovariate {
                name: name.clone(),
                values,
                shapes: shapes.collect::<Result<_, CliError>>()?,
                regression,
            })
        })
        .collect::<Result<_, CliError>>()?;
    Ok(OfModes {
        tests: compare_scores(&coordinates, groups, relabelling)
            .map_err(|error| failed(config, &error))?,
        classification: classify(&scores, groups, modes, relabelling)
            .map_err(|error| failed(config, &error))?,
        points: compare_points(&loads, groups, relabelling)
            .map_err(|error| failed(config, &error))?,
        means: means.into_iter().map(predicted).collect::<Result<_, _>>()?,
        displacements,
        covariates,
        outline,
        scores,
    })
}

/// The outward unit normals at the points of a boundary, from its signed distance (positive inside).
fn outwards<const D: usize>(outline: &Contour<D>, distance: &ScalarField<f64, D>) -> Vec<[f64; D]> {
    let step = distance.grid().spacing();
    let normal = |p: &[f64; D]| {
        let slope: [f64; D] = std::array::from_fn(|k| {
            let at = |by: f64| {
                let mut q = *p;
                q[k] += by;
                distance.sample(q)[0]
            };
            at(-step) - at(step)
        });
        let length = slope.iter().map(|x| x * x).sum::<f64>().sqrt();
        slope.map(|x| x / length.max(f64::MIN_POSITIVE))
    };
    outline.points().iter().map(normal).collect()
}

/// The error for shapes and groups that cannot be compared, and for a result whose numbers cannot be.
fn failed(config: &CompareConfig, error: &GroupError) -> CliError {
    let message = format!("the groups cannot be compared: {error}");
    let remedy = match error {
        GroupError::ConstantCovariate | GroupError::TooFewShapes { .. } => {
            "leave the covariate out with --covariates"
        }
        GroupError::EqualWithin => {
            "see whether the same file stands for several shapes of a group, under different names"
        }
        _ => {
            return CliError::Computation {
                message,
                remedy: "compute the result again: its numbers cannot be compared".into(),
            };
        }
    };
    CliError::Config {
        path: config.groups.clone(),
        line: 0,
        message,
        remedy: remedy.into(),
    }
}
