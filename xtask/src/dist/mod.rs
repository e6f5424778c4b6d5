//! `cargo xtask dist`: everything that a release consists of, in one folder, and a list of what has been
//! checked.
//!
//! `checklist` compares versions and dates, `program` makes the archive of the program with `completions`
//! and manual pages, `guide` that of the guide, `wheel` the Python package, `crates` what the registry of
//! Rust gets; `sums` writes the checksums of all files. What needs a program that is not installed is left
//! out, with the command that installs it.

mod archive;
mod checklist;
mod completions;
mod crates;
mod guide;
mod program;
mod step;
mod sums;
mod wheel;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use step::{Step, Steps};

const HELP: &str = "\
cargo xtask dist [--output DIR] [--check] [--no-verify]
  --output DIR  where the files of the release are written [default: target/dist]
  --check       only compare versions and dates
  --no-verify   do not compile the crates from their packages";

/// The options.
struct Options {
    output: PathBuf,
    check: bool,
    verify: bool,
}

/// Makes a release.
pub fn run(arguments: &[String]) -> ExitCode {
    if arguments.iter().any(|a| a == "--help") {
        println!("{HELP}");
        return ExitCode::SUCCESS;
    }
    let options = match parsed(arguments) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}\n{HELP}");
            return ExitCode::from(2);
        }
    };
    let mut steps = Steps::default();
    checklist::run(&mut steps);
    if !options.check {
        match make(&options, &mut steps) {
            Ok(()) => {}
            Err(error) => steps.add("output", Step::Failed(error.to_string())),
        }
    }
    print!("\n{steps}");
    if steps.has_failed() {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}

fn make(options: &Options, steps: &mut Steps) -> std::io::Result<()> {
    let output = &options.output;
    fs::create_dir_all(output)?;
    let version = checklist::version();
    steps.add("program", program::make(output, &version));
    steps.add("guide", guide::make(output, &version));
    steps.add("wheel", wheel::make(output));
    crates::run(options.verify, steps);
    steps.add("checksums", sums::write(output));
    Ok(())
}

fn parsed(arguments: &[String]) -> Result<Options, String> {
    let mut options = Options {
        output: crate::tidy::root().join("target/dist"),
        check: false,
        verify: true,
    };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--output" => {
                let folder = rest.next().ok_or("--output needs a folder")?;
                options.output = folder.into();
            }
            "--check" => options.check = true,
            "--no-verify" => options.verify = false,
            other => return Err(format!("there is no option {other}")),
        }
    }
    Ok(options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_is_no_error() {
        assert_eq!(run(&["--help".into()]), ExitCode::SUCCESS);
        assert_eq!(run(&["--nonsense".into()]), ExitCode::from(2));
    }
}
