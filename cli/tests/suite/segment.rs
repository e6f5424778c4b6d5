//! `shapespace segment`: grey images in, edges and objects out.

use crate::common::{Place, Results, arrays, draw, grey_png, nifti, npy_f64, succeeded};

const NODES: &str = "65";

/// A noisy letter beside its mask.
fn noisy_letter(place: &Place) {
    draw(place, "mask.npy", &["letter", "b", "--grid", NODES]);
    let noise = ["--contrast", ".4", "--noise", ".05"];
    let letter = ["letter", "b", "--grid", NODES];
    draw(place, "grey.npy", &[&letter[..], &noise[..]].concat());
}

#[test]
fn a_noisy_letter_is_found() {
    let place = Place::new();
    noisy_letter(&place);
    // A folder stands for its files.
    std::fs::create_dir(place.path("truth")).unwrap();
    std::fs::copy(place.path("mask.npy"), place.path("truth/mask.npy")).unwrap();
    let run = place.run(&["segment", "grey.npy", "--truth", "truth", "-o", "out"]);
    let printed = succeeded(&run);
    assert!(printed.contains("Dice") && printed.trim_end().ends_with("segment.png"));
    let results = Results::read(&place.path("out"));
    // A letter of strokes six spacings wide: a boundary off by a tenth of one is 97 %.
    assert!(results.number("/mean_dice") > 0.97, "{printed}");
    assert_eq!(results.json["status"], "converged");
    let levels = results.json.pointer("/images/0/levels").unwrap();
    let levels = levels.as_array().unwrap();
    assert_eq!(levels.len(), 3);
    for level in levels {
        let energies = level["energies"].as_array().unwrap();
        let energies: Vec<f64> = energies.iter().map(|e| e.as_f64().unwrap()).collect();
        assert!(energies.windows(2).all(|pair| pair[1] <= pair[0]));
    }
    // The terms add up.
    let term = |name: &str| results.number(&format!("/images/0/energy/{name}"));
    let sum = term("fidelity") + term("smoothness") + term("edges");
    assert!((sum / term("total") - 1.0).abs() < 1e-12);
    for name in ["smoothed_000.npy", "phasefield_000.npy"] {
        let (shape, values) = results.array(name);
        assert_eq!(shape, [65, 65], "{name}");
        assert!(values.iter().all(|v| v.is_finite()));
    }
    let (shape, mask) = results.mask("mask_grey.npy");
    assert_eq!(shape, [65, 65]);
    let share = mask.iter().map(|&m| f64::from(m)).sum::<f64>() / mask.len() as f64;
    let area = results.number("/images/0/object/area");
    assert!((share - area).abs() < 0.01, "{share} {area}");
    for name in [
        "segment.png",
        "energy.svg",
        "energy.csv",
        "outline_grey.csv",
        "segment_000.vti",
    ] {
        assert!(results.path(name).is_file(), "{name}");
    }
    // The mask is an input of the other commands.
    succeeded(&place.compute(&[
        "average",
        "out/mask_grey.npy",
        "mask.npy",
        "--grid",
        "17",
        "-o",
        "two",
    ]));
}

#[test]
fn results_do_not_depend_on_threads() {
    let place = Place::new();
    noisy_letter(&place);
    let of = |threads: &str| {
        let out = format!("out{threads}");
        succeeded(&place.run(&["segment", "grey.npy", "--threads", threads, "-o", &out]));
        arrays(&Results::read(&place.path(&out)))
    };
    assert_eq!(of("1"), of("3"));
}

/// A dark disk on a bright ground, whose grey values are those of the file.
#[test]
fn a_dark_object_is_found_by_threshold_and_by_its_edges() {
    let place = Place::new();
    let disk = |x: i32, y: i32| (x - 30).pow(2) + (y - 24).pow(2) < 15 * 15;
    let grey: Vec<u8> = (0..60 * 48)
        .map(|i| if disk(i % 60, i / 60) { 90 } else { 200 })
        .collect();
    place.write("disk.png", &grey_png(60, 48, &grey));
    let area = std::f64::consts::PI * 225.0;
    let options = [
        vec!["--object", "dark"],
        vec!["--object", "dark", "--threshold", "145"],
        vec!["--object", "enclosed"],
        vec!["--object", "dark", "--classes", "2", "--largest"],
    ];
    for (k, options) in options.iter().enumerate() {
        let out = format!("out{k}");
        let fixed = ["segment", "disk.png", "--grid", "65", "-o", &out];
        succeeded(&place.run(&[&fixed[..], &options[..]].concat()));
        let results = Results::read(&place.path(&out));
        let found = results.number("/images/0/object/area_input_units");
        // Edges are found to a small part of a spacing, thresholds better still.
        assert!(
            (found / area - 1.0).abs() < 0.08,
            "{options:?}: {found} {area}"
        );
        assert_eq!(results.mask("mask_disk.npy").0, [48, 60]);
        // 59 spacings of the image are 64 of the grid; 47 are 51, and with it 52.
        assert_eq!(results.array("smoothed_000.npy").0, [53, 65]);
    }
    succeeded(&place.run(&["segment", "disk.png", "--object", "none", "-o", "edges"]));
    let results = Results::read(&place.path("edges"));
    assert!(results.json.pointer("/images/0/object").is_none());
    assert_eq!(results.number("/images/0/regions"), 2.0);
}

/// A disk that the picture shows in part: the verdict is that of other commands on its mask.
#[test]
fn an_object_that_is_cut_off_is_doubtful() {
    let place = Place::new();
    for (name, x, is_cut) in [("cut.png", 3, true), ("whole.png", 30, false)] {
        let disk = |i: i32| (i % 60 - x).pow(2) + (i / 60 - 24).pow(2) < 15 * 15;
        let grey: Vec<u8> = (0..60 * 48)
            .map(|i| if disk(i) { 200 } else { 90 })
            .collect();
        place.write(name, &grey_png(60, 48, &grey));
        let run = place.run(&["segment", name, "--grid", "65", "-o", &name[..3]]);
        assert_eq!(
            run.status.code(),
            Some(if is_cut { 3 } else { 0 }),
            "{name}"
        );
        let results = Results::read(&place.path(&name[..3]));
        let doubts = results.json["doubts"].as_array().unwrap();
        let causes: Vec<_> = doubts.iter().map(|doubt| &doubt["what"]).collect();
        assert_eq!(causes, if is_cut { vec!["border"] } else { vec![] });
    }
}

/// Samples far beyond all others are no class: the object is the disk, not the hot pixel.
#[test]
fn a_hot_pixel_is_no_object() {
    let place = Place::new();
    let side = 65;
    let disk = |k: usize| (k % side) as f64 - 32.0;
    let inside = |k: usize| disk(k).hypot((k / side) as f64 - 32.0) < 15.0;
    let mut values: Vec<f64> = (0..side * side)
        .map(|k| if inside(k) { 0.8 } else { 0.2 })
        .collect();
    values[3 * side + 3] = 50.0;
    place.write("hot.npy", &npy_f64(&[side, side], &values));
    succeeded(&place.compute(&["segment", "hot.npy", "-o", "out"]));
    let results = Results::read(&place.path("out"));
    let threshold = results.number("/images/0/object/threshold");
    assert!((0.3..0.7).contains(&threshold), "{threshold}");
    let (_, mask) = results.mask("mask_hot.npy");
    let wrong = mask
        .iter()
        .enumerate()
        .filter(|(k, m)| (**m == 1) != inside(*k));
    // But for the pixel itself and samples at the boundary.
    assert!(wrong.count() < 20);
}

#[test]
fn a_volume_is_segmented() {
    let place = Place::new();
    let ball = |i: i32| {
        let x = [i % 20, i / 20 % 16, i / 320].map(|k| f64::from(k) - 8.0);
        x.iter().map(|x| x * x).sum::<f64>() < 30.0
    };
    let grey: Vec<u8> = (0..20 * 16 * 16)
        .map(|i| if ball(i) { 180 } else { 60 + (i % 7) as u8 })
        .collect();
    place.write("ball.nii", &nifti([20, 16, 16], [1.0; 3], &grey));
    let smooth = ["--smooth", ".06"];
    let fixed = ["segment", "ball.nii", "--grid", "33", "-o", "out"];
    succeeded(&place.run(&[&fixed[..], &smooth[..]].concat()));
    let results = Results::read(&place.path("out"));
    let volume = results.number("/images/0/object/volume_input_units");
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 30f64.powf(1.5);
    // Sixteen voxels across half a ball's surface are what its volume is told by.
    assert!((volume / exact - 1.0).abs() < 0.1, "{volume} {exact}");
    assert_eq!(results.array("phasefield_000.npy").0, [29, 29, 33]);
}

#[test]
fn what_makes_no_sense_is_reported() {
    let place = Place::new();
    noisy_letter(&place);
    place.write("blank.png", &grey_png(9, 9, &[7; 81]));
    place.write(
        "small.png",
        &grey_png(4, 4, &[0, 9, 9, 9, 0, 9, 9, 9, 0, 9, 9, 9, 0, 9, 9, 9]),
    );
    let cases: [(&[&str], &str); 5] = [
        (&["blank.png"], "shows nothing"),
        (&["grey.npy", "--grid", "50"], "--grid 50 is not allowed"),
        (&["grey.npy", "--truth", "small.png"], "--truth"),
        (
            &["grey.npy", "grey.npy", "--truth", "mask.npy"],
            "give one for each",
        ),
        (
            &["grey.npy", "--object", "none", "--threshold", ".5"],
            "--threshold",
        ),
    ];
    for (arguments, word) in cases {
        let run = place.run(&[&["segment", "-o", "out"], arguments].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(word), "{report}");
        assert!(!place.path("out").exists());
    }
}

/// Groups, classes and pictures of other commands name subjects, not numbers.
#[test]
fn masks_have_the_names_of_their_images() {
    let place = Place::new();
    let picture = |radius: f64| {
        let pixel = |i: usize| {
            let [x, y] = [i % 32, i / 32].map(|k| k as f64 - 15.5);
            if x.hypot(y) < radius { 200 } else { 40 }
        };
        grey_png(32, 32, &(0..32 * 32).map(pixel).collect::<Vec<_>>())
    };
    for (folder, radius) in [("x", 8.0), ("y", 10.0)] {
        std::fs::create_dir(place.path(folder)).unwrap();
        place.write(&format!("{folder}/fish.png"), &picture(radius));
        place.write(
            &format!("{folder}/{folder}_bird.png"),
            &picture(radius + 1.0),
        );
    }
    let segmented = |inputs: [&str; 2], out: &str| {
        let fixed = ["--grid", "33", "-o", out];
        succeeded(&place.compute(&[&["segment"], &inputs[..], &fixed].concat()));
        let results = Results::read(&place.path(out));
        [0, 1].map(|i| {
            let object = &results.json["images"][i]["object"];
            let file = |key: &str| object[key].as_str().unwrap().to_owned();
            assert!(results.path(&file("boundary")).is_file());
            assert_eq!(results.mask(&file("mask")).0, [32, 32]);
            file("mask")
        })
    };
    let masks = segmented(["x/fish.png", "y/y_bird.png"], "named");
    assert_eq!(masks, ["mask_fish.npy", "mask_y_bird.npy"]);
    assert_eq!(
        segmented(["x/fish.png", "y/fish.png"], "numbered"),
        ["mask_fish_000.npy", "mask_fish_001.npy"]
    );
    let masks = masks.map(|mask| format!("named/{mask}"));
    let few = [
        "--grid",
        "17",
        "--max-iterations",
        "1",
        "-K",
        "1",
        "-o",
        "all",
    ];
    let inputs = [masks[0].as_str(), &masks[1]];
    succeeded(&place.compute(&[&["distances"], &inputs[..], &few].concat()));
    let table = std::fs::read_to_string(place.path("all/distances.csv")).unwrap();
    assert!(table.contains("fish") && table.contains("bird"), "{table}");
}
