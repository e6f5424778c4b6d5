//! Runs the tests of the Python package, with the module and the program of this build.
//!
//! They need a Python with NumPy and pytest: the one that `SHAPESPACE_PYTHON` names, or `python3`.
//! Without it the test prints a reason and passes.

use std::env::consts::EXE_SUFFIX;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use test_support::python::{install_package, outputs};

/// What the interpreter has to have.
const NEEDED: &str = "import sys, numpy, pytest; assert sys.version_info >= (3, 9)";

/// The package with the compiled module, in a folder that Python can import from.
fn installed() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-package");
    let _ = fs::remove_dir_all(&folder);
    install_package(&folder).unwrap();
    folder
}

#[test]
fn the_python_package_passes_its_tests() {
    let python = env::var_os("SHAPESPACE_PYTHON").unwrap_or_else(|| "python3".into());
    let ready = Command::new(&python).args(["-c", NEEDED]).output();
    if !ready.is_ok_and(|output| output.status.success()) {
        println!(
            "skipped: {} has no Python of version 3.9 or later with numpy and pytest",
            python.display()
        );
        return;
    }
    let program = outputs()
        .unwrap()
        .join(format!("../shapespace{EXE_SUFFIX}"));
    let tests = Command::new(&python)
        .args([
            "-m",
            "pytest",
            "-q",
            "-rs",
            "-p",
            "no:cacheprovider",
            "tests",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("PYTHONPATH", installed())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("SHAPESPACE_PROGRAM", program)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&tests.stdout);
    println!("{text}{}", String::from_utf8_lossy(&tests.stderr));
    assert!(tests.status.success(), "{text}");
}
