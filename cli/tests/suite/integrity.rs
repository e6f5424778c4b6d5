//! Results that have changed since they were written, or that do not belong together.

use std::fs;
use std::process::Output;

use crate::common::{Place, Results, draw, drawn, npy_f64, succeeded};

/// Averages of two families, and the modes of the first.
fn results(place: &Place) {
    for family in ["bars", "crosses"] {
        let inputs = drawn(place, family, "2", "33");
        let output = format!("average-{family}");
        let mut arguments = vec!["average", "--grid", "33", "-o", &output];
        arguments.extend(inputs[..2].iter().map(String::as_str));
        succeeded(&place.compute(&arguments));
    }
    succeeded(&place.compute(&["pca", "average-bars", "-o", "modes"]));
}

fn report(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// A command must be refused with all the words, and accepted with `--trust`.
fn refused_unless_trusted(place: &Place, arguments: &[&str], words: &[&str]) {
    let run = place.compute(arguments);
    let report = report(&run);
    assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
    for word in words {
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
    let output = arguments.last().unwrap();
    assert!(!place.path(output).exists());
    succeeded(&place.compute(&[arguments, &["--trust"]].concat()));
    fs::remove_dir_all(place.path(output)).unwrap();
}

/// Changes the last bit of a file.
fn flip(place: &Place, name: &str) {
    let mut bytes = fs::read(place.path(name)).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    place.write(name, &bytes);
}

fn checked(place: &Place, directory: &str, words: &[&str]) -> Option<i32> {
    let run = place.run(&["check", directory]);
    let text = String::from_utf8_lossy(&run.stdout).into_owned() + &report(&run);
    for word in words {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
    run.status.code()
}

#[test]
fn what_is_no_result_is_not_checked() {
    let place = Place::new();
    let words = [
        "'nowhere' is not a result of shapespace",
        "name a directory",
    ];
    assert_eq!(checked(&place, "nowhere", &words), Some(2));
}

#[test]
fn changed_and_mixed_results_are_refused() {
    let place = Place::new();
    results(&place);
    let score = [
        "score",
        "bars/bar_000.npy",
        "--pca",
        "modes",
        "-o",
        "scores",
    ];
    let synthesize = ["synthesize", "modes", "--scores", "1", "-o", "shape"];
    // Modes on the average of others.
    let other = ["--average", "average-crosses"];
    for command in [&score[..], &synthesize] {
        let (inner, output) = command.split_at(command.len() - 2);
        let arguments = [inner, &other, output].concat();
        let words = ["average-crosses", "computed from another average"];
        refused_unless_trusted(&place, &arguments, &words);
    }
    // The same average elsewhere is the same.
    fs::rename(place.path("average-bars"), place.path("moved")).unwrap();
    let arguments = [
        "score",
        "bars/bar_000.npy",
        "--pca",
        "modes",
        "--average",
        "moved",
    ];
    succeeded(&place.compute(&[&arguments[..], &["-o", "scores"]].concat()));
    fs::remove_dir_all(place.path("scores")).unwrap();
    fs::rename(place.path("moved"), place.path("average-bars")).unwrap();

    flip(&place, "modes/mode_000.npy");
    refused_unless_trusted(&place, &score, &["mode_000.npy", "changed"]);
    flip(&place, "average-bars/weight_001.npy");
    let pca = ["pca", "average-bars", "-o", "again"];
    refused_unless_trusted(&place, &pca, &["weight_001.npy", "changed"]);
    flip(&place, "average-bars/deformation_000.npy");
    let start = [
        "average",
        "bars/bar_000.npy",
        "bars/bar_001.npy",
        "--grid",
        "33",
    ];
    let start = [&start[..], &["--start", "average-bars", "-o", "on"]].concat();
    refused_unless_trusted(&place, &start, &["deformation_000.npy", "changed"]);
    place.write("average-bars/result.json", b"{");
    let run = place.compute(&start);
    assert_eq!(run.status.code(), Some(2));
    assert!(report(&run).contains("result.json"), "{}", report(&run));
}

/// Shapes without an object have no modes.
#[test]
fn modes_of_nothing_are_refused() {
    let place = Place::new();
    results(&place);
    for number in 0..2 {
        let file = format!("average-bars/weight_{number:03}.npy");
        place.write(&file, &npy_f64(&[33, 33], &[0.0; 1089]));
    }
    let run = place.compute(&["pca", "average-bars", "--trust", "-o", "nothing"]);
    assert_eq!(run.status.code(), Some(1), "{}", report(&run));
    assert!(report(&run).contains("empty"), "{}", report(&run));
    assert!(!place.path("nothing").exists());
}

/// Energies of steps of both forms, and on both domains, are those of the arrays.
#[test]
fn energies_of_geodesics_are_checked() {
    let place = Place::new();
    draw(&place, "a.npy", &["disk", "--radius", ".2", "--grid", "33"]);
    draw(
        &place,
        "b.npy",
        &["disk", "--radius", ".25", "--grid", "33"],
    );
    // Paths of level sets have no domain.
    for (name, options) in [
        ("start", &["--domain", "start"]),
        ("end", &["--domain", "end"]),
        ("level-sets", &["--form", "level-sets"]),
    ] {
        let path = ["geodesic", "a.npy", "b.npy", "--grid", "33", "-K", "2"];
        succeeded(&place.compute(&[&path[..], options, &["-o", name]].concat()));
        let results = Results::read(&place.path(name));
        let stated = results.json["step_energies"][1].as_f64().unwrap();
        let words = [
            "length",
            "dissipation",
            "energy of step 1",
            "energy of step 2",
            "checked by version",
        ];
        assert!(
            matches!(checked(&place, name, &words), Some(0 | 3)),
            "{name}"
        );
        // Ten times the tolerance of recomputed numbers.
        let mut record = results.json.clone();
        record["step_energies"][1] = (stated * (1.0 + 1e-5)).into();
        let file = format!("{name}/result.json");
        place.write(&file, record.to_string().as_bytes());
        assert_eq!(checked(&place, name, &["WRONG", "2 of its parts"]), Some(2));
        let mut record = results.json.clone();
        let stated = record["certificate"]["min_det"].as_f64().unwrap();
        record["certificate"]["min_det"] = (stated * (1.0 + 1e-5)).into();
        place.write(&file, record.to_string().as_bytes());
        let words = ["determinant", "WRONG", "2 of its parts"];
        assert_eq!(checked(&place, name, &words), Some(2));
        let mut record = results.json.clone();
        for what in ["length", "dissipation"] {
            record[what] = (record[what].as_f64().unwrap() * (1.0 + 1e-4)).into();
        }
        place.write(&file, record.to_string().as_bytes());
        let words = ["length", "dissipation", "WRONG", "3 of its parts"];
        assert_eq!(checked(&place, name, &words), Some(2));
    }
    // The energies of rotations are rounding errors, of either sign.
    draw(&place, "u.npy", &["letter", "u", "--grid", "33"]);
    let turned = ["letter", "u", "--rotate", "180", "--grid", "33"];
    draw(&place, "turned.npy", &turned);
    let path = ["geodesic", "u.npy", "turned.npy", "--grid", "33", "-K", "2"];
    succeeded(&place.compute(&[&path[..], &["--align", "none", "-o", "turns"]].concat()));
    assert!(Results::read(&place.path("turns")).number("/length") < 0.01);
    assert!(matches!(checked(&place, "turns", &["length"]), Some(0 | 3)));
    // A step whose deformation folds in the void, where it is composed of two others and sampled at nodes; those that
    // were minimised do not.
    draw(&place, "star.npy", &["star", "--grid", "33"]);
    draw(&place, "pin.npy", &["star", "--pin", "40", "--grid", "33"]);
    let path = ["geodesic", "star.npy", "pin.npy", "--grid", "33", "-K", "2"];
    succeeded(&place.compute(&[&path[..], &["-o", "pins"]].concat()));
    assert!(matches!(
        checked(&place, "pins", &["determinant"]),
        Some(0 | 3)
    ));
}

#[test]
fn results_are_checked() {
    let place = Place::new();
    results(&place);
    let results = Results::read(&place.path("average-bars"));
    let sums = results.json["arrays"].as_object().unwrap();
    assert!(sums.contains_key("average.npy") && sums.contains_key("deformation_001.npy"));
    assert_eq!(
        results.json["input"][0]["sha256"].as_str().unwrap().len(),
        64
    );
    let is_sound = results.json["verdict"] == "sound";
    let expected = Some(if is_sound { 0 } else { 3 });
    let words = [
        "unchanged",
        "the same input",
        "elastic energy 1",
        "determinant",
    ];
    assert_eq!(checked(&place, "average-bars", &words), expected);
    checked(&place, "modes", &["mode_000.npy", "unchanged"]);

    // Energies and determinants are those of the arrays, whatever the checksums.
    let text = fs::read_to_string(place.path("average-bars/result.json")).unwrap();
    let mut record: serde_json::Value = serde_json::from_str(&text).unwrap();
    record["energy"]["elastic"][0] = 7.25.into();
    record["certificate"]["min_det"] = 0.75.into();
    place.write("average-bars/result.json", record.to_string().as_bytes());
    let words = [
        "the record states 7.25",
        "the record states 0.75",
        "result.json",
        "3 of its parts",
    ];
    assert_eq!(checked(&place, "average-bars", &words), Some(2));
    place.write("average-bars/result.json", text.as_bytes());

    // The verdict follows from the doubts, and doubts from the status.
    let doubt = serde_json::json!([{"what": "not_converged", "limit": 0.0, "remedy": "none"}]);
    let stated = results.json["verdict"].clone();
    for (verdict, doubts, status, words) in [
        (
            "sound".into(),
            doubt.clone(),
            "converged",
            "sound, with 1 doubt",
        ),
        (
            "doubtful".into(),
            serde_json::json!([]),
            "converged",
            "doubtful, with no doubts",
        ),
        (
            "sound".into(),
            serde_json::json!([]),
            "max_iterations",
            "has not converged",
        ),
        (
            stated,
            serde_json::Value::Null,
            "converged",
            "only one of verdict and doubts",
        ),
        (
            serde_json::Value::Null,
            doubt,
            "converged",
            "only one of verdict and doubts",
        ),
    ] {
        let mut record = results.json.clone();
        record["verdict"] = verdict;
        record["doubts"] = doubts;
        record["status"] = status.into();
        place.write("average-bars/result.json", record.to_string().as_bytes());
        let words = [words, "WRONG", "2 of its parts"];
        assert_eq!(checked(&place, "average-bars", &words), Some(2));
    }
    place.write("average-bars/result.json", text.as_bytes());
    let text = fs::read_to_string(place.path("modes/result.json")).unwrap();
    place.write("modes/result.json", text.replacen("0.", "1.", 1).as_bytes());
    let words = ["result.json", "its contents have changed"];
    assert_eq!(checked(&place, "modes", &words), Some(2));
    let score = [
        "score",
        "--pca",
        "modes",
        "bars/bar_000.npy",
        "-o",
        "scored",
    ];
    refused_unless_trusted(&place, &score, &["modes/result.json", "changed"]);

    flip(&place, "bars/bar_000.npy");
    let words = ["the input has changed since", "1 of its parts"];
    assert_eq!(checked(&place, "average-bars", &words), Some(2));
    fs::remove_file(place.path("bars/bar_000.npy")).unwrap();
    assert_eq!(checked(&place, "average-bars", &["is not here"]), expected);
    flip(&place, "average-bars/average.npy");
    fs::remove_file(place.path("average-bars/weight_000.npy")).unwrap();
    place.write("average-bars/more.npy", b"");
    let words = [
        "its contents have changed",
        "No such file",
        "does not list",
        "3 of its parts",
    ];
    assert_eq!(checked(&place, "average-bars", &words), Some(2));
    assert_eq!(
        checked(&place, "nowhere", &["nowhere", "result.json"]),
        Some(2)
    );
}
