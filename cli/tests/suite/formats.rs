//! Files of other programs are read as these read them, and ours are read by others. The tests
//! print a reason and pass where Python lacks a module.

use std::process::Command;

use shapespace_input::{AnyImage, ReadOptions, read_image};

use crate::common::solid::{SOLID, Solid, lattice, mapped};
use crate::common::{Place, Results, succeeded};

const WRITE: &str = include_str!("files/write_formats.py");
const CHECK: &str = include_str!("files/check_warps.py");

/// The modules for volumes.
const VOLUMES: &str = "nibabel, numpy, SimpleITK";

/// Python with the modules that a script uses.
pub fn python(modules: &str) -> Option<String> {
    let named = std::env::var("SHAPESPACE_PYTHON").ok();
    let program = named.unwrap_or_else(|| "python3".into());
    let imports = format!("import {modules}");
    let run = Command::new(&program).args(["-c", &imports]).output();
    if run.is_ok_and(|run| run.status.success()) {
        return Some(program);
    }
    println!("skipped: no Python with {modules} (SHAPESPACE_PYTHON)");
    None
}

/// Runs a script in a place, and reads the last line that it prints.
pub fn run_script(
    program: &str,
    place: &Place,
    script: &str,
    arguments: &[String],
) -> serde_json::Value {
    let mut command = Command::new(program);
    let run = command
        .current_dir(place.path(""))
        .args(["-W", "ignore", "-c", script])
        .args(arguments);
    let run = run.output().unwrap();
    let report = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{report}");
    let text = String::from_utf8(run.stdout).unwrap();
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

#[test]
fn files_of_other_programs_are_read_as_these_wrote_them() {
    let Some(program) = python(VOLUMES) else {
        return;
    };
    let place = Place::new();
    let written = run_script(&program, &place, WRITE, &[".".into()]);
    let samples = written["samples"].as_f64().unwrap();
    let number = |i: usize, j: usize| written["affine"][i][j].as_f64().unwrap();
    let mut count = 0;
    for name in place.listing() {
        if name.contains(".raw") || name.contains(".zraw") {
            continue;
        }
        let image = match read_image(&place.path(&name), &ReadOptions::default()) {
            Ok(AnyImage::D3(image)) => image,
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(image.size, [20, 18, 16], "{name}");
        assert_eq!(image.values.iter().sum::<f64>(), samples, "{name}");
        let affine = image
            .affine
            .unwrap_or_else(|| panic!("{name} has no place"));
        for i in 0..3 {
            for j in 0..4 {
                // Single precision of NIfTI-1, and of the quaternion.
                let difference = (affine[i][j] - number(i, j)).abs();
                assert!(difference < 1e-4, "{name}: {affine:?}");
            }
        }
        count += 1;
    }
    // 12 of NIfTI of both versions, 3 more, two pairs of two files, and 10 of NRRD and MetaImage.
    assert_eq!(count, 12 + 2 + 4 + 10);
}

/// Two solids on different lattices, and their average.
fn averaged(place: &Place) -> Results {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let turned = [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let other = Solid {
        swelling: 1.2,
        ..SOLID
    };
    SOLID.write(place, "a.nii", [34; 3], &lattice(identity, [34; 3]));
    other.write(place, "b.nii", [34; 3], &lattice(turned, [34; 3]));
    succeeded(&place.compute(&[
        "average", "a.nii", "b.nii", "--grid", "33", "--align", "rigid", "-o", "out",
    ]));
    Results::read(&place.path("out"))
}

#[test]
fn displacement_fields_are_applied_by_other_programs() {
    let Some(program) = python(VOLUMES) else {
        return;
    };
    let place = Place::new();
    let found = averaged(&place);
    assert_eq!(found.number("/world/of_input"), 0.0);
    for (shape, name) in [("0", "a.nii"), ("1", "b.nii")] {
        let out = format!("warped{shape}");
        succeeded(&place.compute(&[
            "warp",
            "out",
            name,
            "--shape",
            shape,
            "--interpolation",
            "linear",
            "-o",
            &out,
        ]));
    }
    // The samples of the average are those of the first input, from another one on.
    let affine = {
        let bytes = unpacked(&place, "out/average.nii.gz");
        let number =
            |k: usize| f32::from_le_bytes(bytes[280 + 4 * k..284 + 4 * k].try_into().unwrap());
        let mut rows: Vec<f32> = (0..12).map(number).collect();
        rows.extend([0.0, 0.0, 0.0, 1.0]);
        rows
    };
    for j in 0..3 {
        assert!((affine[5 * j] - 1.0).abs() < 1e-6, "{affine:?}");
    }
    let mut arguments = vec![
        "out/average.nii.gz".to_owned(),
        "out/average_distance.nii.gz".into(),
        format!("{affine:?}"),
    ];
    for (i, name) in ["a.nii", "b.nii"].iter().enumerate() {
        let stem = name.strip_suffix(".nii").unwrap();
        arguments.push(format!(
            "{name},out/warp_00{i}.nii.gz,out/inverse_warp_00{i}.nii.gz,warped{i}/{stem}.nii.gz"
        ));
    }
    let checked = run_script(&program, &place, CHECK, &arguments);
    println!("{checked}");
    let list = |key: &str| -> Vec<f64> {
        let list = checked[key].as_array().unwrap().iter();
        list.map(|v| v.as_f64().unwrap()).collect()
    };
    assert_eq!(checked["sides"], true);
    assert!(checked["affine"].as_f64().unwrap() < 1e-5);
    if list("ants").is_empty() {
        println!("not applied by ANTs: no Python with ants (antspyx)");
    }
    for (i, dice) in list("ours").into_iter().chain(list("ants")).enumerate() {
        // The same field, applied by two or three programs.
        assert!(dice >= 0.99, "{i}: {dice}");
    }
    for (i, dice) in list("onto").into_iter().chain(list("back")).enumerate() {
        // A sample at each side of a boundary of 900 of 2500 mm3 may differ by a part.
        assert!(dice >= 0.96, "{i}: {dice}");
    }
    let volume = checked["volume"].as_f64().unwrap();
    let expected = found.number("/average/volume_input_units");
    assert!(
        (volume / expected - 1.0).abs() < 0.02,
        "{volume} {expected}"
    );
}

/// The shapes of a path lie in the world, and its steps are applied by another program.
#[test]
fn paths_lie_in_the_world() {
    let place = Place::new();
    averaged(&place);
    succeeded(&place.compute(&[
        "geodesic", "a.nii", "b.nii", "--grid", "33", "-K", "2", "-o", "path",
    ]));
    succeeded(&place.compute(&["warp", "path", "a.nii", "--time", ".5", "-o", "half"]));
    succeeded(&place.compute(&["warp", "path", "a.nii", "--time", "1", "-o", "end"]));
    let inside = |name: &str| -> (Vec<usize>, Vec<bool>) {
        let sources = shapespace_input::Sources::files();
        let image = sources.read_numbers(&place.path(name)).unwrap();
        (image.size, image.values.iter().map(|&v| v > 0.5).collect())
    };
    let dice = |a: &str, b: &str| {
        let ((size, a), (other, b)) = (inside(a), inside(b));
        assert_eq!(size, other);
        let both = a.iter().zip(&b).filter(|(a, b)| **a && **b).count();
        let count = |m: &[bool]| m.iter().filter(|&&x| x).count();
        2.0 * both as f64 / (count(&a) + count(&b)) as f64
    };
    // At the end the samples are those of the second input.
    for (a, b) in [
        ("half/a.nii.gz", "path/shape_001.nii.gz"),
        ("end/a.nii.gz", "b.nii"),
    ] {
        let overlap = dice(a, b);
        assert!(overlap > 0.96, "{a}: {overlap}");
    }
    let Some(program) = python(VOLUMES) else {
        return;
    };
    let affine = {
        let image = shapespace_input::Sources::files();
        let image = image.read_numbers(&place.path("path/shape_001.nii.gz"));
        let mut rows: Vec<f64> = image.unwrap().affine.unwrap().concat();
        rows.extend([0.0, 0.0, 0.0, 1.0]);
        format!("{rows:?}")
    };
    let arguments = [
        "path/shape_001.nii.gz",
        "path/shape_001_distance.nii.gz",
        &affine,
        "path/shape_000.nii.gz,path/warp_001.nii.gz,path/inverse_warp_001.nii.gz,half/a.nii.gz",
    ];
    let checked = run_script(&program, &place, CHECK, &arguments.map(String::from));
    println!("{checked}");
    for key in ["onto", "back", "ours"] {
        let dice = checked[key][0].as_f64().unwrap();
        assert!(dice >= 0.96, "{key}: {dice}");
    }
}

fn unpacked(place: &Place, name: &str) -> Vec<u8> {
    use std::io::Read;
    let file = std::fs::File::open(place.path(name)).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(file)
        .read_to_end(&mut bytes)
        .unwrap();
    bytes
}

#[test]
fn points_images_and_surfaces_go_there_and_back() {
    let place = Place::new();
    let found = averaged(&place);
    // Landmarks in the first solid, which lies in the world of the average, with names and a remark.
    let landmarks = [
        [12.0, -30.0, 44.0],
        [19.0, -30.0, 46.0],
        [13.0, -22.0, 40.0],
    ];
    let rows = landmarks.iter().enumerate();
    let rows: Vec<String> = rows
        .map(|(i, [x, y, z])| format!("{x},{y},{z},p{i}"))
        .collect();
    place.write(
        "points.csv",
        format!("x,y,z,name\n# a remark\n{}\n", rows.join("\n")).as_bytes(),
    );
    let warp = |names: &[&str], options: &[&str], out: &str| {
        let run = place.compute(
            &[
                &["warp", "out"],
                names,
                &["--shape", "0"],
                options,
                &["-o", out],
            ]
            .concat(),
        );
        succeeded(&run)
    };
    std::fs::copy(found.path("average.stl"), place.path("average.stl")).unwrap();
    let report = warp(&["points.csv", "a.nii"], &[], "there");
    assert!(
        report.contains("points") && report.contains("image"),
        "{report}"
    );
    warp(&["there/points.csv", "average.stl"], &["--inverse"], "back");
    let text = std::fs::read_to_string(place.path("back/points.csv")).unwrap();
    assert!(text.starts_with("x,y,z,name\n# a remark\n"), "{text}");
    for (line, expected) in text.lines().skip(2).zip(landmarks) {
        let columns: Vec<&str> = line.split(',').collect();
        assert!(columns[3].starts_with('p'));
        for k in 0..3 {
            let x: f64 = columns[k].parse().unwrap();
            // Written with six digits after the point, after an inverse by iteration.
            assert!((x - expected[k]).abs() < 1e-4, "{line} {expected:?}");
        }
    }
    // The surface of the average, carried to the first solid, lies on its boundary.
    let mut file = std::fs::File::open(place.path("back/average.stl")).unwrap();
    let mesh = stl_io::read_stl(&mut file).unwrap();
    let share = |p: [f64; 3]| SOLID.value(p, 1.0);
    let apart = mesh
        .vertices
        .iter()
        .map(|v| (2.0 * (share(v.0.map(f64::from)) - 0.5)).abs());
    let mean = apart.sum::<f64>() / mesh.vertices.len() as f64;
    assert!(mean < 0.15, "{mean} mm");
    // So does the image of the solid, in the average.
    let AnyImage::D3(image) =
        read_image(&place.path("there/a.nii.gz"), &ReadOptions::default()).unwrap()
    else {
        panic!("a volume")
    };
    let affine = image.affine.unwrap();
    let centre = |values: &dyn Fn(usize) -> f64| {
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for index in 0..image.values.len() {
            let p = mapped(&affine, image.sample(index).map(|i| i as f64));
            let value = values(index);
            total += value;
            for k in 0..3 {
                sum[k] += value * p[k];
            }
        }
        sum.map(|x| x / total)
    };
    let AnyImage::D3(average) =
        read_image(&place.path("out/average.nii.gz"), &ReadOptions::default()).unwrap()
    else {
        panic!("a volume")
    };
    assert_eq!((average.affine, average.size), (image.affine, image.size));
    let (a, b) = (
        centre(&|i| image.values.get(i)),
        centre(&|i| average.values.get(i)),
    );
    for k in 0..3 {
        assert!((a[k] - b[k]).abs() < 0.1, "{a:?} {b:?}");
    }
    for (names, options, expected) in [
        (
            ["points.csv", "points.csv"],
            &["--shape", "0"][..],
            "given twice",
        ),
        (["points.csv", "a.nii"], &["--shape", "7"], "inputs 0 to 1"),
    ] {
        let run =
            place.compute(&[&["warp", "out"], &names[..], options, &["-o", "refused"]].concat());
        let report = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(expected), "{report}");
        assert!(!place.path("refused").exists());
    }
}
