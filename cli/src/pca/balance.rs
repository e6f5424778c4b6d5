//! Continues an average until its stresses balance, before its modes are computed.

use fe_grid::minimise::{Objective, Observer};
use fe_grid::{ScalarField, certify};
use levelset::Doubt;
use serde::Serialize;
use shape_average::{AverageError, AverageObjective, LevelShapes};
use shape_pca::{Average, BalanceReport, Balancing, PcaParams, push_forward};

use super::components::follow;
use super::read::StoredAverage;
use crate::error::CliError;

/// What was done to an average, and how its shapes fit before and afterwards.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Continuation {
    #[serde(flatten)]
    pub report: BalanceReport,
    /// Whether the modes refer to other deformations than those of the average: to `deformation_*.npy`
    /// and `average.npy` beside this record.
    pub continued: bool,
    /// Before, and afterwards if the average was continued.
    pub fits: Vec<Fit>,
}

impl Continuation {
    /// The doubt about deformations that fold almost, where these are no longer those of the average.
    pub fn doubt(&self, lower_bound: f64) -> Option<Doubt> {
        let after = self.fits.last().filter(|_| self.continued)?;
        Doubt::determinant(after.min_det, lower_bound)
    }
}

/// How the shapes of an average fit it.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Fit {
    /// Least overlap of a deformed shape with the average object.
    pub least_dice: f64,
    /// Mean mismatch of the shapes with the average.
    pub mismatch: f64,
    /// Least determinant of a deformation.
    pub min_det: f64,
}

/// Moves an average until its stresses balance; it stays as it is where they do. The average of images
/// is the whole box, medians have other weights, and of shapes that are partly hidden the average field
/// is not known: those stay as they are, and there is no record.
///
/// # Errors
/// Those of the law and of the linear solves.
pub(super) fn balanced<const D: usize>(
    stored: &mut StoredAverage<D>,
    params: &PcaParams,
    observer: &mut dyn Observer,
) -> Result<Option<Continuation>, CliError> {
    if stored.phase_fields.is_empty() {
        return Ok(None);
    }
    let balancing = Balancing {
        min_determinant: stored.params.min_determinant,
        ..Balancing::default()
    };
    let (average, report) = balancing.balance(&stored.average, params, observer)?;
    let mut fits = vec![fit(&stored.average, &objective(stored)?)?];
    let continued = report.changed();
    if continued {
        follow(&mut stored.components, [&stored.average, &average]);
        stored.average = average;
        let objective = objective(stored)?;
        fits.push(fit(&stored.average, &objective)?);
        take_average(stored, objective.average())?;
    }
    stored.phase_fields = Vec::new();
    Ok(Some(Continuation {
        report,
        continued,
        fits,
    }))
}

/// Takes over the phase field of a continued average; of several components their least one.
fn take_average<const D: usize>(
    stored: &mut StoredAverage<D>,
    fields: &[f64],
) -> Result<(), CliError> {
    let grid = *stored.average.grid();
    let mut fields = fields.chunks_exact(grid.n_nodes());
    let Some(first) = fields.clone().next() else {
        return Ok(());
    };
    let mut least = first.to_vec();
    for (component, field) in stored.components.iter_mut().zip(&mut fields) {
        component.phase_field = ScalarField::from_vec(grid, field.to_vec())?;
        for (least, value) in least.iter_mut().zip(field) {
            *least = least.min(*value);
        }
    }
    stored.phase_field = ScalarField::from_vec(grid, least)?;
    Ok(())
}

/// The functional of an average, evaluated at its deformations, of which this process has some.
fn objective<const D: usize>(
    stored: &StoredAverage<D>,
) -> Result<AverageObjective<D>, AverageError> {
    let average = &stored.average;
    let (own, n_components) = (average.distribution().own(), stored.components.len().max(1));
    let fields = own.start * n_components..own.end * n_components;
    let shapes = LevelShapes::from_components(
        *average.grid(),
        stored.params.interface_cells * average.grid().spacing(),
        n_components,
        stored.phase_fields[fields].to_vec(),
        average.indicators()[own.clone()].to_vec(),
    )
    .distributed(average.distribution().clone());
    let params = shape_average::AverageParams {
        weights: Some(average.weights().to_vec()),
        ..stored.params.clone()
    };
    let start = if stored.components.is_empty() {
        stored.phase_field.as_slice().to_vec()
    } else {
        let fields = stored.components.iter().map(|c| c.phase_field.as_slice());
        fields.collect::<Vec<_>>().concat()
    };
    let mut objective = AverageObjective::new(shapes, &params, start)?;
    let own: Vec<f64> = average.displacements()[own]
        .iter()
        .flat_map(fe_grid::Field::as_slice)
        .copied()
        .collect();
    objective.value(&own)?;
    Ok(objective)
}

fn fit<const D: usize>(
    average: &Average<D>,
    objective: &AverageObjective<D>,
) -> Result<Fit, CliError> {
    let distribution = average.distribution();
    let of = |i: usize| {
        let u = &average.displacements()[i];
        let pushed = push_forward(&average.indicators()[i], u, 0.0);
        let dice = levelset::dice(&pushed, 0.5, average.object(), 0.5)?;
        Ok([dice, certify(average.grid(), u.as_slice(), 0.0).min_det])
    };
    let own: Result<Vec<_>, CliError> = distribution.own().map(of).collect();
    let all = distribution.share(&own?).into_iter();
    let least = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].min(b[1])];
    let [least_dice, min_det] = all.fold([f64::INFINITY; 2], least);
    let mismatch = &objective.energy().mismatch;
    Ok(Fit {
        least_dice,
        mismatch: mismatch.iter().sum::<f64>() / mismatch.len().max(1) as f64,
        min_det,
    })
}
