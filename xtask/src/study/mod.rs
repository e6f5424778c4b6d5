//! The study: figures of averages whose result is known, of both solvers, and of real shapes; of
//! modes of variation; and of geodesics.
//!
//! Every figure stands beside what is asked of it. Real shapes are averaged by the program
//! itself, with the command that is printed.

#[path = "../../../shape-average/tests/support/angle.rs"]
mod angle;
mod known;
mod modes;
mod paths;
mod real;
mod shapes;
mod solvers;

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::table::Table;

const HELP: &str = "cargo xtask study [SECTION ...] [--shared DIR] [--write]

sections (all where none is named):
  known    averages whose result is known, on shapes drawn by the program
  solvers  iterations on every level, and the descent against L-BFGS
  flat     real shapes in 2D: device7, hands, the letter A
  solid    real shapes in 3D: hippocampi
  modes    modes of variation of drawn and of real shapes; hands beside their landmarks
  letters, triangles, materials
           the notes' tables of geodesics, on shapes drawn by the program

--shared DIR  the folder that holds `data`; without it, a folder `shared` beside the project.
              What needs data is left out where there are none.
--write       also write docs/study.md";

/// A part of the study: a heading, what it is about, and a table.
struct Section {
    title: &'static str,
    text: &'static str,
    table: Table,
}

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// What was asked for.
struct Options {
    sections: Vec<String>,
    data: Option<PathBuf>,
    write: bool,
}

/// Runs the study and prints its tables.
pub fn run(arguments: &[String]) -> ExitCode {
    if arguments.iter().any(|a| a == "--help" || a == "-h") {
        println!("{HELP}");
        return ExitCode::SUCCESS;
    }
    match parse(arguments).and_then(|options| measure(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}\n\n{HELP}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Outcome<Options> {
    let mut options = Options {
        sections: Vec::new(),
        data: None,
        write: false,
    };
    let mut shared = None;
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--write" => options.write = true,
            "--shared" => {
                shared = Some(PathBuf::from(
                    arguments.next().ok_or("--shared needs a folder")?,
                ));
            }
            "known" | "solvers" | "flat" | "solid" | "modes" | "letters" | "triangles"
            | "materials" => {
                options.sections.push(argument.clone());
            }
            other => return Err(format!("there is no section {other}").into()),
        }
    }
    options.data = match shared {
        Some(folder) => Some(folder.join("data")),
        None => Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .map(|above| above.join("shared/data"))
            .find(|folder| folder.is_dir()),
    };
    Ok(options)
}

fn measure(options: &Options) -> Outcome<()> {
    let asked =
        |name: &str| options.sections.is_empty() || options.sections.iter().any(|s| s == name);
    let mut report = String::from(
        "# Study\n\nMade by `cargo xtask study --write`. A figure that misses what is asked of it \
         is marked with **!**.\n",
    );
    let mut add = |section: Section| -> Outcome<()> {
        let mut text = String::new();
        writeln!(
            text,
            "\n## {}\n\n{}\n\n{}",
            section.title, section.text, section.table
        )?;
        print!("{text}");
        report.push_str(&text);
        Ok(())
    };
    if options.data.is_none() {
        eprintln!("no folder of real data (--shared): what needs it is left out");
    }
    if asked("known") {
        add(known::section()?)?;
    }
    if asked("solvers") {
        let groups = solvers::groups(options.data.as_deref())?;
        add(solvers::iterations(&groups))?;
        add(solvers::against_descent(&groups)?)?;
    }
    if let Some(data) = &options.data {
        if asked("flat") {
            add(real::flat(data)?)?;
        }
        if asked("solid") {
            add(real::solid(data)?)?;
        }
    }
    if asked("modes") {
        add(modes::section(options.data.as_deref())?)?;
        if let Some(data) = &options.data {
            add(modes::landmarks(data)?)?;
        }
    }
    for (name, section) in [
        ("letters", paths::letters as fn() -> Outcome<Section>),
        ("triangles", paths::triangles),
        ("materials", paths::materials),
    ] {
        if asked(name) {
            add(section()?)?;
        }
    }
    if options.write {
        let docs = root().join("docs");
        std::fs::create_dir_all(&docs)?;
        std::fs::write(docs.join("study.md"), report)?;
    }
    Ok(())
}

/// The folder of the workspace.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).into()
}
