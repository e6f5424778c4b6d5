//! `shapespace transport`: parallel transport of a variation along a geodesic.

use std::path::Path as FilePath;
use std::time::Instant;

use ::geodesic::calculus::{
    Extension, Ladder, SolveReport, SolveStatus, at_end, logarithm, memory_estimate, shoot,
    transport,
};
use ::geodesic::{GeodesicError, GeodesicParams, memory_estimate as memory_of_path};
use fe_grid::{Field, ScalarField};
use levelset::topology::Topology;
use levelset::{
    BoxEdge, Cause, Contour, ContourDistance, Doubt, LevelsetError, contour, enclosed_volume,
    hausdorff, share_outside,
};

use super::args::TransportConfig;
use super::read::{StoredGeodesic, read};
use super::record::{TransportRecord, Transported};
use crate::checkpoint::Checkpointer;
use crate::doubts::{named, of_source};
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::geodesic::draw::portraits;
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::{STEM, write_path};
use crate::memory::announce;
use crate::output::ResultDir;
use crate::report::word;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{
    BoundaryRecord, WorldFrame, inspect_mask, inspect_resolution, labels, place_like,
};
use crate::summary::Summary;
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::{Image, ReadOptions};
use shapespace_picture::{analogy, colour};

/// The result of a computation.
pub(crate) struct Outcome<const D: usize> {
    geodesic: StoredGeodesic<D>,
    variation: Variation<D>,
    counterpart: Counterpart<D>,
}

/// The variation relative to the first shape.
struct Variation<const D: usize> {
    /// Its boundary.
    outline: Contour<D>,
    /// Parts, holes and tunnels that it or the first shape has and the other one has not.
    other_topology: usize,
    /// The displacement in unit time that leads to it.
    velocity: Field<f64, D, D>,
    /// Length of the geodesic to it.
    length: f64,
    /// Its overlap with the end shape of that geodesic.
    dice: f64,
    /// Mean distance of their boundaries, in spacings.
    distance: f64,
    /// Doubts about its mask.
    doubts: Vec<Doubt>,
}

/// The last shape and its counterpart of the variation.
struct Counterpart<const D: usize> {
    end: ScalarField<f64, D>,
    /// The variation on the domain of the last shape.
    velocity: Field<f64, D, D>,
    shot: Extension<D>,
    /// For the rungs, then for the steps.
    reports: Vec<SolveReport>,
}

impl Command for TransportConfig {
    type Plan<const D: usize> = (StoredGeodesic<D>, Image<D>);
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the geodesic");
        let geodesic = read(&self.geodesic, session.trust)?;
        let stated = ReadOptions {
            label: self.label,
            invert: self.invert,
        };
        let known = match &geodesic {
            Dim::D2(geodesic) => geodesic.read_options,
            Dim::D3(geodesic) => geodesic.read_options,
        };
        let options = stated.or(known);
        let image = session.sources.read_image(&self.variation, &options)?;
        let reason = match geodesic.dimension() {
            2 => "is a volume; the shapes of the geodesic are 2D",
            _ => "is a 2D image; the shapes of the geodesic are 3D",
        };
        Ok(per_dimension!(geodesic, geodesic => {
            let image = image.of_type();
            (geodesic, image.ok_or_else(|| self.unfit(reason.into()))?)
        }))
    }

    fn compute<const D: usize>(
        &self,
        (geodesic, image): (StoredGeodesic<D>, Image<D>),
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let needed = self.memory(&geodesic);
        announce(needed, geodesic.grid(), &session.progress)?;
        let mut fingerprint =
            Fingerprint::of_results(self, &[&self.geodesic])?.and(std::iter::once(hash(&image)));
        fingerprint.leave_out("geodesic");
        fingerprint.leave_out("variation");
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let variation = self.variation(&geodesic, &image, session, &mut checkpointer)?;
        let velocity = &variation.velocity;
        let counterpart = self
            .counterpart(&geodesic, velocity, session, &mut checkpointer)
            .map_err(|error| self.explained(error, variation.other_topology))?;
        session.ended(checkpointer);
        Ok(Outcome {
            geodesic,
            variation,
            counterpart,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let path = self.path(outcome)?;
        let coordinates = write_path(directory, STEM, &outcome.geodesic.inputs, &path)?;
        let variation = &outcome.variation;
        let end = &outcome.counterpart.velocity;
        for (place, velocity) in [("start", &variation.velocity), ("end", end)] {
            directory.array(format!("variation_{place}.npy"), velocity)?;
        }
        let level_set = &outcome.geodesic.level_sets[0];
        let first = contour(level_set, 0.0, BoxEdge::Closed)?;
        let [last, counterpart] = [0, path.steps()].map(|k| &path.contours[k]);
        let ends = [&first, last, &variation.outline, counterpart];
        let [first_name, last_name] = outcome.geodesic.names.clone();
        let counterpart_name = path.parts.names[path.steps()].clone();
        let names = [first_name, last_name, self.name(), counterpart_name];
        let tiles: Vec<_> = ends.into_iter().zip([0, 0, 1, 1].map(colour)).collect();
        directory.picture("analogy.png", || analogy(&names, &portraits(&tiles)))?;
        let record = record(self, outcome, &path, (&first, coordinates), session.start)?;
        record.write(directory)?;
        Ok(summary(&record))
    }
}

fn record<'a, const D: usize>(
    config: &TransportConfig,
    outcome: &'a Outcome<D>,
    path: &Path<D>,
    (first, coordinates): (&Contour<D>, BoundaryRecord),
    start: Instant,
) -> Result<TransportRecord<'a, D>, CliError> {
    let (variation, shot) = (&outcome.variation, &outcome.counterpart.shot);
    let size = |shape| enclosed_volume(shape).map_err(CliError::from);
    let transported = Transported {
        given_steps: outcome.geodesic.motions.len(),
        steps_found: path.steps(),
        dice_variation: variation.dice,
        length_variation: variation.length,
        length: path.length(),
        volumes: [
            size(first)?,
            size(&variation.outline)?,
            path.sizes[0],
            path.sizes[path.steps()],
        ],
        step_energies: path.parts.energies.clone(),
        certificate: shot.certificate,
        equations: &outcome.counterpart.reports,
        coordinates,
    };
    let grid = outcome.geodesic.grid();
    let status = word(&shot.status());
    let doubts = named(&config.doubts(outcome), [&*config.name()]);
    Ok(
        TransportRecord::new(status, Some(grid), config, transported, doubts, start)
            .within(WorldFrame::of_inputs(&outcome.geodesic.inputs).as_ref()),
    )
}

impl TransportConfig {
    fn unfit(&self, reason: String) -> CliError {
        CliError::Variation {
            path: self.variation.clone(),
            reason,
        }
    }

    /// Estimates the memory, in bytes: with the geodesic, that of the path to the variation, or that of the
    /// transport and of the steps to the counterpart.
    fn memory<const D: usize>(&self, geodesic: &StoredGeodesic<D>) -> u64 {
        let grid = geodesic.grid();
        let params = geodesic.calculus_params(self.solver);
        let given = geodesic.motions.len();
        let to_variation = GeodesicParams {
            steps: self.steps,
            ..geodesic.params.clone()
        };
        let of_path = memory_of_path(&to_variation, 1, grid) + geodesic.bytes(D * given);
        let of_transport = memory_estimate(&params, given, self.steps, grid);
        geodesic.shapes_bytes() + of_path.max(of_transport)
    }

    /// The doubts about the mask of the variation, about its overlap with the end of the path to it,
    /// and about the path to its counterpart.
    fn doubts<const D: usize>(&self, outcome: &Outcome<D>) -> Vec<Doubt> {
        let variation = &outcome.variation;
        let reached = Doubt::overlap(Cause::PathEnd, variation.dice, variation.distance);
        let of_variation = variation.doubts.iter().copied().chain(reached);
        let doubts = of_variation.map(|doubt| doubt.about(0));
        let shot = outcome.counterpart.shot.doubts(self.steps, None);
        let source = of_source(&outcome.geodesic.doubts);
        doubts.chain(shot).chain(source).collect()
    }

    /// Label of the variation in pictures.
    fn name(&self) -> String {
        labels(&[FilePath::new(&self.variation)]).swap_remove(0)
    }

    /// Computes the logarithm of the variation at the first shape.
    fn variation<const D: usize>(
        &self,
        geodesic: &StoredGeodesic<D>,
        image: &Image<D>,
        session: &Session<'_>,
        checkpointer: &mut Checkpointer<'_>,
    ) -> Result<Variation<D>, CliError> {
        // Geodesics that were read have two inputs.
        let start = &geodesic.inputs[0];
        let (size, factor) = (&start.size, start.size_factor.unwrap_or(1.0));
        let frame = start.frame.beside(size, factor, image);
        let frame = frame.ok_or_else(|| {
            self.unfit(format!(
                "has {:?} samples, the first shape of the geodesic {size:?} (x first), and does not state its place \
                 in the world as that does",
                image.size
            ))
        })?;
        let first = &geodesic.level_sets[0];
        let grid = *first.grid();
        let motion = start.alignment.map(|alignment| alignment.motion);
        let (outline, near) = place_like(image, frame, motion, grid)?;
        let outside = share_outside(&outline, &grid)?;
        if Doubt::check(Cause::OutsideBox, outside).is_some() {
            return Err(self.unfit(format!(
                "has {:.2} % of its {} outside of the box of the geodesic's grid, which would be cut off",
                100.0 * outside,
                if D == 2 { "area" } else { "volume" }
            )));
        }
        let params = GeodesicParams {
            steps: self.steps,
            ..geodesic.params.clone()
        };
        session.progress.stage("computing the variation");
        let grids = grid.hierarchy(params.coarsest_nodes);
        let mut watch = checkpointer.observe(session.observer(&grids));
        let other_topology = Topology::of(first).differences(&Topology::of(&near));
        let found = logarithm(first, &near, &params, &mut watch)
            .map_err(|error| self.explained(error.into(), other_topology))?;
        watch.finish();
        match (found.path.displacements.last(), found.path.levels.last()) {
            (Some(last), Some(level)) if *last.grid() == grid => {
                let (dice, distance) = overlap(first, last, &near)?;
                let mut doubts = inspect_mask(image, false);
                doubts.extend(inspect_resolution(&near, &outline));
                Ok(Variation {
                    other_topology,
                    dice,
                    distance,
                    doubts,
                    length: level.energy.length(),
                    velocity: found.velocity,
                    outline,
                })
            }
            // Interrupted on a coarser grid.
            _ => Err(CliError::Stopped),
        }
    }

    /// Transports a velocity along the path and applies the exponential map at its end.
    fn counterpart<const D: usize>(
        &self,
        geodesic: &StoredGeodesic<D>,
        velocity: &Field<f64, D, D>,
        session: &Session<'_>,
        checkpointer: &mut Checkpointer<'_>,
    ) -> Result<Counterpart<D>, CliError> {
        let (first, path) = (&geodesic.level_sets[0], &geodesic.motions);
        let params = &geodesic.calculus_params(self.solver);
        let equations = || session.equation_observer(geodesic.grid());
        let mut watch = checkpointer.observe(equations());
        let ladder = Ladder::default();
        let transported = transport(first, path, velocity, ladder, params, &mut watch)?;
        watch.finish();
        let (Some(velocity), Some(last)) = (&transported.variation, path.last()) else {
            if transported.status() == SolveStatus::Cancelled {
                return Err(CliError::Stopped);
            }
            return Err(CliError::Computation {
                message: "the variation cannot be transported along the geodesic: a rung of the \
                          ladder was not found"
                    .into(),
                remedy: "compute the geodesic with more steps (-K), or give a variation that is \
                         nearer to its first shape"
                    .into(),
            });
        };
        let (end, velocity) = at_end(first, last, velocity, params)?;
        let mut watch = checkpointer.observe(equations());
        let shot = shoot(&end, &velocity, self.steps, params, &mut watch)?;
        watch.finish();
        if !shot.step_energies.iter().all(|energy| energy.is_finite()) {
            return Err(CliError::Computation {
                message: "the transported variation folds the last shape of the geodesic".into(),
                remedy: "use more --steps, a finer --grid for the geodesic, or a variation that is nearer to its \
                         first shape"
                    .into(),
            });
        }
        let mut reports = transported.reports;
        reports.extend_from_slice(&shot.reports);
        Ok(Counterpart {
            end,
            velocity,
            shot,
            reports,
        })
    }

    /// The error where no counterpart was found: deformations do not change the parts and holes of a shape.
    fn explained(&self, error: CliError, other_topology: usize) -> CliError {
        let may_be = matches!(error, CliError::Computation { .. } | CliError::Geodesic(_));
        if may_be && other_topology > 0 {
            self.unfit(
                "has other parts, holes or tunnels than the first shape of the geodesic: no counterpart was found"
                    .into(),
            )
        } else {
            error
        }
    }

    /// The path from the last shape to the counterpart.
    fn path<const D: usize>(&self, outcome: &Outcome<D>) -> Result<Path<D>, CliError> {
        let counterpart = &outcome.counterpart;
        let (shapes, displacements) = counterpart.shot.shapes()?;
        let [first, last] = &outcome.geodesic.names;
        let (name, steps) = (self.name(), self.steps);
        let names = (0..=displacements.len()).map(|k| match k {
            0 => last.clone(),
            _ if k == steps => format!("{last} + ({name} - {first})"),
            _ => format!("{k} of {steps}"),
        });
        let parts = Parts {
            level_sets: [vec![counterpart.end.clone()], shapes].concat(),
            names: names.collect(),
            displacements,
            energies: counterpart.shot.step_energies.clone(),
            steps,
            target: None,
        };
        Path::of(parts, &outcome.geodesic.params.law)
    }
}

fn summary<const D: usize>(record: &TransportRecord<'_, D>) -> Summary {
    let found = &record.body;
    let title = format!(
        "Variation transported over {} steps, {} of {} steps to its counterpart: {}, {:.1} s",
        found.given_steps,
        found.steps_found,
        record.parameters.steps,
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, "analogy.png", title);
    let dice = found.dice_variation;
    summary.line(
        "variation",
        format!("Dice {dice:.4} of the mask and the deformed first shape"),
    );
    let (start, end) = (found.length_variation, found.length);
    summary.line(
        "lengths",
        format!("{start:.4e} at the start, {end:.4e} at the end"),
    );
    summary.certificate(&found.certificate);
    summary
}

/// Overlap of a shape with the deformation of another, and the mean distance of their boundaries
/// in spacings.
fn overlap<const D: usize>(
    first: &ScalarField<f64, D>,
    displacement: &Field<f64, D, D>,
    shape: &ScalarField<f64, D>,
) -> Result<(f64, f64), CliError> {
    let measured = || {
        let moved = contour(first, 0.0, BoxEdge::Open)?.displaced(displacement, 1.0);
        let apart = hausdorff(&moved, &contour(shape, 0.0, BoxEdge::Open)?)?;
        let moved = ContourDistance::new(&moved)?.sample(*shape.grid());
        let dice = levelset::dice(&moved, 0.0, shape, 0.0)?;
        Ok((dice, apart.mean / shape.grid().spacing()))
    };
    Ok(measured().map_err(|error: LevelsetError| GeodesicError::from(error))?)
}
