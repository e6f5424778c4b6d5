//! `shapespace score`: scores of new shapes in the modes of variation.
//!
//! A new shape is placed as the shapes of the average, aligned with the average if they were, and
//! deformed elastically onto the fixed average. The resulting stress is represented by a
//! displacement as for them, and its scores in the modes are computed.
//!
//! `target` deforms a shape and measures it, `measured` is what is found of it, as numbers for other processes
//! and checkpoints.

mod measured;
mod target;

use std::path::Path;

use fe_grid::minimise::Memory;
use fe_grid::{Distribution, Grid};
use levelset::{Cause, Contour, Doubt};
use shape_average::memory_estimate as memory_of_average;
use shape_pca::{Scores, memory_estimate};

use super::args::ScoreConfig;
use super::components::NewShapes;
use super::read::{StoredPca, read_pca};
use super::record::{Distances, Placements, ScoreRecord};
use super::tables::{write_reconstruction, write_scores};
use crate::checkpoint::Checkpointer;
use crate::doubts::{named_by_label, of_source};
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::geodesic::draw::portraits;
use crate::memory::announce;
use crate::numbers::plural;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{Components, labels};
use crate::summary::Summary;
use measured::Measured;
use shapespace_input::ReadOptions;
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_picture::{Canvas, Colour, INK, Tiles, colour};
use target::Target;

/// Maximum number of shapes in the picture.
const SHOWN: usize = 12;

/// The scores of all shapes.
pub(crate) struct Outcome<const D: usize> {
    config: ScoreConfig,
    /// The grid of the displacements.
    grid: Grid<D>,
    names: Vec<String>,
    /// The labels of the components, if there are several.
    labels: Vec<i64>,
    shapes: Vec<Measured<D>>,
    /// As [`StoredPca::left_out_error`].
    left_out_error: Option<f64>,
    /// The doubt about the modes.
    source: Option<Doubt>,
}

impl Command for ScoreConfig {
    const DISTRIBUTED: bool = true;

    type Plan<const D: usize> = (StoredPca<D>, NewShapes<D>);
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the modes");
        let stored = read_pca(&self.pca, self.average.as_deref(), session.trust)?;
        let stated = ReadOptions {
            label: self.label,
            invert: self.invert,
        };
        let (labelled, known) = match &stored {
            Dim::D2(stored) => stored.average.reading(),
            Dim::D3(stored) => stored.average.reading(),
        };
        let options = stated.or(known);
        let images = if labelled {
            self.check_labelled()?;
            session.sources.read_label_images(&self.inputs)?
        } else {
            session.sources.read_images(&self.inputs, &options)?
        };
        let [own, new] = [stored.dimension(), images.dimension()];
        let unfit = || CliError::Option {
            option: "--pca",
            value: format!("'{}'", self.pca.display()),
            remedy: format!(
                "its shapes are {own}D and '{}' is {new}D: give new shapes as those of the average",
                self.inputs[0].display()
            ),
        };
        Ok(per_dimension!(stored, stored => {
            let images = images.of_type().ok_or_else(unfit)?;
            let new = NewShapes::new(images, &stored.average.components)?;
            (stored, new)
        }))
    }

    fn compute<const D: usize>(
        &self,
        plan: Self::Plan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let outcome = self.take_part(plan, session)?;
        // The first process has all shapes.
        outcome.ok_or_else(|| CliError::Computation {
            message: "the scores of a shape are missing".into(),
            remedy: "start the same program on all machines".into(),
        })
    }

    fn assist<const D: usize>(
        &self,
        plan: Self::Plan<D>,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        self.take_part(plan, session).map(drop)
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let (names, shapes) = (&outcome.names, &outcome.shapes);
        let placed = placements(shapes);
        let displacements = shapes.iter().map(|shape| &shape.displacement);
        directory.arrays("displacement", 0, displacements)?;
        let scores: Vec<Scores> = shapes.iter().map(|shape| shape.scores.clone()).collect();
        directory.with_file("scores.csv", |path| {
            write_scores(path, names, &scores, &[], None)
        })?;
        directory.with_file("reconstruction.svg", |path| {
            let distances = &placed.reconstruction_distance;
            write_reconstruction(path, names, &placed.errors, distances)
        })?;
        directory.picture("score.png", || picture(names, shapes))?;
        let (grid, start) = (Some(&outcome.grid), session.start);
        let doubts = shapes.iter().enumerate();
        let doubts = doubts.flat_map(|(i, shape)| {
            let beside = doubt_of_residual(&shape.scores, outcome.left_out_error);
            let doubts = shape.doubts.iter().copied().chain(beside);
            doubts.map(move |doubt| doubt.about(i))
        });
        let doubts: Vec<Doubt> = doubts.chain(outcome.source).collect();
        let names = names.iter().map(|name| &**name);
        let doubts = named_by_label(&doubts, names, &outcome.labels);
        let config = &outcome.config;
        let record = ScoreRecord::<D>::new("complete", grid, config, placed, doubts, start);
        record.write(directory)?;
        Ok(summary(&record))
    }
}

/// Estimates the memory of the scores of new shapes, in bytes: of the modes of the average, and of the deformation
/// of one shape after the other onto it.
fn memory_of_scores<const D: usize>(stored: &StoredPca<D>, n_shapes: usize) -> u64 {
    let (average, grid) = (&stored.average, stored.space.object.grid());
    let modes = stored.space.fields.len();
    let of_modes = memory_estimate(average.average.n_shapes(), modes, false, grid);
    let components = average.components.len().max(1);
    let alone = Distribution::alone(1);
    let of_one = memory_of_average(&average.params, &alone, components, false, grid).memory;
    let found = size_of::<f64>() * grid.n_nodes() * n_shapes * D;
    of_modes + of_one + found as u64
}

/// Share of a deformation that may lie beside the modes at any distance: that of masks on other grids.
const EXPLAINED: f64 = 0.1;

impl ScoreConfig {
    /// Measures all shapes, some on each process; the first one has them.
    fn take_part<const D: usize>(
        &self,
        (stored, new): (StoredPca<D>, NewShapes<D>),
        session: &Session<'_>,
    ) -> Result<Option<Outcome<D>>, CliError> {
        session.progress.stage("assembling the compound operator");
        let align = self.align.unwrap_or(stored.average.align);
        let size = self.size.unwrap_or(stored.average.size);
        let images = &new.images;
        let parts = new.parts.iter().flat_map(Components::masks);
        let hashes = images.iter().chain(parts).map(hash);
        let mut fingerprint = Fingerprint::of_results(self, &[&self.pca])?.and(hashes);
        fingerprint.leave_out("pca");
        fingerprint.leave_out("average");
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let grid = stored.space.object.grid();
        let needed = memory_of_scores(&stored, images.len());
        announce(needed, grid, &session.progress)?;
        let target = Target::new(&stored, align, size)?;
        let paths: Vec<&Path> = images.iter().map(|image| image.path.as_path()).collect();
        let names = labels(&paths);
        let shapes = measure_all(&target, &new, &names, session, &mut checkpointer)?;
        session.ended(checkpointer);
        Ok(shapes.map(|shapes| Outcome {
            config: Self {
                align: Some(align),
                size: Some(size),
                ..self.clone()
            },
            grid: *grid,
            labels: stored.average.components.iter().map(|c| c.label).collect(),
            names,
            shapes,
            left_out_error: stored.left_out_error,
            source: of_source(&stored.doubts),
        }))
    }

    /// Rejects options that choose one object of label images.
    fn check_labelled(&self) -> Result<(), CliError> {
        let refused = [("--label", self.label.is_some()), ("--invert", self.invert)];
        match refused.into_iter().find(|(_, is_set)| *is_set) {
            Some((option, _)) => Err(CliError::Option {
                option,
                value: "with modes of labelled components".into(),
                remedy: "leave it out: new shapes have the labels of the average".into(),
            }),
            None => Ok(()),
        }
    }
}

/// Measures all shapes that an earlier run has not: every process takes some of them, one after the other. The
/// first process has all in the end, and keeps them for checkpoints.
fn measure_all<const D: usize>(
    target: &Target<'_, D>,
    new: &NewShapes<D>,
    names: &[String],
    session: &Session<'_>,
    checkpointer: &mut Checkpointer<'_>,
) -> Result<Option<Vec<Measured<D>>>, CliError> {
    let processes = &*session.processes;
    let (space, grids) = (&target.stored.space, target.grids());
    let mut found: Vec<Option<Measured<D>>> = Vec::new();
    for number in 0..names.len() {
        let known = checkpointer.part(number);
        found.push(known.and_then(|known| Measured::of_numbers(&known.x, space)));
    }
    let is_known = |shape: &Option<Measured<D>>| f64::from(u8::from(shape.is_some()));
    let mut known: Vec<f64> = found.iter().map(is_known).collect();
    // Checkpoints are those of the first process.
    processes.broadcast(0, &mut known);
    let left: Vec<usize> = (0..names.len()).filter(|i| known[*i] == 0.0).collect();
    let own = &left[session.distribution(left.len()).own()];
    // The first process has as many as any other.
    for step in 0..left.len().div_ceil(processes.size()) {
        let mut numbers = Vec::new();
        if let Some(&number) = own.get(step) {
            let name = &names[number];
            let stage = format!("deforming '{name}' onto the average");
            session.progress.stage(stage);
            let parts = new.parts.as_ref().map_or(&[][..], |parts| parts.of(number));
            let (image, is_shown) = (&new.images[number], number < SHOWN);
            let watch = session.observer(&grids);
            let measured = if session.is_first() {
                checkpointer.part(number);
                let mut watch = checkpointer.observe(watch);
                let measured = target.measure(image, parts, is_shown, session, &mut watch)?;
                watch.finish();
                measured
            } else {
                let mut watch = watch;
                target.measure(image, parts, is_shown, session, &mut watch)?
            };
            let measured = measured.into_numbers();
            numbers.extend([number as f64, measured.len() as f64]);
            numbers.extend(measured);
        }
        let gathered = processes.gather(&numbers).unwrap_or_default();
        let mut rest = &gathered[..];
        while let [number, length, all @ ..] = rest {
            let (number, length) = (*number as usize, *length as usize);
            let (own, others) = all.split_at(length.min(all.len()));
            checkpointer.keep_part(number, &Memory::of_result(own, Vec::new()), &grids);
            if let Some(place) = found.get_mut(number) {
                *place = Measured::of_numbers(own, space);
            }
            rest = others;
        }
    }
    Ok(found.into_iter().collect())
}

/// The doubt about a shape that the modes do not span, given the distance of the training shapes from the modes of the
/// others.
fn doubt_of_residual(scores: &Scores, left_out_error: Option<f64>) -> Option<Doubt> {
    let error = scores.errors.last()?;
    let doubt = Doubt::check(Cause::Residual, error / left_out_error?);
    doubt.filter(|_| scores.residual() > EXPLAINED)
}

fn placements<const D: usize>(shapes: &[Measured<D>]) -> Placements {
    let relative = |s: &Scores| -> Vec<f64> {
        let size = s.norm.max(f64::MIN_POSITIVE);
        s.errors.iter().map(|e| e / size).collect()
    };
    Placements {
        distances: Distances::of(shapes.iter().map(|shape| &shape.scores)),
        scores: shapes.iter().map(|s| s.scores.scores.clone()).collect(),
        residual: shapes.iter().map(|s| s.scores.residual()).collect(),
        errors: shapes.iter().map(|s| relative(&s.scores)).collect(),
        reconstruction_dice: shapes.iter().map(|s| s.dice.clone()).collect(),
        reconstruction_distance: shapes.iter().map(|s| s.distance.clone()).collect(),
        dice: shapes.iter().map(|s| s.overlap).collect(),
        elastic: shapes.iter().map(|s| s.elastic).collect(),
    }
}

/// Every shape with its reconstructions by none, some and all modes.
fn picture<const D: usize>(names: &[String], found: &[Measured<D>]) -> Canvas {
    let (mut shapes, mut words): (Vec<(&Contour<D>, Colour)>, Vec<String>) = Default::default();
    for (k, (name, shape)) in names.iter().zip(found).take(SHOWN).enumerate() {
        let Some((own, reconstructions)) = shape.outlines.split_first() else {
            continue;
        };
        let distance = shape.scores.mahalanobis.distance;
        shapes.push((own, colour(k)));
        words.push(format!("{name}, d {distance:.2}"));
        for (outline, m) in reconstructions.iter().zip(shape.shown_modes()) {
            shapes.push((outline, INK));
            words.push(format!("{m} modes, Dice {:.3}", shape.dice[m]));
        }
    }
    let pictures = portraits(&shapes);
    let tiles: Vec<(String, Canvas)> = words.into_iter().zip(pictures).collect();
    Tiles {
        tiles: &tiles,
        columns: 4,
        side: 200,
    }
    .draw()
}

fn summary<const D: usize>(record: &ScoreRecord<D>) -> Summary {
    let (shapes, found) = (&record.parameters.inputs, &record.body);
    let (n, seconds) = (shapes.len(), record.seconds);
    let title = format!("Scores of {n} shape{}, {seconds:.1} s", plural(n));
    let mut summary = Summary::new(record, "score.png", title);
    for (k, shape) in shapes.iter().enumerate() {
        summary.text(format!(
            "  {}: Mahalanobis distance {:.3} (p = {:.2e} in {} modes), residual {:.1} %, deformed \
             with Dice {:.4}",
            shape.display(),
            found.distances.mahalanobis[k],
            found.distances.p_value[k],
            found.distances.degrees_of_freedom,
            100.0 * found.residual[k],
            found.dice[k]
        ));
    }
    summary
}

#[cfg(test)]
mod tests {
    use super::*;
    use shape_pca::SampleSize;

    #[test]
    fn shapes_beside_the_modes_are_doubtful() {
        let doubt = |[first, last]: [f64; 2], left_out: Option<f64>| {
            let mut scores = Scores::new(&[], first * first, &[], SampleSize::equal(9));
            scores.errors.push(last);
            doubt_of_residual(&scores, left_out)
        };
        // A reflected shape: .6 of its deformation lies beside the modes, 24 times as far as that of others.
        let found = doubt([1.0, 0.6], Some(0.025)).unwrap();
        assert_eq!(found.cause, Cause::Residual);
        assert!((found.figure - 24.0).abs() < 1e-9);
        assert!(doubt([1.0, 0.6], Some(0.2)).is_none());
        assert!(doubt([1.0, 0.09], Some(1e-3)).is_none());
        // Modes of a version that did not measure it.
        assert!(doubt([1.0, 0.6], None).is_none());
    }
}
