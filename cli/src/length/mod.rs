//! `shapespace length`: the length and dissipation of a given path, beside those of the geodesic
//! between its ends.
//!
//! Consecutive shapes are joined by geodesics, of one step by default.

mod args;
mod record;

use ::geodesic::{Geodesic, GeodesicParams, GivenPath, Shape, geodesic_between, memory_estimate};
use fe_grid::{Grid, ScalarField};
use levelset::{Cause, Doubt};

use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::geodesic::draw::film;
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::write_path;
use crate::memory::announce;
use crate::options::resolve_law;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{Input, Placed, doubts_of, records_of, settle};
use crate::summary::Summary;
use shapespace_input::Image;
use shapespace_input::dimension::per_dimension;

pub use args::LengthConfig;

/// The name of the pictures of the given path.
const STEM: &str = "path";

/// The doubt about a geodesic that is longer than the given path between its ends.
fn is_shorter<const D: usize>(given: &GivenPath<D>, geodesic: &Geodesic<D>) -> Option<Doubt> {
    let ratio = given.length() / geodesic.length();
    Doubt::check(Cause::ShorterPath, ratio).filter(|_| ratio.is_finite())
}

/// Inputs that are read, placed and validated.
pub(crate) struct LengthPlan<const D: usize> {
    placed: Placed<D>,
    /// With all defaults resolved.
    config: LengthConfig,
    fingerprint: Fingerprint,
}

/// The lengths of a path and of the geodesic.
pub(crate) struct Outcome<const D: usize> {
    config: LengthConfig,
    inputs: Vec<Input<D>>,
    distances: Vec<ScalarField<f64, D>>,
    given: GivenPath<D>,
    shortest: Option<Geodesic<D>>,
    doubts: Vec<Doubt>,
    /// Whether the user stopped the computation.
    interrupted: bool,
}

impl Command for LengthConfig {
    type Plan<const D: usize> = LengthPlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        let count = self.inputs.len();
        session.progress.stage(format!("reading {count} masks"));
        let sources = &session.sources;
        let images = sources.read_images(&self.inputs, &self.masks.reading())?;
        Ok(per_dimension!(images, images => plan(images, self.clone())?))
    }

    fn compute<const D: usize>(
        &self,
        plan: LengthPlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let LengthPlan {
            placed,
            config,
            fingerprint,
        } = plan;
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let params = &config.params;
        let settled = settle(placed, &[], None, &session.progress, &session.processes)?;
        let grid = settled.grid;
        let (inputs, distances) = settled.measure(&session.progress, &session.processes)?;
        announce(
            self.memory(distances.len(), params, &grid),
            &grid,
            &session.progress,
        )?;
        let shapes: Vec<_> = distances.iter().cloned().map(Shape::new).collect();
        session.progress.stage("joining consecutive shapes");
        let levels = grid.hierarchy(params.coarsest_nodes);
        let mut watch = checkpointer.observe(session.observer(&levels));
        let given = GivenPath::new(&shapes, params, &mut watch)?;
        let mut doubts = doubts_of(&inputs);
        doubts.extend(given.doubts(params));
        let mut shortest = None;
        if let ([first, .., last], false) =
            (&shapes[..], self.no_geodesic || session.interrupt.asked())
        {
            session.progress.stage("computing the geodesic");
            let params = GeodesicParams {
                steps: given.step_energies().len(),
                ..params.clone()
            };
            let mut path = geodesic_between(first, last, &params, &mut watch)?;
            // A shorter path than the geodesic leads to another minimum.
            if is_shorter(&given, &path).is_some() && !session.interrupt.asked() {
                session
                    .progress
                    .stage("computing the geodesic from the given path");
                let other = given.shortened(first, last, &params, &mut watch)?;
                let better =
                    |other: &Geodesic<D>| other.end_reached() && other.length() < path.length();
                if let Some(other) = other.filter(better) {
                    path = other;
                }
            }
            doubts.extend(path.doubts(&params));
            doubts.extend(is_shorter(&given, &path));
            shortest = Some(path);
        }
        watch.finish();
        session.ended(checkpointer);
        Ok(Outcome {
            config,
            inputs,
            distances,
            given,
            shortest,
            doubts,
            interrupted: session.interrupt.asked(),
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let path = outcome.path()?;
        let inputs = records_of(&outcome.inputs);
        let coordinates = write_path(directory, STEM, &inputs, &path)?;
        if let (Some(shortest), [first, .., last]) = (&outcome.shortest, &outcome.inputs[..]) {
            let path = Path::of_geodesic([first, last], shortest, &outcome.config.params)?;
            directory.picture("geodesic.png", || film(&path))?;
        }
        let record = record::record(outcome, &path, coordinates, session.start);
        record.write(directory)?;
        Ok(record::summary(&record))
    }
}

impl LengthConfig {
    /// Estimates the memory, in bytes: the shapes, as they are and as the ends of paths, the pieces of the given path,
    /// which are kept, and the larger of one piece and of the geodesic, which has as many steps as all pieces.
    fn memory<const D: usize>(
        &self,
        n_shapes: usize,
        params: &GeodesicParams,
        grid: &Grid<D>,
    ) -> u64 {
        let steps = n_shapes.saturating_sub(1) * params.steps;
        // Of every step the level set and both kinds of deformations, and of every piece the start shape.
        let kept = 2 * n_shapes + steps * (2 * D + 1) + n_shapes;
        let of_piece = memory_estimate(params, 1, grid);
        let of_geodesic = if self.no_geodesic {
            0
        } else {
            let params = GeodesicParams {
                steps,
                ..params.clone()
            };
            memory_estimate(&params, 1, grid)
        };
        let kept = (size_of::<f64>() * kept * grid.n_nodes()) as u64;
        kept + of_piece.max(of_geodesic)
    }
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    mut config: LengthConfig,
) -> Result<LengthPlan<D>, CliError> {
    resolve_law::<D>(&mut config.params.law)?;
    let hashes = images.iter().map(hash).collect();
    let mut placed = Placed::new(images, &mut config.masks)?;
    placed.lead(&config.inputs, config.like.as_deref())?;
    Ok(LengthPlan {
        placed,
        fingerprint: Fingerprint::new(&config, hashes),
        config,
    })
}

impl<const D: usize> Outcome<D> {
    /// The given shapes, what lies between them, and the steps.
    fn path(&self) -> Result<Path<D>, CliError> {
        let (mut level_sets, mut displacements, mut names) = (Vec::new(), Vec::new(), Vec::new());
        for (k, piece) in self.given.pieces.iter().enumerate() {
            let steps = piece.displacements.len();
            level_sets.push(self.distances[k].clone());
            level_sets.extend(piece.level_sets[1..steps].iter().cloned());
            displacements.extend(piece.displacements.iter().cloned());
            names.push(self.inputs[k].name.clone());
            names.extend((1..steps).map(|i| format!("{i} of {steps}")));
        }
        let last = self.given.pieces.len();
        level_sets.push(self.distances[last].clone());
        names.push(self.inputs[last].name.clone());
        let parts = Parts {
            level_sets,
            steps: displacements.len(),
            displacements,
            energies: self.given.step_energies(),
            names,
            target: None,
        };
        Path::of(parts, &self.config.params.law)
    }
}
