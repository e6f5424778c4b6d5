//! The wheel of the Python package for this system.

use std::fs;
use std::path::Path;

use super::step::{Ran, Step, is_installed, shown};

/// Builds it with maturin.
pub fn make(output: &Path) -> Step {
    if !is_installed("maturin", &["--version"]) {
        return Step::LeftOut("no maturin: pip install maturin".into());
    }
    let Ok(output) = fs::canonicalize(output) else {
        return Step::Failed(format!("there is no {}", output.display()));
    };
    let folder = output.to_string_lossy();
    let arguments = ["build", "--release", "--locked", "--out", &folder];
    match shown("maturin", &arguments, &crate::tidy::root().join("python")) {
        Ran::Well => {
            Step::Done("for this system; those of others are built by the workflow wheels".into())
        }
        Ran::Badly(reason) => Step::Failed(reason),
        Ran::NotInstalled => Step::LeftOut("no maturin: pip install maturin".into()),
    }
}
