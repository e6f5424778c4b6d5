//! Initial deformations of an average: those of an earlier result.

use std::path::Path;

use fe_grid::{Field, Grid};

use super::args::AverageConfig;
use crate::error::CliError;
use crate::grid::in_words;
use crate::output::numbered;
use crate::progress::Progress;
use crate::report::RESULT;
use crate::results::{ResultFields, read_record};
use shapespace_input::frame::FrameTransform;

fn unfit(path: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: path.into(),
        command: "average",
        reason,
    }
}

/// The displacements of an earlier average of the same number of shapes, on one of these grids.
///
/// # Errors
/// [`CliError::NoResult`] if they are missing or on another grid.
fn deformations<const D: usize>(
    directory: &Path,
    fields: &ResultFields<'_>,
    n_shapes: usize,
    grids: &[Grid<D>],
) -> Result<Vec<Field<f64, D, D>>, CliError> {
    let exists = |i: usize| directory.join(numbered("deformation", i, "npy")).is_file();
    let mut found = 0;
    while exists(found) {
        found += 1;
    }
    if found != n_shapes {
        let reason = format!("it has {found} deformations, and there are {n_shapes} inputs");
        return Err(unfit(directory, reason));
    }
    let nodes = fields.nodes(&numbered("deformation", 0, "npy"))?;
    let Some(grid) = grids.iter().find(|g| g.nodes_per_axis()[..] == nodes[..]) else {
        let sides: Vec<String> = grids.iter().map(in_words).collect();
        let reason = format!(
            "its deformations have {nodes:?} nodes, and the grids of this run have {} nodes",
            sides.join(", ")
        );
        return Err(unfit(directory, reason));
    };
    let read = |i| fields.displacement(grid, "deformation", i);
    (0..n_shapes).map(read).collect()
}

/// Whether the inputs of an earlier average had the same placement, if its record states it.
fn same_placement<const D: usize>(directory: &Path, frames: &[FrameTransform<D>]) -> bool {
    if !directory.join(RESULT).exists() {
        return true;
    }
    let record = read_record::<AverageConfig, (), D>(directory);
    record.is_ok_and(|record| {
        let mut all = record.input.iter().zip(frames);
        record.input.len() == frames.len() && all.all(|(a, b)| a.frame.like(b))
    })
}

/// The initial deformations: those of the average that `--start` names, none without.
///
/// # Errors
/// [`CliError::NoResult`] for a start that does not fit, and [`CliError::Damaged`] for one that has changed.
pub(super) fn initial<const D: usize>(
    start: Option<&Path>,
    n_shapes: usize,
    grids: &[Grid<D>],
    trust: bool,
) -> Result<Vec<Field<f64, D, D>>, CliError> {
    start.map_or_else(
        || Ok(Vec::new()),
        |directory| {
            let fields = ResultFields::new(directory, unfit, trust)?;
            deformations(directory, &fields, n_shapes, grids)
        },
    )
}

/// Warns if the inputs of the average that `--start` names had another placement.
pub(super) fn compare_places<const D: usize>(
    start: Option<&Path>,
    frames: impl Iterator<Item = FrameTransform<D>>,
    progress: &Progress,
) {
    let frames: Vec<_> = frames.collect();
    if let Some(directory) = start.filter(|directory| !same_placement(directory, &frames)) {
        progress.note(format!(
            "warning: the inputs of '{}' lay elsewhere in the box: its deformations fit badly",
            directory.display()
        ));
    }
}
