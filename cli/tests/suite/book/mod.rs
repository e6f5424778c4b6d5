//! The guide in `docs/book` does what it says.
//!
//! The blocks of a chapter are run in order, in one folder: commands (`sh`), Python (`python`), and
//! files of which the block has the contents (such as `csv groups.csv`). A block of `text` shows what
//! the block before it has printed. Blocks of Rust are parts of examples, which the compiler checks.
//! Where Python is missing, a chapter is run up to its first block of Python.

mod run;
mod structure;

use std::path::PathBuf;

/// The folder of the chapters.
fn source() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/book/src")
}

/// The text of a chapter as it is written, with its includes unresolved.
fn chapter(name: &str) -> String {
    let path = source().join(format!("{name}.md"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A test for each chapter, so that they run side by side and fail by their names.
macro_rules! chapters {
    ($($test:ident: $name:literal,)*) => {
        /// All chapters that are run.
        const CHAPTERS: &[&str] = &[$($name),*];
        $(
            #[test]
            fn $test() {
                run::chapter($name);
            }
        )*
    };
}

chapters! {
    introduction: "introduction",
    idea: "idea",
    pictures: "pictures",
    volumes: "volumes",
    geodesics: "geodesics",
    images: "images",
    doubts: "doubts",
    parameters: "parameters",
    accuracy: "accuracy",
    theory: "theory",
    numerics: "numerics",
    other_tools: "other-tools",
}
