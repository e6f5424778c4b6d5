//! Drawn shapes, by the program and against inputs that were made elsewhere.

use std::path::{Path, PathBuf};

use crate::common::Place;
use shapespace_input::{AnyImage, Image, ReadOptions, read_image};

fn picture(path: &Path) -> Image<2> {
    match read_image(path, &ReadOptions::default()).unwrap() {
        AnyImage::D2(image) => image,
        AnyImage::D3(_) => panic!("a picture was drawn"),
    }
}

fn drawn(place: &Place, arguments: &[&str], output: &str) -> PathBuf {
    let mut all = vec!["generate"];
    all.extend(arguments);
    all.extend(["-o", output]);
    let run = place.run(&all);
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    place.path(output)
}

/// The folder of shared data beside the project, where there is one.
fn shared(name: &str) -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors()
        .map(|folder| folder.join("shared").join(name))
        .find(|path| path.exists())
}

#[test]
fn bars_equal_those_drawn_elsewhere() {
    let Some(folder) = shared("peers/ref_inputs") else {
        println!("skipped: no shared folder with reference inputs");
        return;
    };
    let place = Place::new();
    // The bent bars drawn elsewhere have their centroid .00203 over the middle.
    for (name, angle, grid, shift) in [
        ("bar_straight_65", "180", "65", "0,0"),
        ("bar_bent_65", "118", "65", "0,0.00203"),
        ("bar_straight_129", "180", "129", "0,0"),
        ("bar_bent_129", "118", "129", "0,0.00203"),
    ] {
        let output = format!("{name}.npy");
        let path = drawn(
            &place,
            &["bar", "--angle", angle, "--grid", grid, "--shift", shift],
            &output,
        );
        let (ours, theirs) = (picture(&path), picture(&folder.join(&output)));
        assert_eq!(ours.size, theirs.size);
        let mean = ours
            .values
            .iter()
            .zip(theirs.values.iter())
            .map(|(a, b)| (a - b).abs())
            .sum::<f64>()
            / ours.values.len() as f64;
        // The other one counts points, 1/8 of a box wrong at most, in 2 % of the boxes at 65 nodes.
        assert!(mean < 0.0012, "{name}: mean difference {mean}");
    }
}

#[test]
fn a_png_and_an_array_of_one_shape_are_the_same_image() {
    let place = Place::new();
    let letter = ["letter", "m", "--grid", "33"];
    let array = picture(&drawn(&place, &letter, "m.npy"));
    let png = picture(&drawn(&place, &letter, "m.png"));
    assert_eq!(array.size, png.size);
    for (a, b) in array.values.iter().zip(png.values.iter()) {
        // Half a grey level.
        assert!((a - b).abs() <= 0.5 / 255.0 + 1e-12);
    }
    // Upright: an M is closed at the bottom nowhere and has its legs there.
    let row = |j: usize| (0..33).map(|i| array.values.get(33 * j + i)).sum::<f64>();
    assert!(row(24) < row(16));
}

#[test]
fn a_shape_that_is_cut_off_is_said_to_be() {
    let place = Place::new();
    for (radius, shift, cut) in [
        ("0.3", "0,0", false),
        ("0.3", "0.25,0", true),
        ("0.6", "0,0", true),
    ] {
        let output = format!("{radius}_{shift}.png");
        let disk = [
            "generate", "disk", "--radius", radius, "--shift", shift, "-o", &output,
        ];
        let run = place.run(&disk);
        let text = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{text}");
        assert_eq!(
            text.contains("cut off at the border"),
            cut,
            "{output}: {text}"
        );
    }
}

#[test]
fn families_and_refusals() {
    let place = Place::new();
    let folder = drawn(
        &place,
        &["family", "blobs", "--dimension", "3", "--grid", "17"],
        "blobs",
    );
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 5);
    let volume = read_image(&folder.join("blob_003.npy"), &ReadOptions::default()).unwrap();
    assert_eq!(volume.dimension(), 3);
    let labels = drawn(&place, &["family", "parts", "--grid", "33"], "parts");
    // The nodes with a label.
    let count = |image: &str, label: i64| {
        let options = ReadOptions {
            label: Some(label),
            ..ReadOptions::default()
        };
        match read_image(&labels.join(image), &options).unwrap() {
            AnyImage::D2(image) => image.values.iter().filter(|v| *v > 0.5).count(),
            AnyImage::D3(_) => panic!("label images of the plane were drawn"),
        }
    };
    let [left, right] =
        ["bar_000.npy", "bar_001.npy"].map(|image| [1, 2].map(|label| count(image, label)));
    // Where the parts meet differs by .1, over the width of .18 of the bars: by 18 nodes of 33 a side; what is inside
    // does not.
    assert_eq!(left[0] + left[1], right[0] + right[1]);
    assert!(
        (12..=24).contains(&(right[0] - left[0])),
        "{left:?} {right:?}"
    );
    for (arguments, word) in [
        (
            vec!["family", "parts", "--noise", ".1", "-o", "noisy"],
            "label images",
        ),
        (vec!["family", "disks", "-o", "blobs"], "exists already"),
        (
            vec!["letter", "b", "--dimension", "3", "-o", "b.npy"],
            "flat",
        ),
        (vec!["disk", "-o", "disk.txt"], "disk.txt"),
        (vec!["disk", "--shift", "1,2,3", "-o", "d.npy"], "--shift"),
        (vec!["bar", "--angle", "5", "-o", "d.npy"], "--angle"),
    ] {
        let before = place.listing();
        let mut all = vec!["generate"];
        all.extend(&arguments);
        let run = place.run(&all);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
        assert!(report.contains(word), "{report}");
        assert_eq!(place.listing(), before);
    }
}
