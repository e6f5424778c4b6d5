//! Numbers at the ends of what is allowed: the result is that of a run in other units, or a refusal, and
//! nothing that is written has a number that is not finite.

use std::process::Output;

use crate::common::{Place, Results, arrays, draw, nifti};

/// 2^-20 and 2^20: they change exponents and no other bit.
const FACTORS: [f64; 2] = [1.0 / 1_048_576.0, 1_048_576.0];

/// Runs a command with options and numbers; a doubtful result is one.
fn run(place: &Place, command: &[&str], numbers: &[(&str, f64)], output: &str) -> Output {
    let numbers: Vec<String> = numbers
        .iter()
        .map(|(option, number)| format!("--{option}={number:e}"))
        .collect();
    let numbers = numbers.iter().map(String::as_str);
    let all: Vec<&str> = command.iter().copied().chain(numbers).collect();
    place.run(&[&all[..], &["-o", output]].concat())
}

/// The result of a command that has one; all its arrays are finite. `None` where it is refused.
fn finite(place: &Place, run: &Output, output: &str) -> Option<Results> {
    let report = String::from_utf8_lossy(&run.stderr);
    match run.status.code() {
        Some(0 | 3) => {}
        Some(2) => {
            assert!(!place.path(output).exists());
            return None;
        }
        code => panic!("{code:?}: {report}"),
    }
    // JSON has no numbers that are not finite; a null would be one that was lost.
    let results = Results::read(&place.path(output));
    assert!(
        !results.json.to_string().contains("null"),
        "{}",
        results.json
    );
    for (name, bytes) in arrays(&results) {
        let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        if bytes[10..header].windows(3).any(|code| code == b"<f8") {
            let (numbers, _) = bytes[header..].as_chunks();
            let is_finite = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes).is_finite();
            assert!(numbers.iter().all(is_finite), "{name}");
        }
    }
    Some(results)
}

fn disks(place: &Place) {
    draw(place, "a.npy", &["disk", "--radius", ".2", "--grid", "17"]);
    draw(
        place,
        "b.npy",
        &["ellipse", "--radii", ".3,.2", "--grid", "17"],
    );
}

#[test]
fn moduli_have_no_unit() {
    let place = Place::new();
    disks(&place);
    let average = ["average", "a.npy", "b.npy", "--grid", "17"];
    let average_of = |factor: f64| {
        let output = format!("average{factor:e}");
        let numbers = ["lambda", "mu", "mismatch-weight"].map(|option| (option, factor));
        let run = run(&place, &average, &numbers, &output);
        finite(&place, &run, &output).unwrap()
    };
    let path = ["geodesic", "a.npy", "b.npy", "--grid", "17", "-K", "2"];
    let path_of = |factor: f64| {
        let output = format!("path{factor:e}");
        let numbers = [
            ("lambda", factor),
            ("mu", factor),
            ("mismatch-weight", 100.0 * factor),
        ];
        let run = run(&place, &path, &numbers, &output);
        finite(&place, &run, &output).unwrap()
    };
    let (whole, way) = (average_of(1.0), path_of(1.0));
    for factor in FACTORS {
        let other = average_of(factor);
        assert!(arrays(&other) == arrays(&whole), "{factor}");
        let energy = |results: &Results| results.number("/energy/total");
        assert_eq!(energy(&other), factor * energy(&whole));
        let other = path_of(factor);
        assert!(arrays(&other) == arrays(&way), "{factor}");
        assert_eq!(
            other.number("/dissipation"),
            factor * way.number("/dissipation")
        );
    }
}

#[test]
fn extreme_moduli_and_weights_give_results() {
    let place = Place::new();
    disks(&place);
    let average = ["average", "a.npy", "b.npy", "--grid", "17"];
    let path = ["geodesic", "a.npy", "b.npy", "--grid", "17", "-K", "2"];
    let level_sets = [&path[..], &["--form", "level-sets"]].concat();
    let mut refused = 0;
    let cases = [
        (&average[..], "lambda", [1e-6, 1e6]),
        (&average, "mu", [1e-6, 1e6]),
        (&average, "mismatch-weight", [1e-12, 1e12]),
        (&average, "length-weight", [1e-12, 1e12]),
        (&average, "void-stiffness", [1e-12, 1.0]),
        (&path, "lambda", [1e-6, 1e6]),
        (&path, "mu", [1e-6, 1e6]),
        (&path, "mismatch-weight", [1e-12, 1e12]),
        (&level_sets, "area-weight", [1e-12, 1e12]),
    ];
    for (command, option, numbers) in cases {
        for number in numbers {
            let output = format!("{}-{option}-{number:e}", command[0]);
            let run = run(&place, command, &[(option, number)], &output);
            refused += usize::from(finite(&place, &run, &output).is_none());
        }
    }
    // All of these are allowed, and all have a result so far, if a doubtful one.
    assert_eq!(refused, 0);
}

/// A ball and a larger one in volumes of nanometres, millimetres and kilometres.
#[test]
fn coordinates_have_no_unit() {
    let place = Place::new();
    let volume = |radius: f64, h: f32| {
        let inside = |index: usize| {
            let [x, y, z] = [index % 12, index / 12 % 12, index / 144];
            let far = [x, y, z]
                .map(|i| (i as f64 - 5.5).powi(2))
                .iter()
                .sum::<f64>();
            u8::from(far.sqrt() < radius)
        };
        let labels: Vec<u8> = (0..1728).map(inside).collect();
        nifti([12; 3], [h; 3], &labels)
    };
    let results = [1.0, 1.0 / 524_288.0, 524_288.0].map(|h| {
        place.write("a.nii", &volume(3.2, h));
        place.write("b.nii", &volume(4.4, h));
        let command = ["average", "a.nii", "b.nii", "--grid", "9"];
        let output = format!("of{h:e}");
        let run = run(&place, &command, &[], &output);
        (f64::from(h), finite(&place, &run, &output).unwrap())
    });
    let [(_, one), others @ ..] = results;
    for (h, other) in others {
        assert!(arrays(&other) == arrays(&one), "{h}");
        let distance = |results: &Results| results.number("/hausdorff_input_units/0/mean");
        let ratio = distance(&other) / (h * distance(&one));
        // Powers of two change no bit, but for conversions to millimetres.
        assert!((ratio - 1.0).abs() < 1e-12, "{h}: {ratio}");
    }
    place.write("a.nii", &volume(3.2, 1e-7));
    place.write("b.nii", &volume(3.2, 1e7));
    for name in ["a.nii", "b.nii"] {
        let run = run(&place, &["average", name, name, "--grid", "9"], &[], "out");
        assert!(finite(&place, &run, "out").is_none());
    }
}

/// Plates of a third of a spacing have no cell whose mean indicator is one half.
#[test]
fn plates_thinner_than_a_cell_have_a_doubtful_average() {
    let place = Place::new();
    for (name, side) in [("a.nii", 29), ("b.nii", 27)] {
        let inside = |i: usize| {
            let [x, y, z] = [i % 31, i / 31 % 31, i / 961].map(|x| x.abs_diff(15));
            u8::from(x.max(y) <= side / 2 && z == 0)
        };
        let labels: Vec<u8> = (0..31 * 31 * 31).map(inside).collect();
        place.write(name, &nifti([31; 3], [1.0; 3], &labels));
    }
    let command = [
        "average", "a.nii", "b.nii", "--align", "none", "--grid", "17",
    ];
    let run = run(&place, &command, &[], "out");
    let found = finite(&place, &run, "out").unwrap();
    assert_eq!(run.status.code(), Some(3));
    assert!(found.json.to_string().contains("thin_parts"));
    for shape in 0..2 {
        // The average is between plates whose areas differ by 14 %.
        let mean = found.number(&format!("/strain/{shape}/determinant/mean"));
        assert!((0.85..1.15).contains(&mean), "{mean}");
    }
}
