//! `metric` from files to files.

use std::f64::consts::PI;

use crate::common::{Place, Results, arrays, npy_f64, picture_size, succeeded};

const NODES: usize = 33;

/// Writes the mask of a ball with a soft boundary, whose level 1/2 is the ball.
fn ball(place: &Place, name: &str, dimension: usize, radius: f64) {
    let h = 1.0 / (NODES - 1) as f64;
    let value = |node: usize| {
        let at = |k: usize| (node / NODES.pow(k as u32) % NODES) as f64 * h - 0.49;
        let r = (0..dimension).map(|k| at(k).powi(2)).sum::<f64>().sqrt();
        (0.5 + (radius - r) / (6.0 * h)).clamp(0.0, 1.0)
    };
    let values: Vec<f64> = (0..NODES.pow(dimension as u32)).map(value).collect();
    place.write(name, &npy_f64(&vec![NODES; dimension], &values));
}

fn metric(place: &Place, arguments: &[&str], output: &str) -> (Results, String) {
    let fixed = ["-o", output, "--grid", "33", "--allow-doubtful"];
    let run = place.run(&[&["metric"], arguments, &fixed].concat());
    let text = succeeded(&run);
    (Results::read(&place.path(output)), text)
}

#[test]
fn a_disk_has_the_metric_of_its_closed_forms() {
    let place = Place::new();
    ball(&place, "disk.npy", 2, 0.3);
    ball(&place, "larger.npy", 2, 0.31);
    let (found, text) = metric(&place, &["disk.npy", "--mode", "2"], "mode");
    // 6 pi mu / (kappa + 3) with kappa = 2, see the tests of the library; five cells a radius.
    let exact = 6.0 * PI / 5.0;
    let g = found.number("/metric");
    assert!((g / exact - 1.0).abs() < 0.02, "{g} {exact}");
    assert!((found.number("/speed").powi(2) / g - 1.0).abs() < 1e-12);
    let shares = found.number("/volume_share") + found.number("/shear_share");
    assert!((shares - 1.0).abs() < 1e-12);
    assert!(found.number("/discretisation/error") < 0.05 * exact);
    assert_eq!(found.json["verdict"], "sound");
    for word in ["Metric of a variation", "speed", "shear", "verdict"] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    assert_eq!(found.array("velocity.npy").0, [2, 33, 33]);
    assert_eq!(found.array("dissipation.npy").0, [33, 33]);
    assert_eq!(found.array("level_set.npy").0, [33, 33]);
    assert!(found.path("metric.vti").is_file() && found.path("report.html").is_file());
    let [width, height] = picture_size(&found.path("metric.png"));
    assert!(width > 1000 && height > 400);

    // Growth by a hundredth of the box, whose square the metric has.
    let (found, _) = metric(&place, &["disk.npy", "larger.npy"], "towards");
    let g = found.number("/metric");
    assert!((g / (4.0 * PI * 1e-4) - 1.0).abs() < 0.02, "{g}");
    assert_eq!(found.json["variation"]["kind"], "towards");

    let (found, _) = metric(&place, &["disk.npy", "--translation", "-1,.5"], "moved");
    assert!(found.number("/metric") < 1e-5);
    assert_eq!(found.json.get("shear_share"), None);
}

#[test]
fn a_ball_grows_alike_on_every_number_of_threads() {
    let place = Place::new();
    ball(&place, "ball.npy", 3, 0.3);
    let runs = ["1", "2"].map(|threads| {
        let arguments = [
            "ball.npy",
            "--dilation",
            "--threads",
            threads,
            "--tolerance",
            "1e-2",
        ];
        metric(&place, &arguments, threads).0
    });
    let g = runs[0].number("/metric");
    assert!((g / (3.0 * PI) - 1.0).abs() < 0.02, "{g}");
    assert_eq!(runs[0].json["metric"], runs[1].json["metric"]);
    assert!(arrays(&runs[0]) == arrays(&runs[1]));
}

#[test]
fn a_variation_is_one_motion_of_the_boundary() {
    let place = Place::new();
    ball(&place, "disk.npy", 2, 0.3);
    let before = place.listing();
    for (arguments, words) in [
        (vec!["disk.npy"], vec!["variation", "--dilation"]),
        (vec!["--dilation"], vec!["SHAPE"]),
        (
            vec!["disk.npy", "disk.npy", "--mode", "2"],
            vec!["--mode", "VARIATION"],
        ),
        (vec!["disk.npy", "--mode", "65"], vec!["--mode", "64"]),
        (
            vec!["disk.npy", "--translation", "1,2,3"],
            vec!["--translation", "2 dimensions"],
        ),
        (
            vec!["disk.npy", "--translation", "1"],
            vec!["--translation"],
        ),
        (vec!["disk.npy", "--dilation", "--mu", "0"], vec!["--mu"]),
        (
            vec!["disk.npy", "--dilation", "--void-stiffness", "0"],
            vec!["--void-stiffness"],
        ),
    ] {
        let run = place.run(&[vec!["metric", "-o", "out"], arguments.clone()].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
    }
    assert_eq!(place.listing(), before);
}
