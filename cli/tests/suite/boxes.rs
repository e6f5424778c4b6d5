//! Grids of boxes: of given nodes, of given spacing, and around the shapes.
//!
//! A box that fits has the spacing of the cube and nodes of it, so that results are compared at the
//! same nodes. They differ by what the void beyond the box contributes. Its stiffness is 1e-4 of that of
//! the shapes.

use crate::average::averaged;
use crate::common::solid::{Affine, nifti_of};
use crate::common::{Place, Results, grey_png, npy_f64, picture_size, succeeded};

/// Samples of pictures of rods along `x` and `y`.
const SIZE: [usize; 2] = [120, 80];
/// Minimisations to nearly the end, so that they differ in their energies, not in where they stop.
const EXACT: [&str; 4] = ["--tolerance", "1e-6", "--max-iterations", "1000"];

/// Inside a rod along `x` about the middle of a box, with a knob: a ramp of two samples.
fn rod([x, y]: [f64; 2], half_length: f64, radius: f64, knob: f64) -> f64 {
    let along = (x.abs() - half_length).max(0.0);
    let body = radius - along.hypot(y);
    let end = 1.4 * radius - (x - knob).hypot(y - 0.8 * radius);
    (0.5 + 0.5 * body.max(end)).clamp(0.0, 1.0)
}

/// Two rods as pictures.
fn rods(place: &Place) -> Vec<String> {
    draw_rod(place, "long.png", [38.0, 7.0, 20.0], false);
    draw_rod(place, "thick.png", [33.0, 9.0, 6.0], false);
    ["long.png", "thick.png"].map(String::from).into()
}

/// A rod of this half length, radius and place of the knob as a picture, along `y` if it is turned.
fn draw_rod(place: &Place, name: &str, [length, radius, knob]: [f64; 3], turned: bool) {
    let [w, h] = if turned { [SIZE[1], SIZE[0]] } else { SIZE };
    let grey = (0..w * h).map(|i| {
        let [x, y] = [i % w, i / w].map(|x| x as f64);
        let p = [x - 0.5 * (w - 1) as f64, y - 0.5 * (h - 1) as f64];
        // A rotation, no reflection.
        let p = if turned { [p[1], -p[0]] } else { p };
        (255.0 * rod(p, length, radius, knob)).round() as u8
    });
    let grey: Vec<u8> = grey.collect();
    place.write(name, &grey_png(w as u32, h as u32, &grey));
}

/// The volumes of two rods, of half a millimetre a sample, anywhere in the world.
fn solid_rods(place: &Place) -> Vec<String> {
    let size = [88, 40, 36];
    let affine: Affine = [
        [0.5, 0.0, 0.0, -70.0],
        [0.0, 0.5, 0.0, 12.0],
        [0.0, 0.0, 0.5, 30.0],
    ];
    let shapes = [("long", 30.0, 7.0, 14.0), ("thick", 27.0, 8.5, 4.0)];
    draw_solids(place, size, &affine, &shapes)
}

/// Rods of these names, half lengths, radii and places of the knob as volumes.
fn draw_solids(
    place: &Place,
    size: [usize; 3],
    affine: &Affine,
    shapes: &[(&str, f64, f64, f64)],
) -> Vec<String> {
    let draw = |&(name, length, radius, knob): &(&str, f64, f64, f64)| {
        let values = (0..size.iter().product()).map(|i: usize| {
            let at = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let [x, y, z] = [0, 1, 2].map(|k| at[k] as f64 - 0.5 * (size[k] - 1) as f64);
            rod([x, y.hypot(z)], length, radius, knob) as f32
        });
        let name = format!("{name}.nii");
        place.write(&name, &nifti_of(size, affine, &values.collect::<Vec<_>>()));
        name
    };
    shapes.iter().map(draw).collect()
}

fn nodes(results: &Results) -> Vec<usize> {
    let nodes = results.numbers("/nodes");
    nodes.into_iter().map(|n| n as usize).collect()
}

/// The values of an array on a cube at the nodes of a box in its middle.
fn middle(cube: &[f64], n: &[usize], own: &[usize]) -> Vec<f64> {
    let count = own.iter().product();
    let value = |mut index: usize| {
        let (mut at, mut stride) = (0, 1);
        for (all, own) in n.iter().zip(own) {
            assert_eq!((all - own) % 2, 0);
            at += stride * (index % own + (all - own) / 2);
            index /= own;
            stride *= all;
        }
        cube[at]
    };
    (0..count).map(value).collect()
}

/// The mean and the largest difference of an array of two results at common nodes.
fn apart(cube: &Results, fit: &Results, name: &str) -> [f64; 2] {
    let ((_, all), (_, own)) = (cube.array(name), fit.array(name));
    let all = middle(&all, &nodes(cube), &nodes(fit));
    assert_eq!(all.len(), own.len());
    let differences: Vec<f64> = all.iter().zip(&own).map(|(a, b)| (a - b).abs()).collect();
    let most = differences.iter().copied().fold(0.0, f64::max);
    [differences.iter().sum::<f64>() / own.len() as f64, most]
}

fn run(place: &Place, command: &str, inputs: &[String], options: &[&str]) -> Results {
    let output = options.last().unwrap();
    let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
    succeeded(&place.compute(&[&[command], &inputs[..], options].concat()));
    Results::read(&place.path(output))
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

#[test]
fn averages_and_modes_in_a_box_that_fits_are_those_of_the_cube() {
    let place = Place::new();
    let inputs = rods(&place);
    let options = [&EXACT[..], &["--grid", "65", "--align", "none"]].concat();
    let cube = averaged(&place, &inputs, &options, "cube");
    let boxed = [&options[..], &["--box", "fit"]].concat();
    let fit = averaged(&place, &inputs, &boxed, "fit");
    // The rods are 23 by 77 samples long; with a room of .15 and rounded up to eighths.
    assert_eq!((nodes(&cube), nodes(&fit)), (vec![65, 65], vec![65, 41]));
    assert_eq!(fit.json["spacing"], cube.json["spacing"]);
    // Energies of void are 1e-4 of those of the shapes for equal strains, and there is several times as
    // much void as shape.
    let elastic = |results: &Results| results.numbers("/energy/elastic").iter().sum::<f64>();
    let energies = [elastic(&cube), elastic(&fit)];
    assert!(relative(energies[0], energies[1]) < 1e-3, "{energies:?}");
    let area = "/average/area_input_units";
    assert!(relative(cube.number(area), fit.number(area)) < 1e-3);
    // Interfaces, where values change by 1 over two spacings, moved by hundredths of a spacing.
    let [mean, most] = apart(&cube, &fit, "average.npy");
    assert!(mean < 1e-3 && most < 2e-2, "{mean} {most}");
    // The cost is one of nodes.
    let displacements = "/memory_estimate/displacements";
    let share = fit.number(displacements) / cube.number(displacements);
    assert!((share - 41.0 / 65.0).abs() < 1e-12, "{share}");
    let heights = [&cube, &fit].map(|results| picture_size(&results.path("average.png"))[1]);
    assert!(4 * heights[1] < 3 * heights[0], "{heights:?}");

    let modes = ["cube", "fit"].map(|result| {
        let output = format!("modes_{result}");
        succeeded(&place.compute(&["pca", result, "-o", &output]));
        Results::read(&place.path(&output)).numbers("/eigenvalues")[0]
    });
    assert!(relative(modes[0], modes[1]) < 2e-3, "{modes:?}");

    // A new shape lies across the box, in which there is no room for it, before it is aligned.
    draw_rod(&place, "upright.png", [35.0, 8.0, 15.0], true);
    let scores = ["cube", "fit"].map(|result| {
        let (modes, output) = (format!("modes_{result}"), format!("score_{result}"));
        let score = ["score", "upright.png", "--pca", &modes, "--align", "rigid"];
        succeeded(&place.compute(&[&score[..], &["-o", &output]].concat()));
        let scored = Results::read(&place.path(&output));
        let overlap = scored.numbers("/dice")[0];
        assert!(overlap > 0.98, "{result}: {overlap}");
        let scores = scored.json["scores"][0].clone();
        scores[0].as_f64().unwrap()
    });
    // Scores are of size one; the shape is matched to the tolerance of the minimiser.
    assert!((scores[0] - scores[1]).abs() < 0.02, "{scores:?}");
}

#[test]
fn geodesics_in_a_box_that_fits_are_those_of_the_cube() {
    let place = Place::new();
    let inputs = rods(&place);
    let path = |form: &str, sides: &str| {
        let output = format!("{form}_{sides}");
        let common = ["--grid", "33", "--align", "none", "-K", "2"];
        let own = ["--form", form, "--box", sides, "-o", &output];
        run(&place, "geodesic", &inputs, &[&common[..], &own].concat())
    };
    // The metric of level sets includes how these are continued into the void.
    for (form, tolerance) in [("lagrangian", 1e-3), ("level-sets", 1e-2)] {
        let [cube, fit] = ["cube", "fit"].map(|sides| path(form, sides));
        assert_eq!((nodes(&cube), nodes(&fit)), (vec![33, 33], vec![33, 21]));
        // The form may deform the end shape: its start has the error of the minimisation.
        assert!(apart(&cube, &fit, "shape_000.npy")[1] < 1e-3, "{form}");
        let lengths = [&cube, &fit].map(|results| results.number("/length"));
        assert!(
            relative(lengths[0], lengths[1]) < tolerance,
            "{form} {lengths:?}"
        );
        checked(&place, &format!("{form}_fit"));
    }
    let extend = ["extend", "lagrangian_fit", "--steps", "1", "-o", "further"];
    succeeded(&place.compute(&extend));
    let further = Results::read(&place.path("further"));
    assert_eq!(nodes(&further), [33, 21]);
    checked(&place, "further");
}

/// The program finds a result as its record states it.
fn checked(place: &Place, result: &str) {
    let check = place.run(&["check", result]);
    let report = String::from_utf8_lossy(&check.stdout);
    assert!(matches!(check.status.code(), Some(0 | 3)), "{report}");
}

#[test]
fn distances_of_pairs_have_one_box() {
    let place = Place::new();
    let inputs = rods(&place);
    let distance = |options: &[&str], output: &str| {
        let common = ["--grid", "33", "-K", "1", "--align", "rigid"];
        let found = run(
            &place,
            "distances",
            &inputs,
            &[&common[..], options, &["-o", output]].concat(),
        );
        let row = found.json["distances"]["matrix"][0].clone();
        (row[1].as_f64().unwrap(), nodes(&found))
    };
    let (cube, _) = distance(&[], "cube");
    let (fit, sides) = distance(&["--box", "fit"], "fit");
    assert_eq!(sides, [33, 17]);
    assert!(relative(cube, fit) < 1e-3, "{cube} {fit}");
}

/// Before anything is computed, and not where the advice is followed.
#[test]
fn a_cube_that_is_mostly_void_is_named() {
    let place = Place::new();
    let affine = [
        [0.5, 0.0, 0.0, -70.0],
        [0.0, 0.5, 0.0, 12.0],
        [0.0, 0.0, 0.5, 30.0],
    ];
    let thin = [("long", 38.0, 4.0, 14.0), ("short", 34.0, 4.5, 4.0)];
    let inputs = draw_solids(&place, [100, 26, 26], &affine, &thin);
    let advised = |options: &[&str], output: &str| {
        let inputs = [inputs[0].as_str(), inputs[1].as_str()];
        let short = ["--max-iterations", "1", "--align", "none", "-o", output];
        let run = place.compute(&[&["average"], &inputs[..], options, &short].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        (report.contains("--box fit would take"), report)
    };
    let (is_advised, report) = advised(&["--grid", "33"], "cube");
    assert!(is_advised, "{report}");
    let words = "--box fit would take 9537 nodes instead of 35937";
    assert!(report.contains(words), "{report}");
    // A small cube takes no time.
    for (k, options) in [&["--grid", "33", "--box", "fit"][..], &["--grid", "17"]]
        .into_iter()
        .enumerate()
    {
        let (is_advised, report) = advised(options, &format!("other{k}"));
        assert!(!is_advised, "{report}");
    }
}

#[test]
fn volumes_have_their_spacing_and_their_place_in_millimetres() {
    let place = Place::new();
    let inputs = solid_rods(&place);
    let average = |options: &[&str], output: &str| {
        let options = [options, &["--align", "none", "-o", output]].concat();
        run(&place, "average", &inputs, &options)
    };
    let cube = average(&["--grid", "17"], "cube");
    let fit = average(&["--grid", "17", "--box", "fit"], "fit");
    assert_eq!((nodes(&cube), nodes(&fit)), (vec![17; 3], vec![17, 13, 13]));
    let volumes = [&cube, &fit].map(|r| r.number("/average/volume_input_units"));
    assert!(relative(volumes[0], volumes[1]) < 1e-2, "{volumes:?}");
    // The first node of the box is a node of the cube, two from its corner.
    let spacing = fit.number("/spacing_input_units");
    assert_eq!(fit.numbers("/world/spacing"), [spacing; 3]);
    let [whole, part] = [&cube, &fit].map(|r| r.numbers("/world/origin"));
    for (k, cells) in [0.0, 2.0, 2.0].into_iter().enumerate() {
        let moved = part[k] - whole[k];
        assert!((moved - cells * spacing).abs() < 1e-12, "{k}: {moved}");
    }
    // Both average volumes lie on the samples of the first input, as the shapes do.
    for name in ["average.nii.gz", "warp_000.nii.gz", "average.vti"] {
        assert!(fit.path(name).is_file(), "{name}");
    }
    place.write("ends.csv", b"x,y,z\n-60,22,39\n-38,22,39\n");
    let ends = ["cube", "fit"].map(|result| {
        let output = format!("ends_{result}");
        let warp = ["warp", result, "ends.csv", "--shape", "0", "-o", &output];
        succeeded(&place.compute(&warp));
        let text = std::fs::read_to_string(place.path(&output).join("ends.csv")).unwrap();
        let numbers = text.lines().skip(1).flat_map(|line| line.split(','));
        let numbers = numbers.map(|n| n.parse().unwrap());
        numbers.collect::<Vec<f64>>()
    });
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        // Half a spacing: minimisations stop early on so few nodes.
        assert!((a - b).abs() < 0.5 * spacing, "{ends:?}");
    }

    let run = place.compute(&[
        "geodesic",
        "long.nii",
        "thick.nii",
        "--spacing",
        "4",
        "--box",
        "fit",
        "-K",
        "1",
        "-o",
        "spaced",
    ]);
    let words = succeeded(&run);
    assert!(words.contains("spacing      4 mm"), "{words}");
    let spaced = Results::read(&place.path("spaced"));
    assert_eq!(spaced.numbers("/world/spacing"), [4.0; 3]);
    assert!(relative(spaced.number("/spacing_input_units"), 4.0) < 1e-14);
    checked(&place, "spaced");
}

#[test]
fn a_spacing_is_kept_and_does_not_change_the_unit_of_length() {
    let place = Place::new();
    let inputs = rods(&place);
    let average = |options: &[&str], output: &str| {
        let options = [options, &["--align", "none", "-o", output]].concat();
        run(&place, "average", &inputs, &options)
    };
    let usual = average(&["--grid", "33"], "usual");
    let spaced = average(&["--spacing", "3"], "spaced");
    assert!(relative(spaced.number("/spacing_input_units"), 3.0) < 1e-14);
    let scale = "/input/0/frame/scale";
    assert_eq!(spaced.number(scale), usual.number(scale));
    assert_eq!(spaced.number("/spacing"), 3.0 * usual.number(scale));
    // 91 samples are .7 of the side of the unit box: 44 cells of 3.
    assert_eq!(nodes(&spaced), [45, 45]);
    // Deformations are read again on a grid whose longest side is not one.
    succeeded(&place.compute(&["pca", "spaced", "-o", "modes"]));
    checked(&place, "spaced");
    checked(&place, "modes");
    let shape = ["synthesize", "modes", "--scores", "1", "-o", "shape"];
    succeeded(&place.compute(&shape));
    let [own, all] = ["shape", "spaced"].map(|name| Results::read(&place.path(name)));
    assert_eq!(own.json["spacing"], all.json["spacing"]);
}

#[test]
fn arrays_of_the_nodes_are_used_as_they_are_in_every_box() {
    let place = Place::new();
    let array = |name: &str, n: [usize; 2], radius: f64| {
        let values = (0..n[0] * n[1]).map(|i| {
            let [x, y] = [0, 1].map(|k| [i % n[0], i / n[0]][k] as f64 - 0.5 * (n[k] - 1) as f64);
            rod([x, y], 9.0, radius, 4.0)
        });
        place.write(name, &npy_f64(&[n[1], n[0]], &values.collect::<Vec<_>>()));
        name.to_owned()
    };
    let path = |inputs: &[String], options: &[&str], output: &str| {
        let common = ["-K", "1", "--domain", "start", "-o", output];
        let options = [options, &common].concat();
        let results = run(&place, "geodesic", inputs, &options);
        assert_eq!(results.json["input"][0]["frame"]["rule"], "as_is");
        assert_eq!(results.json["parameters"]["align"], "none");
        results
    };
    let square = [array("a.npy", [33, 33], 2.4), array("b.npy", [33, 33], 3.0)];
    let cube = path(&square, &["--grid", "33"], "cube");
    let fit = path(&square, &["--grid", "33", "--box", "fit"], "fit");
    assert_eq!(nodes(&fit), [33, 25]);
    assert_eq!(apart(&cube, &fit, "shape_000.npy"), [0.0; 2]);
    // Alignments have a grid of their own, whose nodes these are not.
    run(
        &place,
        "average",
        &square,
        &["--grid", "33", "-o", "average"],
    );
    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let score = ["score", "b.npy", "--pca", "modes", "--align", "rigid"];
    succeeded(&place.compute(&[&score[..], &["-o", "score"]].concat()));
    let long = [array("c.npy", [33, 17], 2.4), array("d.npy", [33, 17], 3.0)];
    let given = path(&long, &["--grid", "33x17"], "given");
    assert_eq!(nodes(&given), [33, 17]);
    // The same distances up to the order of sums of coordinates that are moved.
    assert!(apart(&cube, &given, "shape_000.npy")[1] < 1e-12);
}

#[test]
fn shapes_are_made_smaller_for_a_narrow_box_and_results_are_repeated() {
    let place = Place::new();
    let inputs = rods(&place);
    let sides = [
        &["--grid", "65x17"][..],
        &["--grid", "33x25", "--box", "cube"],
        &["--grid", "33", "--box", "fit"],
        &["--spacing", "4.5", "--box", "fit"],
    ];
    for (number, sides) in sides.iter().enumerate() {
        let output = format!("first{number}");
        let common = ["-K", "1", "--align", "none", "-o", &output];
        let first = run(&place, "geodesic", &inputs, &[sides, &common[..]].concat());
        let again = format!("again{number}");
        let config = format!("{output}/config.toml");
        succeeded(&place.compute(&["geodesic", "--config", &config, "-o", &again]));
        let again = Results::read(&place.path(&again));
        assert_eq!(first.array("shape_001.npy"), again.array("shape_001.npy"));
        assert_eq!(first.json["nodes"], again.json["nodes"]);
        // No shape touches the faces of its box.
        let [x, y] = nodes(&first)[..] else {
            panic!("two sides")
        };
        let (_, distance) = first.array("shape_000.npy");
        let at_face = |i: usize| [0, x - 1].contains(&(i % x)) || [0, y - 1].contains(&(i / x));
        let inside = (0..x * y).filter(|&i| distance[i] > 0.0);
        assert!(inside.clone().count() > x && !inside.clone().any(at_face));
    }
    let scale = "/input/0/frame/scale";
    let scales = [0, 1].map(|i| Results::read(&place.path(&format!("first{i}"))).number(scale));
    assert!(scales[0] < 0.8 * scales[1], "{scales:?}");
}

#[test]
fn boxes_that_do_not_exist_are_refused_with_what_to_do() {
    let place = Place::new();
    let inputs = rods(&place);
    place.write("both.toml", b"grid = 65\nspacing = 2.0\n");
    for (options, words) in [
        (&["--grid", "100"][..], "--grid 101"),
        (&["--grid", "400x60"], "--grid 401x57"),
        (&["--grid", "65x33x33"], "2D"),
        (&["--grid", "65x"], "129x65"),
        (&["--grid", "65x33", "--box", "fit"], "leave out --box"),
        (&["--grid", "65", "--spacing", "2"], "cannot be used with"),
        (&["--config", "both.toml"], "leave out one"),
        (&["--spacing", "2", "--size", "equal"], "use --grid"),
        (&["--spacing", "1e-6"], "a spacing of"),
        (&["--spacing", "50"], "a spacing of"),
        (&["--spacing", "-1"], "positive"),
        (&["--joint", "--box", "fit"], "leave out --box"),
        (&["--joint", "--spacing", "2"], "--grid"),
    ] {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        let run = place.run(&[&["average"], &inputs[..], options, &["-o", "x"]].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{options:?}: {report}");
        // Reports are wrapped.
        let report = report.replace(|c: char| c.is_whitespace() || c == '│', " ");
        let report: Vec<&str> = report.split_whitespace().collect();
        assert!(report.join(" ").contains(words), "{options:?}: {report:?}");
        assert!(!place.path("x").exists());
    }
}
