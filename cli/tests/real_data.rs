//! Real masks are read, placed and resampled; grey photographs and scans are told apart.

mod common;

use std::path::{Path, PathBuf};

use fe_grid::Grid;
use shapespace::input::fit::{FrameRule, fit_frames};
use shapespace::input::resample;
use shapespace::input::{AnyImages, Image, InputError, ReadOptions, read_image, read_images};

/// Files of one ending in a folder of the shared data beside the project, in order.
fn files(folder: &str, ending: &str) -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|place| place.join("shared/data").join(folder))
        .find(|path| path.is_dir());
    let Some(folder) = folder else {
        println!("skipped: no shared data beside the project");
        return None;
    };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.to_string_lossy().ends_with(ending))
        .collect();
    files.sort();
    Some(files)
}

/// Places images and compares the object's volume before and after, in unit-box lengths.
fn check_volumes<const D: usize>(images: &[Image<D>], nodes: usize, tolerance: f64) {
    for (image, frame) in images.iter().zip(fit_frames(images, nodes)) {
        let sample: f64 = frame.sample_size().iter().product();
        let before = image.values.iter().sum::<f64>() * sample;
        let grid = Grid::cube(nodes);
        let field = resample(image, &frame, grid);
        let after = field.as_slice().iter().sum::<f64>() * grid.cell_volume();
        assert!(
            (after / before - 1.0).abs() < tolerance,
            "{}: {before} became {after}",
            image.path.display()
        );
        assert!(
            field
                .as_slice()
                .iter()
                .all(|v| (-1e-12..=1.0 + 1e-12).contains(v))
        );
    }
}

fn flat(folder: &str) -> Option<Vec<Image<2>>> {
    match read_images(&files(folder, ".png")?, &ReadOptions::default()).unwrap() {
        AnyImages::D2(images) => Some(images),
        AnyImages::D3(_) => panic!("pictures were given"),
    }
}

#[test]
fn silhouettes_keep_their_area() {
    for (folder, count, rule) in [
        ("mpeg7/device7", 20, FrameRule::Shared),
        ("hands/mask512", 20, FrameRule::Shared),
        ("mpeg7/bat", 10, FrameRule::Centred),
    ] {
        let Some(images) = flat(folder) else { return };
        assert_eq!(images.len(), count, "{folder}");
        let frames = fit_frames(&images, 129);
        assert_eq!(frames[0].rule(), rule, "{folder}");
        // Objects at the border of their image lose what interpolation fades out there: half a
        // sample along that side.
        check_volumes(&images, 129, 0.02);
    }
}

#[test]
fn label_volumes_keep_their_volume_and_spacing() {
    let Some(paths) = files("hippocampus/labels", ".nii.gz") else {
        return;
    };
    assert_eq!(paths.len(), 20);
    let whole = match read_images(&paths[..8], &ReadOptions::default()).unwrap() {
        AnyImages::D3(images) => images,
        AnyImages::D2(_) => panic!("volumes were given"),
    };
    assert!(
        whole
            .iter()
            .all(|image| image.spacing == [1.0; 3] && image.affine.is_some())
    );
    check_volumes(&whole, 65, 0.01);
    let volume = |label| match read_images(&paths[..1], &ReadOptions { label }).unwrap() {
        AnyImages::D3(images) => images[0].values.iter().sum::<f64>(),
        AnyImages::D2(_) => 0.0,
    };
    assert_eq!(volume(Some(1)) + volume(Some(2)), volume(None));
}

#[test]
fn scans_are_not_taken_for_masks() {
    let Some(paths) = files("hippocampus/mri", ".nii.gz") else {
        return;
    };
    for path in paths {
        let result = read_image(&path, &ReadOptions::default());
        assert!(
            matches!(
                result,
                Err(InputError::Intensities { .. } | InputError::OutOfRange { .. })
            ),
            "{}",
            path.display()
        );
    }
}
