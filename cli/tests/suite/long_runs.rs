//! Averages that are stopped, go on, or need much memory.

use crate::average::{averaged, check};
use crate::common::{Place, Results, drawn, succeeded};
#[cfg(target_os = "linux")]
use crate::common::{arrays, interrupted, killed};

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
    assert_eq!(place.listing(), ["crosses", "out"]);
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
        state["nodes"][0].as_u64() >= Some(65)
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

/// Arrays, tables and records are equal, but for times and memory.
#[cfg(target_os = "linux")]
fn assert_same(one: &Results, other: &Results) {
    assert!(arrays(one) == arrays(other));
    let table = |results: &Results| std::fs::read_to_string(results.path("energy.csv")).unwrap();
    assert_eq!(table(one), table(other));
    assert_eq!(timeless(one.json.clone()), timeless(other.json.clone()));
}

/// A record without times and memory.
#[cfg(target_os = "linux")]
fn timeless(mut value: serde_json::Value) -> serde_json::Value {
    match &mut value {
        serde_json::Value::Object(entries) => {
            entries.retain(|key, _| !key.contains("seconds") && key != "peak_memory_bytes");
            for entry in entries.values_mut() {
                *entry = timeless(entry.take());
            }
        }
        serde_json::Value::Array(items) => {
            for item in items {
                *item = timeless(item.take());
            }
        }
        _ => {}
    }
    value
}

/// Wherever an average is killed, again and again, it ends with the bits of one that is not.
#[cfg(target_os = "linux")]
#[test]
fn averages_resume_to_the_same_bits() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let common = ["--grid", "65", "--align", "none", "--tolerance", "2e-3"];
    for options in [
        &[][..],
        &["--mean", "median"],
        &["--weights", "0.25,0.75,0,0"],
        &["--memory", "2MiB"],
    ] {
        let run = |output| {
            let mut arguments = vec!["average", "-o", output, "--checkpoint", "1e-6"];
            arguments.extend(common.iter().chain(options));
            arguments.extend(inputs.iter().map(String::as_str));
            arguments
        };
        succeeded(&place.compute(&run("whole")));
        let whole = Results::read(&place.path("whole"));
        let state = place.path("out.partial/state.json");
        // Killed at each of these checkpoints; the numbers of checkpoints grow over all runs.
        for number in [0, 2, 4] {
            killed(&place, &run("out"), || {
                let text = std::fs::read_to_string(&state).unwrap_or_default();
                let state: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
                state["checkpoint"].as_u64() >= Some(number)
            });
        }
        let last = place.compute(&run("out"));
        let report = String::from_utf8_lossy(&last.stderr).into_owned();
        succeeded(&last);
        assert!(report.contains("going on from the checkpoint"), "{report}");
        assert_same(&Results::read(&place.path("out")), &whole);
        for output in ["out", "whole"] {
            std::fs::remove_dir_all(place.path(output)).unwrap();
        }
    }
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
