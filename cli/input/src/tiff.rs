//! TIFF pictures, and stacks of pages as volumes (page 0 is `z = 0`).

use std::io::Cursor;
use std::path::Path;

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};

use super::InputError;
use super::decode::{Samples, check_size};
use super::number::Meaning;
use super::raster::{one_channel, reserve_pixels};
use super::values::{Numbers, Values};

const MAX_PAGES: usize = 1 << 14;
const MAX_ALLOC: usize = 1 << 30;
/// No lossless compression of TIFF packs more bytes of pixels than this into one byte of file.
const MOST_COMPRESSION: u64 = 4096;

/// Reads all pages.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let malformed = |reason: String| InputError::Malformed {
        path: path.into(),
        format: "TIFF",
        reason,
    };
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_ALLOC;
    limits.intermediate_buffer_size = MAX_ALLOC;
    let mut decoder = Decoder::new(Cursor::new(bytes))
        .map_err(|e| malformed(e.to_string()))?
        .with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(|e| malformed(e.to_string()))?;
    let mut values: Option<Numbers> = None;
    let mut pages = 0;
    let meaning = loop {
        let size = decoder.dimensions().map_err(|e| malformed(e.to_string()))?;
        if size != (width, height) {
            return Err(malformed(format!("page {pages} has another size")));
        }
        check_claim(size, pages, bytes.len(), path)?;
        let color = decoder.colortype().map_err(|e| malformed(e.to_string()))?;
        let (channels, bits) =
            layout(color).ok_or_else(|| malformed(format!("{color:?} pixels")))?;
        let n_pixels = width as usize * height as usize;
        // Bits are unpacked into bytes, and the values of a page are added to those before.
        let width_of_value = usize::from(bits.max(8)) / 8;
        let decoded = n_pixels * (channels + 2) * width_of_value;
        reserve_pixels(path, n_pixels, width_of_value, decoded)?;
        let data = decoder.read_image().map_err(|e| malformed(e.to_string()))?;
        let (page, kind) = page_values(data, bits, width as usize, channels);
        let page = page.ok_or_else(|| InputError::Colour { path: path.into() })?;
        if page.len() != n_pixels {
            return Err(malformed("a page has too few pixels".into()));
        }
        match &mut values {
            None => values = Some(page),
            Some(before) => before.append(page),
        }
        pages += 1;
        if !decoder.more_images() {
            break kind;
        }
        if pages == MAX_PAGES {
            return Err(malformed(format!("it has more than {MAX_PAGES} pages")));
        }
        decoder.next_image().map_err(|e| malformed(e.to_string()))?;
    };
    let mut size = vec![width as usize, height as usize];
    if pages > 1 {
        size.push(pages);
    }
    let values = values.ok_or_else(|| malformed("it has no page".into()))?;
    Ok(Samples {
        values: Values::new(values),
        spacing: vec![1.0; size.len()],
        size,
        meaning,
        affine: None,
        plain_array: false,
    })
}

fn check_claim(size: (u32, u32), page: usize, found: usize, path: &Path) -> Result<(), InputError> {
    let (width, height) = (u64::from(size.0), u64::from(size.1));
    check_size(&[width, height], path)?;
    if page > 0 {
        check_size(&[width, height, page as u64 + 1], path)?;
    }
    let expected = width * height / (8 * MOST_COMPRESSION);
    if expected > found as u64 {
        return Err(InputError::Truncated {
            path: path.into(),
            expected,
            found: found as u64,
        });
    }
    Ok(())
}

fn layout(color: ColorType) -> Option<(usize, u8)> {
    match color {
        ColorType::Gray(bits) => Some((1, bits)),
        ColorType::GrayA(bits) => Some((2, bits)),
        ColorType::RGB(bits) => Some((3, bits)),
        ColorType::RGBA(bits) => Some((4, bits)),
        _ => None,
    }
}

/// One number a pixel, `None` for colours; and their interpretation.
fn page_values(
    data: DecodingResult,
    bits: u8,
    width: usize,
    channels: usize,
) -> (Option<Numbers>, Meaning) {
    let real = Meaning::Real { labels: false };
    macro_rules! of {
        ($type:ident, $numbers:expr, $full:expr, $meaning:expr) => {{
            let values = one_channel(&$numbers, channels, $full);
            (values.map(Numbers::$type), $meaning)
        }};
    }
    match data {
        DecodingResult::U8(v) if bits < 8 => {
            let full = u8::MAX >> (8 - bits);
            let grey = Meaning::Grey(full.into());
            of!(U8, unpacked(&v, bits, width * channels), full, grey)
        }
        DecodingResult::U8(v) => of!(U8, v, u8::MAX, Meaning::Grey(255.0)),
        DecodingResult::U16(v) => of!(U16, v, u16::MAX, Meaning::Grey(65535.0)),
        DecodingResult::U32(v) => of!(U32, v, 1, Meaning::Labels),
        DecodingResult::U64(v) => {
            let wide: Vec<f64> = v.into_iter().map(|x| x as f64).collect();
            of!(F64, wide, 1.0, Meaning::Labels)
        }
        DecodingResult::F16(v) => {
            let wide: Vec<f32> = v.into_iter().map(f32::from).collect();
            of!(F32, wide, 1.0, real)
        }
        DecodingResult::F32(v) => of!(F32, v, 1.0, real),
        DecodingResult::F64(v) => of!(F64, v, 1.0, real),
        DecodingResult::I8(v) => of!(I8, v, 1, Meaning::Labels),
        DecodingResult::I16(v) => of!(I16, v, 1, Meaning::Labels),
        DecodingResult::I32(v) => of!(I32, v, 1, Meaning::Labels),
        DecodingResult::I64(v) => {
            let wide: Vec<f64> = v.into_iter().map(|x| x as f64).collect();
            of!(F64, wide, 1.0, Meaning::Labels)
        }
    }
}

/// Grey values of 1, 2 or 4 bits, each row starting at a byte.
fn unpacked(bytes: &[u8], bits: u8, width: usize) -> Vec<u8> {
    let per_byte = usize::from(8 / bits.max(1));
    let mask = (1u32 << bits) - 1;
    let row_bytes = width.div_ceil(per_byte).max(1);
    bytes
        .chunks(row_bytes)
        .flat_map(|row| {
            (0..width.min(row.len() * per_byte)).map(move |x| {
                let shift = 8 - u32::from(bits) * (x % per_byte + 1) as u32;
                (u32::from(row[x / per_byte]) >> shift & mask) as u8
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::tiff::encoder::{TiffEncoder, colortype};

    fn stack<C>(pages: &[Vec<C::Inner>]) -> Vec<u8>
    where
        C: colortype::ColorType,
        [C::Inner]: ::tiff::encoder::TiffValue,
    {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
        for page in pages {
            encoder.write_image::<C>(3, 2, page).unwrap();
        }
        bytes.into_inner()
    }

    #[test]
    fn pages_of_every_depth_are_read() {
        let path = Path::new("a.tif");
        let eight = decode(
            &stack::<colortype::Gray8>(&[vec![0, 255, 9, 0, 0, 1]]),
            path,
        )
        .unwrap();
        assert_eq!(eight.size, [3, 2]);
        assert_eq!(eight.values, [0.0, 255.0, 9.0, 0.0, 0.0, 1.0]);
        let deep = stack::<colortype::Gray16>(&[vec![0, 65535, 900, 0, 0, 1]]);
        assert_eq!(decode(&deep, path).unwrap().meaning, Meaning::Grey(65535.0));
        let page = vec![0.0f32, 1.0, 0.5, 0.0, 0.25, 1.0];
        let volume = decode(
            &stack::<colortype::Gray32Float>(&[page.clone(), page]),
            path,
        )
        .unwrap();
        assert_eq!(volume.size, [3, 2, 2]);
        assert_eq!(volume.values.get(7), 1.0);
    }

    #[test]
    fn packed_bits_unpack_row_by_row() {
        assert_eq!(
            unpacked(&[0b1010_0000, 0b0110_0000], 1, 3),
            [1, 0, 1, 0, 1, 1]
        );
        assert_eq!(unpacked(&[0x12, 0x30], 4, 3), [1, 2, 3]);
    }
}
