//! `cargo xtask sanitize`: the tests of `fe-grid`, the only crate with unsafe code, under the address and
//! the thread sanitizer, and under Miri.

use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

use crate::tidy::root;

const HELP: &str = "cargo xtask sanitize [address|thread|miri...]

Runs the tests of fe-grid with the nightly compiler under the address sanitizer, the thread sanitizer and
Miri, or under those that are named. What the compiler has not installed is left out, with the reason.";

/// The crate.
const CRATE: &str = "fe-grid";
/// Tests that Miri can run: those of the modules with unsafe code, but for files mapped into memory.
const MIRI: [&str; 5] = [
    "allocator::",
    "dimension::",
    "parallel::",
    "routine::",
    "a_vector_in_memory",
];

/// What has come of a check.
#[derive(Debug, PartialEq, Eq)]
enum Outcome {
    Clean,
    Failed,
    /// With the reason.
    LeftOut(String),
}

/// Runs the task.
pub fn run(arguments: &[String]) -> ExitCode {
    let all = ["address", "thread", "miri"];
    if arguments.iter().any(|a| a == "--help") {
        println!("{HELP}");
        return ExitCode::SUCCESS;
    }
    if let Some(other) = arguments.iter().find(|a| !all.contains(&a.as_str())) {
        eprintln!("there is no check {other}\n{HELP}");
        return ExitCode::from(2);
    }
    let chosen = all.iter().filter(|name| {
        let is_named = |argument: &String| argument == *name;
        arguments.is_empty() || arguments.iter().any(is_named)
    });
    let mut failed = false;
    for name in chosen {
        let outcome = if *name == "miri" {
            miri()
        } else {
            sanitized(name)
        };
        match &outcome {
            Outcome::Clean => println!("{name}: nothing found"),
            Outcome::Failed => println!("{name}: FAILED"),
            Outcome::LeftOut(reason) => println!("{name}: left out, {reason}"),
        }
        failed |= outcome == Outcome::Failed;
    }
    ExitCode::from(u8::from(failed))
}

/// Runs the tests under a sanitizer.
fn sanitized(name: &str) -> Outcome {
    let Some((sysroot, triple)) = nightly() else {
        return Outcome::LeftOut(
            "there is no nightly compiler: rustup toolchain add nightly".into(),
        );
    };
    let mut flags = format!("-Zsanitizer={name}");
    let mut cargo = cargo();
    cargo.args(["test", "--package", CRATE, "--lib", "--tests", "--locked"]);
    cargo.args(["--target", &triple]);
    if sysroot.join("lib/rustlib/src/rust/library/std").is_dir() {
        cargo.arg("-Zbuild-std");
    } else if name == "thread" {
        // The standard library does not take part: what it synchronises by system calls alone would be
        // reported though it is sound, and nothing of it is missed otherwise.
        flags.push_str(" -Cunsafe-allow-abi-mismatch=sanitizer");
        println!("thread: the standard library is not checked (rustup component add rust-src)");
    }
    cargo.env("RUSTFLAGS", flags);
    cargo.env("CARGO_TARGET_DIR", folder().join(name));
    ended(cargo)
}

/// Runs the tests of the modules with unsafe code under Miri.
fn miri() -> Outcome {
    let mut version = cargo();
    version.args(["miri", "--version"]);
    version.stdout(Stdio::null()).stderr(Stdio::null());
    if !version.status().is_ok_and(|status| status.success()) {
        let reason = "it is not installed: rustup component add --toolchain nightly miri rust-src";
        return Outcome::LeftOut(reason.into());
    }
    let mut cargo = cargo();
    cargo.args(["miri", "test", "--package", CRATE, "--lib", "--locked"]);
    cargo.arg("--").args(MIRI);
    cargo.env("CARGO_TARGET_DIR", folder().join("miri"));
    // The queues of rayon's threads (crossbeam-epoch) reach around a reference, which the older rules of stacked
    // borrows forbid and those of tree borrows allow; the threads themselves wait for work until the program ends.
    cargo.env("MIRIFLAGS", "-Zmiri-tree-borrows -Zmiri-ignore-leaks");
    ended(cargo)
}

fn ended(mut command: Command) -> Outcome {
    match command.status() {
        Ok(status) if status.success() => Outcome::Clean,
        Ok(_) => Outcome::Failed,
        Err(error) => Outcome::LeftOut(format!("cargo cannot be started: {error}")),
    }
}

/// Cargo of the nightly compiler; what another cargo has set for the programs that it runs is left out.
fn cargo() -> Command {
    let mut command = Command::new("cargo");
    command.arg("+nightly").current_dir(root());
    for name in ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN", "RUSTFLAGS"] {
        command.env_remove(name);
    }
    command
}

/// The folder of the nightly compiler, and the triple of this machine.
fn nightly() -> Option<(PathBuf, String)> {
    let mut version = cargo();
    let output = version.args(["-vV"]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let triple = text.lines().find_map(|line| line.strip_prefix("host: "))?;
    let mut rustc = Command::new("rustc");
    rustc.args(["+nightly", "--print", "sysroot"]);
    rustc.env_remove("RUSTUP_TOOLCHAIN");
    let output = rustc.output().ok().filter(|o| o.status.success())?;
    let sysroot = String::from_utf8(output.stdout).ok()?;
    Some((PathBuf::from(sysroot.trim()), triple.to_owned()))
}

/// Where the tests are compiled.
fn folder() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    target
        .unwrap_or_else(|| root().join("target"))
        .join("sanitize")
}
