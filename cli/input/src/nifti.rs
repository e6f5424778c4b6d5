//! NIfTI-1 and NIfTI-2 volumes, in one file or two, plain or compressed, and ANALYZE 7.5.

use std::path::{Path, PathBuf};

use super::decode::{Samples, take};
use super::number::NumberType;
use super::packed::Packed;
use super::values::Values;
use super::volume::{Storage, Volume, flattened, unread_type, usable_affine};
use super::{InputError, bytes_of, extension_of, reserve};

/// Bytes of the headers of both versions, which is also their first number.
const LENGTHS: [usize; 2] = [348, 540];
/// Where the data begin in a file that does not state it: after the header and four bytes.
const USUAL_OFFSETS: [f64; 2] = [352.0, 544.0];
/// Extensions between header and data may not be longer than this.
const MAX_OFFSET: f64 = (1 << 26) as f64;
/// A quaternion is at most this much longer than 1.
const ROUNDING: f64 = 1e-3;

/// Reads an uncompressed volume.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let header = Header::parse(bytes, path)?;
    let offset = header.offset(path)?;
    let volume = header.volume(path)?;
    volume.stored(bytes.get(offset..).unwrap_or(&[]), Storage::Raw, file(path))
}

/// Reads a compressed volume, once it is known how much is to be unpacked.
pub(crate) fn decode_compressed(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    // What follows a header of the first version may be padding.
    let mut head = file(path).start(bytes, LENGTHS[0])?;
    if version(&head).is_some_and(|(_, version)| version == 1) {
        head = file(path).start(bytes, LENGTHS[1])?;
    }
    let header = Header::parse(&head, path)?;
    let offset = header.offset(path)?;
    let volume = header.volume(path)?;
    let length = offset + volume.data_bytes();
    let unpacked = file(path).check(length, bytes)?;
    let kept = volume.data_bytes() as u64;
    reserve(path, unpacked + kept + volume.count as u64, kept)?;
    let unpacked = file(path).gzip(bytes, length)?;
    let data = unpacked.get(offset..).unwrap_or(&[]);
    let data = take(data, volume.data_bytes(), path)?;
    Ok(volume.decode(data))
}

/// The data of a header, or the header of the data.
pub(crate) fn other_of_pair(path: &Path) -> PathBuf {
    let (lower, upper) = if extension_of(path) == "hdr" {
        ("img", "IMG")
    } else {
        ("hdr", "HDR")
    };
    let plain = path.with_extension(lower);
    if plain.exists() {
        plain
    } else {
        path.with_extension(upper)
    }
}

/// Reads a pair of files, of which either is named: the header in `.hdr`, the data in `.img`.
pub(crate) fn decode_pair(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let other = bytes_of(&other_of_pair(path))?;
    let (header, data) = if extension_of(path) == "hdr" {
        (bytes, &*other)
    } else {
        (&*other, bytes)
    };
    let header = Header::parse(header, path)?;
    let offset = header.stated_offset;
    if !(0.0..=MAX_OFFSET).contains(&offset) {
        return Err(file(path).malformed(format!("its data start at byte {offset}")));
    }
    let data = data.get(offset as usize..).unwrap_or(&[]);
    header.volume(path)?.stored(data, Storage::Raw, file(path))
}

fn file(path: &Path) -> Packed<'_> {
    Packed {
        path,
        format: "NIfTI",
    }
}

/// The parts of a header that matter here, as the NIfTI standards name them.
#[derive(Clone, Debug, Default)]
struct Header {
    /// 0 for NIfTI-1 and ANALYZE, 1 for NIfTI-2.
    version: usize,
    little_endian: bool,
    /// Samples along each axis.
    dim: Vec<u64>,
    datatype: i64,
    pixdim: [f64; 4],
    stated_offset: f64,
    /// Slope and shift.
    scaling: (f64, f64),
    xyzt_units: u8,
    qform_code: i64,
    sform_code: i64,
    quatern: [f64; 3],
    qoffset: [f64; 3],
    srow: [[f64; 4]; 3],
}

/// Reads numbers at positions of a header that is long enough.
struct Numbers<'a> {
    bytes: &'a [u8],
    little_endian: bool,
}

impl Numbers<'_> {
    fn at(&self, numbers: NumberType, position: usize) -> f64 {
        let bytes = self.bytes.get(position..position + numbers.width());
        let found = bytes.map(|bytes| Values::new(numbers.decode(bytes, self.little_endian)));
        found.map_or(0.0, |found| found.get(0))
    }

    fn row<const N: usize>(&self, numbers: NumberType, position: usize) -> [f64; N] {
        std::array::from_fn(|k| self.at(numbers, position + k * numbers.width()))
    }
}

/// The byte order and the version of a header, by the length that it states.
fn version(bytes: &[u8]) -> Option<(bool, usize)> {
    [true, false].into_iter().find_map(|little_endian| {
        let numbers = Numbers {
            bytes,
            little_endian,
        };
        let length = numbers.at(NumberType::I32, 0);
        let version = LENGTHS.iter().position(|&n| n as f64 == length)?;
        Some((little_endian, version))
    })
}

impl Header {
    fn parse(bytes: &[u8], path: &Path) -> Result<Self, InputError> {
        let bytes = take(bytes, LENGTHS[0], path).map(|_| bytes)?;
        let (little_endian, version) = version(bytes)
            .ok_or_else(|| file(path).malformed("its header does not state its own length"))?;
        let numbers = Numbers {
            bytes,
            little_endian,
        };
        take(bytes, LENGTHS[version], path)?;
        let magic = if version == 0 {
            &bytes[344..348]
        } else {
            &bytes[4..8]
        };
        let known: [&[u8]; 2] = if version == 0 {
            [b"n+1\0", b"ni1\0"]
        } else {
            [b"n+2\0", b"ni2\0"]
        };
        // ANALYZE has no sign; only pairs of files may lack it.
        let pair = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("hdr") || e.eq_ignore_ascii_case("img"));
        let analyze = version == 0 && pair && !known.contains(&magic);
        if !analyze && !known.contains(&magic) {
            return Err(file(path).malformed("its header does not have the sign of its version"));
        }
        let mut header = if version == 0 {
            Self::first(&numbers)
        } else {
            Self::second(&numbers)
        };
        header.version = version;
        header.little_endian = numbers.little_endian;
        if analyze {
            // What NIfTI has there is other or nothing.
            header.scaling = (0.0, 0.0);
            (header.qform_code, header.sform_code, header.xyzt_units) = (0, 0, 0);
        }
        header.dim = dimensions(&numbers, version)
            .ok_or_else(|| file(path).malformed("its number of axes is not one from 1 to 7"))?;
        Ok(header)
    }

    fn first(numbers: &Numbers<'_>) -> Self {
        use NumberType::{F32, I16};
        Self {
            datatype: numbers.at(I16, 70) as i64,
            pixdim: numbers.row(F32, 76),
            stated_offset: numbers.at(F32, 108),
            scaling: (numbers.at(F32, 112), numbers.at(F32, 116)),
            xyzt_units: numbers.at(NumberType::U8, 123) as u8,
            qform_code: numbers.at(I16, 252) as i64,
            sform_code: numbers.at(I16, 254) as i64,
            quatern: numbers.row(F32, 256),
            qoffset: numbers.row(F32, 268),
            srow: [280, 296, 312].map(|position| numbers.row(F32, position)),
            ..Self::default()
        }
    }

    fn second(numbers: &Numbers<'_>) -> Self {
        use NumberType::{F64, I16, I32, I64};
        Self {
            datatype: numbers.at(I16, 12) as i64,
            pixdim: numbers.row(F64, 104),
            stated_offset: numbers.at(I64, 168),
            scaling: (numbers.at(F64, 176), numbers.at(F64, 184)),
            xyzt_units: numbers.at(I32, 500) as u8,
            qform_code: numbers.at(I32, 344) as i64,
            sform_code: numbers.at(I32, 348) as i64,
            quatern: numbers.row(F64, 352),
            qoffset: numbers.row(F64, 376),
            srow: [400, 432, 464].map(|position| numbers.row(F64, position)),
            ..Self::default()
        }
    }

    /// Where the data begin in a single file.
    fn offset(&self, path: &Path) -> Result<usize, InputError> {
        // Many writers leave out the usual place.
        let stated = self.stated_offset;
        let offset = if stated == 0.0 {
            USUAL_OFFSETS[self.version]
        } else {
            stated
        };
        if (LENGTHS[self.version] as f64..=MAX_OFFSET).contains(&offset) {
            Ok(offset as usize)
        } else {
            Err(file(path).malformed(format!("its data start at byte {offset}")))
        }
    }

    fn volume(&self, path: &Path) -> Result<Volume, InputError> {
        let (size, count) = flattened(self.dim.clone(), path)?;
        let (slope, shift) = self.scaling;
        let scaled = slope != 0.0 && slope.is_finite() && shift.is_finite();
        let n_axes = size.len();
        Ok(Volume {
            count,
            numbers: number_type(self.datatype)
                .ok_or_else(|| unread_type(self.datatype, file(path)))?,
            little_endian: self.little_endian,
            scaling: scaled.then_some((slope, shift)),
            spacing: (1..=n_axes).map(|k| self.unit() * self.pixdim[k]).collect(),
            affine: self.affine(n_axes, path)?,
            size,
        })
    }

    /// The length unit of the file in millimetres, which are the unit of files that state none.
    fn unit(&self) -> f64 {
        match self.xyzt_units & 7 {
            1 => 1e3,
            3 => 1e-3,
            _ => 1.0,
        }
    }

    /// Voxel indices to world coordinates: the sform where stated, else the qform (quaternion,
    /// handedness `pixdim[0]`), as the standard defines them.
    fn affine(&self, n_axes: usize, path: &Path) -> Result<Option<[[f64; 4]; 3]>, InputError> {
        let matrix = if self.sform_code > 0 {
            self.srow
        } else if self.qform_code > 0 {
            self.quaternion_affine()
        } else {
            return Ok(None);
        };
        let matrix = matrix.map(|row| row.map(|x| self.unit() * x));
        let square = self.quatern.iter().map(|x| x * x).sum::<f64>();
        if self.sform_code <= 0 && square > 1.0 + ROUNDING {
            return Err(file(path).malformed("its orientation is not a quaternion of length 1"));
        }
        usable_affine(matrix, n_axes, file(path)).map(Some)
    }

    fn quaternion_affine(&self) -> [[f64; 4]; 3] {
        let [b, c, d] = self.quatern;
        let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
        let rotation = [
            [
                a * a + b * b - c * c - d * d,
                2.0 * (b * c - a * d),
                2.0 * (b * d + a * c),
            ],
            [
                2.0 * (b * c + a * d),
                a * a + c * c - b * b - d * d,
                2.0 * (c * d - a * b),
            ],
            [
                2.0 * (b * d - a * c),
                2.0 * (c * d + a * b),
                a * a + d * d - b * b - c * c,
            ],
        ];
        let handedness = if self.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let spacing = [self.pixdim[1], self.pixdim[2], handedness * self.pixdim[3]];
        std::array::from_fn(|i| {
            let [x, y, z] = std::array::from_fn(|j| rotation[i][j] * spacing[j]);
            [x, y, z, self.qoffset[i]]
        })
    }
}

/// The samples along each axis; `None` unless there are one to seven axes. Sizes below 0 are 0.
fn dimensions(numbers: &Numbers<'_>, version: usize) -> Option<Vec<u64>> {
    let dim: [f64; 8] = if version == 0 {
        numbers.row(NumberType::I16, 40)
    } else {
        numbers.row(NumberType::I64, 16)
    };
    let axes = (1.0..=7.0).contains(&dim[0]).then_some(dim[0] as usize)?;
    Some(dim[1..=axes].iter().map(|&n| n as u64).collect())
}

fn number_type(code: i64) -> Option<NumberType> {
    Some(match code {
        2 => NumberType::U8,
        256 => NumberType::I8,
        4 => NumberType::I16,
        512 => NumberType::U16,
        8 => NumberType::I32,
        768 => NumberType::U32,
        1024 => NumberType::I64,
        1280 => NumberType::U64,
        16 => NumberType::F32,
        64 => NumberType::F64,
        _ => return None,
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::{AnyImage, ReadOptions, decode_image};
    use super::*;
    use std::io::Write;

    /// A little-endian file of `u8` labels.
    pub(crate) fn file(size: [u16; 3], pixdim: [f32; 3], labels: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0u8; 352];
        bytes[..4].copy_from_slice(&348i32.to_le_bytes());
        let dims = [3, size[0], size[1], size[2], 1, 1, 1, 1];
        for (k, n) in dims.iter().enumerate() {
            bytes[40 + 2 * k..42 + 2 * k].copy_from_slice(&n.to_le_bytes());
        }
        bytes[70..72].copy_from_slice(&2i16.to_le_bytes());
        bytes[72..74].copy_from_slice(&8i16.to_le_bytes());
        for (k, h) in [1.0, pixdim[0], pixdim[1], pixdim[2]].iter().enumerate() {
            bytes[76 + 4 * k..80 + 4 * k].copy_from_slice(&f32::to_le_bytes(*h));
        }
        bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
        bytes[344..348].copy_from_slice(b"n+1\0");
        bytes.extend(labels);
        bytes
    }

    fn volume(bytes: &[u8], name: &str, label: Option<i64>) -> super::super::Image<3> {
        let invert = false;
        let options = ReadOptions { label, invert };
        match decode_image(bytes, Path::new(name), &options).unwrap() {
            AnyImage::D3(image) => image,
            AnyImage::D2(_) => panic!("the file holds a volume"),
        }
    }

    #[test]
    fn labels_and_spacing_are_read_plain_and_compressed() {
        let labels = [0, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 2];
        let plain = file([3, 2, 2], [1.0, 1.5, 2.0], &labels);
        let image = volume(&plain, "v.nii", None);
        assert_eq!(image.size, [3, 2, 2]);
        assert_eq!(image.spacing, [1.0, 1.5, 2.0]);
        assert_eq!(image.values.iter().sum::<f64>(), 3.0);
        assert_eq!(image.values.get(image.index([2, 1, 1])), 1.0);
        let two = volume(&plain, "v.nii", Some(2));
        assert_eq!(two.values.iter().sum::<f64>(), 2.0);
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packer.write_all(&plain).unwrap();
        let packed = packer.finish().unwrap();
        assert_eq!(volume(&packed, "v.nii.gz", None).values, image.values);
        let cut = decode_image(
            &packed[..packed.len() / 2],
            Path::new("v.nii.gz"),
            &ReadOptions::default(),
        );
        assert!(matches!(cut, Err(InputError::Truncated { .. })), "{cut:?}");
    }

    #[test]
    fn checksums_are_verified() {
        let options = ReadOptions::default();
        let read = |bytes: &[u8]| decode_image(bytes, Path::new("v.nii.gz"), &options);
        // Stored, not compressed: a flipped bit of the data is found by the checksum alone.
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
        let labels: Vec<u8> = (0..125).map(|k| u8::from(k == 62)).collect();
        packer.write_all(&file([5; 3], [1.0; 3], &labels)).unwrap();
        let packed = packer.finish().unwrap();
        assert!(read(&packed).is_ok());
        let padded = [&packed[..], &[0; 512]].concat();
        assert!(read(&padded).is_ok());
        let end = packed.len();
        for place in [end - 20, end - 6, end - 2] {
            let mut flipped = packed.clone();
            flipped[place] ^= 1;
            let result = read(&flipped);
            assert!(
                matches!(result, Err(InputError::Malformed { .. })),
                "{result:?}"
            );
        }
        for missing in [1, 7] {
            let result = read(&packed[..end - missing]);
            assert!(
                matches!(result, Err(InputError::Truncated { .. })),
                "{result:?}"
            );
        }
    }

    #[test]
    fn a_bad_voxel_size_is_refused() {
        for h in [0.0, -1.0, f32::NAN] {
            let bytes = file([2, 2, 2], [1.0, h, 1.0], &[0, 1, 0, 0, 0, 0, 0, 0]);
            let result = decode_image(&bytes, Path::new("v.nii"), &ReadOptions::default());
            assert!(
                matches!(result, Err(InputError::Spacing { .. })),
                "{result:?}"
            );
        }
    }

    #[test]
    fn orientations_are_checked() {
        let usual = Header {
            sform_code: 1,
            srow: [
                [2.0, 0.0, 0.0, -9.0],
                [0.0, 2.0, 0.0, 1.0],
                [0.0, 0.0, -3.0, 1.0],
            ],
            ..Header::default()
        };
        let path = Path::new("v.nii");
        assert!(usual.affine(3, path).unwrap().is_some());
        let changed = |change: fn(&mut Header)| {
            let mut header = usual.clone();
            change(&mut header);
            header.affine(3, path).unwrap_err().to_string()
        };
        assert!(changed(|h| h.srow[1] = [0.0; 4]).contains("no length"));
        assert!(changed(|h| h.srow[1][1] = 3e38).contains("1e9 mm"));
        assert!(changed(|h| h.srow[1][1] = f64::NAN).contains("finite"));
        assert!(changed(|h| h.srow[0][1] = 50.0).contains("singular"));
        let turned = |h: &mut Header| {
            (h.sform_code, h.qform_code) = (0, 1);
            h.quatern = [9.0; 3];
        };
        assert!(changed(turned).contains("quaternion"));
    }

    #[test]
    fn lengths_are_millimetres_whatever_the_unit_of_the_file() {
        let labels = [0, 1, 0, 0, 0, 0, 0, 0];
        for (code, unit) in [(0, 1.0), (1, 1e3), (2, 1.0), (3, 1e-3)] {
            let mut bytes = file([2; 3], [1.0, 1.5, 2.0], &labels);
            bytes[123] = code;
            // An sform: the axes along y, x and z, with an origin.
            bytes[254..256].copy_from_slice(&1i16.to_le_bytes());
            let rows = [
                [0.0, 1.5, 0.0, 7.0],
                [1.0, 0.0, 0.0, 8.0],
                [0.0, 0.0, 2.0, 9.0f32],
            ];
            for (k, number) in rows.iter().flatten().enumerate() {
                bytes[280 + 4 * k..284 + 4 * k].copy_from_slice(&number.to_le_bytes());
            }
            let image = volume(&bytes, "v.nii", None);
            let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
            assert!(close(image.spacing[2], 2.0 * unit), "{code}");
            let world = image.in_world().unwrap();
            assert!(close(world.origin[1], 8.0 * unit) && close(world.spacing[1], 1.5 * unit));
            assert_eq!(world.direction.unwrap()[1], [1.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn the_place_of_the_data_may_be_left_out() {
        let mut bytes = file([2, 2, 2], [1.0; 3], &[0, 1, 0, 0, 0, 0, 0, 0]);
        bytes[108..112].copy_from_slice(&0f32.to_le_bytes());
        assert_eq!(volume(&bytes, "v.nii", None).values.get(1), 1.0);
    }

    #[test]
    fn a_half_turn_quaternion_gives_its_matrix() {
        let header = Header {
            quatern: [0.0, 0.0, 1.0],
            pixdim: [-1.0, 2.0, 3.0, 4.0],
            qoffset: [5.0, 0.0, 0.0],
            ..Header::default()
        };
        let expected = [
            [-2.0, 0.0, 0.0, 5.0],
            [0.0, -3.0, 0.0, 0.0],
            [0.0, 0.0, -4.0, 0.0],
        ];
        assert_eq!(header.quaternion_affine(), expected);
    }

    /// The same volume as NIfTI-2 of one byte order.
    fn second(size: [i64; 3], labels: &[u8], little_endian: bool) -> Vec<u8> {
        let mut bytes = vec![0u8; 544];
        let mut put = |at: usize, little: &[u8]| {
            let mut number = little.to_vec();
            if !little_endian {
                number.reverse();
            }
            bytes[at..at + number.len()].copy_from_slice(&number);
        };
        put(0, &540i32.to_le_bytes());
        put(12, &2i16.to_le_bytes());
        for (k, n) in [3, size[0], size[1], size[2], 1, 1, 1, 1]
            .iter()
            .enumerate()
        {
            put(16 + 8 * k, &n.to_le_bytes());
        }
        for (k, h) in [1.0, 1.5, 2.0, 3.0f64].iter().enumerate() {
            put(104 + 8 * k, &h.to_le_bytes());
        }
        put(168, &544i64.to_le_bytes());
        put(348, &1i32.to_le_bytes());
        let rows = [
            0.0, 0.0, 3.0, 1.0, 1.5, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, 4.0f64,
        ];
        for (k, x) in rows.iter().enumerate() {
            put(400 + 8 * k, &x.to_le_bytes());
        }
        bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        bytes.extend(labels);
        bytes
    }

    #[test]
    fn the_second_version_is_read_in_both_byte_orders() {
        let labels = [0, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 2];
        for little_endian in [true, false] {
            let image = volume(&second([3, 2, 2], &labels, little_endian), "v.nii", Some(2));
            assert_eq!((image.size, image.spacing), ([3, 2, 2], [1.5, 2.0, 3.0]));
            assert_eq!(image.affine.unwrap()[1], [1.5, 0.0, 0.0, 2.0]);
            assert_eq!(image.values.iter().sum::<f64>(), 2.0);
        }
        let cut = decode_image(
            &second([3, 2, 2], &labels, true)[..500],
            Path::new("v.nii"),
            &ReadOptions::default(),
        );
        assert!(matches!(cut, Err(InputError::Truncated { .. })), "{cut:?}");
    }

    #[test]
    fn a_pair_of_files_is_read_by_either_name() {
        let folder = tempfile::tempdir().unwrap();
        let labels = [0, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 2];
        let whole = file([3, 2, 2], [1.0, 1.5, 2.0], &labels);
        for sign in [b"ni1\0", b"\0\0\0\0"] {
            let mut header = whole[..348].to_vec();
            header[108..112].copy_from_slice(&0f32.to_le_bytes());
            header[344..348].copy_from_slice(sign);
            let [hdr, img] = ["v.hdr", "v.img"].map(|name| folder.path().join(name));
            std::fs::write(&hdr, &header).unwrap();
            std::fs::write(&img, labels).unwrap();
            for path in [&hdr, &img] {
                let image = super::super::read_image(path, &ReadOptions::default()).unwrap();
                let AnyImage::D3(image) = image else {
                    panic!("three axes")
                };
                assert_eq!(image.spacing, [1.0, 1.5, 2.0]);
                assert_eq!(image.values.iter().sum::<f64>(), 3.0);
            }
            std::fs::remove_file(&img).unwrap();
            let lost = super::super::read_image(&hdr, &ReadOptions::default());
            assert!(
                matches!(lost, Err(InputError::Unreadable { .. })),
                "{lost:?}"
            );
        }
    }
}
