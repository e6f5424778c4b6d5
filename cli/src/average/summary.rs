//! The closing words on standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use super::record::ResultRecord;

/// Prints a short summary; the last line names the picture.
pub(super) fn print<const D: usize>(record: &ResultRecord<D>, target: &Path) {
    // Nobody is left to be told where standard output is closed.
    let _ = std::io::stdout().write_all(text(record, target).as_bytes());
}

fn text<const D: usize>(record: &ResultRecord<D>, target: &Path) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_lines(&mut text, record, target);
    text
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &ResultRecord<D>,
    target: &Path,
) -> std::fmt::Result {
    let nodes: Vec<String> = record.nodes.iter().map(ToString::to_string).collect();
    writeln!(
        text,
        "Average of {} shapes on {} nodes: {} after {} iterations, {:.1} s",
        record.input.len(),
        nodes.join(" x "),
        record.status.replace('_', " "),
        record.iterations,
        record.seconds
    )?;
    let p = &record.parameters;
    let mismatch: f64 = record.energy.mismatch.iter().sum::<f64>() / p.weights.len() as f64;
    let (mismatch, length) = (
        p.mismatch_weight * mismatch,
        p.length_weight * record.energy.length,
    );
    let elastic = record.energy.total - mismatch - length;
    writeln!(
        text,
        "  energy       {:.6e} = elastic {elastic:.3e} + mismatch {:.3e} + length {:.3e}",
        record.energy.total, mismatch, length
    )?;
    if let Some((worst, least)) = worst(&record.dice) {
        writeln!(
            text,
            "  overlap      Dice {:.4} on average, {least:.4} at least ({})",
            record.mean_dice, record.input[worst].path
        )?;
    }
    let certificate = record.certificate;
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        certificate.words(),
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
