//! `distances` without all paths: neighbours by calibrated bounds, and maps by landmarks.

use crate::common::{Place, Results, draw, picture_size, succeeded};
use crate::distances::{exact, files, timeless};

/// Disks and ellipses, five of each: far from each other, and near among themselves.
fn shapes(place: &Place) -> Vec<String> {
    let mut names = Vec::new();
    for k in 0..5 {
        let radius = format!("{}", 0.16 + 0.012 * f64::from(k));
        let name = format!("disk-{k}.npy");
        draw(place, &name, &["disk", "--radius", &radius, "--grid", "33"]);
        names.push(name);
        let radii = format!("{},.1", 0.28 + 0.016 * f64::from(k));
        let name = format!("oval-{k}.npy");
        draw(
            place,
            &name,
            &["ellipse", "--radii", &radii, "--grid", "33"],
        );
        names.push(name);
    }
    names
}

fn run(place: &Place, inputs: &[String], options: &[&str], output: &str) -> Results {
    let mut all = vec!["distances"];
    all.extend(inputs.iter().map(String::as_str));
    // Aligning takes longer than such paths.
    all.extend(["--grid", "17", "-K", "1", "--align", "none", "-o", output]);
    all.extend(options);
    succeeded(&place.compute(&all));
    Results::read(&place.path(output))
}

/// The numbers of the neighbours of all shapes.
fn neighbours(results: &Results) -> Vec<Vec<u64>> {
    let of = results.json["neighbours"]["of"].as_array().unwrap();
    let nearest = of.iter().map(|of| of["nearest"].as_array().unwrap());
    let objects = |all: &Vec<serde_json::Value>| -> Vec<u64> {
        all.iter().map(|n| n["object"].as_u64().unwrap()).collect()
    };
    nearest.map(objects).collect()
}

#[test]
fn far_pairs_are_skipped_and_neighbours_are_kept() {
    let place = Place::new();
    let inputs = shapes(&place);
    let two = ["--neighbours", "2", "--classes", "prefix"];
    let whole = run(&place, &inputs, &two, "whole");
    let options = [&two[..], &["--skip-far", ".05"]].concat();
    let sparse = run(&place, &inputs, &options, "sparse");
    assert_eq!(sparse.json["status"], "complete");
    assert_eq!(neighbours(&sparse), neighbours(&whole));
    assert_eq!(sparse.number("/neighbours/agreement/nearest"), 1.0);
    assert_eq!(sparse.number("/skipped/pairs"), 45.0);
    let computed = sparse.number("/skipped/computed");
    // Those of four landmarks are computed in any case.
    assert!((30.0..45.0).contains(&computed), "{computed}");
    assert_eq!(
        sparse.json["paths"].as_array().unwrap().len() as f64,
        2.0 * computed
    );
    assert_eq!(sparse.number("/skipped/calibrated_on"), 30.0);
    assert_eq!(sparse.number("/skipped/kept/1"), 8.0);
    assert_eq!(sparse.number("/skipped/nearest_kept/1"), 4.0);
    // What is computed has the bits of all pairs, and the rest is not there.
    let ((size, found), (_, all)) = (sparse.array("distances.npy"), whole.array("distances.npy"));
    assert_eq!(size, [10, 10]);
    let missing = found.iter().filter(|d| d.is_nan()).count();
    assert_eq!(missing as f64, 2.0 * (45.0 - computed));
    let known = found.iter().zip(&all).filter(|(d, _)| !d.is_nan());
    assert!(known.clone().all(|(d, e)| d == e) && known.count() > 60);
    // No clusters, but a map.
    assert!(sparse.json.get("clustering").is_none());
    assert_eq!(
        sparse.json["embedding"]["points"].as_array().unwrap().len(),
        10
    );
    assert_eq!(
        sparse.json["embedding"]["landmarks"],
        sparse.json["skipped"]["sample"]
    );
    assert!(files(&sparse.path(".")).contains(&"surrogates".to_owned()));
    for name in ["matrix.png", "neighbours.png", "embedding.png"] {
        let [width, height] = picture_size(&sparse.path(name));
        assert!(width > 300 && height > 200, "{name}: {width} x {height}");
    }
    check_surrogates(&sparse);
    check_repetitions(&place, &inputs, &options, &sparse);
    // A share of less than one pair skips nothing, whatever the surrogates are.
    let least = [&two[..], &["--skip-far", ".001", "--merge", "whole"]].concat();
    let every = run(&place, &inputs, &least, "every");
    assert_eq!(every.number("/skipped/factor"), 0.0);
    assert_eq!(every.number("/skipped/computed"), 45.0);
    assert!(every.number("/skipped/rounds") > 1.0);
    assert_eq!(every.json["neighbours"], whole.json["neighbours"]);
    assert_eq!(every.array("distances.npy"), whole.array("distances.npy"));
}

/// On so few nodes surrogates have the grid of the paths: they are the elastic lengths from the earlier
/// shape to the later, in their scale, up to the tolerance.
fn check_surrogates(results: &Results) {
    let elastic = |start: usize, end: u64| {
        let paths = results.json["paths"].as_array().unwrap().iter();
        let mut own = paths.filter(|path| path["start"] == start && path["end"] == end);
        own.next()?["elastic"].as_f64()
    };
    let mut compared = 0;
    for row in 0..9 {
        let text = std::fs::read(results.path(&format!("surrogates/{row:03}.json"))).unwrap();
        let stored: serde_json::Value = serde_json::from_slice(&text).unwrap();
        for value in stored["values"].as_array().unwrap() {
            if let Some(length) = elastic(row, value[0].as_u64().unwrap()) {
                let found = value[1].as_f64().unwrap();
                assert!(
                    (found / length - 1.0).abs() < 0.05,
                    "{row} {value} {length}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared >= 30, "{compared}");
}

/// Other threads, other results, and an unfinished one give the same.
fn check_repetitions(place: &Place, inputs: &[String], options: &[&str], sparse: &Results) {
    let merging = [options, &["--merge", "whole", "--threads", "3"]].concat();
    let merged = run(place, inputs, &merging, "merged");
    let without_times = |results: &Results| {
        let mut json = timeless(results);
        json["parameters"]
            .as_object_mut()
            .unwrap()
            .remove("threads");
        json
    };
    assert_eq!(without_times(&merged), without_times(sparse));
    assert_eq!(exact(&merged), exact(sparse));
    let surrogates = |results: &Results| {
        let read = |k: usize| std::fs::read(results.path(&format!("surrogates/{k:03}.json")));
        (0..9).map(|k| read(k).unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(surrogates(&merged), surrogates(sparse));
    std::fs::create_dir_all(place.path("again.partial/pairs")).unwrap();
    let pairs = files(&sparse.path("pairs"));
    for name in pairs.iter().step_by(3) {
        let to = place.path("again.partial/pairs").join(name);
        std::fs::copy(sparse.path("pairs").join(name), to).unwrap();
    }
    let work = place.path("again.partial/work.json");
    std::fs::copy(sparse.path("work.json"), work).unwrap();
    let again = run(place, inputs, options, "again");
    assert_eq!(timeless(&again), timeless(sparse));
    assert_eq!(exact(&again), exact(sparse));
    assert_eq!(files(&again.path("pairs")), pairs);
    succeeded(&place.compute(&["distances", "--config", "sparse/config.toml", "-o", "file"]));
    let file = Results::read(&place.path("file"));
    assert_eq!(timeless(&file)["skipped"], timeless(sparse)["skipped"]);
}

#[test]
fn landmarks_make_a_map_of_all_shapes() {
    let place = Place::new();
    let inputs = shapes(&place);
    let few = &inputs[..6];
    let results = run(
        &place,
        few,
        &["--landmarks", "3", "--classes", "prefix"],
        "out",
    );
    assert_eq!(results.json["status"], "complete");
    assert_eq!(
        results.json["paths"].as_array().unwrap().len(),
        2 * (3 * 3 + 3)
    );
    assert_eq!(
        results.json["embedding"]["landmarks"]
            .as_array()
            .unwrap()
            .len(),
        3
    );
    let point = |k: usize| results.numbers(&format!("/embedding/points/{k}"));
    let apart = |a: usize, b: usize| {
        let (p, q) = (point(a), point(b));
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    // Disks and ellipses take turns.
    assert!(apart(0, 2) < 0.5 * apart(0, 1) && apart(1, 5) < 0.5 * apart(4, 5));
    let table = std::fs::read_to_string(results.path("embedding.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "name,class,cluster,x,y,landmark");
    assert_eq!(lines.iter().filter(|line| line.ends_with(",1")).count(), 3);
    let (_, matrix) = results.array("distances.npy");
    assert_eq!(matrix.iter().filter(|d| d.is_nan()).count(), 6);
    check_parts(&place, few, &results);
    // Stored shapes are landmarks where there are new ones.
    let stored: Vec<&str> = inputs[1..6].iter().map(String::as_str).collect();
    let options = [&["--landmarks", "3", "--against"], &stored[..]].concat();
    let across = run(&place, &inputs[..1], &options, "across");
    assert_eq!(
        across.json["embedding"]["points"].as_array().unwrap().len(),
        6
    );
    assert!(
        across
            .numbers("/embedding/landmarks")
            .iter()
            .all(|&l| l >= 1.0)
    );
    assert_eq!(across.array("distances.npy").0, [1, 5]);
    assert!(across.array("distances.npy").1.iter().all(|d| !d.is_nan()));
}

/// Parts of the paths of landmarks are merged as those of all pairs.
fn check_parts(place: &Place, inputs: &[String], whole: &Results) {
    let options = ["--landmarks", "3", "--classes", "prefix"];
    for (part, output) in [("1/2", "part_1"), ("2/2", "part_2")] {
        let options = [&options[..], &["--shard", part]].concat();
        let found = run(place, inputs, &options, output);
        assert_eq!(found.json["status"], "part");
        assert_eq!(found.json["paths"].as_array().unwrap().len(), 12);
        assert!(found.json.get("embedding").is_none());
    }
    let options = [&options[..], &["--merge", "part_1", "part_2"]].concat();
    let merged = run(place, inputs, &options, "merged");
    assert_eq!(timeless(&merged), timeless(whole));
    assert_eq!(exact(&merged), exact(whole));
}

#[test]
fn new_shapes_skip_far_stored_ones() {
    let place = Place::new();
    let inputs = shapes(&place);
    let (new, stored) = inputs.split_at(4);
    let stored: Vec<&str> = stored.iter().map(String::as_str).collect();
    let against = [&["--neighbours", "1", "--against"], &stored[..]].concat();
    let whole = run(&place, new, &against, "whole");
    let skipping = [&["--skip-far", ".15"], &against[..]].concat();
    let sparse = run(&place, new, &skipping, "sparse");
    assert_eq!(neighbours(&sparse), neighbours(&whole));
    assert_eq!(
        sparse.json["skipped"]["sample"].as_array().unwrap().len(),
        2
    );
    let computed = sparse.number("/skipped/computed");
    assert!((12.0..24.0).contains(&computed), "{computed}");
    assert_eq!(sparse.number("/skipped/calibrated_on"), 12.0);
    assert!(sparse.json.get("embedding").is_none());
}

#[test]
fn what_cannot_be_skipped_is_refused() {
    let place = Place::new();
    let inputs = shapes(&place);
    let before = place.listing();
    for (options, words) in [
        (vec!["--skip-far", "0"], ["--skip-far", "above 0"]),
        (vec!["--skip-far", "1"], ["--skip-far", "below 1"]),
        (
            vec!["--skip-far", ".1", "--shard", "1/2"],
            ["--shard", "--skip-far"],
        ),
        (
            vec!["--skip-far", ".1", "--clusters", "2"],
            ["--clusters", "--skip-far"],
        ),
        (
            vec!["--landmarks", "4", "--clusters", "2"],
            ["--clusters", "--landmarks"],
        ),
        (
            vec!["--landmarks", "4", "--neighbours", "2"],
            ["--neighbours", "add --skip-far"],
        ),
        (vec!["--landmarks", "2"], ["--landmarks", "needs 3"]),
        (vec!["--landmarks", "11"], ["--landmarks", "10 shapes"]),
    ] {
        let mut all = vec!["distances", "-o", "out"];
        all.extend(inputs.iter().map(String::as_str));
        all.extend(&options);
        let run = place.run(&all);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{options:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
        assert_eq!(place.listing(), before, "{options:?}");
    }
}
