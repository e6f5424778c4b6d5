//! PNM pictures: PBM, PGM and PPM, plain and raw, of up to 16 bits.

use std::path::Path;

use crate::InputError;
use crate::decode::{check_size, take};
use crate::raster::{Numbers, Pixels, reserve_pixels};

struct Header {
    size: [usize; 2],
    channels: usize,
    /// Whether the samples are bits, 1 for black.
    bitmap: bool,
    /// Whether the samples are written as text.
    plain: bool,
    /// The sample of full white.
    largest: u32,
}

/// Reads a picture. Samples are scaled to the full range of 8 bits, or of 16 where the largest
/// one does not fit into 8.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Pixels, InputError> {
    let malformed = |reason: &str| InputError::Malformed {
        path: path.into(),
        format: "PNM",
        reason: reason.into(),
    };
    let (header, data) =
        header(bytes).ok_or_else(|| malformed("its header is damaged or cut off"))?;
    let n_pixels = check_size(&header.size.map(|n| n as u64), path)?;
    let n_samples = n_pixels * header.channels;
    check_stored(&header, data, path)?;
    let work = 2 * size_of::<u32>() * n_samples;
    reserve_pixels(path, n_pixels, size_of::<f64>(), work)?;
    let samples = if header.plain {
        plain_samples(&header, data).ok_or_else(|| malformed("it has too few samples"))?
    } else {
        raw_samples(&header, data, path)?
    };
    let value = |sample: u32| if header.bitmap { 1 - sample } else { sample };
    let scaled = |full: f32| {
        let factor = full / header.largest as f32;
        let scale = move |sample| (value(sample) as f32 * factor).round().min(full);
        samples.iter().map(move |&sample| scale(sample))
    };
    let numbers = if header.largest < 256 {
        Numbers::Bytes(scaled(255.0).map(|number| number as u8).collect())
    } else {
        Numbers::Words(scaled(65535.0).map(|number| number as u16).collect())
    };
    Ok(Pixels {
        size: header.size,
        channels: header.channels,
        numbers,
        palette: Vec::new(),
    })
}

/// Checks that the file is long enough for its samples.
fn check_stored(header: &Header, data: &[u8], path: &Path) -> Result<(), InputError> {
    let [width, height] = header.size;
    let n_samples = width * height * header.channels;
    let stored = match (header.plain, header.bitmap) {
        // Each sample takes a byte or more.
        (true, _) => n_samples,
        (_, true) => width.div_ceil(8) * height,
        _ if header.largest < 256 => n_samples,
        _ => 2 * n_samples,
    };
    take(data, stored, path).map(drop)
}

/// The header and what follows it.
fn header(bytes: &[u8]) -> Option<(Header, &[u8])> {
    let kind = match bytes {
        [b'P', kind @ b'1'..=b'6', ..] => kind - b'0',
        _ => return None,
    };
    let bitmap = kind % 3 == 1;
    let (width, rest) = number(&bytes[2..])?;
    let (height, rest) = number(rest)?;
    let (largest, rest) = if bitmap { (1, rest) } else { number(rest)? };
    let header = Header {
        size: [width as usize, height as usize],
        channels: if kind % 3 == 0 { 3 } else { 1 },
        bitmap,
        plain: kind <= 3,
        largest: Some(largest).filter(|n| (1..=65535).contains(n))?,
    };
    // One blank ends the header.
    Some((header, rest.get(1..)?))
}

/// Drops blanks and comments, which run from `#` to the end of their line.
fn trimmed(bytes: &[u8]) -> &[u8] {
    let mut rest = bytes.trim_ascii_start();
    while rest.first() == Some(&b'#') {
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
        rest = rest[end.unwrap_or(rest.len())..].trim_ascii_start();
    }
    rest
}

/// The next number and what follows it.
fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let rest = trimmed(bytes);
    let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
    let (number, rest) = rest.split_at(digits);
    Some((std::str::from_utf8(number).ok()?.parse().ok()?, rest))
}

/// Samples as text; those of a bitmap need no blanks between them.
fn plain_samples(header: &Header, mut rest: &[u8]) -> Option<Vec<u32>> {
    let count = header.size[0] * header.size[1] * header.channels;
    let next = |_| {
        let sample;
        if header.bitmap {
            let (first, after) = trimmed(rest).split_first()?;
            sample = u32::from(first.checked_sub(b'0').filter(|&bit| bit <= 1)?);
            rest = after;
        } else {
            (sample, rest) = number(rest)?;
        }
        Some(sample)
    };
    (0..count).map(next).collect()
}

/// Samples of 1 bit, each row starting at a byte, of 8 bits, or of 16.
fn raw_samples(header: &Header, data: &[u8], path: &Path) -> Result<Vec<u32>, InputError> {
    let [width, height] = header.size;
    let count = width * height * header.channels;
    if header.bitmap {
        let row_bytes = width.div_ceil(8);
        let rows = take(data, row_bytes * height, path)?.chunks_exact(row_bytes);
        let bits = |row| (0..width).map(move |x: usize| bit(row, x));
        return Ok(rows.flat_map(bits).collect());
    }
    Ok(if header.largest < 256 {
        take(data, count, path)?.iter().map(|&b| b.into()).collect()
    } else {
        let pairs = take(data, 2 * count, path)?.as_chunks().0.iter();
        pairs.map(|&pair| u16::from_be_bytes(pair).into()).collect()
    })
}

fn bit(row: &[u8], x: usize) -> u32 {
    u32::from(row[x / 8] >> (7 - x % 8) & 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(bytes: &[u8]) -> Vec<f64> {
        let picture = decode(bytes, Path::new("a.pnm")).unwrap();
        assert_eq!(picture.size, [3, 2]);
        match picture.numbers {
            Numbers::Bytes(numbers) => numbers.into_iter().map(f64::from).collect(),
            Numbers::Words(_) => panic!("every number has 8 bits"),
        }
    }

    #[test]
    fn plain_and_raw_pictures_are_the_same() {
        let grey = [0.0, 51.0, 255.0, 255.0, 0.0, 102.0];
        assert_eq!(values(b"P2 3 2 # size\n5\n0 1 5\n5 0 2\n"), grey);
        assert_eq!(values(b"P5\n#\n3 2\n5\n\0\x01\x05\x05\0\x02"), grey);
        let black = [0.0, 255.0, 0.0, 0.0, 0.0, 255.0];
        assert_eq!(values(b"P1 3 2\n101 1\n1 0"), black);
        assert_eq!(values(b"P4 3 2\n\xa0\xc0"), black);
        let colour = values(b"P3 3 2 255 1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9");
        assert_eq!(colour, values(b"P6 3 2 255 \x01\x02\x03\x04\x05\x06\x07\x08\x09\x01\x02\x03\x04\x05\x06\x07\x08\x09"));
    }

    #[test]
    fn sixteen_bits_are_kept() {
        let picture = decode(
            b"P5 2 2 65535\n\0\0\0\x01\x01\0\xff\xff",
            Path::new("a.pgm"),
        );
        let picture = picture.unwrap();
        assert_eq!(picture.numbers, Numbers::Words(vec![0, 1, 256, 65535]));
    }

    #[test]
    fn absurd_headers_are_refused() {
        let error = |bytes: &[u8]| decode(bytes, Path::new("a.pgm")).err().unwrap();
        let huge = error(b"P5 99999 99999 255\n");
        assert!(matches!(huge, InputError::TooLarge { .. }));
        for cut in [&b"P5 9999 9999 255\nabc"[..], b"P1 9999 9999\n0101"] {
            assert!(matches!(error(cut), InputError::Truncated { .. }));
        }
        for damaged in [
            &b"P5 3 2 0\n"[..],
            b"P5 3 2 70000\n",
            b"P9 3 2 1\n",
            b"P2 3 2 9\n1 2 3 4 5 x",
        ] {
            assert!(matches!(error(damaged), InputError::Malformed { .. }));
        }
    }
}
