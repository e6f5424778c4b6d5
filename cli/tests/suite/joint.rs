//! `shapespace average --joint`, `--mean median` and `--sweep`.

use std::path::Path;

use crate::common::solid::{SOLID, lattice, nifti_of};
use crate::common::{Place, Results, array, arrays, draw, drawn, grey_png, npy_f64, succeeded};

/// Two grey disks of different size.
fn grey_disks(place: &Place) -> [&'static str; 2] {
    for (name, radius) in [("a.npy", ".22"), ("b.npy", ".28")] {
        let disk = ["disk", "--radius", radius, "--grid", "33"];
        let grey = ["--contrast", ".6", "--noise", ".03"];
        draw(place, name, &[&disk[..], &grey[..]].concat());
    }
    ["a.npy", "b.npy"]
}

#[test]
fn images_are_averaged_with_their_edges() {
    let place = Place::new();
    let [a, b] = grey_disks(&place);
    let joint = ["average", "--joint", a, b, "--grid", "33"];
    let run = place.run(&[&joint[..], &["-o", "out"]].concat());
    let printed = succeeded(&run);
    assert!(printed.trim_end().ends_with("average.png"), "{printed}");
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["certificate"]["certified"], true);
    for level in results.json["levels"].as_array().unwrap() {
        let energies = level["energies"].as_array().unwrap();
        let energies: Vec<f64> = energies.iter().map(|e| e.as_f64().unwrap()).collect();
        // The average is solved for to 1e-7, which enters the energy squared.
        assert!(
            energies.windows(2).all(|w| w[1] <= w[0] * (1.0 + 1e-12)),
            "{energies:?}"
        );
    }
    // Brought onto each other the images differ less.
    assert!(results.number("/spread_after") < 0.5 * results.number("/spread_before"));
    for (name, shape) in [
        ("average.npy", vec![33, 33]),
        ("average_image.npy", vec![33, 33]),
        ("smoothed_001.npy", vec![33, 33]),
        ("phasefield_001.npy", vec![33, 33]),
        ("predicted_001.npy", vec![33, 33]),
        ("deformation_001.npy", vec![2, 33, 33]),
        ("norm_001.npy", vec![32, 32]),
        ("determinant_001.npy", vec![32, 32]),
    ] {
        let (found, values) = results.array(name);
        assert_eq!(found, shape, "{name}");
        assert!(values.iter().all(|v| v.is_finite()), "{name}");
    }
    // The average image is nearer to an image through its deformation than as it is. A third of the
    // difference is little to ask: boundaries here are as wide as the disks are apart.
    let (_, average) = results.array("average_image.npy");
    for i in 0..2 {
        let (_, smoothed) = results.array(&format!("smoothed_00{i}.npy"));
        let (_, predicted) = results.array(&format!("predicted_00{i}.npy"));
        let off = |image: &[f64]| -> f64 {
            let squares = smoothed.iter().zip(image).map(|(u, p)| (u - p).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let (through, as_it_is) = (off(&predicted), off(&average));
        assert!(through < as_it_is * 2.0 / 3.0, "{i}: {through} {as_it_is}");
    }
    let (_, determinant) = results.array("determinant_000.npy");
    // The smaller disk grows.
    assert!(
        determinant[16 * 32 + 16] > 1.05,
        "{}",
        determinant[16 * 32 + 16]
    );
    // The results do not depend on the threads.
    let threads = ["--threads", "3", "-o", "again"];
    succeeded(&place.run(&[&joint[..], &threads[..]].concat()));
    assert_eq!(
        arrays(&results),
        arrays(&Results::read(&place.path("again")))
    );
}

/// The average image has modes: here one, by which disks grow.
#[test]
fn images_have_modes() {
    let place = Place::new();
    let [a, b] = grey_disks(&place);
    let joint = ["average", "--joint", a, b, "--grid", "33", "-o", "average"];
    succeeded(&place.run(&joint));
    let printed = succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    assert!(printed.contains("modes/modes.png\n"), "{printed}");
    let results = Results::read(&place.path("modes"));
    assert_eq!(results.json["definite"], true);
    let ratios = results.numbers("/ratios");
    assert!(ratios.len() == 2 && ratios[1].abs() < 1e-8, "{ratios:?}");
    assert_eq!(results.number("/object_size"), 1.0);
    let (shape, mode) = results.array("mode_000.npy");
    assert_eq!(shape, [2, 33, 33]);
    // To both sides of the middle it points to or from it, alike.
    let (left, right) = (mode[16 * 33 + 8], mode[16 * 33 + 24]);
    assert!(left * right < 0.0, "{left} {right}");
    assert!((left + right).abs() < 0.2 * left.abs(), "{left} {right}");
    assert!(results.path("mode_000.apng").is_file());
    // They are not drawn at their scores.
    let groups = ["pca", "average", "--groups", "prefix", "-o", "grouped"];
    let run = place.run(&groups);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("average of images"));
    // Boundaries cannot be measured by them.
    let run = place.run(&["score", a, "--pca", "modes", "-o", "scored"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("images"));
}

/// Images of other sizes are placed in one scale, the middle of each in that of the box.
#[test]
fn images_may_differ_a_little_in_size() {
    let place = Place::new();
    for (name, nodes, radius) in [("a.png", "33", ".24"), ("b.png", "41", ".193")] {
        let disk = ["disk", "--radius", radius, "--grid", nodes];
        draw(&place, name, &[&disk[..], &["--contrast", ".6"]].concat());
    }
    let joint = ["average", "--joint", "a.png", "b.png", "--grid", "33"];
    succeeded(&place.run(&[&joint[..], &["-o", "out"]].concat()));
    let results = Results::read(&place.path("out"));
    let scale = |i: usize| results.number(&format!("/input/{i}/frame/scale"));
    assert_eq!(scale(0), scale(1));
    // The disks are as many samples wide, and lie on each other from the start.
    let area = |name: &str| {
        let (_, values) = results.array(name);
        let middle = 0.5 * (values[0] + values[values.len() / 2]);
        values.iter().filter(|v| **v > middle).count() as f64
    };
    let (first, second) = (area("smoothed_000.npy"), area("smoothed_001.npy"));
    assert!((first / second - 1.0).abs() < 0.1, "{first} {second}");
    assert!(results.number("/spread_before") < 0.05);
}

#[test]
fn options_that_do_not_go_together_are_reported() {
    let place = Place::new();
    let [a, b] = grey_disks(&place);
    place.write(
        "small.png",
        &grey_png(4, 4, &[0, 9, 0, 9, 0, 9, 0, 9, 0, 9, 0, 9, 0, 9, 0, 9]),
    );
    let cases: [(&[&str], &str); 6] = [
        (&["--joint", a], "at least 2"),
        (&["--joint", a, "small.png"], "small.png"),
        (&["--joint", a, b, "--weights", ".5,.5"], "--weights"),
        (&["--joint", a, b, "--align", "rigid"], "--align"),
        (&[a, b, "--contrast", ".3"], "add --joint"),
        (&[a, b, a, b, "--sweep", "3"], "--sweep"),
    ];
    for (arguments, word) in cases {
        let run = place.run(&[&["average", "-o", "out"], arguments].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(word), "{report}");
    }
}

/// A volume stored with its axes to the right, to the front and upwards, one with the first axis reversed, and
/// one with the axes in another order: the same samples.
fn stored(place: &Place) -> [&'static str; 3] {
    let (right, front, up) = ([1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.75]);
    let files = [
        ("ras.nii", [right, front, up], [17, 15, 13]),
        ("las.nii", [[-1.5, 0.0, 0.0], front, up], [17, 15, 13]),
        ("sra.nii", [up, right, front], [13, 17, 15]),
    ];
    files.map(|(name, axes, size)| {
        SOLID.write(place, name, size, &lattice(axes, size));
        name
    })
}

/// Volumes are averaged where they lie in the world, however they are stored.
#[test]
fn volumes_are_placed_by_their_affine_maps() {
    let place = Place::new();
    let [ras, las, sra] = stored(&place);
    let average = |inputs: &[&str], options: &[&str]| {
        // Where they lie does not depend on how far they are minimised.
        let common = ["average", "--joint", "--grid", "17", "--tolerance", "1e-2"];
        // So few nodes do not resolve the edges.
        succeeded(&place.compute(&[&common[..], inputs, options].concat()));
        Results::read(&place.path(options[options.len() - 1]))
    };
    let found = average(&[ras, las, sra], &["-o", "out"]);
    assert_eq!(found.json["parameters"]["frame"], "physical");
    let elastic = |results: &Results| -> f64 {
        let elastic = results.numbers("/energy/shapes/elastic");
        elastic.into_iter().fold(0.0, f64::max)
    };
    // What copies of one file give: the average has a length of its own, which moves its edges a little.
    for name in ["one.nii", "two.nii"] {
        std::fs::copy(place.path(ras), place.path(name)).unwrap();
    }
    let copies = average(&[ras, "one.nii", "two.nii"], &["-o", "copies"]);
    assert!(elastic(&copies) < 1e-8, "{}", elastic(&copies));
    assert!((elastic(&found) - elastic(&copies)).abs() < 1e-10);
    assert!(found.number("/spread_before") < 1e-6);
    assert_eq!(found.numbers("/world/spacing"), [1.5; 3]);
    assert_eq!(found.number("/spacing_input_units"), 1.5);
    // The grid begins at the first sample: 12 mm, 10.5 mm and 10.5 mm from the middle.
    let corner = [14.0 - 12.0, -30.0 - 10.5, 44.0 - 10.5];
    for (x, expected) in found.numbers("/world/origin").into_iter().zip(corner) {
        assert!((x - expected).abs() < 1e-5, "{x} {expected}");
    }
    // Without their affine maps, one is reflected: they differ, and have no common world.
    let ignored = average(&[ras, las], &["--frame", "none", "-o", "ignored"]);
    assert!(ignored.number("/spread_before") > 0.05);
    assert!(elastic(&ignored) > 1e-4, "{}", elastic(&ignored));
    assert!(ignored.json.get("world").is_none());
    // The box is that of whichever leads.
    let other = average(&[las, sra, ras], &["--like", "sra.nii", "-o", "other"]);
    assert_eq!(other.number("/world/of_input"), 1.0);
    let same = |a: &[f64], b: &[f64], most: f64| {
        assert_eq!(a.len(), b.len());
        let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        let largest = difference.fold(0.0, f64::max);
        assert!(largest < most, "{largest}");
    };
    let [first, second] = [&found, &other].map(|results| results.array("average_image.npy").1);
    same(&first, &second, 1e-6);
    // The average is written on the samples of the one that leads, and others are carried to it.
    let numbers = |name: &str| {
        let sources = shapespace_input::Sources::files();
        sources.read_numbers(&place.path(name)).unwrap()
    };
    succeeded(&place.compute(&[
        "warp",
        "out",
        las,
        "--shape",
        "1",
        "--interpolation",
        "linear",
        "-o",
        "there",
    ]));
    let (carried, original) = (numbers("there/las.nii.gz"), numbers(ras));
    assert_eq!(carried.size, original.size);
    // Edges are moved by the deformation of copies, by less than a thousandth of a sample.
    same(&carried.values, &original.values, 1e-3);
    let written = numbers("out/average.nii.gz");
    assert_eq!(
        (&written.size, written.affine),
        (&original.size, original.affine)
    );
    // Along x the samples are nodes.
    same(&written.values[..17], &first[..17], 1e-6);
    for name in ["average_phasefield", "warp_002", "inverse_warp_002"] {
        assert!(found.path(&format!("{name}.nii.gz")).is_file(), "{name}");
    }
    assert_eq!(numbers("other/average.nii.gz").size, numbers(sra).size);
}

/// Volumes that lie apart are refused, or each put into the middle.
#[test]
fn volumes_that_lie_apart_are_centred_when_asked() {
    let place = Place::new();
    let [ras, las, _] = stored(&place);
    let mut far = lattice(
        [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.75]],
        [17, 15, 13],
    );
    let numbers = |name: &str| -> Vec<f64> {
        let sources = shapespace_input::Sources::files();
        sources.read_numbers(&place.path(name)).unwrap().values
    };
    let values: Vec<f32> = numbers(ras).into_iter().map(|v| v as f32).collect();
    far[2][3] += 9.0;
    place.write("far.nii", &nifti_of([17, 15, 13], &far, &values));
    // An array of about the same extent in samples as the volumes in millimetres.
    let fine = [[1.2, 0.0, 0.0], [0.0, 1.2, 0.0], [0.0, 0.0, 1.2]];
    SOLID.write(
        &place,
        "fine.nii",
        [21, 19, 19],
        &lattice(fine, [21, 19, 19]),
    );
    place.write("nowhere.npy", &npy_f64(&[19, 19, 21], &numbers("fine.nii")));
    let cases: [(&[&str], &str); 5] = [
        (&[ras, "far.nii"], "'far.nii' shows less than two thirds"),
        (
            &[ras, "nowhere.npy", "--frame", "physical"],
            "'nowhere.npy' does not state",
        ),
        (&[ras, las, "--frame", "none", "--like", las], "--like"),
        (&[ras, las, "--like", "b.nii"], "--like"),
        (&[ras, las, "--invert"], "--invert"),
    ];
    let common = ["average", "--joint", "--grid", "17", "-o"];
    for (arguments, word) in cases {
        let run = place.run(&[&common[..], &["refused"], arguments].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(word), "{report}");
    }
    let centred = ["centred", ras, "far.nii", "--frame", "centred"];
    succeeded(&place.compute(&[&common[..], &centred].concat()));
    let found = Results::read(&place.path("centred"));
    assert!(found.number("/spread_before") < 1e-6);
    assert_eq!(found.number("/world/of_input"), 0.0);
    // The second input is carried from where it lies.
    succeeded(&place.compute(&["warp", "centred", "far.nii", "--shape", "1", "-o", "there"]));
    let carried = numbers("there/far.nii.gz");
    assert_eq!(carried.len(), values.len());
    for (a, b) in carried.iter().zip(&values) {
        assert!((a - f64::from(*b)).abs() < 1e-3, "{a} {b}");
    }
    // One without a place is centred, too.
    succeeded(&place.compute(&[&common[..], &["mixed", ras, "nowhere.npy"]].concat()));
    let mixed = Results::read(&place.path("mixed"));
    assert_eq!(mixed.json["parameters"]["frame"], "centred");
    assert!(mixed.json.get("world").is_none());
}

#[test]
fn a_sweep_begins_and_ends_at_its_shapes() {
    let place = Place::new();
    let files = drawn(&place, "bars", "2", "33");
    let fixed = ["average", &files[0], &files[1], "--grid", "33"];
    let sweep = ["--sweep", "3", "-o", "out"];
    let printed = succeeded(&place.compute(&[&fixed[..], &sweep[..]].concat()));
    // The doubts about shapes of weight 0 follow.
    assert!(printed.contains("out/sweep.png\n"), "{printed}");
    let results = Results::read(&place.path("out"));
    let averages = results.json["averages"].as_array().unwrap();
    assert_eq!(averages.len(), 3);
    for (i, file) in [(0, &files[0]), (2, &files[1])] {
        let name = format!("average_mask_{i:03}.npy");
        let (_, mask) = results.mask(&name);
        let (_, shape) = array(Path::new(file));
        let inside: Vec<bool> = mask.iter().map(|m| *m == 1).collect();
        let own: Vec<bool> = shape.iter().map(|s| *s > 0.5).collect();
        let count = |mask: &[bool]| mask.iter().filter(|m| **m).count();
        let both = inside.iter().zip(&own).filter(|(a, b)| **a && **b).count();
        let sum = count(&inside) + count(&own);
        let dice = 2.0 * both as f64 / sum as f64;
        assert!(dice > 0.99, "{name}: {dice}");
    }
}

#[test]
fn a_median_is_asked_for_by_name() {
    let place = Place::new();
    let files = drawn(&place, "stars", "2", "33");
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let options = ["--mean", "median", "--grid", "33", "-o", "out"];
    succeeded(&place.compute(&[&["average"], &files[..], &options[..]].concat()));
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["parameters"]["mean"], "median");
    assert!(results.number("/mean_dice") > 0.9);
}

/// A ring of lines, two pixels wide, and a bar across it.
fn drawing(place: &Place, name: &str, radius: f64, bright: bool) {
    let grey: Vec<u8> = (0..64 * 64)
        .map(|k| {
            let [x, y] = [k % 64, k / 64].map(|i| f64::from(i) - 31.5);
            let on = (x.hypot(y) - radius).abs() < 1.5 || y.abs() < 1.5 && x.abs() < radius;
            if on == bright { 255 } else { 0 }
        })
        .collect();
    place.write(name, &grey_png(64, 64, &grey));
}

#[test]
fn drawn_edges_are_averaged() {
    let place = Place::new();
    drawing(&place, "small.png", 14.0, true);
    drawing(&place, "large.png", 19.0, true);
    let common = ["average", "--joint", "--grid", "65", "--edges", "given"];
    let run = place.compute(&[&common[..], &["small.png", "large.png", "-o", "out"]].concat());
    let printed = succeeded(&run);
    let out = Results::read(&place.path("out"));
    assert_eq!(out.json["parameters"]["edges"], "given", "{printed}");
    assert_eq!(out.json["certificate"]["certified"], true);
    // The edges of the average: between the rings, and across.
    let (_, v) = out.array("average.npy");
    let at = |x: usize, y: usize| v[65 * y + x];
    let right = (40..60)
        .min_by(|a, b| at(*a, 45).total_cmp(&at(*b, 45)))
        .unwrap();
    let radius = ((right as f64 - 32.0).powi(2) + 13.0f64.powi(2)).sqrt();
    assert!((15.0..18.5).contains(&radius), "{radius}");
    assert!(at(32, 32) < 0.3 && at(32, 40) > 0.6 && at(4, 4) > 0.9);
    drawing(&place, "paper.png", 14.0, false);
    // A dot that is smaller than a cell of the grid.
    let dot: Vec<u8> = (0..64 * 64)
        .map(|k| 255 * u8::from(k == 64 * 30 + 30))
        .collect();
    place.write("dot.png", &grey_png(64, 64, &dot));
    for (name, said) in [("dot.png", "no line"), ("paper.png", "invert")] {
        let coarse = ["average", "--joint", "--grid", "17", "--edges", "given"];
        let run = place.run(&[&coarse[..], &[name, name, "-o", "no"]].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(said), "{report}");
    }
    let masks = [
        "average",
        "small.png",
        "large.png",
        "--edges",
        "given",
        "-o",
        "no",
    ];
    let run = place.run(&masks);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--joint"));
}
