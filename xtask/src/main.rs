//! Development tasks: `cargo xtask NAME`.

#![forbid(unsafe_code)]

#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "book")]
mod book;
#[cfg(any(feature = "bench", feature = "study"))]
mod descent;
#[cfg(feature = "dist")]
mod dist;
mod figures;
mod fuzz;
mod kills;
mod mutants;
#[cfg(any(feature = "bench", feature = "study"))]
mod outcome;
mod sanitize;
#[cfg(feature = "study")]
mod study;
#[cfg(any(feature = "bench", feature = "study"))]
mod table;
mod tidy;
mod verify;

use std::process::ExitCode;

/// The tasks, one file each.
const TASKS: &str = "tasks:
  tidy     check the rules that no compiler checks
  book     build the guide of docs/book with mdBook
  figures  regenerate docs/figures, or the named figures (real: those of files in ../shared/data)
  study    measure averages of built-in and real shapes (study --help)
  bench    measure speed: kernels, averages, other programs (bench --help)
  sanitize run the tests of fe-grid under sanitizers and Miri (sanitize --help)
  verify   check the theory by experiments, and write docs/verification
  fuzz     run libFuzzer on every reader of files (fuzz --help)
  kills    kill long commands at random moments and compare their results (kills --help)
  dist     make the files of a release, and check versions and dates (dist --help)
  mutants  check that the experiments find errors built into the crates (mutants --help)";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let task = arguments.next();
    let rest: Vec<String> = arguments.collect();
    match task.as_deref() {
        Some("tidy") => tidy::run(),
        Some("figures") => figures::run(&rest),
        Some("fuzz") => fuzz::run(&rest),
        Some("sanitize") => sanitize::run(&rest),
        Some("kills") => kills::run(&rest),
        Some("verify") => verify::run(&rest),
        Some("mutants") => mutants::run(&rest),
        #[cfg(feature = "study")]
        Some("study") => study::run(&rest),
        #[cfg(feature = "bench")]
        Some("bench") => bench::run(&rest),
        #[cfg(feature = "book")]
        Some("book") => book::run(),
        #[cfg(feature = "dist")]
        Some("dist") => dist::run(&rest),
        #[allow(unreachable_patterns, reason = "reached where the feature is off")]
        Some(task @ ("study" | "bench" | "book" | "dist")) => rebuilt(task, &rest),
        Some("--help") => {
            println!("{TASKS}");
            ExitCode::SUCCESS
        }
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

/// Builds this program again with all that a task needs, the feature of its name, and runs that.
fn rebuilt(task: &str, arguments: &[String]) -> ExitCode {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = std::process::Command::new(cargo)
        .args(["run", "--release", "--package", "xtask", "--features"])
        .args([task, "--", task])
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
