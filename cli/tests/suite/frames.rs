//! Inputs lie where their files say, whatever the order, the directions and the distances of their
//! samples.

use levelset::{Contour, ContourDistance};
use shapespace_input::place::physical_frames;
use shapespace_input::{AnyImage, Image, ReadOptions, boundary, decode_image};

use crate::common::solid::{Affine, SOLID, Solid, lattice, mapped, nifti_of};
use crate::common::{Place, Results, grey_png, npy_f64, succeeded};

/// The side of a cube of samples of one millimetre that holds the solid.
const SIDE: usize = 34;

/// The 48 signed permutations of the axes, as lattices of one millimetre.
fn orientations() -> Vec<Affine> {
    let mut all = Vec::new();
    for order in [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ] {
        for signs in 0..8 {
            let axis = |j: usize| {
                let mut axis = [0.0; 3];
                axis[order[j]] = if signs >> j & 1 == 1 { -1.0 } else { 1.0 };
                axis
            };
            all.push(lattice([axis(0), axis(1), axis(2)], [SIDE; 3]));
        }
    }
    all
}

/// Lattices of other directions and distances: oblique, of unequal spacings, and sheared.
fn resampled() -> Vec<([usize; 3], Affine)> {
    let (c, s) = (30f64.to_radians().cos(), 30f64.to_radians().sin());
    let oblique = [[c, s, 0.0], [-s * c, c * c, s], [s * s, -c * s, c]];
    let fine = oblique.map(|axis| axis.map(|x| 0.8 * x));
    let flat = [[0.0, 0.0, 0.6], [0.7, 0.0, 0.0], [0.0, -1.2, 0.0]];
    let sheared = [[1.0, 0.0, 0.0], [0.4, 0.9, 0.0], [0.0, -0.2, 0.8]];
    let lattices = [
        ([48; 3], fine),
        ([56, 48, 30], flat),
        ([56, 44, 48], sheared),
    ];
    lattices
        .map(|(size, axes)| (size, lattice(axes, size)))
        .into()
}

fn read(bytes: &[u8]) -> Image<3> {
    match decode_image(bytes, "v.nii".as_ref(), &ReadOptions::default()).unwrap() {
        AnyImage::D3(image) => image.in_world().unwrap(),
        AnyImage::D2(_) => panic!("the file holds a volume"),
    }
}

/// The mean and the largest distance of the boundaries of images from that of the first, in
/// millimetres.
fn apart(images: &[Image<3>]) -> Vec<[f64; 2]> {
    let frames = physical_frames(images);
    let drawn: Vec<_> = images
        .iter()
        .zip(&frames)
        .map(|(image, frame)| boundary(image, frame).unwrap())
        .collect();
    let first = ContourDistance::new(&drawn[0]).unwrap();
    let of = |contour: &Contour<3>| {
        let points = contour.points().iter();
        let distances: Vec<f64> = points
            .map(|p| first.signed_distance(*p).abs() / frames[0].scale())
            .collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        [mean, distances.into_iter().fold(0.0, f64::max)]
    };
    drawn.iter().map(of).collect()
}

#[test]
fn one_object_in_all_orientations_has_one_boundary() {
    let grey: Vec<Image<3>> = orientations()
        .iter()
        .map(|affine| read(&SOLID.nifti([SIDE; 3], affine)))
        .collect();
    let largest = |images: &[Image<3>]| {
        apart(images)
            .iter()
            .fold(0.0, |most, d| f64::max(most, d[1]))
    };
    // The same samples in another order: rounding of coordinates of the box.
    assert!(largest(&grey) < 1e-12);
    // Every seventh has all orders of axes and all directions among them.
    let white: Vec<Image<3>> = grey
        .iter()
        .step_by(7)
        .map(|image| {
            let above = |value: f64| u8::from(value > 0.5);
            let values: Vec<u8> = image.values.iter().map(above).collect();
            Image {
                values: values.into(),
                ..image.clone()
            }
        })
        .collect();
    assert!(largest(&white) < 1e-12);
}

#[test]
fn resampled_copies_of_an_object_have_one_boundary() {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut lattices = vec![([SIDE; 3], lattice(identity, [SIDE; 3]))];
    lattices.extend(resampled());
    // Twice as fine.
    let images: Vec<Image<3>> = lattices
        .into_iter()
        .map(|(size, affine)| {
            let size = size.map(|n| 2 * n);
            let axis = |j: usize| [0, 1, 2].map(|i| 0.5 * affine[i][j]);
            read(&SOLID.nifti(size, &lattice([axis(0), axis(1), axis(2)], size)))
        })
        .collect();
    for [mean, largest] in apart(&images) {
        // .02 samples of .5 mm, and a fifth of one: chords of .7 mm on a ball of 4 mm are up to
        // .02 mm inside of it, and several times as far where balls are joined.
        assert!(mean < 0.01, "{mean}");
        assert!(largest < 0.1, "{largest}");
    }
}

const COPIES: [&str; 4] = ["plain.nii", "turned.nii", "oblique.nii", "sheared.nii"];

/// Copies of a solid: as it is, in another order of axes that is a reflection, oblique and sheared.
fn copies(place: &Place, solid: &Solid, prefix: &str) -> Vec<String> {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let others = resampled();
    let lattices = [
        ([SIDE; 3], lattice(identity, [SIDE; 3])),
        ([SIDE; 3], orientations()[21]),
        others[0],
        others[2],
    ];
    let written = COPIES.iter().zip(lattices).map(|(name, (size, affine))| {
        let name = format!("{prefix}{name}");
        solid.write(place, &name, size, &affine);
        name
    });
    written.collect()
}

#[test]
fn copies_of_one_object_have_their_own_average() {
    let place = Place::new();
    let copies = copies(&place, &SOLID, "");
    for align in ["none", "rigid"] {
        let mut arguments = vec!["average"];
        arguments.extend(copies.iter().map(String::as_str));
        arguments.extend(["--grid", "33", "--align", align, "-o", align]);
        arguments.extend(["--tolerance", "0.02"]);
        succeeded(&place.run(&arguments));
        let found = Results::read(&place.path(align));
        assert_eq!(found.json["parameters"]["frame"], "physical");
        let volume = |i| found.number(&format!("/input/{i}/volume_input_units"));
        for i in 0..4 {
            // Chords cut off .01 mm or a little more of a ball of 7 mm: .5 %.
            assert!((volume(i) / volume(0) - 1.0).abs() < 6e-3, "{}", volume(i));
            let mean = found.number(&format!("/hausdorff_input_units/{i}/mean"));
            // Chords, and what the elastic energy leaves of the differences that they make.
            assert!(mean < 0.04, "{align}, {i}: {mean} mm");
            if align == "rigid" {
                let of = |key| found.number(&format!("/input/{i}/alignment/{key}"));
                assert!(of("moved_mm") < 0.02, "{i}: {} mm", of("moved_mm"));
                assert!(of("angle_degrees") < 0.1, "{i}: {}", of("angle_degrees"));
            }
        }
        check_world(&found);
    }
}

/// The mask of an average in the world is where the solid is.
fn check_world(found: &Results) {
    let [origin, spacing] = ["/world/origin", "/world/spacing"].map(|key| found.numbers(key));
    let (shape, mask) = found.mask("average_mask.npy");
    assert_eq!(shape, [33, 33, 33]);
    let (mut centre, mut count) = ([0.0; 3], 0.0);
    let (mut expected, mut whole) = ([0.0; 3], 0.0);
    for (index, value) in mask.iter().enumerate() {
        let node = [index % 33, index / 33 % 33, index / (33 * 33)];
        let p: [f64; 3] = std::array::from_fn(|k| origin[k] + node[k] as f64 * spacing[k]);
        let share = SOLID.value(p, spacing[0] / 2.0);
        for k in 0..3 {
            centre[k] += f64::from(*value) * p[k];
            expected[k] += share * p[k];
        }
        count += f64::from(*value);
        whole += share;
    }
    for k in 0..3 {
        // A mask of 2500 nodes: its centre is known to a hundredth of their distance of .85 mm.
        let difference = centre[k] / count - expected[k] / whole;
        assert!(difference.abs() < 0.05, "axis {k}: {difference}");
    }
}

/// Runs of the other commands on copies must give what they give on the originals.
#[test]
fn modes_scores_and_distances_do_not_depend_on_the_lattice() {
    let place = Place::new();
    let solids = [-1.0, 0.0, 1.2, 0.6].map(|swelling| Solid { swelling, ..SOLID });
    let files: Vec<Vec<String>> = solids
        .iter()
        .enumerate()
        .map(|(i, solid)| copies(&place, solid, &format!("{i}_")))
        .collect();
    // The second run has another lattice for each shape.
    let chosen = [[0, 0, 0, 0], [1, 2, 3, 2]].map(|which| {
        let names = which
            .iter()
            .zip(&files)
            .map(|(&copy, files)| files[copy].as_str());
        names.collect::<Vec<_>>()
    });
    let mut found = Vec::new();
    for (run, names) in chosen.iter().enumerate() {
        let out = |what: &str| format!("{what}{run}");
        let common = ["--grid", "17", "--align", "none"];
        let three = &names[..3];
        let run_all = |arguments: &[&str]| succeeded(&place.compute(arguments));
        run_all(&[&["average"], three, &common, &["-o", &out("average")]].concat());
        run_all(&["pca", &out("average"), "-o", &out("pca")]);
        run_all(&["score", names[3], "--pca", &out("pca"), "-o", &out("score")]);
        run_all(
            &[
                &["geodesic"],
                &names[..2],
                &common,
                &["-K", "2", "-o", &out("geodesic")],
            ]
            .concat(),
        );
        run_all(
            &[
                &["distances"],
                &names[..2],
                &common,
                &["-K", "1", "-o", &out("distances")],
            ]
            .concat(),
        );
        let results = |what: &str| Results::read(&place.path(&out(what)));
        let row = |i: usize| results("distances").numbers(&format!("/distances/matrix/{i}"));
        found.push([
            results("pca").numbers("/eigenvalues"),
            results("score").numbers("/scores/0"),
            vec![results("geodesic").number("/length")],
            row(0),
        ]);
    }
    println!("{found:.4?}");
    let [first, second] = [&found[0], &found[1]];
    for (a, b) in first.iter().flatten().zip(second.iter().flatten()) {
        assert!(
            (a - b).abs() < 0.1 * a.abs().max(0.05),
            "{a} {b}: {found:?}"
        );
    }
}

/// Scores are those of a minimum, which does not depend on the order of additions.
#[test]
fn scores_do_not_depend_on_the_order_of_samples() {
    let place = Place::new();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let affine = lattice(identity, [SIDE; 3]);
    let names = ["a.nii", "b.nii", "c.nii", "d.nii"];
    for (name, swelling) in names.iter().zip([-1.0, 0.0, 1.2, 0.6]) {
        Solid { swelling, ..SOLID }.write(&place, name, [SIDE; 3], &affine);
    }
    // The first axis is the last one, reversed.
    let reversed = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
    let solid = Solid {
        swelling: 0.6,
        ..SOLID
    };
    solid.write(
        &place,
        "reversed.nii",
        [SIDE; 3],
        &lattice(reversed, [SIDE; 3]),
    );
    let average = [
        "average", "a.nii", "b.nii", "c.nii", "--grid", "17", "--align", "none",
    ];
    succeeded(&place.compute(&[&average[..], &["-o", "average"]].concat()));
    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let score = [
        "score",
        "d.nii",
        "reversed.nii",
        "--pca",
        "modes",
        "-o",
        "out",
    ];
    succeeded(&place.compute(&score));
    let found = Results::read(&place.path("out"));
    let [one, other] = [0, 1].map(|i| found.numbers(&format!("/scores/{i}")));
    println!("{one:?} {other:?} {:?}", found.numbers("/elastic"));
    for (a, b) in one.iter().zip(&other) {
        assert!((a - b).abs() < 0.02, "{one:?} {other:?}");
    }
}

/// One file in another unit of length, which is named, and not the others that it would make vanish.
#[test]
fn an_input_in_another_unit_is_named() {
    let place = Place::new();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let affine = lattice(identity, [SIDE; 3]);
    let values: Vec<f32> = (0..SIDE.pow(3))
        .map(|i| {
            let sample = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|i| i as f64);
            SOLID.value(mapped(&affine, sample), 1.0) as f32
        })
        .collect();
    let write = |name: &str, factor: f64| {
        let scaled = affine.map(|row| row.map(|x| factor * x));
        place.write(name, &nifti_of([SIDE; 3], &scaled, &values));
    };
    for (name, factor) in [("a.nii", 1.0), ("metres.nii", 1e-3), ("absurd.nii", 1e5)] {
        write(name, factor);
    }
    let average = |other: &str, options: &[&str]| {
        let inputs = ["average", "a.nii", other, "--grid", "17", "-o", "out"];
        let run = place.compute(&[&inputs[..], options].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        (run.status.code(), report)
    };
    for (other, words) in [
        (
            "metres.nii",
            ["1000 times as short", "its lengths look like metres"],
        ),
        (
            "absurd.nii",
            ["100000 times as long", "its lengths are not millimetres"],
        ),
    ] {
        for options in [&[][..], &["--align", "none"], &["--frame", "centred"]] {
            let (code, report) = average(other, options);
            assert_eq!(code, Some(2), "{report}");
            assert!(report.contains(&format!("'{other}'")), "{report}");
            for words in words {
                assert!(report.contains(words), "{words}: {report}");
            }
        }
    }
    let (code, report) = average("metres.nii", &["--size", "equal"]);
    assert!(matches!(code, Some(0 | 3)), "{report}");
}

#[test]
fn a_mirror_image_is_named() {
    let place = Place::new();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let affine = lattice(identity, [SIDE; 3]);
    let reflected = Solid {
        reflected: true,
        ..SOLID
    };
    for (name, solid) in [
        ("a.nii", SOLID),
        (
            "b.nii",
            Solid {
                swelling: 0.2,
                ..SOLID
            },
        ),
        ("mirrored.nii", reflected),
    ] {
        solid.write(&place, name, [SIDE; 3], &affine);
    }
    for align in ["none", "rigid"] {
        let inputs = ["a.nii", "b.nii", "mirrored.nii"];
        let options = [
            "--grid",
            "17",
            "--align",
            align,
            "--max-iterations",
            "3",
            "-o",
            align,
        ];
        place.compute(&[&["average"], &inputs[..], &options].concat());
        let found = Results::read(&place.path(align));
        let doubts = found.json["doubts"].as_array().unwrap();
        let named: Vec<_> = doubts
            .iter()
            .filter(|doubt| doubt["what"] == "reflection")
            .collect();
        assert_eq!(named.len(), 1, "{align}: {doubts:?}");
        assert_eq!(named[0]["shape"], "mirrored");
    }
}

/// Results of inputs without a place have no world that one of them could state.
#[test]
fn like_is_refused_without_a_world() {
    let place = Place::new();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let affine = lattice(identity, [SIDE; 3]);
    for name in ["a.nii", "b.nii"] {
        SOLID.write(&place, name, [SIDE; 3], &affine);
    }
    for command in ["average", "geodesic"] {
        let options = [
            "--frame", "none", "--like", "b.nii", "--grid", "17", "-o", "out",
        ];
        let run = place.run(&[&[command, "a.nii", "b.nii"], &options[..]].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{command}: {report}");
        assert!(report.contains("--like"), "{command}: {report}");
    }
}

#[test]
fn frames_are_chosen_by_what_files_state() {
    let place = Place::new();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let near = lattice(identity, [SIDE; 3]);
    SOLID.write(&place, "near.nii", [SIDE; 3], &near);
    // The same samples, stated to lie 60 mm further to the right.
    let mut far = near;
    far[0][3] += 60.0;
    let samples: Vec<f32> = {
        let bytes = SOLID.nifti([SIDE; 3], &near);
        let numbers = bytes[352..].chunks_exact(4);
        numbers
            .map(|raw| f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]))
            .collect()
    };
    place.write("far.nii", &nifti_of([SIDE; 3], &far, &samples));
    let values: Vec<f64> = samples.iter().map(|v| f64::from(*v)).collect();
    place.write("nowhere.npy", &npy_f64(&[SIDE; 3], &values));
    let average = |names: &[&str], options: &[&str], out: &str| {
        let common = ["--grid", "17", "--max-iterations", "1", "-o", out];
        place.compute(&[&["average"], names, options, &common].concat());
        Results::read(&place.path(out))
    };
    let far_apart = average(&["near.nii", "far.nii"], &[], "far");
    assert_eq!(far_apart.json["parameters"]["align"], "rigid");
    let moved = [0, 1].map(|i| far_apart.number(&format!("/input/{i}/alignment/moved_mm")));
    assert!((moved[0] + moved[1] - 60.0).abs() < 1e-3, "{moved:?}");
    // A box of both at their places would have 60 mm more.
    let scale = |found: &Results| found.number("/input/0/frame/scale");
    let kept = average(&["near.nii", "far.nii"], &["--align", "none"], "kept");
    assert!(scale(&far_apart) > 2.0 * scale(&kept));
    let mixed = average(&["near.nii", "nowhere.npy"], &["--align", "none"], "mixed");
    assert_eq!(mixed.json["parameters"]["frame"], "centred");
    assert!(mixed.json.get("world").is_none());
    let plain = average(&["nowhere.npy", "nowhere.npy"], &[], "plain");
    assert_eq!(plain.json["parameters"]["frame"], "none");
    for (options, expected) in [
        (&["--frame", "physical"][..], "nowhere.npy"),
        (&["--frame", "physical", "--size", "equal"], "nowhere.npy"),
    ] {
        let common = ["average", "near.nii", "nowhere.npy", "-o", "refused"];
        let run = place.run(&[&common, options].concat());
        let report = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(
            report.contains(expected) && report.contains("--frame centred"),
            "{report}"
        );
    }
}

/// An ellipsoid of three axes in slices of nearly half the shortest one fits the same with fine slices as well when it is
/// turned by half a turn, but for the steps of its slices.
#[test]
fn thick_slices_do_not_turn_a_symmetric_object() {
    let place = Place::new();
    let write = |name: &str, size: [usize; 3], spacing: [f64; 3]| {
        let [a, b, c] = spacing;
        let affine = lattice([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]], size);
        let middle = |k: usize| spacing[k] * (size[k] - 1) as f64 / 2.0;
        let mut values = Vec::new();
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let at = |i: usize, k: usize| spacing[k] * i as f64 - middle(k);
                    let squares = (at(x, 0) / 24.0).powi(2)
                        + (at(y, 1) / 16.0).powi(2)
                        + (at(z, 2) / 14.0).powi(2);
                    values.push(if squares < 1.0 { 1.0 } else { 0.0 });
                }
            }
        }
        place.write(name, &nifti_of(size, &affine, &values));
    };
    write("fine.nii", [60, 50, 50], [1.0; 3]);
    write("thick.nii", [60, 50, 9], [1.0, 1.0, 6.0]);
    let options = ["--align", "rigid", "--grid", "33", "-o", "out"];
    place.compute(&[&["average", "fine.nii", "thick.nii"], &options[..]].concat());
    let found = Results::read(&place.path("out"));
    for i in 0..2 {
        let degrees = found.number(&format!("/input/{i}/alignment/angle_degrees"));
        assert!(degrees < 3.0, "{i}: {degrees}");
    }
}

/// Two pictures of one disk, of which the second is larger and shows it elsewhere.
fn disks(place: &Place) -> [[f64; 2]; 2] {
    let (sizes, middles) = ([[60, 40], [80, 50]], [[18.0, 20.0], [55.0, 28.0]]);
    for (k, name) in ["a.png", "b.png"].into_iter().enumerate() {
        let [width, height] = sizes[k];
        let grey = |i: u32| {
            let place = [f64::from(i % width), f64::from(i / width)];
            let far = (place[0] - middles[k][0]).hypot(place[1] - middles[k][1]);
            (255.0 * (10.5 - far).clamp(0.0, 1.0)) as u8
        };
        let grey: Vec<u8> = (0..width * height).map(grey).collect();
        place.write(name, &grey_png(width, height, &grey));
    }
    middles
}

/// The middle of the points of a curve in a table.
fn middle(path: &std::path::Path) -> [f64; 2] {
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let numbers: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
        [numbers[numbers.len() - 2], numbers[numbers.len() - 1]]
    });
    let rows: Vec<[f64; 2]> = rows.collect();
    [0, 1].map(|k| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64)
}

/// Without an alignment objects lie where the pixels say.
#[test]
fn pictures_keep_their_positions_without_an_alignment() {
    let place = Place::new();
    let [a, b] = disks(&place);
    let run = |command: &[&str], options: &[&str], out: &str| {
        let common = ["--grid", "33", "--threads", "1", "-o", out];
        succeeded(&place.compute(&[command, options, &common].concat()));
        Results::read(&place.path(out))
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
        // Half a spacing of the grid; each disk moves by seven.
        assert!(off < 1.3, "{found:?}, not {expected:?}");
    };
    let average = ["average", "a.png", "b.png"];
    let kept = run(&average, &["--align", "none"], "kept");
    let between = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
    near(middle(&kept.path("average_outline.csv")), between);
    // The box around both disks is 37 samples and a diameter of 19 long.
    let scale = kept.number("/input/0/frame/scale");
    assert!((scale * 56.0 - 0.7).abs() < 1e-9, "{scale}");
    assert_eq!(scale, kept.number("/input/1/frame/scale"));
    let aligned = run(&average, &["--align", "rigid"], "aligned");
    near(middle(&aligned.path("average_outline.csv")), a);
    let path = ["geodesic", "a.png", "b.png", "-K", "2"];
    let kept = run(&path, &["--align", "none"], "path");
    // What is between costs next to nothing, wherever it is.
    for (shape, expected) in [("000", a), ("002", b)] {
        let outline = format!("shape_{shape}_outline.csv");
        near(middle(&kept.path(&outline)), expected);
    }
    // The configuration of a result gives the same one.
    let config = kept.path("config.toml");
    let again = [
        "geodesic",
        "--config",
        config.to_str().unwrap(),
        "-o",
        "again",
    ];
    succeeded(&place.compute(&again));
    let again = Results::read(&place.path("again"));
    assert_eq!(again.number("/length"), kept.number("/length"));
}
