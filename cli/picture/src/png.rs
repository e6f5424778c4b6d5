//! Pictures as PNG files.

use std::io;

pub use ::png::{BitDepth, ColorType};

/// The file of a picture, row by row from the top; samples of two bytes have the larger one first.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] and the like where the size does not fit the samples.
pub fn encode(
    size: [usize; 2],
    (colour, depth): (ColorType, BitDepth),
    samples: &[u8],
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size[0] as u32, size[1] as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(::png::Compression::Fast);
    encoder.set_filter(::png::Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(samples)?;
    writer.finish()?;
    Ok(bytes)
}
