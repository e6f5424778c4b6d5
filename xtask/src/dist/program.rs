//! The archive of the program: with completions, manual pages, licences and the README.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use super::archive::Contents;
use super::completions::{add_completions, add_manual};
use super::step::{Ran, Step, shown};

/// Builds the program, and writes its archive.
pub fn make(output: &Path, version: &str) -> Step {
    let root = crate::tidy::root();
    let built = ["build", "--release", "--locked", "--package", "shapespace"];
    match shown(&cargo(), &built, &root) {
        Ran::Well => {}
        Ran::Badly(reason) => return Step::Failed(reason),
        Ran::NotInstalled => return Step::Failed("cargo cannot be started".into()),
    }
    let name = format!(
        "shapespace-{version}-{}-{}",
        env::consts::ARCH,
        env::consts::OS
    );
    match written(&root, output, &name) {
        Ok(step) => step,
        Err(error) => Step::Failed(error.to_string()),
    }
}

/// The program that runs this task, and builds others.
pub fn cargo() -> String {
    env::var("CARGO").unwrap_or_else(|_| "cargo".into())
}

/// The folder of the outputs of cargo.
pub fn target() -> PathBuf {
    let named = env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    named.unwrap_or_else(|| crate::tidy::root().join("target"))
}

fn written(root: &Path, output: &Path, name: &str) -> io::Result<Step> {
    let program = format!("shapespace{}", env::consts::EXE_SUFFIX);
    let stripped = output.join(&program);
    fs::copy(target().join("release").join(&program), &stripped)?;
    let path = stripped.to_string_lossy();
    let how = match shown("strip", &[&path], root) {
        Ran::Well => "without symbols",
        _ => "with symbols, for want of `strip`",
    };
    let mut contents = Contents::default();
    contents.add_program(program, fs::read(&stripped)?);
    fs::remove_file(&stripped)?;
    add_completions(&mut contents);
    add_manual(&mut contents)?;
    for file in [
        "README.md",
        "CHANGELOG.md",
        "CITATION.cff",
        "LICENSE-MIT",
        "LICENSE-APACHE",
    ] {
        contents.add(file, fs::read(root.join(file))?);
    }
    let file = format!("{name}.tar.gz");
    contents.write(&output.join(&file), name)?;
    Ok(Step::Done(format!("{file}, {how}")))
}
