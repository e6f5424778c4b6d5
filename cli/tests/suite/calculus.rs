//! `extend` and `transport` from files to files.

#[cfg(target_os = "linux")]
use crate::common::interrupted;
use crate::common::{Place, Results, arrays, draw, drawn, npy_f64, picture_size, succeeded};

/// A geodesic in the folder, by these steps.
fn geodesic(place: &Place, ends: [&str; 2], steps: &str, grid: &str, output: &str) -> Results {
    let mut arguments = vec!["geodesic", ends[0], ends[1], "-o", output, "--grid", grid];
    arguments.extend(["-K", steps]);
    succeeded(&place.compute(&arguments));
    Results::read(&place.path(output))
}

/// A straight bar and one folded by 20 degrees, and the path between them.
fn bars(place: &Place) -> Results {
    draw(place, "straight.png", &["bar", "--grid", "65"]);
    draw(
        place,
        "folded.png",
        &["bar", "--angle", "160", "--grid", "65"],
    );
    geodesic(place, ["straight.png", "folded.png"], "3", "33", "folding")
}

/// What every directory of a path holds.
fn check_path(results: &Results, shapes: usize, size: &[u64]) {
    let mut vector = vec![size.len() as u64];
    vector.extend(size);
    for k in 0..shapes {
        assert_eq!(results.array(&format!("shape_{k:03}.npy")).0, size);
        assert!(results.path(&format!("shape_{k:03}.vti")).is_file());
        if k > 0 {
            assert_eq!(results.array(&format!("deformation_{k:03}.npy")).0, vector);
        }
    }
    assert!(!results.path(&format!("shape_{shapes:03}.npy")).exists());
    let table = std::fs::read_to_string(results.path("steps.csv")).unwrap();
    assert_eq!(table.lines().count(), shapes + 1);
    for name in ["geodesic.png", "geodesic.apng"] {
        let [width, height] = picture_size(&results.path(name));
        assert!(width > 100 && height > 100, "{name}");
    }
    assert_eq!(results.json["certificate"]["certified"], true);
}

/// How much further the ends of a bar are up than its middle, in nodes: less than 0 in pictures
/// whose y axis points down.
fn bend(results: &Results, shape: usize) -> f64 {
    let (size, values) = results.array(&format!("shape_{shape:03}.npy"));
    let nodes = size[0] as usize;
    let middle = |x: usize| {
        let inside = (0..nodes)
            .map(|y| (y, values[y * nodes + x]))
            .filter(|p| p.1 > 0.0);
        let (sum, mass) = inside.fold((0.0, 0.0), |(s, m), (y, u)| (s + u * y as f64, m + u));
        sum / mass
    };
    let quarter = nodes / 4;
    0.5 * (middle(quarter + 1) + middle(nodes - 2 - quarter)) - middle(nodes / 2)
}

#[test]
fn a_geodesic_of_disks_goes_on() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "65");
    let given = geodesic(&place, [&disks[0], &disks[1]], "4", "65", "out");
    let printed = succeeded(&place.run(&["extend", "out", "-o", "on", "-K", "2"]));
    assert!(printed.contains("continued by 2 of 2"), "{printed}");
    let results = Results::read(&place.path("on"));
    check_path(&results, 7, &[65, 65]);
    assert_eq!(results.json["status"], "converged");
    // The given part is what it was.
    for k in 0..=4 {
        let name = format!("shape_{k:03}.npy");
        assert_eq!(results.array(&name), given.array(&name));
    }
    // In the coordinates of the pictures, too.
    assert_eq!(results.json["outline"]["coordinates"], "input");
    assert_eq!(results.json["outline"], given.json["outline"]);
    let outline = |found: &Results| std::fs::read(found.path("shape_003_outline.csv")).unwrap();
    assert!(outline(&results) == outline(&given));
    let (energies, own) = (
        results.numbers("/step_energies"),
        given.numbers("/step_energies"),
    );
    assert_eq!(energies[..4], own[..]);
    // Constant speed, as far as a geodesic of four steps that is solved to 1e-4 has it.
    for energy in &energies[4..] {
        assert!((energy / own[3] - 1.0).abs() < 0.01, "{energies:?}");
    }
    // Radii of .2 and .3, and half as far again; the boundary has a width of some cells of 1/64.
    let areas = results.numbers("/volumes");
    let radius = (areas[6] / std::f64::consts::PI).sqrt();
    assert!((radius - 0.35).abs() < 0.006, "{radius}");
}

#[test]
fn a_bar_that_folds_folds_further() {
    let place = Place::new();
    bars(&place);
    succeeded(&place.run(&["extend", "folding", "-o", "further"]));
    let results = Results::read(&place.path("further"));
    check_path(&results, 7, &[33, 33]);
    let bends: Vec<f64> = (0..7).map(|k| bend(&results, k)).collect();
    // As far again in as many steps: .85 at a tolerance of 1e-8 on this grid, and .92 on one of 65 nodes.
    let ratio = (bends[6] - bends[3]) / (bends[3] - bends[0]);
    assert!((ratio - 0.85).abs() < 0.03, "{bends:?}");
    assert_eq!(results.json["given_steps"], 3);
    assert_eq!(results.json["equations"].as_array().unwrap().len(), 3);
}

#[test]
fn a_longer_bar_folds_to_a_longer_folded_bar() {
    let place = Place::new();
    let given = bars(&place);
    let length = ["bar", "--length", "0.68", "--grid", "65"];
    draw(&place, "long.png", &length);
    let arguments = [
        "transport",
        "folding",
        "long.png",
        "-o",
        "out",
        "--steps",
        "2",
    ];
    let printed = succeeded(&place.run(&arguments));
    assert!(printed.contains("2 of 2 steps"), "{printed}");
    let results = Results::read(&place.path("out"));
    check_path(&results, 3, &[33, 33]);
    for name in ["variation_start.npy", "variation_end.npy"] {
        assert_eq!(results.array(name).0, [2, 33, 33]);
    }
    let [width, height] = picture_size(&results.path("analogy.png"));
    assert!(width > 300 && height > 100);
    // Transport keeps lengths, up to what three steps on a coarse grid leave.
    let (before, after) = (
        results.number("/length_variation"),
        results.number("/length"),
    );
    assert!((after / before - 1.0).abs() < 0.05, "{before} {after}");
    // Areas grow alike, and the bar stays folded.
    let areas = results.numbers("/volumes");
    let ratio = (areas[3] / areas[2]) / (areas[1] / areas[0]);
    assert!((ratio - 1.0).abs() < 0.02, "{areas:?}");
    assert!((bend(&results, 2) / bend(&given, 3) - 1.0).abs() < 0.15);
}

#[test]
fn no_variation_changes_nothing_wherever_the_shapes_were_placed() {
    let place = Place::new();
    draw(&place, "a.png", &["bar", "--rotate", "20", "--grid", "65"]);
    let folded = ["bar", "--angle", "160", "--rotate", "50", "--grid", "65"];
    draw(&place, "b.png", &folded);
    let mut arguments = vec![
        "geodesic", "a.png", "b.png", "-o", "out", "--align", "rigid",
    ];
    arguments.extend(["--grid", "33", "-K", "2"]);
    succeeded(&place.run(&arguments));
    let arguments = ["transport", "out", "a.png", "-o", "same", "--steps", "1"];
    succeeded(&place.run(&arguments));
    let results = Results::read(&place.path("same"));
    // The mask is placed and turned as it was: it is the first shape, but for rounding.
    assert!(results.number("/dice_variation") > 0.9999);
    assert!(results.number("/length_variation") < 1e-4);
    // An outline that is read from 33 nodes a side once more loses something of its corners.
    let areas = results.numbers("/volumes");
    assert!((areas[3] / areas[2] - 1.0).abs() < 0.01, "{areas:?}");
}

#[test]
fn volumes_go_on_too() {
    let place = Place::new();
    for (name, radius) in [("a.npy", "0.2"), ("b.npy", "0.23"), ("c.npy", "0.22")] {
        let shape = [
            "disk",
            "--dimension",
            "3",
            "--grid",
            "17",
            "--radius",
            radius,
        ];
        draw(&place, name, &shape);
    }
    geodesic(&place, ["a.npy", "b.npy"], "2", "17", "out");
    succeeded(&place.run(&["extend", "out", "-o", "on", "--steps", "1"]));
    let results = Results::read(&place.path("on"));
    check_path(&results, 4, &[17, 17, 17]);
    assert!(results.path("shape_003.stl").is_file());
    let volumes = results.numbers("/volumes");
    assert!(volumes.windows(2).all(|v| v[0] < v[1]), "{volumes:?}");
    let arguments = ["transport", "out", "c.npy", "-o", "carried", "--steps", "2"];
    succeeded(&place.run(&arguments));
    let results = Results::read(&place.path("carried"));
    check_path(&results, 3, &[17, 17, 17]);
    let volumes = results.numbers("/volumes");
    assert!(
        volumes[1] > volumes[0] && volumes[3] > volumes[2],
        "{volumes:?}"
    );
}

#[test]
fn threads_do_not_matter() {
    let place = Place::new();
    bars(&place);
    let run = |threads: &str| {
        let output = format!("on{threads}");
        let arguments = ["extend", "folding", "-o", &output, "--threads", threads];
        succeeded(&place.run(&arguments));
        arrays(&Results::read(&place.path(&output)))
    };
    assert!(run("1") == run("3"));
}

fn refused(place: &Place, arguments: &[&str], words: &[&str]) {
    let before = place.listing();
    let run = place.run(arguments);
    let report = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{report}");
    for word in words {
        assert!(report.contains(word), "{word}: {report}");
    }
    assert_eq!(place.listing(), before);
}

#[test]
fn what_is_no_geodesic_is_refused() {
    let place = Place::new();
    bars(&place);
    refused(
        &place,
        &["extend", "nothing", "-o", "on"],
        &["nothing", "result.json"],
    );
    refused(
        &place,
        &["extend", "folding", "-o", "folding"],
        &["exists already"],
    );
    let mut arguments = vec!["geodesic", "straight.png", "folded.png", "-o", "sets"];
    arguments.extend(["--form", "level-sets", "--grid", "17", "-K", "2"]);
    succeeded(&place.compute(&arguments));
    refused(
        &place,
        &["extend", "sets", "-o", "on"],
        &["level sets", "--form lagrangian"],
    );
    draw(&place, "small.png", &["bar", "--grid", "33"]);
    refused(
        &place,
        &["transport", "folding", "small.png", "-o", "on"],
        &["small.png", "33", "65"],
    );
    draw(
        &place,
        "ball.npy",
        &["disk", "--dimension", "3", "--grid", "17"],
    );
    refused(
        &place,
        &["transport", "folding", "ball.npy", "-o", "on"],
        &["ball.npy", "volume"],
    );
    // A tenth of it is beside the box.
    draw(
        &place,
        "beside.png",
        &["bar", "--grid", "65", "--length", ".6", "--shift", ".2,.35"],
    );
    refused(
        &place,
        &["transport", "folding", "beside.png", "-o", "on"],
        &["beside.png", "% of its area", "cut off"],
    );
    let inside = |i: usize| {
        let [x, y] = [i % 65, i / 65].map(|k| k as f64 - 32.0);
        let beside = |centre: f64| (x - centre).hypot(y) < 7.0;
        f64::from(u8::from(beside(-12.0) || beside(12.0)))
    };
    let values: Vec<f64> = (0..65 * 65).map(inside).collect();
    place.write("two.npy", &npy_f64(&[65, 65], &values));
    refused(
        &place,
        &["transport", "folding", "two.npy", "-o", "on"],
        &["two.npy", "other parts, holes or tunnels"],
    );
    std::fs::remove_file(place.path("folding/psi_002.npy")).unwrap();
    refused(&place, &["extend", "folding", "-o", "on"], &["psi_002.npy"]);
    place.write("folding/result.json", b"{}");
    refused(&place, &["extend", "folding", "-o", "on"], &["result.json"]);
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_extension_is_written() {
    let place = Place::new();
    bars(&place);
    let arguments = ["extend", "folding", "-o", "on", "--steps", "1024"];
    assert_eq!(interrupted(&place, &arguments, "equation 1"), Some(130));
    let results = Results::read(&place.path("on"));
    assert_eq!(results.json["status"], "cancelled");
    let found = results.number("/steps_found") as usize;
    assert!(found < 1024);
    check_path(&results, 4 + found, &[33, 33]);
}
