//! The contents of `result.json` of what was carried.

use std::path::{Path, PathBuf};
use std::time::Instant;

use levelset::{Cause, Doubt};
use serde::{Deserialize, Serialize};

use super::command::{Interpolation, WarpArgs};
use super::draw::PICTURE;
use super::points::Moved;
use crate::doubts::{DoubtRecord, named, of_source};
use crate::numbers::plural;
use crate::report;
use crate::results::read_contents;
use crate::shapes::stem;
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<Parameters<'a>, Body<'a>, D>;

/// What was asked for.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Parameters<'a> {
    result: &'a Path,
    files: &'a [PathBuf],
    #[serde(skip_serializing_if = "Option::is_none")]
    shape: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to_shape: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    from_time: Option<f64>,
    #[serde(skip_serializing_if = "<[f64]>::is_empty")]
    scores: &'a [f64],
    inverse: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    interpolation: Option<Interpolation>,
    refine: u32,
}

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Body<'a> {
    carried: Vec<Carried<'a>>,
}

/// A file that was carried.
#[derive(Clone, Debug, Serialize)]
struct Carried<'a> {
    file: &'a Path,
    /// Its name in the results.
    result: &'a Path,
    what: &'static str,
    /// Samples of an image, or points.
    count: usize,
    /// Those of them for which the deformation has no exact inverse.
    inexact: usize,
    /// Points outside of the box of the grid, where deformations are those of the nearest point of its faces, and
    /// samples of objects of label images, which are left out there.
    outside: usize,
}

/// The doubts about the result that files were carried by, about deformations that are not a part of it, and about
/// objects that were cut off.
fn doubts(
    result: &Path,
    files: &[PathBuf],
    carried: &[Moved],
    deformations: &[Doubt],
) -> Vec<DoubtRecord> {
    #[derive(Deserialize)]
    struct Doubted {
        #[serde(default)]
        doubts: Vec<DoubtRecord>,
    }
    let source = read_contents::<Doubted>(result);
    let source = source.map_or_else(|_| Vec::new(), |source| source.doubts);
    let lost = carried
        .iter()
        .enumerate()
        .filter_map(|(i, moved)| Some(Doubt::check(Cause::OutsideBox, moved.lost)?.about(i)));
    let doubts: Vec<Doubt> = of_source(&source)
        .into_iter()
        .chain(deformations.iter().copied())
        .chain(lost)
        .collect();
    let names: Vec<String> = files.iter().map(|file| stem(file)).collect();
    named(&doubts, names.iter().map(String::as_str))
}

/// The record of files that were carried. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    args: &'a WarpArgs,
    files: &'a [PathBuf],
    (carried, deformations): (&'a [Moved], &[Doubt]),
    start: Instant,
) -> Record<'a, D> {
    let way = &args.way;
    let parameters = Parameters {
        result: &args.result,
        files,
        shape: way.shape,
        to_shape: way.to_shape,
        time: way.time,
        from_time: way.from_time,
        scores: &way.scores,
        inverse: args.inverse,
        interpolation: args.interpolation,
        refine: args.refine,
    };
    let listed = files.iter().zip(carried).map(|(file, moved)| Carried {
        file,
        result: &moved.name,
        what: moved.what,
        count: moved.count,
        inexact: moved.inexact,
        outside: moved.outside,
    });
    let body = Body {
        carried: listed.collect(),
    };
    let mut doubts = doubts(&args.result, files, carried, deformations);
    if !way.scores.is_empty() {
        doubts = doubts.into_iter().map(DoubtRecord::of_scores).collect();
    }
    Record::without_grid("warp", "complete", parameters, body, doubts, start)
}

/// The summary, with a line for every file.
pub(super) fn summary<const D: usize>(
    record: &Record<'_, D>,
    args: &WarpArgs,
    carried: &[Moved],
) -> Summary {
    let title = format!(
        "{} file{} carried, {:.1} s",
        carried.len(),
        plural(carried.len()),
        record.seconds
    );
    let mut summary = Summary::new(record, PICTURE, title);
    for moved in carried {
        let (name, rest) = moved.line(&args.run.output);
        summary.line(moved.what, format!("{name}{rest}"));
    }
    summary
}
