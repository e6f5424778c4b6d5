//! What is said of a run, and to whom.

use serde_json::Value;

use crate::common::{Place, draw};

fn disks(place: &Place) {
    for (name, radius) in [("a.npy", ".2"), ("b.npy", ".3")] {
        draw(place, name, &["disk", "--radius", radius, "--grid", "33"]);
    }
}

/// The fields of the lines of an event, as they are documented.
fn documented(event: &str) -> Vec<String> {
    let text = include_str!("../../../docs/formats.md");
    let row = text.lines().find_map(|line| {
        let row = line.strip_prefix(&format!("| `{event}` | "))?;
        row.split_once(" | ").map(|(fields, _)| fields)
    });
    let row = row.unwrap_or_else(|| panic!("'{event}' is not documented"));
    let words = row.split('`').skip(1).step_by(2);
    words
        .chain(["seconds", "event"])
        .map(str::to_owned)
        .collect()
}

/// The lines of standard error, all of which have to be objects of documented fields.
fn lines(errors: &[u8]) -> Vec<Value> {
    let text = String::from_utf8(errors.to_vec()).unwrap();
    let parsed = text.lines().map(|line| {
        let value: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"));
        assert!(
            value["event"].is_string() && value["seconds"].is_f64(),
            "{line}"
        );
        let known = documented(value["event"].as_str().unwrap());
        for field in value.as_object().unwrap().keys() {
            assert!(known.contains(field), "{field}: {line}");
        }
        value
    });
    parsed.collect()
}

/// Whoever has not enough memory need not wait for what comes to nothing.
#[test]
fn every_command_states_its_memory_before_it_computes() {
    let place = Place::new();
    disks(&place);
    for (name, radius) in [("c.npy", ".25"), ("d.npy", ".32")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "33"]);
    }
    place.write("groups.csv", b"shape,group\na,x\nb,y\nc,x\nd,y\n");
    let few = "--grid 17 --max-iterations 2";
    for (command, out) in [
        (format!("average a.npy b.npy c.npy d.npy {few}"), "mean"),
        (format!("average a.npy b.npy --sweep 3 {few}"), "sweep"),
        (format!("average --joint a.npy b.npy {few}"), "joint"),
        (format!("geodesic a.npy b.npy -K 2 {few}"), "path"),
        (format!("length a.npy c.npy b.npy {few}"), "length"),
        (format!("length a.npy b.npy --no-geodesic {few}"), "given"),
        ("metric a.npy --mode 2 --grid 17".into(), "metric"),
        ("extend path -K 1".into(), "beyond"),
        ("transport path c.npy --steps 1".into(), "beside"),
        (format!("distances a.npy b.npy -K 1 {few}"), "distances"),
        (format!("segment a.npy {few}"), "found"),
        ("pca mean".into(), "modes"),
        ("synthesize modes --scores 1".into(), "shape"),
        ("score b.npy --pca modes".into(), "scores"),
        (
            "compare modes --groups groups.csv --permutations 99".into(),
            "groups",
        ),
        (format!("figure weights a.npy b.npy c.npy {few}"), "figure"),
    ] {
        let words: Vec<&str> = command.split_whitespace().collect();
        let log = ["--log", "json", "-o", out];
        let run = place.compute(&[&words[..], &log].concat());
        let found = lines(&run.stderr);
        assert_eq!(run.status.code(), Some(0), "{command}: {found:?}");
        let begins = |event: &str, text: &str| {
            found.iter().position(|line| {
                let starts = |found: &str| found.starts_with(text);
                line["event"] == event && line["text"].as_str().is_none_or(starts)
            })
        };
        let memory = begins("note", "memory: about");
        let memory = memory.unwrap_or_else(|| panic!("{command}: {found:?}"));
        let first = [
            begins("stage", "level "),
            begins("stage", "equation "),
            begins("iteration", ""),
        ];
        for first in first.into_iter().flatten() {
            assert!(memory < first, "{command}: {found:?}");
        }
    }
}

#[test]
fn a_log_has_an_object_a_line_and_ends_with_the_result() {
    let place = Place::new();
    disks(&place);
    let inputs = [
        "average", "a.npy", "b.npy", "--grid", "33", "-o", "out", "--log", "json",
    ];
    let run = place.run(&inputs);
    let found = lines(&run.stderr);
    let count = |name: &str| found.iter().filter(|line| line["event"] == name).count();
    assert!(
        count("stage") > 2 && count("iteration") > 5 && count("note") > 0,
        "{found:?}"
    );
    assert_eq!((count("result"), count("error")), (1, 0));
    let times: Vec<f64> = found
        .iter()
        .map(|line| line["seconds"].as_f64().unwrap())
        .collect();
    assert!(times.is_sorted());
    let energies = found.iter().filter_map(|line| line["energy"].as_f64());
    assert!(energies.clone().all(|energy| energy > 0.0) && energies.count() > 5);
    let last = found.last().unwrap();
    assert_eq!(last["directory"], "out");
    let result: Value =
        serde_json::from_slice(&std::fs::read(place.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(last["verdict"], result["verdict"]);
    assert_eq!(last["doubts"], result["doubts"].as_array().unwrap().len());
    assert_eq!(last["exit_code"], run.status.code().unwrap());
    // The summary is where it always is.
    assert!(String::from_utf8(run.stdout).unwrap().contains("verdict"));
}

#[test]
fn a_log_ends_with_the_error() {
    let place = Place::new();
    disks(&place);
    std::fs::write(place.path("broken.png"), "no picture").unwrap();
    let run = place.run(&[
        "average",
        "a.npy",
        "broken.png",
        "-o",
        "out",
        "--log",
        "json",
    ]);
    assert_eq!(run.status.code(), Some(2));
    let found = lines(&run.stderr);
    let last = found.last().unwrap();
    assert_eq!(
        (&last["event"], &last["exit_code"]),
        (&"error".into(), &2.into())
    );
    assert!(
        last["message"].as_str().unwrap().contains("broken.png"),
        "{last}"
    );
    assert!(!last["help"].as_str().unwrap().is_empty());
}

/// What is wrong with options and folders is found before the inputs are read, and is in the log, too.
#[test]
fn errors_of_options_are_in_the_log() {
    let place = Place::new();
    disks(&place);
    for command in [
        "average a.npy b.npy --mu -1",
        "average a.npy nowhere",
        "geodesic a.npy b.npy -K 0",
        "length a.npy b.npy -K 1000",
        "distances a.npy",
        "extend a.npy -K 0",
        "figure weights a.npy b.npy c.npy --max-iterations 0",
        "warp nowhere a.npy",
    ] {
        let words: Vec<&str> = command.split_whitespace().collect();
        let run = place.run(&[&words[..], &["-o", "out", "--log", "json"]].concat());
        assert_eq!(run.status.code(), Some(2), "{command}");
        let found = lines(&run.stderr);
        let errors = found.iter().filter(|line| line["event"] == "error");
        assert_eq!(errors.count(), 1, "{command}: {found:?}");
        assert_eq!(found.last().unwrap()["event"], "error");
    }
}

#[test]
fn quiet_runs_have_a_summary_and_errors_only() {
    let place = Place::new();
    disks(&place);
    let inputs = ["average", "a.npy", "b.npy", "--grid", "33"];
    let run = place.run(&[&inputs[..], &["-o", "out", "--quiet"]].concat());
    assert!(
        run.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert!(!run.stdout.is_empty());
    let again = place.run(&[&inputs[..], &["-o", "out", "--quiet"]].concat());
    assert_eq!(again.status.code(), Some(2));
    let report = String::from_utf8(again.stderr).unwrap();
    assert!(report.contains("'out'"), "{report}");
    let both = place.run(&[&inputs[..], &["-o", "new", "--quiet", "--log", "json"]].concat());
    assert_eq!(both.status.code(), Some(2));
}
