//! The summary on standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use ::geodesic::Form;

use super::record::Record;
use crate::report::certified;

/// Prints a short summary; the last line names the picture.
pub(super) fn print<const D: usize>(record: &Record<'_, D>, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &Record<'_, D>,
    target: &Path,
) -> std::fmt::Result {
    let (found, path) = (&record.body, record.body.result);
    let nodes: Vec<String> = record.nodes.iter().map(ToString::to_string).collect();
    writeln!(
        text,
        "Geodesic of {} steps on {} nodes: {} after {} iterations, {:.1} s",
        path.energy.step_energies.len(),
        nodes.join(" x "),
        record.status.replace('_', " "),
        found.iterations,
        record.seconds
    )?;
    writeln!(
        text,
        "  length       {:.6e}, its square {:.3e} of the dissipation {:.3e}",
        found.length,
        found.length * found.length,
        found.dissipation
    )?;
    writeln!(
        text,
        "  end          Dice {:.4} of the end shape and the start shape carried there",
        path.dice_end
    )?;
    if !found.end_reached {
        let remedy = match record.parameters.params.form {
            Form::Lagrangian => "try --form level-sets, a finer --grid, or --align rigid",
            Form::LevelSets => "try more steps (-K), a finer --grid, or --align rigid",
        };
        writeln!(
            text,
            "               the end shape is not reached: {remedy}"
        )?;
    }
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        certified(&path.certificate),
        path.certificate.min_det
    )?;
    writeln!(
        text,
        "  results      {}",
        target.join("result.json").display()
    )?;
    writeln!(
        text,
        "  picture      {}",
        target.join("geodesic.png").display()
    )
}
