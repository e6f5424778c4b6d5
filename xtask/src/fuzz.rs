//! `cargo xtask fuzz`: libFuzzer on every reader of the program.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Duration;

use nix::sys::resource::{UsageWho, getrusage};

use crate::tidy::root;

const HELP: &str = "cargo xtask fuzz [--minutes M] [TARGET...]

Compiles the readers of the program with coverage (xtask/fuzz; a C++ compiler is needed), and runs
libFuzzer on each for M minutes (30), from the seeds of xtask/fuzz/corpus and from what earlier runs have
kept in target/fuzz. A run of more than 10 s or 1 GiB is a failure, as a panic is. Prints a table in
Markdown, and what has failed as a line for the seeds.";

/// Coverage of edges, with the values of comparisons, as `cargo fuzz` asks for it; it works with every
/// compiler, and without a sanitizer: outside of fe-grid there is no unsafe code.
const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing";
/// Limits of a run.
const LIMITS: [&str; 3] = ["-timeout=10", "-rss_limit_mb=1024", "-malloc_limit_mb=1024"];
/// Longer inputs take more time, and say little new.
const LENGTH: &str = "-max_len=16384";

/// What a session on one target has done.
struct Session {
    runs: u64,
    cpu: f64,
    /// Edges that the seeds reach, and all inputs.
    edges: [u64; 2],
    memory: u64,
    /// The input that has failed.
    failed: Option<PathBuf>,
}

/// Runs the task.
pub fn run(arguments: &[String]) -> ExitCode {
    let mut minutes = 30.0;
    let mut names = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--minutes" => match rest.next().and_then(|text| text.parse::<f64>().ok()) {
                Some(number) if number > 0.0 => minutes = number,
                _ => return refused("--minutes needs a number above 0"),
            },
            "--help" => {
                println!("{HELP}");
                return ExitCode::SUCCESS;
            }
            option if option.starts_with('-') => {
                return refused(&format!("there is no option {option}"));
            }
            name => names.push(name.to_owned()),
        }
    }
    match fuzz(&names, minutes) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(failures) => {
            eprintln!("{failures} targets fail");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("cannot fuzz: {error}");
            ExitCode::FAILURE
        }
    }
}

fn refused(reason: &str) -> ExitCode {
    eprintln!("{reason}\n{HELP}");
    ExitCode::from(2)
}

/// The targets, which are the files of seeds.
fn targets() -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(root().join("xtask/fuzz/corpus"))? {
        if let Some(name) = entry?.path().file_stem() {
            names.push(name.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// Fuzzes the named targets, or all; returns how many have failed.
fn fuzz(names: &[String], minutes: f64) -> io::Result<usize> {
    let all = targets()?;
    if let Some(name) = names.iter().find(|name| !all.contains(name)) {
        let known = all.join(", ");
        return Err(io::Error::other(format!(
            "there is no target {name}, only {known}"
        )));
    }
    let program = build()?;
    println!("| target | runs | CPU s | edges, seeds | edges, all | peak MiB |");
    println!("|---|---|---|---|---|---|");
    let chosen = if names.is_empty() { &all } else { names };
    let mut failures = 0;
    for name in chosen {
        let session = session(&program, name, minutes)?;
        let Session {
            runs,
            cpu,
            edges: [seeds, all],
            memory,
            failed,
        } = session;
        println!("| {name} | {runs} | {cpu:.0} | {seeds} | {all} | {memory} |");
        if let Some(file) = failed {
            failures += 1;
            let bytes = fs::read(&file)?;
            eprintln!("{name} fails on {}, as a seed:", file.display());
            eprintln!("{}", bytes.escape_ascii());
        }
    }
    Ok(failures)
}

/// Compiles the program, with the versions of crates that the workspace has.
fn build() -> io::Result<PathBuf> {
    let root = root();
    let crate_folder = root.join("xtask/fuzz");
    fs::copy(root.join("Cargo.lock"), crate_folder.join("Cargo.lock"))?;
    let target = folder().join("build");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let triple = host(&cargo)?;
    let status = Command::new(&cargo)
        .args(["build", "--release", "--target", &triple])
        .current_dir(&crate_folder)
        .env("RUSTFLAGS", FLAGS)
        .env("CARGO_TARGET_DIR", &target)
        .status()?;
    if !status.success() {
        return Err(io::Error::other("xtask/fuzz does not compile"));
    }
    Ok(target.join(triple).join("release/shapespace-fuzz"))
}

/// The triple of this machine: with `--target`, build scripts and macros have no coverage.
fn host(cargo: &std::ffi::OsStr) -> io::Result<String> {
    let output = Command::new(cargo).arg("-vV").output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().find_map(|line| line.strip_prefix("host: "));
    let triple = line.ok_or_else(|| io::Error::other("cargo does not state its host"))?;
    Ok(triple.to_owned())
}

/// Where builds and inputs are kept.
fn folder() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    target.unwrap_or_else(|| root().join("target")).join("fuzz")
}

fn session(program: &Path, name: &str, minutes: f64) -> io::Result<Session> {
    let corpus = folder().join("corpus").join(name);
    let found = folder().join("found");
    fs::create_dir_all(&corpus)?;
    fs::create_dir_all(&found)?;
    let seconds = (60.0 * minutes).ceil() as u64;
    let before = cpu()?;
    let output = Command::new(program)
        .args(LIMITS)
        .args([LENGTH, "-print_final_stats=1"])
        .arg(format!("-max_total_time={seconds}"))
        .arg(format!("-artifact_prefix={}/{name}-", found.display()))
        .arg(&corpus)
        .env("SHAPESPACE_FUZZ", name)
        .env("SHAPESPACE_CORPUS", &corpus)
        .env("RAYON_NUM_THREADS", "1")
        .output()?;
    let cpu = cpu()?.saturating_sub(before).as_secs_f64();
    let text = String::from_utf8_lossy(&output.stderr);
    let log = folder().join(format!("{name}.log"));
    fs::write(&log, &*text)?;
    let covered: Vec<u64> = text
        .lines()
        .filter_map(|line| after(line, "cov: "))
        .collect();
    let stated = |key: &str| text.lines().rev().find_map(|line| after(line, key));
    let failed = text
        .lines()
        .find_map(|line| line.split_once("Test unit written to "))
        .map(|(_, path)| PathBuf::from(path.trim()));
    if !output.status.success() && failed.is_none() {
        let message = format!("{name} has ended with {}: {}", output.status, log.display());
        return Err(io::Error::other(message));
    }
    let first = covered.first().copied().unwrap_or(0);
    Ok(Session {
        runs: stated("stat::number_of_executed_units:").unwrap_or(0),
        cpu,
        edges: [first, covered.last().copied().unwrap_or(first)],
        memory: stated("stat::peak_rss_mb:").unwrap_or(0),
        failed,
    })
}

/// The number after a key in a line.
fn after(line: &str, key: &str) -> Option<u64> {
    let (_, rest) = line.split_once(key)?;
    rest.split_whitespace().next()?.parse().ok()
}

/// The time of the processors for all programs that this one has run.
fn cpu() -> io::Result<Duration> {
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    let [user, system] = [usage.user_time(), usage.system_time()];
    let micros = |time: nix::sys::time::TimeVal| {
        let (seconds, micros) = (time.tv_sec(), time.tv_usec());
        u64::try_from(seconds).unwrap_or(0) * 1_000_000 + u64::try_from(micros).unwrap_or(0)
    };
    Ok(Duration::from_micros(micros(user) + micros(system)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figures_of_libfuzzer_are_read() {
        let line =
            "#1048576\tpulse  cov: 813 ft: 2034 corp: 210/9Kb lim: 110 exec/s: 52428 rss: 55Mb";
        assert_eq!(after(line, "cov: "), Some(813));
        let line = "stat::number_of_executed_units: 1048577";
        let key = "stat::number_of_executed_units:";
        assert_eq!(after(line, key), Some(1_048_577));
        assert_eq!(after(line, "cov: "), None);
    }

    #[test]
    fn every_target_has_seeds() {
        let source = fs::read_to_string(root().join("cli/src/fuzz/mod.rs")).unwrap();
        let named: Vec<&str> = source
            .split("target(\"")
            .skip(1)
            .filter_map(|rest| rest.split('"').next())
            .collect();
        let mut sorted = named.clone();
        sorted.sort_unstable();
        assert!(sorted.len() > 20);
        assert_eq!(targets().unwrap(), sorted);
    }
}
