//! The summary on standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use super::pair::PairRecord;
use super::record::{MarkOutcome, MarkRecord, MatrixRecord, Record};

/// Maximum number of marked paths that are listed.
const NAMED: usize = 6;

/// Prints a short summary; the last line names the picture.
pub(super) fn print<const D: usize>(record: &Record<D>, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Prints how to resume.
pub(super) fn print_interrupted(done: usize, total: usize, path: &Path) {
    let text = format!(
        "Stopped with {done} of {total} pairs finished, which are kept in {}\n  \
         the same command goes on from there\n",
        path.display()
    );
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Finished pairs among the requested ones.
pub(super) fn finished(pairs: &[Option<PairRecord>]) -> usize {
    pairs.iter().flatten().count()
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &Record<D>,
    target: &Path,
) -> std::fmt::Result {
    let nodes: Vec<String> = record.nodes.iter().map(ToString::to_string).collect();
    let ways = if record.parameters.one_way {
        "one way"
    } else {
        "both ways"
    };
    writeln!(
        text,
        "Distances of {} shapes on {} nodes, {} steps, {ways}: {} pairs, {:.1} s",
        record.input.len(),
        nodes.join(" x "),
        record.parameters.params.steps,
        record.body.paths.len(),
        record.seconds
    )?;
    write_marks(text, record)?;
    let distances = &record.body.distances;
    match distances.range() {
        Some([low, high]) => writeln!(text, "  distances    from {low:.4e} to {high:.4e}")?,
        None => writeln!(
            text,
            "  distances    NOT between all shapes: no clusters and no map"
        )?,
    }
    if let Some(asymmetry) = &distances.asymmetry {
        let [i, j] = asymmetry.worst.map(|i| record.input[i].name.as_str());
        writeln!(
            text,
            "  asymmetry    {:.1} % in the mean, {:.1} % at most ({i} and {j})",
            100.0 * asymmetry.mean,
            100.0 * asymmetry.largest
        )?;
    }
    writeln!(
        text,
        "  triangles    {} of {} violated{}, elastic {}{}",
        distances.triangles.violations,
        distances.triangles.count,
        worst(distances),
        record.body.elastic.triangles.violations,
        worst(&record.body.elastic)
    )?;
    if let Some(clustering) = &record.body.clustering {
        writeln!(text, "  clusters     {}", clustering.clusters)?;
    }
    if let Some(embedding) = &record.body.embedding {
        writeln!(
            text,
            "  map          stress {:.3}, {:.0} % of the variance in classical scaling",
            embedding.stress,
            100.0 * embedding.classical.explained
        )?;
    }
    for (name, matrix) in [("classes", distances), ("elastic", &record.body.elastic)] {
        let Some(agreement) = matrix.agreement else {
            continue;
        };
        let nearest = agreement.nearest_neighbour_accuracy.map_or_else(
            || "unknown".into(),
            |share| format!("{:.0} %", 100.0 * share),
        );
        writeln!(
            text,
            "  {name:<12} nearest neighbour {nearest} right, purity {:.2}, adjusted Rand index {:.2}",
            agreement.purity, agreement.adjusted_rand_index
        )?;
    }
    writeln!(
        text,
        "  results      {}",
        target.join("result.json").display()
    )?;
    let picture = if record.body.embedding.is_some() {
        "embedding.png"
    } else {
        "matrix.png"
    };
    writeln!(text, "  picture      {}", target.join(picture).display())
}

fn worst(matrix: &MatrixRecord) -> String {
    if matrix.triangles.violations == 0 {
        return String::new();
    }
    format!(" (by {:.1} % at most)", 100.0 * matrix.triangles.worst)
}

/// Lists unusable paths.
fn write_marks<const D: usize>(text: &mut String, record: &Record<D>) -> std::fmt::Result {
    let steps = record.parameters.params.steps;
    let unfinished = record.body.paths.iter().filter(|p| p.status != "converged");
    let (unfinished, all) = (unfinished.count(), record.body.paths.len());
    if unfinished > 0 {
        writeln!(
            text,
            "  paths        {unfinished} of {all} end before they converge"
        )?;
    }
    if record.body.marked.is_empty() {
        return Ok(());
    }
    let left = || {
        let marks = record.body.marked.iter();
        marks.filter(|mark| mark.outcome != MarkOutcome::Replaced)
    };
    let counting = by_path(left().filter(|mark| mark.steps == steps));
    let fewer = by_path(left().filter(|mark| mark.steps != steps));
    let used = counting
        .iter()
        .filter(|mark| mark.outcome == MarkOutcome::Used);
    writeln!(
        text,
        "  marked       {} of {all} paths do not reach their end or fold, {} of them used; \
         of fewer steps {}",
        counting.len(),
        used.count(),
        fewer.len(),
    )?;
    let replaced = record.body.marked.len() - left().count();
    if replaced > 0 {
        writeln!(
            text,
            "               {replaced} others were replaced by a second attempt"
        )?;
    }
    for mark in counting.iter().take(NAMED) {
        let [start, end] = [mark.start, mark.end].map(|i| record.input[i].name.as_str());
        let why = if mark.end_reached {
            "it folds".into()
        } else {
            format!("Dice {:.3}", mark.dice_end)
        };
        writeln!(text, "               {start} to {end}: {why}")?;
    }
    if counting.len() > NAMED {
        writeln!(text, "               and others, see result.json")?;
    }
    let filled = record.body.distances.filled.len();
    if filled > 0 {
        writeln!(
            text,
            "               pairs without a path: {filled}, replaced by paths through other shapes; \
             try --retry level-sets, more steps (-K) or a finer --grid"
        )?;
    }
    Ok(())
}

/// The best attempt of each path: those of one path follow each other.
fn by_path<'a>(marks: impl Iterator<Item = &'a MarkRecord>) -> Vec<&'a MarkRecord> {
    let mut best: Vec<&MarkRecord> = Vec::new();
    for mark in marks {
        match best.last_mut() {
            Some(last) if (last.start, last.end) == (mark.start, mark.end) => {
                if mark.dice_end > last.dice_end {
                    *last = mark;
                }
            }
            _ => best.push(mark),
        }
    }
    best
}
