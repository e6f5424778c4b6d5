//! Commands that are killed go on from their checkpoints, to the bits of a run that is not interrupted.

#![cfg(target_os = "linux")]

use std::fs;
use std::time::Duration;

use serde_json::Value;

use crate::common::{Place, Results, arrays, draw, drawn, killed, spawn, succeeded};

/// Arrays, tables and records are equal, but for times and memory.
pub fn assert_same(one: &Results, other: &Results) {
    assert!(arrays(one) == arrays(other));
    let table = |results: &Results| fs::read_to_string(results.path("energy.csv")).ok();
    assert_eq!(table(one), table(other));
    assert_eq!(timeless(one.json.clone()), timeless(other.json.clone()));
}

/// A record without times and memory.
fn timeless(mut value: Value) -> Value {
    match &mut value {
        Value::Object(entries) => {
            let others = ["peak_memory_bytes", "record_sha256"];
            entries.retain(|key, _| !key.contains("seconds") && !others.contains(&&**key));
            for entry in entries.values_mut() {
                *entry = timeless(entry.take());
            }
        }
        Value::Array(items) => {
            for item in items {
                *item = timeless(item.take());
            }
        }
        _ => {}
    }
    value
}

/// Kills a command at its first checkpoint, and again at later ones; then it has the result of a run that
/// is not interrupted. Returns the number of times that it was killed.
fn check(place: &Place, command: &[&str]) -> usize {
    let with = |options: &[&'static str]| [command, options].concat();
    succeeded(&place.compute(&with(&["-o", "whole"])));
    let whole = Results::read(&place.path("whole"));
    let state = place.path("out.partial/state.json");
    let mut kills = 0;
    // The numbers of checkpoints grow over all runs.
    for number in [0, 1, 2, 4, 9, 20] {
        let mut child = spawn(place, &with(&["-o", "out", "--checkpoint", "1e-6"]));
        let reached = || {
            let text = fs::read_to_string(&state).unwrap_or_default();
            let state: Value = serde_json::from_str(&text).unwrap_or_default();
            state["checkpoint"].as_u64() >= Some(number)
        };
        while !reached() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(300));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        if place.path("out").exists() {
            break;
        }
        kills += 1;
    }
    if !place.path("out").exists() {
        let last = place.compute(&with(&["-o", "out"]));
        let report = String::from_utf8_lossy(&last.stderr).into_owned();
        succeeded(&last);
        assert!(report.contains("going on from the checkpoint"), "{report}");
    }
    assert!(!place.path("out.partial").exists());
    assert_same(&Results::read(&place.path("out")), &whole);
    for output in ["out", "whole"] {
        fs::remove_dir_all(place.path(output)).unwrap();
    }
    println!("{command:?}: {kills} kills");
    kills
}

#[test]
fn averages_resume_to_the_same_bits() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let common = ["--grid", "33", "--align", "none", "--tolerance", "2e-3"];
    for options in [
        &[][..],
        &["--mean", "median"],
        &["--box", "fit"],
        &["--weights", "0.25,0.75,0,0"],
        &["--memory", "2MiB"],
        // It would go on to its limit of iterations: few show as much as many.
        &["--solver", "descent", "--max-iterations", "40"],
    ] {
        let mut arguments = vec!["average"];
        arguments.extend(inputs.iter().map(String::as_str));
        arguments.extend(common.iter().chain(options));
        assert!(check(&place, &arguments) > 1, "{options:?}");
    }
    let mut sweep = vec!["average", "--sweep", "4", "--grid", "33", "--align", "none"];
    sweep.extend(inputs[..2].iter().map(String::as_str));
    assert!(check(&place, &sweep) > 1, "{}", line!());
}

#[test]
fn joint_averages_resume_to_the_same_bits() {
    let place = Place::new();
    for (name, radius) in [("a.npy", ".2"), ("b.npy", ".26")] {
        let disk = ["disk", "--radius", radius, "--grid", "33"];
        let grey = ["--contrast", ".6", "--noise", ".03"];
        draw(&place, name, &[&disk[..], &grey[..]].concat());
    }
    let joint = ["average", "--joint", "a.npy", "b.npy", "--grid", "33"];
    assert!(check(&place, &joint) > 1, "{}", line!());
}

#[test]
fn paths_resume_to_the_same_bits() {
    let place = Place::new();
    draw(&place, "straight.png", &["bar", "--grid", "65"]);
    draw(
        &place,
        "folded.png",
        &["bar", "--angle", "160", "--grid", "65"],
    );
    let path = ["geodesic", "straight.png", "folded.png", "--grid", "33"];
    let level_sets = [&path[..], &["-K", "2", "--form", "level-sets"]].concat();
    assert!(check(&place, &level_sets) > 1, "{}", line!());
    let domain = [&path[..], &["-K", "3"]].concat();
    assert!(check(&place, &domain) > 1, "{}", line!());
    let starts = [&domain[..], &["--starts", "2"]].concat();
    assert!(check(&place, &starts) > 1, "{}", line!());
    succeeded(&place.compute(&[&domain[..], &["-o", "folding"]].concat()));
    assert!(
        check(&place, &["extend", "folding", "--steps", "3"]) > 1,
        "{}",
        line!()
    );
    draw(
        &place,
        "raised.png",
        &["bar", "--angle", "170", "--grid", "65"],
    );
    let transport = ["transport", "folding", "raised.png", "--steps", "2"];
    assert!(check(&place, &transport) > 1, "{}", line!());
}

#[test]
fn modes_and_scores_resume_to_the_same_bits() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let mut average = vec!["average", "-o", "average", "--grid", "33"];
    average.extend(inputs.iter().map(String::as_str));
    succeeded(&place.compute(&average));
    assert!(check(&place, &["pca", "average"]) > 1, "{}", line!());
    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let mut score = vec!["score", "--pca", "modes"];
    score.extend(inputs.iter().map(String::as_str));
    assert!(check(&place, &score) > 1, "{}", line!());
}

#[test]
fn lengths_and_figures_resume_to_the_same_bits() {
    let place = Place::new();
    for (name, angle) in [("a.png", "180"), ("b.png", "170"), ("c.png", "150")] {
        draw(&place, name, &["bar", "--angle", angle, "--grid", "65"]);
    }
    let length = ["length", "a.png", "b.png", "c.png", "--grid", "33"];
    assert!(check(&place, &length) > 1, "{}", line!());
    let figure = ["figure", "stiffness", "a.png", "b.png", "--grid", "33"];
    assert!(check(&place, &figure) > 1, "{}", line!());
}

#[test]
fn metrics_shapes_of_scores_and_segmentations_resume_to_the_same_bits() {
    let place = Place::new();
    draw(&place, "a.npy", &["cross", "--grid", "65"]);
    draw(
        &place,
        "b.npy",
        &["cross", "--grid", "65", "--angle", "15,5"],
    );
    assert!(check(&place, &["metric", "a.npy", "--mode", "2"]) > 1);
    let average = ["average", "-o", "average", "--grid", "33", "a.npy", "b.npy"];
    succeeded(&place.compute(&average));
    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let synthesize = [
        "synthesize",
        "modes",
        "--scores=2",
        "--nonlinear",
        "--load-steps",
        "3",
    ];
    assert!(check(&place, &synthesize) > 1);
    for (name, radius) in [("grey1.npy", ".2"), ("grey2.npy", ".26")] {
        let disk = ["disk", "--radius", radius, "--grid", "65"];
        let grey = ["--contrast", ".6", "--noise", ".03"];
        draw(&place, name, &[&disk[..], &grey[..]].concat());
    }
    assert!(check(&place, &["segment", "grey1.npy", "grey2.npy"]) > 1);
}

/// Experiments that have ended are not repeated.
#[test]
fn verification_goes_on_where_it_was_killed() {
    let place = Place::new();
    let verify = ["verify", "laws", "level", "--quick", "-o"];
    let run = |output| [&verify[..], &[output]].concat();
    succeeded(&place.run(&run("whole")));
    let whole = Results::read(&place.path("whole"));
    let outcomes = place.path("out.partial/statements");
    // Without those that are being written.
    let whole_file = |entry: fs::DirEntry| entry.path().extension() == Some("json".as_ref());
    let done = || -> usize {
        let entries = fs::read_dir(&outcomes).into_iter().flatten().flatten();
        entries.map(|entry| usize::from(whole_file(entry))).sum()
    };
    killed(&place, &run("out"), || done() >= 2);
    let before = done();
    let last = place.run(&run("out"));
    succeeded(&last);
    let report = String::from_utf8_lossy(&last.stderr).into_owned();
    assert!(report.contains("going on from the outcomes"), "{report}");
    let all = whole.json["statements"].as_array().unwrap().len();
    let repeated = report.matches("confirmed ").count();
    assert!(repeated > 0 && repeated <= all - before + 1, "{report}");
    assert_same(&Results::read(&place.path("out")), &whole);
    assert!(!place.path("out.partial").exists());
}
