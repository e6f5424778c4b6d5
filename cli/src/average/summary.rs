//! The summary on standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use super::record::Record;
use crate::report::certified;

/// Prints a short summary; the last line names the picture.
pub(super) fn print<const D: usize>(record: &Record<'_, D>, target: &Path) {
    // A closed standard output is not an error.
    let _ = std::io::stdout().write_all(text(record, target).as_bytes());
}

fn text<const D: usize>(record: &Record<'_, D>, target: &Path) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_lines(&mut text, record, target);
    text
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &Record<'_, D>,
    target: &Path,
) -> std::fmt::Result {
    let nodes: Vec<String> = record.nodes.iter().map(ToString::to_string).collect();
    writeln!(
        text,
        "Average of {} shapes on {} nodes: {} after {} iterations, {:.1} s",
        record.input.len(),
        nodes.join(" x "),
        record.status.replace('_', " "),
        record.body.iterations,
        record.seconds
    )?;
    let (params, found) = (&record.parameters.params, &record.body);
    let energy = &found.result.energy;
    let mismatch: f64 = energy.mismatch.iter().sum::<f64>() / energy.mismatch.len() as f64;
    let (mismatch, length) = (
        params.mismatch_weight * mismatch,
        params.resolved_length_weight() * energy.length,
    );
    let elastic = energy.total - mismatch - length;
    writeln!(
        text,
        "  energy       {:.6e} = elastic {elastic:.3e} + mismatch {:.3e} + length {:.3e}",
        energy.total, mismatch, length
    )?;
    if let Some((worst, least)) = worst(&found.result.dice) {
        writeln!(
            text,
            "  overlap      Dice {:.4} on average, {least:.4} at least ({})",
            found.mean_dice,
            record.input[worst].path.display()
        )?;
    }
    let certificate = found.result.certificate;
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        certified(&certificate),
        certificate.min_det
    )?;
    if record.cancelled() {
        writeln!(text, "  to go on     --start {}", target.display())?;
    }
    writeln!(
        text,
        "  results      {}",
        target.join("result.json").display()
    )?;
    writeln!(
        text,
        "  picture      {}",
        target.join("average.png").display()
    )
}

fn worst(dice: &[f64]) -> Option<(usize, f64)> {
    let overlaps = dice.iter().copied().enumerate();
    overlaps.min_by(|a, b| a.1.total_cmp(&b.1))
}
