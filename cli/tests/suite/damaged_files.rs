//! Damaged files give an error or an image, and never a panic.

use std::io::Cursor;
use std::path::Path;

use crate::common::{grey_png, nifti, npy_f64};
use proptest::prelude::*;
use shapespace_input::{AnyImage, ReadOptions, decode_image};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray8;

fn originals() -> Vec<(&'static str, Vec<u8>)> {
    let disk = |n: i32| {
        (0..n * n).map(move |k| {
            let (x, y) = (2 * (k % n) - n, 2 * (k / n) - n);
            u8::from(x * x + y * y < n * n / 2)
        })
    };
    let grey: Vec<u8> = disk(24).map(|v| 255 * v).collect();
    let real: Vec<f64> = disk(12).map(f64::from).collect();
    let labels: Vec<u8> = (0..125).map(|k| u8::from(k % 7 == 3) * 2).collect();
    let plain = nifti([5, 5, 5], [1.0, 1.5, 2.0], &labels);
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packer, &plain).unwrap();
    let mut tiff = Cursor::new(Vec::new());
    TiffEncoder::new(&mut tiff)
        .unwrap()
        .write_image::<Gray8>(24, 24, &grey)
        .unwrap();
    vec![
        ("a.npy", npy_f64(&[12, 12], &real)),
        ("a.nii", plain),
        ("a.nii.gz", packer.finish().unwrap()),
        ("a.png", grey_png(24, 24, &grey)),
        ("a.bmp", grey_bmp(24, 24, &grey)),
        ("a.pgm", [b"P5\n24 24\n255\n", &grey[..]].concat()),
        ("a.tif", tiff.into_inner()),
    ]
}

/// A BMP file with a palette of all greys; the last row comes first.
fn grey_bmp(width: u32, height: u32, grey: &[u8]) -> Vec<u8> {
    assert_eq!(width % 4, 0, "rows end at multiples of four bytes");
    let start = 14 + 40 + 4 * 256;
    let mut bytes = b"BM".to_vec();
    for number in [start + width * height, 0, start, 40, width, height] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([1, 8].map(u16::to_le_bytes).as_flattened());
    let rest = [0, 0, 0, 0, 256, 256].map(u32::to_le_bytes);
    bytes.extend(rest.as_flattened());
    bytes.extend((0..=255).flat_map(|level: u8| [level, level, level, 0]));
    let rows = grey.chunks_exact(width as usize).rev();
    bytes.extend(rows.flatten());
    bytes
}

/// What comes through must be a usable mask.
fn check(name: &str, bytes: &[u8], label: Option<i64>) {
    let values = match decode_image(
        bytes,
        Path::new(name),
        &ReadOptions {
            label,
            ..ReadOptions::default()
        },
    ) {
        Ok(AnyImage::D2(image)) => image.values,
        Ok(AnyImage::D3(image)) => image.values,
        Err(error) => {
            assert!(error.to_string().contains(name), "{error}");
            return;
        }
    };
    assert!(values.iter().all(|v| (0.0..=1.0).contains(&v)));
    assert!(values.iter().any(|v| v >= 0.5) && values.iter().any(|v| v < 0.5));
}

#[test]
fn the_originals_are_read() {
    for (name, bytes) in originals() {
        let result = decode_image(&bytes, Path::new(name), &ReadOptions::default());
        assert!(result.is_ok(), "{name}: {result:?}");
        if let (Ok(AnyImage::D2(image)), true) = (result, name != "a.npy") {
            // Every picture format gives the same disk, row 0 first.
            assert_eq!(image.size, [24, 24]);
            let disk = |k: usize| {
                let (x, y) = (2 * (k % 24) as i32 - 24, 2 * (k / 24) as i32 - 24);
                f64::from(u8::from(x * x + y * y < 288))
            };
            assert!((0..576).all(|k| image.values.get(k) == disk(k)), "{name}");
        }
    }
}

#[test]
fn every_cut_is_survived() {
    for (name, bytes) in originals() {
        for length in 0..bytes.len() {
            check(name, &bytes[..length], None);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn changed_bytes_are_survived(
        which in 0usize..7,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        // Most of what can go wrong is in the header.
        header in any::<bool>(),
        label in prop::option::of(-3i64..3),
    ) {
        let (name, mut bytes) = originals().swap_remove(which);
        let reach = if header { bytes.len().min(360) } else { bytes.len() };
        for (place, value) in changes {
            bytes[place.index(reach)] = value;
        }
        check(name, &bytes, label);
    }

    #[test]
    fn arbitrary_bytes_are_survived(
        which in 0usize..7,
        keep in 0usize..16,
        tail in prop::collection::vec(any::<u8>(), 0..600),
    ) {
        let (name, bytes) = originals().swap_remove(which);
        let mut bytes = bytes[..keep].to_vec();
        bytes.extend(tail);
        check(name, &bytes, None);
    }
}
