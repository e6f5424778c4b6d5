//! `shapespace score`: scores of new shapes in the modes of variation.
//!
//! A new shape is placed as the shapes of the average, aligned with the average if they were, and
//! deformed elastically onto the fixed average. The resulting stress is represented by a
//! displacement as for them, and its scores in the modes are computed.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Contour, ContourDistance, Moments, contour, signed_distance};
use shape_average::align::align_to;
use shape_average::{AverageResult, match_to};
use shape_pca::{Compound, Scores, Source};

use super::args::{ScoreArgs, ScoreConfig};
use super::draw::{moved, shown};
use super::procrustes::{Procrustes, there_and_back};
use super::read::{AnyPca, StoredPca, read_pca};
use super::record::{Placements, ScoreRecord};
use super::tables::{write_reconstruction, write_scores};
use crate::error::{CliError, Exit};
use crate::geodesic::draw::portraits;
use crate::input::place::frame_like;
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::options::{Align, Size};
use crate::output::npy::{Precision, write_field};
use crate::output::{ResultDir, numbered};
use crate::picture::{Canvas, Colour, INK, Tiles, colour};
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{labels, place_like};
use crate::watch::{Interrupt, ProgressObserver, level_nodes};

/// Nodes per side of the grids for the rigid alignment, in 2D and 3D.
const ALIGNMENT_NODES: [usize; 2] = [65, 33];
/// Maximum number of shapes in the picture.
const SHOWN: usize = 12;

/// Runs `shapespace score`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_score(args: &ScoreArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config: ScoreConfig| {
        ResultDir::create(&args.run.output).map(drop)?;
        progress.stage("reading the modes");
        let stored = read_pca(&config.pca, config.average.as_deref())?;
        let options = ReadOptions {
            label: config.label,
        };
        let images = read_images(&config.inputs, &options)?;
        match (stored, images) {
            (AnyPca::D2(stored), AnyImages::D2(images)) => {
                run(&stored, &images, config, args, &progress, interrupt, start)
            }
            (AnyPca::D3(stored), AnyImages::D3(images)) => {
                run(&stored, &images, config, args, &progress, interrupt, start)
            }
            (AnyPca::D2(_), _) => Err(unfit(config, "its shapes are flat, the new ones volumes")),
            (AnyPca::D3(_), _) => Err(unfit(config, "its shapes are volumes, the new ones flat")),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn unfit(config: ScoreConfig, reason: &str) -> CliError {
    CliError::NoResult {
        path: config.pca,
        command: "pca",
        reason: reason.into(),
    }
}

/// A new shape and its scores.
struct Measured<const D: usize> {
    /// Overlap of the shape, deformed onto the average, with the average.
    overlap: f64,
    outline: Contour<D>,
    scores: Scores,
    /// The reconstruction by the first `m` modes.
    reconstructions: Vec<Contour<D>>,
    dice: Vec<f64>,
    distance: Vec<f64>,
    matched: AverageResult<D>,
    displacement: fe_grid::VectorField<f64, D>,
}

/// The average as the target of new shapes.
struct Target<'a, const D: usize> {
    stored: &'a StoredPca<D>,
    compound: Compound<D>,
    outline: Contour<D>,
    size: f64,
    distance: ScalarField<f64, D>,
    /// On the grid of the rigid alignment.
    coarse: ScalarField<f64, D>,
    align: Align,
    scale: Size,
}

fn run<const D: usize>(
    stored: &StoredPca<D>,
    images: &[Image<D>],
    mut config: ScoreConfig,
    args: &ScoreArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    progress.stage("assembling the compound operator");
    let object = &stored.space.object;
    let align = config.align.unwrap_or(stored.average.align);
    config.align = Some(align);
    let outline = contour(object, 0.5, BoxEdge::Closed).map_err(shown)?;
    let nodes = object.grid().nodes_per_axis();
    let coarse = Grid::cube(ALIGNMENT_NODES[usize::from(D == 3)]);
    let target = Target {
        stored,
        compound: Compound::new(&stored.average.average, &stored.space.params)?,
        size: Moments::of_contour(&outline).map_err(shown)?.volume,
        distance: signed_distance(object, 0.5).map_err(shown)?,
        coarse: ContourDistance::new(&outline)
            .map_err(shown)?
            .sample(coarse),
        outline,
        align,
        scale: config.size,
    };
    let paths: Vec<&Path> = images.iter().map(|image| image.path.as_path()).collect();
    let names = labels(&paths);
    let mut found = Vec::new();
    for (image, name) in images.iter().zip(&names) {
        progress.stage(format!("deforming '{name}' onto the average"));
        found.push(target.measure(image, progress, interrupt)?);
    }
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(&args.run.output)?;
    let record = write_all(&directory, &config, &names, &found, (nodes, start))?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(Exit::Success)
}

impl<const D: usize> Target<'_, D> {
    fn measure(
        &self,
        image: &Image<D>,
        progress: &Progress,
        interrupt: Interrupt,
    ) -> Result<Measured<D>, CliError> {
        let grid = *self.distance.grid();
        let (outline, distance) = self.placed(image)?;
        let params = &self.stored.average.params;
        let levels = level_nodes(&grid.hierarchy(params.coarsest_nodes));
        let mut watch = ProgressObserver::new(progress, interrupt, levels);
        let phase_field = &self.stored.average.phase_field;
        let matched = match_to(&distance, &self.distance, phase_field, params, &mut watch)?;
        watch.finish();
        if *matched.average.grid() != grid {
            return Err(CliError::Computation {
                message: format!(
                    "'{}' was not deformed onto the average",
                    image.path.display()
                ),
                remedy: "the run was stopped; repeat it".into(),
            });
        }
        let source = Source {
            weight: 1.0,
            displacement: matched.displacements[0].as_slice(),
            indicator: matched.shapes.indicators[0].as_slice(),
        };
        let space = &self.stored.space;
        let displacement = space.represent(&self.compound, source)?;
        let scores = space.scores(&self.compound, &displacement);
        let (mut reconstructions, mut dice, mut distances) = (Vec::new(), Vec::new(), Vec::new());
        let onto = &matched.displacements[0];
        for m in 0..=scores.scores.len() {
            let u = space.synthesise(&scores.scores[..m])?;
            let back = there_and_back(&outline, onto, &u, -1.0);
            let fit = Procrustes::new(back.points(), outline.points());
            let made = fit.apply(&moved(&self.outline, &u, -1.0));
            let field = ContourDistance::new(&made).map_err(shown)?.sample(grid);
            dice.push(levelset::dice(&field, 0.0, &distance, 0.0).map_err(shown)?);
            distances.push(fit.distance);
            reconstructions.push(made);
        }
        let pushed = &matched.pushed[0];
        Ok(Measured {
            overlap: levelset::dice(pushed, 0.0, &self.distance, 0.0).map_err(shown)?,
            outline,
            scores,
            reconstructions,
            dice,
            distance: distances,
            matched,
            displacement,
        })
    }

    /// The boundary of a new shape in the box of the average, and its signed distance.
    fn placed(&self, image: &Image<D>) -> Result<(Contour<D>, ScalarField<f64, D>), CliError> {
        let grid = *self.distance.grid();
        let nodes = grid.nodes_per_axis()[0];
        let (size, frame) = &self.stored.average.frame;
        let mut frame_of = frame_like(image, (size, frame), nodes, 1.0);
        if self.scale == Size::Equal {
            let (outline, _) = place_like(image, frame_of, None, self.coarse_grid())?;
            let own = Moments::of_contour(&outline).map_err(shown)?.volume;
            frame_of = frame_of.shrunk((self.size / own).powf(1.0 / D as f64));
        }
        if self.align == Align::None {
            return place_like(image, frame_of, None, grid);
        }
        let (_, coarse) = place_like(image, frame_of, None, self.coarse_grid())?;
        let found = align_to(&self.coarse, &coarse).map_err(|error| CliError::Computation {
            message: format!("'{}' cannot be aligned: {error}", image.path.display()),
            remedy: "give --align none, if it lies as the average does".into(),
        })?;
        let rotation = found.motion.rotation();
        let translation = found.motion.translation();
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]));
        let shift = std::array::from_fn(|i| translation[i]);
        place_like(image, frame_of, Some((rows, shift)), grid)
    }

    fn coarse_grid(&self) -> Grid<D> {
        *self.coarse.grid()
    }
}

fn write_all<const D: usize>(
    directory: &ResultDir,
    config: &ScoreConfig,
    names: &[String],
    found: &[Measured<D>],
    (nodes, start): ([usize; D], Instant),
) -> Result<ScoreRecord<D>, CliError> {
    let relative = |s: &Scores| -> Vec<f64> {
        let size = s.norm.max(f64::MIN_POSITIVE);
        s.errors.iter().map(|e| e / size).collect()
    };
    let placed = Placements {
        mahalanobis: found.iter().map(|f| f.scores.mahalanobis).collect(),
        scores: found.iter().map(|f| f.scores.scores.clone()).collect(),
        residual: found.iter().map(|f| f.scores.residual()).collect(),
        errors: found.iter().map(|f| relative(&f.scores)).collect(),
        reconstruction_dice: found.iter().map(|f| f.dice.clone()).collect(),
        reconstruction_distance: found.iter().map(|f| f.distance.clone()).collect(),
        dice: found.iter().map(|f| f.overlap).collect(),
        elastic: found.iter().map(|f| f.matched.energy.elastic[0]).collect(),
    };
    for (k, shape) in found.iter().enumerate() {
        let file = directory.file(numbered("displacement", k, "npy"));
        write_field(&file, &shape.displacement, Precision::Double)?;
    }
    let scores: Vec<Scores> = found.iter().map(|f| f.scores.clone()).collect();
    write_scores(&directory.file("scores.csv"), names, &scores)?;
    write_reconstruction(
        &directory.file("reconstruction.svg"),
        names,
        &placed.errors,
        &placed.reconstruction_distance,
    )?;
    picture(names, found).write_png(&directory.file("score.png"))?;
    let record = ScoreRecord::new("complete", &nodes, config, placed, start);
    record.write(directory.path())?;
    Ok(record)
}

/// Every shape with its reconstructions by some and by all modes.
fn picture<const D: usize>(names: &[String], found: &[Measured<D>]) -> Canvas {
    let (mut shapes, mut words): (Vec<(&Contour<D>, Colour)>, Vec<String>) = Default::default();
    for (k, (name, shape)) in names.iter().zip(found).take(SHOWN).enumerate() {
        let all = shape.reconstructions.len() - 1;
        let some = all.div_ceil(2);
        shapes.push((&shape.outline, colour(k)));
        words.push(format!("{name}, d {:.2}", shape.scores.mahalanobis));
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

/// Prints the summary on standard output; the last line names the picture.
fn print<const D: usize>(record: &ScoreRecord<D>, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &ScoreRecord<D>,
    target: &Path,
) -> std::fmt::Result {
    let (shapes, found) = (&record.parameters.inputs, &record.body);
    writeln!(
        text,
        "{} shapes scored in {:.1} s",
        shapes.len(),
        record.seconds
    )?;
    for (k, shape) in shapes.iter().enumerate() {
        writeln!(
            text,
            "  {}: Mahalanobis distance {:.3}, residual {:.1} %, matched with Dice {:.4}",
            shape.display(),
            found.mahalanobis[k],
            100.0 * found.residual[k],
            found.dice[k]
        )?;
    }
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("score.png"))
}
