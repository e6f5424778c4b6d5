//! NIfTI-1 files (`.nii.gz`): masks, numbers and displacement fields in the world.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::OutputError;
use shapespace_input::lattice::Lattice;

/// Bytes of the header, and of the sign that no extension follows.
const HEADER: usize = 352;
/// The intent of vectors whose components have the axes of ITK, to the left, to the back, upwards.
const VECTORS: i16 = 1007;
/// Positions are those of the scanner.
const SCANNER: i16 = 1;
/// Millimetres.
const UNIT: u8 = 2;
/// Directions are orthogonal up to this much.
const SKEWED: f64 = 1e-5;

/// The numbers of a file, `x` fastest.
pub enum Values<'a> {
    /// A mask.
    Mask(&'a [u8]),
    /// A label a sample.
    Labels(&'a [i32]),
    /// A number a sample.
    Numbers(&'a [f32]),
    /// Displacements in millimetres to the left, to the back and upwards, as ITK expects them.
    Displacements(&'a [[f32; 3]]),
}

impl Values<'_> {
    /// The code of the numbers, and bits of each.
    fn kind(&self) -> (i16, i16) {
        match self {
            Self::Mask(_) => (2, 8),
            Self::Labels(_) => (8, 32),
            Self::Numbers(_) | Self::Displacements(_) => (16, 32),
        }
    }

    fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        match self {
            Self::Mask(values) => writer.write_all(values),
            Self::Labels(values) => values
                .iter()
                .try_for_each(|value| writer.write_all(&value.to_le_bytes())),
            Self::Numbers(values) => values
                .iter()
                .try_for_each(|value| writer.write_all(&value.to_le_bytes())),
            // One component after the other.
            Self::Displacements(values) => (0..3).try_for_each(|k| {
                let mut components = values.iter().map(|vector| vector[k]);
                components.try_for_each(|value| writer.write_all(&value.to_le_bytes()))
            }),
        }
    }
}

/// Writes numbers on a lattice in the world, compressed.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_volume(
    path: &Path,
    lattice: &Lattice,
    values: &Values<'_>,
) -> Result<(), OutputError> {
    let write = || {
        let file = BufWriter::new(File::create(path)?);
        let mut packer = GzEncoder::new(file, Compression::fast());
        packer.write_all(&header(lattice, values))?;
        values.write(&mut BufWriter::with_capacity(1 << 16, &mut packer))?;
        packer.finish()?.flush()
    };
    write().map_err(OutputError::at(path))
}

fn header(lattice: &Lattice, values: &Values<'_>) -> [u8; HEADER] {
    let mut bytes = [0; HEADER];
    let mut put = |at: usize, number: &[u8]| bytes[at..at + number.len()].copy_from_slice(number);
    put(0, &348i32.to_le_bytes());
    let [nx, ny, nz] = lattice.size.map(|n| n.min(i16::MAX as usize) as i16);
    let dim = match values {
        Values::Displacements(_) => [5, nx, ny, nz, 1, 3, 1, 1],
        _ => [3, nx, ny, nz, 1, 1, 1, 1],
    };
    for (k, n) in dim.iter().enumerate() {
        put(40 + 2 * k, &n.to_le_bytes());
    }
    if matches!(values, Values::Displacements(_)) {
        put(68, &VECTORS.to_le_bytes());
    }
    let (kind, bits) = values.kind();
    put(70, &kind.to_le_bytes());
    put(72, &bits.to_le_bytes());
    let spacing = lattice.spacing();
    let rotation = quaternion(lattice);
    let handedness = rotation.map_or(1.0, |(_, handedness)| handedness);
    let pixdim = [
        handedness, spacing[0], spacing[1], spacing[2], 1.0, 1.0, 1.0, 1.0,
    ];
    for (k, h) in pixdim.iter().enumerate() {
        put(76 + 4 * k, &(*h as f32).to_le_bytes());
    }
    put(108, &(HEADER as f32).to_le_bytes());
    put(112, &1f32.to_le_bytes());
    put(123, &[UNIT]);
    if let Some((quaternion, _)) = rotation {
        put(252, &SCANNER.to_le_bytes());
        for (k, number) in quaternion.iter().enumerate() {
            put(256 + 4 * k, &(*number as f32).to_le_bytes());
        }
        for i in 0..3 {
            put(268 + 4 * i, &(lattice.affine[i][3] as f32).to_le_bytes());
        }
    }
    put(254, &SCANNER.to_le_bytes());
    for (k, number) in lattice.affine.iter().flatten().enumerate() {
        put(280 + 4 * k, &(*number as f32).to_le_bytes());
    }
    put(344, b"n+1\0");
    bytes
}

/// The last three components of the unit quaternion of a lattice at right angles, and its
/// handedness; `None` for a sheared lattice.
fn quaternion(lattice: &Lattice) -> Option<([f64; 3], f64)> {
    let spacing = lattice.spacing();
    let mut r: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| lattice.affine[i][j] / spacing[j]));
    let dot = |a: usize, b: usize| (0..3).map(|i| r[i][a] * r[i][b]).sum::<f64>();
    if [dot(0, 1), dot(0, 2), dot(1, 2)]
        .iter()
        .any(|x| x.abs() > SKEWED)
    {
        return None;
    }
    let handedness = fe_grid::tensor::determinant(&r).signum();
    for row in &mut r {
        row[2] *= handedness;
    }
    // The largest component first, which is not small.
    let squares = [
        1.0 + r[0][0] + r[1][1] + r[2][2],
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
    ];
    let largest = (0..4).max_by(|&a, &b| squares[a].total_cmp(&squares[b]))?;
    let twice = squares[largest].sqrt();
    let (sum, difference) = (
        |i: usize, j: usize| (r[i][j] + r[j][i]) / (2.0 * twice),
        |i: usize, j: usize| (r[i][j] - r[j][i]) / (2.0 * twice),
    );
    let half = 0.5 * twice;
    let [a, b, c, d] = match largest {
        0 => [half, difference(2, 1), difference(0, 2), difference(1, 0)],
        1 => [difference(2, 1), half, sum(0, 1), sum(0, 2)],
        2 => [difference(0, 2), sum(0, 1), half, sum(1, 2)],
        _ => [difference(1, 0), sum(0, 2), sum(1, 2), half],
    };
    // The first component is not stored; it is not negative.
    let sign = if a < 0.0 { -1.0 } else { 1.0 };
    Some(([b, c, d].map(|x| sign * x), handedness))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapespace_input::{AnyImage, ReadOptions, decode_image};

    fn read_back(affine: [[f64; 4]; 3], change: impl Fn(&mut [u8])) -> [[f64; 4]; 3] {
        let lattice = Lattice {
            size: [2, 3, 2],
            affine,
        };
        let mut mask = [0; 12];
        mask[7] = 1;
        let mut bytes = header(&lattice, &Values::Mask(&mask)).to_vec();
        bytes.extend(mask);
        change(&mut bytes);
        match decode_image(&bytes, Path::new("a.nii"), &ReadOptions::default()).unwrap() {
            AnyImage::D3(image) => image.affine.unwrap(),
            AnyImage::D2(_) => panic!("three axes"),
        }
    }

    #[test]
    fn both_forms_of_the_place_are_the_same() {
        let (c, s) = (0.8, 0.6);
        let cases = [
            [
                [1.0, 0.0, 0.0, 5.0],
                [0.0, 2.0, 0.0, -6.0],
                [0.0, 0.0, 3.0, 7.0],
            ],
            [
                [-1.0, 0.0, 0.0, 5.0],
                [0.0, -2.0, 0.0, -6.0],
                [0.0, 0.0, 3.0, 7.0],
            ],
            [
                [0.0, 0.0, -1.0, 5.0],
                [-2.0, 0.0, 0.0, -6.0],
                [0.0, 3.0, 0.0, 7.0],
            ],
            [
                [c, -s * c, s * s, 1.0],
                [s, c * c, -c * s, 2.0],
                [0.0, s, c, 3.0],
            ],
            [
                [-c, s * c, s * s, 1.0],
                [-s, -c * c, -c * s, 2.0],
                [0.0, -s, c, 3.0],
            ],
        ];
        for affine in cases {
            for without in [252, 254] {
                let found = read_back(affine, |bytes| bytes[without..without + 2].fill(0));
                for (a, b) in found.iter().flatten().zip(affine.iter().flatten()) {
                    // Stored in single precision.
                    assert!((a - b).abs() < 1e-5, "{found:?} {affine:?}");
                }
            }
        }
        let sheared = [
            [1.0, 0.5, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        assert_eq!(read_back(sheared, |_| ()), sheared);
    }
}
