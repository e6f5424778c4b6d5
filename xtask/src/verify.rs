//! `cargo xtask verify`: runs all of `shapespace verify`, and writes its results as documents.
//!
//! Runs the program on all statements, sound and with broken ingredients, and replaces
//! `docs/verification` by the results: a table of each, the figures as JSON, and the plots.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const HELP: &str = "cargo xtask verify [--quick]

Runs `shapespace verify` and `shapespace verify --broken` on all statements (--quick: on the
smaller experiments), and writes docs/verification.";

/// Where the results belong.
const FOLDER: &str = "docs/verification";

/// What stands over the table.
const HEAD: &str = "<!-- Made by `cargo xtask verify`. -->

# Theory, verified by runs

What `shapespace verify` finds of the definitions, lemmas, theorems and claims of the lecture notes.
Hypotheses are those of the statement, answered for the law and the shapes that are used; where one
is not met the statement says nothing of the case. Expected figures and their tolerances, with the
reasons for them, are in [result.json](result.json). The same experiments with one wrong ingredient
each are in [broken.md](broken.md): all must end refuted.
";

const BROKEN_HEAD: &str = "<!-- Made by `cargo xtask verify`. -->

# The same with broken ingredients

Each experiment of the [verification](README.md) is made again with one wrong ingredient, by the same
code. A verdict that could not fail would be worth nothing: all must end refuted. **≠** marks the
figures that tell.
";

/// Runs the task.
pub fn run(arguments: &[String]) -> ExitCode {
    let quick = match arguments {
        [] => false,
        [one] if one == "--quick" => true,
        _ => {
            println!("{HELP}");
            return ExitCode::from(u8::from(!arguments.iter().any(|a| a == "--help")) * 2);
        }
    };
    match verify(quick) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("the verification cannot be made: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Whether all statements ended as they should.
fn verify(quick: bool) -> io::Result<bool> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.parent().unwrap_or(here);
    let work = std::env::temp_dir().join(format!("shapespace-verify-{}", std::process::id()));
    fs::create_dir_all(&work)?;
    let (sound, broken) = (work.join("sound"), work.join("broken"));
    let well = shapespace(root, &sound, quick, false)? & shapespace(root, &broken, quick, true)?;
    let folder = root.join(FOLDER);
    if folder.is_dir() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(folder.join("plots"))?;
    fs::copy(sound.join("result.json"), folder.join("result.json"))?;
    let mut text = format!("{HEAD}\n{}", fs::read_to_string(sound.join("table.md"))?);
    text.push_str("\n## Plots\n\nDashed are the orders that are expected.\n\n");
    for plot in plots(&sound.join("plots"))? {
        let name = plot.file_name().unwrap_or_default();
        fs::copy(&plot, folder.join("plots").join(name))?;
        let name = name.to_string_lossy();
        let title = name.trim_end_matches(".svg");
        // Writing into a string cannot fail.
        let _ = writeln!(text, "![{title}](plots/{name})");
    }
    fs::write(folder.join("README.md"), text)?;
    let table = fs::read_to_string(broken.join("table.md"))?;
    fs::write(folder.join("broken.md"), format!("{BROKEN_HEAD}\n{table}"))?;
    fs::remove_dir_all(&work)?;
    println!("wrote {FOLDER}");
    Ok(well)
}

/// Runs the program; false where statements ended as they should not.
fn shapespace(root: &Path, output: &Path, quick: bool, broken: bool) -> io::Result<bool> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .current_dir(root)
        .args([
            "run",
            "--release",
            "--package",
            "shapespace",
            "--",
            "verify",
        ])
        .arg("-o")
        .arg(output);
    for (option, wanted) in [("--quick", quick), ("--broken", broken)] {
        if wanted {
            command.arg(option);
        }
    }
    let status = command.status()?;
    if !output.is_dir() {
        return Err(io::Error::other(format!("the program ended with {status}")));
    }
    Ok(status.success())
}

/// The plots of a run, by name.
fn plots(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut plots: Vec<PathBuf> = fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()?;
    plots.sort();
    Ok(plots)
}
