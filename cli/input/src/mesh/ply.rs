//! PLY, text and binary: the points and the faces; other elements and properties are left out.

use super::polygon::Polygons;
use super::text::{Words, index, text};
use super::{Decoded, states_left};
use crate::number::NumberType;

/// A header longer than this is damage.
const LONGEST_HEADER: usize = 1 << 20;

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// The type of the count of a list.
    counted: Option<NumberType>,
    kind: NumberType,
}

enum Body<'a> {
    Text(Words<'a>),
    Binary { rest: &'a [u8], little_endian: bool },
}

impl Body<'_> {
    fn number(&mut self, kind: NumberType) -> Result<f64, String> {
        match self {
            Self::Text(words) => words.number(),
            Self::Binary {
                rest,
                little_endian,
            } => {
                let (number, after) = rest
                    .split_at_checked(kind.width())
                    .ok_or("it is cut off: it ends before its last element")?;
                *rest = after;
                Ok(kind.doubles(number, *little_endian)[0])
            }
        }
    }
}

pub(super) fn decode(bytes: &[u8]) -> Decoded {
    if !bytes.starts_with(b"ply") {
        return Err("it does not start as one".into());
    }
    let head = &bytes[..bytes.len().min(LONGEST_HEADER)];
    let end = head
        .windows(10)
        .position(|window| window == b"end_header")
        .ok_or("its header does not end")?;
    let rest = &bytes[end + 10..];
    let line_end = rest.iter().position(|&b| b == b'\n');
    let rest = &rest[line_end.map_or(rest.len(), |n| n + 1)..];
    let header = text(&bytes[..end]);
    let (format, elements) = parse_header(&header)?;
    let body_text;
    let mut body = match format {
        "ascii" => {
            body_text = text(rest);
            Body::Text(Words::new(&body_text))
        }
        "binary_little_endian" | "binary_big_endian" => Body::Binary {
            rest,
            little_endian: format == "binary_little_endian",
        },
        _ => return Err("its header states no known format".into()),
    };
    let mut polygons = Polygons::default();
    for element in &elements {
        read_element(element, &mut body, &mut polygons)?;
    }
    Ok((polygons, states_left(&bytes[..end])))
}

fn parse_header(header: &str) -> Result<(&str, Vec<Element>), String> {
    let mut format = "";
    let mut elements: Vec<Element> = Vec::new();
    for line in header.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["format", name, ..] => format = name,
            ["element", name, count] => elements.push(Element {
                name: name.into(),
                count: count
                    .parse()
                    .map_err(|_| format!("element {name} has no count"))?,
                properties: Vec::new(),
            }),
            ["property", ref kinds @ .., name] => {
                let (counted, kind) = match *kinds {
                    ["list", counted, kind] => (Some(number_type(counted)?), kind),
                    [kind] => (None, kind),
                    _ => return Err(format!("property {name} has no type")),
                };
                let element = elements.last_mut().ok_or("a property has no element")?;
                element.properties.push(Property {
                    name: name.into(),
                    counted,
                    kind: number_type(kind)?,
                });
            }
            _ => {}
        }
    }
    Ok((format, elements))
}

fn number_type(name: &str) -> Result<NumberType, String> {
    Ok(match name {
        "char" | "int8" => NumberType::I8,
        "uchar" | "uint8" => NumberType::U8,
        "short" | "int16" => NumberType::I16,
        "ushort" | "uint16" => NumberType::U16,
        "int" | "int32" => NumberType::I32,
        "uint" | "uint32" => NumberType::U32,
        "float" | "float32" => NumberType::F32,
        "double" | "float64" => NumberType::F64,
        _ => return Err(format!("it has numbers of the unknown type '{name}'")),
    })
}

/// Rows end where the file does: counts of the header are not trusted.
fn read_element(
    element: &Element,
    body: &mut Body<'_>,
    polygons: &mut Polygons,
) -> Result<(), String> {
    let places = ["x", "y", "z"].map(|axis| {
        let named = |property: &Property| property.name == axis && property.counted.is_none();
        element.properties.iter().position(named)
    });
    let is_points = element.name == "vertex";
    if is_points && places.contains(&None) {
        return Err("its points have no x, y and z".into());
    }
    let is_faces = element.name == "face";
    let of_corners = |property: &Property| {
        let name = property.name.as_str();
        property.counted.is_some() && matches!(name, "vertex_indices" | "vertex_index")
    };
    if is_faces && !element.properties.iter().any(of_corners) {
        return Err("its faces have no vertex_indices".into());
    }
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        let mut point = [0.0; 3];
        for (number, property) in element.properties.iter().enumerate() {
            let Some(counted) = property.counted else {
                let value = body.number(property.kind)?;
                if let Some(axis) = places.iter().position(|&place| place == Some(number)) {
                    point[axis] = value;
                }
                continue;
            };
            let count = index(body.number(counted)?)?;
            let corners = is_faces && of_corners(property);
            for _ in 0..count {
                let value = body.number(property.kind)?;
                if corners {
                    polygons.corner(index(value)?);
                }
            }
            if corners {
                polygons.end();
            }
        }
        if is_points {
            polygons.points.push(point);
        }
    }
    Ok(())
}
