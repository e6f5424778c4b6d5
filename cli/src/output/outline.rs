//! Closed outlines of flat shapes as CSV, SVG and GeoJSON.
//!
//! The object lies to the left of the curves where x points to the right and y upwards: boundaries of
//! parts have a positive area, those of holes a negative one.

use std::fmt::Write;
use std::path::Path;

use levelset::bounds;
use levelset::polygon::{area, encloses};
use serde_json::{Value, json};
use shapespace_input::Fill;

use super::{OutputError, write_text};

/// Digits of coordinates, relative to the extent of the outline.
const DIGITS: i32 = 6;

/// A closed curve; the first point is not repeated.
type Curve = [[f64; 2]];

/// Writes closed curves to files of this name with the extensions `csv` (numbers of curves, and x and y
/// of their points), `svg` (one path) and `geojson` (a polygon for each part, with its holes).
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_outline(path: &Path, curves: &[&Curve]) -> Result<(), OutputError> {
    let decimals = decimals(around(curves));
    write_text(&path.with_extension("csv"), &table(curves, decimals))?;
    let drawn = [(curves.to_vec(), Fill::EvenOdd)];
    write_drawing(&path.with_extension("svg"), &drawn)?;
    let text = polygons(curves, decimals).to_string();
    write_text(&path.with_extension("geojson"), &text)
}

/// Writes closed curves as the paths of a drawing (SVG), each filled by its own rule.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_drawing(path: &Path, drawn: &[(Vec<&Curve>, Fill)]) -> Result<(), OutputError> {
    let around = around(drawn.iter().flat_map(|(curves, _)| curves));
    write_text(path, &drawing(drawn, around, decimals(around)))
}

/// The box around curves; that of the origin where there are no points.
fn around<'a>(curves: impl IntoIterator<Item = &'a &'a Curve>) -> [[f64; 2]; 2] {
    let around = bounds(curves.into_iter().copied().flatten().copied());
    if around[0][0] > around[1][0] {
        return [[0.0; 2]; 2];
    }
    around
}

/// The longest side of a box.
fn extent([low, high]: [[f64; 2]; 2]) -> f64 {
    (0..2).map(|k| high[k] - low[k]).fold(0.0, f64::max)
}

/// The digits behind the point of coordinates in a box.
fn decimals(around: [[f64; 2]; 2]) -> usize {
    // None of an outline without points.
    let magnitude = extent(around).log10().floor().clamp(-12.0, 12.0) as i32;
    (DIGITS - magnitude).max(0) as usize
}

fn table(curves: &[&Curve], decimals: usize) -> String {
    let mut text = String::from("piece,x,y\n");
    for (piece, curve) in curves.iter().enumerate() {
        for [x, y] in *curve {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{piece},{x:.decimals$},{y:.decimals$}");
        }
    }
    text
}

fn drawing(drawn: &[(Vec<&Curve>, Fill)], around: [[f64; 2]; 2], decimals: usize) -> String {
    let (edge, [low, high]) = (0.05 * extent(around), around);
    let (x, y) = (low[0] - edge, low[1] - edge);
    let (width, height) = (high[0] - x + edge, high[1] - y + edge);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x:.decimals$} {y:.decimals$} \
         {width:.decimals$} {height:.decimals$}\">\n"
    );
    for (curves, fill) in drawn {
        let path = levelset::svg_path(curves.iter().map(|curve| (*curve, true)), decimals);
        let rule = match fill {
            Fill::EvenOdd => "evenodd",
            Fill::NonZero => "nonzero",
        };
        // Writing to a string does not fail.
        let _ = writeln!(text, "<path fill-rule=\"{rule}\" d=\"{path}\"/>");
    }
    text + "</svg>\n"
}

/// Each part with the holes in it: a hole belongs to the smallest part around it.
fn polygons(curves: &[&Curve], decimals: usize) -> Value {
    let areas: Vec<f64> = curves.iter().map(|curve| area(curve)).collect();
    let parts = || (0..curves.len()).filter(|&i| areas[i] > 0.0);
    let owner = |hole: usize| {
        let around = parts().filter(|&part| encloses(curves[part], curves[hole][0]));
        around.min_by(|&a, &b| areas[a].total_cmp(&areas[b]))
    };
    let holes: Vec<(usize, Option<usize>)> = (0..curves.len())
        .filter(|&i| areas[i] < 0.0)
        .map(|hole| (hole, owner(hole)))
        .collect();
    let ring = |i: usize| -> Value {
        let points = curves[i].iter().chain(curves[i].first());
        points
            .map(|p| json!(p.map(|x| rounded(x, decimals))))
            .collect()
    };
    let features: Vec<Value> = parts()
        .enumerate()
        .map(|(piece, part)| {
            let own = holes.iter().filter(|(_, owner)| *owner == Some(part));
            let rings: Vec<Value> = std::iter::once(part)
                .chain(own.map(|(hole, _)| *hole))
                .map(ring)
                .collect();
            json!({
                "type": "Feature",
                "properties": {"piece": piece},
                "geometry": {"type": "Polygon", "coordinates": rings},
            })
        })
        .collect();
    json!({"type": "FeatureCollection", "features": features})
}

fn rounded(x: f64, decimals: usize) -> f64 {
    let scale = 10f64.powi(decimals as i32);
    (x * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64, hole: bool) -> Vec<[f64; 2]> {
        let mut curve = vec![[low, low], [high, low], [high, high], [low, high]];
        if hole {
            curve.reverse();
        }
        curve
    }

    #[test]
    fn holes_belong_to_the_smallest_part_around_them() {
        let curves = [
            square(4.0, 6.0, true),
            square(0.0, 10.0, false),
            square(1.0, 9.0, true),
            square(2.0, 8.0, false),
        ];
        let curves: Vec<&Curve> = curves.iter().map(Vec::as_slice).collect();
        let polygons = polygons(&curves, 3);
        let rings = |part: usize| {
            let feature = &polygons["features"][part]["geometry"]["coordinates"];
            let rings = feature.as_array().unwrap();
            let starts: Vec<f64> = rings.iter().map(|r| r[0][0].as_f64().unwrap()).collect();
            assert!(
                rings
                    .iter()
                    .all(|r| r[0] == r[4] && r.as_array().unwrap().len() == 5)
            );
            starts
        };
        assert_eq!(polygons["features"].as_array().unwrap().len(), 2);
        assert_eq!((rings(0), rings(1)), (vec![0.0, 1.0], vec![2.0, 4.0]));
    }

    #[test]
    fn coordinates_have_digits_for_their_extent() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a");
        let small = square(0.0, 1.0 / 3.0, false);
        write_outline(&path, &[&small]).unwrap();
        let text = std::fs::read_to_string(path.with_extension("csv")).unwrap();
        assert!(text.contains("\n0,0.3333333,0.0000000\n"), "{text}");
        write_outline(&path, &[]).unwrap();
    }
}
