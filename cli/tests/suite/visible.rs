//! Averages and modes of shapes that are visible in part.

use crate::average::{averaged, check};
use crate::common::{Place, Results, array, draw, npy_f64, succeeded};

/// One of three bars is covered in part; a mask that says so gives the average of the whole bars.
#[test]
fn what_was_not_seen_is_not_missed() {
    let place = Place::new();
    for (k, angle) in ["180", "160", "150"].iter().enumerate() {
        let bar = ["bar", "--angle", angle, "--grid", "65"];
        draw(&place, &format!("{k}.npy"), &bar);
    }
    let (_, mut values) = array(&place.path("0.npy"));
    let mut view = vec![1.0; values.len()];
    for (index, (value, seen)) in values.iter_mut().zip(&mut view).enumerate() {
        if index % 65 >= 42 {
            (*value, *seen) = (0.0, 0.0);
        }
    }
    place.write("covered.npy", &npy_f64(&[65, 65], &values));
    place.write("view.npy", &npy_f64(&[65, 65], &view));
    let run = |first: &str, options: &[&str], output: &str| {
        let inputs = [first, "1.npy", "2.npy"].map(str::to_owned);
        let options = [&["--grid", "65"], options].concat();
        let results = averaged(&place, &inputs, &options, output);
        check(&results, 3, &[65, 65]);
        results
    };
    let full = run("0.npy", &[], "full");
    let known = run(
        "covered.npy",
        &["--valid", "view.npy", "all", "all"],
        "known",
    );
    let blind = run("covered.npy", &[], "blind");
    assert_eq!(known.json["parameters"]["valid"][1], "all");
    assert!(full.json["parameters"]["valid"].is_null());
    let area = |results: &Results| results.number("/average/area");
    let (known_change, blind_change) = (
        area(&known) / area(&full) - 1.0,
        area(&blind) / area(&full) - 1.0,
    );
    // A mask that is bright everywhere hides nothing.
    place.write("bright.npy", &npy_f64(&[65, 65], &vec![1.0; 65 * 65]));
    let bright = run(
        "covered.npy",
        &["--valid", "view.npy", "bright.npy", "all"],
        "bright",
    );
    assert_eq!(area(&bright), area(&known));
    // Where all are, it is as if there were none.
    let none = run(
        "covered.npy",
        &["--valid", "all", "bright.npy", "all"],
        "none",
    );
    assert!(none.json["parameters"]["valid"].is_null());
    assert_eq!(area(&none), area(&blind));
    assert!(!none.path("visibility_000.npy").exists());
    // Nor do modes take the covered part for background: their object is the average.
    succeeded(&place.compute(&["pca", "known", "-o", "modes"]));
    let object = Results::read(&place.path("modes")).number("/object_size");
    // Both are of interpolated fields, whose values at the nodes differ.
    assert!((object / area(&known) - 1.0).abs() < 2e-3, "{object}");
    // What is hidden of one in three: without the mask the average loses a good part of it.
    assert!(
        known_change.abs() < 0.02 && blind_change < -0.04,
        "{known_change} {blind_change}"
    );
    std::fs::create_dir(place.path("views")).unwrap();
    for name in ["views/a.npy", "views/b.npy"] {
        std::fs::copy(place.path("view.npy"), place.path(name)).unwrap();
    }
    let inputs = ["covered.npy", "1.npy", "2.npy", "-o", "out"];
    for (valid, word) in [
        (&["views"][..], "of 2 masks"),
        (&["view.npy"], "3 inputs"),
        (&["view.npy", "all", "missing.npy"], "missing.npy"),
        (&["view.npy", "all", "small.npy"], "small.npy"),
        (&["view.npy", "all", "other.npy"], "bright everywhere"),
    ] {
        place.write("other.npy", &npy_f64(&[64, 65], &vec![1.0; 64 * 65]));
        place.write("small.npy", &npy_f64(&[2, 2], &[0.0, 1.0, 1.0, 1.0]));
        let mut arguments = vec!["average"];
        arguments.extend(inputs);
        arguments.push("--valid");
        arguments.extend(valid);
        let run = place.run(&arguments);
        assert_eq!(run.status.code(), Some(2));
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
}
