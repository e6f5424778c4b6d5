//! The files of a result directory.

use fe_grid::{Grid, ScalarField};
use shape_average::joint::StrainMaps;

use super::Outcome;
use super::draw;
use super::record::{record, summary};
use crate::error::CliError;
use crate::output::energy::write_energy;
use crate::output::npy::{Precision, write_field};
use crate::output::vti::VtiFile;
use crate::output::{ResultDir, deformation, numbered};
use crate::session::Session;
use crate::summary::Summary;

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
    let field = |name: &str, field: &ScalarField<f64, D>| {
        write_field(&directory.file(name), field, Precision::Double)
    };
    field("average.npy", &result.average)?;
    field("average_image.npy", &result.average_image)?;
    let mut vti = VtiFile::new(*result.average.grid(), Precision::Single)
        .field("average", &result.average)
        .field("average_image", &result.average_image);
    let maps: Vec<StrainMaps> = result.displacements.iter().map(StrainMaps::new).collect();
    for (i, displacement) in result.displacements.iter().enumerate() {
        let file = |kind: &str| directory.file(numbered(kind, i, "npy"));
        write_field(&file("smoothed"), &result.images[i], Precision::Double)?;
        write_field(
            &file("phasefield"),
            &result.phase_fields[i],
            Precision::Double,
        )?;
        write_field(&file("predicted"), &result.predicted(i), Precision::Double)?;
        write_field(
            &file("deformation"),
            &deformation(displacement),
            Precision::Double,
        )?;
        // One number a cell.
        let cells = displacement.grid().cells_per_axis();
        let lattice = Grid::with_nodes(cells, displacement.grid().spacing())?;
        for (kind, map) in [
            ("norm", &maps[i].norm),
            ("determinant", &maps[i].determinant),
        ] {
            let map = ScalarField::from_vec(lattice, map.clone())?;
            write_field(&file(kind), &map, Precision::Double)?;
        }
        vti = vti.field(&format!("displacement_{i:03}"), displacement);
        vti = vti.field(&format!("phase_field_{i:03}"), &result.phase_fields[i]);
    }
    vti.write(&directory.file("average.vti"))?;
    write_energy(directory, &outcome.history, &PARTS, |level| {
        parts(outcome, level)
    })?;
    draw::picture(outcome, &maps).write_png(&directory.file("average.png"))?;
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
