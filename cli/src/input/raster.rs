//! PNG, PNM and BMP pictures at their native depth.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use super::InputError;
use super::decode::{Meaning, Samples, check_size};

/// No lossless picture format packs more bytes of pixels than this into one byte of file.
const MOST_COMPRESSION: u64 = 4096;
const MAX_ALLOC: u64 = 1 << 30;

/// Reads a picture: its transparency where that varies, else its grey value.
pub(super) fn decode(bytes: &[u8], path: &Path, extension: &str) -> Result<Samples, InputError> {
    let (format, name) = match extension {
        "png" => (ImageFormat::Png, "PNG"),
        "bmp" => (ImageFormat::Bmp, "BMP"),
        _ => (ImageFormat::Pnm, "PNM"),
    };
    let failed = |error: ImageError| failure(&error, bytes.len(), path, name);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_ALLOC);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(&[width.into(), height.into()], path)?;
    let expected = decoder.total_bytes() / MOST_COMPRESSION;
    if expected > bytes.len() as u64 {
        return Err(InputError::Truncated {
            path: path.into(),
            expected,
            found: bytes.len() as u64,
        });
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let (channels, full) = channels(&picture);
    let values = one_channel(&channels, picture.color().channel_count().into(), full)
        .ok_or_else(|| InputError::Colour { path: path.into() })?;
    Ok(Samples {
        values,
        size: vec![width as usize, height as usize],
        meaning: Meaning::Grey(full),
        spacing: vec![1.0; 2],
        affine: None,
        plain_array: false,
    })
}

fn failure(error: &ImageError, found: usize, path: &Path, format: &'static str) -> InputError {
    let reason = match error {
        ImageError::Limits(_) => "it is too large".to_owned(),
        ImageError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => {
            format!("it is cut off after {found} bytes")
        }
        other => other.to_string(),
    };
    InputError::Malformed {
        path: path.into(),
        format,
        reason,
    }
}

/// All numbers, channel fastest, and the number of full white.
fn channels(picture: &DynamicImage) -> (Vec<f64>, f64) {
    let from_u8 = |data: &[u8]| data.iter().copied().map(f64::from).collect();
    let from_u16 = |data: &[u16]| data.iter().copied().map(f64::from).collect();
    match picture {
        DynamicImage::ImageLuma8(p) => (from_u8(p), 255.0),
        DynamicImage::ImageLumaA8(p) => (from_u8(p), 255.0),
        DynamicImage::ImageRgb8(p) => (from_u8(p), 255.0),
        DynamicImage::ImageRgba8(p) => (from_u8(p), 255.0),
        DynamicImage::ImageLuma16(p) => (from_u16(p), 65535.0),
        DynamicImage::ImageLumaA16(p) => (from_u16(p), 65535.0),
        DynamicImage::ImageRgb16(p) => (from_u16(p), 65535.0),
        DynamicImage::ImageRgba16(p) => (from_u16(p), 65535.0),
        other => {
            let wide = other.to_rgba16();
            (from_u16(&wide), 65535.0)
        }
    }
}

/// One number a pixel out of 1 to 4 channels: transparency where it varies, else grey. `None` for
/// a coloured picture, unless it has two colours only, which make a mask as well.
pub(super) fn one_channel(data: &[f64], channels: usize, full: f64) -> Option<Vec<f64>> {
    let pixels = || data.chunks_exact(channels);
    if matches!(channels, 2 | 4) {
        let alpha: Vec<f64> = pixels().map(|p| p[channels - 1]).collect();
        if alpha.iter().any(|a| *a != alpha[0]) {
            return Some(alpha);
        }
    }
    if channels <= 2 {
        return Some(pixels().map(|p| p[0]).collect());
    }
    if pixels().all(|p| p[0] == p[1] && p[1] == p[2]) {
        return Some(pixels().map(|p| p[0]).collect());
    }
    let mut colours = BTreeSet::new();
    for p in pixels() {
        colours.insert([p[0] as u64, p[1] as u64, p[2] as u64]);
        if colours.len() > 2 {
            return None;
        }
    }
    // Two colours: the lighter one is the object.
    let luminance = |p: &[f64]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    let lightest = pixels().map(luminance).fold(0.0, f64::max);
    Some(
        pixels()
            .map(|p| if luminance(p) == lightest { full } else { 0.0 })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparency_wins_where_it_varies() {
        let cut_out = [9.0, 9.0, 9.0, 0.0, 9.0, 9.0, 9.0, 255.0];
        assert_eq!(one_channel(&cut_out, 4, 255.0).unwrap(), [0.0, 255.0]);
        let opaque = [0.0, 255.0, 255.0, 255.0];
        assert_eq!(one_channel(&opaque, 2, 255.0).unwrap(), [0.0, 255.0]);
    }

    #[test]
    fn two_colours_are_a_mask_and_three_are_not() {
        let two = [128.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(one_channel(&two, 3, 255.0).unwrap(), [255.0, 0.0]);
        let three = [128.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0];
        assert!(one_channel(&three, 3, 255.0).is_none());
    }
}
