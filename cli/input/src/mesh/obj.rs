//! Wavefront OBJ: points (`v`) and polygons (`f`); materials and curves are left out.

use super::polygon::Polygons;
use super::text::{index, parsed, text};
use super::{Decoded, states_left};

pub(super) fn decode(bytes: &[u8]) -> Decoded {
    let text = text(bytes).replace("\\\r\n", " ").replace("\\\n", " ");
    let mut polygons = Polygons::default();
    let mut to_the_left = false;
    for (number, line) in text.lines().enumerate() {
        let at = |reason: String| format!("line {}: {reason}", number + 1);
        if line.starts_with('#') {
            to_the_left |= states_left(line.as_bytes());
            continue;
        }
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Result<Vec<f64>, _> = words.take(3).map(parsed).collect();
                let numbers = numbers.map_err(at)?;
                let point = numbers.try_into();
                let point = point.map_err(|_| at("a point has three coordinates".into()))?;
                polygons.points.push(point);
            }
            Some("f") => {
                for word in words {
                    let corner = corner(word, polygons.points.len()).map_err(at)?;
                    polygons.corner(corner);
                }
                polygons.end();
            }
            _ => {}
        }
    }
    Ok((polygons, to_the_left))
}

/// The point of a corner `point/texture/normal`: counted from 1, or backwards from the last point.
fn corner(word: &str, count: usize) -> Result<u32, String> {
    let number = parsed(word.split('/').next().unwrap_or_default())?;
    if number < 0.0 {
        index(count as f64 + number)
    } else {
        index(number - 1.0)
    }
}
