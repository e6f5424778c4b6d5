//! STL, binary and text.

use super::polygon::Polygons;
use super::text::{Words, text};
use super::{Decoded, states_left};

const HEADER: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn decode(bytes: &[u8]) -> Decoded {
    let start = bytes.trim_ascii_start();
    // Binary files, too, may begin as text does; their length tells.
    let stated = bytes
        .get(80..HEADER)
        .map(|n| HEADER + TRIANGLE * u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    if start.starts_with(b"solid") && stated != Some(bytes.len()) {
        return from_text(bytes);
    }
    let Some(expected) = stated else {
        return Err("it is shorter than a header".into());
    };
    let Some(data) = bytes.get(HEADER..expected) else {
        let found = bytes.len();
        return Err(format!(
            "its header states {expected} bytes of triangles, found {found}"
        ));
    };
    let mut polygons = Polygons::default();
    for triangle in data.chunks_exact(TRIANGLE) {
        // The normal before the corners is left out: it follows from them.
        let (corners, _) = triangle[12..48].as_chunks::<4>();
        let numbers: Vec<f64> = corners
            .iter()
            .map(|&b| f64::from(f32::from_le_bytes(b)))
            .collect();
        add(&mut polygons, &numbers);
    }
    Ok((polygons, states_left(&bytes[..80])))
}

fn from_text(bytes: &[u8]) -> Decoded {
    let text = text(bytes);
    let first = text.lines().next().unwrap_or_default();
    let mut words = Words::new(&text[first.len()..]);
    let mut polygons = Polygons::default();
    let mut numbers = Vec::new();
    let mut ended = false;
    while let Some(word) = words.next() {
        match word.to_ascii_lowercase().as_str() {
            "vertex" => {
                for _ in 0..3 {
                    numbers.push(words.number()?);
                }
            }
            "endfacet" => {
                if numbers.len() != 9 {
                    let found = numbers.len() / 3;
                    return Err(format!("a facet has {found} corners"));
                }
                add(&mut polygons, &numbers);
                numbers.clear();
            }
            "endsolid" => ended = true,
            _ => {}
        }
    }
    if !ended || !numbers.is_empty() {
        return Err("it is cut off: 'endsolid' is missing".into());
    }
    Ok((polygons, states_left(first.as_bytes())))
}

fn add(polygons: &mut Polygons, corners: &[f64]) {
    for point in corners.as_chunks::<3>().0 {
        polygons.corner(polygons.points.len() as u32);
        polygons.points.push(*point);
    }
    polygons.end();
}
