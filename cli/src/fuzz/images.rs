//! Targets for masks, grey images, surfaces and outlines: they are read, placed, and their boundary is
//! taken.

use std::io::Write;
use std::path::Path;

use fe_grid::Grid;
use flate2::write::GzEncoder;
use flate2::{Compression, Crc};
use shapespace_input::dimension::Dim;
use shapespace_input::place::{centred_frames, fit_frames, physical_frames, whole_frames};
use shapespace_input::{
    Image, ReadOptions, boundary, decode_array, decode_grey_image, decode_image, decode_mesh,
    decode_outline,
};

/// Nodes a side of the grid that images are placed on.
const NODES: usize = 17;
/// Images of more samples are not placed: it says nothing new, and takes long.
const MOST_SAMPLES: usize = 1 << 13;
/// Of one in so many surfaces and outlines it is found out what they enclose, which takes long.
const ENCLOSED: usize = 16;

/// Reads an array, as one of the program's own too.
pub(super) fn npy(bytes: &[u8]) -> bool {
    let is_array = decode_array(bytes, Path::new("a.npy")).is_ok();
    picture(bytes, "a.npy") && is_array
}

/// Reads a picture in PNG, once with the checksums that its chunks should have.
pub(super) fn png(bytes: &[u8]) -> bool {
    let as_it_is = picture(bytes, "a.png");
    picture(&with_checksums(bytes), "a.png") && as_it_is
}

/// Reads a compressed volume, and the same bytes as the contents of one.
pub(super) fn nifti_gz(bytes: &[u8]) -> bool {
    let as_it_is = picture(bytes, "a.nii.gz");
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    if packed.write_all(bytes).is_ok()
        && let Ok(packed) = packed.finish()
    {
        picture(&packed, "a.nii.gz");
    }
    as_it_is
}

/// Reads a mask, a mask of one label, and a grey image.
pub(super) fn picture(bytes: &[u8], name: &str) -> bool {
    let path = Path::new(name);
    let mut is_read = false;
    let label = ReadOptions {
        label: Some(1),
        ..ReadOptions::default()
    };
    for options in [ReadOptions::default(), label] {
        if let Ok(image) = decode_image(bytes, path, &options) {
            is_read = true;
            place_any(image);
        }
    }
    if let Ok((image, _)) = decode_grey_image(bytes, path) {
        match image {
            Dim::D2(image) => drop(whole_frames(&[image], NODES)),
            Dim::D3(image) => drop(whole_frames(&[image], NODES)),
        }
    }
    is_read
}

/// Reads a surface.
pub(super) fn surface(bytes: &[u8], name: &str) -> bool {
    let path = Path::new(name);
    let is_read = decode_mesh(bytes, path).is_ok();
    if is_read {
        enclosed(bytes, path);
    }
    is_read
}

/// Reads an outline.
pub(super) fn outline(bytes: &[u8], name: &str) -> bool {
    let path = Path::new(name);
    let is_read = decode_outline(bytes, path).is_ok();
    if is_read {
        enclosed(bytes, path);
    }
    is_read
}

/// Reads what a few surfaces and outlines enclose, always the same ones.
fn enclosed(bytes: &[u8], path: &Path) {
    let sum = bytes.iter().map(|byte| usize::from(*byte)).sum::<usize>();
    if sum.is_multiple_of(ENCLOSED)
        && let Ok(image) = decode_image(bytes, path, &ReadOptions::default())
    {
        place_any(image);
    }
}

pub(super) fn place_any(image: Dim<Image<2>, Image<3>>) {
    match image {
        Dim::D2(image) => place(image),
        Dim::D3(image) => place(image),
    }
}

/// Places an image by all rules, and takes its boundary there.
fn place<const D: usize>(image: Image<D>) {
    if image.values.len() > MOST_SAMPLES && image.outline.is_none() {
        return;
    }
    let in_world = image.in_world();
    let images = [image];
    let mut placed = vec![(&images[0], fit_frames(&images, Some(&Grid::cube(NODES))))];
    if let Some(image) = &in_world {
        let one = std::slice::from_ref(image);
        placed.push((image, physical_frames(one)));
        placed.push((image, centred_frames(one)));
    }
    for (image, frames) in placed {
        for frame in &frames {
            let _ = boundary(image, frame);
        }
    }
}

/// The chunks of a PNG file, as far as they go, with right checksums.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut fixed = bytes.to_vec();
    let mut start = 8;
    while let Some(&[a, b, c, d]) = fixed.get(start..start + 4) {
        let end = (start + 8).saturating_add(u32::from_be_bytes([a, b, c, d]) as usize);
        let Some(covered) = fixed.get(start + 4..end) else {
            break;
        };
        let mut sum = Crc::new();
        sum.update(covered);
        let Some(place) = fixed.get_mut(end..end + 4) else {
            break;
        };
        place.copy_from_slice(&sum.sum().to_be_bytes());
        start = end + 4;
    }
    fixed
}
