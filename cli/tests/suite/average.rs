//! `average` and `demo` from files to files.

use crate::common::{Place, Results, arrays, draw, drawn, grey_png, npy_f64, succeeded};

const KEYS: [&str; 20] = [
    "average",
    "certificate",
    "dice",
    "dimension",
    "energy",
    "evaluations",
    "hausdorff",
    "hausdorff_input_units",
    "input",
    "iterations",
    "levels",
    "mean_dice",
    "memory_estimate",
    "nodes",
    "parameters",
    "seconds",
    "shape_evaluations",
    "solver_seconds",
    "status",
    "version",
];

pub fn averaged(place: &Place, inputs: &[String], options: &[&str], output: &str) -> Results {
    let mut arguments = vec!["average"];
    arguments.extend(inputs.iter().map(String::as_str));
    arguments.extend(["-o", output]);
    arguments.extend(options);
    succeeded(&place.compute(&arguments));
    Results::read(&place.path(output))
}

/// Everything that holds for every average of `n` shapes.
pub fn check(results: &Results, n: usize, shape: &[u64]) {
    for key in KEYS {
        assert!(!results.json[key].is_null(), "no {key} in result.json");
    }
    let p = &results.json["parameters"];
    for key in [
        "align",
        "boundary",
        "grid",
        "interface_cells",
        "lambda",
        "law",
        "length_weight",
        "mismatch_weight",
        "mu",
        "solver",
        "void_stiffness",
        "weights",
    ] {
        assert!(!p[key].is_null(), "no parameter {key}");
    }
    check_energy(results, n);
    let levels = results.json["levels"].as_array().unwrap();
    let sum = |key: &str| -> u64 { levels.iter().map(|l| l[key].as_u64().unwrap()).sum() };
    assert_eq!(results.json["iterations"], sum("iterations"));
    assert_eq!(results.json["evaluations"], results.evaluations());
    assert_eq!(levels.last().unwrap()["energy"], results.json["energy"]);
    assert_eq!(levels.last().unwrap()["nodes"], results.json["nodes"]);
    assert_eq!(results.json["certificate"]["certified"], true);
    for dice in results.numbers("/dice") {
        assert!(dice > 0.5 && dice <= 1.0, "{dice}");
    }
    let distances = results.json["hausdorff"].as_array().unwrap();
    let physical = results.json["hausdorff_input_units"].as_array().unwrap();
    for (i, (unit, own)) in distances.iter().zip(physical).enumerate() {
        let scale = results.number(&format!("/input/{i}/frame/scale"));
        let (unit, own) = (
            unit["maximum"].as_f64().unwrap(),
            own["maximum"].as_f64().unwrap(),
        );
        assert!((unit - own * scale).abs() < 1e-14);
    }
    check_arrays(results, n, shape);
    let table = std::fs::read_to_string(results.path("energy.csv")).unwrap();
    let steps: usize = sum("iterations") as usize + levels.len();
    assert_eq!(table.lines().count(), 1 + steps);
    for name in ["average.png", "strain.png", "average.vti", "energy.svg"] {
        assert!(
            std::fs::metadata(results.path(name)).unwrap().len() > 500,
            "{name}"
        );
    }
}

/// The functional is the weighted sum of its terms.
fn check_energy(results: &Results, n: usize) {
    let weights = results.numbers("/parameters/weights");
    let (elastic, mismatch) = (
        results.numbers("/energy/elastic"),
        results.numbers("/energy/mismatch"),
    );
    assert_eq!([weights.len(), elastic.len(), mismatch.len()], [n; 3]);
    let total = weights
        .iter()
        .zip(&elastic)
        .map(|(w, e)| w * e)
        .sum::<f64>()
        + results.number("/parameters/mismatch_weight") / n as f64 * mismatch.iter().sum::<f64>()
        + results.number("/parameters/length_weight") * results.number("/energy/length");
    let written = results.number("/energy/total");
    // A few sums in another order.
    assert!(
        (total - written).abs() <= 1e-12 * written,
        "{total} {written}"
    );
}

fn check_arrays(results: &Results, n: usize, shape: &[u64]) {
    let (found, phase_field) = results.array("average.npy");
    assert_eq!(found, shape);
    assert!(phase_field.iter().all(|v| (-0.1..1.1).contains(v)));
    assert_eq!(results.mask("average_mask.npy").0, shape);
    let mut vector = vec![shape.len() as u64];
    vector.extend(shape);
    let stiffness = results.number("/parameters/void_stiffness");
    for i in 0..n {
        assert_eq!(results.array(&format!("deformation_{i:03}.npy")).0, vector);
        let (found, values) = results.array(&format!("phasefield_{i:03}.npy"));
        assert_eq!(found, shape);
        assert!(values.iter().all(|v| (0.0..1.0).contains(v)));
        let (found, weight) = results.array(&format!("weight_{i:03}.npy"));
        assert_eq!(found, shape);
        assert!(weight.iter().all(|w| (stiffness..=1.0).contains(w)));
        check_strain(results, i, &weight, shape);
    }
    assert!(!results.path(&format!("weight_{n:03}.npy")).exists());
}

/// The maps of strains have a number a cell, and their ranges are those over the cells of the shape.
fn check_strain(results: &Results, i: usize, weight: &[f64], shape: &[u64]) {
    let cells: Vec<usize> = shape.iter().map(|n| *n as usize - 1).collect();
    let count = cells.iter().product::<usize>();
    // The last axis is x.
    let corners = |cell: usize| {
        let mut index = cell;
        let at: Vec<usize> = cells
            .iter()
            .rev()
            .map(|n| {
                let k = index % n;
                index /= n;
                k
            })
            .collect();
        (0..1usize << cells.len()).map(move |c| {
            let places = at.iter().zip(shape.iter().rev()).enumerate();
            let (node, _) = places.fold((0, 1), |(sum, stride), (k, (i, n))| {
                (sum + (i + (c >> k & 1)) * stride, stride * *n as usize)
            });
            node
        })
    };
    let inside = |cell: &usize| {
        let mean = corners(*cell).map(|node| weight[node]).sum::<f64>();
        mean / (1usize << cells.len()) as f64 >= 0.5
    };
    let inside: Vec<usize> = (0..count).filter(inside).collect();
    let names: &[&str] = if shape.len() == 3 {
        &["norm", "cofactor", "determinant"]
    } else {
        &["norm", "determinant"]
    };
    for name in names {
        let (found, map) = results.array(&format!("{name}_{i:03}.npy"));
        assert_eq!(found, shape.iter().map(|n| n - 1).collect::<Vec<_>>());
        let least = inside.iter().fold(f64::INFINITY, |a, &c| a.min(map[c]));
        let stated = results.number(&format!("/strain/{i}/{name}/least"));
        // The void stiffness moves the limit of one half by its half: hardly a cell.
        assert!((least - stated).abs() < 1e-3, "{name} {least} {stated}");
        let mean = results.number(&format!("/strain/{i}/{name}/mean"));
        assert!(stated <= mean && mean <= results.number(&format!("/strain/{i}/{name}/greatest")));
    }
}

/// Largest `|phi - id|` of a deformation, and the mean of `phi - id` along each axis.
fn displacement(results: &Results, index: usize) -> (f64, Vec<f64>) {
    let (shape, positions) = results.array(&format!("deformation_{index:03}.npy"));
    let (dimension, side) = (shape[0] as usize, shape[1] as usize);
    let n = side.pow(dimension as u32);
    let (mut largest, mut means) = (0.0, Vec::new());
    for k in 0..dimension {
        let moved = (0..n).map(|i| {
            // Component 0 is x, and x runs fastest.
            let own = (i / side.pow(k as u32) % side) as f64 / (side - 1) as f64;
            positions[k * n + i] - own
        });
        largest = moved.clone().fold(largest, |a: f64, u| a.max(u.abs()));
        means.push(moved.sum::<f64>() / n as f64);
    }
    (largest, means)
}

#[test]
fn a_flat_average_has_all_its_files() {
    let place = Place::new();
    let inputs = drawn(&place, "bars", "2", "33");
    let results = averaged(&place, &inputs, &["--grid", "33"], "out");
    check(&results, 2, &[33, 33]);
    assert!(!results.path("average.stl").exists());
    let area = results.number("/average/area");
    // Bars of .6 x .12; bending keeps the area to a few per cent.
    assert!((area / 0.072 - 1.0).abs() < 0.08, "{area}");
    let (_, mask) = results.mask("average_mask.npy");
    let counted = mask.iter().copied().map(f64::from).sum::<f64>() / 1024.0;
    assert!((counted / area - 1.0).abs() < 0.1, "{counted} {area}");
    for i in 0..2 {
        let own = results.number(&format!("/input/{i}/area"));
        assert!((own / 0.072 - 1.0).abs() < 0.08, "{own}");
        // The file's length unit is one sample, 1/32 of the box.
        let samples = results.number(&format!("/input/{i}/area_input_units"));
        assert!((samples / (1024.0 * own) - 1.0).abs() < 1e-12);
    }
    assert_eq!(results.json["nodes"], serde_json::json!([33, 33]));
    // Nothing else lies beside the results.
    assert_eq!(place.listing(), ["bars", "out"]);
}

#[test]
fn an_average_in_space_has_its_surface() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "3", "17");
    let results = averaged(&place, &inputs, &["--grid", "17"], "out");
    check(&results, 2, &[17, 17, 17]);
    let mut file = std::fs::File::open(results.path("average.stl")).unwrap();
    let mesh = stl_io::read_stl(&mut file).unwrap();
    mesh.validate().unwrap();
    // In the coordinates of the inputs: samples of an array of 17.
    assert_eq!(results.json["surface"]["coordinates"], "input");
    for k in 0..3 {
        let axis = || mesh.vertices.iter().map(|v| v.0[k]);
        let (low, high) = (axis().fold(16.0, f32::min), axis().fold(0.0, f32::max));
        // Balls of radius 3.2 and 4.8 samples about sample 8.
        assert!((low + high - 16.0).abs() < 0.3, "{low} {high}");
        assert!((6.4..9.6).contains(&(high - low)), "{low} {high}");
    }
}

#[test]
fn the_summary_ends_with_the_picture() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "33");
    let mut arguments = vec!["average", "-o", "out", "--grid", "33"];
    arguments.extend(inputs.iter().map(String::as_str));
    let run = place.run(&arguments);
    let text = succeeded(&run);
    let last = text.lines().last().unwrap();
    assert!(place.path("out/report.html").exists());
    assert!(text.contains("report       out/report.html"), "{text}");
    assert!(last.ends_with("out/average.png"), "{last}");
    for word in ["energy", "Dice", "certified", "converged"] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    // Progress has its own stream: a line for each of the levels 9, 17 and 33.
    let progress = String::from_utf8(run.stderr).unwrap();
    assert_eq!(progress.matches("nodes a side").count(), 3, "{progress}");
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let place = Place::new();
    let flat = drawn(&place, "letters", "2", "65");
    let solid = drawn(&place, "blobs", "3", "17");
    for (name, inputs, grid, align) in [
        ("flat", &flat[..], "65", "rigid"),
        ("solid", &solid[..3], "17", "none"),
    ] {
        let runs: Vec<Results> = ["1", "2"]
            .iter()
            .map(|threads| {
                let options = ["--grid", grid, "--align", align, "--threads", threads];
                let options = [&options[..], &["--tolerance", "0.05"]].concat();
                averaged(&place, inputs, &options, &format!("{name}_{threads}"))
            })
            .collect();
        let (one, two) = (arrays(&runs[0]), arrays(&runs[1]));
        // The average, and of every shape its fields and the maps of its strain.
        let maps = if name == "flat" { 2 } else { 3 };
        assert_eq!(one.len(), 2 + 3 * (3 + maps));
        for ((name, a), (_, b)) in one.iter().zip(&two) {
            assert!(a == b, "{name} differs");
        }
        assert_eq!(runs[0].json["energy"], runs[1].json["energy"]);
    }
}

#[test]
fn identical_inputs_stay_where_they_are() {
    let place = Place::new();
    draw(
        &place,
        "bar.npy",
        &["bar", "--angle", "118", "--grid", "65"],
    );
    let inputs = vec!["bar.npy".to_owned(); 3];
    let results = averaged(&place, &inputs, &["--grid", "65"], "out");
    for i in 0..3 {
        let (largest, _) = displacement(&results, i);
        assert!(largest < 1e-3, "{largest}");
    }
    assert!(results.numbers("/dice").iter().all(|d| *d > 0.995));
}

#[test]
fn deformations_go_from_the_inputs_to_the_average() {
    let place = Place::new();
    draw(
        &place,
        "left.npy",
        &["disk", "--grid", "33", "--shift", "-.06,-.02"],
    );
    draw(
        &place,
        "right.npy",
        &["disk", "--grid", "33", "--shift", ".06,.02"],
    );
    let inputs = ["left.npy".to_owned(), "right.npy".to_owned()];
    let results = averaged(&place, &inputs, &["--grid", "33"], "out");
    let (_, left) = displacement(&results, 0);
    let (_, right) = displacement(&results, 1);
    // The void follows the disks only in part.
    assert!(left[0] > 0.01 && right[0] < -0.01, "{left:?} {right:?}");
    assert!(left[0] > 2.0 * left[1].abs() && right[0] < -2.0 * right[1].abs());
}

#[test]
fn weights_pull_the_average() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "33");
    let area = |weights: &str, name: &str| {
        let options = ["--grid", "33", "--weights", weights];
        let results = averaged(&place, &inputs, &options, name);
        check(&results, 2, &[33, 33]);
        results.number("/average/area")
    };
    // Radii .2 and .3.
    let (small, large) = (area(".75,.25", "small"), area(".25,.75", "large"));
    assert!(
        small > 0.125 && large < 0.283 && small < 0.93 * large,
        "{small} {large}"
    );
}

#[test]
fn the_descent_and_every_option_run() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "17");
    let options = ["--grid", "17", "--solver", "descent"];
    let descent = averaged(&place, &inputs, &options, "descent");
    check(&descent, 2, &[17, 17]);
    assert_eq!(descent.json["parameters"]["solver"], "descent");
    let options = [
        "--grid",
        "17",
        "--law",
        "inverse:logdet",
        "--lambda",
        "2",
        "--mu",
        ".5",
        "--mismatch-weight",
        ".5",
        "--length-weight",
        "1e-3",
        "--void-stiffness",
        "1e-3",
        "--boundary",
        "identity",
    ];
    let other = averaged(&place, &inputs, &options, "other");
    check(&other, 2, &[17, 17]);
    for (key, value) in [("lambda", 2.0), ("mu", 0.5), ("mismatch_weight", 0.5)] {
        assert_eq!(other.number(&format!("/parameters/{key}")), value);
    }
    assert_eq!(other.json["parameters"]["law"], "inverse:logdet");
    // The faces of the box stay where they are.
    let (_, positions) = other.array("deformation_000.npy");
    for i in 0..17 {
        assert_eq!(positions[i], i as f64 / 16.0);
        assert_eq!(positions[289 + i], 0.0);
    }
}

#[test]
fn aligned_inputs_lie_on_each_other() {
    let place = Place::new();
    let bar = ["bar", "--angle", "100", "--grid", "65"];
    draw(&place, "a.npy", &bar);
    let mut turned = bar.to_vec();
    turned.extend(["--rotate", "70", "--shift", ".04,-.03"]);
    draw(&place, "b.npy", &turned);
    let inputs = ["a.npy".to_owned(), "b.npy".to_owned()];
    let options = ["--grid", "33", "--align", "rigid"];
    let results = averaged(&place, &inputs, &options, "out");
    check(&results, 2, &[33, 33]);
    let angles: Vec<f64> = (0..2)
        .map(|i| results.number(&format!("/input/{i}/alignment/angle_degrees")))
        .collect();
    let (least, most) = (angles[0].min(angles[1]), angles[0].max(angles[1]));
    // Drawn on 65 nodes, an edge is known to a few hundredths of a cell: a few tenths of a degree.
    assert!(least == 0.0 && (most - 70.0).abs() < 0.5, "{angles:?}");
    let dice = results.numbers("/dice");
    assert!(dice.iter().all(|d| *d > 0.97), "{dice:?}");
    let elastic = results.numbers("/energy/elastic");
    // What is left is a shift of hundredths of a cell; a bend of a few degrees costs 1e-3.
    assert!(elastic.iter().all(|e| *e < 2e-5), "{elastic:?}");
}

/// A picture of an L with strokes of a third of its size, turned by a quarter turn or not.
fn letter_png(pixels: u32, size: u32, turned: bool) -> Vec<u8> {
    let (from, stroke) = ((pixels - size) / 2, size / 3);
    let pixel = |k: u32| {
        let (x, y) = (k % pixels, k / pixels);
        let (x, y) = if turned { (y, pixels - 1 - x) } else { (x, y) };
        let inside = |i: u32, length: u32| (from..from + length).contains(&i);
        let covered = inside(x, stroke) && inside(y, size) || inside(x, size) && inside(y, stroke);
        if covered { 255 } else { 0 }
    };
    let grey: Vec<u8> = (0..pixels * pixels).map(pixel).collect();
    grey_png(pixels, pixels, &grey)
}

#[test]
fn shapes_without_common_coordinates_are_aligned_by_default() {
    let place = Place::new();
    place.write("a.png", &letter_png(60, 36, false));
    place.write("b.png", &letter_png(60, 36, true));
    let pictures = ["a.png".to_owned(), "b.png".to_owned()];
    let aligned = averaged(&place, &pictures, &["--grid", "33"], "aligned");
    let angles: Vec<f64> = (0..2)
        .map(|i| aligned.number(&format!("/input/{i}/alignment/angle_degrees")))
        .collect();
    // Both are the same pixels, turned.
    assert!((angles[0] - angles[1]).abs() > 89.9, "{angles:?}");
    assert!(aligned.numbers("/dice").iter().all(|d| *d > 0.99));
    assert_eq!(aligned.json["parameters"]["align"], "rigid");
    let options = ["--grid", "33", "--align", "none"];
    let kept = averaged(&place, &pictures, &options, "kept");
    assert!(kept.json["input"][1]["alignment"].is_null());
    // Arrays of nodes have coordinates.
    let arrays = drawn(&place, "crosses", "2", "33");
    let nodal = averaged(&place, &arrays[..2], &["--grid", "17"], "nodal");
    assert_eq!(nodal.json["parameters"]["align"], "none");
}

#[test]
fn shapes_are_scaled_to_equal_sizes() {
    let place = Place::new();
    place.write("a.png", &letter_png(60, 24, false));
    place.write("b.png", &letter_png(60, 48, false));
    let pictures = ["a.png".to_owned(), "b.png".to_owned()];
    let options = ["--grid", "33", "--size", "equal"];
    let equal = averaged(&place, &pictures, &options, "equal");
    let factors = [0, 1].map(|i| equal.number(&format!("/input/{i}/size_factor")));
    assert!((factors[0] / factors[1] - 2.0).abs() < 1e-9, "{factors:?}");
    let area = |i: usize, unit: &str| equal.number(&format!("/input/{i}/area{unit}"));
    assert!((area(0, "") / area(1, "") - 1.0).abs() < 0.05);
    // Boundaries between pixels cut the corners of the smaller letter more.
    assert!((area(1, "_input_units") / area(0, "_input_units") - 4.0).abs() < 0.2);
    assert!(equal.numbers("/dice").iter().all(|d| *d > 0.98));
}

#[test]
fn options_that_cannot_work_are_refused_before_anything_is_written() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "17");
    // A thin angle, none of whose points is a node of the coarse grid.
    let thin: Vec<f64> = (0..200 * 200)
        .map(|k| {
            f64::from(u8::from(
                k % 200 == 3 && k < 39000 || k / 200 == 194 && k % 200 > 2,
            ))
        })
        .collect();
    place.write("thin.npy", &npy_f64(&[200, 200], &thin));
    let before = place.listing();
    for (options, words) in [
        (vec!["--void-stiffness", "2"], ["--void-stiffness", "2"]),
        (
            vec!["--law", "power_two_term", "--lambda", ".01"],
            ["power_two_term", "--lambda"],
        ),
        (vec!["--law", "rubber"], ["rubber", "inverse:logdet"]),
        (
            vec![
                "thin.npy", "--grid", "9", "--frame", "centred", "--align", "none",
            ],
            ["thin.npy", "--grid"],
        ),
        (vec!["--threads", "0"], ["--threads", "0"]),
    ] {
        let mut arguments = vec!["average", &inputs[0], &inputs[1], "-o", "out"];
        arguments.extend(&options);
        let run = place.run(&arguments);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{options:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
        assert_eq!(place.listing(), before);
    }
}

#[test]
fn the_demo_picks_a_free_name_and_ends_with_the_picture() {
    let place = Place::new();
    std::fs::create_dir(place.path("shapespace-demo")).unwrap();
    let text = succeeded(&place.run(&["demo"]));
    let last = text.lines().last().unwrap();
    assert!(last.ends_with("shapespace-demo-2/average.png"), "{last}");
    let results = Results::read(&place.path("shapespace-demo-2"));
    let n = results.json["input"].as_array().unwrap().len();
    check(&results, n, &[129, 129]);
    assert!(results.number("/mean_dice") > 0.97);
    for input in results.json["input"].as_array().unwrap() {
        assert!(place.path(input["path"].as_str().unwrap()).exists());
    }
}
