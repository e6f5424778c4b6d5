//! `average --starts`.

use crate::common::{Place, Results, arrays, draw, succeeded};

/// Two crossed ellipses, which are not aligned.
fn crossed() -> Place {
    let place = Place::new();
    for (name, angle) in [("lying.npy", "0"), ("standing.npy", "90")] {
        draw(
            &place,
            name,
            &["ellipse", "--rotate", angle, "--grid", "33"],
        );
    }
    place
}

const AVERAGE: [&str; 7] = [
    "average",
    "lying.npy",
    "standing.npy",
    "--align",
    "none",
    "--grid",
    "33",
];

#[test]
fn two_minima_of_crossed_ellipses_are_listed() {
    let place = crossed();
    let options = ["--starts", "4", "-o", "four"];
    let printed = succeeded(&place.compute(&[&AVERAGE[..], &options].concat()));
    let four = Results::read(&place.path("four"));
    let minima = four.json["minima"].as_array().unwrap();
    assert_eq!(minima.len(), 3, "{printed}");
    assert_eq!(four.json["starts"].as_array().unwrap().len(), 4);
    assert_eq!(four.number("/parameters/starts"), 4.0);
    assert!(printed.contains("4 end in 3 minima"), "{printed}");
    // The usual start is not the lowest by far, and the result is the lowest.
    assert_eq!(
        four.number("/minima/0/energy"),
        four.number("/energy/total")
    );
    let last = four.numbers("/minima/2/starts");
    assert!(last.contains(&1.0) && four.number("/minima/2/excess") > 10.0);
    assert!(four.number("/minima/0/least_eigenvalue/value") > 1.0);
    // Turned to the left and to the right, with averages of one shape: nothing is ambiguous.
    assert!(four.number("/minima/1/state_distance") > 1.0);
    assert_eq!(four.json["minima"][1]["other_shape"], false);
    assert!(!printed.contains("another minimum"), "{printed}");
    let config = std::fs::read_to_string(four.path("config.toml")).unwrap();
    assert!(config.contains("starts = 4"), "{config}");
}

#[test]
fn one_start_is_the_usual_one() {
    let place = crossed();
    for (options, output) in [(&["--starts", "1"][..], "one"), (&[], "usual")] {
        let arguments = [&AVERAGE[..], options, &["-o", output]].concat();
        succeeded(&place.compute(&arguments));
    }
    let [one, usual] = ["one", "usual"].map(|name| Results::read(&place.path(name)));
    assert_eq!(arrays(&one), arrays(&usual));
    assert_eq!(one.json["minima"].as_array().unwrap().len(), 1);
    assert!(usual.json["minima"].is_null());
}

#[test]
fn options_that_starts_exclude_are_named() {
    let place = crossed();
    let refused: [&[&str]; 5] = [
        &["--sweep", "3"],
        &["--error-bars"],
        &["--mean", "median"],
        &["--weights", "0,1"],
        &["--joint"],
    ];
    for options in refused {
        let options = [options, &["--starts", "3", "-o", "out"]].concat();
        let run = place.run(&[&AVERAGE[..], &options].concat());
        let text = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{text}");
        assert!(
            text.contains("--starts") || text.contains("--align"),
            "{text}"
        );
    }
    let run = place.run(&[&AVERAGE[..], &["--starts", "0", "-o", "out"]].concat());
    assert_eq!(run.status.code(), Some(2));
}

/// A cross of four equal arms, which become the two halves of an ellipse.
fn cross_and_ellipse() -> Place {
    let place = Place::new();
    draw(&place, "cross.npy", &["cross", "--grid", "33"]);
    draw(&place, "ellipse.npy", &["ellipse", "--grid", "33"]);
    place
}

const PATH: [&str; 9] = [
    "geodesic",
    "cross.npy",
    "ellipse.npy",
    "--align",
    "none",
    "--grid",
    "33",
    "-K",
    "2",
];

/// Arms that may become either end of the ellipse make paths of one length.
#[test]
fn paths_of_a_symmetric_shape_are_ambiguous() {
    let place = cross_and_ellipse();
    let run = place.run(&[&PATH[..], &["--starts", "3", "-o", "three"]].concat());
    let printed = String::from_utf8(run.stdout).unwrap();
    assert_eq!(run.status.code(), Some(3), "{printed}");
    let three = Results::read(&place.path("three"));
    let minima = three.json["minima"].as_array().unwrap();
    assert_eq!(three.json["starts"].as_array().unwrap().len(), 3);
    assert!(minima.len() > 1, "{printed}");
    assert_eq!(three.number("/minima/0/length"), three.number("/length"));
    // A quarter or half of a turn.
    assert!(three.number("/minima/1/distance") > 1.0, "{printed}");
    assert!(three.number("/minima/1/excess").abs() < 0.05, "{printed}");
    let doubts = three.json["doubts"].as_array().unwrap();
    assert!(
        doubts.iter().any(|d| d["what"] == "ambiguous_path"),
        "{doubts:?}"
    );
    assert!(printed.contains("3 end in"), "{printed}");
}

#[test]
fn one_start_of_a_path_is_the_usual_one() {
    let place = cross_and_ellipse();
    for (options, output) in [(&["--starts", "1"][..], "one"), (&[], "usual")] {
        succeeded(&place.compute(&[&PATH[..], options, &["-o", output]].concat()));
    }
    let [one, usual] = ["one", "usual"].map(|name| Results::read(&place.path(name)));
    assert_eq!(arrays(&one), arrays(&usual));
    assert_eq!(one.json["minima"].as_array().unwrap().len(), 1);
    assert!(usual.json["minima"].is_null());
}

#[test]
fn options_that_starts_of_paths_exclude_are_named() {
    let place = cross_and_ellipse();
    let refused: [&[&str]; 4] = [
        &["--form", "level-sets"],
        &["--domain", "end"],
        &["--occluded", "start"],
        &["--valid-end", "ellipse.npy"],
    ];
    for options in refused {
        let run = place.run(&[&PATH[..], options, &["--starts", "3", "-o", "out"]].concat());
        let text = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{text}");
        assert!(text.contains("--starts"), "{text}");
    }
}

/// The best path of those that were found before is kept.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_search_is_cancelled() {
    let place = cross_and_ellipse();
    let arguments = [&PATH[..], &["--starts", "200", "-o", "some"]].concat();
    let code = crate::common::interrupted(&place, &arguments, "start 3 of 200");
    assert_eq!(code, Some(130));
    let some = Results::read(&place.path("some"));
    assert_eq!(some.json["status"], "cancelled");
    let starts = some.json["starts"].as_array().unwrap().len();
    assert!((2..200).contains(&starts), "{starts}");
    assert!(!some.json["minima"].as_array().unwrap().is_empty());
    assert_eq!(some.number("/minima/0/length"), some.number("/length"));
    // The starts that are missing are no minima.
    let missing = (200 - starts) as f64;
    let doubts = some.json["doubts"].as_array().unwrap();
    let counted = |d: &&serde_json::Value| d["what"] == "not_converged" && d["figure"] == missing;
    assert!(doubts.iter().any(|d| counted(&d)), "{doubts:?}");
}
