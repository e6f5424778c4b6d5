//! `report.html`: a result in one page that loads nothing, made of what its directory has.

mod boundary;
mod leads;
mod map;
mod mesh;
mod modes;
mod overlay;
mod overview;
mod pictures;
mod repeat;
mod scene;
mod source;
mod tables;
mod values;

use shapespace_report::html::{Markup, Page};

use crate::output::{OutputError, ResultDir, write_text};
use crate::report::PAGE;
use crate::summary::Summary;
use source::Source;

const STYLE: &str = include_str!("assets/page.css");
/// The scripts, each for the elements of one kind.
const SCRIPT: &str = concat!(
    "\n'use strict';\n",
    include_str!("assets/common.js"),
    include_str!("assets/player.js"),
    include_str!("assets/viewer.js"),
    include_str!("assets/map.js"),
);

/// Writes the report of an incomplete directory, unless it does without such files. What the
/// directory does not have is left out.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_page(
    directory: &ResultDir,
    summary: &Summary,
    command_line: Option<&str>,
) -> Result<(), OutputError> {
    directory.with_file(PAGE, |path| {
        let source = Source::read(directory.path(), summary, command_line);
        let source = source.map_err(OutputError::at(directory.path()))?;
        write_text(path, &page(&source))
    })
}

/// The command line of this process.
pub(crate) fn command_line() -> String {
    let mut arguments = std::env::args_os();
    // As it is called, wherever it lies.
    let program = arguments.next().map(|_| "shapespace".into());
    repeat::quoted(program.into_iter().chain(arguments))
}

/// The page of a result.
fn page(source: &Source<'_>) -> String {
    let lead = leads::lead(&source.record);
    // The first that asks gets room: what shows most comes first.
    let main = pictures::main(source);
    let turning = scene::scenes(source);
    let others = pictures::others(source);
    let body: Markup = [
        overview::overview(source, lead),
        main,
        turning,
        map::map(source),
        others,
        overview::shapes(source, lead),
        tables::tables(source),
        repeat::repeat(source),
    ]
    .into_iter()
    .collect();
    let page = Page {
        title: source.summary.title(),
        style: STYLE,
        script: SCRIPT,
        body,
    };
    page.document()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use serde_json::{Value, json};

    use super::*;
    use crate::doubts::{DoubtRecord, named};
    use crate::output::write_json;
    use crate::report::Record;
    use levelset::{Cause, Doubt};
    use shapespace_picture::Canvas;

    const EVIL: &str = "<img src=x onerror=\"alert(1)\"></script>'&";

    /// Elements that have no end.
    const SINGLE: [&str; 5] = ["meta", "img", "input", "br", "circle"];

    /// The page is well formed: every element is closed, in order; scripts and styles are not read.
    fn assert_well_formed(page: &str) {
        let mut open: Vec<&str> = Vec::new();
        let mut rest = page.strip_prefix("<!DOCTYPE html>").unwrap();
        while let Some(start) = rest.find('<') {
            let text = &rest[..start];
            assert!(!text.contains('>'), "{text}");
            let end = start + rest[start..].find('>').unwrap();
            let tag = &rest[start + 1..end];
            rest = &rest[end + 1..];
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name));
                continue;
            }
            let name = tag.split([' ', '/']).next().unwrap();
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            if SINGLE.contains(&name) {
                assert!(tag.ends_with('/'), "{tag}");
                continue;
            }
            open.push(name);
            if ["script", "style"].contains(&name) {
                rest = &rest[rest.find(&format!("</{name}>")).unwrap()..];
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    /// Everything that the page shows lies in it.
    fn assert_self_contained(page: &str) {
        assert!(!page.contains("http://") && !page.contains("https://"));
        for (place, _) in page.match_indices("src=\"") {
            assert!(page[place..].starts_with("src=\"data:image/"), "{place}");
        }
        assert!(!page.contains("<link") && !page.contains("@import") && !page.contains("url("));
        assert!(page.contains("default-src &#39;none&#39;"));
    }

    fn doubts() -> Vec<DoubtRecord> {
        let doubt = Doubt::check(Cause::Overlap, 0.5).unwrap();
        named(&[doubt.about(0)], [EVIL])
    }

    fn summary(doubts: Vec<DoubtRecord>) -> Summary {
        let record = Record::<(), Value, 2> {
            version: "1".into(),
            command: String::new(),
            status: "converged".into(),
            verdict: levelset::Verdict::of(&doubts),
            doubts,
            dimension: 2,
            nodes: Vec::new(),
            spacing: None,
            spacing_input_units: None,
            input: Vec::new(),
            world: None,
            parameters: (),
            body: Value::Null,
            seconds: 1.0,
            peak_memory_bytes: None,
        };
        Summary::new(&record, "matrix.png", format!("Distances of {EVIL}"))
    }

    /// The page of a directory with these files, and with a record.
    fn page_of(record: &Value, summary: &Summary, files: &[(&str, &[u8])]) -> String {
        let place = tempfile::tempdir().unwrap();
        let directory = ResultDir::create(&place.path().join("out")).unwrap();
        write_json(&directory.file("result.json"), record).unwrap();
        for (name, bytes) in files {
            fs::write(directory.file(Path::new(name)), bytes).unwrap();
        }
        write_page(&directory, summary, Some(EVIL)).unwrap();
        fs::read_to_string(directory.file("report.html")).unwrap()
    }

    fn distances() -> Value {
        json!({
            "command": "distances", "version": "1", "status": EVIL, "dimension": 2,
            "input": [
                {"name": EVIL, "path": EVIL, "class": EVIL},
                {"name": "b", "path": "b.png", "class": "plain"},
            ],
            "clustering": {"order": [1, 0], "labels": [0, 1]},
            "embedding": {"points": [[0.0, 0.0], [1.0, 0.5]]},
        })
    }

    #[test]
    fn no_name_of_a_file_becomes_markup() {
        let mut summary = summary(doubts());
        summary.line("shapes", EVIL);
        summary.marks = vec![Canvas::new(4, 4); 2];
        let quoted = EVIL.replace('"', "\"\"");
        let table = format!(",\"{quoted}\",b\n\"{quoted}\",0,0.5\nb,,0\n");
        let png = Canvas::new(8, 8).png().unwrap();
        let page = page_of(
            &distances(),
            &summary,
            &[
                ("distances.csv", table.as_bytes()),
                ("config.toml", EVIL.as_bytes()),
                ("matrix.png", &png),
                ("<b>\" onload='.png", &png),
            ],
        );
        assert_well_formed(&page);
        assert_self_contained(&page);
        assert!(!page.contains("<img src=x") && !page.contains("<b>"));
        let letters = page.matches("&lt;img src=x onerror=&quot;").count();
        // Title twice, status, doubt, summary twice, table of shapes three times, table of distances
        // twice, command line, configuration.
        assert!(letters >= 12, "{letters}");
        // In the data of the script: name, class.
        assert_eq!(page.matches("\\u003cimg src=x onerror=\\\"").count(), 2);
    }

    #[test]
    fn the_verdict_leads_with_doubts_and_remedies() {
        let record = json!({"command": "average", "energy": {"total": 0.25}, "dice": [0.5, 0.75]});
        let page = page_of(&record, &summary(doubts()), &[]);
        let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text}"));
        let verdict = place("verdict fair");
        assert!(verdict < place("sound is at least 0.960"));
        assert!(place("sound is at least 0.960") < place("Remedy: "));
        assert!(place("Remedy: ") < place("<dt>energy</dt><dd>0.2500</dd>"));
        assert!(page.contains("<dt>Dice, least</dt><dd>0.5000</dd>"));
        let sound = page_of(&record, &summary(Vec::new()), &[]);
        assert!(sound.contains("verdict good") && !sound.contains("Remedy"));
    }

    #[test]
    fn what_is_missing_or_damaged_is_left_out() {
        let bare = page_of(&json!({}), &summary(Vec::new()), &[]);
        assert_well_formed(&bare);
        let mut record = distances();
        record["command"] = "pca".into();
        record["dimension"] = 3.into();
        let damaged = page_of(
            &record,
            &summary(Vec::new()),
            &[
                ("object.npy", b"no array"),
                ("average.stl", b"no surface"),
                ("energy.csv", b"\xff\xfe"),
                ("mode_000.apng", b"no picture"),
            ],
        );
        assert_well_formed(&damaged);
        assert_self_contained(&damaged);
        let broken = page_of(
            &distances(),
            &summary(Vec::new()),
            &[("distances.csv", b"")],
        );
        assert_well_formed(&broken);
    }

    #[test]
    fn a_file_without_room_is_named() {
        let large = vec![0; 6_000_000];
        let files: [(&str, &[u8]); 2] = [("a.png", &large), ("b.svg", b"<svg/>")];
        let page = page_of(&json!({}), &summary(Vec::new()), &files);
        assert!(page.len() < 200_000);
        assert!(page.contains("a.png: too large for this page"));
        assert!(page.contains("data:image/svg+xml;base64,PHN2Zy8+"));
    }
}
