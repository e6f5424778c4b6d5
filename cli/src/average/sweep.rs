//! `shapespace average --sweep N`: averages of two or three shapes for all weights on a line or in
//! a triangle, in one picture.

use fe_grid::{Certificate, Distribution, Grid, ScalarField};
use levelset::{BoxEdge, Cause, Doubt, contour, enclosed_volume};
use serde::Serialize;
use shape_average::{AverageParams, AverageResult, average_of_visible, memory_estimate};

use super::args::AverageConfig;
use super::plan::{AveragePlan, fingerprint, plan_average};
use super::views;
use crate::doubts::named;
use crate::error::CliError;
use crate::memory::announce;
use crate::output::{ResultDir, numbered};
use crate::report::{CANCELLED, Record, first_failure, overall, unless_cancelled};
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{Input, SizeRecord, common_scale, doubts_of, records_of, settle};
use crate::summary::Summary;
use shapespace_picture::{Canvas, INK, Slice, TileRows, WHITE, colour, mix};

/// Everything in `result.json`.
type SweepRecord<const D: usize> = Record<AverageConfig, Averages, D>;

/// The result.
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

/// Averages of two or three shapes for all weights, `side` per side.
pub(crate) struct Sweep {
    pub config: AverageConfig,
    pub side: usize,
}

/// The averages, each with its weights.
pub(crate) struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    config: AverageConfig,
    grid: Grid<D>,
    averages: Vec<(Vec<f64>, AverageResult<D>)>,
}

impl Command for Sweep {
    type Plan<const D: usize> = AveragePlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        plan_average(self.config.clone(), &session.sources, &session.progress)
    }

    fn compute<const D: usize>(
        &self,
        plan: AveragePlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let config = plan.config;
        let fingerprint = fingerprint(&config, &plan.placed.images, None, &plan.views);
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let settled = settle(
            plan.placed,
            &plan.views,
            None,
            &session.progress,
            &session.processes,
        )?;
        let grid = settled.grid;
        let (mut inputs, mut distances) = settled.measure(&session.progress, &session.processes)?;
        // The averages follow each other, and all results are kept.
        let n = inputs.len();
        let alone = Distribution::alone(n);
        let partly = plan.views.iter().any(Option::is_some);
        let estimate = memory_estimate(&config.params, &alone, 1, partly, &grid);
        let kept = weights(n, self.side).len() * (n * D + 1) * grid.n_nodes() * size_of::<f64>();
        announce(estimate.memory + kept as u64, &grid, &session.progress)?;
        let visibility = views::apply(&plan.views, &mut inputs, &mut distances, grid)?;
        let mut averages = Vec::new();
        for weights in weights(inputs.len(), self.side) {
            let params = AverageParams {
                weights: Some(weights.clone()),
                ..config.params.clone()
            };
            let words: Vec<String> = weights.iter().map(|w| format!("{w:.3}")).collect();
            session
                .progress
                .note(format!("weights {}:", words.join(", ")));
            let grids = grid.hierarchy(params.coarsest_nodes);
            let mut watch = checkpointer.observe(session.observer(&grids));
            let result = average_of_visible(&distances, &visibility, &params, &mut watch)?;
            watch.finish();
            averages.push((weights, result));
            if session.interrupt.asked() {
                break;
            }
        }
        session.ended(checkpointer);
        Ok(Outcome {
            inputs,
            config,
            grid,
            averages,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let (inputs, found) = (&outcome.inputs, &outcome.averages);
        let scale = common_scale(inputs.iter().map(Input::scale));
        let mut averages = Vec::new();
        for (i, (weights, result)) in found.iter().enumerate() {
            directory.array(numbered("average", i, "npy"), &result.average)?;
            let mask = numbered("average_mask", i, "npy");
            directory.object(mask, &result.average_mask, 0.5)?;
            averages.push(one_record(weights, result, scale)?);
        }
        directory.picture("sweep.png", || picture(found, &outcome.grid, self.side))?;
        let missing = weights(inputs.len(), self.side).len() - averages.len();
        let stopped = missing > 0 || averages.iter().any(|record| record.status == CANCELLED);
        let status = first_failure(averages.iter().map(|record| &*record.status));
        let status = unless_cancelled(stopped, status);
        let results = outcome.averages.iter();
        let mut doubts: Vec<Doubt> = results
            .flat_map(|(_, result)| result.doubts(&outcome.config.params))
            .chain(doubts_of(inputs))
            .collect();
        doubts.extend(Doubt::check(Cause::NotConverged, missing as f64));
        let doubts = named(&doubts, inputs.iter().map(|input| &*input.name));
        let found = Averages { averages };
        let record = SweepRecord::new(
            status,
            Some(&outcome.grid),
            &outcome.config,
            found,
            doubts,
            session.start,
        )
        .of(records_of(inputs));
        record.write(directory)?;
        Ok(summary(&record))
    }
}

fn one_record<const D: usize>(
    weights: &[f64],
    result: &AverageResult<D>,
    scale: Option<f64>,
) -> Result<OneRecord, CliError> {
    let outline = contour(&result.average_indicator, 0.5, BoxEdge::Closed);
    let volume = outline.and_then(|outline| enclosed_volume(&outline));
    let volume = volume?;
    Ok(OneRecord {
        weights: weights.to_vec(),
        status: overall(result.status, result.levels.last().map(|l| l.status)),
        energy: result.energy.total,
        elastic: result.energy.elastic.clone(),
        dice: result.dice.clone(),
        certificate: result.certificate,
        average: SizeRecord::new::<D>(volume, scale),
        seconds: result.seconds,
    })
}

/// The averages in colours interpolated between those of the shapes; two shapes in rows, three in a
/// triangle with the shapes at its corners.
fn picture<const D: usize>(
    found: &[(Vec<f64>, AverageResult<D>)],
    grid: &Grid<D>,
    side: usize,
) -> Canvas {
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

fn summary<const D: usize>(record: &SweepRecord<D>) -> Summary {
    let averages = &record.body.averages;
    let title = format!(
        "{} averages of {} shapes: {}, {:.1} s",
        averages.len(),
        record.input.len(),
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, "sweep.png", title);
    let overlaps = averages.iter().flat_map(|average| &average.dice);
    let least = overlaps.copied().fold(1.0, f64::min);
    summary.line("overlap", format!("Dice {least:.4} at least"));
    summary
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
