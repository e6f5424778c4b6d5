//! Images that are carried, and how they are written.

use std::path::{Path, PathBuf};

use shapespace_input::{Sources, extension_of};
use shapespace_picture::png::{BitDepth, ColorType, encode};

use super::command::Interpolation;
use super::draw;
use super::points::Moved;
use super::route::WorldMap;
use super::samples::{Between, Side, beyond_box, carried};
use crate::error::CliError;
use crate::output::nifti::{Values, write_volume};
use crate::output::npy::write_samples;
use crate::output::{OutputError, ResultDir};
use shapespace_input::lattice::Lattice;

/// Carries an image from the first side to the second, by a map and that of the way back, and writes it:
/// volumes in the world as NIfTI, pictures of whole numbers as PNG, and others as arrays.
///
/// # Errors
/// Those of reading and writing, and [`CliError::Option`] for an image with other samples.
pub(super) fn carried_image(
    (path, stem): (&Path, &str),
    directory: &ResultDir,
    ([from, to], [there, back], small): ([&Side; 2], [&WorldMap; 2], f64),
    interpolation: Option<Interpolation>,
) -> Result<Moved, CliError> {
    let image = Sources::files().read_numbers(path)?;
    let lattice = from.lattice_of(path, &image)?;
    let target = to.target();
    let whole = image.are_whole();
    let between = between(image.are_labels(), interpolation);
    let lost = if image.are_labels() {
        beyond_box((&image, &lattice), there, small)
    } else {
        // Other images reach beyond their objects as a rule.
        [0, 0]
    };
    let found = carried((&image, &lattice), (&target, back), between, small);
    let size = std::array::from_fn(|k| image.size.get(k).copied().unwrap_or(1));
    let pictures = draw::images((&image.values, size), (&found.values, target.size));
    let written = Written {
        stem,
        target: &target,
        array: extension_of(path) == "npy",
        whole,
    };
    let name = if to.in_world() {
        written.volume(directory, &found.values)?
    } else {
        written.picture(directory, found.values)?
    };
    Ok(Moved {
        name,
        what: match between {
            Between::Nearest => "labels",
            Between::Linear => "image",
        },
        unit: "samples",
        count: target.count(),
        pictures: Some(pictures),
        inexact: found.inexact,
        outside: lost[0],
        lost: lost[0] as f64 / lost[1].max(1) as f64,
    })
}

/// Whole numbers are taken from the nearest sample unless asked otherwise.
pub(crate) fn between(labels: bool, interpolation: Option<Interpolation>) -> Between {
    match interpolation {
        Some(Interpolation::Nearest) => Between::Nearest,
        None if labels => Between::Nearest,
        Some(Interpolation::Linear) | None => Between::Linear,
    }
}

/// An image that is written.
struct Written<'a> {
    stem: &'a str,
    target: &'a Lattice,
    /// Whether it came as an array.
    array: bool,
    /// Whether its numbers were whole.
    whole: bool,
}

impl Written<'_> {
    fn volume(&self, directory: &ResultDir, values: &[f32]) -> Result<PathBuf, CliError> {
        let name = PathBuf::from(format!("{}.nii.gz", self.stem));
        let file = directory.file(&name);
        match bytes(values) {
            Some(bytes) => write_volume(&file, self.target, &Values::Mask(&bytes))?,
            None => write_volume(&file, self.target, &Values::Numbers(values))?,
        }
        Ok(name)
    }

    /// A flat image, or a volume without a place.
    fn picture(&self, directory: &ResultDir, mut values: Vec<f32>) -> Result<PathBuf, CliError> {
        let [nx, ny, nz] = self.target.size;
        let flat = nz == 1;
        let grey = |value: &f32| (0.0..=f32::from(u16::MAX)).contains(value);
        if flat && !self.array && self.whole && values.iter().all(grey) {
            for value in &mut values {
                *value = value.round();
            }
            let (depth, samples) = if let Some(bytes) = bytes(&values) {
                (BitDepth::Eight, bytes)
            } else {
                let pairs = values
                    .iter()
                    .flat_map(|&value| (value as u16).to_be_bytes());
                (BitDepth::Sixteen, pairs.collect())
            };
            let name = PathBuf::from(format!("{}.png", self.stem));
            let file = directory.file(&name);
            let picture = encode([nx, ny], (ColorType::Grayscale, depth), &samples);
            let written = picture.and_then(|bytes| std::fs::write(&file, bytes));
            written.map_err(OutputError::at(&file))?;
            return Ok(name);
        }
        let name = PathBuf::from(format!("{}.npy", self.stem));
        let size: &[usize] = if flat { &[nx, ny] } else { &[nx, ny, nz] };
        write_samples(&directory.file(&name), size, &values)?;
        Ok(name)
    }
}

/// The values as bytes, if they are.
fn bytes(values: &[f32]) -> Option<Vec<u8>> {
    let byte = |&value: &f32| (f32::from(value as u8) == value).then_some(value as u8);
    values.iter().map(byte).collect()
}
