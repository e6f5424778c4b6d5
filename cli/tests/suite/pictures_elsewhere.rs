//! Pictures and arrays of other programs are read as these wrote them, and images, masks, fields at points and
//! drawings of ours are read by other programs. The tests print a reason and pass where Python lacks a module.

use shapespace_input::{AnyImage, LEVEL, ReadOptions, read_image};

use crate::common::solid::{SOLID, lattice};
use crate::common::{Place, Results, succeeded};
use crate::formats::{python, run_script};

const WRITE: &str = include_str!("files/write_pictures.py");
const READ: &str = include_str!("files/read_outputs.py");

#[test]
fn pictures_of_other_programs_are_masks() {
    let Some(program) = python("numpy, PIL") else {
        return;
    };
    let place = Place::new();
    let written = run_script(&program, &place, WRITE, &[]);
    let expected: Vec<bool> = serde_json::from_value(written["mask"].clone()).unwrap();
    let mut count = 0;
    for name in place.listing() {
        let image = read_image(&place.path(&name), &ReadOptions::default());
        let (size, values) = match image {
            Ok(AnyImage::D2(image)) => (image.size.to_vec(), image.values.iter().collect()),
            Ok(AnyImage::D3(image)) => (image.size.to_vec(), image.values.iter().collect()),
            Err(error) => panic!("{name}: {error}"),
        };
        let values: Vec<f64> = values;
        let found = values.iter().map(|&v| v > LEVEL);
        if name == "stack.tif" {
            assert_eq!(size, [30, 22, 3]);
            let empty = vec![false; expected.len()];
            assert!(found.eq([&expected[..], &empty, &expected].concat()));
        } else {
            assert_eq!(size, [30, 22], "{name}");
            let differing = found.zip(&expected).filter(|(a, b)| a != *b).count();
            assert_eq!(differing, 0, "{name}");
        }
        count += 1;
    }
    // PNG 5, BMP 3, netpbm 4, JPEG 1, TIFF 7, arrays 8.
    assert_eq!(count, 28);
}

/// What no other test has read elsewhere: VTK images, fields at the points of surfaces, changes of volume, masks of
/// segmented volumes, and drawings.
#[test]
fn outputs_are_read_by_other_programs() {
    let Some(program) = python("nibabel, numpy, shapely, vtk") else {
        return;
    };
    let place = Place::new();
    let turned = [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let affine = lattice(turned, [34; 3]);
    SOLID.write(&place, "a.nii", [34; 3], &affine);
    let average = ["average", "a.nii", "a.nii", "--grid", "33", "-o", "out"];
    succeeded(&place.compute(&average));
    succeeded(&place.compute(&["segment", "a.nii", "--grid", "33", "-o", "found"]));
    let ellipse = ["generate", "ellipse", "--grid", "65", "-o", "e.npy"];
    succeeded(&place.run(&ellipse));
    let flat = ["average", "e.npy", "e.npy", "--grid", "65", "-o", "flat"];
    succeeded(&place.compute(&flat));
    let read = run_script(
        &program,
        &place,
        READ,
        &["out", "found", "flat"].map(String::from),
    );
    println!("{read}");
    let number = |key: &str| read[key].as_f64().unwrap();
    let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(read[key].clone()).unwrap() };
    // Single precision.
    assert!(number("array") < 1e-6);
    // Centroids of masks on two lattices with spacings of 1 and 1.1 mm, in the world of other programs.
    for key in ["vti", "mask_centre"] {
        for (a, b) in numbers(key).iter().zip(numbers("nifti")) {
            assert!((a - b).abs() < 0.1, "{key}: {a} {b}");
        }
    }
    // The boundary of the input is carried onto that of the average, with a tenth of a spacing of 1.1 mm between.
    assert!(number("carried") < 0.2);
    assert!((number("inner_change") - 1.0).abs() < 0.01);
    let rows: Vec<f64> = affine.concat();
    for (a, b) in numbers("mask_affine").iter().zip(&rows) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    let sources = shapespace_input::Sources::files();
    let image = sources.read_numbers(&place.path("a.nii")).unwrap();
    let inside = image.values.iter().filter(|&&v| v > LEVEL).count() as f64;
    let share = number("mask_samples") / inside;
    assert!((share - 1.0).abs() < 0.05, "{share}");
    assert_eq!(read["valid"], true);
    let area = Results::read(&place.path("flat")).number("/average/area_input_units");
    let share = number("area") / area;
    assert!((share - 1.0).abs() < 0.005, "{share}");
}
