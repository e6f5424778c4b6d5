//! Distances to be read off: the map and the matrix, whose points and cells say what they are.

use serde_json::{Value, json};
use shapespace_picture::{Colour, colour, heat};
use shapespace_report::html::{Markup, data_block, data_url, element, single};

use super::overview::section;
use super::scene::{byte, hex};
use super::source::Source;
use super::values::{at, one, points, text};

/// Width of the map, and the space around its points.
const WIDTH: f64 = 640.0;
const MARGIN: f64 = 40.0;
/// Most shapes: their pairs are as many as the square.
const SHAPES: usize = 400;
/// Colours of the scale.
const STOPS: usize = 17;
const RADIUS: &str = "6";

/// The map and the matrix of distances; nothing for other results.
pub(super) fn map(source: &Source<'_>) -> Markup {
    let record = &source.record;
    let names = at(record, "/input/*/name");
    let known = text(record, "/command") == "distances" && names.len() <= SHAPES;
    let Some(matrix) = source.text("distances.csv").filter(|_| known) else {
        return Markup::default();
    };
    let groups = groups(record, names.len());
    let stops = (0..STOPS).map(|k| heat(k as f64 / (STOPS - 1) as f64).map(byte));
    let order = at(record, "/clustering/order/*").into_iter();
    let order = order.map(|i| i.and_then(Value::as_u64).unwrap_or(0) as usize);
    let order: Vec<usize> = order.collect();
    // New shapes in the rows, stored ones in the columns.
    let new = one(record, "/new_shapes").and_then(Value::as_u64);
    let new = new
        .and_then(|new| usize::try_from(new).ok())
        .filter(|new| *new < names.len());
    let first = new.unwrap_or(0);
    let [rows, columns] = match (new, order.is_empty()) {
        (Some(new), _) => [(0..new).collect(), (new..names.len()).collect()],
        (None, true) => [(); 2].map(|()| (0..names.len()).collect()),
        (None, false) => [(); 2].map(|()| order.clone()),
    };
    let [rows, columns]: [Vec<usize>; 2] = [rows, columns];
    let data = json!({
        "names": names,
        "groups": groups.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "rows": rows,
        "columns": columns,
        "first": first,
        "matrix": entries(&matrix),
        "heat": stops.collect::<Vec<_>>(),
        "marks": marks(source),
    });
    let data = data.to_string();
    if !source.take(data.len()) {
        return Markup::default();
    }
    // Its colours are explained below it.
    let shades = element(
        "canvas",
        &[("class", "matrix"), ("aria-label", "distances")],
        "",
    );
    let inner: Markup = [
        drawn(&points(record, "/embedding/points/*"), &groups),
        element("div", &[], shades),
        element("figcaption", &[], caption(record)),
        data_block("distances", &data),
    ]
    .into_iter()
    .collect();
    section(
        "Map and matrix",
        element("figure", &[("class", "map")], inner),
    )
}

/// What can be read off, and in which order.
fn caption(record: &Value) -> String {
    let has = |pointer: &str| one(record, pointer).is_some();
    let of_map = if has("/embedding") {
        "at a shape of the map or "
    } else {
        ""
    };
    let order = if has("/new_shapes") {
        "with new shapes in its rows and stored ones in its columns"
    } else if has("/clustering") {
        "whose rows and columns are in the order of the tree"
    } else {
        "whose rows and columns are in the order of the inputs"
    };
    format!("Point {of_map}at a cell of the matrix, {order}: the darker, the further apart.")
}

/// What each shape belongs to, with its colour: its class, or else its cluster.
fn groups(record: &Value, count: usize) -> Vec<(String, Colour)> {
    let classes = at(record, "/input/*/class");
    let labels = at(record, "/clustering/labels/*");
    let mut seen: Vec<&str> = Vec::new();
    let group = |i: usize| {
        if let Some(class) = classes.get(i).copied().flatten().and_then(Value::as_str) {
            let place = seen.iter().position(|name| *name == class);
            let place = place.unwrap_or_else(|| {
                seen.push(class);
                seen.len() - 1
            });
            return (class.to_owned(), colour(place));
        }
        match labels.get(i).copied().flatten().and_then(Value::as_u64) {
            Some(label) => (format!("cluster {label}"), colour(label as usize)),
            None => (String::new(), colour(0)),
        }
    };
    (0..count).map(group).collect()
}

/// The entries of a table of distances; none where there is no path.
fn entries(text: &str) -> Vec<Vec<Option<f64>>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let row = |row: csv::StringRecord| row.iter().skip(1).map(rounded).collect();
    reader.records().flatten().map(row).collect()
}

/// Four digits, for which the script asks.
fn rounded(text: &str) -> Option<f64> {
    let number: f64 = text.parse().ok()?;
    format!("{number:.3e}").parse().ok()
}

/// The small pictures of the shapes.
fn marks(source: &Source<'_>) -> Vec<String> {
    let url = |mark: &shapespace_picture::Canvas| {
        let png = mark.png().unwrap_or_default();
        data_url("image/png", &png)
    };
    source.summary.marks.iter().map(url).collect()
}

/// The points of a map, the second axis upwards.
fn drawn(points: &[[f64; 2]], groups: &[(String, Colour)]) -> Markup {
    let along = |k: usize| points.iter().map(move |p| p[k]);
    let low = [0, 1].map(|k| along(k).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k| along(k).fold(f64::NEG_INFINITY, f64::max));
    let sides = [0, 1].map(|k| high[k] - low[k]);
    let most = sides[0].max(sides[1]);
    if points.len() != groups.len() || most.is_nan() || most <= 0.0 {
        return Markup::default();
    }
    let scale = (WIDTH - 2.0 * MARGIN) / most;
    let [width, height] = sides.map(|side| 2.0 * MARGIN + scale * side);
    let circle = |(i, (p, (_, colour))): (usize, (&[f64; 2], &(String, Colour)))| {
        let x = format!("{:.1}", MARGIN + scale * (p[0] - low[0]));
        let y = format!("{:.1}", MARGIN + scale * (high[1] - p[1]));
        let attributes = [
            ("cx", &*x),
            ("cy", &y),
            ("r", RADIUS),
            ("fill", &hex(*colour)),
            ("data-index", &i.to_string()),
        ];
        single("circle", &attributes)
    };
    let circles = points.iter().zip(groups).enumerate().map(circle);
    let attributes = [
        ("viewBox", &*format!("0 0 {width:.0} {height:.0}")),
        ("class", "points"),
    ];
    element("svg", &attributes, circles.collect::<Markup>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_without_a_path_are_none() {
        let found = entries(",a,\"b,\"\na,0,1.23456e-1\n\"b,\",,0\n");
        assert_eq!(found, [[Some(0.0), Some(0.1235)], [None, Some(0.0)]]);
    }

    #[test]
    fn the_second_axis_points_up_at_one_scale() {
        let groups = vec![(String::new(), [0.0, 0.5, 1.0]); 3];
        let svg = drawn(&[[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]], &groups);
        assert!(svg.as_str().contains("viewBox=\"0 0 640 360\""));
        let place = |i: usize| {
            let circle = svg.as_str().split("<circle").nth(i + 1).unwrap();
            circle
                .split('"')
                .skip(1)
                .step_by(2)
                .take(2)
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(
            [0, 1, 2].map(place),
            ["40.0 320.0", "600.0 320.0", "40.0 40.0"]
        );
        assert!(svg.as_str().contains("fill=\"#0080ff\""));
        assert!(drawn(&[[0.0; 2]; 3], &groups).is_empty());
    }
}
