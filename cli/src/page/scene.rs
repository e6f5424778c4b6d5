//! Surfaces that turn with the mouse: single ones, series in time, and modes with their scores.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use shapespace_input::read_mesh;
use shapespace_report::html::{Markup, data_block, element};

use super::mesh::{Cube, FINEST, Mesh, vectors_as_letters};
use super::modes::{Mode, modes};
use super::overview::section;
use super::source::Source;

/// Lattices on which points are joined, until there is room for all surfaces.
const LATTICES: [u32; 7] = [FINEST, 256, 192, 128, 96, 64, 48];
/// The share of the room that one scene takes at most.
const SHARE: f64 = 0.6;

/// Surfaces that are shown at one place, one after the other, or one with its modes.
pub(super) struct Scene {
    pub title: String,
    /// The surfaces with their names.
    pub frames: Vec<(String, Mesh)>,
    pub modes: Vec<Mode>,
    /// The largest score.
    pub amplitude: f64,
}

/// All scenes of a directory.
pub(super) fn scenes(source: &Source<'_>) -> Markup {
    let all = modes(source).into_iter().chain(series(source));
    let shown = all
        .enumerate()
        .filter_map(|(i, scene)| draw(source, i, &scene));
    section("In 3D", shown.collect())
}

/// The surfaces in files, those with numbers as series.
fn series(source: &Source<'_>) -> Vec<Scene> {
    let mut stems: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for name in source.ending(".stl") {
        let whole = name.trim_end_matches(".stl");
        let stem = whole.trim_end_matches(|letter: char| letter.is_ascii_digit());
        let stem = if stem.ends_with('_') {
            stem.trim_end_matches('_')
        } else {
            whole
        };
        stems.entry(stem).or_default().push(name);
    }
    let scene = |(stem, names): (&str, Vec<&str>)| {
        let frames = names.into_iter().filter_map(|name| {
            let mesh = read_mesh(&source.path(name)).ok()?;
            let (points, triangles) = (mesh.points, mesh.triangles);
            Some((name.to_owned(), Mesh { points, triangles }))
        });
        Scene {
            title: stem.to_owned(),
            frames: frames.collect(),
            modes: Vec::new(),
            amplitude: 0.0,
        }
    };
    stems.into_iter().map(scene).collect()
}

/// A scene and its data; nothing where it is empty.
fn draw(source: &Source<'_>, number: usize, scene: &Scene) -> Option<Markup> {
    let cube = Cube::around(scene.frames.iter().map(|(_, mesh)| mesh))?;
    let room = (SHARE * source.room() as f64) as usize;
    let joined = LATTICES.iter().map(|cells| {
        let frames = scene
            .frames
            .iter()
            .map(|(_, mesh)| mesh.joined(&cube, *cells));
        frames.collect::<Vec<Mesh>>()
    });
    let letters = |meshes: &Vec<Mesh>| -> usize {
        let offsets = 6 * scene.modes.len();
        let bytes = meshes
            .iter()
            .map(|mesh| mesh.bytes() + offsets * mesh.points.len());
        bytes.sum::<usize>() / 3 * 4
    };
    let meshes = joined.into_iter().find(|meshes| letters(meshes) <= room)?;
    let id = format!("scene-{number}");
    let text = data(scene, &cube, &meshes).to_string();
    if !source.take(text.len()) {
        return None;
    }
    let name = format!("{}, in 3D", scene.title);
    let canvas = [
        ("tabindex", "0"),
        ("role", "img"),
        ("aria-label", name.as_str()),
    ];
    let note = "Drag to turn, double-click to turn back; after a click, wheel or + and - for the size, \
                arrows to turn.";
    let inner: Markup = [
        element("canvas", &canvas, ""),
        element("div", &[("class", "controls")], ""),
        element("figcaption", &[], format!("{}. {note}", scene.title)),
        data_block(&id, &text),
    ]
    .into_iter()
    .collect();
    Some(element(
        "figure",
        &[("class", "viewer"), ("data-of", &id)],
        inner,
    ))
}

/// What the script reads.
fn data(scene: &Scene, cube: &Cube, meshes: &[Mesh]) -> Value {
    let frame = |((name, _), mesh): (&(String, Mesh), &Mesh)| {
        json!({
            "name": name,
            "wide": mesh.is_wide(),
            "points": mesh.points_as_letters(cube),
            "corners": mesh.corners_as_letters(),
        })
    };
    let mode = |mode: &Mode| {
        let offsets = meshes.first().map(|mesh| mode.offsets(&mesh.points));
        let (letters, unit) = vectors_as_letters(&offsets.unwrap_or_default());
        // In the units of the coordinates.
        let unit = unit / cube.side * f64::from(FINEST);
        json!({ "name": mode.name, "offsets": letters, "unit": unit })
    };
    json!({
        "frames": scene.frames.iter().zip(meshes).map(frame).collect::<Vec<_>>(),
        "modes": scene.modes.iter().map(mode).collect::<Vec<_>>(),
        "amplitude": scene.amplitude,
    })
}
