//! Reads masks and grey images: files of several formats are converted to images with values in
//! `[0, 1]`.
//!
//! **Axes.** An array is stored as `[y][x]` or `[z][y][x]`, the last axis running fastest. The
//! last axis is `x`: axis 0 of an [`Image`]. Row 0 of a picture file is `y = 0`, so that the `y`
//! axis points down in a picture and a `.npy` array and a PNG of the same numbers are the same
//! image. NIfTI volumes are stored `i` fastest, and `i` is `x`.
//!
//! **Values.** The object is where the value exceeds 1/2; see [`ReadOptions`] for how the numbers
//! of a file become values.

#![forbid(unsafe_code)]

mod bmp;
mod boundary;
pub mod bytes;
mod curves;
mod decode;
pub mod dimension;
mod error;
mod exact;
pub mod files;
mod folder;
pub mod frame;
mod grey;
mod jpeg;
pub mod lattice;
mod levels;
mod mask;
pub mod memory;
mod mesh;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod number;
mod outline;
mod packed;
pub mod place;
mod pnm;
mod raster;
mod sources;
pub mod terminal;
mod tiff;
mod volume;
mod winding;
mod world;

use std::path::{Path, PathBuf};

pub use boundary::boundary;
pub use error::InputError;
pub use exact::read_mesh;
pub use folder::Kinds;
pub use folder::expand;
pub use grey::GreyRange;
pub use levels::grey_share;
pub use mesh::{Mesh, is_mesh};
pub use sources::{ArrayType, NamedArray, Sources};

use levelset::Contour;

use dimension::Dim;
use exact::is_exact;
use lattice::Lattice;
use raster::Colours;

/// No input may have more values than this (2 GiB in double precision).
pub const MAX_VALUES: u64 = 1 << 28;

/// The value that separates the object from the rest.
pub const LEVEL: f64 = 0.5;

/// How the numbers of a file are converted to values in `[0, 1]`.
///
/// Without a label: numbers of exactly two levels become 0 and 1; 8-bit and 16-bit images are
/// divided by their full range (numbers that are only 0 and 1 stay); floating-point numbers must
/// lie in `[0, 1]` already. In volumes of integers every number but 0 is the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The object is where the number equals this label.
    pub label: Option<i64>,
    /// The object is dark, and the background bright.
    pub invert: bool,
}

/// A sampled image with values in `[0, 1]`. Sample `i` stands for the box of one spacing about
/// the point `origin + i * spacing`.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<const D: usize> {
    /// The values, `x` fastest.
    pub values: Vec<f64>,
    /// Samples along each axis, `x` first.
    pub size: [usize; D],
    /// Distance of neighbouring samples along each axis, in the units of the file.
    pub spacing: [f64; D],
    /// Position of sample 0.
    pub origin: [f64; D],
    /// The file.
    pub path: PathBuf,
    /// Affine map from sample indices to world coordinates (rows of a 3x4 matrix), if the file
    /// states it.
    pub affine: Option<[[f64; 4]; 3]>,
    /// Directions of the axes in the world, row by row, for an image that is placed in the world
    /// ([`Image::in_world`]): then sample `i` stands for the box about
    /// `direction (i * spacing) + origin`, in millimetres.
    pub direction: Option<[[f64; D]; D]>,
    /// Whether the values are the unchanged numbers of the file, so that they can be used as nodal
    /// values.
    pub plain_array: bool,
    /// The exact boundary in (fractional) sample indices, where the file has one; the values are
    /// then samples of what it encloses.
    pub outline: Option<Contour<D>>,
    /// What was mended when the file was read.
    pub remark: Option<String>,
}

impl<const D: usize> Image<D> {
    /// Position in memory of a sample.
    pub fn index(&self, sample: [usize; D]) -> usize {
        (0..D)
            .rev()
            .fold(0, |index, k| index * self.size[k] + sample[k])
    }

    /// The sample at a position in memory.
    pub fn sample(&self, mut index: usize) -> [usize; D] {
        self.size.map(|n| {
            let i = index % n;
            index /= n;
            i
        })
    }

    /// First and last sample of the object along each axis, or `None` where there is no object.
    pub fn object_bounds(&self) -> Option<[[usize; 2]; D]> {
        let mut bounds: Option<[[usize; 2]; D]> = None;
        for (index, &value) in self.values.iter().enumerate() {
            if value > LEVEL {
                let sample = self.sample(index);
                let bounds = bounds.get_or_insert_with(|| sample.map(|i| [i, i]));
                for k in 0..D {
                    bounds[k] = [bounds[k][0].min(sample[k]), bounds[k][1].max(sample[k])];
                }
            }
        }
        bounds
    }
}

/// Returns an image that is 1 from one sample to another along each axis, both included, and 0
/// elsewhere.
pub fn block<const D: usize>(
    size: [usize; D],
    spacing: [f64; D],
    low: [usize; D],
    high: [usize; D],
) -> Image<D> {
    let mut image = Image {
        values: vec![0.0; size.iter().product()],
        size,
        spacing,
        origin: [0.0; D],
        path: "block".into(),
        affine: None,
        direction: None,
        plain_array: false,
        outline: None,
        remark: None,
    };
    for index in 0..image.values.len() {
        let sample = image.sample(index);
        if (0..D).all(|k| (low[k]..=high[k]).contains(&sample[k])) {
            image.values[index] = 1.0;
        }
    }
    image
}

/// An image of either dimension.
pub type AnyImage = Dim<Image<2>, Image<3>>;

/// Images of one dimension.
pub type AnyImages = Dim<Vec<Image<2>>, Vec<Image<3>>>;

/// Reads one mask.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn read_image(path: &Path, options: &ReadOptions) -> Result<AnyImage, InputError> {
    Sources::files().read_image(path, options)
}

/// Reads grey images, as [`Sources::read_grey_images`].
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn read_grey_images(paths: &[PathBuf]) -> Result<(AnyImages, Vec<GreyRange>), InputError> {
    Sources::files().read_grey_images(paths)
}

/// The numbers of a volume as they are, and their place in the world.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// The numbers, `x` fastest.
    pub values: Vec<f64>,
    /// Their lattice.
    pub lattice: Lattice,
}

/// The bytes of a regular file, for which there is memory.
///
/// # Errors
/// [`InputError::Unreadable`], [`InputError::Memory`].
pub fn bytes_of(path: &Path) -> Result<Vec<u8>, InputError> {
    let unreadable = |source| InputError::Unreadable {
        path: path.into(),
        source,
    };
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    reserve(path, length, 0)?;
    files::read(path, length).map_err(unreadable)
}

/// Asks for the memory of an input before it is allocated: so many bytes, of which some are kept.
fn reserve(path: &Path, needed: u64, kept: u64) -> Result<(), InputError> {
    memory::reserve(needed, kept).map_err(|shortage| InputError::Memory {
        path: path.into(),
        needed: shortage.needed,
        limit: shortage.limit,
    })
}

/// Reads one mask from the bytes of a file; the name determines the format.
///
/// # Errors
/// As [`read_image`].
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

/// The extension of a file, in small letters; empty where there is none.
pub fn extension_of(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}

fn decode_samples(
    bytes: &[u8],
    path: &Path,
    colours: Colours,
) -> Result<decode::Samples, InputError> {
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

/// Reads an array of numbers that the program has written: its size, the last axis first, and its
/// values in memory order.
///
/// # Errors
/// [`InputError`] for files that are no arrays, and values that are not finite.
pub fn read_array(path: &Path) -> Result<(Vec<usize>, Vec<f64>), InputError> {
    decode_array(&bytes_of(path)?, path)
}

/// The same from the bytes of a file.
///
/// # Errors
/// As [`read_array`].
pub fn decode_array(bytes: &[u8], path: &Path) -> Result<(Vec<usize>, Vec<f64>), InputError> {
    let samples = npy::decode(bytes, path)?;
    if let Some(index) = samples.values.iter().position(|value| !value.is_finite()) {
        return Err(InputError::NotFinite {
            path: path.into(),
            value: samples.values[index],
            position: vec![index],
        });
    }
    Ok((samples.size, samples.values))
}

/// Reads masks that all have the same number of axes.
///
/// # Errors
/// As [`read_image`], and [`InputError::MixedDimensions`].
pub fn read_images(paths: &[PathBuf], options: &ReadOptions) -> Result<AnyImages, InputError> {
    Sources::files().read_images(paths, options)
}

fn same_dimension(images: Vec<AnyImage>) -> Result<AnyImages, InputError> {
    let (mut flat, mut solid) = (Vec::new(), Vec::new());
    for image in images {
        match image {
            AnyImage::D2(image) => flat.push(image),
            AnyImage::D3(image) => solid.push(image),
        }
    }
    match (flat.first(), solid.first()) {
        (Some(flat), Some(solid)) => Err(InputError::MixedDimensions {
            flat: flat.path.clone(),
            solid: solid.path.clone(),
        }),
        (None, Some(_)) => Ok(AnyImages::D3(solid)),
        _ => Ok(AnyImages::D2(flat)),
    }
}
