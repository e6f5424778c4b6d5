//! `shapespace figure`: figures and tables about averages and modes, each reproduced by one
//! command, on built-in shapes or on the user's own.
//!
//! `scene` holds the shapes and averages them, `drawn` has the built-in shapes, `sheet` is the
//! content of a figure; every other file has the figures of one subject.

mod args;
mod averages;
mod bends;
mod drawn;
mod force;
mod inverse;
mod missing;
mod modes;
mod scene;
mod sheet;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use hyperelastic::LawSpec;
use serde::Serialize;
use shapespace_report::table::Table;

pub use args::{FigureArgs, FigureConfig, FigureName};

use crate::average::write_inputs;
use crate::error::{CliError, Exit};
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::options::check_law;
use crate::output::{ResultDir, write_json, write_text};
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Placed, prepare};
use crate::watch::Interrupt;
use scene::Scene;
use sheet::Sheet;

/// Everything in `result.json`.
#[derive(Clone, Debug, Serialize)]
struct FigureRecord<'a> {
    version: &'static str,
    status: &'static str,
    figure: FigureName,
    title: &'static str,
    text: &'a str,
    dimension: usize,
    nodes: Vec<usize>,
    inputs: Vec<PathBuf>,
    tolerance: f64,
    law: LawSpec,
    table: &'a Table,
    seconds: f64,
}

/// Runs `shapespace figure`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_figure(args: &FigureArgs) -> Result<Exit, CliError> {
    args.config.run(|config| figure(config, args))
}

fn figure(config: FigureConfig, args: &FigureArgs) -> Result<Exit, CliError> {
    ResultDir::check(&args.run.output)?;
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.run.threads, || {
        if config.inputs.is_empty() {
            let folder = args.run.output.join("inputs");
            let images = drawn::images(args.name, config.masks.nodes::<2>()?, &folder);
            return run(images, true, config, args, &progress, interrupt);
        }
        let needed = args.name.fewest();
        if config.inputs.len() < needed {
            return Err(CliError::TooFewInputs {
                command: "figure",
                needed,
                found: config.inputs.len(),
            });
        }
        progress.stage(format!("reading {} masks", config.inputs.len()));
        let options = ReadOptions {
            label: config.masks.label,
        };
        match read_images(&config.inputs, &options)? {
            AnyImages::D2(images) => run(images, false, config, args, &progress, interrupt),
            AnyImages::D3(images) => run(images, false, config, args, &progress, interrupt),
        }
    })
}

fn run<const D: usize>(
    images: Vec<Image<D>>,
    own: bool,
    mut config: FigureConfig,
    args: &FigureArgs,
    progress: &Progress,
    interrupt: Interrupt,
) -> Result<Exit, CliError> {
    let start = Instant::now();
    let output = args.run.output.as_path();
    ResultDir::create(output).map(drop)?;
    check_law::<D>(&config.law)?;
    let params = config.params();
    let law = params.law;
    let drawn = own.then(|| images.clone());
    let (inputs, distances) = prepare(Placed::new(images, &mut config.masks)?, &[], progress)?;
    let scene = Scene {
        names: inputs.iter().map(|input| input.name.clone()).collect(),
        distances,
        params,
        progress,
        interrupt,
    };
    let sheet = made(args.name, &scene)?;
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(output)?;
    if let Some(drawn) = drawn {
        write_inputs(&directory, &drawn)?;
    }
    sheet.picture.write_png(&directory.file("figure.png"))?;
    write_text(&directory.file("table.csv"), &sheet.table.csv())?;
    let page = format!(
        "# {}\n\n{}\n\n{}\n![{}](figure.png)\n",
        sheet.title,
        sheet.text,
        sheet.table.markdown(),
        sheet.title
    );
    write_text(&directory.file("figure.md"), &page)?;
    let record = FigureRecord {
        version: env!("CARGO_PKG_VERSION"),
        status: "done",
        figure: args.name,
        title: sheet.title,
        text: &sheet.text,
        dimension: D,
        nodes: scene.grid().nodes_per_axis().to_vec(),
        inputs: inputs.iter().map(|input| input.path.clone()).collect(),
        tolerance: config.tolerance,
        law,
        table: &sheet.table,
        seconds: start.elapsed().as_secs_f64(),
    };
    write_json(&directory.file("result.json"), &record)?;
    let target = directory.commit()?;
    progress.finish();
    print(&sheet, &target, record.seconds);
    Ok(Exit::Success)
}

fn made<const D: usize>(name: FigureName, scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    match name {
        FigureName::Weights => averages::weights(scene),
        FigureName::Median => averages::median(scene),
        FigureName::ForceBalance => force::force_balance(scene),
        FigureName::ElasticDomain => averages::elastic_domain(scene),
        FigureName::Stiffness => averages::stiffness(scene),
        FigureName::AddingShapes => averages::adding_shapes(scene),
        FigureName::MismatchWeight => averages::mismatch_weight(scene),
        FigureName::LargeBends => bends::large_bends(scene),
        FigureName::MissingParts => missing::missing_parts(scene),
        FigureName::InverseModel => inverse::inverse_model(scene),
        FigureName::Pins => modes::pins(scene),
        FigureName::Modes => modes::modes(scene),
    }
}

fn print(sheet: &Sheet, target: &Path, seconds: f64) {
    let text = format!(
        "{}, {seconds:.1} s\n{}  results  {}\n  picture  {}\n",
        sheet.title,
        sheet.table.aligned("  "),
        target.join("figure.md").display(),
        target.join("figure.png").display()
    );
    // A closed standard output is not an error.
    let _ = std::io::stdout().write_all(text.as_bytes());
}
