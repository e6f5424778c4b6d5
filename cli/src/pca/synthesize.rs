//! `shapespace synthesize`: computes a shape from its scores.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use fe_grid::{ScalarField, VectorField, certify_within};
use levelset::{BoxEdge, Contour, ContourDistance, Moments, contour};
use shape_pca::{Compound, Finite, FiniteReport};

use super::args::{SynthesizeArgs, SynthesizeConfig};
use super::draw::{moved, shown};
use super::read::{AnyPca, StoredPca, read_pca};
use super::record::{Synthesis, SynthesisRecord};
use crate::error::{CliError, Exit};
use crate::geodesic::draw::portraits;
use crate::output::ResultDir;
use crate::output::npy::{Precision, write_field, write_mask};
use crate::output::stl::write_surface;
use crate::picture::{Canvas, INK, Shape, Tiles, colour};
use crate::pool::in_pool;
use crate::progress::Progress;

/// Runs `shapespace synthesize`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_synthesize(args: &SynthesizeArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let progress = Progress::stderr();
    let compute = |config: SynthesizeConfig| {
        ResultDir::create(&args.run.output).map(drop)?;
        progress.stage("reading the modes");
        match read_pca(&config.pca, config.average.as_deref())? {
            AnyPca::D2(stored) => run(&stored, &config, args, &progress, start),
            AnyPca::D3(stored) => run(&stored, &config, args, &progress, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run<const D: usize>(
    stored: &StoredPca<D>,
    config: &SynthesizeConfig,
    args: &SynthesizeArgs,
    progress: &Progress,
    start: Instant,
) -> Result<Exit, CliError> {
    let modes = stored.space.fields.len();
    if config.scores.len() > modes {
        return Err(CliError::Option {
            option: "--scores",
            value: format!("with {} numbers", config.scores.len()),
            remedy: format!("there are {modes} modes: give at most one score for each"),
        });
    }
    // `S_k` is about `(1 - u_k)(S)`.
    let mut displacement = stored.space.synthesise(&config.scores)?;
    fe_grid::vector::scale(-1.0, displacement.as_mut_slice());
    let mut report = None;
    if config.nonlinear {
        progress.stage("solving the nonlinear elastic problem");
        let compound = Compound::new(&stored.average.average, &stored.space.params)?;
        let load = compound.apply(displacement.as_slice());
        let mut problem = Finite::new(&stored.average.average, &compound);
        problem.load_steps = config.load_steps;
        let found = problem.respond(&load)?;
        displacement = found.0;
        report = Some(found.1);
    }
    progress.stage("writing");
    let outline = contour(&stored.space.object, 0.5, BoxEdge::Closed).map_err(shown)?;
    let shape = moved(&outline, &displacement, 1.0);
    let level_set = ContourDistance::new(&shape)
        .map_err(shown)?
        .sample(*stored.space.object.grid());
    let directory = ResultDir::create(&args.run.output)?;
    write_arrays(&directory, &level_set, &displacement)?;
    let pictures = portraits(&[(&outline, INK), (&shape, colour(0))]);
    let names = ["average".to_owned(), "shape".to_owned()];
    let tiles: Vec<(String, Canvas)> = names.into_iter().zip(pictures).collect();
    let sheet = Tiles {
        tiles: &tiles,
        columns: 2,
        side: 360,
    };
    sheet.draw().write_png(&directory.file("shape.png"))?;
    if D == 3 {
        write_surface(&directory.file("shape.stl"), Shape::of(&shape).surface())?;
    }
    let record = record(
        stored,
        config,
        &displacement,
        [&shape, &outline],
        report,
        start,
    )?;
    record.write(directory.path())?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(Exit::Success)
}

fn write_arrays<const D: usize>(
    directory: &ResultDir,
    level_set: &ScalarField<f64, D>,
    displacement: &VectorField<f64, D>,
) -> Result<(), CliError> {
    let double = Precision::Double;
    write_field(&directory.file("shape.npy"), level_set, double)?;
    write_field(&directory.file("displacement.npy"), displacement, double)?;
    let mask: Vec<bool> = level_set.as_slice().iter().map(|&d| d > 0.0).collect();
    let size = level_set.grid().nodes_per_axis();
    Ok(write_mask(&directory.file("shape_mask.npy"), &mask, &size)?)
}

fn record<const D: usize>(
    stored: &StoredPca<D>,
    config: &SynthesizeConfig,
    displacement: &VectorField<f64, D>,
    [shape, average]: [&Contour<D>; 2],
    report: Option<FiniteReport>,
    start: Instant,
) -> Result<SynthesisRecord<D>, CliError> {
    let size = |c: &Contour<D>| Ok::<_, CliError>(Moments::of_contour(c).map_err(shown)?.volume);
    let object = &stored.space.object;
    let grid = *object.grid();
    let inside: Vec<bool> = (0..grid.n_cells())
        .map(|cell| object.as_slice()[grid.node_index(grid.cell(cell))] > 0.5)
        .collect();
    let u = displacement.as_slice();
    let certificate = certify_within(&grid, u, 0.0, f64::INFINITY, Some(&inside));
    let sum: f64 = config.scores.iter().map(|s| s * s).sum();
    let share = report.as_ref().map_or(1.0, |report| report.share);
    let found = Synthesis {
        load_share: share,
        iterations: report.map_or_else(Vec::new, |report| {
            report.steps.iter().map(|step| step.iterations).collect()
        }),
        mahalanobis: (sum / stored.space.n_shapes as f64).sqrt(),
        min_det: certificate.min_det,
        size: size(shape)?,
        average_size: size(average)?,
    };
    let reached = share >= 1.0;
    let status = if reached {
        "complete"
    } else {
        "load_not_reached"
    };
    Ok(SynthesisRecord::new(
        status,
        &grid.nodes_per_axis(),
        config,
        found,
        start,
    ))
}

/// Prints the summary on standard output; the last line names the picture.
fn print<const D: usize>(record: &SynthesisRecord<D>, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &SynthesisRecord<D>,
    target: &Path,
) -> std::fmt::Result {
    let found = &record.body;
    writeln!(
        text,
        "Shape of scores {:?}: Mahalanobis distance {:.3}, size {:.4} ({:.4} of the average)",
        record.parameters.scores,
        found.mahalanobis,
        found.size,
        found.size / found.average_size
    )?;
    if found.load_share < 1.0 {
        writeln!(
            text,
            "  load         only {:.0} % of it was reached; try more --load-steps",
            100.0 * found.load_share
        )?;
    }
    if found.min_det <= 0.0 {
        writeln!(
            text,
            "  warning      the displacement folds: smaller scores, or --nonlinear"
        )?;
    }
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("shape.png"))
}
