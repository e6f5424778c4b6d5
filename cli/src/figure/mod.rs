//! `shapespace figure`: figures and tables about averages, modes and paths, each reproduced by one
//! command, on built-in shapes or on the user's own.
//!
//! `scene` holds the shapes and averages them, `paths` computes paths between them, `drawn` has the built-in
//! shapes, `sheet` is the content of a figure; every other file has the figures of one subject.

mod args;
mod averages;
mod bends;
mod components;
mod drawn;
mod fluids;
mod force;
mod inverse;
mod minima;
mod missing;
mod modes;
mod paths;
mod related;
mod scene;
mod sheet;
mod steps;

use std::cell::RefCell;
use std::fmt::Write as _;

use fe_grid::Grid;
use levelset::Doubt;
use serde::Serialize;
use shapespace_report::table::Table;

pub use args::{FigureArgs, FigureConfig, FigureName};
pub(crate) use drawn::drawn_image;

use crate::average::write_inputs;
use crate::doubts::{in_words, named};
use crate::error::{CliError, Exit};
use crate::fingerprint::{Fingerprint, hash};
use crate::memory::announce;
use crate::options::{at_least, resolve_law};
use crate::output::{OutputError, ResultDir, write_text};
use crate::report::Record;
use crate::session::{self, Command, PlanOf, Session};
use crate::shapes::{Components, InputRecord, Placed, doubts_of, prepare, records_of};
use crate::summary::Summary;
use scene::Scene;
use shapespace_input::Image;
use shapespace_input::dimension::{Dim, per_dimension};
use sheet::Sheet;

/// Why the box of the grid is not one of the options.
const DRAWN: &str = "the built-in shapes are drawn in a square";

/// A figure that is drawn.
struct Figure {
    name: FigureName,
    config: FigureConfig,
}

/// The shapes of a figure.
struct Plan<const D: usize> {
    placed: Placed<D>,
    /// The components of the shapes, of the figure about these.
    parts: Option<Components<D>>,
    config: FigureConfig,
    /// The built-in shapes, to be written to the folder `inputs`.
    drawn: Option<Vec<Image<D>>>,
    fingerprint: Fingerprint,
}

/// A figure and its shapes.
struct Outcome<const D: usize> {
    sheet: Sheet,
    doubts: Vec<Doubt>,
    inputs: Vec<InputRecord<D>>,
    config: FigureConfig,
    grid: Grid<D>,
    drawn: Option<Vec<Image<D>>>,
}

/// The contents of a figure in `result.json`.
#[derive(Clone, Debug, Serialize)]
struct Contents<'a> {
    figure: FigureName,
    title: &'static str,
    text: &'a str,
    table: &'a Table,
}

/// Runs `shapespace figure`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_figure(args: &FigureArgs) -> Result<Exit, CliError> {
    let name = args.name;
    session::logged(&args.run, || {
        args.config
            .run(|config| session::run(&Figure { name, config }, &args.run, args.checkpoint))
    })
}

impl Command for Figure {
    type Plan<const D: usize> = Plan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        let config = self.config.clone();
        if config.inputs.is_empty() {
            let folder = session.output.join("inputs");
            let images = drawn::images(self.name, config.masks.longest_side::<2>(DRAWN)?, &folder);
            let drawn = Some(images.clone());
            let parts = (self.name == FigureName::Components)
                .then(|| components::parts(images[0].size[0], &folder));
            return Plan::new(self.name, images, parts, config, drawn).map(Dim::D2);
        }
        let ([needed, most], found) = (self.name.counts(), config.inputs.len());
        at_least(needed, "figure", &config.inputs)?;
        if found > most {
            return Err(CliError::Option {
                option: "INPUT",
                value: format!("with {found} masks"),
                remedy: format!("the figure shows {needed} to {most} shapes"),
            });
        }
        session.progress.stage(format!("reading {found} masks"));
        if self.name == FigureName::Components {
            let images = session.sources.read_label_images(&config.inputs)?;
            return Ok(per_dimension!(images, images => {
                let (images, parts) = Components::each(&images)?;
                Plan::new(self.name, images, Some(parts), config, None)?
            }));
        }
        let images = session
            .sources
            .read_images(&config.inputs, &config.masks.reading())?;
        Ok(per_dimension!(images, images => Plan::new(self.name, images, None, config, None)?))
    }

    fn compute<const D: usize>(
        &self,
        plan: Plan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let checkpointer = session.checkpointer(plan.fingerprint)?;
        let (inputs, distances) = prepare(plan.placed, &[], &session.progress, &session.processes)?;
        let mut parts = Vec::new();
        for (number, input) in inputs.iter().enumerate() {
            if let Some(components) = &plan.parts {
                parts.extend(components.distances(number, input, *distances[0].grid())?);
            }
        }
        let scene = Scene {
            names: inputs.iter().map(|input| input.name.clone()).collect(),
            distances,
            labels: plan.parts.map(|parts| parts.labels).unwrap_or_default(),
            parts,
            params: plan.config.params(),
            doubts: RefCell::new(doubts_of(&inputs)),
            groups: match plan.drawn {
                Some(_) => drawn::groups(self.name),
                None => vec![inputs.len()],
            },
            session,
            checkpointer: RefCell::new(checkpointer),
        };
        announce(scene.memory(), &scene.grid(), &session.progress)?;
        let sheet = sheet(self.name, &scene);
        let doubts = scene.doubts.take();
        let grid = scene.grid();
        // Also after an interruption, from which the same command goes on.
        session.ended(scene.checkpointer.into_inner());
        Ok(Outcome {
            sheet: sheet?,
            doubts,
            inputs: records_of(&inputs),
            config: plan.config,
            grid,
            drawn: plan.drawn,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        if let Some(drawn) = &outcome.drawn {
            write_inputs(directory, drawn)?;
        }
        let sheet = &outcome.sheet;
        let (title, text, table) = (sheet.title, &sheet.text, &sheet.table);
        let file = directory.file("figure.png");
        sheet
            .picture
            .write_png(&file)
            .map_err(OutputError::at(&file))?;
        write_text(&directory.file("table.csv"), &table.csv())?;
        let contents = Contents {
            figure: self.name,
            title,
            text,
            table,
        };
        let (grid, start) = (Some(&outcome.grid), session.start);
        let doubts = named(
            &outcome.doubts,
            outcome.inputs.iter().map(|input| &*input.name),
        );
        let markdown = table.markdown();
        let mut page = format!("# {title}\n\n{text}\n\n{markdown}\n![{title}](figure.png)\n");
        if !doubts.is_empty() {
            page.push_str("\nThe result is doubtful:\n\n");
            for line in in_words(&doubts) {
                let _ = writeln!(page, "- {line}");
            }
        }
        write_text(&directory.file("figure.md"), &page)?;
        let record: Record<_, _, D> =
            Record::new("done", grid, &outcome.config, contents, doubts, start)
                .of(outcome.inputs.clone());
        record.write(directory)?;
        let heading = format!("{title}, {:.1} s\n{}", record.seconds, table.aligned("  "));
        let mut summary = Summary::new(&record, "figure.png", heading.trim_end().into());
        summary.results = "figure.md";
        Ok(summary)
    }
}

impl<const D: usize> Plan<D> {
    fn new(
        name: FigureName,
        images: Vec<Image<D>>,
        parts: Option<Components<D>>,
        mut config: FigureConfig,
        drawn: Option<Vec<Image<D>>>,
    ) -> Result<Self, CliError> {
        resolve_law::<D>(&mut config.law)?;
        let hashes: Vec<String> = images.iter().map(hash).collect();
        let placed = Placed::new(images, &mut config.masks)?;
        let name = std::iter::once(format!("{name:?}"));
        Ok(Self {
            placed,
            parts,
            fingerprint: Fingerprint::new(&config, hashes).and(name),
            config,
            drawn,
        })
    }
}

fn sheet<const D: usize>(name: FigureName, scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
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
        FigureName::Components => components::components(scene),
        FigureName::Pins => modes::pins(scene),
        FigureName::Modes => modes::modes(scene),
        FigureName::Related => related::related(scene),
        FigureName::Steps => steps::steps(scene),
        FigureName::Fluids => fluids::fluids(scene),
        FigureName::Minima => minima::minima(scene),
    }
}
