//! `shapespace synthesize`: computes a shape from its scores.

use std::time::Instant;

use fe_grid::VectorField;
use levelset::{Cause, Contour, Doubt, enclosed_volume};
use shape_pca::{
    Compound, Finite, FiniteReport, Mahalanobis, Variation, memory_estimate_of_response,
};

use super::args::SynthesizeConfig;
use super::components::{displaced, label_field, outlines};
use super::displaced::Displaced;
use super::read::{StoredPca, read_pca};
use super::record::{Synthesis, SynthesisRecord};
use crate::doubts::{DoubtRecord, named, of_source};
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::geodesic::draw::{portraits, portraits_of_parts};
use crate::memory::announce;
use crate::output::ResultDir;
use crate::report::unless_cancelled;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;
use crate::warp::{write_labels, write_shape};
use shapespace_picture::{Canvas, INK, Tiles, colour};

/// A shape as a displacement of the average.
pub(crate) struct Outcome<const D: usize> {
    stored: StoredPca<D>,
    displacement: VectorField<f64, D>,
    /// The report of the nonlinear problem.
    report: Option<FiniteReport>,
    /// Whether the user stopped the computation.
    interrupted: bool,
}

impl Command for SynthesizeConfig {
    type Plan<const D: usize> = StoredPca<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the modes");
        read_pca(&self.pca, self.average.as_deref(), session.trust)
    }

    fn compute<const D: usize>(
        &self,
        stored: StoredPca<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let modes = stored.space.fields.len();
        if self.scores.len() > modes {
            return Err(CliError::Option {
                option: "--scores",
                value: format!("with {} numbers", self.scores.len()),
                remedy: format!("there are {modes} modes: give at most one score for each"),
            });
        }
        let variation = stored.space.params.variation;
        if self.nonlinear && variation == Variation::Displacement {
            return Err(CliError::Option {
                option: "--nonlinear",
                value: "with modes of displacements".into(),
                remedy: "these are finite already and have no loads: leave it out".into(),
            });
        }
        let grid = stored.space.object.grid();
        announce(memory(&stored, self.nonlinear), grid, &session.progress)?;
        // `S_k` is about `(1 - u_k)(S)`.
        let mut displacement = stored.space.synthesise(&self.scores)?;
        fe_grid::vector::scale(-1.0, displacement.as_mut_slice());
        let mut report = None;
        if self.nonlinear {
            session
                .progress
                .stage("solving the nonlinear elastic problem");
            let compound = Compound::new(&stored.average.average, &stored.space.params)?;
            let load = compound.apply(displacement.as_slice());
            let mut problem = Finite::new(&stored.average.average, &compound);
            problem.load_steps = self.load_steps;
            let mut fingerprint = Fingerprint::of_results(self, &[&self.pca])?;
            for key in ["pca", "average"] {
                fingerprint.leave_out(key);
            }
            let mut checkpointer = session.checkpointer(fingerprint)?;
            let mut watch = checkpointer.observe(session.observer(&[*grid]));
            let found = problem.respond(&load, &mut watch)?;
            watch.finish();
            session.ended(checkpointer);
            displacement = found.0;
            report = Some(found.1);
        }
        let interrupted = report.is_some() && session.interrupt.asked();
        Ok(Outcome {
            stored,
            displacement,
            report,
            interrupted,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let object = Displaced::new(&outcome.stored.space.object, &outcome.displacement)?;
        let Displaced {
            outline,
            shape,
            level_set,
            ..
        } = &object;
        directory.array("shape.npy", level_set)?;
        directory.array("displacement.npy", &outcome.displacement)?;
        directory.object("shape_mask.npy", level_set, 0.0)?;
        let components = outlines(&outcome.stored.average.components)?;
        let parts = displaced(&components, &outcome.displacement, 1.0);
        let labels: Vec<i64> = components.iter().map(|(label, _)| *label).collect();
        if !labels.is_empty() {
            let field = label_field(level_set, &labels, &parts)?;
            directory.array("shape_labels.npy", &field)?;
        }
        directory.picture("shape.png", || {
            let pictures = if labels.is_empty() {
                portraits(&[(outline, INK), (shape, colour(0))])
            } else {
                let before = displaced(&components, &outcome.displacement, 0.0);
                portraits_of_parts(&[(outline, &before), (shape, &parts)])
            };
            let names = ["average", "shape"].map(String::from);
            let tiles: Vec<(String, Canvas)> = names.into_iter().zip(pictures).collect();
            let sheet = Tiles {
                tiles: &tiles,
                columns: 2,
                side: 360,
            };
            sheet.draw()
        })?;
        let place = &outcome.stored.average.place;
        place.write(directory, "shape", shape)?;
        let (inputs, grid) = (&outcome.stored.average.inputs, *level_set.grid());
        write_shape(directory, "shape", inputs, shape, grid)?;
        for (label, (part, _)) in labels.iter().zip(&parts) {
            place.write(directory, &format!("shape_label_{label}"), part)?;
        }
        if !labels.is_empty() {
            let parts: Vec<_> = parts.into_iter().map(|(part, _)| part).collect();
            write_labels(directory, "shape", inputs, shape, (&labels, &parts), grid)?;
        }
        let record = record(outcome, self, &object, session.start)?;
        record.write(directory)?;
        Ok(summary(&record))
    }
}

/// Estimates the memory of a shape of given scores, in bytes.
fn memory<const D: usize>(stored: &StoredPca<D>, nonlinear: bool) -> u64 {
    let grid = stored.space.object.grid();
    // The displacement, what it is a sum of, and the signed distance.
    let linear = stored.bytes() + (size_of::<f64>() * (2 * D + 1) * grid.n_nodes()) as u64;
    if !nonlinear {
        return linear;
    }
    let shapes = stored.average.average.n_shapes();
    linear.max(memory_estimate_of_response(
        shapes,
        stored.space.fields.len(),
        grid,
    ))
}

fn record<const D: usize>(
    outcome: &Outcome<D>,
    config: &SynthesizeConfig,
    displaced: &Displaced<D>,
    start: Instant,
) -> Result<SynthesisRecord<D>, CliError> {
    let size = |c: &Contour<D>| enclosed_volume(c).map_err(CliError::from);
    let (space, report) = (&outcome.stored.space, &outcome.report);
    let grid = *space.object.grid();
    let share = report.as_ref().map_or(1.0, |report| report.share);
    let found = Synthesis {
        load_share: share,
        iterations: report.as_ref().map_or_else(Vec::new, |report| {
            report.steps.iter().map(|step| step.iterations).collect()
        }),
        mahalanobis: Mahalanobis::new(&config.scores, &space.eigenvalues, space.sample),
        min_det: displaced.min_det,
        size: size(&displaced.shape)?,
        average_size: size(&displaced.outline)?,
        boundaries: outcome.stored.average.place.record(),
    };
    let unsolved = Doubt::check(Cause::NotConverged, f64::from(u8::from(share < 1.0)));
    let doubts: Vec<Doubt> = unsolved
        .into_iter()
        .chain(displaced.doubts()?)
        .chain(of_source(&outcome.stored.doubts))
        .collect();
    let doubts = named(&doubts, [])
        .into_iter()
        .map(DoubtRecord::of_scores)
        .collect();
    let reached = share >= 1.0;
    let ended = if reached {
        "complete"
    } else {
        "load_not_reached"
    };
    let status = unless_cancelled(outcome.interrupted, ended);
    Ok(
        SynthesisRecord::new(status, Some(&grid), config, found, doubts, start)
            .within(outcome.stored.average.world.as_ref()),
    )
}

fn summary<const D: usize>(record: &SynthesisRecord<D>) -> Summary {
    let found = &record.body;
    let title = format!(
        "Shape of scores {:?}: Mahalanobis distance {:.3}, size {:.4} ({:.4} of the average)",
        record.parameters.scores,
        found.mahalanobis.distance,
        found.size,
        found.size / found.average_size
    );
    let mut summary = Summary::new(record, "shape.png", title);
    if found.load_share < 1.0 {
        let share = 100.0 * found.load_share;
        let remedy = "try more --load-steps";
        summary.line("load", format!("only {share:.0} % was reached; {remedy}"));
    }
    if found.min_det <= 0.0 {
        let remedy = "try smaller scores, or --nonlinear";
        summary.line("warning", format!("the displacement folds; {remedy}"));
    }
    summary
}
