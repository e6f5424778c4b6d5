//! What the registry of Rust gets: the packages of all crates that are published, and whether their
//! interfaces are compatible with the version before.

use std::process::Command;

use super::program::cargo;
use super::step::{Ran, Step, Steps, is_installed, shown};

/// Packages the crates without publishing them, and compares their interfaces.
pub fn run(verify: bool, steps: &mut Steps) {
    let root = crate::tidy::root();
    let mut arguments = vec![
        "publish",
        "--workspace",
        "--dry-run",
        "--locked",
        "--allow-dirty",
    ];
    if !verify {
        arguments.push("--no-verify");
    }
    let how = if verify {
        "packaged and compiled"
    } else {
        "packaged, not compiled"
    };
    let step = match shown(&cargo(), &arguments, &root) {
        Ran::Well => Step::Done(how.into()),
        Ran::Badly(reason) => Step::Failed(format!("{reason} (it needs a network)")),
        Ran::NotInstalled => Step::Failed("cargo cannot be started".into()),
    };
    steps.add("crates", step);
    steps.add("repository", repository());
    steps.add("compatibility", compatibility());
}

/// The registry shows where a crate is developed, if the manifest states it.
fn repository() -> Step {
    let manifest = crate::tidy::root().join("Cargo.toml");
    let text = std::fs::read_to_string(manifest).unwrap_or_default();
    if text.lines().any(|line| line.starts_with("repository = ")) {
        Step::Done("stated in Cargo.toml".into())
    } else {
        Step::LeftOut("Cargo.toml states no repository, as none is known: add it to publish".into())
    }
}

fn compatibility() -> Step {
    let cargo = cargo();
    if !is_installed(&cargo, &["semver-checks", "--version"]) {
        return Step::LeftOut("no cargo-semver-checks: cargo install cargo-semver-checks".into());
    }
    let published = Command::new(&cargo)
        .args(["info", "--quiet", "fe-grid@0"])
        .current_dir(std::env::temp_dir())
        .output();
    if !published.is_ok_and(|output| output.status.success()) {
        return Step::LeftOut("no earlier version is published".into());
    }
    match shown(
        &cargo,
        &["semver-checks", "--workspace"],
        &crate::tidy::root(),
    ) {
        Ran::Well => Step::Done("with the version that is published".into()),
        Ran::Badly(reason) => Step::Failed(reason),
        Ran::NotInstalled => Step::LeftOut("cargo cannot be started".into()),
    }
}
