//! Development tasks: `cargo xtask NAME`.

#[cfg(feature = "study")]
mod study;
mod tidy;

use std::process::ExitCode;

/// The tasks, one file each.
const TASKS: &str = "tasks:
  tidy   check the rules that no compiler checks
  study  measure averages of built-in and real shapes (study --help)";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("tidy") => tidy::run(),
        Some("study") => study(&arguments.collect::<Vec<_>>()),
        Some(other) => {
            eprintln!("there is no task {other}\n{TASKS}");
            ExitCode::from(2)
        }
        None => {
            eprintln!("{TASKS}");
            ExitCode::from(2)
        }
    }
}

#[cfg(feature = "study")]
fn study(arguments: &[String]) -> ExitCode {
    study::run(arguments)
}

/// Builds this program again with all that the study needs, and runs that.
#[cfg(not(feature = "study"))]
fn study(arguments: &[String]) -> ExitCode {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = std::process::Command::new(cargo)
        .args([
            "run",
            "--release",
            "--package",
            "xtask",
            "--features",
            "study",
            "--",
            "study",
        ])
        .args(arguments)
        .status();
    match status {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("cargo cannot be started: {error}");
            ExitCode::FAILURE
        }
    }
}
