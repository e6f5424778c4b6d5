//! Distances of many real shapes, and their clusters.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::Section;
use super::paths::Place;
use super::real::files;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Required fractions of correctly classified shapes for five classes.
const LEAST_ACCURACY: f64 = 0.9;

/// A set of shapes.
struct Set {
    name: &'static str,
    /// The files as they are typed, in the folder of the data.
    typed: &'static str,
    files: Vec<PathBuf>,
    options: &'static str,
}

/// The first files of a folder with an ending.
fn first(data: &Path, folder: &str, ending: &str, count: usize) -> Outcome<Vec<PathBuf>> {
    let all = files(&data.join(folder), ending)?;
    Ok(all.into_iter().take(count).collect())
}

/// Letters and bones.
pub fn section(data: &Path) -> Outcome<Section> {
    let mut faces: Vec<PathBuf> = std::fs::read_dir(data.join("glyphs"))?
        .map(|entry| Ok(entry?.path()))
        .collect::<std::io::Result<_>>()?;
    faces.sort();
    let mut letters = Vec::new();
    for letter in ["A", "C", "M", "U", "X"] {
        let of_faces = faces
            .iter()
            .map(|face| face.join(letter).with_extension("png"));
        letters.extend(of_faces.filter(|file| file.is_file()).take(3));
    }
    let mut bones = first(data, "calcaneus", ".ply", 3)?;
    bones.extend(first(data, "mandible", ".stl", 3)?);
    measured(&[
        Set {
            name: "5 letters of two faces, A of three",
            typed: "glyphs/FACE/{A,C,M,U,X}.png",
            files: letters,
            options: "--size equal --classes prefix --grid 65",
        },
        Set {
            name: "3 heel bones and 3 half-mandibles",
            typed: "{calcaneus/*.ply,mandible/*.stl}",
            files: bones,
            options: "--size equal --classes folder --grid 33 -K 2",
        },
    ])
}

/// Silhouettes of five classes, cells and hippocampi.
pub fn silhouettes(data: &Path) -> Outcome<Section> {
    let mut classes = Vec::new();
    for class in ["Bone", "bat", "device7", "fish", "horse"] {
        classes.extend(first(data, &format!("mpeg7/{class}"), ".png", 6)?);
    }
    measured(&[
        Set {
            name: "MPEG-7, 5 classes of 6",
            typed: "mpeg7/{Bone,bat,device7,fish,horse}/*-0[1-6].png",
            files: classes,
            options: "--size equal --classes folder --grid 65",
        },
        Set {
            name: "cells",
            typed: "cells/*.png",
            files: first(data, "cells", ".png", usize::MAX)?,
            options: "--grid 65",
        },
        Set {
            name: "6 hippocampi",
            typed: "hippocampus/labels/*.nii.gz",
            files: first(data, "hippocampus/labels", ".nii.gz", 6)?,
            options: "--grid 33",
        },
    ])
}

/// Distances, clusters and triangles of some sets.
fn measured(sets: &[Set]) -> Outcome<Section> {
    let place = Place::new()?;
    let mut table = Table::new([
        "shapes",
        "command",
        "usable paths",
        "asymmetry, mean",
        "triangles violated by L",
        "by the elastic distance",
        "nearest neighbours",
        "purity",
        "adjusted Rand",
        "seconds of paths",
    ]);
    for set in sets {
        let record = distances(&place, set)?;
        let number = |key: &str| record.pointer(key).and_then(Value::as_f64);
        let share = |key: &str| {
            number(key).map_or_else(
                || "–".into(),
                |value| checked(format!("{value:.2}"), value >= LEAST_ACCURACY),
            )
        };
        let plain = |key: &str| number(key).map_or_else(|| "–".into(), |v| format!("{v:.2}"));
        let triangles = |matrix: &str| {
            let of = |key: &str| number(&format!("/{matrix}/triangles/{key}")).unwrap_or(f64::NAN);
            let (violations, count) = (of("violations"), of("count"));
            format!("{violations} of {count}, {:.1} %", 100.0 * of("worst"))
        };
        let n = set.files.len();
        let marked = record["marked"].as_array().map_or(0, Vec::len);
        table.row([
            set.name.into(),
            format!("`shapespace distances data/{} {}`", set.typed, set.options),
            format!("{} of {}", n * (n - 1) - marked, n * (n - 1)),
            number("/distances/asymmetry/mean")
                .map_or_else(|| "–".into(), |value| format!("{:.1} %", 100.0 * value)),
            triangles("distances"),
            triangles("elastic"),
            share("/distances/agreement/nearest_neighbour_accuracy"),
            plain("/distances/agreement/purity"),
            plain("/distances/agreement/adjusted_rand_index"),
            plain("/path_seconds"),
        ]);
    }
    Ok(Section {
        title: "Distances of real shapes",
        text: "Symmetrised lengths of paths of four steps, where nothing else is said, between \
               shapes that are aligned first. Paths that do not reach their end are marked, and \
               their distances are replaced by those through other shapes. Clusters are those of \
               average linkage, as many as there are classes.",
        table,
        chart: None,
    })
}

fn distances(place: &Place, set: &Set) -> Outcome<Value> {
    eprintln!("{}", set.name);
    let output = "distances";
    let files: Vec<String> = set.files.iter().map(|f| f.display().to_string()).collect();
    let mut arguments = vec!["distances", "--allow-doubtful", "-o", output];
    arguments.extend(set.options.split_whitespace());
    arguments.extend(files.iter().map(String::as_str));
    place.run(&arguments)?;
    let folder = place.folder.join(output);
    let record = serde_json::from_str(&std::fs::read_to_string(folder.join("result.json"))?)?;
    std::fs::remove_dir_all(&folder)?;
    Ok(record)
}
