//! `distances` from new shapes to stored ones.

use crate::common::{Place, Results, picture_size, succeeded};
use crate::distances::{arguments, exact, files, measured, shapes, timeless};

/// A disk and an ellipse, and another two of these.
const NEW: [&str; 2] = ["disk-1.npy", "oval-1.npy"];
const STORED: [&str; 2] = ["disk-2.npy", "oval-2.npy"];

fn against<'a>(options: &[&'a str]) -> Vec<&'a str> {
    [&["--against"], &STORED[..], options].concat()
}

#[test]
fn distances_to_stored_shapes_are_those_between_all() {
    let place = Place::new();
    shapes(&place);
    let options = against(&["--classes", "prefix"]);
    let across = measured(&place, &NEW, &options, "across");
    assert_eq!(across.json["status"], "complete");
    assert_eq!(across.json["new_shapes"], 2);
    assert_eq!(
        files(&across.path(".")),
        [
            "config.toml",
            "distances.csv",
            "distances.npy",
            "elastic.csv",
            "matrix.png",
            "neighbours.csv",
            "neighbours.png",
            "pairs",
            "paths.csv",
            "report.html",
            "result.json",
            "work.json",
        ]
    );
    // Both ways of four pairs, with the bits of a run on all shapes.
    assert_eq!(across.json["paths"].as_array().unwrap().len(), 8);
    let all = [NEW, STORED].concat();
    let whole = measured(&place, &all, &[], "whole");
    let (size, found) = across.array("distances.npy");
    assert_eq!(size, [2, 2]);
    let (_, every) = whole.array("distances.npy");
    assert_eq!(found, [every[2], every[3], every[6], every[7]]);
    let table = std::fs::read_to_string(across.path("distances.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some(",disk-2,oval-2"));
    assert!(lines.next().unwrap().starts_with("disk-1,"));
    check_neighbours(&across, &found);
    for name in ["matrix.png", "neighbours.png"] {
        let [width, height] = picture_size(&across.path(name));
        assert!(width > 300 && height > 200, "{name}: {width} x {height}");
    }
    let page = std::fs::read_to_string(across.path("report.html")).unwrap();
    assert!(page.contains(r#""rows":[0,1]"#) && page.contains(r#""columns":[2,3]"#));
    // Each of both results has paths of the other.
    let merged = against(&["--classes", "prefix", "--merge", "whole"]);
    let run = place.compute(&arguments(&NEW, &merged, "merged"));
    succeeded(&run);
    let progress = String::from_utf8(run.stderr).unwrap();
    assert!(progress.contains("8 of 8 paths are taken"), "{progress}");
    let merged = Results::read(&place.path("merged"));
    assert_eq!(timeless(&merged), timeless(&across));
    let run = place.compute(&arguments(&all, &["--merge", "across"], "more"));
    let progress = String::from_utf8(run.stderr).unwrap();
    assert!(progress.contains("8 of 12 paths are taken"), "{progress}");
    assert_eq!(exact(&Results::read(&place.path("more"))), exact(&whole));
}

/// The neighbours are those of the matrix, with their classes.
fn check_neighbours(results: &Results, matrix: &[f64]) {
    for (k, class) in ["disk", "oval"].into_iter().enumerate() {
        let of = &results.json["neighbours"]["of"][k];
        assert_eq!((&of["shape"], &of["class"]), (&k.into(), &class.into()));
        // One of each: the nearest one decides.
        assert_eq!(of["vote"], class);
        let place = format!("/neighbours/of/{k}/nearest");
        assert_eq!(results.number(&format!("{place}/0/object")), (2 + k) as f64);
        assert_eq!(
            results.number(&format!("{place}/0/distance")),
            matrix[3 * k]
        );
        assert_eq!(
            results.number(&format!("{place}/1/distance")),
            matrix[1 + k]
        );
    }
    // The names of new shapes tell their classes here.
    assert_eq!(results.number("/neighbours/agreement/shapes"), 2.0);
    assert_eq!(results.number("/neighbours/agreement/vote"), 1.0);
    let table = std::fs::read_to_string(results.path("neighbours.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(
        (lines.len(), lines[0]),
        (5, "name,rank,neighbour,distance,class")
    );
    assert!(lines[1].starts_with("disk-1,1,disk-2,") && lines[1].ends_with(",disk"));
    assert!(lines[4].starts_with("oval-1,2,disk-2,"), "{}", lines[4]);
}

#[test]
fn parts_of_distances_to_stored_shapes_are_merged() {
    let place = Place::new();
    shapes(&place);
    // A folder of stored shapes, of unknown class.
    std::fs::create_dir(place.path("stored")).unwrap();
    for name in STORED {
        std::fs::copy(place.path(name), place.path("stored").join(name)).unwrap();
    }
    let folder = ["--against", "stored", "--neighbours", "1"];
    let whole = measured(&place, &NEW, &folder, "whole");
    assert!(whole.json["neighbours"].get("agreement").is_none());
    let nearest = |k: usize| {
        whole.json["neighbours"]["of"][k]["nearest"]
            .as_array()
            .unwrap()
            .len()
    };
    assert_eq!((nearest(0), nearest(1)), (1, 1));
    for (part, output) in [("1/2", "part_1"), ("2/2", "part_2")] {
        let options = [&folder[..], &["--shard", part]].concat();
        let found = measured(&place, &NEW, &options, output);
        assert_eq!(found.json["status"], "part");
        assert_eq!(found.json["paths"].as_array().unwrap().len(), 4);
        assert!(found.json.get("neighbours").is_none());
    }
    let options = [&folder[..], &["--merge", "part_2", "part_1"]].concat();
    let merged = measured(&place, &NEW, &options, "merged");
    assert_eq!(timeless(&merged), timeless(&whole));
    assert_eq!(exact(&merged), exact(&whole));
    // The configuration names the stored shapes.
    succeeded(&place.compute(&["distances", "--config", "whole/config.toml", "-o", "again"]));
    assert_eq!(exact(&Results::read(&place.path("again"))), exact(&whole));
}

#[test]
fn what_new_shapes_cannot_have_is_refused() {
    let place = Place::new();
    shapes(&place);
    std::fs::create_dir(place.path("empty")).unwrap();
    let before = place.listing();
    for (arguments, words) in [
        (against(&["--clusters", "2"]), ["--clusters", "stored"]),
        (
            against(&["--neighbours", "0"]),
            ["--neighbours", "at least 1"],
        ),
        (against(&["--classes", "folder"]), ["disk-2.npy", "class"]),
        (vec!["--against", "empty"], ["empty", "no"]),
        (vec!["--against", "none.npy"], ["none.npy", "no"]),
    ] {
        let run = place.run(&[&["distances", NEW[0], "-o", "out"], &arguments[..]].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
        assert_eq!(place.listing(), before, "{arguments:?}");
    }
}
