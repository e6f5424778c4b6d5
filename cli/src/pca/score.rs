//! `shapespace score`: scores of new shapes in the modes of variation.
//!
//! A new shape is placed as the shapes of the average, aligned with the average if they were, and
//! deformed elastically onto the fixed average. The resulting stress is represented by a
//! displacement as for them, and its scores in the modes are computed.

use std::path::Path;
use std::slice;

use fe_grid::minimise::{Memory, Observer};
use fe_grid::{Distribution, Grid, ScalarField, VectorField};
use levelset::{
    BoxEdge, Cause, Contour, ContourDistance, Doubt, Moments, contour, hausdorff, signed_distance,
};
use shape_average::align::align_to;
use shape_average::{
    AverageResult, Shapes, match_components_to, memory_estimate as memory_of_average,
};
use shape_pca::{Compound, Scores, Source, memory_estimate};

use super::args::ScoreConfig;
use super::components::NewShapes;
use super::draw::{moved, shown};
use super::procrustes::{Procrustes, there_and_back};
use super::read::{StoredPca, read_pca};
use super::record::{Distances, Placements, ScoreRecord};
use super::tables::{write_reconstruction, write_scores};
use crate::checkpoint::Checkpointer;
use crate::doubts::{named_by_label, of_source};
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::geodesic::draw::portraits;
use crate::memory::announce;
use crate::options::{Align, Frame, Size};
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{
    Components, Likeness, Motion, inspect_mask, inspect_resolution, labels, moved as moved_by,
    place_like,
};
use crate::summary::Summary;
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::frame::{FrameTransform, corner_in_unit_box};
use shapespace_input::place::frame_like;
use shapespace_input::{Image, ReadOptions};
use shapespace_picture::{Canvas, Colour, INK, Tiles, colour};

/// Nodes per side of the grids for the rigid alignment, in 2D and 3D.
const ALIGNMENT_NODES: [usize; 2] = [65, 33];
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
    /// The doubt about the modes.
    source: Option<Doubt>,
}

/// A new shape and its scores.
struct Measured<const D: usize> {
    /// Overlap of the shape, deformed onto the average, with the average.
    overlap: f64,
    doubts: Vec<Doubt>,
    outline: Contour<D>,
    scores: Scores,
    /// The reconstruction by the first `m` modes.
    reconstructions: Vec<Contour<D>>,
    dice: Vec<f64>,
    distance: Vec<f64>,
    /// The deformation onto the average.
    fit: AverageResult<D>,
    displacement: VectorField<f64, D>,
}

/// Where a new shape lies.
struct Place<const D: usize> {
    frame: FrameTransform<D>,
    motion: Option<Motion<D>>,
    /// The doubt that it is reflected.
    reflection: Option<Doubt>,
}

/// The average as the target of new shapes.
struct Target<'a, const D: usize> {
    stored: &'a StoredPca<D>,
    compound: Compound<D>,
    outline: Contour<D>,
    size: f64,
    distance: ScalarField<f64, D>,
    /// Signed distances of its components; that of the whole where there is one.
    parts: Vec<ScalarField<f64, D>>,
    /// Their phase fields.
    phase_fields: Vec<ScalarField<f64, D>>,
    /// On the grid of the rigid alignment, which is that of the unit box.
    coarse: ScalarField<f64, D>,
    align: Align,
    scale: Size,
}

impl Command for ScoreConfig {
    type Plan<const D: usize> = (StoredPca<D>, NewShapes<D>);
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the modes");
        let stored = read_pca(&self.pca, self.average.as_deref(), session.trust)?;
        let options = ReadOptions {
            label: self.label,
            invert: self.invert,
        };
        let labelled = match &stored {
            Dim::D2(stored) => !stored.average.components.is_empty(),
            Dim::D3(stored) => !stored.average.components.is_empty(),
        };
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
        (stored, new): (StoredPca<D>, NewShapes<D>),
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
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
        let mut shapes = Vec::new();
        for (number, (image, name)) in images.iter().zip(&names).enumerate() {
            session
                .progress
                .stage(format!("deforming '{name}' onto the average"));
            let parts = new.parts.as_ref().map_or(&[][..], |parts| parts.of(number));
            shapes.push(target.measure(image, parts, session, &mut checkpointer)?);
        }
        session.ended(checkpointer);
        Ok(Outcome {
            config: ScoreConfig {
                align: Some(align),
                size: Some(size),
                ..self.clone()
            },
            grid: *stored.space.object.grid(),
            labels: stored.average.components.iter().map(|c| c.label).collect(),
            names,
            shapes,
            source: of_source(&stored.doubts),
        })
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
        directory.with_file("scores.csv", |path| write_scores(path, names, &scores, &[]))?;
        directory.with_file("reconstruction.svg", |path| {
            let distances = &placed.reconstruction_distance;
            write_reconstruction(path, names, &placed.errors, distances)
        })?;
        directory.picture("score.png", || picture(names, shapes))?;
        let (grid, start) = (Some(&outcome.grid), session.start);
        let doubts = shapes.iter().enumerate();
        let doubts = doubts.flat_map(|(i, shape)| shape.doubts.iter().map(move |d| d.about(i)));
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

impl ScoreConfig {
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

impl<'a, const D: usize> Target<'a, D> {
    fn new(stored: &'a StoredPca<D>, align: Align, scale: Size) -> Result<Self, CliError> {
        let object = &stored.space.object;
        let outline = contour(object, 0.5, BoxEdge::Closed).map_err(shown)?;
        let coarse = Grid::cube(ALIGNMENT_NODES[usize::from(D == 3)]);
        let distance = signed_distance(object, 0.5).map_err(shown)?;
        let components = &stored.average.components;
        let (mut parts, mut phase_fields) = (Vec::new(), Vec::new());
        for component in components {
            parts.push(signed_distance(&component.indicator, 0.5).map_err(shown)?);
            phase_fields.push(component.phase_field.clone());
        }
        if components.is_empty() {
            parts.push(distance.clone());
            phase_fields.push(stored.average.phase_field.clone());
        }
        Ok(Self {
            stored,
            compound: Compound::new(&stored.average.average, &stored.space.params)?,
            size: Moments::of_contour(&outline).map_err(shown)?.volume,
            distance,
            parts,
            phase_fields,
            coarse: ContourDistance::new(&moved_by(&outline, corner_in_unit_box(object.grid())))
                .map_err(shown)?
                .sample(coarse),
            outline,
            align,
            scale,
        })
    }

    fn measure(
        &self,
        image: &Image<D>,
        components: &[Image<D>],
        session: &Session<'_>,
        checkpointer: &mut Checkpointer<'_>,
    ) -> Result<Measured<D>, CliError> {
        let grid = *self.distance.grid();
        let place = self.place(image)?;
        let (outline, distance) = place.of(image, grid)?;
        let mut parts = Vec::new();
        for component in components {
            parts.push(place.of(component, grid)?.1);
        }
        if parts.is_empty() {
            parts.push(distance.clone());
        }
        let params = &self.stored.average.params;
        let grids = grid.hierarchy(params.coarsest_nodes);
        let mut watch = checkpointer.observe(session.observer(&grids));
        let [own, goal] =
            [(&distance, &parts), (&self.distance, &self.parts)].map(|(whole, parts)| {
                Shapes::of_components(slice::from_ref(whole), parts, parts.len())
            });
        let fit = match_components_to(own?, goal?, &self.phase_fields, params, &mut watch);
        if session.interrupt.asked() {
            return Err(CliError::Stopped);
        }
        let fit = fit?;
        let source = Source {
            weight: 1.0,
            displacement: fit.displacements[0].as_slice(),
            indicator: fit.shapes.indicators[0].as_slice(),
        };
        let space = &self.stored.space;
        let displacement = self.represented(source, &mut watch)?;
        watch.finish();
        let scores = space.scores(&self.compound, &displacement);
        let (mut reconstructions, mut dice, mut distances) = (Vec::new(), Vec::new(), Vec::new());
        let onto = &fit.displacements[0];
        for m in 0..=scores.scores.len() {
            let u = space.synthesise(&scores.scores[..m])?;
            let back = there_and_back(&outline, onto, &u, -1.0);
            let aligned = Procrustes::new(back.points(), outline.points());
            let shape = aligned.apply(&moved(&self.outline, &u, -1.0));
            let field = ContourDistance::new(&shape).map_err(shown)?.sample(grid);
            dice.push(levelset::dice(&field, 0.0, &distance, 0.0).map_err(shown)?);
            distances.push(aligned.distance);
            reconstructions.push(shape);
        }
        let (overlap, doubts) = agreement(&fit.pushed[0], &self.distance, &self.outline)?;
        let mut doubts = [doubts, self.doubts(image, &distance, &outline, &fit)].concat();
        doubts.extend(place.reflection);
        let stored = &self.stored.average.components;
        let components = fit.components.iter().zip(&self.parts).zip(stored);
        for (c, ((component, part), stored)) in components.enumerate() {
            let (_, found) = agreement(&component.pushed[0], part, &stored.outline()?)?;
            doubts.extend(found.into_iter().map(|doubt| doubt.within(c)));
        }
        Ok(Measured {
            doubts,
            overlap,
            outline,
            scores,
            reconstructions,
            dice,
            distance: distances,
            fit,
            displacement,
        })
    }

    /// The displacement of a new shape, from an earlier run if the observer has it.
    fn represented(
        &self,
        source: Source<'_>,
        observer: &mut dyn Observer,
    ) -> Result<VectorField<f64, D>, CliError> {
        let grid = *self.distance.grid();
        let memory = observer.resume();
        let known = memory
            .as_ref()
            .and_then(|memory| memory.result(D * grid.n_nodes()));
        if let Some((u, [])) = known {
            return Ok(VectorField::from_vec(grid, u.to_vec())?);
        }
        let u = self.stored.space.represent(&self.compound, source)?;
        observer.memory(&Memory::of_result(u.as_slice(), Vec::new()));
        Ok(u)
    }

    /// The doubts about the mask of a new shape, and about its deformation onto the average.
    fn doubts(
        &self,
        image: &Image<D>,
        distance: &ScalarField<f64, D>,
        outline: &Contour<D>,
        fit: &AverageResult<D>,
    ) -> Vec<Doubt> {
        // The result of a single shape compares it with itself.
        let own = fit.doubts(&self.stored.average.params).into_iter();
        let own = own.filter(|d| !matches!(d.cause, Cause::Overlap | Cause::BoundaryDistance));
        let doubts = inspect_resolution(distance, outline).into_iter().chain(own);
        doubts.chain(inspect_mask(image, false)).collect()
    }

    /// Where a new shape lies in the box of the average.
    fn place(&self, image: &Image<D>) -> Result<Place<D>, CliError> {
        let grid = *self.distance.grid();
        // New shapes are placed and aligned in the unit box, which has room for any orientation.
        let corner = corner_in_unit_box(&grid);
        let back = corner.map(|x| -x);
        let (size, frame) = &self.stored.average.frame;
        let in_world = match self.stored.average.placing {
            None | Some(Frame::None) => None,
            Some(Frame::Physical | Frame::Centred) => image.in_world(),
        };
        let image = in_world.as_ref().unwrap_or(image);
        let turned = self.align == Align::Rigid || self.scale == Size::Equal;
        let mut frame_of = frame_like(image, (size, &frame.moved(corner)), &grid, 1.0, turned);
        if self.scale == Size::Equal {
            let (outline, _) = place_like(image, frame_of, None, self.coarse_grid())?;
            let own = Moments::of_contour(&outline).map_err(shown)?.volume;
            frame_of = frame_of.shrunk((self.size / own).powf(1.0 / D as f64));
        }
        let coarse = place_like(image, frame_of, None, self.coarse_grid());
        if self.align == Align::None {
            // Where nothing is aligned, only sides in the world are those of the average.
            let reflection = match coarse {
                Ok((_, coarse)) if in_world.is_some() => self.reflection(&coarse)?,
                _ => None,
            };
            return Ok(Place {
                frame: frame_of.moved(back),
                motion: None,
                reflection,
            });
        }
        let (_, coarse) = coarse?;
        let found = align_to(&self.coarse, &coarse).map_err(|error| CliError::Computation {
            message: format!("'{}' cannot be aligned: {error}", image.path.display()),
            remedy: "use --align none if it has the position of the average".into(),
        })?;
        let rotation = found.motion.rotation();
        let translation = found.motion.translation();
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]));
        let shift = std::array::from_fn(|i| translation[i] + back[i]);
        Ok(Place {
            frame: frame_of,
            motion: Some((rows, shift)),
            reflection: self.reflection(&coarse)?,
        })
    }

    /// The doubt that a shape is reflected against the average.
    fn reflection(&self, coarse: &ScalarField<f64, D>) -> Result<Option<Doubt>, CliError> {
        Ok(Likeness::new(&self.coarse, coarse)?.doubt())
    }

    fn coarse_grid(&self) -> Grid<D> {
        *self.coarse.grid()
    }
}

impl<const D: usize> Place<D> {
    /// The boundary of a mask in this place, and its signed distance.
    fn of(
        &self,
        mask: &Image<D>,
        grid: Grid<D>,
    ) -> Result<(Contour<D>, ScalarField<f64, D>), CliError> {
        place_like(mask, self.frame, self.motion, grid)
    }
}

/// The overlap of a deformed shape, given by its signed distance, with what it is deformed onto, and the doubts
/// about it and about the distance of the boundaries.
fn agreement<const D: usize>(
    pushed: &ScalarField<f64, D>,
    target: &ScalarField<f64, D>,
    outline: &Contour<D>,
) -> Result<(f64, Vec<Doubt>), CliError> {
    let overlap = levelset::dice(pushed, 0.0, target, 0.0).map_err(shown)?;
    let pushed = contour(pushed, 0.0, BoxEdge::Closed).map_err(shown)?;
    let apart = hausdorff(&pushed, outline).map_err(shown)?;
    let [mean, largest] = [apart.mean, apart.maximum].map(|d| d / target.grid().spacing());
    let doubts = [
        Doubt::overlap(Cause::Overlap, overlap, mean),
        Doubt::check(Cause::BoundaryDistance, largest),
    ];
    Ok((overlap, doubts.into_iter().flatten().collect()))
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
        elastic: shapes.iter().map(|s| s.fit.energy.elastic[0]).collect(),
    }
}

/// Every shape with its reconstructions by some and by all modes.
fn picture<const D: usize>(names: &[String], found: &[Measured<D>]) -> Canvas {
    let (mut shapes, mut words): (Vec<(&Contour<D>, Colour)>, Vec<String>) = Default::default();
    for (k, (name, shape)) in names.iter().zip(found).take(SHOWN).enumerate() {
        let all = shape.reconstructions.len() - 1;
        let some = all.div_ceil(2);
        shapes.push((&shape.outline, colour(k)));
        words.push(format!(
            "{name}, d {:.2}",
            shape.scores.mahalanobis.distance
        ));
        for m in [0, some, all] {
            shapes.push((&shape.reconstructions[m], INK));
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
    let title = format!("Scores of {} shapes, {:.1} s", shapes.len(), record.seconds);
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
