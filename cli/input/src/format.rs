//! From the bytes of a file to an image: the name determines the format.

use std::path::Path;

use crate::content::extension_of;
use crate::decode::Samples;
use crate::error::InputError;
use crate::exact::{self, is_exact};
use crate::grey::{self, GreyRange};
use crate::image::{AnyImage, ReadOptions};
use crate::raster::{self, Colours};
use crate::{mask, metaimage, nifti, npy, nrrd, tiff};

/// Reads one mask from the bytes of a file; the name determines the format.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn decode_image(
    bytes: &[u8],
    path: &Path,
    options: &ReadOptions,
) -> Result<AnyImage, InputError> {
    let extension = extension_of(path);
    if is_exact(&extension) {
        if options.label.is_some() || options.invert {
            return Err(InputError::NoLabels { path: path.into() });
        }
        return exact::decode_image(bytes, path, &extension);
    }
    let samples = decode_samples(bytes, path, Colours::Refused)?;
    mask::into_image(samples, path, options)
}

/// Reads a grey image from the bytes of a file; the name determines the format.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn decode_grey_image(bytes: &[u8], path: &Path) -> Result<(AnyImage, GreyRange), InputError> {
    grey::into_grey_image(decode_samples(bytes, path, Colours::Luminance)?, path)
}

/// The numbers of a file as they are.
pub(crate) fn decode_samples(
    bytes: &[u8],
    path: &Path,
    colours: Colours,
) -> Result<Samples, InputError> {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    match extension {
        "npy" => npy::decode(bytes, path),
        "nii" => nifti::decode(bytes, path),
        "gz" if name.ends_with(".nii.gz") => nifti::decode_compressed(bytes, path),
        "hdr" | "img" => nifti::decode_pair(bytes, path),
        "nrrd" | "nhdr" => nrrd::decode(bytes, path),
        "mha" | "mhd" => metaimage::decode(bytes, path),
        "tif" | "tiff" => tiff::decode(bytes, path),
        "png" | "jpg" | "jpeg" | "pgm" | "pbm" | "ppm" | "pnm" | "bmp" => {
            raster::decode(bytes, path, extension, colours)
        }
        _ if is_exact(extension) => Err(InputError::NoImage { path: path.into() }),
        _ => Err(InputError::UnknownFormat { path: path.into() }),
    }
}

/// The array in the bytes of a file that the program has written: its size, the last axis first, and
/// its values in memory order.
///
/// # Errors
/// [`InputError`] for files that are no arrays, and values that are not finite.
pub fn decode_array(bytes: &[u8], path: &Path) -> Result<(Vec<usize>, Vec<f64>), InputError> {
    let samples = npy::decode(bytes, path)?;
    if let Some(index) = samples.values.iter().position(|value| !value.is_finite()) {
        return Err(InputError::NotFinite {
            path: path.into(),
            value: samples.values.get(index),
            position: vec![index],
        });
    }
    Ok((samples.size, samples.values.into_vec()))
}
