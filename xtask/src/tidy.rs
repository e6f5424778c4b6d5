//! Rules that the compiler does not check.
//!
//! - Every source file begins with a `//!` comment that states its purpose, and is no longer than
//!   [`MAX_LINES`].
//! - No code is unfinished or switched off ([`FORBIDDEN`]).
//! - No crate but `fe-grid` has unsafe code ([`FORBIDS`]).
//! - A library whose manifest says that it has no unit tests has none ([`UNIT_TESTS`]): they would never run.
//! - Calls that may panic ([`PANICS`]) are allowed in tests, benchmarks and examples only, or with
//!   a comment that explains why they cannot.
//! - Crates depend on each other only as in the table of `ARCHITECTURE.md`.
//! - Files do not import each other in a cycle, except inside one small module ([`cycles`]).
//! - Every crate carries the licence of the workspace.
//! - Links between the documents are valid.

mod code;
mod cycles;
mod links;
mod manifest;
mod modules;

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use code::{blanked, without_tests};

/// The longest file allowed, in lines.
const MAX_LINES: usize = 600;
/// Words that no code may contain.
const FORBIDDEN: [&str; 4] = ["dbg!", "todo!", "unimplemented!", "#[ignore"];
/// The files at the roots of crates.
const ROOTS: [&str; 2] = ["src/lib.rs", "src/main.rs"];
/// The line that all of them have, except for those of [`UNSAFE_CRATE`].
const FORBIDS: &str = "#![forbid(unsafe_code)]";
/// The only crate with unsafe code.
const UNSAFE_CRATE: &str = "fe-grid";
/// What unit tests are made of.
const UNIT_TESTS: [&str; 2] = ["cfg(test)", "#[test]"];
/// Calls that need a reason outside tests.
const PANICS: [&str; 2] = [".unwrap()", ".expect("];
/// Folders of a crate in which a panic is a failed test.
const TEST_FOLDERS: [&str; 3] = ["tests", "benches", "examples"];

/// A rule that is broken somewhere.
#[derive(Debug, PartialEq, Eq)]
pub struct Finding {
    /// The file, relative to the root.
    path: PathBuf,
    /// The line, counted from 1, if it is in one line.
    line: Option<usize>,
    /// The message.
    message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.message)
    }
}

/// Checks the tree that this program was built from, and lists the findings.
pub fn run() -> ExitCode {
    match check(&root()) {
        Ok(findings) if findings.is_empty() => {
            println!("tidy");
            ExitCode::SUCCESS
        }
        Ok(findings) => {
            for finding in &findings {
                eprintln!("{finding}");
            }
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("cannot read the tree: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).into()
}

fn check(root: &Path) -> io::Result<Vec<Finding>> {
    let read = |name: &Path| {
        fs::read_to_string(root.join(name))
            .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", name.display())))
    };
    let workspace = read(Path::new("Cargo.toml"))?;
    let architecture = read(Path::new("ARCHITECTURE.md"))?;
    let members = manifest::members(&workspace)
        .into_iter()
        .map(|folder| {
            let manifest = read(&Path::new(&folder).join("Cargo.toml"))?;
            Ok(manifest::Member { folder, manifest })
        })
        .collect::<io::Result<Vec<_>>>()?;
    let mut findings = manifest::check_workspace(&workspace, &architecture, root);
    findings.extend(links::check(root)?);
    for member in &members {
        findings.extend(manifest::check_member(member, &members, &architecture));
        let text = |path: &Path| fs::read_to_string(root.join(path)).ok();
        findings.extend(cycles::check(Path::new(&member.folder), &text));
        let mut sources = Vec::new();
        collect_sources(&root.join(&member.folder), &mut sources)?;
        sources.sort();
        for source in sources {
            let path = source.strip_prefix(root).unwrap_or(&source);
            let inside = path.strip_prefix(&member.folder).unwrap_or(path);
            let text = read(path)?;
            findings.extend(check_source(path, inside, &text));
            if member.has_no_unit_tests() && inside.starts_with("src") {
                findings.extend(check_no_unit_tests(path, &text));
            }
        }
    }
    Ok(findings)
}

/// All Rust files under the folder of a crate, without build outputs and without the crates inside.
fn collect_sources(folder: &Path, sources: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            let built = path.file_name().is_some_and(|name| name == "target");
            if !built && !path.join("Cargo.toml").is_file() {
                collect_sources(&path, sources)?;
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            sources.push(path);
        }
    }
    Ok(())
}

/// Checks one Rust file, given its path in the tree and in its crate.
fn check_source(path: &Path, inside: &Path, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut report = |line: Option<usize>, message: String| {
        let path = path.into();
        findings.push(Finding {
            path,
            line,
            message,
        });
    };
    if !text.starts_with("//!") {
        report(
            Some(1),
            "no `//!` comment states the purpose of the file".into(),
        );
    }
    let is_root = ROOTS.iter().any(|root| inside == Path::new(root));
    if is_root && !path.starts_with(UNSAFE_CRATE) && !text.contains(FORBIDS) {
        report(None, format!("no {FORBIDS}"));
    }
    let n_lines = text.lines().count();
    if n_lines > MAX_LINES {
        report(None, format!("{n_lines} lines, more than {MAX_LINES}"));
    }
    let code = blanked(text);
    for (i, line) in code.lines().enumerate() {
        for word in FORBIDDEN.iter().filter(|word| line.contains(**word)) {
            report(Some(i + 1), format!("{word} is not allowed"));
        }
    }
    let folder = inside.components().next();
    if folder.is_some_and(|f| TEST_FOLDERS.iter().any(|t| f.as_os_str() == *t)) {
        return findings;
    }
    let lines: Vec<&str> = text.lines().collect();
    for (i, line) in without_tests(&code).lines().enumerate() {
        let commented = |i: usize| lines.get(i).is_some_and(|line| has_comment(line));
        let excused = commented(i) || (i > 0 && commented(i - 1));
        for word in PANICS.iter().filter(|word| line.contains(**word)) {
            if !excused {
                let message = format!("{word} without a comment that states why it cannot fail");
                report(Some(i + 1), message);
            }
        }
    }
    findings
}

/// Finds unit tests in a file of a library that is not compiled for them.
fn check_no_unit_tests(path: &Path, text: &str) -> Vec<Finding> {
    let code = blanked(text);
    let found = |line: &str| UNIT_TESTS.iter().any(|word| line.contains(word));
    let lines = code.lines().enumerate().filter(|(_, line)| found(line));
    lines
        .map(|(i, _)| Finding {
            path: path.into(),
            line: Some(i + 1),
            message: "a unit test that never runs: the library has `test = false`".into(),
        })
        .collect()
}

/// Whether a line has a comment; documentation does not count.
fn has_comment(line: &str) -> bool {
    line.match_indices("//").any(|(i, _)| {
        let rest = &line[i + 2..];
        !rest.starts_with(['/', '!']) && !line[..i].ends_with([':', '/'])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_tidy() {
        let findings = check(&root()).unwrap();
        let lines: Vec<String> = findings.iter().map(ToString::to_string).collect();
        assert!(lines.is_empty(), "\n{}", lines.join("\n"));
    }

    fn messages(path: &str, text: &str) -> Vec<String> {
        let path = Path::new(path);
        let inside = path.strip_prefix("a").unwrap();
        let findings = check_source(path, inside, text);
        findings.into_iter().map(|f| f.message).collect()
    }

    #[test]
    fn a_file_says_what_it_is_for_and_stays_short() {
        assert!(messages("a/src/b.rs", "//! Says it.\n").is_empty());
        assert_eq!(messages("a/src/b.rs", "fn f() {}\n").len(), 1);
        let long = format!("//! Long.\n{}", "\n".repeat(MAX_LINES));
        assert_eq!(messages("a/src/b.rs", &long).len(), 1);
    }

    #[test]
    fn nothing_is_left_unfinished() {
        for word in FORBIDDEN {
            let text = format!("//! Doc.\nfn f() {{ {word} }}\n");
            assert_eq!(messages("a/src/b.rs", &text).len(), 1, "{word}");
            let quoted = format!("//! Doc.\nconst S: &str = \"{word}\"; // {word}\n");
            assert!(messages("a/src/b.rs", &quoted).is_empty(), "{word}");
        }
    }

    #[test]
    fn unit_tests_that_never_run_are_found() {
        let lines = |text: &str| {
            let findings = check_no_unit_tests(Path::new("a/src/b.rs"), text);
            findings.iter().map(|f| f.line).collect::<Vec<_>>()
        };
        assert!(lines("//! Has no #[test].\nfn f() {}\n").is_empty());
        let text = "//! Doc.\n#[cfg(test)]\nmod tests {\n    #[test]\n    fn f() {}\n}\n";
        assert_eq!(lines(text), [Some(2), Some(4)]);
    }

    #[test]
    fn panics_need_a_reason_outside_tests() {
        for word in PANICS {
            let bare = format!("//! Doc.\nfn f() {{\n    g(){word}\n}}\n");
            assert_eq!(messages("a/src/b.rs", &bare).len(), 1, "{word}");
            assert!(messages("a/tests/b.rs", &bare).is_empty());
            let inside = format!("//! Doc.\n#[cfg(test)]\nmod tests {{\n    g(){word}\n}}\n");
            assert!(messages("a/src/b.rs", &inside).is_empty());
            let after = format!("{inside}fn f() {{\n    g(){word}\n}}\n");
            assert_eq!(messages("a/src/b.rs", &after).len(), 1);
            let above = format!("//! Doc.\nfn f() {{\n    // Never empty.\n    g(){word}\n}}\n");
            assert!(messages("a/src/b.rs", &above).is_empty());
            let beside = format!("//! Doc.\nfn f() {{\n    g(){word} // never empty\n}}\n");
            assert!(messages("a/src/b.rs", &beside).is_empty());
            let documented = format!("//! Doc.\n/// Doc.\nfn f() {{ g(){word} }}\n");
            assert_eq!(messages("a/src/b.rs", &documented).len(), 1);
        }
    }
}
