//! `cargo xtask book`: builds the guide in `docs/book` with mdBook, and draws its formulas.

mod formulas;

use std::io::ErrorKind;
use std::path::Path;
use std::process::{Command, ExitCode};

/// The version that the guide is built with.
const VERSION: &str = "0.5.2";

/// Builds the guide, or says how to install mdBook.
pub fn run() -> ExitCode {
    build("mdbook", &crate::tidy::root().join("docs/book"))
}

fn build(program: &str, folder: &Path) -> ExitCode {
    match Command::new(program).arg("build").arg(folder).status() {
        Ok(status) if status.success() => match formulas::draw(&folder.join("book")) {
            Ok(n) => {
                let index = folder.join("book/index.html");
                println!("{n} formulas drawn; open {}", index.display());
                ExitCode::SUCCESS
            }
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
        Ok(_) => ExitCode::FAILURE,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            eprintln!(
                "mdBook is not installed (some minutes):\n  {}",
                installation()
            );
            ExitCode::from(2)
        }
        Err(error) => {
            eprintln!("{program} cannot be started: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The command that installs mdBook, without its server and its search.
pub fn installation() -> String {
    format!("cargo install mdbook --version {VERSION} --no-default-features --locked")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_is_no_failure_of_the_build() {
        let code = build("no-such-program", Path::new("."));
        assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::from(2)));
    }

    #[test]
    fn the_contributors_install_this_version() {
        let root = crate::tidy::root();
        let text = std::fs::read_to_string(root.join("CONTRIBUTING.md")).unwrap();
        assert!(text.contains(&installation()));
    }
}
