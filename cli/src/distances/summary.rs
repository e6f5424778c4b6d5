//! The summary of distances.

use ::geodesic::distances::TriangleReport;

use super::neighbours::Neighbours;
use super::record::{EmbeddingRecord, MarkOutcome, MarkRecord, Record};
use super::skip::Skipped;
use crate::summary::Summary;

/// Maximum number of marked paths that are listed.
const NAMED: usize = 6;
/// Maximum number of shapes that are listed with their nearest neighbour.
const NEAREST: usize = 12;

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>) -> Summary {
    let shapes = match record.body.new_shapes {
        Some(new) => format!("from {new} new to {} stored", record.input.len() - new),
        None => format!("of {}", record.input.len()),
    };
    let title = format!(
        "Distances {shapes} shapes on {} nodes, {} steps, {}: {} pairs, {:.1} s",
        record.grid(),
        record.parameters.params.steps,
        if record.parameters.one_way {
            "one way"
        } else {
            "both ways"
        },
        record.body.paths.len(),
        record.seconds
    );
    let picture = if record.body.embedding.is_some() {
        "embedding.png"
    } else if record.body.neighbours.is_some() {
        "neighbours.png"
    } else {
        "matrix.png"
    };
    let mut summary = Summary::new(record, picture, title);
    describe_paths(&mut summary, record);
    describe_distances(&mut summary, record);
    describe_groups(&mut summary, record);
    if let Some(neighbours) = record.body.neighbours {
        describe_neighbours(&mut summary, neighbours, record);
    }
    summary
}

/// Says how much was skipped, and what that costs.
fn describe_skipped(summary: &mut Summary, skipped: &Skipped, count: Option<usize>) {
    let (computed, pairs) = (skipped.computed, skipped.pairs);
    let share = 100.0 * computed as f64 / pairs.max(1) as f64;
    summary.line(
        "computed",
        format!("{computed} of {pairs} pairs, {share:.0} %; the others are farther by a calibrated bound"),
    );
    let ([found, all], [first, firsts]) = (skipped.kept, skipped.nearest_kept);
    let (shapes, count) = (skipped.sample.len(), count.unwrap_or(1));
    if all == 0 {
        let words = "unknown: the sample is too small, see --landmarks";
        return summary.line("kept", words);
    }
    summary.line(
        "kept",
        format!(
            "{found} of the {all} that are among the {count} nearest of {shapes} shapes, all of whose \
             paths were computed, and {first} of their {firsts} nearest"
        ),
    );
}

/// Lists the first shapes with the nearest of their neighbours.
fn describe_neighbours<const D: usize>(
    summary: &mut Summary,
    neighbours: &Neighbours,
    record: &Record<'_, D>,
) {
    let name = |shape: usize| record.input[shape].name.as_str();
    if record.body.new_shapes.is_some() {
        for of in neighbours.of.iter().take(NEAREST) {
            let nearest = of.nearest.first().map_or_else(
                || "NO path to any stored shape".into(),
                |n| format!("{} is nearest, {:.4e} away", name(n.object), n.distance),
            );
            let vote = of.vote.as_ref().map_or_else(String::new, |vote| {
                format!("; most of {} are {vote}", of.nearest.len())
            });
            summary.line(name(of.shape), format!("{nearest}{vote}"));
        }
        if neighbours.of.len() > NEAREST {
            summary.line("", "and others, see neighbours.csv");
        }
    }
    if let Some(found) = &neighbours.agreement {
        let [nearest, vote] = [found.nearest, found.vote].map(|share| 100.0 * share);
        summary.line(
            "neighbours",
            format!(
                "of {} shapes of known class the nearest is right for {nearest:.0} %, most of {} \
                 for {vote:.0} %",
                found.shapes, neighbours.count
            ),
        );
    }
}

fn describe_distances<const D: usize>(summary: &mut Summary, record: &Record<'_, D>) {
    let (distances, elastic) = (record.body.distances, record.body.elastic);
    if let Some(shard) = &record.body.shard {
        summary.line(
            "part",
            format!("{shard}; --merge with the directories of all parts evaluates the distances"),
        );
        return;
    }
    let range = distances.range();
    let missing = record.status == "incomplete";
    let sparse = record.parameters.skip_far.is_some() || record.parameters.landmarks.is_some();
    let range = match (range, record.body.new_shapes) {
        (Some([low, high]), _) => format!("from {low:.4e} to {high:.4e}"),
        (None, _) if sparse && missing => "NOT between all shapes that are asked for".into(),
        (None, _) if sparse => "between all shapes that are asked for".into(),
        (None, None) => "NOT between all shapes: no clusters and no map".into(),
        (None, Some(_)) if missing => "NOT from all new to all stored shapes".into(),
        (None, Some(_)) => "from all new to all stored shapes".into(),
    };
    summary.line("distances", range);
    if let Some(unit) = record.body.length_unit {
        summary.line("", format!("in units of the inputs times {unit:.4e}"));
    }
    if let Some(skipped) = record.body.skipped {
        describe_skipped(summary, skipped, record.parameters.listed_neighbours());
    }
    if let Some(asymmetry) = &distances.asymmetry {
        let [i, j] = asymmetry.worst.map(|i| record.input[i].name.as_str());
        let [mean, largest] = [asymmetry.mean, asymmetry.largest].map(|share| 100.0 * share);
        summary.line(
            "asymmetry",
            format!("{mean:.1} % in the mean, {largest:.1} % at most ({i} and {j})"),
        );
    }
    let [own, other] = [distances, elastic].map(|distances| distances.triangles);
    if own.count == 0 {
        return;
    }
    summary.line(
        "triangles",
        format!(
            "{} of {} violated{}, elastic {}{}",
            own.violations,
            own.count,
            worst(&own),
            other.violations,
            worst(&other)
        ),
    );
}

fn describe_groups<const D: usize>(summary: &mut Summary, record: &Record<'_, D>) {
    let found = &record.body;
    if let Some(clustering) = &found.clustering {
        summary.line("clusters", clustering.clusters);
    }
    if let Some(embedding) = &found.embedding {
        let (stress, share) = embedding.figures();
        let of = match embedding {
            EmbeddingRecord::Whole(_) => "in classical scaling".into(),
            EmbeddingRecord::Landmarks(map) => format!("of {} landmarks", map.landmarks.len()),
        };
        let share = 100.0 * share;
        summary.line(
            "map",
            format!("stress {stress:.3}, {share:.0} % of the variance {of}"),
        );
    }
    for (name, distances) in [("classes", found.distances), ("elastic", found.elastic)] {
        let Some(agreement) = distances.completed.as_ref().and_then(|c| c.agreement) else {
            continue;
        };
        let (purity, index) = (agreement.purity, agreement.adjusted_rand_index);
        let agreement = match agreement.nearest_neighbour_accuracy {
            Some(share) => format!(
                "nearest neighbour {:.0} % right, purity {purity:.2}, adjusted Rand index \
                 {index:.2}",
                100.0 * share
            ),
            // All agree with classes of one shape each.
            None => "none has two shapes, so that there is nothing to agree with".into(),
        };
        summary.line(name, agreement);
    }
}

fn worst(triangles: &TriangleReport) -> String {
    if triangles.violations == 0 {
        return String::new();
    }
    format!(" (by {:.1} % at most)", 100.0 * triangles.worst)
}

/// Lists unusable paths.
fn describe_paths<const D: usize>(summary: &mut Summary, record: &Record<'_, D>) {
    let (found, steps) = (&record.body, record.parameters.params.steps);
    let unfinished = found.paths.iter().filter(|p| p.status != "converged");
    let (unfinished, all) = (unfinished.count(), found.paths.len());
    if unfinished > 0 {
        summary.line("paths", format!("{unfinished} of {all} have not converged"));
    }
    let refined = found.paths.iter().filter(|p| p.refinements > 0).count();
    if refined > 0 {
        let words = format!("{refined} of {all} paths, of pairs that did not arrive (--refine)");
        summary.line("finer grids", words);
    }
    let detours = found.detours;
    if detours.computed > 0 {
        let words = format!(
            "{} of {} pairs had a shorter path from the way through a third shape (--detours)",
            detours.kept, detours.computed
        );
        summary.line("detours", words);
    }
    if found.marked.is_empty() {
        return;
    }
    let remaining = || {
        let marks = found.marked.iter();
        marks.filter(|mark| mark.outcome != MarkOutcome::Replaced)
    };
    let counting = by_path(remaining().filter(|mark| mark.path.steps == steps));
    let fewer = by_path(remaining().filter(|mark| mark.path.steps != steps)).len();
    let is_used = |mark: &&&MarkRecord<'_>| mark.outcome == MarkOutcome::Used;
    let (marked, used) = (counting.len(), counting.iter().filter(is_used).count());
    summary.line(
        "marked",
        format!(
            "{marked} of {all} paths do not arrive or fold, {used} of them used; of fewer \
             steps {fewer}"
        ),
    );
    let replaced = found.marked.len() - remaining().count();
    if replaced > 0 {
        summary.line(
            "",
            format!("{replaced} others were replaced by a second attempt"),
        );
    }
    list_marks(summary, record, &counting);
    let completed = found.distances.completed.as_ref();
    let completed = completed.map_or(0, |completed| completed.filled.len());
    if completed > 0 {
        summary.line(
            "",
            format!(
                "pairs without a path: {completed}, replaced by the shortest way through other \
                 shapes; try --retry level-sets, more steps (-K) or a finer --grid"
            ),
        );
    }
}

/// Lists the first marked paths.
fn list_marks<const D: usize>(
    summary: &mut Summary,
    record: &Record<'_, D>,
    marks: &[&MarkRecord<'_>],
) {
    for mark in marks.iter().take(NAMED) {
        let [start, end] = [mark.start, mark.end].map(|i| record.input[i].name.as_str());
        let why = match (mark.path.end_reached, mark.path.arrival) {
            (true, _) => "it folds".into(),
            (false, Some(found)) => format!(
                "Dice {:.3}, 95 % of the boundaries within {:.2} spacings",
                mark.path.dice_end, found.percentile_95
            ),
            (false, None) => format!("Dice {:.3}", mark.path.dice_end),
        };
        summary.line("", format!("{start} to {end}: {why}"));
    }
    if marks.len() > NAMED {
        summary.line("", "and others, see result.json");
    }
}

/// The best attempt of each path: those of one path are adjacent.
fn by_path<'a>(marks: impl Iterator<Item = &'a MarkRecord<'a>>) -> Vec<&'a MarkRecord<'a>> {
    let mut best: Vec<&MarkRecord<'_>> = Vec::new();
    for mark in marks {
        match best.last_mut() {
            Some(last) if (last.start, last.end) == (mark.start, mark.end) => {
                if mark.path.dice_end > last.path.dice_end {
                    *last = mark;
                }
            }
            _ => best.push(mark),
        }
    }
    best
}
