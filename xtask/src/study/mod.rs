//! The study: measurements of averages with known results, of both solvers, and of real shapes; of
//! modes of variation; and of geodesics.
//!
//! Every measured value is listed with its requirement. Real shapes are averaged by the program
//! itself, with the printed command.

#[path = "../../../shape-average/tests/support/angle.rs"]
mod angle;
mod clusters;
mod joint;
mod known;
mod modes;
mod occlusion;
mod paths;
mod photographs;
mod real;
mod shapes;
mod solvers;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::outcome::Outcome;
use crate::table::Table;

/// The sections, in the order of the help.
const SECTIONS: [&str; 11] = [
    "known",
    "solvers",
    "flat",
    "solid",
    "modes",
    "letters",
    "triangles",
    "materials",
    "occlusion",
    "clusters",
    "joint",
];

const HELP: &str = "cargo xtask study [SECTION ...] [--shared DIR] [--write]

sections (all where none is named):
  known    averages whose result is known, on shapes drawn by the program
  solvers  iterations on every level, and the descent against L-BFGS
  flat     real shapes in 2D: device7, hands, the letter A
  solid    real shapes in 3D: hippocampi
  modes    modes of variation of drawn and of real shapes; hands beside their landmarks
  letters, triangles, materials, occlusion
           the notes' tables of geodesics, on shapes drawn by the program
  clusters distances of real shapes (an hour)
  joint    noisy images, segmented alone and jointly with their average; real images jointly

--shared DIR  the folder that holds `data`; without it, a folder `shared` beside the project.
              What needs data is left out where there are none.
--write       also write docs/study/SECTION.md";

/// A part of the study: a heading, what it is about, and a table.
struct Section {
    title: &'static str,
    text: &'static str,
    table: Table,
}

/// What was asked for.
struct Options {
    sections: Vec<&'static str>,
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
            name => {
                let section = SECTIONS.iter().find(|section| **section == name);
                let section = section.ok_or(format!("there is no section {name}"))?;
                options.sections.push(section);
            }
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
    if options.data.is_none() {
        eprintln!("no folder of real data (--shared): what needs it is left out");
    }
    let asked = if options.sections.is_empty() {
        &SECTIONS
    } else {
        options.sections.as_slice()
    };
    for name in asked {
        let mut report = format!(
            "<!-- Made by `cargo xtask study {name} --write`. -->\n\nA figure that misses what is \
             asked of it is marked with **!**.\n"
        );
        let sections = sections(name, options.data.as_deref())?;
        for section in &sections {
            let mut text = String::new();
            writeln!(
                text,
                "\n# {}\n\n{}\n\n{}",
                section.title, section.text, section.table
            )?;
            print!("{text}");
            report.push_str(text.trim_end_matches('\n'));
            report.push('\n');
        }
        if options.write && !sections.is_empty() {
            let folder = root().join("docs/study");
            std::fs::create_dir_all(&folder)?;
            std::fs::write(folder.join(format!("{name}.md")), report)?;
        }
    }
    Ok(())
}

/// What is measured under a name: nothing where that needs data and there are none.
fn sections(name: &str, data: Option<&Path>) -> Outcome<Vec<Section>> {
    Ok(match (name, data) {
        ("known", _) => vec![known::section()?],
        ("solvers", data) => {
            let groups = solvers::groups(data)?;
            vec![
                solvers::iterations(&groups),
                solvers::against_descent(&groups)?,
            ]
        }
        ("flat", Some(data)) => vec![real::flat(data)?],
        ("solid", Some(data)) => vec![real::solid(data)?],
        ("modes", None) => vec![modes::section(None)?],
        ("modes", Some(data)) => vec![modes::section(Some(data))?, modes::landmarks(data)?],
        ("letters", _) => vec![paths::letters()?],
        ("triangles", _) => vec![paths::triangles()?],
        ("materials", _) => vec![paths::materials()?],
        ("occlusion", _) => vec![occlusion::section()?],
        ("joint", None) => vec![joint::section()?],
        ("joint", Some(data)) => vec![joint::section()?, photographs::section(data)?],
        ("clusters", Some(data)) => vec![clusters::section(data)?],
        _ => Vec::new(),
    })
}

/// The folder of the workspace.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).into()
}
