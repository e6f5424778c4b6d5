//! Pictures as PNG files.

use std::io;

/// The file of a picture of 8-bit samples, row by row from the top.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] and the like where the size does not fit the samples.
pub fn encode(size: [usize; 2], colour: ::png::ColorType, samples: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size[0] as u32, size[1] as u32);
    encoder.set_color(colour);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(::png::Compression::Fast);
    encoder.set_filter(::png::Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(samples)?;
    writer.finish()?;
    Ok(bytes)
}
