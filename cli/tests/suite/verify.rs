//! `shapespace verify`: every statement holds, and none does with a broken ingredient.

use std::collections::BTreeSet;
use std::process::Output;

use crate::common::Place;
use serde_json::Value;

fn ran(place: &Place, arguments: &[&str]) -> Output {
    let output = place.run(arguments);
    eprintln!("{}", String::from_utf8_lossy(&output.stderr));
    output
}

fn statements(place: &Place, directory: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(place.path(directory).join("result.json")).unwrap();
    let record: Value = serde_json::from_str(&text).unwrap();
    record["statements"].as_array().unwrap().clone()
}

fn text(value: &Value, key: &str) -> String {
    value[key]
        .as_str()
        .unwrap_or_else(|| panic!("no {key} in {value}"))
        .to_owned()
}

/// The names that `--list` gives.
fn listed(place: &Place) -> BTreeSet<String> {
    let output = place.run(&["verify", "--list"]);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines()
        .map(|line| line.split_whitespace().next().unwrap().to_owned())
        .collect()
}

/// Statements of which some hypothesis is known not to be met.
const NOT_COVERED: [&str; 2] = ["existence-average-logdet", "existence-bounded-linear"];

/// Asserts that a run of all statements, written to `directory`, confirms them. The test of the
/// README makes one, and no test makes another.
pub(crate) fn assert_every_statement_holds(place: &Place, output: &Output, directory: &str) {
    let found = statements(place, directory);
    let names: BTreeSet<String> = found.iter().map(|s| text(s, "name")).collect();
    assert_eq!(names, listed(place));
    for statement in &found {
        let name = text(statement, "name");
        let expected = if NOT_COVERED.contains(&name.as_str()) {
            "not_covered"
        } else {
            "confirmed"
        };
        let measured = format!("{}: {}", statement["observable"], statement["measured"]);
        assert_eq!(text(statement, "verdict"), expected, "{name}: {measured}");
        assert!(
            !statement["figures"].as_array().unwrap().is_empty(),
            "{name}"
        );
        for key in ["reference", "claim", "expected", "measured"] {
            assert!(!text(statement, key).is_empty(), "{name}: {key}");
        }
        if expected == "not_covered" {
            assert!(!text(statement, "hypothesis").is_empty());
        }
    }
    assert!(output.status.success());
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(names.iter().all(|name| table.contains(name.as_str())));
    let written = place.path(directory);
    let report = std::fs::read_to_string(written.join("report.html")).unwrap();
    assert!(names.iter().all(|name| report.contains(name.as_str())));
    // Orders are plotted, and the plots stand in the report.
    assert!(written.join("plots/dissipation-balls-2d.svg").is_file());
    assert!(report.matches("<svg").count() > 10);
    for file in ["table.md", "figures.csv", "lines.csv"] {
        assert!(written.join(file).is_file(), "{file}");
    }
}

#[test]
fn no_statement_survives_a_broken_ingredient() {
    let place = Place::new();
    let output = ran(&place, &["verify", "--quick", "--broken", "-o", "found"]);
    for statement in statements(&place, "found") {
        let name = text(&statement, "name");
        assert_eq!(text(&statement, "verdict"), "refuted", "{name}");
        assert!(!text(&statement, "broken_ingredient").is_empty());
        // A figure tells, and the record says which.
        let figures = statement["figures"].as_array().unwrap();
        let of = |f: &&Value| f["holds"] == false;
        assert_eq!(
            figures.iter().find(of).unwrap()["observable"],
            statement["observable"],
            "{name}"
        );
    }
    assert!(output.status.success());
}

#[test]
fn results_do_not_depend_on_the_threads() {
    let place = Place::new();
    let names = ["dissipation-flow", "linear-response", "average-equilibrium"];
    let figures = |threads: &str| {
        let directory = format!("on_{threads}");
        let mut arguments = vec!["verify", "--quick", "--threads", threads, "-o", &directory];
        arguments.extend(names);
        assert!(ran(&place, &arguments).status.success());
        let found = statements(&place, &directory);
        found
            .into_iter()
            .map(|s| s["figures"].clone())
            .collect::<Vec<_>>()
    };
    let one = figures("1");
    assert_eq!(one.len(), names.len());
    assert_eq!(one, figures("3"));
}

#[test]
fn names_that_there_are_not_are_told_their_neighbours() {
    let place = Place::new();
    let output = place.run(&["verify", "misprint-densty", "-o", "found"]);
    assert_eq!(output.status.code(), Some(2));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.contains("misprint-density"), "{errors}");
    assert!(place.listing().is_empty());
    // Without a place for results there is nothing to do.
    assert_eq!(place.run(&["verify"]).status.code(), Some(2));
}
