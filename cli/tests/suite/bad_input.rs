//! The program refuses bad input: exit code 2, one report that names the file, nothing written.

use crate::common::solid::{Affine, nifti_of};
use crate::common::{Place, Results, grey_png, nifti, npy_f64};

/// Runs `average` on a good mask and a bad one; the report must hold all the words.
fn refused(place: &Place, bad: &str, words: &[&str]) {
    refused_with(place, &["good.npy", bad], &[], words);
}

fn refused_with(place: &Place, inputs: &[&str], options: &[&str], words: &[&str]) {
    let before = place.listing();
    let mut arguments = vec!["average"];
    arguments.extend(inputs);
    arguments.extend(["-o", "out"]);
    arguments.extend(options);
    let run = place.run(&arguments);
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{inputs:?}: {report}");
    for word in words {
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
    assert!(report.contains("help:"), "no remedy in: {report}");
    assert_eq!(
        report.matches('×').count(),
        1,
        "more than one report: {report}"
    );
    assert!(!report.contains("panicked"), "{report}");
    assert_eq!(place.listing(), before, "something was written");
}

fn place() -> Place {
    let place = Place::new();
    place.write("good.npy", &npy_f64(&[8, 8], &square(8)));
    place
}

fn square(n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|k| {
            let inside = |i: usize| i >= n / 4 && i < 3 * n / 4;
            f64::from(u8::from(inside(k % n) && inside(k / n)))
        })
        .collect()
}

#[test]
fn files_that_cannot_be_read() {
    let place = place();
    refused(&place, "missing.png", &["missing.png", "cannot read"]);
    std::fs::create_dir(place.path("folder.npy")).unwrap();
    refused(&place, "folder.npy", &["folder.npy", "nothing to read"]);
    place.write("shape.xyz", b"?");
    refused(&place, "shape.xyz", &["shape.xyz", "format"]);
    place.write("text.png", b"this is no picture");
    refused(&place, "text.png", &["text.png", "PNG"]);
    place.write("empty.tif", b"");
    refused(&place, "empty.tif", &["empty.tif", "TIFF"]);
}

#[test]
fn files_that_are_cut_off() {
    let place = place();
    let whole = npy_f64(&[8, 8], &square(8));
    place.write("cut.npy", &whole[..whole.len() - 100]);
    refused(&place, "cut.npy", &["cut.npy", "512 bytes", "412"]);
    let grey: Vec<u8> = (0..4096u32).map(|k| (k * k % 251) as u8).collect();
    let whole = grey_png(64, 64, &grey);
    place.write("cut.png", &whole[..whole.len() / 2]);
    refused(&place, "cut.png", &["cut.png", "cut off"]);
    place.write("cut.pgm", b"P5 64 64 255\nabc");
    refused(&place, "cut.pgm", &["cut.pgm"]);
    let whole = nifti([4, 4, 4], [1.0; 3], &[1; 64]);
    place.write("cut.nii", &whole[..whole.len() - 10]);
    refused(&place, "cut.nii", &["cut.nii", "64 bytes", "54"]);
}

#[test]
fn shapes_that_are_no_masks() {
    let place = place();
    place.write("empty.npy", &npy_f64(&[8, 8], &[0.0; 64]));
    refused(&place, "empty.npy", &["empty.npy", "empty shape"]);
    place.write("full.png", &grey_png(8, 8, &[255; 64]));
    refused(&place, "full.png", &["full.png", "full shape"]);
    let mut values = square(8);
    values[8 * 3 + 5] = f64::NAN;
    place.write("nan.npy", &npy_f64(&[8, 8], &values));
    refused(&place, "nan.npy", &["nan.npy", "NaN", "[3, 5]"]);
    values[8 * 3 + 5] = 17.5;
    place.write("range.npy", &npy_f64(&[8, 8], &values));
    refused(&place, "range.npy", &["range.npy", "17.5", "[0, 1]"]);
    let rgb: Vec<u8> = (0..192u32).map(|k| (k * 37 % 256) as u8).collect();
    let mut photograph = b"P6 8 8 255\n".to_vec();
    photograph.extend(rgb);
    place.write("photo.ppm", &photograph);
    refused(&place, "photo.ppm", &["photo.ppm", "colour"]);
}

#[test]
fn headers_that_claim_the_absurd() {
    let place = place();
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (4000000000, 4000000000), }";
    let mut huge = b"\x93NUMPY\x01\x00".to_vec();
    huge.extend((header.len() as u16).to_le_bytes());
    huge.extend(header.as_bytes());
    place.write("huge.npy", &huge);
    refused(&place, "huge.npy", &["huge.npy", "4000000000 x 4000000000"]);
    place.write("huge.pgm", b"P5 16000 16000 255\nabc");
    refused(&place, "huge.pgm", &["huge.pgm"]);
    place.write("huge.nii", &nifti([30000, 30000, 30000], [1.0; 3], &[1; 8]));
    refused(&place, "huge.nii", &["huge.nii", "30000"]);
}

#[test]
fn volumes_that_do_not_fit() {
    let place = place();
    let mut labels = [0u8; 64];
    labels[21] = 2;
    place.write("volume.nii", &nifti([4, 4, 4], [1.0; 3], &labels));
    refused(
        &place,
        "volume.nii",
        &["volume.nii", "good.npy", "picture", "volume"],
    );
    place.write("zero.nii", &nifti([4, 4, 4], [1.0, 0.0, 1.0], &labels));
    refused(&place, "zero.nii", &["zero.nii", "voxel size"]);
    let both = ["volume.nii", "volume.nii"];
    refused_with(
        &place,
        &both,
        &["--label", "7"],
        &["volume.nii", "label 7", "[0, 2]"],
    );
}

#[test]
fn options_that_do_not_fit() {
    let place = place();
    let two = ["good.npy", "good.npy"];
    refused_with(
        &place,
        &two,
        &["--weights", ".2,.3,.5"],
        &["3 numbers", "2 masks"],
    );
    refused_with(
        &place,
        &two,
        &["--weights", ".2,.3"],
        &["0.5", "0.400000,0.600000"],
    );
    refused_with(&place, &two, &["--weights", "-1,2"], &["-1"]);
    refused_with(&place, &two, &["--grid", "64"], &["--grid 65"]);
    refused_with(&place, &["good.npy"], &[], &["at least 2"]);
    std::fs::create_dir(place.path("out")).unwrap();
    refused_with(&place, &two, &[], &["'out'", "exists already"]);
    let run = place.run(&["average", "good.npy", "good.npy", "-o", "no/where"]);
    assert_eq!(run.status.code(), Some(2));
}

/// Mistakes that all inputs have alike, which no comparison with the others finds: of affine maps, and of what is the
/// object. Each is refused, or named as a doubt.
#[test]
fn mistakes_that_all_inputs_have_alike() {
    const SIDE: usize = 12;
    /// The value at a sample with this squared distance from the middle.
    type Value = fn([usize; 3], f64) -> f32;
    let place = Place::new();
    let write = |affine: &Affine, value: Value| {
        for (name, stretch) in [("a.nii", 1.0), ("b.nii", 1.3)] {
            let sample = |index: usize| {
                let at = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
                let [x, y, z] = at.map(|k| k as f64 - 5.5);
                value(at, x * x + stretch * y * y + z * z)
            };
            let values: Vec<f32> = (0..SIDE.pow(3)).map(sample).collect();
            place.write(name, &nifti_of([SIDE; 3], affine, &values));
        }
    };
    let run = |command: &str, out: &str| {
        let words: Vec<&str> = command.split_whitespace().collect();
        let run = place.run(&[&words[..], &["a.nii", "b.nii", "--grid", "9", "-o", out]].concat());
        // Reports are wrapped.
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        let words = report.split_whitespace().filter(|word| *word != "│");
        let report = words.collect::<Vec<_>>().join(" ");
        (run.status.code(), report)
    };
    let scaled =
        |h: f64, x: f64| -> Affine { [[h, 0.0, 0.0, x], [0.0, h, 0.0, x], [0.0, 0.0, h, x]] };
    let ball: Value = |_, square| f32::from(u8::from(square < 14.0));
    let mut flat = scaled(1.0, 0.0);
    flat[2][2] = 0.0;
    let mut sheared = scaled(1.0, 0.0);
    sheared[0][1] = 40.0;
    for (affine, words) in [
        (scaled(1e6, 0.0), "6 mm long"),
        (scaled(1e-9, 0.0), "axis of no length"),
        (flat, "axis of no length"),
        (sheared, "singular"),
        (scaled(f64::NAN, 0.0), "finite"),
        (scaled(1.0, 1e12), "more than 1e9 mm"),
    ] {
        write(&affine, ball);
        for command in ["average", "geodesic", "distances"] {
            let (code, report) = run(command, "refused");
            assert_eq!(code, Some(2), "{command} {affine:?}: {report}");
            assert!(report.contains("a.nii"), "{report}");
            assert!(report.contains(words), "{command} {words}: {report}");
        }
    }
    // Without their sizes they are shapes as others.
    write(&scaled(1e6, 0.0), ball);
    assert_ne!(run("average --size equal", "sizes").0, Some(2));
    let cases: [(Value, Option<i32>, &str); 6] = [
        (|_, _| 0.0, Some(2), "empty shape"),
        (|_, _| 1.0, Some(2), "full shape"),
        (
            |_, square| f32::from(u8::from(square > 14.0)),
            Some(3),
            "background",
        ),
        (
            |[i, j, k], _| ((i + j + k) % 2) as f32,
            Some(2),
            "no node of 9 a side",
        ),
        (|[i, ..], _| f32::from(u8::from(i < 6)), Some(3), "border"),
        (
            |at, _| f32::from(u8::from(at == [6; 3])),
            Some(3),
            "coarse_samples",
        ),
    ];
    for (number, (value, expected, what)) in cases.into_iter().enumerate() {
        write(&scaled(1.0, 0.0), value);
        let out = format!("out{number}");
        let (code, report) = run("average", &out);
        assert_eq!(code, expected, "{what}: {report}");
        if expected == Some(2) {
            assert!(report.contains(what), "{report}");
            continue;
        }
        let doubts = Results::read(&place.path(&out)).json["doubts"].clone();
        for shape in ["a", "b"] {
            let named =
                |doubt: &serde_json::Value| doubt["what"] == what && doubt["shape"] == shape;
            let doubts = doubts.as_array().unwrap();
            assert!(doubts.iter().any(named), "{what}: {doubts:?}");
        }
    }
}
