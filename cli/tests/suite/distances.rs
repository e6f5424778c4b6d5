//! `distances` from files to files.

use std::path::Path;

#[cfg(target_os = "linux")]
use crate::common::interrupted;
use crate::common::{Place, Results, draw, nifti, npy_f64, picture_size, succeeded};
use serde_json::Value;

/// Disks and ellipses, two and two: the ellipses are equal but for a turn.
const SHAPES: [(&str, &[&str]); 4] = [
    ("disk-1.npy", &["disk", "--radius", ".2"]),
    ("disk-2.npy", &["disk", "--radius", ".23"]),
    ("oval-1.npy", &["ellipse", "--radii", ".32,.14"]),
    (
        "oval-2.npy",
        &["ellipse", "--radii", ".32,.14", "--rotate", "40"],
    ),
];

pub fn shapes(place: &Place) -> Vec<&'static str> {
    for (name, arguments) in SHAPES {
        draw(place, name, &[arguments, &["--grid", "33"]].concat());
    }
    SHAPES.map(|(name, _)| name).into()
}

pub fn arguments<'a>(inputs: &[&'a str], options: &[&'a str], output: &'a str) -> Vec<&'a str> {
    let mut all = vec!["distances"];
    all.extend(inputs);
    all.extend(["--grid", "33", "-K", "2", "-o", output]);
    all.extend(options);
    all
}

pub fn measured(place: &Place, inputs: &[&str], options: &[&str], output: &str) -> Results {
    succeeded(&place.compute(&arguments(inputs, options, output)));
    Results::read(&place.path(output))
}

fn matrix(results: &Results, name: &str) -> Vec<Vec<f64>> {
    let rows = results.json[name]["matrix"].as_array().unwrap();
    (0..rows.len())
        .map(|i| results.numbers(&format!("/{name}/matrix/{i}")))
        .collect()
}

/// A result without what depends on the clock.
pub fn timeless(results: &Results) -> Value {
    let mut json = results.json.clone();
    let all = json.as_object_mut().unwrap();
    for key in [
        "seconds",
        "path_seconds",
        "peak_memory_bytes",
        "record_sha256",
    ] {
        all.remove(key);
    }
    for path in json["paths"].as_array_mut().unwrap() {
        path.as_object_mut().unwrap().remove("seconds");
    }
    json
}

pub fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// What is compared byte by byte: every file that holds no times.
pub fn exact(results: &Results) -> Vec<(String, Vec<u8>)> {
    let names = files(&results.path(".")).into_iter();
    let timed = ["paths.csv", "report.html", "result.json"];
    let names = names.filter(|n| !timed.contains(&n.as_str()) && results.path(n).is_file());
    names
        .map(|name| {
            let bytes = std::fs::read(results.path(&name)).unwrap();
            (name, bytes)
        })
        .collect()
}

#[test]
fn disks_and_ellipses_are_told_apart() {
    let place = Place::new();
    let inputs = shapes(&place);
    let options = ["--richardson", "--classes", "prefix"];
    let results = measured(&place, &inputs, &options, "out");
    assert_eq!(results.json["status"], "complete");
    assert_eq!(results.json["align"], "pairs");
    assert_eq!(
        files(&results.path(".")),
        [
            "config.toml",
            "dendrogram.png",
            "distances.csv",
            "distances.npy",
            "elastic.csv",
            "embedding.csv",
            "embedding.png",
            "matrix.png",
            "pairs",
            "paths.csv",
            "report.html",
            "result.json",
            "work.json",
        ]
    );
    let distances = matrix(&results, "distances");
    for i in 0..4 {
        assert_eq!(distances[i][i], 0.0);
        for j in 0..4 {
            assert_eq!(distances[i][j], distances[j][i]);
        }
    }
    // Per unit of radius the length is sqrt((2 lambda + 2 mu) pi). A cell is .031 wide, and the
    // boundary lags behind by a share of it.
    let exact = (4.0 * std::f64::consts::PI).sqrt() * 0.03;
    assert!(
        (distances[0][1] / exact - 1.0).abs() < 0.12,
        "{}",
        distances[0][1]
    );
    // A turn is no distance, up to what the grid makes of it.
    assert!(distances[2][3] < 0.25 * distances[1][2], "{distances:?}");
    for place in ["/distances/agreement", "/elastic/agreement"] {
        assert_eq!(
            results.number(&format!("{place}/nearest_neighbour_accuracy")),
            1.0
        );
        assert_eq!(results.number(&format!("{place}/purity")), 1.0);
        assert_eq!(results.number(&format!("{place}/adjusted_rand_index")), 1.0);
    }
    assert_eq!(results.numbers("/clustering/labels"), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(results.number("/clustering/clusters"), 2.0);
    assert_eq!(results.number("/distances/triangles/count"), 4.0);
    check_paths(&results, &distances);
    check_tables(&results, &distances);
    for name in ["dendrogram.png", "embedding.png", "matrix.png"] {
        let [width, height] = picture_size(&results.path(name));
        assert!(width > 300 && height > 200, "{name}: {width} x {height}");
    }
}

/// The distances come from the lengths as it is said.
fn check_paths(results: &Results, distances: &[Vec<f64>]) {
    let paths = results.json["paths"].as_array().unwrap();
    assert_eq!(paths.len(), 12);
    let of = |i: usize, j: usize, key: &str| -> f64 {
        let found = paths.iter().find(|p| p["start"] == i && p["end"] == j);
        found.unwrap()[key].as_f64().unwrap()
    };
    let elastic = matrix(results, "elastic");
    for i in 0..4 {
        for j in i + 1..4 {
            let mean = |key: &str| 0.5 * (of(i, j, key) + of(j, i, key));
            let limit = mean("length") + (mean("length") - mean("half_length")) / 3.0;
            assert!((distances[i][j] - limit).abs() < 1e-14);
            assert_eq!(elastic[i][j], mean("elastic"));
            // Half of two steps is one.
            assert_eq!(of(i, j, "half_length"), of(i, j, "elastic"));
        }
    }
    let scale = 32.0;
    assert!((results.number("/length_unit") / scale - 1.0).abs() < 1e-12);
}

fn check_tables(results: &Results, distances: &[Vec<f64>]) {
    let (shape, values) = results.array("distances.npy");
    assert_eq!(shape, [4, 4]);
    assert_eq!(values, distances.concat());
    let table = std::fs::read_to_string(results.path("distances.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], ",disk-1,disk-2,oval-1,oval-2");
    let row: Vec<f64> = lines[2]
        .split(',')
        .skip(1)
        .map(|cell| cell.parse().unwrap())
        .collect();
    assert_eq!(row, distances[1]);
    let map = std::fs::read_to_string(results.path("embedding.csv")).unwrap();
    assert_eq!(map.lines().count(), 5);
    assert!(map.lines().nth(3).unwrap().starts_with("oval-1,oval,1,"));
    let paths = std::fs::read_to_string(results.path("paths.csv")).unwrap();
    assert_eq!(paths.lines().count(), 13);
}

#[test]
fn a_run_goes_on_where_it_was() {
    let place = Place::new();
    let inputs = shapes(&place);
    let inputs = &inputs[1..];
    let whole = measured(&place, inputs, &["--threads", "1"], "whole");
    let copy = |from: &str, to: &str| {
        std::fs::create_dir_all(place.path(to)).unwrap();
        for name in files(&place.path(from)) {
            let (from, to) = (place.path(from).join(&name), place.path(to).join(&name));
            if from.is_file() {
                std::fs::copy(from, to).unwrap();
            }
        }
    };
    // A run that has come as far as all pairs but one, another one being damaged. Both directions of
    // a pair are computed together.
    copy("whole/pairs", "again.partial/pairs");
    copy("whole", "again.partial");
    std::fs::remove_file(place.path("again.partial/pairs/002_001.json")).unwrap();
    place.write("again.partial/pairs/000_002.json", b"{\"start\": 0");
    // Other parameters are refused, and so are other shapes.
    for (options, inputs, words) in [
        (
            vec!["--tolerance", "1e-3"],
            inputs.to_vec(),
            "tolerance 0.0001 there, 0.001 here",
        ),
        (
            vec!["--align", "none"],
            inputs.to_vec(),
            "align rigid there, none here",
        ),
        (vec!["--richardson"], inputs.to_vec(), "richardson"),
        (
            vec![],
            vec!["disk-1.npy", inputs[1], inputs[2]],
            "input 1 is another shape",
        ),
        (vec![], inputs[..2].to_vec(), "3 inputs there, 2 here"),
    ] {
        let run = place.run(&arguments(&inputs, &options, "again"));
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(words), "no '{words}' in: {report}");
        assert!(report.contains("again.partial"), "{report}");
    }
    // More threads than pairs are left, too.
    let run = place.run(&arguments(inputs, &["--threads", "3"], "again"));
    succeeded(&run);
    let progress = String::from_utf8(run.stderr).unwrap();
    assert!(
        progress.contains("going on: 2 of 6 pairs are there"),
        "{progress}"
    );
    let again = Results::read(&place.path("again"));
    assert_eq!(timeless(&again), timeless(&whole));
    assert_eq!(exact(&again), exact(&whole));
    assert!(!place.path("again.partial").exists());
    // What is made of the paths may be chosen anew.
    copy("whole/pairs", "other.partial/pairs");
    copy("whole", "other.partial");
    let other = measured(&place, inputs, &["--linkage", "ward"], "other");
    assert_eq!(other.json["paths"], whole.json["paths"]);
    assert_eq!(other.json["parameters"]["linkage"], "ward");
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let place = Place::new();
    let inputs = shapes(&place);
    let runs: Vec<Results> = [
        ["--threads", "1", "--at-once", "1"],
        ["--threads", "3", "--at-once", "2"],
        ["--threads", "4", "--at-once", "4"],
    ]
    .iter()
    .enumerate()
    .map(|(k, threads)| measured(&place, &inputs[..3], threads, &format!("out_{k}")))
    .collect();
    for other in &runs[1..] {
        assert_eq!(timeless(other), timeless(&runs[0]));
        assert_eq!(exact(other), exact(&runs[0]));
    }
}

#[test]
fn the_order_of_the_inputs_changes_no_bit_of_a_length() {
    let place = Place::new();
    draw(
        &place,
        "oval.npy",
        &[
            "ellipse", "--radii", ".3,.16", "--rotate", "25", "--grid", "33",
        ],
    );
    draw(&place, "bar.npy", &["bar", "--angle", "50", "--grid", "33"]);
    let [first, second] = [["oval.npy", "bar.npy"], ["bar.npy", "oval.npy"]].map(|inputs| {
        matrix(
            &measured(&place, &inputs, &[], inputs[0].trim_end_matches(".npy")),
            "distances",
        )
    });
    assert!(first[0][1] > 0.1, "{first:?}");
    // The mean of both directions.
    assert_eq!(first[0][1].to_bits(), second[0][1].to_bits());
}

#[test]
fn paths_that_fall_short_are_marked_and_not_used() {
    let place = Place::new();
    let bar = ["bar", "--length", ".7", "--width", ".08", "--grid", "33"];
    draw(&place, "bar.npy", &bar);
    draw(
        &place,
        "disk.npy",
        &["disk", "--radius", ".13", "--grid", "33"],
    );
    draw(&place, "ring.npy", &["letter", "o", "--grid", "33"]);
    let inputs = ["bar.npy", "disk.npy", "ring.npy"];
    // Enough iterations for the ends of the bar to become round, and too few for the disk to approach
    // the ring from inside.
    let options = ["--one-way", "--max-iterations", "20", "--domain", "start"];
    let options = [&options[..], &["--refine", "0"]].concat();
    let results = measured(&place, &inputs, &options, "out");
    assert_eq!(results.json["status"], "incomplete");
    let marked = results.json["marked"].as_array().unwrap();
    // No deformation of a disk makes a ring of it.
    let mark = marked
        .iter()
        .find(|m| m["start"] == 1 && m["end"] == 2 && m["steps"] == 2)
        .unwrap();
    assert_eq!(
        (&mark["end_reached"], &mark["outcome"]),
        (&false.into(), &"left_out".into())
    );
    let length = |results: &Results, path: usize| {
        let found = results.json["paths"][path].get("length").cloned();
        found.map(|length| length.as_f64().unwrap())
    };
    assert_eq!((length(&results, 1), length(&results, 2)), (None, None));
    assert!(results.json.get("embedding").is_none());
    let table = std::fs::read_to_string(results.path("distances.csv")).unwrap();
    assert!(table.lines().nth(2).unwrap().ends_with(','), "{table}");
    let (_, values) = results.array("distances.npy");
    assert!(values[5].is_nan() && values[1] > 0.0);
    // From the bar it comes some of the way (.75, from the disk .70), which is used where that is asked for, and said so.
    std::fs::rename(place.path("out"), place.path("low.partial")).unwrap();
    let options = [&options[..], &["--reached", ".72"]].concat();
    let low = measured(&place, &inputs, &options, "low");
    assert_eq!(low.json["status"], "incomplete");
    let (there, on) = (length(&low, 0).unwrap(), length(&low, 1).unwrap());
    assert_eq!(length(&low, 2), None);
    let marked = low.json["marked"].as_array().unwrap();
    assert!(marked.iter().any(|m| m["outcome"] == "used"));
    // The way by the bar stands in for that from the disk to the ring.
    assert_eq!(low.json["distances"]["filled"], serde_json::json!([[1, 2]]));
    assert_eq!(matrix(&low, "distances")[1][2], there + on);
    let (_, values) = low.array("distances.npy");
    assert!(values[5].is_nan() && values[2] == on);
    // Another attempt is made of what is not reached only.
    let options = [
        "--one-way",
        "--max-iterations",
        "3",
        "--retry",
        "level-sets",
        "--refine",
        "0",
    ];
    let retried = measured(&place, &inputs, &options, "retried");
    let tried = |name: &str| {
        let bytes = std::fs::read(retried.path("pairs").join(name)).unwrap();
        let pair: Value = serde_json::from_slice(&bytes).unwrap();
        let paths = pair["paths"].as_array().unwrap().clone();
        paths.iter().filter(|p| p["form"] == "level_sets").count()
    };
    assert_eq!(tried("001_002.json"), 2);
}

#[test]
fn volumes_have_distances_too() {
    let place = Place::new();
    for (name, radii) in [("a.npy", ".2"), ("b.npy", ".22"), ("c.npy", ".28,.2,.2")] {
        let ball = [
            "ellipse",
            "--radii",
            radii,
            "--dimension",
            "3",
            "--grid",
            "17",
        ];
        draw(&place, name, &ball);
    }
    let run = place.run(&[
        "distances",
        "a.npy",
        "b.npy",
        "c.npy",
        "--grid",
        "17",
        "-K",
        "1",
        "-o",
        "out",
    ]);
    let text = succeeded(&run);
    let last = text.lines().last().unwrap();
    assert!(last.ends_with("out/embedding.png"), "{last}");
    for word in ["3 shapes", "asymmetry", "triangles", "clusters", "stress"] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["dimension"], 3);
    let distances = matrix(&results, "distances");
    assert!(distances[0][1] < distances[0][2], "{distances:?}");
    assert_eq!(place.listing(), ["a.npy", "b.npy", "c.npy", "out"]);
}

#[test]
fn what_cannot_work_is_refused_before_anything_is_written() {
    let place = Place::new();
    let inputs = shapes(&place);
    place.write("empty.npy", &npy_f64(&[17, 17], &[0.0; 289]));
    let mut labels = [0u8; 64];
    labels[21] = 2;
    place.write("volume.nii", &nifti([4, 4, 4], [1.0; 3], &labels));
    place.write("classes.csv", b"file,class\ndisk-1.npy,disk\n");
    std::fs::create_dir(place.path("taken")).unwrap();
    std::fs::create_dir(place.path("other.partial")).unwrap();
    place.write("other.partial/mine.txt", b"x");
    let before = place.listing();
    let (a, b) = (inputs[0], inputs[1]);
    for (arguments, words) in [
        (vec![a, "-o", "out"], vec!["at least 2"]),
        (vec![a, b, "-o", "taken"], vec!["'taken'", "exists already"]),
        (
            vec![a, b, "-o", "other"],
            vec!["'other.partial'", "exists already"],
        ),
        (vec![a, b, "-o", "no/where"], vec!["no"]),
        (vec![a, "empty.npy", "-o", "out"], vec!["empty.npy"]),
        (
            vec![a, "volume.nii", "-o", "out"],
            vec!["volume.nii", "picture"],
        ),
        (vec![a, b, "-o", "out", "--grid", "64"], vec!["--grid 65"]),
        (
            vec![a, b, "-o", "out", "-K", "3", "--richardson"],
            vec!["--richardson", "even"],
        ),
        (
            vec![a, b, "-o", "out", "--clusters", "3"],
            vec!["--clusters", "2 shapes"],
        ),
        (
            vec![a, b, "-o", "out", "--reached", "1.5"],
            vec!["--reached"],
        ),
        (
            vec![a, b, "-o", "out", "--retry", "lagrangian"],
            vec!["--retry"],
        ),
        (
            vec![a, b, "-o", "out", "--area-weight", "1"],
            vec!["--area-weight"],
        ),
        (
            vec![a, b, "-o", "out", "--classes", "classes.csv"],
            vec!["disk-2.npy", "class"],
        ),
        (
            vec![a, b, "-o", "out", "--classes", "none.csv"],
            vec!["none.csv"],
        ),
        (
            vec![a, b, "-o", "out", "--classes", "folder"],
            vec!["disk-1.npy"],
        ),
    ] {
        let run = place.run(&[vec!["distances"], arguments.clone()].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
        assert!(!report.contains("panicked"), "{report}");
        assert_eq!(place.listing(), before, "{arguments:?}");
    }
}

/// Ctrl-C ends the run; what is finished is kept, and the same command goes on.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_keeps_finished_pairs() {
    let place = Place::new();
    let inputs = shapes(&place);
    // Far too fine to end by itself in the time of this test.
    let long: Vec<&str> = [
        "distances",
        inputs[0],
        inputs[2],
        "--grid",
        "1025",
        "-o",
        "out",
    ]
    .into();
    assert_eq!(interrupted(&place, &long, ""), Some(130));
    assert!(!place.path("out").exists());
    // It may have been pressed before the directory was begun.
    if place.path("out.partial").exists() {
        let names = files(&place.path("out.partial"));
        assert_eq!(names, [".lock", "pairs", "work.json"]);
        assert!(files(&place.path("out.partial/pairs")).is_empty());
        let report = place.run(&[&long[..4], &["33", "-o", "out"]].concat());
        assert_eq!(report.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&report.stderr).contains("grid 1025 there, 33 here"));
    }
    assert_eq!(interrupted(&place, &long, ""), Some(130));
}

#[test]
fn parts_are_merged_to_the_bits_of_the_whole() {
    let place = Place::new();
    let inputs = shapes(&place);
    let whole = measured(&place, &inputs, &[], "whole");
    for part in ["1/3", "2/3", "3/3"] {
        let output = format!("part_{}", &part[..1]);
        let found = measured(&place, &inputs, &["--shard", part], &output);
        // Two of the six pairs, both ways; nothing is said of the others.
        assert_eq!(found.json["paths"].as_array().unwrap().len(), 4);
        assert_eq!(
            (&found.json["status"], &found.json["shard"]),
            (&"part".into(), &part.into())
        );
        assert!(found.json.get("clustering").is_none());
        assert!(found.json["distances"].get("matrix").is_none());
    }
    let merge = ["--merge", "part_3", "part_1", "part_2"];
    let run = place.compute(&arguments(&inputs, &merge, "merged"));
    succeeded(&run);
    let progress = String::from_utf8(run.stderr).unwrap();
    assert!(progress.contains("12 of 12 paths are taken"), "{progress}");
    let merged = Results::read(&place.path("merged"));
    assert_eq!(timeless(&merged), timeless(&whole));
    assert_eq!(exact(&merged), exact(&whole));
    // What a part lacks, or holds damaged, is computed.
    let damaged = place.path("part_1/pairs/000_001.json");
    let text = std::fs::read_to_string(&damaged).unwrap();
    std::fs::write(&damaged, &text[..text.len() / 2]).unwrap();
    let merge = ["--merge", "part_1", "part_2"];
    let again = measured(&place, &inputs, &merge, "again");
    assert_eq!(timeless(&again), timeless(&whole));
    // A whole result is merged, too, for another evaluation.
    let options = ["--merge", "whole", "--linkage", "ward"];
    let other = measured(&place, &inputs, &options, "other");
    assert_eq!(other.json["paths"], whole.json["paths"]);
    // Other shapes, other parameters, and other directories are refused.
    std::fs::create_dir(place.path("empty")).unwrap();
    for (inputs, options, words) in [
        (
            &inputs[..3],
            vec!["--merge", "part_1"],
            "4 inputs there, 3 here",
        ),
        (
            &inputs[..],
            vec!["--mu", "2", "--merge", "part_1"],
            "mu 1.0 there, 2.0 here",
        ),
        (&inputs[..], vec!["--merge", "empty"], "it has no work.json"),
        (&inputs[..], vec!["--shard", "4/3"], "3/8"),
    ] {
        let run = place.run(&arguments(inputs, &options, "refused"));
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(words), "no '{words}' in: {report}");
    }
}
