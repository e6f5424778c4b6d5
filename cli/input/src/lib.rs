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

mod arrangement;
mod boundary;
pub mod bytes;
mod content;
mod curves;
mod decode;
pub mod dimension;
mod endings;
mod error;
mod exact;
pub mod files;
mod filled;
mod folder;
mod format;
pub mod frame;
mod grey;
mod image;
pub mod lattice;
mod levels;
mod limits;
mod mask;
pub mod memory;
mod merge;
mod mesh;
mod metaimage;
mod nearby;
mod nifti;
mod npy;
mod nrrd;
mod number;
mod outline;
mod packed;
mod parts;
pub mod place;
mod raster;
mod read;
mod resolve;
mod sources;
pub mod terminal;
mod tiff;
mod values;
mod volume;
pub mod whole;
mod winding;
mod world;

pub use boundary::boundary;
pub(crate) use content::reserve;
pub use content::{bytes_of, extension_of};
pub use decode::check_count;
pub use endings::without_ending;
pub use error::{InputError, size_text};
pub use exact::{decode_mesh, decode_outline, read_mesh, read_outline, read_point_array};
pub use filled::Filled;
pub use folder::Kinds;
pub use folder::expand;
pub(crate) use format::decode_samples;
pub use format::{decode_array, decode_grey_image, decode_image};
pub use grey::GreyRange;
pub use image::{AnyImage, AnyImages, Image, LEVEL, ReadOptions, block};
pub use levels::grey_share;
pub use limits::MAX_VALUES;
pub use mesh::{Mesh, is_mesh};
pub use parts::files_of;
pub use read::{read_array, read_grey_images, read_image, read_images};
pub use sources::{ArrayType, NamedArray, Numbers, Sources};
pub use values::Values;
pub use winding::Fill;
