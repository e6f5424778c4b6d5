//! A law against its inverse model.

use fe_grid::pullback::Derivatives;
use hyperelastic::{LawName, LawSpec};
use shape_average::AverageResult;
use shape_pca::{Average, evaluate};
use shapespace_report::table::{Cell, Table};

use super::scene::{Scene, distance, outline};
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;
use shapespace_picture::colour;

/// Averages by the law of the options and by its inverse model, and the energies of both on the
/// deformations of the first, whole and in part.
pub(super) fn inverse_model<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let plain = scene.params.law;
    let inverse = LawSpec {
        law: other(plain.law)?,
        ..plain
    };
    let average = |law: LawSpec| scene.average(&law.law.to_string(), |params| params.law = law);
    let (a, b) = (average(plain)?, average(inverse)?);
    let (contour_a, contour_b) = (outline(&a)?, outline(&b)?);
    let mut table = Table::new([
        "share of the displacements",
        "energy",
        "energy of the inverse model",
        "relative difference",
        "order",
    ]);
    let mut before: Option<f64> = None;
    for share in [1.0, 0.5, 0.25, 0.125, 0.0625] {
        let (own, other) = (
            energy(scene, &a, plain, share)?,
            energy(scene, &a, inverse, share)?,
        );
        let difference = (other / own - 1.0).abs();
        let order: Cell = before.map_or("-".into(), |b| (b / difference).log2().into());
        before = Some(difference);
        table.row([
            share.into(),
            own.into(),
            other.into(),
            difference.into(),
            order,
        ]);
    }
    let mut tiles = Tiles::new(&scene.grid(), 4);
    tiles.shapes("shapes", &scene.distances, 0.0);
    tiles.average(&plain.law.to_string(), &a);
    tiles.average(&inverse.law.to_string(), &b);
    let pair = [(&contour_a, colour(0)), (&contour_b, colour(1))];
    tiles.outlines("both averages", &pair);
    Ok(Sheet {
        title: "A law and its inverse model",
        text: format!(
            "The inverse model measures a deformation by the energy of its inverse. The two averages are \
             at a mean distance of {:.1e}. On fractions of the deformations of the first (`1 + t u_i`) \
             both energies agree to second order in the strain: their relative difference falls like \
             `t`, that is with order 1.",
            distance(&contour_a, &contour_b)?
        ),
        table,
        picture: tiles.draw(),
    })
}

/// The inverse model of a law, or the law that this is the inverse model of.
fn other(law: LawName) -> Result<LawName, CliError> {
    let name = law.to_string();
    let other = match name.strip_prefix("inverse:") {
        Some(plain) => plain.to_owned(),
        None => format!("inverse:{name}"),
    };
    other
        .parse()
        .map_err(|source| CliError::Law { law: other, source })
}

/// The energy of the objects under a part of the displacements of an average.
fn energy<const D: usize>(
    scene: &Scene<'_, D>,
    result: &AverageResult<D>,
    law: LawSpec,
    share: f64,
) -> Result<f64, CliError> {
    let mut part = result.clone();
    for displacement in &mut part.displacements {
        fe_grid::vector::scale(share, displacement.as_mut_slice());
    }
    let average = Average::of_result(&part, &scene.params)?;
    let law = law.compile().map_err(shape_pca::PcaError::from)?;
    let sources = average.sources();
    let value = Derivatives::Value;
    Ok(evaluate(average.grid(), &law, 0.0, &sources, &[], value)?.value)
}
