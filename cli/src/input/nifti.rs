//! NIfTI-1 volumes, plain or compressed.

use std::io::Read;
use std::path::Path;

use ::nifti::{Endianness, NiftiHeader, NiftiType};
use flate2::bufread::{GzDecoder, MultiGzDecoder};

use super::decode::{Meaning, NumberType, Samples, VALUE, check_size, take};
use super::world::affine_fault;
use super::{InputError, reserve};

const HEADER_BYTES: usize = 348;
/// Where the data begin in a file that does not state it: after the header and four bytes.
const USUAL_OFFSET: f32 = 352.0;
/// DEFLATE packs no more bytes than this into one.
const MOST_COMPRESSION: usize = 1032;
/// How every stream of gzip begins.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// No more bytes than this may follow the data.
const MOST_AFTER: usize = 1 << 26;
/// Extensions between header and data may not be longer than this.
const MAX_OFFSET: f32 = (1 << 26) as f32;

/// Reads an uncompressed volume.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let header = parse_header(bytes, path)?;
    let layout = Layout::new(&header, path)?;
    let data = bytes.get(layout.offset..).unwrap_or(&[]);
    let data = take(data, layout.data_bytes(), path)?;
    let values = VALUE * layout.count as u64;
    reserve(path, values, values)?;
    layout.decode(data, &header, path)
}

/// Reads a compressed volume, once it is known how much is to be unpacked.
pub(super) fn decode_compressed(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let head = unpack_start(bytes, HEADER_BYTES, path)?;
    let layout = Layout::new(&parse_header(&head, path)?, path)?;
    let length = layout.offset + layout.data_bytes();
    // No more than this is unpacked from a byte.
    take_claim(length, MOST_COMPRESSION * bytes.len(), path)?;
    let unpacked = (length + MOST_AFTER.min(length)) as u64;
    reserve(path, unpacked + VALUE * layout.count as u64, 0)?;
    decode(&unpack(bytes, length, path)?, path)
}

/// Checks that a file of this length can hold as much as its header states.
fn take_claim(expected: usize, most: usize, path: &Path) -> Result<(), InputError> {
    if expected <= most {
        return Ok(());
    }
    Err(InputError::Truncated {
        path: path.into(),
        expected: expected as u64,
        found: most as u64,
    })
}

/// The first bytes of a compressed file.
fn unpack_start(bytes: &[u8], length: usize, path: &Path) -> Result<Vec<u8>, InputError> {
    let mut unpacked = Vec::new();
    let mut all = MultiGzDecoder::new(bytes).take(length as u64);
    let read = all.read_to_end(&mut unpacked);
    read.map_err(|error| unpacking(&error, length, unpacked.len(), path))?;
    Ok(unpacked)
}

/// The first bytes of a compressed file, all of which is unpacked, so that its checksums are
/// verified.
fn unpack(bytes: &[u8], length: usize, path: &Path) -> Result<Vec<u8>, InputError> {
    // No more than is needed: vectors that grow take up to twice their length.
    let mut unpacked = Vec::with_capacity(length);
    let mut rest = bytes;
    // Several streams may follow each other; what follows the last is padding.
    while rest.starts_with(&GZIP) {
        let mut stream = GzDecoder::new(rest);
        let most = length + MOST_AFTER - unpacked.len();
        let read = stream
            .by_ref()
            .take(most as u64 + 1)
            .read_to_end(&mut unpacked);
        let read = read.map_err(|error| unpacking(&error, length, unpacked.len(), path))?;
        if read > most {
            let reason = format!("it has more than the {length} bytes that its header states");
            return Err(malformed(path, &reason));
        }
        rest = stream.into_inner();
    }
    unpacked.truncate(length);
    Ok(unpacked)
}

fn unpacking(error: &std::io::Error, expected: usize, found: usize, path: &Path) -> InputError {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        InputError::Truncated {
            path: path.into(),
            expected: expected as u64,
            found: found as u64,
        }
    } else {
        malformed(path, &error.to_string())
    }
}

fn malformed(path: &Path, reason: &str) -> InputError {
    InputError::Malformed {
        path: path.into(),
        format: "NIfTI",
        reason: reason.into(),
    }
}

fn parse_header(bytes: &[u8], path: &Path) -> Result<NiftiHeader, InputError> {
    let bytes = take(bytes, HEADER_BYTES, path)?;
    let header = NiftiHeader::from_reader(bytes).map_err(|e| malformed(path, &e.to_string()))?;
    if header.sizeof_hdr != HEADER_BYTES as i32 {
        return Err(malformed(path, "its header does not state its own length"));
    }
    Ok(header)
}

/// Where the numbers are and how many.
struct Layout {
    size: Vec<usize>,
    count: usize,
    offset: usize,
    numbers: NumberType,
}

impl Layout {
    fn new(header: &NiftiHeader, path: &Path) -> Result<Self, InputError> {
        let dim = header.dim().map_err(|e| malformed(path, &e.to_string()))?;
        let mut size: Vec<u64> = dim.iter().map(|&n| n.into()).collect();
        while size.len() > 2 && size.last() == Some(&1) {
            size.pop();
        }
        let count = check_size(&size, path)?;
        // Many writers leave out the usual place.
        let stated = header.vox_offset;
        let offset = if stated == 0.0 { USUAL_OFFSET } else { stated };
        if !(HEADER_BYTES as f32..=MAX_OFFSET).contains(&offset) {
            return Err(malformed(path, &format!("its data start at byte {offset}")));
        }
        Ok(Self {
            size: size.into_iter().map(|n| n as usize).collect(),
            count,
            offset: offset as usize,
            numbers: number_type(header, path)?,
        })
    }

    fn data_bytes(&self) -> usize {
        self.count * self.numbers.width()
    }

    fn decode(self, data: &[u8], header: &NiftiHeader, path: &Path) -> Result<Samples, InputError> {
        let little_endian = header.endianness == Endianness::Little;
        let mut values = self.numbers.decode(data, little_endian);
        let (slope, shift) = (f64::from(header.scl_slope), f64::from(header.scl_inter));
        let scaled = slope != 0.0 && slope.is_finite() && shift.is_finite();
        if scaled && (slope, shift) != (1.0, 0.0) {
            for v in &mut values {
                *v = slope * *v + shift;
            }
        }
        let n_axes = self.size.len();
        let spacing = (0..n_axes)
            .map(|k| unit(header) * f64::from(header.pixdim[k + 1]))
            .collect();
        let meaning = match self.numbers {
            NumberType::F32 | NumberType::F64 => Meaning::Real { labels: true },
            _ if scaled && (slope.fract(), shift.fract()) != (0.0, 0.0) => {
                Meaning::Real { labels: true }
            }
            _ => Meaning::Labels,
        };
        Ok(Samples {
            values,
            size: self.size,
            meaning,
            spacing,
            affine: affine(header, n_axes, path)?,
            plain_array: false,
        })
    }
}

fn number_type(header: &NiftiHeader, path: &Path) -> Result<NumberType, InputError> {
    let stated = header
        .data_type()
        .map_err(|e| malformed(path, &e.to_string()))?;
    Ok(match stated {
        NiftiType::Uint8 => NumberType::U8,
        NiftiType::Int8 => NumberType::I8,
        NiftiType::Uint16 => NumberType::U16,
        NiftiType::Int16 => NumberType::I16,
        NiftiType::Uint32 => NumberType::U32,
        NiftiType::Int32 => NumberType::I32,
        NiftiType::Uint64 => NumberType::U64,
        NiftiType::Int64 => NumberType::I64,
        NiftiType::Float32 => NumberType::F32,
        NiftiType::Float64 => NumberType::F64,
        other => return Err(malformed(path, &format!("it holds {other:?} numbers"))),
    })
}

/// Voxel indices to world coordinates: the sform where stated, else the qform (quaternion,
/// handedness `pixdim[0]`), as the NIfTI-1 standard defines them.
fn affine(
    header: &NiftiHeader,
    n_axes: usize,
    path: &Path,
) -> Result<Option<[[f64; 4]; 3]>, InputError> {
    let matrix = if header.sform_code > 0 {
        [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from))
    } else if header.qform_code > 0 {
        quaternion_affine(header)
    } else {
        return Ok(None);
    };
    let matrix = matrix.map(|row| row.map(|x| unit(header) * x));
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let fault = if header.sform_code <= 0 && b * b + c * c + d * d > 1.0 + 1e-3 {
        Some("its orientation is not a quaternion of length 1")
    } else {
        affine_fault(&matrix, n_axes)
    };
    match fault {
        None => Ok(Some(matrix)),
        Some(reason) => Err(malformed(path, reason)),
    }
}

/// The length unit of the file in millimetres, which are the unit of files that state none.
fn unit(header: &NiftiHeader) -> f64 {
    match header.xyzt_units & 7 {
        1 => 1e3,
        3 => 1e-3,
        _ => 1.0,
    }
}

fn quaternion_affine(header: &NiftiHeader) -> [[f64; 4]; 3] {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
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
    let handedness = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let spacing = [
        f64::from(header.pixdim[1]),
        f64::from(header.pixdim[2]),
        handedness * f64::from(header.pixdim[3]),
    ];
    let shift = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            if j < 3 {
                rotation[i][j] * spacing[j]
            } else {
                shift[i]
            }
        })
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
        match decode_image(bytes, Path::new(name), &ReadOptions { label }).unwrap() {
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
        assert_eq!(image.values[image.index([2, 1, 1])], 1.0);
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
        let usual = NiftiHeader {
            sform_code: 1,
            srow_x: [2.0, 0.0, 0.0, -9.0],
            srow_y: [0.0, 2.0, 0.0, 1.0],
            srow_z: [0.0, 0.0, -3.0, 1.0],
            ..NiftiHeader::default()
        };
        let path = Path::new("v.nii");
        assert!(affine(&usual, 3, path).unwrap().is_some());
        let changed = |change: fn(&mut NiftiHeader)| {
            let mut header = usual.clone();
            change(&mut header);
            affine(&header, 3, path).unwrap_err().to_string()
        };
        assert!(changed(|h| h.srow_y = [0.0; 4]).contains("no length"));
        assert!(changed(|h| h.srow_y[1] = 3e38).contains("finite"));
        assert!(changed(|h| h.srow_y[1] = f32::NAN).contains("finite"));
        assert!(changed(|h| h.srow_x[1] = 50.0).contains("singular"));
        let turned = |h: &mut NiftiHeader| {
            (h.sform_code, h.qform_code) = (0, 1);
            [h.quatern_b, h.quatern_c, h.quatern_d] = [9.0; 3];
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
        assert_eq!(volume(&bytes, "v.nii", None).values[1], 1.0);
    }

    #[test]
    fn a_half_turn_quaternion_gives_its_matrix() {
        let header = NiftiHeader {
            quatern_d: 1.0,
            pixdim: [-1.0, 2.0, 3.0, 4.0, 1.0, 1.0, 1.0, 1.0],
            quatern_x: 5.0,
            ..NiftiHeader::default()
        };
        let expected = [
            [-2.0, 0.0, 0.0, 5.0],
            [0.0, -3.0, 0.0, 0.0],
            [0.0, 0.0, -4.0, 0.0],
        ];
        assert_eq!(quaternion_affine(&header), expected);
    }
}
