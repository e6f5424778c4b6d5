//! `shapespace average --labels` and what follows from it: modes, shapes of scores, scores.

use crate::common::{Place, Results, array, arrays, npy_f64, succeeded};

/// A label image of 33 by 33 nodes: a bar whose labels 3 and 7 meet at a column.
fn halves(border: usize) -> Vec<f64> {
    let mut values = vec![0.0; 33 * 33];
    for y in 12..21 {
        for x in 6..27 {
            values[33 * y + x] = if x < border { 3.0 } else { 7.0 };
        }
    }
    values
}

/// Two label images, `a.npy` and `b.npy`.
fn place() -> Place {
    let place = Place::new();
    for (name, border) in [("a.npy", 15), ("b.npy", 18)] {
        place.write(name, &npy_f64(&[33, 33], &halves(border)));
    }
    place
}

const AVERAGE: [&str; 6] = ["average", "a.npy", "b.npy", "--labels", "--grid", "33"];

fn averaged(place: &Place, options: &[&str], output: &str) -> Results {
    succeeded(&place.compute(&[&AVERAGE, options, &["-o", output]].concat()));
    Results::read(&place.path(output))
}

/// The number of the first column of the middle row with this label.
fn border(labels: &[f64], label: f64) -> usize {
    let row = &labels[33 * 16..33 * 17];
    row.iter().position(|found| *found == label).unwrap()
}

#[test]
fn labels_are_averaged_by_one_deformation_of_each_image() {
    let place = place();
    let results = averaged(&place, &["--tolerance", "1e-3"], "out");
    assert_eq!(results.numbers("/components/0/dice").len(), 2);
    let labels = ["/components/0/label", "/components/1/label"].map(|p| results.number(p));
    assert_eq!(labels, [3.0, 7.0]);
    // The outline is the same in both; the labels meet half way, and are stretched or compressed for it.
    let (shape, found) = results.array("average_labels.npy");
    assert_eq!(shape, [33, 33]);
    let [first, second, end] = [
        border(&found, 3.0),
        border(&found, 7.0),
        33 - border(&found.iter().rev().copied().collect::<Vec<_>>(), 7.0),
    ];
    // The middle of 15 and 18, a little to one side where the whole is moved.
    assert!(
        (9..=12).contains(&(second - first)),
        "{first} {second} {end}"
    );
    assert!((20..=22).contains(&(end - first)), "{first} {second} {end}");
    assert!(results.number("/energy/parts/0") > 1e-4);
    for component in ["0", "1"] {
        let dice = results.numbers(&format!("/components/{component}/dice"));
        assert!(dice.iter().all(|dice| *dice > 0.95), "{dice:?}");
        let mismatch = format!("/energy/components/{component}/mismatch");
        assert_eq!(results.numbers(&mismatch).len(), 2);
        let (shape, field) = results.array(&format!("average_component_{component}.npy"));
        assert_eq!(shape, [33, 33]);
        assert!(field.iter().copied().fold(1.0, f64::min) < 0.4);
    }
    for name in [
        "average_label_3_outline.csv",
        "average_label_7_outline.svg",
        "average.png",
    ] {
        assert!(results.path(name).is_file(), "no {name}");
    }
    let report = std::fs::read_to_string(results.path("report.html")).unwrap();
    assert!(report.contains("Dice of components, least"), "{report}");
    // Whole shapes of the same outline are not deformed at all.
    for name in ["whole_a.npy", "whole_b.npy"] {
        let inside = halves(16).into_iter().map(|label| label.min(1.0));
        place.write(name, &npy_f64(&[33, 33], &inside.collect::<Vec<_>>()));
    }
    let whole = [
        "average",
        "whole_a.npy",
        "whole_b.npy",
        "--grid",
        "33",
        "-o",
        "whole",
    ];
    succeeded(&place.compute(&whole));
    let whole = Results::read(&place.path("whole"));
    assert!(whole.number("/energy/parts/0") < 1e-6 && whole.json.get("components").is_none());
    let check = place.run(&["check", "out"]);
    let text = String::from_utf8_lossy(&check.stdout).into_owned();
    assert!(
        text.contains("elastic energy 1") && !text.contains("WRONG"),
        "{text}"
    );
    let warped = place.compute(&["warp", "out", "a.npy", "--shape", "0", "-o", "warped"]);
    succeeded(&warped);
}

#[test]
fn modes_move_the_components() {
    let place = place();
    averaged(&place, &["--tolerance", "1e-4"], "out");
    succeeded(&place.compute(&["pca", "out", "-o", "modes"]));
    let modes = Results::read(&place.path("modes"));
    assert_eq!(modes.numbers("/labels"), [3.0, 7.0]);
    assert!(modes.path("modes.png").is_file());
    // One mode, along which the labels change their lengths.
    let at = |score: &str, output: &str| {
        let scores = format!("--scores={score}");
        succeeded(&place.compute(&["synthesize", "modes", &scores, "-o", output]));
        let results = Results::read(&place.path(output));
        let (_, labels) = results.array("shape_labels.npy");
        let area = |label: f64| labels.iter().filter(|found| **found == label).count() as f64;
        area(3.0) / (area(3.0) + area(7.0))
    };
    let [less, more] = [("-1.5", "less"), ("1.5", "more")].map(|(score, name)| at(score, name));
    // Labels that do not move with the whole change by two thirds of what these do.
    assert!((more - less).abs() > 0.12, "{less} {more}");
    // The images of the average have scores of opposite signs; other labels are refused.
    let score = ["score", "a.npy", "b.npy", "--pca", "modes", "-o", "scores"];
    succeeded(&place.compute(&score));
    let scores = Results::read(&place.path("scores"));
    let [a, b] = [0, 1].map(|k| scores.number(&format!("/scores/{k}/0")));
    assert!(a * b < 0.0 && (a.abs() - 1.0).abs() < 0.4, "{a} {b}");
    let other: Vec<f64> = halves(16).into_iter().map(|x| 2.0 * x).collect();
    place.write("c.npy", &npy_f64(&[33, 33], &other));
    let run = place.run(&["score", "c.npy", "--pca", "modes", "-o", "refused"]);
    let text = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{text}");
    assert!(
        text.contains("[3, 7]") && text.contains("[6, 14]"),
        "{text}"
    );
}

/// A single label is the whole shape: all arrays have the same bits.
#[test]
fn one_label_is_the_plain_average() {
    let place = Place::new();
    for (name, border) in [("a.npy", 15), ("b.npy", 18)] {
        let left = halves(border)
            .into_iter()
            .map(|x| if x == 3.0 { 3.0 } else { 0.0 });
        place.write(name, &npy_f64(&[33, 33], &left.collect::<Vec<_>>()));
    }
    let labelled = averaged(&place, &[], "labelled");
    let plain = ["average", "a.npy", "b.npy", "--grid", "33", "-o", "plain"];
    succeeded(&place.compute(&plain));
    assert_eq!(
        arrays(&labelled),
        arrays(&Results::read(&place.path("plain")))
    );
}

#[test]
fn a_label_that_is_not_matched_makes_the_result_doubtful() {
    let place = place();
    // Labels that would have to change their lengths by a factor of five.
    place.write("b.npy", &npy_f64(&[33, 33], &halves(24)));
    place.write("a.npy", &npy_f64(&[33, 33], &halves(9)));
    let run = place.run(&[&AVERAGE[..], &["-o", "out"]].concat());
    assert_eq!(run.status.code(), Some(3));
    let results = Results::read(&place.path("out"));
    let doubts = results.json["doubts"].as_array().unwrap();
    let about = |label: &str| {
        let mut overlaps = doubts.iter().filter(|doubt| doubt["what"] == "overlap");
        overlaps.any(|doubt| doubt["component"] == label)
    };
    assert!(about("label 3") || about("label 7"), "{doubts:?}");
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(text.contains(", label "), "{text}");
}

#[test]
fn what_labels_cannot_be_combined_with_is_refused() {
    let place = place();
    for (option, values) in [
        ("--label", &["3"][..]),
        ("--invert", &[]),
        ("--sweep", &["3"]),
        ("--starts", &["2"]),
        ("--error-bars", &[]),
    ] {
        let run = place.run(&[&AVERAGE[..], &[option], values, &["-o", "out"]].concat());
        let text = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{option}: {text}");
        assert!(text.contains("--labels") && text.contains(option), "{text}");
    }
    let run = place.run(&[&AVERAGE[..], &["--joint", "-o", "out"]].concat());
    let text = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        run.status.code() == Some(2) && text.contains("--labels"),
        "{text}"
    );
    place.write("b.npy", &npy_f64(&[33, 33], &[0.0, 3.0, 5.0].repeat(363)));
    let run = place.run(&[&AVERAGE[..], &["-o", "out"]].concat());
    let text = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{text}");
    assert!(text.contains("b.npy") && text.contains('5'), "{text}");
}

/// The right end of one image is hidden, and drawn shorter than it is: with a mask the average has the
/// length of the other.
#[test]
fn hidden_parts_of_labels_are_not_compared() {
    let place = place();
    let mut cut = halves(16);
    let mut view = vec![1.0; cut.len()];
    for (index, (value, seen)) in cut.iter_mut().zip(&mut view).enumerate() {
        if index % 33 >= 23 {
            *value = 0.0;
        }
        if index % 33 >= 21 {
            *seen = 0.0;
        }
    }
    place.write("a.npy", &npy_f64(&[33, 33], &cut));
    place.write("b.npy", &npy_f64(&[33, 33], &halves(16)));
    place.write("view.npy", &npy_f64(&[33, 33], &view));
    let options = ["--align", "none"];
    let area = |options: &[&str], output: &str| {
        let (_, labels) = averaged(&place, options, output).array("average_labels.npy");
        labels.iter().filter(|label| **label == 7.0).count() as f64
    };
    let blind = area(&options, "blind");
    let known = area(
        &[&options[..], &["--valid", "view.npy", "all"]].concat(),
        "known",
    );
    // Of the two columns that are missing on average.
    let whole = 9.0 * 11.0;
    assert!(whole - known < 0.5 * (whole - blind), "{known} {blind}");
}

/// A NIfTI file with a place in the world: one millimetre, at the origin.
fn volume(border: usize) -> Vec<u8> {
    let size = 15;
    let mut labels = Vec::new();
    for z in 0..size {
        for y in 0..size {
            for x in 0..size {
                let inside = [x, y, z].iter().all(|k| (3..12).contains(k));
                let label = if x < border { 2u8 } else { 9 };
                labels.push(if inside { label } else { 0 });
            }
        }
    }
    let mut bytes = crate::common::nifti([size as u16; 3], [1.0; 3], &labels);
    // The sform is the identity.
    bytes[254..256].copy_from_slice(&1i16.to_le_bytes());
    for (row, axis) in [280, 296, 312].into_iter().zip(0..) {
        let at = row + 4 * axis;
        bytes[at..at + 4].copy_from_slice(&1f32.to_le_bytes());
    }
    bytes
}

#[test]
fn volumes_have_surfaces_of_labels_and_a_label_image() {
    let place = Place::new();
    place.write("a.nii", &volume(7));
    place.write("b.nii", &volume(8));
    let all = [
        "average", "a.nii", "b.nii", "--labels", "--grid", "17", "-o", "out",
    ];
    succeeded(&place.compute(&all));
    let results = Results::read(&place.path("out"));
    for name in [
        "average_label_2.stl",
        "average_label_9.ply",
        "average_label_9.vtp",
    ] {
        assert!(results.path(name).is_file(), "no {name}");
    }
    assert_eq!(array(&results.path("average_labels.npy")).0, [17, 17, 17]);
    // The label image is read again, as one of the same labels.
    let again = [
        "average",
        "a.nii",
        "out/average.nii.gz",
        "--labels",
        "--grid",
        "17",
    ];
    succeeded(&place.compute(&[&again[..], &["-o", "again"]].concat()));
    let again = Results::read(&place.path("again"));
    let dice = again.numbers("/components/1/dice");
    assert!(dice.iter().all(|dice| *dice > 0.9), "{dice:?}");
    succeeded(&place.compute(&["pca", "out", "-o", "modes"]));
    let scores = ["synthesize", "modes", "--scores", "1", "-o", "shape"];
    succeeded(&place.compute(&scores));
    assert!(place.path("shape").join("shape_label_2.stl").is_file());
    let labels = shapespace_input::Sources::files().read_numbers(&place.path("shape/shape.nii.gz"));
    let values = labels.unwrap().values;
    let count = |label: f64| values.iter().filter(|value| **value == label).count();
    assert!(count(2.0) > 50 && count(9.0) > 50);
    assert_eq!(count(0.0) + count(2.0) + count(9.0), values.len());
}

/// The outline of two halves is symmetric; a picture turned by half a turn is turned back, and one that is not
/// stays as it is.
#[test]
fn label_images_are_aligned_by_their_labels() {
    let place = Place::new();
    let wide = halves(12);
    place.write("a.npy", &npy_f64(&[33, 33], &wide));
    place.write("b.npy", &npy_f64(&[33, 33], &halves(13)));
    let turned: Vec<f64> = wide.iter().rev().copied().collect();
    place.write("turned.npy", &npy_f64(&[33, 33], &turned));
    let inputs = ["average", "a.npy", "b.npy", "turned.npy", "--labels"];
    let options = ["--align", "rigid", "--grid", "33", "-o", "out"];
    place.run(&[&inputs[..], &options].concat());
    let results = Results::read(&place.path("out"));
    let angle = |i: usize| results.number(&format!("/input/{i}/alignment/angle_degrees"));
    assert!(
        angle(1) < 2.0 && (angle(2) - 180.0).abs() < 2.0,
        "{} {}",
        angle(1),
        angle(2)
    );
    for label in 0..2 {
        let dice = results.numbers(&format!("/components/{label}/dice"));
        assert!(dice.iter().all(|dice| *dice > 0.9), "{dice:?}");
    }
    // So are new ones; the turned copy has the scores of its original.
    succeeded(&place.compute(&["pca", "out", "-o", "modes"]));
    succeeded(&place.compute(&[
        "score",
        "a.npy",
        "turned.npy",
        "--pca",
        "modes",
        "-o",
        "scores",
    ]));
    let scores = Results::read(&place.path("scores"));
    let [own, copy] = [0, 1].map(|k| scores.number(&format!("/scores/{k}/0")));
    assert!((own - copy).abs() < 0.1 * own.abs(), "{own} {copy}");
}
