//! BMP pictures: palettes of up to 8 bits, also as run lengths, and colours of 16, 24 or 32 bits.

use std::path::Path;

use crate::InputError;
use crate::decode::{check_size, take};
use crate::raster::{Numbers, Pixels, check_compression, reserve_pixels};

// Ways to store the pixels.
const PLAIN: u32 = 0;
const RUN_LENGTHS_8: u32 = 1;
const RUN_LENGTHS_4: u32 = 2;
const BIT_FIELDS: u32 = 3;

/// Red, green, blue and transparency.
type Pixel = [u8; 4];

const BLACK: Pixel = [0, 0, 0, 255];

struct Header<'a> {
    size: [usize; 2],
    /// Whether the first row comes first.
    top_down: bool,
    bits: usize,
    storage: u32,
    /// The bits of red, green, blue and transparency in a pixel of 16 or 32.
    masks: [u32; 4],
    palette: Vec<Pixel>,
    data: &'a [u8],
}

/// Reads a picture; every channel gets 8 bits.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Pixels, InputError> {
    let malformed = |reason: &str| InputError::Malformed {
        path: path.into(),
        format: "BMP",
        reason: reason.into(),
    };
    let header = header(bytes).ok_or_else(|| malformed("its header is damaged or cut off"))?;
    let [width, height] = header.size;
    let n_pixels = check_size(&[width as u64, height as u64], path)?;
    check_compression(3 * n_pixels, bytes.len(), path)?;
    let work = 2 * size_of::<Pixel>() * n_pixels;
    reserve_pixels(path, n_pixels, size_of::<f64>(), work)?;
    let pixels = match (header.storage, header.bits) {
        (PLAIN, 1 | 2 | 4 | 8 | 16 | 24 | 32) | (BIT_FIELDS, 16 | 32) => plain(&header, path)?,
        (RUN_LENGTHS_8, 8) | (RUN_LENGTHS_4, 4) => {
            run_lengths(&header).ok_or_else(|| malformed("its pixels are damaged or cut off"))?
        }
        (storage, bits) => {
            return Err(malformed(&format!(
                "{bits} bits a pixel, stored in way {storage}"
            )));
        }
    };
    let channels = if header.masks[3] == 0 { 3 } else { 4 };
    let place = |row: usize| {
        if header.top_down {
            row
        } else {
            height - 1 - row
        }
    };
    let in_order = (0..height).flat_map(|row| &pixels[place(row) * width..][..width]);
    let numbers = in_order.flat_map(|pixel| &pixel[..channels]);
    Ok(Pixels {
        size: header.size,
        channels,
        numbers: Numbers::Bytes(numbers.copied().collect()),
        palette: Vec::new(),
    })
}

fn header(bytes: &[u8]) -> Option<Header<'_>> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let half = |at: usize| Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    bytes.strip_prefix(b"BM")?;
    let data = bytes.get(word(10)? as usize..)?;
    let length = word(14)? as usize;
    // The oldest headers have 12 bytes, and colours of three; later ones begin with 40 bytes.
    let old = length == 12;
    if !old && length < 40 {
        return None;
    }
    let (width, height, bits) = if old {
        (half(18)?.into(), half(20)?.into(), half(24)?)
    } else {
        (word(18)?.cast_signed(), word(22)?.cast_signed(), half(28)?)
    };
    let storage = if old { PLAIN } else { word(30)? };
    let masks = match (storage, bits) {
        (BIT_FIELDS, _) => {
            let alpha = if length >= 56 { word(66)? } else { 0 };
            [word(54)?, word(58)?, word(62)?, alpha]
        }
        (_, 16) => [0x7c00, 0x3e0, 0x1f, 0],
        _ => [0xff_0000, 0xff00, 0xff, 0],
    };
    let palette = match bits {
        1..=8 => {
            let named = if old { 0 } else { word(46)? as usize };
            let all = 1 << bits;
            let count = if named == 0 { all } else { named };
            let width = if old { 3 } else { 4 };
            let colours = bytes.get(14 + length..)?.get(..width * count.min(all))?;
            let colours = colours.chunks_exact(width);
            colours.map(|c| [c[2], c[1], c[0], 255]).collect()
        }
        _ => Vec::new(),
    };
    Some(Header {
        size: [width.try_into().ok()?, height.unsigned_abs() as usize],
        top_down: height < 0,
        bits: bits.into(),
        storage,
        masks,
        palette,
        data,
    })
}

impl Header<'_> {
    /// Colours that the palette does not have are black.
    fn colour(&self, index: u8) -> Pixel {
        self.palette
            .get(usize::from(index))
            .copied()
            .unwrap_or(BLACK)
    }
}

/// Pixels one by one, each row ending at a multiple of four bytes.
fn plain(header: &Header<'_>, path: &Path) -> Result<Vec<Pixel>, InputError> {
    let [width, height] = header.size;
    let row_bytes = 4 * (width * header.bits).div_ceil(32);
    let rows = take(header.data, row_bytes * height, path)?.chunks_exact(row_bytes);
    let fields = header.masks.map(Field::new);
    let coloured = |number: u32| fields.map(|field| field.read(number));
    let pixel = |row: &[u8], x: usize| match header.bits {
        bits @ (1 | 2 | 4 | 8) => {
            let shift = 8 - bits - x * bits % 8;
            header.colour(row[x * bits / 8] >> shift & (u8::MAX >> (8 - bits)))
        }
        16 => coloured(u16::from_le_bytes([row[2 * x], row[2 * x + 1]]).into()),
        bits => {
            let bytes = &row[x * bits / 8..][..bits / 8];
            coloured(
                bytes
                    .iter()
                    .rev()
                    .fold(0, |all, &byte| all << 8 | u32::from(byte)),
            )
        }
    };
    Ok(rows
        .flat_map(|row| (0..width).map(move |x| pixel(row, x)))
        .collect())
}

/// Neighbouring bits of a number.
#[derive(Clone, Copy)]
struct Field {
    shift: u32,
    largest: u32,
}

impl Field {
    fn new(mask: u32) -> Self {
        let shift = mask.trailing_zeros() % 32;
        Self {
            shift,
            largest: mask >> shift,
        }
    }

    /// On a scale from 0 to 255; without any bits 255.
    fn read(self, number: u32) -> u8 {
        let value = number >> self.shift & self.largest;
        let share = f64::from(value) / f64::from(self.largest);
        if self.largest == 0 {
            255
        } else {
            (255.0 * share).round() as u8
        }
    }
}

/// Pixels as runs of one colour, or of two in turn, and as runs of different ones. What is skipped
/// is black.
fn run_lengths(header: &Header<'_>) -> Option<Vec<Pixel>> {
    let [width, height] = header.size;
    let mut pixels = vec![BLACK; width * height];
    let mut data = header.data;
    let [mut x, mut y] = [0, 0];
    while y < height {
        let (&[count, value], rest) = data.split_first_chunk()?;
        data = rest;
        let (run, bytes) = match (count, value) {
            (0, 0) => {
                [x, y] = [0, y + 1];
                continue;
            }
            (0, 1) => break,
            (0, 2) => {
                let (&[right, up], rest) = data.split_first_chunk()?;
                data = rest;
                [x, y] = [x + usize::from(right), y + usize::from(up)];
                continue;
            }
            (0, run) => {
                let length = 2 * (usize::from(run) * header.bits).div_ceil(16);
                let (bytes, rest) = data.split_at_checked(length)?;
                data = rest;
                (run, bytes)
            }
            (run, _) => (run, std::slice::from_ref(&value)),
        };
        for i in 0..usize::from(run) {
            let byte = bytes[i * header.bits / 8 % bytes.len()];
            let index = match header.bits {
                8 => byte,
                _ => byte >> (4 - i % 2 * 4) & 15,
            };
            if x < width {
                pixels[y * width + x] = header.colour(index);
            }
            x += 1;
        }
    }
    Some(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with a header of 40 bytes; `extra` are masks or the palette.
    fn file(size: [i32; 2], bits: u16, storage: u32, extra: &[u32], data: &[u8]) -> Vec<u8> {
        let start = 54 + 4 * extra.len() as u32;
        let mut bytes = b"BM".to_vec();
        for number in [start + data.len() as u32, 0, start, 40] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(size.map(i32::to_le_bytes).as_flattened());
        bytes.extend([1, bits].map(u16::to_le_bytes).as_flattened());
        let colours = if bits > 8 { 0 } else { extra.len() as u32 };
        let numbers = [storage, 0, 0, 0, colours, 0];
        bytes.extend(numbers.map(u32::to_le_bytes).as_flattened());
        bytes.extend(extra.iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend(data);
        bytes
    }

    fn numbers(picture: Pixels) -> Vec<u8> {
        match picture.numbers {
            Numbers::Bytes(numbers) => numbers,
            Numbers::Words(_) => panic!("every channel has 8 bits"),
        }
    }

    fn red(bytes: &[u8]) -> Vec<f64> {
        let picture = decode(bytes, Path::new("a.bmp")).unwrap();
        assert_eq!((picture.size, picture.channels), ([3, 2], 3));
        let red = numbers(picture).into_iter().step_by(3);
        red.map(f64::from).collect()
    }

    const PALETTE: [u32; 3] = [0x0a_0000, 0x14_0000, 0x1e_0000];
    const EXPECTED: [f64; 6] = [20.0, 30.0, 10.0, 10.0, 20.0, 20.0];

    #[test]
    fn pixels_of_all_widths_are_read() {
        for (bits, data) in [
            (2, [0x14, 0, 0, 0, 0x60, 0, 0, 0]),
            (4, [0x01, 0x10, 0, 0, 0x12, 0, 0, 0]),
            (8, [0, 1, 1, 0, 1, 2, 0, 0]),
        ] {
            assert_eq!(red(&file([3, 2], bits, PLAIN, &PALETTE, &data)), EXPECTED);
        }
        let rows = [[20.0, 30.0, 10.0], [10.0, 20.0, 20.0]];
        let full = |width: usize| -> Vec<u8> {
            let row = |row: [f64; 3]| {
                let mut bytes: Vec<u8> = row
                    .iter()
                    .flat_map(|&r| {
                        let mut pixel = vec![1, 2, r as u8, 77];
                        pixel.truncate(width);
                        pixel
                    })
                    .collect();
                bytes.resize(bytes.len().next_multiple_of(4), 0);
                bytes
            };
            rows.map(row).concat()
        };
        // A negative height says that the first row comes first.
        assert_eq!(red(&file([3, -2], 24, PLAIN, &[], &full(3))), EXPECTED);
        assert_eq!(red(&file([3, -2], 32, PLAIN, &[], &full(4))), EXPECTED);
        let fives = [0x7c00u16, 0x0400, 0, 0, 0, 0, 0, 0].map(u16::to_le_bytes);
        let read = red(&file([3, 2], 16, PLAIN, &[], fives.as_flattened()));
        assert_eq!(read, [0.0, 0.0, 0.0, 255.0, 8.0, 0.0]);
        let masks = [0xff00_0000, 0xff_0000, 0xff00];
        let bytes = [0u32, 0, 0, 0x4000_0000, 0, 7].map(u32::to_le_bytes);
        let read = red(&file([3, 2], 32, BIT_FIELDS, &masks, bytes.as_flattened()));
        assert_eq!(read, [64.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn run_lengths_are_read() {
        let eight = [1, 0, 2, 1, 0, 0, 0, 3, 1, 2, 0, 99, 0, 1];
        let four = [3, 0x01, 0, 0, 0, 3, 0x12, 0x00, 0, 1];
        let read = red(&file([3, 2], 8, RUN_LENGTHS_8, &PALETTE, &eight));
        assert_eq!(read, EXPECTED);
        let read = red(&file([3, 2], 4, RUN_LENGTHS_4, &PALETTE, &four));
        assert_eq!(read, [20.0, 30.0, 10.0, 10.0, 20.0, 10.0]);
        let skipped = [0, 2, 2, 1, 1, 2, 0, 1];
        let read = red(&file([3, 2], 8, RUN_LENGTHS_8, &PALETTE, &skipped));
        assert_eq!(read, [0.0, 0.0, 30.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn transparency_and_old_headers_are_read() {
        let mut bytes = file(
            [2, 2],
            32,
            BIT_FIELDS,
            &[0xff_0000, 0xff00, 0xff, 0xff00_0000],
            &[],
        );
        bytes[14] = 56;
        bytes.extend(
            [0x0102_0304u32, 0x8000_0000, 0, 0]
                .map(u32::to_le_bytes)
                .as_flattened(),
        );
        let picture = decode(&bytes, Path::new("a.bmp")).unwrap();
        assert_eq!(picture.channels, 4);
        assert_eq!(numbers(picture)[8..], [2, 3, 4, 1, 0, 0, 0, 128]);

        let mut old = b"BM\0\0\0\0\0\0\0\0\x20\0\0\0\x0c\0\0\0\x03\0\x02\0\x01\0\x01\0".to_vec();
        old.extend([1, 2, 3, 7, 8, 9, 0xa0, 0, 0, 0, 0x40, 0, 0, 0]);
        assert_eq!(red(&old), [3.0, 9.0, 3.0, 9.0, 3.0, 9.0]);
    }

    #[test]
    fn absurd_headers_are_refused() {
        let error = |bytes: &[u8]| decode(bytes, Path::new("a.bmp")).err().unwrap();
        let huge = error(&file([99999, 99999], 24, PLAIN, &[], &[0; 64]));
        assert!(matches!(huge, InputError::TooLarge { .. }));
        let cut = error(&file([9999, 9999], 24, PLAIN, &[], &[0; 64]));
        assert!(matches!(cut, InputError::Truncated { .. }));
        let cut = error(&file([30, 30], 24, PLAIN, &[], &[0; 64]));
        assert!(matches!(
            cut,
            InputError::Truncated {
                expected: 2760,
                found: 64,
                ..
            }
        ));
        for (bits, storage) in [(24, 1), (8, 4), (3, 0), (32, 5)] {
            let odd = error(&file([3, 2], bits, storage, &PALETTE, &[0; 64]));
            assert!(matches!(odd, InputError::Malformed { .. }));
        }
        let runs = error(&file([3, 2], 8, RUN_LENGTHS_8, &PALETTE, &[3, 0, 0]));
        assert!(matches!(runs, InputError::Malformed { .. }));
    }
}
