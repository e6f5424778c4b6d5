//! Volumes of plain numbers behind a header: what NIfTI, NRRD and MetaImage have in common.

use std::fmt::Display;
use std::path::{Component, Path, PathBuf};

use super::decode::{Samples, check_size, take};
use super::number::{Meaning, NumberType};
use super::packed::Packed;
use super::values::{Step, Values};
use super::world::affine_fault;
use super::{InputError, bytes_of, reserve};

/// Headers of text may not be longer than this.
pub(crate) const MAX_HEADER: usize = 1 << 20;

/// The numbers of a file, as its header describes them.
pub(crate) struct Volume {
    /// Samples along each axis, `x` first, without trailing axes of one sample.
    pub size: Vec<usize>,
    pub count: usize,
    pub numbers: NumberType,
    pub little_endian: bool,
    /// Slope and shift of the numbers, where they are scaled.
    pub scaling: Option<(f64, f64)>,
    /// Spacing along each axis, `x` first.
    pub spacing: Vec<f64>,
    /// Sample indices to world coordinates.
    pub affine: Option<[[f64; 4]; 3]>,
}

/// How the numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    Raw,
    Gzip,
    Zlib,
}

/// A size without trailing axes of one sample, and the number of all samples.
pub(crate) fn flattened(
    mut size: Vec<u64>,
    path: &Path,
) -> Result<(Vec<usize>, usize), InputError> {
    while size.len() > 2 && size.last() == Some(&1) {
        size.pop();
    }
    let count = check_size(&size, path)?;
    Ok((size.into_iter().map(|n| n as usize).collect(), count))
}

impl Volume {
    /// Bytes of all numbers.
    pub fn data_bytes(&self) -> usize {
        self.count * self.numbers.width()
    }

    /// The samples from the stored bytes.
    pub fn stored(
        self,
        bytes: &[u8],
        storage: Storage,
        file: Packed<'_>,
    ) -> Result<Samples, InputError> {
        let length = self.data_bytes();
        // A byte more for a mask of them.
        let kept = length as u64;
        let values = kept + self.count as u64;
        if storage == Storage::Raw {
            let data = take(bytes, length, file.path)?;
            reserve(file.path, values, kept)?;
            return Ok(self.decode(data));
        }
        reserve(file.path, file.check(length, bytes)? + values, kept)?;
        let unpacked = match storage {
            Storage::Zlib => file.zlib(bytes, length)?,
            _ => file.gzip(bytes, length)?,
        };
        Ok(self.decode(take(&unpacked, length, file.path)?))
    }

    /// The samples from bytes of which there are enough.
    pub fn decode(self, data: &[u8]) -> Samples {
        let mut values = Values::new(self.numbers.decode(data, self.little_endian));
        if let Some((slope, shift)) = self.scaling.filter(|scaling| *scaling != (1.0, 0.0)) {
            values.then(Step::Scaled(slope, shift));
        }
        let whole = |(slope, shift): (f64, f64)| (slope.fract(), shift.fract()) == (0.0, 0.0);
        let meaning = match self.numbers {
            NumberType::F32 | NumberType::F64 => Meaning::Real { labels: true },
            _ if self.scaling.is_none_or(whole) => Meaning::Labels,
            _ => Meaning::Real { labels: true },
        };
        Samples {
            values,
            size: self.size,
            meaning,
            spacing: self.spacing,
            affine: self.affine,
            plain_array: false,
        }
    }
}

/// The error for numbers of a type that is not read.
pub(crate) fn unread_type(kind: impl Display, file: Packed<'_>) -> InputError {
    file.malformed(format!(
        "it holds numbers of the type {kind}, which is not read"
    ))
}

/// An affine map of `n_axes` axes, if it can be used.
pub(crate) fn usable_affine(
    affine: [[f64; 4]; 3],
    n_axes: usize,
    file: Packed<'_>,
) -> Result<[[f64; 4]; 3], InputError> {
    match affine_fault(&affine, n_axes) {
        None => Ok(affine),
        Some(reason) => Err(file.malformed(reason)),
    }
}

/// The file that a header names: one in the folder of the header, or below it.
pub(crate) fn data_file(header: &Path, name: &str) -> Option<PathBuf> {
    let below = Path::new(name)
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    (!name.is_empty() && below).then(|| header.with_file_name(name))
}

/// The bytes of the file that a header names.
pub(crate) fn data_of(header: Packed<'_>, name: &str) -> Result<Vec<u8>, InputError> {
    let path = data_file(header.path, name).ok_or_else(|| {
        header.malformed(format!(
            "its data are in '{name}', which is not a file in its folder"
        ))
    })?;
    bytes_of(&path)
}

/// The affine map of samples to RAS, from the vectors between samples along the axes and the
/// position of the first sample in a space with other signs.
pub(crate) fn in_space(vectors: &[[f64; 3]], origin: [f64; 3], signs: [f64; 3]) -> [[f64; 4]; 3] {
    std::array::from_fn(|i| {
        let [x, y, z] = std::array::from_fn(|j| {
            let vector = vectors.get(j).map_or(0.0, |vector| vector[i]);
            // Zero has no sign.
            signs[i] * vector + 0.0
        });
        [x, y, z, signs[i] * origin[i] + 0.0]
    })
}
