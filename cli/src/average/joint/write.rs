//! The files of a result directory.

use shape_average::StrainMaps;

use super::Outcome;
use super::draw;
use super::record::{record, summary};
use crate::average::strain::write_maps;
use crate::error::CliError;
use crate::output::energy::write_energy;
use crate::output::npy::Precision;
use crate::output::vti::VtiFile;
use crate::output::{ResultDir, numbered};
use crate::session::Session;
use crate::shapes::WorldFrame;
use crate::summary::Summary;
use crate::warp::{Space, write_images, write_warps};

/// Names of the terms of the energy.
const PARTS: [&str; 4] = ["elastic", "mismatch", "length", "images"];

/// Writes everything, `result.json` last.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    session: &Session<'_>,
) -> Result<Summary, CliError> {
    let result = &outcome.result;
    directory.array("average.npy", &result.average)?;
    directory.array("average_image.npy", &result.average_image)?;
    directory.arrays("smoothed", 0, &result.images)?;
    directory.arrays("phasefield", 0, &result.phase_fields)?;
    directory.deformations("deformation", 0, &result.displacements)?;
    let maps: Vec<StrainMaps> = result.displacements.iter().map(StrainMaps::new).collect();
    for i in 0..maps.len() {
        directory.array(numbered("predicted", i, "npy"), &result.predicted(i))?;
    }
    write_maps(directory, result.average.grid(), &maps)?;
    let inputs = &outcome.images;
    let world = WorldFrame::of_inputs(inputs);
    let images = [
        ("average", &result.average_image),
        ("average_phasefield", &result.average),
    ];
    write_images(directory, inputs, &images)?;
    let space = Space::of_inputs(directory, inputs);
    let of_input = |number| Space::of_input(inputs, number);
    let determinants = maps.iter().map(|maps| &*maps.determinant);
    let jacobians = write_warps(
        directory,
        space.as_ref(),
        of_input,
        &result.displacements,
        determinants,
    )?;
    directory.with_file("average.vti", |path| {
        let mut vti = VtiFile::new(*result.average.grid(), Precision::Single)
            .within(world)
            .field("average", &result.average)
            .field("average_image", &result.average_image);
        let pairs = result.displacements.iter().zip(&result.phase_fields);
        for (i, (displacement, phase_field)) in pairs.enumerate() {
            vti = vti
                .field(&format!("displacement_{i:03}"), displacement)
                .field(&format!("phase_field_{i:03}"), phase_field);
        }
        vti.fields("jacobian", &jacobians).write(path)
    })?;
    write_energy(directory, &outcome.history, &PARTS, |level| {
        parts(outcome, level)
    })?;
    directory.picture("average.png", || draw::picture(outcome, &maps))?;
    let record = record(outcome, session.start);
    record.write(directory)?;
    Ok(summary(&record))
}

/// The weighted terms of the energy at the end of a level.
fn parts<const D: usize>(outcome: &Outcome<D>, level: usize) -> Option<Vec<f64>> {
    let energy = &outcome.result.levels.get(level)?.energy;
    let n = outcome.images.len() as f64;
    let mean = |terms: &[f64]| terms.iter().sum::<f64>() / n;
    let images: f64 = energy.images.iter().map(|i| i.total).sum();
    let params = &outcome.params.average;
    Some(vec![
        mean(&energy.shapes.elastic),
        params.mismatch_weight * mean(&energy.shapes.mismatch),
        params.resolved_length_weight() * energy.shapes.length,
        images / n,
    ])
}
