//! `shapespace extend`: continues a geodesic beyond its end.

use std::time::Instant;

use ::geodesic::calculus::{
    CalculusParams, Extension, SolveStatus, continued, exponential, memory_estimate,
};
use fe_grid::Field;

use super::args::ExtendConfig;
use super::read::{StoredGeodesic, read};
use super::record::{Extended, ExtensionRecord};
use crate::doubts::{named, of_source};
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::{STEM, write_path};
use crate::memory::announce;
use crate::output::ResultDir;
use crate::report::word;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{BoundaryRecord, WorldFrame};
use crate::summary::Summary;

/// A geodesic and its continuation.
pub(crate) struct Outcome<const D: usize> {
    geodesic: StoredGeodesic<D>,
    config: ExtendConfig,
    /// Requested steps beyond the end.
    steps: usize,
    extension: Extension<D>,
}

impl Command for ExtendConfig {
    type Plan<const D: usize> = StoredGeodesic<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the geodesic");
        read(&self.geodesic, session.trust)
    }

    fn compute<const D: usize>(
        &self,
        geodesic: StoredGeodesic<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let mut config = self.clone();
        let steps = *config.steps.get_or_insert(geodesic.motions.len());
        let params = geodesic.calculus_params(config.solver);
        let needed = memory_of_extension(&geodesic, &params, steps);
        announce(needed, geodesic.grid(), &session.progress)?;
        let mut fingerprint = Fingerprint::of_results(self, &[&self.geodesic])?;
        fingerprint.leave_out("geodesic");
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let mut watch = checkpointer.observe(session.equation_observer(geodesic.grid()));
        let extension = match &geodesic.before_end {
            None => {
                let first = &geodesic.level_sets[0];
                exponential(first, &geodesic.motions, steps, &params, &mut watch)?
            }
            Some(before) => {
                let end = &geodesic.level_sets[geodesic.motions.len()];
                let identity = Field::zeros(*geodesic.grid());
                continued(end, [before, &identity], steps, &params, &mut watch)?
            }
        };
        watch.finish();
        session.ended(checkpointer);
        if extension.step_energies.is_empty() && extension.status() != SolveStatus::Cancelled {
            return Err(CliError::Computation {
                message: "the geodesic cannot be continued: no step from its end was found".into(),
                remedy: "compute the geodesic with more steps (-K) or on a finer --grid, and see \
                         that its end shape does not touch the border of the box"
                    .into(),
            });
        }
        Ok(Outcome {
            geodesic,
            config,
            steps,
            extension,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let path = Path::of(parts(outcome)?, &outcome.geodesic.params.law)?;
        let coordinates = write_path(directory, STEM, &outcome.geodesic.inputs, &path)?;
        let record = record(outcome, path, coordinates, session.start);
        record.write(directory)?;
        Ok(summary(&record))
    }
}

/// Estimates the memory of a continuation, in bytes: with the geodesic, while it is computed, and while both are
/// written, one after the other.
fn memory_of_extension<const D: usize>(
    geodesic: &StoredGeodesic<D>,
    params: &CalculusParams,
    steps: usize,
) -> u64 {
    let given = geodesic.motions.len();
    let of_steps = memory_estimate(params, given, steps, geodesic.grid());
    let both = given + steps;
    // The motions, and the displacements as they are and together.
    let displacements = 2 * both + steps + 2 * given + usize::from(geodesic.before_end.is_some());
    let of_writing = geodesic.bytes(D * displacements + 2 * (both + 1));
    geodesic.shapes_bytes() + of_steps.max(of_writing)
}

/// The geodesic followed by its continuation.
fn parts<const D: usize>(outcome: &Outcome<D>) -> Result<Parts<D>, CliError> {
    let (geodesic, extension) = (&outcome.geodesic, &outcome.extension);
    let steps = geodesic.motions.len();
    let (shapes, displacements) = extension.shapes()?;
    let name = |k| match k {
        0 => geodesic.names[0].clone(),
        _ if k < steps => format!("{k} of {steps}"),
        _ if k == steps => geodesic.names[1].clone(),
        _ => format!("+{}", k - steps),
    };
    Ok(Parts {
        level_sets: [geodesic.level_sets.clone(), shapes].concat(),
        displacements: [geodesic.displacements.clone(), displacements].concat(),
        energies: [&*geodesic.energies, &extension.step_energies].concat(),
        steps,
        names: (0..=steps + extension.step_energies.len())
            .map(name)
            .collect(),
        target: None,
    })
}

fn record<const D: usize>(
    outcome: &Outcome<D>,
    path: Path<D>,
    coordinates: BoundaryRecord,
    start: Instant,
) -> ExtensionRecord<'_, D> {
    let extension = &outcome.extension;
    let extended = Extended {
        given_steps: outcome.geodesic.motions.len(),
        steps: outcome.steps,
        steps_found: extension.step_energies.len(),
        start_shapes: extension.pieces.len(),
        length: path.length(),
        step_energies: path.parts.energies,
        volumes: path.sizes,
        certificate: extension.certificate,
        equations: &extension.reports,
        coordinates,
    };
    let grid = outcome.geodesic.grid();
    let status = word(&extension.status());
    let mut doubts = extension.doubts(outcome.steps, outcome.geodesic.energies.last().copied());
    doubts.extend(of_source(&outcome.geodesic.doubts));
    let doubts = named(&doubts, []);
    let world = WorldFrame::of_inputs(&outcome.geodesic.inputs);
    ExtensionRecord::new(status, Some(grid), &outcome.config, extended, doubts, start)
        .within(world.as_ref())
}

fn summary<const D: usize>(record: &ExtensionRecord<'_, D>) -> Summary {
    let found = &record.body;
    let title = format!(
        "Geodesic of {} steps, continued by {} of {}: {}, {:.1} s",
        found.given_steps,
        found.steps_found,
        found.steps,
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, "geodesic.png", title);
    summary.certificate(&found.certificate);
    summary
}
