//! Whether all files state the same version, and the changelog and the citation the date of a release.

use std::fs;

use super::step::{Step, Steps};

/// The version of the workspace.
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Compares all files.
pub fn run(steps: &mut Steps) {
    let version = version();
    let read = |name: &str| {
        let text = fs::read_to_string(crate::tidy::root().join(name));
        text.map_err(|error| format!("{name}: {error}"))
    };
    let mut check = |name: &str, file: &str, found: fn(&str, &str) -> Result<String, String>| {
        let step = match read(file).and_then(|text| found(&text, &version)) {
            Ok(text) => Step::Done(text),
            Err(text) => Step::Failed(text),
        };
        steps.add(name, step);
    };
    check("Cargo.toml", "Cargo.toml", manifest);
    check("Cargo.lock", "Cargo.lock", lock);
    check("Python package", "python/pyproject.toml", python);
    check("CITATION.cff", "CITATION.cff", citation);
    check("README.md", "README.md", readme);
    check("CHANGELOG.md", "CHANGELOG.md", changelog);
    let dates = read("CHANGELOG.md").and_then(|changelog| {
        let citation = read("CITATION.cff")?;
        same_date(&changelog, &citation, &version)
    });
    steps.add(
        "date of the release",
        dates.map_or_else(Step::Failed, Step::Done),
    );
}

/// The crates of the workspace depend on each other in this version.
fn manifest(text: &str, version: &str) -> Result<String, String> {
    let of_paths = text.lines().filter(|line| line.contains("path = \""));
    let stated = of_paths.filter_map(|line| quoted(line, "version = "));
    let mut n = 0;
    for found in stated {
        if found != version {
            return Err(format!("a crate of the workspace is required as {found}"));
        }
        n += 1;
    }
    if n == 0 {
        return Err("no crate of the workspace states a version".into());
    }
    Ok(format!("{n} crates require each other as {version}"))
}

/// The lock file has been written for this version.
fn lock(text: &str, version: &str) -> Result<String, String> {
    let stated = text.split("[[package]]").find_map(|package| {
        let named = package.contains("name = \"shapespace\"\n");
        named.then(|| quoted(package, "\nversion = "))?
    });
    match stated {
        Some(found) if found == version => Ok(found.into()),
        Some(found) => Err(format!("shapespace is {found}, not {version}")),
        None => Err("shapespace is missing".into()),
    }
}

/// The version of the Python package is that of its crate.
fn python(text: &str, version: &str) -> Result<String, String> {
    if text.contains("dynamic = [\"version\"]") {
        Ok(format!("{version}, from its crate"))
    } else {
        Err("states a version of its own".into())
    }
}

fn citation(text: &str, version: &str) -> Result<String, String> {
    let stated = line_after(text, "version: ").ok_or("has no version")?;
    if stated == version {
        Ok(stated.into())
    } else {
        Err(format!("{stated}, not {version}"))
    }
}

fn readme(text: &str, version: &str) -> Result<String, String> {
    let stated = format!("version {version}, ");
    if text.contains(&stated) {
        Ok(format!("to be cited as {version}"))
    } else {
        Err(format!("the citation does not say \"{stated}\""))
    }
}

/// The changelog has this version with a date, and nothing that is not in it.
fn changelog(text: &str, version: &str) -> Result<String, String> {
    let (_, rest) = text
        .split_once("\n## [Unreleased]\n")
        .ok_or("has no section [Unreleased]")?;
    let (unreleased, rest) = rest
        .split_once("\n## [")
        .ok_or("has no section of a version")?;
    let heading = rest.lines().next().unwrap_or_default();
    let expected = format!("{version}] - ");
    if !heading.starts_with(&expected) {
        return Err(format!("its newest section is [{heading}"));
    }
    if !unreleased.trim().is_empty() {
        return Err("there are changes after this version, in [Unreleased]".into());
    }
    Ok(format!("[{heading}, and nothing after it"))
}

/// The changelog and the citation have one date.
fn same_date(changelog: &str, citation: &str, version: &str) -> Result<String, String> {
    let heading = format!("## [{version}] - ");
    let logged = line_after(changelog, &heading).ok_or("not in CHANGELOG.md")?;
    let cited = line_after(citation, "date-released: ").ok_or("not in CITATION.cff")?;
    let form = |c: char| c.is_ascii_digit() || c == '-';
    if logged.len() != 10 || !logged.chars().all(form) {
        return Err(format!("{logged} is no date such as 2026-01-31"));
    }
    if logged != cited {
        return Err(format!("{logged} in CHANGELOG.md, {cited} in CITATION.cff"));
    }
    Ok(logged.into())
}

/// What stands in quotes after some text.
fn quoted<'a>(text: &'a str, before: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(before)?;
    rest.strip_prefix('"')?.split('"').next()
}

/// The rest of the line that begins with some text.
fn line_after<'a>(text: &'a str, beginning: &str) -> Option<&'a str> {
    let found = text.lines().find_map(|line| line.strip_prefix(beginning));
    found.map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differing_versions_are_found() {
        let manifest = |version| {
            super::manifest(
                &format!("a = {{ path = \"a\", version = \"{version}\" }}\n"),
                "1.2.0",
            )
        };
        assert!(manifest("1.2.0").is_ok());
        assert!(manifest("1.1.0").is_err());
        let lock = "[[package]]\nname = \"shapespace\"\nversion = \"1.1.0\"\n";
        assert!(super::lock(lock, "1.1.0").is_ok());
        assert!(super::lock(lock, "1.2.0").is_err());
        assert!(citation("version: 1.1.0\n", "1.2.0").is_err());
        assert!(python("version = \"1.1.0\"", "1.2.0").is_err());
        assert!(readme("version 1.1.0, 2026", "1.2.0").is_err());
    }

    #[test]
    fn changes_after_the_version_are_found() {
        let log =
            |between: &str| format!("# C\n\n## [Unreleased]\n{between}\n## [1.2.0] - 2026-01-31\n");
        assert!(changelog(&log(""), "1.2.0").is_ok());
        assert!(changelog(&log("\n- More.\n"), "1.2.0").is_err());
        assert!(changelog(&log(""), "1.3.0").is_err());
        let citation = "date-released: 2026-01-31\n";
        assert!(same_date(&log(""), citation, "1.2.0").is_ok());
        assert!(same_date(&log(""), "date-released: 2026-02-01\n", "1.2.0").is_err());
    }

    #[test]
    fn this_version_is_stated_everywhere() {
        let mut steps = Steps::default();
        run(&mut steps);
        let list = steps.to_string();
        // Between releases there are changes that are in none.
        let wrong = list.lines().filter(|line| line.starts_with("[!]"));
        let wrong: Vec<_> = wrong
            .filter(|line| !line.contains("[Unreleased]"))
            .collect();
        assert!(wrong.is_empty(), "{wrong:?}");
    }
}
