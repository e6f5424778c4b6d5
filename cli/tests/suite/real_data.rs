//! Real masks are read and placed, their boundaries drawn; grey photographs and scans are told apart.

use std::path::{Path, PathBuf};

use levelset::Moments;
use shapespace_input::frame::FrameRule;
use shapespace_input::place::fit_frames;
use shapespace_input::{
    AnyImages, Image, InputError, ReadOptions, boundary, read_image, read_images,
};

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

/// Places images and compares the sum over their samples with what their boundary encloses, both
/// in unit-box lengths.
fn check_volumes<const D: usize>(images: &[Image<D>], tolerance: f64) {
    for (image, frame) in images.iter().zip(fit_frames(images, None)) {
        let sample: f64 = frame.sample_size().iter().product();
        let counted = image.values.iter().sum::<f64>() * sample;
        let drawn = boundary(image, &frame).unwrap();
        let enclosed = Moments::of_contour(&drawn).unwrap().volume;
        assert!(
            (enclosed / counted - 1.0).abs() < tolerance,
            "{}: {counted} counted, {enclosed} enclosed",
            image.path.display()
        );
        for x in drawn.points().iter().flatten() {
            assert!((0.149..0.851).contains(x), "{}: {x}", image.path.display());
        }
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
        let frames = fit_frames(&images, None);
        assert_eq!(frames[0].rule(), rule, "{folder}");
        // The contour cuts the corners of samples, as many outwards as inwards but for a few.
        check_volumes(&images, 1e-4);
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
    // A surface of 1500 samples that encloses 3000 of them: the cut corners of a convex shape are
    // 1.0 to 1.4 per cent of it.
    check_volumes(&whole, 0.02);
    let volume = |label| match read_images(
        &paths[..1],
        &ReadOptions {
            label,
            ..ReadOptions::default()
        },
    )
    .unwrap()
    {
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
