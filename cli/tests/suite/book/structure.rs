//! The table of contents, links, and what the guide has to name.

use std::collections::BTreeSet;
use std::path::Path;

use levelset::Cause;

use super::{CHAPTERS, chapter, source};
use crate::common::document::blocks;
use crate::common::{Place, succeeded};

/// The pages of the table of contents, without their ending.
fn contents() -> Vec<String> {
    let summary = chapter("SUMMARY");
    let links = summary.split("](").skip(1);
    links
        .map(|rest| rest.split(')').next().unwrap())
        .map(|page| page.strip_suffix(".md").expect(page).to_owned())
        .collect()
}

/// Every chapter, without the pages that only include a document.
fn guide() -> String {
    CHAPTERS.iter().map(|name| chapter(name)).collect()
}

/// The text of a page with its includes resolved.
fn resolved(page: &str) -> String {
    let text = chapter(page);
    let lines = text.lines().map(|line| match included(line) {
        Some(target) => read_part(target),
        None => line.to_owned(),
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn included(line: &str) -> Option<&str> {
    line.trim().strip_prefix("{{#include ")?.strip_suffix("}}")
}

/// A file, or the part of it between the comments `ANCHOR: name` and `ANCHOR_END: name`.
fn read_part(target: &str) -> String {
    let (path, anchor) = target.split_once(':').unwrap_or((target, ""));
    let text = std::fs::read_to_string(source().join(path));
    let text = text.unwrap_or_else(|e| panic!("{target}: {e}"));
    if anchor.is_empty() {
        return text;
    }
    let begins = |line: &&str| line.trim_end().ends_with(&format!("ANCHOR: {anchor}"));
    let ends = |line: &&str| line.trim_end().ends_with(&format!("ANCHOR_END: {anchor}"));
    let part: Vec<&str> = text.lines().skip_while(|line| !begins(line)).collect();
    assert!(part.iter().any(ends), "{target}: there is no such part");
    let part = part.into_iter().skip(1).take_while(|line| !ends(line));
    part.collect::<Vec<_>>().join("\n")
}

/// The identifier that mdBook gives to a heading.
fn identifier(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = heading.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    });
    kept.collect()
}

/// What is wrong with the target of a link, if anything is.
fn broken(page: &str, target: &str) -> Option<String> {
    if target.contains("://") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let linked = if file.is_empty() {
        page
    } else if let Some(linked) = file.strip_suffix(".md") {
        // Of pages outside of the book mdBook makes links to HTML that nobody writes.
        if !contents().iter().any(|page| page == linked) {
            return Some(format!("{page}: {file} is no page of the guide"));
        }
        linked
    } else {
        let missing = !source().join(file).is_file();
        return missing.then(|| format!("{page}: there is no {file}"));
    };
    let text = resolved(linked);
    let mut headings = text.lines().filter(|line| line.starts_with('#'));
    let found = anchor.is_empty() || headings.any(|line| identifier(line) == anchor);
    (!found).then(|| format!("{page}: {linked} has no heading for #{anchor}"))
}

/// The targets of all links of a text outside of its blocks.
fn targets(text: &str) -> Vec<String> {
    let mut inside = false;
    let prose = text.lines().filter(|line| {
        let fence = line.starts_with("```");
        inside ^= fence;
        !inside && !fence
    });
    let prose: Vec<&str> = prose.collect();
    let prose = prose.join("\n");
    let links = prose.split("](").skip(1);
    links
        .map(|rest| rest.split(')').next().unwrap().to_owned())
        .collect()
}

#[test]
fn the_contents_name_every_page() {
    let entries = std::fs::read_dir(source()).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let pages: BTreeSet<String> = names
        .filter_map(|name| name.strip_suffix(".md").map(str::to_owned))
        .filter(|name| name != "SUMMARY")
        .collect();
    assert_eq!(pages, contents().into_iter().collect());
}

#[test]
fn pages_are_run_or_only_include() {
    for page in contents() {
        let text = chapter(&page);
        let run = CHAPTERS.contains(&page.as_str());
        assert!(run || blocks(&text).is_empty(), "{page} is not run");
    }
}

#[test]
fn links_and_includes_lead_somewhere() {
    let mut wrong = Vec::new();
    for page in contents() {
        let text = resolved(&page);
        wrong.extend(targets(&text).iter().filter_map(|t| broken(&page, t)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn broken_links_are_found() {
    let first = &contents()[0];
    assert_eq!(
        targets("[a](b.md) ```x``` ![c](d.png)\n```\n[e](f)\n```"),
        ["b.md", "d.png"]
    );
    assert!(broken(first, "nowhere.md").is_some());
    assert!(broken(first, "../../verdict.md").is_some());
    assert!(broken(first, "nowhere.png").is_some());
    assert!(broken(first, "verdict.md#nothing").is_some());
    assert!(broken(first, "verdict.md#overlap").is_none());
    assert!(broken(first, "../../demo.png").is_none());
    assert_eq!(identifier("## What it *is*, A-b"), "what-it-is-a-b");
}

/// What Markdown would take for its own in the formulas of a text: items of lists, and backslashes
/// before signs.
fn spoiled(text: &str) -> Vec<&str> {
    let mut inside = false;
    let lines = text.lines().filter(|line| {
        let begins = line.contains(r"\\[");
        let item = (inside || begins) && line.trim_start().starts_with(['+', '-', '*', '#', '>']);
        inside = (inside || begins) && !line.contains(r"\\]");
        let rest = line.replace(r"\\", "");
        let signs = rest.split('\\').skip(1);
        let escaped = signs.filter(|rest| rest.starts_with(|c: char| c.is_ascii_punctuation()));
        item || escaped.count() > 0
    });
    lines.collect()
}

#[test]
fn formulas_survive_markdown() {
    for page in contents() {
        if CHAPTERS.contains(&page.as_str()) {
            let text = chapter(&page);
            assert_eq!(spoiled(&text), [""; 0], "{page}");
        }
    }
    assert_eq!(spoiled(r"a \\( x_{i}\\,y \\)"), [""; 0]);
    assert_eq!(spoiled(r"a \\( x\,y \\)").len(), 1);
    assert_eq!(spoiled("\\\\[ a\n  + b \\\\]\n- c"), ["  + b \\\\]"]);
}

/// The subcommands that the program lists.
fn subcommands() -> Vec<String> {
    let help = succeeded(&Place::new().run(&["--help"]));
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let lines = list.lines().take_while(|line| !line.is_empty());
    lines
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .map(|line| line.split_whitespace().next().unwrap().to_owned())
        .filter(|name| name != "help")
        .collect()
}

#[test]
fn every_subcommand_is_shown() {
    let (guide, commands) = (guide(), subcommands());
    assert!(commands.len() > 15, "{commands:?}");
    let missing: Vec<_> = commands
        .iter()
        .filter(|name| !guide.contains(&format!("shapespace {name}")))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_parameter_is_explained() {
    let text = chapter("parameters");
    for command in ["average", "geodesic", "pca"] {
        let config = succeeded(&Place::new().run(&["config", command]));
        let keys: Vec<&str> = config.lines().filter_map(key).collect();
        assert!(keys.len() > 5, "{config}");
        for key in keys {
            let option = format!("`--{}", key.replace('_', "-"));
            assert!(text.contains(&option), "{option} of {command}");
        }
    }
}

/// The key that a line of a configuration sets, if any, and if it is no input.
fn key(line: &str) -> Option<&str> {
    let (key, _) = line.trim_start_matches("# ").split_once(" = ")?;
    let named = key.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    (named && !["inputs", "start", "end", "average"].contains(&key)).then_some(key)
}

#[test]
fn every_doubt_has_an_answer() {
    let guide = guide();
    for cause in Cause::ALL {
        let name = serde_json::to_value(cause).unwrap();
        let name = name.as_str().unwrap();
        assert!(guide.contains(&format!("`{name}`")), "{name}");
    }
}

#[test]
fn pictures_of_the_guide_are_small() {
    let entries = std::fs::read_dir(source()).unwrap();
    for path in entries.map(|entry| entry.unwrap().path()) {
        let picture = path.extension().is_some_and(|e| e == "png");
        let size = std::fs::metadata(&path).unwrap().len();
        assert!(!picture || size <= 60_000, "{}: {size}", name_of(&path));
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}
