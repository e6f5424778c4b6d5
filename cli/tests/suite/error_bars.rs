//! Error bars of paths.

use std::f64::consts::PI;

#[cfg(target_os = "linux")]
use crate::common::interrupted;
use crate::common::{Place, Results, draw, succeeded};

fn disks() -> Place {
    let place = Place::new();
    for (name, radius) in [("a.npy", ".2"), ("b.npy", ".3")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "65"]);
    }
    place
}

fn path(place: &Place, options: &str, output: &str) -> (Results, String) {
    let command = format!("geodesic a.npy b.npy --error-bars {options} -o {output}");
    let words: Vec<&str> = command.split(' ').collect();
    let text = succeeded(&place.compute(&words));
    (Results::read(&place.path(output)), text)
}

/// The length of a path between concentric disks has a closed form, within its error bars; each of them is
/// that of the values it states.
#[test]
fn the_length_of_a_path_is_within_its_error_bars() {
    let place = disks();
    let (found, text) = path(&place, "--grid 65 -K 8", "eight");
    assert_eq!(found.numbers("/error_bars/steps/of"), [8.0, 4.0, 2.0]);
    assert_eq!(found.numbers("/error_bars/grids/of"), [65.0, 33.0, 17.0]);
    let length = found.number("/length");
    let mut error = 0.0;
    for of in ["steps", "grids"] {
        let bar = |key: &str| format!("/error_bars/{of}/length/{key}");
        assert_eq!(found.number(&bar("value")), length);
        let values = found.numbers(&bar("values"));
        assert_eq!(values.len(), 3);
        // Coarser paths are others, and the differences become smaller.
        let [fine, middle, coarse] = *values else {
            panic!()
        };
        assert!(fine != middle && (fine - middle).abs() < (middle - coarse).abs());
        error += found.number(&bar("error"));
    }
    let exact = 0.1 * (4.0 * PI).sqrt();
    // The mismatch keeps its share at all grids and steps: it is no part of the error bars.
    assert!(
        (length - exact).abs() < 2.0 * error,
        "{length} {exact} {error}"
    );
    assert!(error < 0.05 * exact, "{error}");
    for words in ["from 8, 4, 2 steps", "from 65, 33, 17 nodes a side"] {
        assert!(text.contains(words), "no '{words}' in {text}");
    }
}

#[test]
fn what_has_no_coarser_path_has_no_error_bar() {
    let place = disks();
    let (found, _) = path(&place, "--grid 17 -K 3", "three");
    assert!(found.json.pointer("/error_bars/steps").is_none());
    assert!(found.json.pointer("/error_bars/grids").is_none());
    for options in ["--form level-sets", "--occluded start"] {
        let command = format!("geodesic a.npy b.npy --error-bars {options} -o out");
        let words: Vec<&str> = command.split(' ').collect();
        let run = place.run(&words);
        let text = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{text}");
        assert!(text.contains("--error-bars"), "{text}");
    }
}

/// Grids on which a shape lies between the nodes are left out.
#[test]
fn shapes_that_are_lost_on_coarse_grids_have_error_bars_of_the_others() {
    let place = Place::new();
    for (name, radius) in [("a.npy", ".022"), ("b.npy", ".028")] {
        let disk = ["disk", "--radius", radius, "--shift=.031,.031"];
        draw(&place, name, &[&disk[..], &["--grid", "65"]].concat());
    }
    let (found, _) = path(&place, "--grid 65 -K 2 --align none", "path");
    assert_eq!(found.numbers("/error_bars/grids/of"), [65.0, 33.0]);
    let command = "average a.npy b.npy --grid 65 --align none --error-bars -o average";
    let words: Vec<&str> = command.split(' ').collect();
    succeeded(&place.compute(&words));
    let found = Results::read(&place.path("average"));
    assert_eq!(found.numbers("/error_bars/nodes"), [65.0, 33.0]);
}

/// A run that is interrupted on a coarser grid has its result, and says that it was; the same command goes on.
#[cfg(target_os = "linux")]
#[test]
fn interrupted_error_bars_say_so() {
    let place = disks();
    for command in ["geodesic a.npy b.npy -K 2", "average a.npy b.npy"] {
        let command = format!(
            "{command} --grid 257 --align none --max-iterations 10 --error-bars --allow-doubtful -o out"
        );
        let words: Vec<&str> = command.split(' ').collect();
        let code = interrupted(&place, &words, "error bars,");
        assert_eq!(code, Some(130), "{command}");
        let found = Results::read(&place.path("out"));
        assert_eq!(found.json["status"], "cancelled", "{command}");
        succeeded(&place.run(&words));
        let found = Results::read(&place.path("out"));
        assert_ne!(found.json["status"], "cancelled", "{command}");
        assert!(found.json.get("error_bars").is_some(), "{command}");
        for output in ["out", "out.interrupted"] {
            std::fs::remove_dir_all(place.path(output)).unwrap();
        }
    }
}
