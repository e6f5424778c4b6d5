//! Checks of the `Cargo.toml` files: dependencies between crates, and licences.
//!
//! Only the part of the format that the manifests of a workspace use is parsed: sections, and one
//! key per line.

use std::path::Path;

use super::Finding;

/// The licence of every crate.
const LICENCE: &str = "MIT OR Apache-2.0";
/// Its texts.
const LICENCE_FILES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];
/// The crate that all others may use in their tests.
const TEST_SUPPORT: &str = "xtask/test-support";

/// The keys of the sections whose name satisfies a condition, with their values.
fn entries(text: &str, section: impl Fn(&str) -> bool) -> Vec<(&str, &str)> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            inside = section(name);
        } else if inside
            && !line.starts_with('#')
            && let Some((key, value)) = line.split_once('=')
        {
            found.push((key.trim(), value.trim()));
        }
    }
    found
}

/// A crate of the workspace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Its folder, relative to the root.
    pub folder: String,
    /// The text of its manifest.
    pub manifest: String,
}

impl Member {
    /// The name by which other crates depend on it.
    fn name(&self) -> &str {
        let package = entries(&self.manifest, |section| section == "package");
        let name = package.iter().find(|(key, _)| *key == "name");
        name.map_or("", |(_, value)| value.trim_matches('"'))
    }

    /// Whether no unit tests of its library are compiled.
    pub fn has_no_unit_tests(&self) -> bool {
        entries(&self.manifest, |section| section == "lib").contains(&("test", "false"))
    }
}

/// The folders of the crates of the workspace.
pub fn members(workspace: &str) -> Vec<String> {
    let listed = entries(workspace, |section| section == "workspace");
    let list = listed.iter().find(|(key, _)| *key == "members");
    let quoted = list.map_or("", |(_, value)| value).split('"');
    quoted.skip(1).step_by(2).map(Into::into).collect()
}

/// The crates that a crate may use, by the table in the description of the architecture: rows
/// `` | `crate` | `used`, `used` | ``.
fn allowed(architecture: &str, member: &str) -> Option<Vec<String>> {
    let first = format!("| `{member}` |");
    let row = architecture.lines().find(|line| line.starts_with(&first))?;
    let cell = row[first.len()..].split('|').next()?;
    let names = cell.split('`').skip(1).step_by(2);
    Some(names.map(Into::into).collect())
}

/// Checks the workspace as a whole.
pub fn check_workspace(workspace: &str, architecture: &str, root: &Path) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut report = |path: &str, message: String| {
        findings.push(Finding {
            path: path.into(),
            line: None,
            message,
        });
    };
    let licence = entries(workspace, |section| section == "workspace.package");
    if !licence.contains(&("license", &format!("\"{LICENCE}\""))) {
        report("Cargo.toml", format!("the licence is not {LICENCE}"));
    }
    for file in LICENCE_FILES {
        if !root.join(file).is_file() {
            report(file, "the text of the licence is missing".into());
        }
    }
    let members = members(workspace);
    if members.is_empty() {
        report("Cargo.toml", "the workspace lists no crates".into());
    }
    for member in members {
        if allowed(architecture, &member).is_none() {
            let message = format!("the table of dependencies has no row for {member}");
            report("ARCHITECTURE.md", message);
        }
    }
    findings
}

/// Checks the dependencies and the licence of one crate.
pub fn check_member(member: &Member, all: &[Member], architecture: &str) -> Vec<Finding> {
    let mut messages = Vec::new();
    let package = entries(&member.manifest, |section| section == "package");
    if !package.contains(&("license.workspace", "true")) {
        messages.push("the licence is not the workspace's".into());
    }
    let allowed = allowed(architecture, &member.folder).unwrap_or_default();
    for tests in [false, true] {
        let dependencies = entries(&member.manifest, |section| {
            section.ends_with("dependencies") && section.starts_with("dev-") == tests
        });
        for (key, _) in dependencies {
            let name = key.split('.').next().unwrap_or(key).trim_matches('"');
            let Some(used) = all.iter().find(|other| other.name() == name) else {
                continue;
            };
            let permitted = allowed.contains(&used.folder);
            if !permitted && (!tests || used.folder != TEST_SUPPORT) {
                messages.push(format!(
                    "{} must not depend on {}",
                    member.folder, used.folder
                ));
            }
        }
    }
    messages
        .into_iter()
        .map(|message| Finding {
            path: Path::new(&member.folder).join("Cargo.toml"),
            line: None,
            message,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORKSPACE: &str = "[workspace]\nmembers = [\"low\", \"high\"]\n\
                             [workspace.package]\nlicense = \"MIT OR Apache-2.0\"\n";
    const ARROWS: &str = "| crate | uses |\n|---|---|\n| `low` | – |\n| `high` | `low` |\n";

    fn manifest(name: &str, rest: &str) -> String {
        format!("[package]\nname = \"{name}\"\n{rest}")
    }

    fn check(folder: &str, rest: &str) -> Vec<String> {
        let all = ["low", "high", TEST_SUPPORT].map(|other| Member {
            folder: other.into(),
            manifest: manifest(
                &format!("crate-{}", other.rsplit('/').next().unwrap()),
                if other == folder { rest } else { "" },
            ),
        });
        let member = all.iter().find(|member| member.folder == folder).unwrap();
        let findings = check_member(member, &all, ARROWS);
        findings.into_iter().map(|f| f.message).collect()
    }

    #[test]
    fn arrows_point_down_only() {
        assert_eq!(members(WORKSPACE), ["low", "high"]);
        let package = "license.workspace = true\n";
        let uses = |name: &str| format!("{package}[dependencies]\n{name}.workspace = true\n");
        assert!(check("high", &uses("crate-low")).is_empty());
        assert!(check("high", &uses("serde")).is_empty());
        assert_eq!(check("low", &uses("crate-high")).len(), 1);
        let tested =
            format!("{package}[dev-dependencies]\ncrate-high = {{ path = \"../high\" }}\n");
        assert_eq!(check("low", &tested).len(), 1);
    }

    #[test]
    fn test_support_is_for_tests_alone() {
        let package = "license.workspace = true\n";
        let uses = |section: &str| format!("{package}[{section}]\ncrate-test-support = \"1\"\n");
        assert!(check("low", &uses("dev-dependencies")).is_empty());
        assert_eq!(check("low", &uses("dependencies")).len(), 1);
    }

    #[test]
    fn a_library_may_have_no_unit_tests() {
        let without = |rest: &str| {
            let member = Member {
                folder: "low".into(),
                manifest: manifest("low", rest),
            };
            member.has_no_unit_tests()
        };
        assert!(without("[lib]\n# Why.\ntest = false\n"));
        assert!(!without("[lib]\nbench = false\n"));
        assert!(!without("[[bench]]\ntest = false\n"));
    }

    #[test]
    fn licences_are_the_workspace_s() {
        assert_eq!(check("low", "license = \"GPL-3.0\"\n").len(), 1);
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        assert!(check_workspace(WORKSPACE, ARROWS, &root).is_empty());
        let other = WORKSPACE.replace("MIT", "BSD");
        assert_eq!(check_workspace(&other, ARROWS, &root).len(), 1);
        assert_eq!(check_workspace(WORKSPACE, "", &root).len(), 2);
    }
}
