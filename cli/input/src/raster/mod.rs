//! PNG, JPEG, PNM and BMP pictures at their native depth.

mod bmp;
mod jpeg;
mod orientation;
mod pnm;

use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Transformations};

use crate::decode::{Samples, check_size};
use crate::number::Meaning;
use crate::values::{self, Values};
use crate::{InputError, reserve};

/// No lossless picture format packs more bytes of pixels than this into one byte of file.
const MOST_COMPRESSION: usize = 4096;
const MAX_ALLOC: usize = 1 << 30;

/// The pixels of a picture, row 0 first.
pub(crate) struct Pixels {
    /// Pixels along each axis, `x` first.
    pub size: [usize; 2],
    /// Numbers a pixel: grey, grey and alpha, colours, or colours and alpha.
    pub channels: usize,
    /// All numbers.
    pub numbers: Numbers,
    /// The colours of a picture that has stored their numbers.
    pub palette: Vec<[u8; 3]>,
}

/// What becomes of coloured pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colours {
    /// They are refused, unless they are masks or label images of few colours.
    Refused,
    /// They are read as their luminance.
    Luminance,
}

/// The numbers of a picture, channel fastest; the greatest one of their type is full white.
#[derive(Debug, PartialEq)]
pub(crate) enum Numbers {
    Bytes(Vec<u8>),
    Words(Vec<u16>),
}

/// Reads a picture: its transparency where that varies, else its grey value, else the numbers of its
/// colours where these are stored. Grey images, and masks in black and white, keep what is drawn in them, before their
/// median grey or black where they are transparent.
pub(crate) fn decode(
    bytes: &[u8],
    path: &Path,
    extension: &str,
    colours: Colours,
) -> Result<Samples, InputError> {
    let picture = match extension {
        "png" => png(bytes, path),
        "jpg" | "jpeg" => jpeg::decode(bytes, path),
        "bmp" => bmp::decode(bytes, path),
        _ => pnm::decode(bytes, path),
    }?;
    let channels = picture.channels;
    // Whatever the colours: two of them would make a mask of the lighter one.
    if let Numbers::Bytes(numbers) = &picture.numbers
        && colours == Colours::Refused
        && !transparency_varies(numbers, channels)
        && !is_grey(numbers, channels)
        && let Some(numbers) = colour_numbers(numbers, channels, &picture.palette)
    {
        let values = Values::new(values::Numbers::U8(numbers));
        return Ok(samples(values, picture.size, Meaning::Labels));
    }
    let drawn = match &picture.numbers {
        Numbers::Bytes(numbers) => drawn(numbers, channels, 255, colours),
        Numbers::Words(numbers) => drawn(numbers, channels, u16::MAX, colours),
    };
    let (mut values, full) = match &picture.numbers {
        Numbers::Bytes(_) if drawn.is_some() => (drawn.map(values::Numbers::F64), 255.0),
        Numbers::Words(_) if drawn.is_some() => (drawn.map(values::Numbers::F64), 65535.0),
        Numbers::Bytes(numbers) => {
            let values = one_channel(numbers, channels, 255);
            (values.map(values::Numbers::U8), 255.0)
        }
        Numbers::Words(numbers) => {
            let values = one_channel(numbers, channels, u16::MAX);
            (values.map(values::Numbers::U16), 65535.0)
        }
    };
    if values.is_none() && colours == Colours::Luminance {
        values = Some(values::Numbers::F64(match &picture.numbers {
            Numbers::Bytes(numbers) => luminances(numbers, channels),
            Numbers::Words(numbers) => luminances(numbers, channels),
        }));
    }
    let values = values
        .map(Values::new)
        .ok_or_else(|| InputError::Colour { path: path.into() })?;
    Ok(samples(values, picture.size, Meaning::Grey(full)))
}

fn samples(values: Values, size: [usize; 2], meaning: Meaning) -> Samples {
    Samples {
        values,
        size: size.to_vec(),
        meaning,
        spacing: vec![1.0; 2],
        affine: None,
        plain_array: false,
    }
}

/// Asks for the memory of a picture: so many bytes while it is decoded, and its values of so many bytes
/// each.
pub(crate) fn reserve_pixels(
    path: &Path,
    n_pixels: usize,
    bytes: usize,
    decoded: usize,
) -> Result<(), InputError> {
    let values = (bytes * n_pixels) as u64;
    // A byte more for a mask of them.
    reserve(path, values + (n_pixels + decoded) as u64, values)
}

/// Pixels of fewer than 8 bits and those of a palette become numbers of 8 bits.
fn png(bytes: &[u8], path: &Path) -> Result<Pixels, InputError> {
    let malformed = |reason: String| InputError::Malformed {
        path: path.into(),
        format: "PNG",
        reason,
    };
    let failed = |error: DecodingError| malformed(failure(&error, bytes.len()));
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: MAX_ALLOC });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(failed)?;
    let (width, height) = reader.info().size();
    check_size(&[width.into(), height.into()], path)?;
    let palette = match (reader.info().color_type, &reader.info().palette) {
        // The decoder panics at one that ends within a colour.
        (ColorType::Indexed, Some(palette)) if palette.is_empty() || palette.len() % 3 != 0 => {
            let reason = format!(
                "its palette has {} bytes, not three a colour",
                palette.len()
            );
            return Err(malformed(reason));
        }
        (ColorType::Indexed, Some(palette)) => palette.as_chunks().0.to_vec(),
        _ => Vec::new(),
    };
    let length = reader.output_buffer_size();
    let length = length.filter(|&n| n <= MAX_ALLOC);
    let length = length.ok_or_else(|| malformed("it is too large".into()))?;
    check_compression(length, bytes.len(), path)?;
    // Numbers of 16 bits are put in order in a second array.
    let n_pixels = width as usize * height as usize;
    // Grey values of colours take eight bytes.
    let bytes = if reader.output_color_type().0.samples() > 2 {
        size_of::<f64>()
    } else {
        size_of::<u16>()
    };
    reserve_pixels(path, n_pixels, bytes, 2 * length)?;
    let mut data = vec![0; length];
    let frame = reader.next_frame(&mut data).map_err(failed)?;
    let numbers = if frame.bit_depth == BitDepth::Sixteen {
        let numbers = data.as_chunks().0.iter();
        Numbers::Words(numbers.map(|&raw| u16::from_be_bytes(raw)).collect())
    } else {
        Numbers::Bytes(data)
    };
    Ok(Pixels {
        size: [width as usize, height as usize],
        channels: frame.color_type.samples(),
        numbers,
        palette,
    })
}

/// Checks that this number of bytes of pixels is possible for a file of this length.
pub(crate) fn check_compression(
    pixels: usize,
    found: usize,
    path: &Path,
) -> Result<(), InputError> {
    let expected = pixels / MOST_COMPRESSION;
    if expected > found {
        return Err(InputError::Truncated {
            path: path.into(),
            expected: expected as u64,
            found: found as u64,
        });
    }
    Ok(())
}

fn failure(error: &DecodingError, found: usize) -> String {
    match error {
        DecodingError::LimitsExceeded => "it is too large".to_owned(),
        DecodingError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => {
            format!("it is cut off after {found} bytes")
        }
        other => other.to_string(),
    }
}

/// One number a pixel out of 1 to 4 channels: transparency where it varies, else grey. `None` for
/// a coloured picture, unless it has two colours only, which make a mask as well.
pub(crate) fn one_channel<T: Copy + Default + PartialOrd + Into<f64>>(
    data: &[T],
    channels: usize,
    full: T,
) -> Option<Vec<T>> {
    let pixels = || data.chunks_exact(channels);
    let channel = |k: usize| Some(pixels().map(|p| p[k]).collect());
    if transparency_varies(data, channels) {
        return channel(channels - 1);
    }
    if is_grey(data, channels) {
        return channel(0);
    }
    let mut colours: Vec<[f64; 3]> = Vec::new();
    for p in pixels() {
        let colour = [p[0], p[1], p[2]].map(Into::into);
        if !colours.contains(&colour) {
            colours.push(colour);
        }
        if colours.len() > 2 {
            return None;
        }
    }
    // Two colours: the lighter one is the object.
    let lightest = colours.iter().copied().map(luminance).fold(0.0, f64::max);
    let value = |p: &[T]| {
        let is_light = luminance([p[0], p[1], p[2]].map(Into::into)) == lightest;
        if is_light { full } else { T::default() }
    };
    Some(pixels().map(value).collect())
}

/// The luminance of a picture, if its transparency varies and it is not only cut out: a grey image whose opaque pixels
/// differ, before their median, which makes no edge where there is none; or a mask whose opaque pixels are black and
/// white, before black.
fn drawn<T: Copy + PartialEq + Default + Into<f64>>(
    data: &[T],
    channels: usize,
    full: T,
    colours: Colours,
) -> Option<Vec<f64>> {
    if !transparency_varies(data, channels) {
        return None;
    }
    let value = |p: &[T]| match *p {
        [grey, _] => grey.into(),
        [r, g, b, _] => luminance([r.into(), g.into(), b.into()]),
        _ => 0.0,
    };
    let mut opaque = data
        .chunks_exact(channels)
        .filter(|p| p[channels - 1] == full)
        .map(|p| &p[..channels - 1]);
    let first = opaque.clone().next()?;
    let is_drawn = match colours {
        Colours::Luminance => opaque.any(|p| p != first),
        Colours::Refused => {
            let [black, white] = [T::default(), full]
                .map(|level| opaque.clone().any(|p| p.iter().all(|x| *x == level)));
            black && white && opaque.all(|p| p.iter().all(|x| [T::default(), full].contains(x)))
        }
    };
    if !is_drawn {
        return None;
    }
    let pixels = || data.chunks_exact(channels);
    let behind = match colours {
        Colours::Refused => 0.0,
        Colours::Luminance => {
            let seen = pixels().filter(|p| p[channels - 1] == full);
            let mut seen: Vec<f64> = seen.map(value).collect();
            let middle = seen.len() / 2;
            *seen.select_nth_unstable_by(middle, f64::total_cmp).1
        }
    };
    let over = |p: &[T]| {
        let opacity = p[channels - 1].into() / full.into();
        opacity * value(p) + (1.0 - opacity) * behind
    };
    Some(pixels().map(over).collect())
}

/// Whether there is transparency, and not the same everywhere.
fn transparency_varies<T: Copy + PartialEq>(data: &[T], channels: usize) -> bool {
    if !matches!(channels, 2 | 4) {
        return false;
    }
    let mut alpha = data.chunks_exact(channels).map(|p| p[channels - 1]);
    let first = alpha.next();
    alpha.any(|a| Some(a) != first)
}

/// Whether no pixel has a colour.
fn is_grey<T: PartialEq>(data: &[T], channels: usize) -> bool {
    let mut pixels = data.chunks_exact(channels);
    channels <= 2 || pixels.all(|p| p[0] == p[1] && p[1] == p[2])
}

/// The luminance of a colour, from linear coefficients (ITU-R BT.709).
fn luminance(p: [f64; 3]) -> f64 {
    0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]
}

fn luminances<T: Copy + Into<f64>>(data: &[T], channels: usize) -> Vec<f64> {
    let pixels = data.chunks_exact(channels);
    pixels
        .map(|p| luminance([p[0], p[1], p[2]].map(Into::into)))
        .collect()
}

/// For every pixel the number of its colour in a palette; `None` without one.
fn colour_numbers(data: &[u8], channels: usize, palette: &[[u8; 3]]) -> Option<Vec<u8>> {
    if palette.is_empty() || channels < 3 {
        return None;
    }
    let pixels = data.chunks_exact(channels);
    pixels
        .map(|p| {
            let number = palette.iter().position(|colour| p[..3] == colour[..]);
            // A palette has at most 256 colours.
            number.and_then(|number| u8::try_from(number).ok())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_colours_are_labels() {
        let palette = [[0, 0, 0], [128, 0, 0], [0, 128, 0]];
        let data = [0, 128, 0, 0, 0, 0, 128, 0, 0];
        let numbers = colour_numbers(&data, 3, &palette);
        assert_eq!(numbers, Some(vec![2, 0, 1]));
        assert_eq!(colour_numbers(&data, 3, &[]), None);
        assert_eq!(colour_numbers(&data, 3, &palette[..2]), None);
        let grey = luminances(&data, 3);
        assert!((grey[0] - 0.7152 * 128.0).abs() < 1e-12 && grey[1] == 0.0);
    }

    /// Also of two colours, of which the lighter one is the background.
    #[test]
    fn pictures_with_a_palette_are_label_images() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_palette(vec![255, 255, 255, 200, 0, 0]);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[0, 1, 0, 0]).unwrap();
        writer.finish().unwrap();
        let read = |colours| decode(&bytes, Path::new("a.png"), "png", colours).unwrap();
        let labels = read(Colours::Refused);
        assert!(matches!(labels.meaning, Meaning::Labels));
        assert_eq!(
            labels.values.iter().collect::<Vec<_>>(),
            [0.0, 1.0, 0.0, 0.0]
        );
        assert!(matches!(read(Colours::Luminance).meaning, Meaning::Grey(_)));
    }

    /// Found by fuzzing: the decoder panics.
    #[test]
    fn a_palette_that_ends_within_a_colour_is_malformed() {
        for length in [4, 5, 265] {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
            encoder.set_color(ColorType::Indexed);
            encoder.set_palette(vec![9u8; length]);
            encoder.set_trns(vec![0u8]);
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(&[0, 0, 0, 0]).unwrap();
            writer.finish().unwrap();
            let found = png(&bytes, Path::new("a.png"));
            let Err(InputError::Malformed { reason, .. }) = found else {
                panic!("{length} bytes are read");
            };
            assert!(reason.contains("palette"), "{reason}");
        }
    }

    #[test]
    fn transparency_wins_where_it_varies() {
        let cut_out = [9u8, 9, 9, 0, 9, 9, 9, 255];
        assert_eq!(one_channel(&cut_out, 4, 255).unwrap(), [0, 255]);
        let opaque = [0u8, 255, 255, 255];
        assert_eq!(one_channel(&opaque, 2, 255).unwrap(), [0, 255]);
    }

    /// What is drawn in a picture is not lost where it has a transparent margin, too.
    #[test]
    fn what_is_drawn_before_a_transparent_margin_is_kept() {
        let drawing = [255u8, 255, 0, 255, 255, 0];
        let found = drawn(&drawing, 2, 255, Colours::Refused).unwrap();
        assert_eq!(found, [255.0, 0.0, 0.0]);
        let grey = [80u8, 255, 20, 255, 40, 255, 255, 0, 80, 51];
        let found = drawn(&grey, 2, 255, Colours::Luminance).unwrap();
        assert_eq!(found, [80.0, 20.0, 40.0, 40.0, 48.0]);
        // A mask of what is cut out, of whatever colours; and of one that is all that is seen.
        assert!(drawn(&grey, 2, 255, Colours::Refused).is_none());
        for colours in [Colours::Refused, Colours::Luminance] {
            let cut_out = [9u8, 9, 9, 0, 9, 9, 9, 255, 9, 9, 9, 255];
            assert!(drawn(&cut_out, 4, 255, colours).is_none());
            assert!(drawn(&drawing[..2], 2, 255, colours).is_none());
        }
    }

    #[test]
    fn two_colours_are_a_mask_and_three_are_not() {
        let two = [128u8, 0, 0, 0, 0, 0];
        assert_eq!(one_channel(&two, 3, 255).unwrap(), [255, 0]);
        let three = [128u8, 0, 0, 0, 0, 0, 1, 2, 3];
        assert!(one_channel(&three, 3, 255).is_none());
    }
}
