//! VTK XML files of polygons (`PolyData`): arrays as text, in base64, or appended, plain or packed by
//! zlib.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};

use super::polygon::Polygons;
use super::text::{Words, index, text};
use super::{Decoded, states_left};
use crate::number::NumberType;

/// Bytes of an array at most, so many times those of the file: zlib packs no better.
const MOST_PACKED: usize = 1032;

/// What all arrays have in common.
struct Layout<'a> {
    little_endian: bool,
    /// The type of the numbers before data.
    header: NumberType,
    packed: bool,
    /// The data that arrays refer to, and whether they are in base64.
    appended: Option<(&'a [u8], bool)>,
    /// Bytes that an array may have.
    limit: usize,
}

pub(super) fn decode(bytes: &[u8]) -> Decoded {
    within(bytes, |root, layout| {
        let mut polygons = Polygons::default();
        for piece in nodes(root, "Piece") {
            read_piece(piece, layout, &mut polygons)?;
        }
        let mut to_the_left = false;
        for field in nodes(root, "FieldData").flat_map(|field| nodes(field, "DataArray")) {
            if field.attribute("Name") == Some("SPACE") {
                let letters = layout.numbers(field)?;
                let letters: Vec<u8> = letters.iter().map(|&letter| letter as u8).collect();
                to_the_left = states_left(&[b"SPACE=", letters.as_slice()].concat());
            }
        }
        Ok((polygons, to_the_left))
    })
}

/// The numbers of the array of this name at the points, as they stand there.
pub(crate) fn point_array(bytes: &[u8], name: &str) -> Result<Vec<f64>, String> {
    within(bytes, |root, layout| {
        let arrays = nodes(root, "PointData").flat_map(|data| nodes(data, "DataArray"));
        let mut named = arrays.filter(|array| array.attribute("Name") == Some(name));
        let array = named.next();
        layout.numbers(array.ok_or_else(|| format!("it has no array '{name}' at its points"))?)
    })
}

/// What is read of the document of a file.
fn within<T>(
    bytes: &[u8],
    read: impl FnOnce(Node<'_, '_>, &Layout<'_>) -> Result<T, String>,
) -> Result<T, String> {
    let (xml, appended) = split(bytes)?;
    let document = Document::parse(&xml).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if !root.has_tag_name("VTKFile") || root.attribute("type") != Some("PolyData") {
        return Err("it has no VTKFile of the type PolyData".into());
    }
    let layout = Layout {
        little_endian: root.attribute("byte_order") != Some("BigEndian"),
        header: match root.attribute("header_type") {
            Some("UInt64") => NumberType::U64,
            _ => NumberType::U32,
        },
        packed: match root.attribute("compressor") {
            None => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => return Err(format!("it is packed by {other}, not by zlib")),
        },
        appended,
        limit: bytes.len().saturating_mul(MOST_PACKED),
    };
    read(root, &layout)
}

/// The text of a file, and the data after it, which need not be text.
fn split(bytes: &[u8]) -> Result<(String, Option<(&[u8], bool)>), String> {
    const TAG: &[u8] = b"<AppendedData";
    let Some(start) = bytes.windows(TAG.len()).position(|window| window == TAG) else {
        return Ok((text(bytes).into_owned(), None));
    };
    let after = &bytes[start..];
    let mark = after.iter().position(|&b| b == b'_');
    let mark = mark.ok_or("its appended data do not begin")?;
    let base64 = after[..mark].windows(6).any(|window| window == b"base64");
    let xml = text(&bytes[..start]).into_owned() + "</VTKFile>";
    Ok((xml, Some((&after[mark + 1..], base64))))
}

fn nodes<'a, 'b: 'a>(node: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.descendants().filter(move |n| n.has_tag_name(name))
}

fn read_piece(
    piece: Node<'_, '_>,
    layout: &Layout<'_>,
    polygons: &mut Polygons,
) -> Result<(), String> {
    let before = polygons.points.len() as u32;
    let points = nodes(piece, "Points").flat_map(|points| nodes(points, "DataArray"));
    for array in points.take(1) {
        let numbers = layout.numbers(array)?;
        polygons.points.extend(numbers.as_chunks::<3>().0);
    }
    for (kind, strips) in [("Polys", false), ("Strips", true)] {
        let Some(cells) = nodes(piece, kind).next() else {
            continue;
        };
        let array = |name: &str| {
            let named = nodes(cells, "DataArray").find(|a| a.attribute("Name") == Some(name));
            named.map_or(Ok(Vec::new()), |array| layout.numbers(array))
        };
        let corners = array("connectivity")?;
        let moved = |&corner: &f64| index(corner + f64::from(before));
        let corners: Vec<u32> = corners.iter().map(moved).collect::<Result<_, _>>()?;
        let mut first = 0;
        for end in array("offsets")? {
            let end = index(end)? as usize;
            let list = corners.get(first..end);
            let list = list.ok_or("its polygons do not end where they state")?;
            first = end;
            if strips {
                polygons.strip(list);
            } else {
                polygons.polygon(list);
            }
        }
    }
    Ok(())
}

impl Layout<'_> {
    /// The numbers of an array.
    fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, String> {
        let kind = array.attribute("type").unwrap_or_default();
        let kind = number_type(kind)?;
        let content = array.text().unwrap_or_default();
        let data = match array.attribute("format") {
            Some("ascii") => {
                let mut words = Words::new(content);
                let mut numbers = Vec::new();
                while let Some(word) = words.next() {
                    numbers.push(super::text::parsed(word)?);
                }
                return Ok(numbers);
            }
            Some("binary") => self.unpacked(content.trim().as_bytes(), true)?,
            Some("appended") => {
                let (data, base64) = self.appended.ok_or("it has no appended data")?;
                let offset = array.attribute("offset").and_then(|n| n.parse().ok());
                let data = offset.and_then(|offset: usize| data.get(offset..));
                self.unpacked(data.ok_or("an array begins behind its data")?, base64)?
            }
            other => {
                let other = other.unwrap_or_default();
                return Err(format!("an array has the unknown format '{other}'"));
            }
        };
        Ok(kind.doubles(&data, self.little_endian))
    }

    /// The bytes of an array: after a header with their number, or in packed blocks.
    fn unpacked(&self, data: &[u8], base64: bool) -> Result<Vec<u8>, String> {
        let cut_off = || "it is cut off: an array is shorter than stated".to_owned();
        let width = self.header.width();
        let header = |count: usize| -> Result<Vec<usize>, String> {
            let bytes = plain(data, count * width, base64).ok_or_else(cut_off)?;
            let numbers = self.header.doubles(&bytes, self.little_endian);
            Ok(numbers.into_iter().map(|n| n as usize).collect())
        };
        if !self.packed {
            let length = header(1)?[0];
            let whole = width.checked_add(length).ok_or_else(cut_off)?;
            let bytes = plain(data, whole, base64).ok_or_else(cut_off)?;
            return Ok(bytes[width..].to_vec());
        }
        let n_blocks = header(1)?[0];
        let length = n_blocks.checked_add(3).filter(|n| *n <= data.len());
        let sizes = header(length.ok_or_else(cut_off)?)?;
        let block = sizes[1];
        if block.checked_mul(n_blocks).is_none_or(|n| n > self.limit) {
            return Err(format!("it states {n_blocks} blocks of {block} bytes"));
        }
        let start = stored(sizes.len() * width, base64);
        let packed = data.get(start..).ok_or_else(cut_off)?;
        let total = sizes[3..]
            .iter()
            .try_fold(0usize, |sum, &n| sum.checked_add(n));
        let total = total.ok_or_else(cut_off)?;
        let packed = plain(packed, total, base64).ok_or_else(cut_off)?;
        let mut rest = &packed[..];
        let mut unpacked = Vec::new();
        for &size in &sizes[3..] {
            let (bytes, after) = rest.split_at(size);
            rest = after;
            let before = unpacked.len();
            let mut unpacker = ZlibDecoder::new(bytes).take(block as u64 + 1);
            let read = unpacker.read_to_end(&mut unpacked);
            read.map_err(|error| format!("a packed block is damaged: {error}"))?;
            if unpacked.len() - before > block {
                return Err("a packed block is longer than stated".into());
            }
        }
        Ok(unpacked)
    }
}

/// The length of bytes as they are stored.
fn stored(length: usize, base64: bool) -> usize {
    if base64 {
        length.div_ceil(3) * 4
    } else {
        length
    }
}

/// The first bytes of data.
fn plain(data: &[u8], length: usize, base64: bool) -> Option<Vec<u8>> {
    if length > data.len() {
        return None;
    }
    let data = data.get(..stored(length, base64))?;
    if !base64 {
        return Some(data.to_vec());
    }
    let mut bytes = STANDARD.decode(data).ok().or_else(|| {
        // The header of an array that is not packed is not padded.
        let whole = length / 3 * 4;
        let tail = STANDARD.decode(data.get(whole..)?).ok()?;
        let mut bytes = STANDARD.decode(&data[..whole]).ok()?;
        bytes.extend(tail);
        Some(bytes)
    })?;
    bytes.truncate(length);
    (bytes.len() == length).then_some(bytes)
}

fn number_type(name: &str) -> Result<NumberType, String> {
    Ok(match name {
        "Int8" => NumberType::I8,
        "UInt8" | "String" => NumberType::U8,
        "Int16" => NumberType::I16,
        "UInt16" => NumberType::U16,
        "Int32" => NumberType::I32,
        "UInt32" => NumberType::U32,
        "Int64" => NumberType::I64,
        "UInt64" => NumberType::U64,
        "Float32" => NumberType::F32,
        "Float64" => NumberType::F64,
        _ => return Err(format!("it has numbers of the unknown type '{name}'")),
    })
}
