//! `shapespace average --sweep N`: averages of two or three shapes for all weights on a line or in
//! a triangle, in one picture.

use std::io::Write as _;
use std::time::Instant;

use fe_grid::{Certificate, ScalarField};
use levelset::{BoxEdge, Moments, contour};
use serde::Serialize;
use shape_average::{AverageParams, AverageResult, average_of_visible};

use super::args::{AverageConfig, AverageRun};
use super::plan::AveragePlan;
use super::views;
use crate::error::{CliError, Exit};
use crate::output::npy::{Precision, write_field, write_mask};
use crate::output::{ResultDir, numbered};
use crate::picture::{INK, Slice, TileRows, WHITE, colour, mix};
use crate::progress::Progress;
use crate::report::{Record, first_failure, overall};
use crate::shapes::{InputRecord, SizeRecord, common_scale, prepare};
use crate::watch::{Interrupt, ProgressObserver, level_nodes};

/// Everything in `result.json`.
type SweepRecord<const D: usize> = Record<AverageConfig, Averages, D>;

/// What was found.
#[derive(Clone, Debug, Serialize)]
struct Averages {
    averages: Vec<OneRecord>,
}

/// One average of the sweep.
#[derive(Clone, Debug, Serialize)]
struct OneRecord {
    weights: Vec<f64>,
    status: String,
    energy: f64,
    elastic: Vec<f64>,
    dice: Vec<f64>,
    certificate: Certificate,
    average: SizeRecord,
    seconds: f64,
}

/// Weights on a line or in a triangle, `side` per side, row by row: integers divided by `side - 1`,
/// so that the weight of a single shape is exactly one.
pub(crate) fn weights(shapes: usize, side: usize) -> Vec<Vec<f64>> {
    let parts = side - 1;
    let share = |k: usize| k as f64 / parts as f64;
    if shapes == 2 {
        return (0..side)
            .map(|k| vec![share(parts - k), share(k)])
            .collect();
    }
    let rows = (0..side)
        .flat_map(|row| (0..=row).map(move |k| vec![share(parts - row), share(row - k), share(k)]));
    rows.collect()
}

/// Computes and writes the averages for all weights.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub(super) fn run_sweep<const D: usize>(
    plan: AveragePlan<D>,
    run: &AverageRun,
    side: usize,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let output = run.common.output.as_path();
    ResultDir::create(output).map(drop)?;
    let (grid, config) = (plan.placed.grid, plan.config);
    let (mut inputs, mut distances) = prepare(plan.placed, &plan.views, progress)?;
    let seen = views::apply(&plan.views, &mut inputs, &mut distances, grid)?;
    let mut found: Vec<(Vec<f64>, AverageResult<D>)> = Vec::new();
    for weights in weights(inputs.len(), side) {
        let params = AverageParams {
            weights: Some(weights.clone()),
            ..config.params.clone()
        };
        let words: Vec<String> = weights.iter().map(|w| format!("{w:.3}")).collect();
        progress.note(format!("weights {}:", words.join(", ")));
        let levels = level_nodes(&grid.hierarchy(params.coarsest_nodes));
        let mut watch = ProgressObserver::new(progress, interrupt, levels);
        let result = average_of_visible(&distances, &seen, &params, &mut watch)?;
        watch.finish();
        found.push((weights, result));
        if interrupt.asked() {
            break;
        }
    }
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(output)?;
    let scale = common_scale(&inputs);
    let mut records = Vec::new();
    for (i, (weights, result)) in found.iter().enumerate() {
        write(&directory, i, result)?;
        records.push(one_record(weights, result, scale));
    }
    picture(&found, &grid, side).write_png(&directory.file("sweep.png"))?;
    let status = first_failure(records.iter().map(|record| &*record.status)).to_owned();
    let found = Averages { averages: records };
    let record = SweepRecord::new(status, &grid.nodes_per_axis(), &config, found, start)
        .of(inputs.iter().map(InputRecord::new).collect());
    record.write(directory.path())?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}

fn write<const D: usize>(
    directory: &ResultDir,
    i: usize,
    result: &AverageResult<D>,
) -> Result<(), CliError> {
    let path = directory.file(numbered("average", i, "npy"));
    write_field(&path, &result.average, Precision::Double)?;
    let mask = result.average_mask.as_slice().iter().map(|&x| x > 0.5);
    let size = result.average_mask.grid().nodes_per_axis();
    let path = directory.file(numbered("average_mask", i, "npy"));
    Ok(write_mask(&path, &mask.collect::<Vec<_>>(), &size)?)
}

fn one_record<const D: usize>(
    weights: &[f64],
    result: &AverageResult<D>,
    scale: Option<f64>,
) -> OneRecord {
    let outline = contour(&result.average_indicator, 0.5, BoxEdge::Closed);
    let volume = outline.and_then(|outline| Moments::of_contour(&outline));
    OneRecord {
        weights: weights.to_vec(),
        status: overall(result.status, result.levels.last().map(|l| l.status)),
        energy: result.energy.total,
        elastic: result.energy.elastic.clone(),
        dice: result.dice.clone(),
        certificate: result.certificate,
        average: volume.map_or_else(
            |_| SizeRecord::default(),
            |moments| SizeRecord::new::<D>(moments.volume, scale),
        ),
        seconds: result.seconds,
    }
}

/// The averages in colours interpolated between those of the shapes; two shapes in rows, three in a
/// triangle with the shapes at its corners.
fn picture<const D: usize>(
    found: &[(Vec<f64>, AverageResult<D>)],
    grid: &fe_grid::Grid<D>,
    side: usize,
) -> crate::picture::Canvas {
    let columns = side.min(9);
    let slice = Slice::middle(grid, TileRows::width(columns));
    let mut rows = TileRows::new(columns);
    let mut in_row = 0;
    let mut length = 1;
    for (weights, result) in found {
        let hue = |k: usize| -> f32 {
            let colours = weights.iter().enumerate();
            colours.map(|(i, w)| *w as f32 * colour(i)[k]).sum()
        };
        let fill = mix(WHITE, [0, 1, 2].map(hue), 0.55);
        let indicator: &ScalarField<f64, D> = &result.average_indicator;
        let mut tile = slice.painted(|x| mix(WHITE, fill, indicator.sample(x)[0] as f32));
        slice.level(&mut tile, indicator, 0.5, 1.4, INK);
        let words: Vec<String> = weights.iter().map(|w| format!("{w:.2}")).collect();
        rows.push(words.join(" "), tile);
        in_row += 1;
        if weights.len() == 3 && in_row == length {
            rows.end_row();
            (in_row, length) = (0, length + 1);
        }
    }
    rows.draw()
}

fn print<const D: usize>(record: &SweepRecord<D>, target: &std::path::Path) {
    let least = record
        .body
        .averages
        .iter()
        .flat_map(|a| a.dice.iter().copied());
    let text = format!(
        "{} averages of {} shapes: {}, {:.1} s\n  overlap      Dice {:.4} at least\n  \
         results      {}\n  picture      {}\n",
        record.body.averages.len(),
        record.input.len(),
        record.status.replace('_', " "),
        record.seconds,
        least.fold(1.0, f64::min),
        target.join("result.json").display(),
        target.join("sweep.png").display()
    );
    // A closed standard output is not an error.
    let _ = std::io::stdout().write_all(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_and_begin_and_end_at_the_shapes() {
        for (shapes, side, count) in [(2, 5, 5), (3, 4, 10)] {
            let all = weights(shapes, side);
            assert_eq!(all.len(), count);
            for weights in &all {
                assert_eq!(weights.len(), shapes);
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            }
            for i in 0..shapes {
                assert_eq!(all.iter().filter(|w| w[i] == 1.0).count(), 1);
            }
        }
    }
}
