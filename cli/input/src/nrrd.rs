//! NRRD volumes, with the data in the same file or in another, raw or gzip.
//!
//! <https://teem.sourceforge.net/nrrd/format.html>

use std::path::{Path, PathBuf};

use super::InputError;
use super::decode::Samples;
use super::number::NumberType;
use super::packed::Packed;
use super::volume::{
    MAX_HEADER, Storage, Volume, data_file, data_of, flattened, in_space, unread_type,
    usable_affine,
};

/// Reads a volume; the name of a detached header ends with `.nhdr`.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let file = Packed {
        path,
        format: "NRRD",
    };
    let (text, data) = split(bytes)
        .ok_or_else(|| file.malformed("it does not start with an NRRD header of at most 1 MiB"))?;
    let fields = Fields(text);
    let (volume, storage) = volume(&fields, file)?;
    if fields.get("line skip").is_some_and(|skip| skip != "0")
        || fields.get("byte skip").is_some_and(|skip| skip != "0")
    {
        return Err(file.malformed("it skips a part of its data, which is not read"));
    }
    match fields.other_file() {
        Some(name) => volume.stored(&data_of(file, name)?, storage, file),
        None => volume.stored(data, storage, file),
    }
}

/// The file with the data, if the header names another one.
pub(crate) fn data_file_of(bytes: &[u8], path: &Path) -> Option<PathBuf> {
    data_file(path, Fields(split(bytes)?.0).other_file()?)
}

/// The lines of the header after the first, and what follows the empty line.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    if !bytes.starts_with(b"NRRD000") {
        return None;
    }
    let head = &bytes[..bytes.len().min(MAX_HEADER)];
    let ends: [&[u8]; 2] = [b"\n\n", b"\r\n\r\n"];
    let found = ends.iter().filter_map(|end| {
        let at = head.windows(end.len()).position(|window| window == *end)?;
        Some((at, at + end.len()))
    });
    // A detached header may end without an empty line.
    let (end, data) = match found.min() {
        Some(found) => found,
        None if bytes.len() <= MAX_HEADER => (bytes.len(), bytes.len()),
        None => return None,
    };
    let text = std::str::from_utf8(&bytes[..end]).ok()?;
    Some((text.split_once('\n')?.1, &bytes[data..]))
}

/// The fields of a header, `name: value` a line.
struct Fields<'a>(&'a str);

impl<'a> Fields<'a> {
    fn get(&self, name: &str) -> Option<&'a str> {
        self.0.lines().find_map(|line| {
            let (key, value) = line.split_once(':')?;
            // `key:=value` are remarks.
            let is_field = !line.starts_with('#') && !value.starts_with('=');
            (is_field && key.trim().eq_ignore_ascii_case(name)).then(|| value.trim())
        })
    }

    /// The name of the file with the data, if it is another one.
    fn other_file(&self) -> Option<&'a str> {
        self.get("data file").or(self.get("datafile"))
    }
}

fn volume(fields: &Fields<'_>, file: Packed<'_>) -> Result<(Volume, Storage), InputError> {
    let needed = |name: &str| {
        let value = fields.get(name);
        value.ok_or_else(|| file.malformed(format!("its header has no '{name}'")))
    };
    let kind = needed("type")?;
    let numbers = number_type(kind).ok_or_else(|| unread_type(format_args!("'{kind}'"), file))?;
    let storage = match needed("encoding")?.to_ascii_lowercase().as_str() {
        "raw" => Storage::Raw,
        "gzip" | "gz" => Storage::Gzip,
        other => {
            let reason = format!("its encoding is '{other}'; raw and gzip are read");
            return Err(file.malformed(reason));
        }
    };
    let little_endian = match fields.get("endian") {
        Some(endian) => endian.eq_ignore_ascii_case("little"),
        None if numbers.width() == 1 => true,
        None => return Err(file.malformed("its header has no 'endian'")),
    };
    let sizes: Option<Vec<u64>> = needed("sizes")?
        .split_whitespace()
        .map(|n| n.parse().ok())
        .collect();
    let mut sizes = sizes.ok_or_else(|| file.malformed("its sizes are no numbers"))?;
    let stated: Option<usize> = needed("dimension")?.parse().ok();
    if stated != Some(sizes.len()) {
        return Err(file.malformed("it does not have as many sizes as dimensions"));
    }
    let axes = Axes::of(fields, sizes.len()).map_err(|reason| file.malformed(reason))?;
    let Axes {
        mut directions,
        mut spacings,
        origin,
        signs,
    } = axes;
    // A list of one value a sample.
    if sizes.len() > 2 && sizes[0] == 1 && directions.first() == Some(&None) {
        sizes.remove(0);
        directions.remove(0);
        spacings.remove(0);
    }
    let (size, count) = flattened(sizes, file.path)?;
    let n_axes = size.len();
    let vectors: Option<Vec<[f64; 3]>> = directions.into_iter().take(n_axes).collect();
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let spacing = match &vectors {
        Some(vectors) => vectors.iter().map(length).collect(),
        None => spacings[..n_axes].to_vec(),
    };
    let affine = vectors
        .zip(signs)
        .map(|(vectors, signs)| in_space(&vectors, origin, signs));
    let affine = affine.map(|affine| usable_affine(affine, n_axes, file));
    let volume = Volume {
        size,
        count,
        numbers,
        little_endian,
        scaling: None,
        spacing,
        affine: affine.transpose()?,
    };
    Ok((volume, storage))
}

/// What a header states about the axes.
struct Axes {
    /// The vectors along the axes in space; none for axes of other kinds.
    directions: Vec<Option<[f64; 3]>>,
    spacings: Vec<f64>,
    origin: [f64; 3],
    /// Factors from the space of the file to RAS, if it is one of the patient.
    signs: Option<[f64; 3]>,
}

impl Axes {
    fn of(fields: &Fields<'_>, n: usize) -> Result<Self, &'static str> {
        let signs = match fields.get("space") {
            None => None,
            Some(space) => match space.to_ascii_lowercase().as_str() {
                "right-anterior-superior" | "ras" => Some([1.0, 1.0, 1.0]),
                "left-anterior-superior" | "las" => Some([-1.0, 1.0, 1.0]),
                "left-posterior-superior" | "lps" => Some([-1.0, -1.0, 1.0]),
                _ => None,
            },
        };
        let directions = match fields.get("space directions") {
            None => vec![None; n],
            Some(text) => vectors(text).ok_or("its space directions are no vectors")?,
        };
        let spacings = match fields.get("spacings") {
            None => vec![1.0; n],
            Some(text) => {
                let numbers = text.split_whitespace().map(|s| s.parse().ok());
                let numbers: Option<Vec<f64>> = numbers.collect();
                // Axes that are not in space have the spacing `nan`.
                let numbers = numbers.ok_or("its spacings are no numbers")?;
                numbers
                    .into_iter()
                    .map(|h| if h.is_nan() { 1.0 } else { h.abs() })
                    .collect()
            }
        };
        if directions.len() != n || spacings.len() != n {
            return Err("it does not have as many space directions or spacings as sizes");
        }
        let origin = match fields.get("space origin") {
            None => [0.0; 3],
            Some(text) => match vectors(text).as_deref() {
                Some([Some(origin)]) => *origin,
                _ => return Err("its space origin is no vector"),
            },
        };
        Ok(Self {
            directions,
            spacings,
            origin,
            signs,
        })
    }
}

/// `(1,0,0) none (0,1,0)`, with vectors of two or three numbers.
fn vectors(text: &str) -> Option<Vec<Option<[f64; 3]>>> {
    let mut found = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            found.push(None);
            rest = after.trim_start();
            continue;
        }
        let (inside, after) = rest.strip_prefix('(')?.split_once(')')?;
        let numbers = inside.split(',').map(|s| s.trim().parse().ok());
        let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
        let vector = match numbers[..] {
            [x, y] => [x, y, 0.0],
            [x, y, z] => [x, y, z],
            _ => return None,
        };
        found.push(Some(vector));
        rest = after.trim_start();
    }
    Some(found)
}

fn number_type(name: &str) -> Option<NumberType> {
    Some(match name.to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => NumberType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => NumberType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            NumberType::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            NumberType::U16
        }
        "int" | "signed int" | "int32" | "int32_t" => NumberType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => NumberType::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => NumberType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            NumberType::U64
        }
        "float" => NumberType::F32,
        "double" => NumberType::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{AnyImage, ReadOptions, decode_image};
    use super::*;

    fn read(header: &str, data: &[u8]) -> Result<AnyImage, InputError> {
        let bytes = [b"NRRD0004\n", header.as_bytes(), b"\n\n", data].concat();
        decode_image(&bytes, Path::new("v.nrrd"), &ReadOptions::default())
    }

    const DATA: [u8; 8] = [0, 1, 0, 0, 0, 0, 0, 0];

    #[test]
    fn places_in_the_world_are_converted() {
        let header = "# a remark\ntype: unsigned char\ndimension: 3\nsizes: 2 2 2\nspace: \
                      left-posterior-superior\nspace directions: (0,2,0) (0.5,0,0) (0,0,-3)\nspace \
                      origin: (10,-20,5.5)\nencoding: raw\nkey:=value";
        let AnyImage::D3(image) = read(header, &DATA).unwrap() else {
            panic!("three axes")
        };
        let affine = image.affine.unwrap();
        let expected = [
            [0.0, -0.5, 0.0, -10.0],
            [-2.0, 0.0, 0.0, 20.0],
            [0.0, 0.0, -3.0, 5.5],
        ];
        assert_eq!(affine, expected);
        assert_eq!(image.spacing, [2.0, 0.5, 3.0]);
        assert_eq!(image.values.get(1), 1.0);
    }

    #[test]
    fn files_without_a_space_have_spacings() {
        let header = "type: uint16\ndimension: 4\nsizes: 1 2 2 2\nkinds: list space space space\n\
                      spacings: nan 1 2 3\nendian: big\nencoding: raw";
        let data: Vec<u8> = DATA.iter().flat_map(|&v| [0, v]).collect();
        let AnyImage::D3(image) = read(header, &data).unwrap() else {
            panic!("three axes")
        };
        assert_eq!((image.spacing, image.affine), ([1.0, 2.0, 3.0], None));
        assert_eq!(image.values.get(1), 1.0);
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        let good = "type: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw";
        assert!(read(good, &DATA).is_ok());
        let report = |old: &str, new: &str| {
            read(&good.replace(old, new), &DATA)
                .unwrap_err()
                .to_string()
        };
        for (old, new, expected) in [
            ("raw", "bzip2", "encoding"),
            ("raw", "raw\nbyte skip: -1", "skips"),
            (
                "raw",
                "raw\ndata file: ../secret",
                "not a file in its folder",
            ),
            (
                "raw",
                "raw\ndata file: /etc/passwd",
                "not a file in its folder",
            ),
            ("uint8", "block", "type"),
            ("uint8", "uint16", "endian"),
            ("2 2 2", "2 2", "as many sizes"),
            ("2 2 2", "2 2 x", "no numbers"),
            ("2 2 2", "2 2 99999999999", "limit"),
            ("2 2 2", "2 2 3", "cut off"),
            (
                "raw",
                "raw\nspace: RAS\nspace directions: (1,0,0) (0,1,0) (1,1,0)",
                "singular",
            ),
            (
                "raw",
                "raw\nspace: RAS\nspace directions: (1,0,0) (0,1,0)",
                "as many space",
            ),
            (
                "raw",
                "raw\nspace: RAS\nspace directions: 1 0 0",
                "no vectors",
            ),
        ] {
            let found = report(old, new);
            assert!(found.contains(expected), "{new}: {found}");
        }
    }
}
