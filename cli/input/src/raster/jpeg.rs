//! JPEG pictures.

use std::path::Path;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::InputError;
use crate::decode::check_size;
use crate::raster::orientation::Orientation;
use crate::raster::{Numbers, Pixels, check_compression, reserve_pixels};

/// Colours of grey pictures differ by up to this much from grey.
const TINT: u8 = 16;
/// Sides are stored in two bytes.
const LONGEST: usize = 1 << 16;
/// The decoder works in sheets of coefficients of two bytes for each of three colours.
const WORK: usize = 12;

/// Reads a picture as it is to be seen; one without visible colours is grey.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Pixels, InputError> {
    let malformed = |reason: String| InputError::Malformed {
        path: path.into(),
        format: "JPEG",
        reason,
    };
    let options = DecoderOptions::new_safe()
        .set_max_width(LONGEST)
        .set_max_height(LONGEST)
        .set_strict_mode(false)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder
        .decode_headers()
        .map_err(|error| malformed(error.to_string()))?;
    let (width, height) = decoder
        .dimensions()
        .ok_or_else(|| malformed("it states no size".into()))?;
    let count = check_size(&[width as u64, height as u64], path)?;
    check_compression(3 * count, bytes.len(), path)?;
    reserve_pixels(path, count, size_of::<f64>(), WORK * count)?;
    let data = decoder
        .decode()
        .map_err(|error| malformed(error.to_string()))?;
    if data.len() != 3 * count {
        return Err(malformed(
            "it has another number of pixels than it states".into(),
        ));
    }
    let (pixels, _) = data.as_chunks::<3>();
    let tint = |p: &[u8; 3]| {
        let (low, high) = (p.iter().min(), p.iter().max());
        high.zip(low).map_or(0, |(high, low)| high - low)
    };
    let (channels, data) = if pixels.iter().all(|p| tint(p) <= TINT) {
        (1, pixels.iter().map(|p| p[1]).collect())
    } else {
        (3, data)
    };
    let pixels = Pixels {
        size: [width, height],
        channels,
        numbers: Numbers::Bytes(data),
        palette: Vec::new(),
    };
    let exif = decoder.exif().map_or(&[][..], Vec::as_slice);
    Ok(Orientation::of_exif(exif).upright(pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AnyImage, ReadOptions, decode_image, read_grey_images};

    /// A white disk in the left half of 48 x 32 black pixels, of quality 90.
    const DISK: &[u8] = include_bytes!("../../tests/files/disk.jpg");
    /// A red and a green half.
    const COLOURS: &[u8] = include_bytes!("../../tests/files/colours.jpg");

    fn read(bytes: &[u8]) -> Result<AnyImage, InputError> {
        decode_image(bytes, Path::new("a.jpg"), &ReadOptions::default())
    }

    #[test]
    fn a_disk_keeps_its_place_and_its_area() {
        let AnyImage::D2(image) = read(DISK).unwrap() else {
            panic!("two axes")
        };
        assert_eq!(image.size, [48, 32]);
        let inside = image.values.iter().filter(|v| *v > 0.5).count() as f64;
        // Steps of pixels along a circle of radius 10.
        assert!(
            (inside / (std::f64::consts::PI * 100.0) - 1.0).abs() < 0.02,
            "{inside}"
        );
        assert_eq!(image.object_bounds().unwrap()[0], [6, 25]);
    }

    /// A camera that is held upright stores the picture on its side, and states so.
    #[test]
    fn a_picture_of_a_turned_camera_is_upright() {
        let exif = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let mut segment = vec![0xff, 0xe1, 0, exif.len() as u8 + 2];
        segment.extend(exif);
        let turned = [&DISK[..2], &segment, &DISK[2..]].concat();
        let AnyImage::D2(image) = read(&turned).unwrap() else {
            panic!("two axes")
        };
        assert_eq!(image.size, [32, 48]);
        // The left half is turned to the top, and the rows count from above.
        assert_eq!(image.object_bounds().unwrap()[1], [6, 25]);
    }

    #[test]
    fn colours_are_refused_as_masks_and_read_as_grey_images() {
        assert!(matches!(read(COLOURS), Err(InputError::Colour { .. })));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        std::fs::write(&path, COLOURS).unwrap();
        assert!(read_grey_images(&[path]).is_ok());
    }

    #[test]
    fn damaged_files_are_refused() {
        for bytes in [&b""[..], b"\xff\xd8", &DISK[..40], b"GIF89a"] {
            assert!(read(bytes).is_err());
        }
        let mut huge = DISK.to_vec();
        let frame = huge
            .windows(2)
            .position(|w| w == [0xff, 0xc0] || w == [0xff, 0xc2])
            .unwrap();
        huge[frame + 5..frame + 9].fill(0xff);
        let result = read(&huge);
        assert!(
            matches!(
                result,
                Err(InputError::TooLarge { .. } | InputError::Truncated { .. })
            ),
            "{result:?}"
        );
    }
}
