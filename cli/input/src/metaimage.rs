//! MetaImage volumes: `.mha`, and `.mhd` with the data in another file, raw or zlib.
//!
//! <https://itk.org/Wiki/ITK/MetaIO/Documentation>

use std::path::{Path, PathBuf};

use super::InputError;
use super::decode::Samples;
use super::number::NumberType;
use super::packed::Packed;
use super::volume::{
    MAX_HEADER, Storage, Volume, data_file, data_of, flattened, in_space, unread_type,
    usable_affine,
};

/// Factors from the space of the format, to the left, to the back and upwards, to RAS.
const SIGNS: [f64; 3] = [-1.0, -1.0, 1.0];

/// Reads a volume.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let file = Packed {
        path,
        format: "MetaImage",
    };
    let (fields, data) =
        Fields::parse(bytes).ok_or_else(|| file.malformed("its header has no ElementDataFile"))?;
    let (volume, storage) = volume(&fields, file)?;
    let Some(name) = fields.other_file() else {
        return volume.stored(data, storage, file);
    };
    if name == "LIST" || name.contains('%') {
        return Err(file.malformed("its data are in several files, which are not read"));
    }
    volume.stored(&data_of(file, name)?, storage, file)
}

/// The file with the data, if the header names another one.
pub(crate) fn data_file_of(bytes: &[u8], path: &Path) -> Option<PathBuf> {
    data_file(path, Fields::parse(bytes)?.0.other_file()?)
}

/// The fields of a header, `name = value` a line; the last one names the file of the data.
struct Fields(Vec<(String, String)>);

impl Fields {
    fn parse(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (mut fields, mut rest) = (Vec::new(), bytes);
        loop {
            let end = rest.iter().take(MAX_HEADER).position(|&b| b == b'\n');
            let (line, after) = match end {
                Some(end) => (&rest[..end], &rest[end + 1..]),
                None if rest.len() <= MAX_HEADER && !rest.is_empty() => (rest, &[][..]),
                None => return None,
            };
            let (key, value) = std::str::from_utf8(line).ok()?.split_once('=')?;
            let (key, value) = (key.trim().to_owned(), value.trim().to_owned());
            let last = key == "ElementDataFile";
            fields.push((key, value));
            rest = after;
            if last {
                return Some((Self(fields), rest));
            }
            if bytes.len() - rest.len() > MAX_HEADER {
                return None;
            }
        }
    }

    /// The value of the first of these names that is stated.
    fn get(&self, names: &[&str]) -> Option<&str> {
        let named = |name: &&str| {
            let mut fields = self.0.iter();
            fields
                .find(|(key, _)| key == name)
                .map(|(_, value)| value.as_str())
        };
        names.iter().find_map(named)
    }

    /// The name of the file with the data; none for the header's own.
    fn other_file(&self) -> Option<&str> {
        let name = self.get(&["ElementDataFile"]).unwrap_or_default();
        (!name.eq_ignore_ascii_case("LOCAL")).then_some(name)
    }

    fn is_true(&self, names: &[&str]) -> Option<bool> {
        self.get(names)
            .map(|value| value.eq_ignore_ascii_case("true"))
    }

    /// So many numbers.
    fn numbers(
        &self,
        names: &[&str],
        n: usize,
        file: Packed<'_>,
    ) -> Result<Option<Vec<f64>>, InputError> {
        let Some(text) = self.get(names) else {
            return Ok(None);
        };
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|s| s.parse().ok()).collect();
        match numbers.filter(|numbers| numbers.len() == n) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(file.malformed(format!("its {} has not {n} numbers", names[0]))),
        }
    }
}

fn volume(fields: &Fields, file: Packed<'_>) -> Result<(Volume, Storage), InputError> {
    let n = fields.get(&["NDims"]).and_then(|n| n.parse::<usize>().ok());
    let n = n.filter(|n| (1..=8).contains(n));
    let n = n.ok_or_else(|| file.malformed("its NDims is not a number from 1 to 8"))?;
    let sizes = fields.numbers(&["DimSize"], n, file)?;
    let sizes = sizes.ok_or_else(|| file.malformed("its header has no DimSize"))?;
    if sizes.iter().any(|n| n.fract() != 0.0 || *n < 0.0) {
        return Err(file.malformed("its DimSize are no whole numbers"));
    }
    let kind = fields.get(&["ElementType"]).unwrap_or_default();
    let numbers = number_type(kind).ok_or_else(|| unread_type(format_args!("'{kind}'"), file))?;
    if fields
        .get(&["ElementNumberOfChannels"])
        .is_some_and(|channels| channels != "1")
    {
        return Err(file.malformed("it holds several numbers a sample"));
    }
    if fields.is_true(&["BinaryData"]) == Some(false) {
        return Err(file.malformed("its data are text, which is not read"));
    }
    if fields.get(&["HeaderSize"]).is_some_and(|size| size != "0") {
        return Err(file.malformed("its data file has a header of its own, which is not read"));
    }
    let order = ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"];
    let little_endian = !fields.is_true(&order).unwrap_or(false);
    let storage = match fields.is_true(&["CompressedData"]) {
        Some(true) => Storage::Zlib,
        _ => Storage::Raw,
    };
    let (size, count) = flattened(sizes.iter().map(|&n| n as u64).collect(), file.path)?;
    let n_axes = size.len();
    let spacing = fields.numbers(&["ElementSpacing", "ElementSize"], n, file)?;
    let spacing = spacing.unwrap_or_else(|| vec![1.0; n]);
    let offset = fields.numbers(&["Offset", "Position", "Origin"], n, file)?;
    let matrix = fields.numbers(&["TransformMatrix", "Rotation", "Orientation"], n * n, file)?;
    let affine = (n <= 3 && (offset.is_some() || matrix.is_some())).then(|| {
        let component = |axis: usize, i: usize| match &matrix {
            Some(matrix) => matrix[axis * n + i],
            None => f64::from(u8::from(axis == i)),
        };
        let vectors: Vec<[f64; 3]> = (0..n_axes)
            .map(|axis| {
                [0, 1, 2].map(|i| {
                    if i < n {
                        spacing[axis] * component(axis, i)
                    } else {
                        0.0
                    }
                })
            })
            .collect();
        let offset = offset.unwrap_or_default();
        let origin = [0, 1, 2].map(|i| offset.get(i).copied().unwrap_or(0.0));
        in_space(&vectors, origin, SIGNS)
    });
    let affine = affine.map(|affine| usable_affine(affine, n_axes, file));
    let volume = Volume {
        size,
        count,
        numbers,
        little_endian,
        scaling: None,
        spacing: spacing[..n_axes].to_vec(),
        affine: affine.transpose()?,
    };
    Ok((volume, storage))
}

fn number_type(name: &str) -> Option<NumberType> {
    Some(match name {
        "MET_CHAR" => NumberType::I8,
        "MET_UCHAR" => NumberType::U8,
        "MET_SHORT" => NumberType::I16,
        "MET_USHORT" => NumberType::U16,
        "MET_INT" | "MET_LONG" => NumberType::I32,
        "MET_UINT" | "MET_ULONG" => NumberType::U32,
        "MET_LONG_LONG" => NumberType::I64,
        "MET_ULONG_LONG" => NumberType::U64,
        "MET_FLOAT" => NumberType::F32,
        "MET_DOUBLE" => NumberType::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{AnyImage, ReadOptions, decode_image};
    use super::*;
    use std::io::Write;

    const DATA: [u8; 8] = [0, 1, 0, 0, 0, 0, 0, 0];
    const HEADER: &str = "ObjectType = Image\nNDims = 3\nBinaryData = True\nCompressedData = False\n\
                          TransformMatrix = 0 1 0 1 0 0 0 0 -1\nOffset = 10 -20 5.5\nElementSpacing \
                          = 2 0.5 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = \
                          LOCAL\n";

    fn read(header: &str, data: &[u8]) -> Result<AnyImage, InputError> {
        let bytes = [header.as_bytes(), data].concat();
        decode_image(&bytes, Path::new("v.mha"), &ReadOptions::default())
    }

    #[test]
    fn rows_of_the_matrix_are_the_directions_of_the_axes() {
        let AnyImage::D3(image) = read(HEADER, &DATA).unwrap() else {
            panic!("three axes")
        };
        let expected = [
            [0.0, -0.5, 0.0, -10.0],
            [-2.0, 0.0, 0.0, 20.0],
            [0.0, 0.0, -3.0, 5.5],
        ];
        assert_eq!(image.affine, Some(expected));
        assert_eq!(image.spacing, [2.0, 0.5, 3.0]);
        let mut packer =
            flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        packer.write_all(&DATA).unwrap();
        let packed = packer.finish().unwrap();
        let header = HEADER.replace("CompressedData = False", "CompressedData = True");
        assert_eq!(read(&header, &packed).unwrap(), AnyImage::D3(image));
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        let report = |old: &str, new: &str| {
            read(&HEADER.replace(old, new), &DATA)
                .unwrap_err()
                .to_string()
        };
        for (old, new, expected) in [
            ("LOCAL", "LIST", "several files"),
            ("LOCAL", "v%03d.raw", "several files"),
            ("LOCAL", "../v.raw", "not a file in its folder"),
            ("ElementDataFile", "DataFile", "no ElementDataFile"),
            ("MET_UCHAR", "MET_STRING", "type"),
            ("BinaryData = True", "BinaryData = False", "text"),
            ("NDims = 3", "NDims = 99", "NDims"),
            ("DimSize = 2 2 2", "DimSize = 2 2", "DimSize"),
            ("DimSize = 2 2 2", "DimSize = 2 2 2.5", "DimSize"),
            ("DimSize = 2 2 2", "DimSize = 2 2 1e18", "limit"),
            ("DimSize = 2 2 2", "DimSize = 2 2 4", "cut off"),
            (
                "CompressedData = False",
                "CompressedData = True",
                "MetaImage",
            ),
            (
                "ElementSpacing = 2 0.5 3",
                "ElementSpacing = 2 0 3",
                "no length",
            ),
            ("0 1 0 1 0 0 0 0 -1", "0 1 0 1 0 0 1 1 0", "singular"),
            ("0 1 0 1 0 0 0 0 -1", "0 1 0 1", "9 numbers"),
        ] {
            let found = report(old, new);
            assert!(found.contains(expected), "{new}: {found}");
        }
    }
}
