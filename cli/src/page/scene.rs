//! Surfaces that turn with the mouse: single ones, also with colours or with inputs laid over them, series in
//! time, and modes with their scores.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use shapespace_input::read_mesh;
use shapespace_picture::{Colour, ColourBar, Surface, View};
use shapespace_report::html::{Markup, data_block, element};

use super::boundary::shaded;
use super::mesh::{Cube, FINEST, Mesh, shares_as_letters, vectors_as_letters};
use super::modes::{Mode, modes};
use super::overlay::{Overlay, overlays};
use super::overview::section;
use super::source::Source;
use super::values::{at, text};
use crate::output::names::MODE;

/// Lattices on which points are joined, until there is room for all surfaces.
const LATTICES: [u32; 7] = [FINEST, 256, 192, 128, 96, 64, 48];
/// The share of the room that one scene takes at most.
const SHARE: f64 = 0.6;
/// The height from which scenes are first seen, in degrees.
const ELEVATION: f64 = 25.0;
/// Colours of a bar.
const COLOURS: u8 = 63;

/// Surfaces that are shown at one place, one after the other, or one with its modes, its colours, or with
/// inputs laid over it.
#[derive(Default)]
pub(super) struct Scene {
    pub title: String,
    /// The surfaces with their names.
    pub frames: Vec<(String, Mesh)>,
    pub modes: Vec<Mode>,
    /// The largest score.
    pub amplitude: f64,
    /// What the numbers at the points of the first surface are, as shares of these bars.
    pub bars: Vec<ColourBar>,
    pub overlays: Vec<Overlay>,
}

/// All scenes of a directory.
pub(super) fn scenes(source: &Source<'_>) -> Markup {
    let own: Vec<Scene> = modes(source).into_iter().chain(shaded(source)).collect();
    // Surfaces of the mean and the modes are those that are shown with sliders.
    let of_modes = own.iter().any(|scene| !scene.modes.is_empty());
    let others = if of_modes { Vec::new() } else { series(source) };
    let all: Vec<Scene> = own.into_iter().chain(others).collect();
    // All are first seen from one side, so that they can be compared.
    let first = all.iter().find_map(|scene| scene.frames.first());
    let azimuth = first.map_or(View::front(0.0).azimuth, |(_, mesh)| azimuth(mesh));
    let shown = all.iter().enumerate();
    let shown = shown.filter_map(|(i, scene)| draw(source, i, scene, azimuth));
    section("In 3D", shown.collect())
}

/// The surfaces in files, those with numbers as series.
fn series(source: &Source<'_>) -> Vec<Scene> {
    let mut stems: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let names = source.ending(".stl");
    for name in names.filter(|name| !name.starts_with(MODE)) {
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
            let mesh = Mesh {
                points,
                triangles,
                values: Vec::new(),
            };
            Some((name_of(source, stem, name), mesh))
        });
        let frames: Vec<(String, Mesh)> = frames.collect();
        Scene {
            title: stem.to_owned(),
            overlays: overlays(source, stem),
            frames,
            ..Scene::default()
        }
    };
    stems.into_iter().map(scene).collect()
}

/// What a surface in a file is called: the mean of a group by that, all others by their files.
fn name_of(source: &Source<'_>, stem: &str, file: &str) -> String {
    let number = file
        .strip_prefix("mean_")
        .and_then(|n| n.strip_suffix(".stl"));
    let number = number.filter(|_| stem == "mean" && text(&source.record, "/command") == "compare");
    let group = number.and_then(|number| number.parse::<usize>().ok());
    let names = at(&source.record, "/groups/*/name");
    let name = group.and_then(|group| names.get(group).copied().flatten()?.as_str());
    name.map_or_else(|| file.to_owned(), |name| format!("mean of {name}"))
}

/// A scene and its data; nothing where it is empty.
fn draw(source: &Source<'_>, number: usize, scene: &Scene, azimuth: f64) -> Option<Markup> {
    let frames = || scene.frames.iter().map(|(_, mesh)| mesh);
    let over = || scene.overlays.iter().map(|overlay| &overlay.mesh);
    let cube = Cube::around(frames().chain(over()))?;
    let room = (SHARE * source.room() as f64) as usize;
    let joined = LATTICES.iter().map(|cells| {
        let meshes = frames().chain(over());
        meshes
            .map(|mesh| mesh.joined(&cube, *cells))
            .collect::<Vec<Mesh>>()
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
    let json = data(scene, &cube, &meshes, azimuth).to_string();
    if !source.take(json.len()) {
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
    let what = if scene.overlays.is_empty() {
        ""
    } else {
        "In orange an input at its place, carried onto it by its deformation as far as the slider says. "
    };
    let inner: Markup = [
        element("canvas", &canvas, ""),
        element("div", &[("class", "controls")], ""),
        element("figcaption", &[], format!("{}. {what}{note}", scene.title)),
        data_block(&id, &json),
    ]
    .into_iter()
    .collect();
    Some(element(
        "figure",
        &[("class", "viewer"), ("data-of", &id)],
        inner,
    ))
}

/// What the script reads; the meshes are those of the frames, then those of the overlays.
fn data(scene: &Scene, cube: &Cube, meshes: &[Mesh], azimuth: f64) -> Value {
    // In the units of the coordinates.
    let unit = |unit: f64| unit / cube.side * f64::from(FINEST);
    let (frames, overlays) = meshes.split_at(scene.frames.len().min(meshes.len()));
    let frame = |((name, _), mesh): (&(String, Mesh), &Mesh)| surface(name, mesh, cube);
    let mode = |mode: &Mode| {
        let offsets = frames.first().map(|mesh| mode.offsets(&mesh.points));
        let (letters, length) = vectors_as_letters(&offsets.unwrap_or_default());
        json!({ "name": mode.name, "offsets": letters, "unit": unit(length) })
    };
    let overlay = |(overlay, mesh): (&Overlay, &Mesh)| {
        let (letters, length) = vectors_as_letters(&Overlay::offsets(mesh));
        let mut data = surface(&overlay.name, mesh, cube);
        data["offsets"] = letters.into();
        data["unit"] = unit(length).into();
        data
    };
    let values = frames.first().map_or(&[][..], |mesh| &mesh.values);
    let bar = |(bar, shares): (&ColourBar, &Vec<f64>)| {
        let share = |k: u8| f64::from(k) / f64::from(COLOURS - 1);
        let shares_of_colours = std::iter::once(-1.0).chain((0..COLOURS).map(share));
        json!({
            "name": bar.title,
            "colours": shares_of_colours.map(|s| hex((bar.colour)(s))).collect::<Vec<_>>(),
            "marks": bar.marks,
            "shares": shares_as_letters(shares, COLOURS),
        })
    };
    json!({
        "frames": scene.frames.iter().zip(frames).map(frame).collect::<Vec<_>>(),
        "modes": scene.modes.iter().map(mode).collect::<Vec<_>>(),
        "amplitude": scene.amplitude,
        "elevation": ELEVATION,
        "azimuth": azimuth,
        "bars": scene.bars.iter().zip(values).map(bar).collect::<Vec<_>>(),
        "overlays": scene.overlays.iter().zip(overlays).map(overlay).collect::<Vec<_>>(),
    })
}

/// Where the first look comes from: the broad side of a surface.
fn azimuth(mesh: &Mesh) -> f64 {
    let triangles: Vec<[usize; 3]> = mesh
        .triangles
        .iter()
        .map(|corners| corners.map(|corner| corner as usize))
        .collect();
    let surface = Surface {
        vertices: &mesh.points,
        triangles: &triangles,
    };
    View::broadside(surface, ELEVATION).azimuth
}

fn surface(name: &str, mesh: &Mesh, cube: &Cube) -> Value {
    json!({
        "name": name,
        "wide": mesh.is_wide(),
        "points": mesh.points_as_letters(cube),
        "corners": mesh.corners_as_letters(),
    })
}

/// A colour as `#rrggbb`.
pub(super) fn hex(colour: Colour) -> String {
    let [r, g, b] = colour.map(byte);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A share of a colour in bytes.
pub(super) fn byte(share: f32) -> u8 {
    (255.0 * share.clamp(0.0, 1.0)).round() as u8
}
