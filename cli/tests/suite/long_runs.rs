//! Averages that are stopped, go on, or need much memory.

use crate::average::{averaged, check};
use crate::common::{Place, Results, drawn, succeeded};
#[cfg(target_os = "linux")]
use crate::common::{interrupted, killed};
#[cfg(target_os = "linux")]
use crate::resume::assert_same;

/// Ctrl-C ends the minimisation, and what has been reached is written.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_writes_what_is_reached() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    // Far too fine to end by itself in the time of this test.
    let mut arguments = vec!["average", "--grid", "1025", "-o", "out"];
    arguments.extend(inputs.iter().map(String::as_str));
    assert_eq!(interrupted(&place, &arguments, "level 1 of"), Some(130));
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["status"], "cancelled");
    let nodes = results.numbers("/nodes")[0] as u64;
    assert!(nodes < 1025);
    check(&results, 4, &[nodes, nodes]);
    let listing = place.listing();
    assert!(
        listing.starts_with(&["crosses".to_owned(), "out".to_owned()]),
        "{listing:?}"
    );
}

/// After Ctrl-C the same command goes on to the bits of a run that is not interrupted; what was reached is kept.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_goes_on() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let run = |output| {
        let mut arguments = vec!["average", "--grid", "129", "-o", output];
        arguments.extend(inputs.iter().map(String::as_str));
        arguments
    };
    assert_eq!(interrupted(&place, &run("out"), "level 2 of"), Some(130));
    let interrupted = Results::read(&place.path("out"));
    assert_eq!(interrupted.json["status"], "cancelled");
    assert_eq!(place.listing(), ["crosses", "out", "out.partial"]);

    let run_again = place.run(&run("out"));
    succeeded(&run_again);
    let report = String::from_utf8_lossy(&run_again.stderr).into_owned();
    assert!(report.contains("going on from the checkpoint"), "{report}");
    assert_eq!(place.listing(), ["crosses", "out", "out.interrupted"]);
    assert_eq!(
        Results::read(&place.path("out.interrupted")).json,
        interrupted.json
    );
    succeeded(&place.compute(&run("whole")));
    assert_same(
        &Results::read(&place.path("out")),
        &Results::read(&place.path("whole")),
    );
}

/// A run that is killed leaves a checkpoint, from which the same command goes on; another command does
/// not, and in the end nothing is left but the result.
#[cfg(target_os = "linux")]
#[test]
fn a_killed_run_goes_on_from_its_checkpoint() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let mut arguments = vec![
        "average",
        "--grid",
        "129",
        "--checkpoint",
        "1e-6",
        "-o",
        "out",
    ];
    arguments.extend(inputs.iter().map(String::as_str));
    let state = place.path("out.partial/state.json");
    killed(&place, &arguments, || {
        let text = std::fs::read_to_string(&state).unwrap_or_default();
        let state: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
        state["nodes"].as_u64() >= Some(65)
    });
    assert!(state.is_file() && !place.path("out").exists());
    let mut other = arguments.clone();
    other[2] = "65";
    let refused = place.run(&other);
    let report = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{report}");
    assert!(report.contains("129 there, 65 here"), "{report}");

    let run = place.run(&arguments);
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    succeeded(&run);
    assert!(report.contains("going on from the checkpoint"), "{report}");
    assert_eq!(place.listing(), ["crosses", "out"]);
    let resumed = Results::read(&place.path("out"));
    check(&resumed, 4, &[129, 129]);
    let whole = averaged(&place, &inputs, &["--grid", "129"], "whole");
    assert_same(&resumed, &whole);
}

/// `--start` begins with the deformations of a result.
#[test]
fn a_result_is_the_start_of_another() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "65");
    let coarse = averaged(&place, &inputs, &["--grid", "17"], "coarse");
    let go_on = |grid: &str, output: &str| {
        let mut arguments = vec!["average", "--start", "coarse", "--grid", grid, "-o", output];
        arguments.extend(inputs.iter().map(String::as_str));
        let run = place.compute(&arguments);
        succeeded(&run);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        (Results::read(&place.path(output)), report)
    };
    let (fine, report) = go_on("33", "fine");
    check(&fine, 4, &[33, 33]);
    assert_eq!(fine.json["parameters"]["start"], "coarse");
    assert!(!report.contains("lay elsewhere"), "{report}");
    // Arrays of 65 nodes a side are nodal values on that grid, and fitted on others.
    let (_, report) = go_on("65", "nodal");
    assert!(report.contains("lay elsewhere"), "{report}");
    let levels = fine.json["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 2);
    assert!(levels[0]["iterations"].as_u64().unwrap() <= 5);
    assert!(coarse.json["parameters"]["start"].is_null());
    let mut arguments = vec!["average", "-o", "none", "--grid", "65", "--start"];
    for (start, inputs, word) in [
        ("crosses", &inputs[..], "0 deformations"),
        ("coarse", &inputs[..3], "4 deformations"),
        ("missing", &inputs[..], "missing"),
    ] {
        arguments.truncate(6);
        arguments.push(start);
        arguments.extend(inputs.iter().map(String::as_str));
        let run = place.run(&arguments);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
    let mut arguments = vec!["average", "-o", "none", "--grid", "17", "--start", "fine"];
    arguments.extend(inputs.iter().map(String::as_str));
    let report = String::from_utf8_lossy(&place.run(&arguments).stderr).into_owned();
    assert!(report.contains("9, 17"), "{report}");
}

/// What does not fit into the memory that is allowed goes to files, which nobody sees; the results
/// are the same.
#[test]
fn memory_is_saved_when_asked_for() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let plain = averaged(&place, &inputs, &["--grid", "33"], "plain");
    let needed = plain.number("/memory_estimate/memory");
    assert!(plain.number("/memory_estimate/files") == 0.0);
    let limit = (needed - 1.0).to_string();
    let spilled = averaged(
        &place,
        &inputs,
        &["--grid", "33", "--memory", &limit],
        "spilled",
    );
    assert!(spilled.number("/memory_estimate/memory") < needed);
    assert!(spilled.number("/memory_estimate/files") > 0.0);
    for array in ["average.npy", "deformation_001.npy"] {
        assert!(plain.array(array) == spilled.array(array), "{array}");
    }
    assert_eq!(place.listing(), ["crosses", "plain", "spilled"]);

    let mut arguments = vec![
        "average", "-o", "none", "--grid", "33", "--memory", "300KiB",
    ];
    arguments.extend(inputs.iter().map(String::as_str));
    let refused = place.run(&arguments);
    let report = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{report}");
    assert!(
        report.contains("300.0 KiB") && report.contains("--grid"),
        "{report}"
    );
    assert_eq!(place.listing(), ["crosses", "plain", "spilled"]);
}
