//! What `average`, `pca`, `synthesize` and `compare` write in the coordinates of their inputs.

use serde_json::Value;
use shapespace_input::{Sources, read_mesh, read_point_array};

use crate::common::solid::{Affine, mapped, nifti_of};
use crate::common::{Place, Results, succeeded};

/// The middle of all balls in the world, and their radii, in millimetres.
const MIDDLE: [f64; 3] = [20.0, -35.0, 41.0];
const RADII: [f64; 4] = [9.0, 9.5, 10.5, 11.0];
/// Distance of samples, which are stored from left to right and from front to back.
const STEP: f64 = 2.0;
const SIZE: usize = 17;

/// Writes balls of several sizes as volumes.
fn balls(place: &Place) -> Vec<String> {
    let half = 0.5 * STEP * (SIZE - 1) as f64;
    let [x, y, z] = MIDDLE;
    let affine: Affine = [
        [-STEP, 0.0, 0.0, x + half],
        [0.0, -STEP, 0.0, y + half],
        [0.0, 0.0, STEP, z - half],
    ];
    let write = |(number, radius): (usize, &f64)| {
        let value = |index: usize| {
            let [i, j, k] = [index % SIZE, index / SIZE % SIZE, index / SIZE / SIZE];
            let from_middle = away(mapped(&affine, [i, j, k].map(|n| n as f64)));
            (0.5 + (radius - from_middle) / (2.0 * STEP)).clamp(0.0, 1.0) as f32
        };
        let values: Vec<f32> = (0..SIZE.pow(3)).map(value).collect();
        let name = format!("ball_{number}.nii");
        place.write(&name, &nifti_of([SIZE; 3], &affine, &values));
        name
    };
    RADII.iter().enumerate().map(write).collect()
}

/// The distance of a point of the world from the middle of the balls.
fn away(p: [f64; 3]) -> f64 {
    let square: f64 = (0..3).map(|k| (p[k] - MIDDLE[k]).powi(2)).sum();
    square.sqrt()
}

/// The radius of the ball of the volume that a surface encloses; it lies about the middle.
fn radius(results: &Results, name: &str) -> f64 {
    let mesh = read_mesh(&results.path(name)).unwrap();
    let (mut volume, mut moment) = (0.0, [0.0; 3]);
    for corners in &mesh.triangles {
        let corners = corners.map(|corner| mesh.points[corner as usize]);
        let [a, b, c] = corners.map(|p| [0, 1, 2].map(|k| p[k] - MIDDLE[k]));
        let cone = (0..3)
            .map(|k| a[k] * (b[(k + 1) % 3] * c[(k + 2) % 3] - b[(k + 2) % 3] * c[(k + 1) % 3]))
            .sum::<f64>()
            / 6.0;
        volume += cone;
        for k in 0..3 {
            moment[k] += cone * (a[k] + b[k] + c[k]) / 4.0;
        }
    }
    // The orientation is that of the world.
    assert!(volume > 0.0, "{name} {volume}");
    let centre = moment.map(|x| x / volume);
    assert!(centre.iter().all(|x| x.abs() < 0.5), "{name} {centre:?}");
    (volume * 0.75 / std::f64::consts::PI).cbrt()
}

/// Columns of a table of numbers by their names.
fn column(text: &str, name: &str) -> Vec<f64> {
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let place = head.iter().position(|column| *column == name);
    let place = place.unwrap_or_else(|| panic!("no '{name}' in {head:?}"));
    let rows = text.lines().skip(1);
    rows.map(|row| row.split(',').nth(place).unwrap().parse().unwrap())
        .collect()
}

/// The data of the first scene of a report.
fn scene(results: &Results) -> Value {
    let page = std::fs::read_to_string(results.path("report.html")).unwrap();
    let start = "<script type=\"application/json\" id=\"scene-0\">";
    let (_, rest) = page.split_once(start).unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn letters(value: &Value) -> usize {
    value.as_str().unwrap().trim_end_matches('=').len() * 3 / 4
}

#[test]
fn averages_modes_and_differences_lie_in_the_world() {
    let place = Place::new();
    let names = balls(&place);
    let inputs: Vec<&str> = names.iter().map(String::as_str).collect();
    let average = ["average", "--grid", "17", "-o", "average"];
    let printed = succeeded(&place.compute(&[&average[..], &inputs].concat()));
    let found = Results::read(&place.path("average"));
    let mean = radius(&found, "average.ply");
    assert!((mean - 10.0).abs() < 0.4, "{mean}");
    subjects(&found, &names, &printed);
    changes_of_volume(&found, mean);
    carried_inputs(&found, mean);

    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let modes = Results::read(&place.path("modes"));
    assert_eq!(modes.json["surface"]["coordinates"], "world");
    for extension in ["stl", "ply", "vtp"] {
        let of = |name: &str| radius(&modes, &format!("{name}.{extension}"));
        let sizes = ["mode_000_minus", "mean", "mode_000_plus"].map(of);
        assert!((sizes[1] - mean).abs() < 0.3, "{sizes:?} {mean}");
        // Four standard deviations of the radii, .8 each; on so coarse a grid the shapes fall short of them.
        let span = (sizes[2] - sizes[0]).abs();
        assert!((1.0..4.0).contains(&span), "{sizes:?}");
        let between = (sizes[0] - sizes[1]) * (sizes[2] - sizes[1]);
        assert!(between < 0.0, "{sizes:?}");
    }
    let shape = ["synthesize", "modes", "--scores", "2", "-o", "shape"];
    succeeded(&place.compute(&shape));
    let shape = Results::read(&place.path("shape"));
    assert_eq!(shape.json["surface"]["coordinates"], "world");
    let expected = radius(&modes, "mode_000_plus.ply");
    assert!((radius(&shape, "shape.vtp") - expected).abs() < 1e-6);
    assert_volume(&shape, "shape", expected);

    place.write(
        "groups.csv",
        b"file,group,age\nball_0,small,1\nball_1,small,2\nball_2,large,4\nball_3,large,5\n",
    );
    let compare = [
        "compare",
        "modes",
        "--groups",
        "groups.csv",
        "--covariates",
        "age",
    ];
    let options = ["--permutations", "99", "-o", "compared"];
    succeeded(&place.compute(&[&compare[..], &options].concat()));
    differences(&Results::read(&place.path("compared")), mean);
}

/// A mask and a signed distance in the world are those of a ball.
fn assert_volume(results: &Results, name: &str, radius: f64) {
    let read = |name: String| Sources::files().read_numbers(&results.path(&name)).unwrap();
    let distance = read(format!("{name}_distance.nii.gz"));
    let mask = read(format!("{name}.nii.gz"));
    assert_eq!((&mask.size, mask.affine), (&distance.size, distance.affine));
    let [nx, ny] = [0, 1].map(|k| distance.size[k]);
    for (index, value) in distance.values.iter().enumerate() {
        let sample = [index % nx, index / nx % ny, index / (nx * ny)];
        let from_middle = away(mapped(&distance.affine.unwrap(), sample.map(|n| n as f64)));
        let expected = radius - from_middle;
        assert!((value - expected).abs() < 1.2, "{name} {value} {expected}");
        assert_eq!(mask.values[index] > 0.0, *value > 0.0);
    }
}

/// Shapes of every path are volumes and surfaces of all formats, and its steps displacement fields.
#[test]
fn paths_and_their_continuations_lie_in_the_world() {
    let place = Place::new();
    balls(&place);
    let like = "--like ball_3.nii --no-geodesic";
    for (command, out, last) in [
        (
            "geodesic ball_0.nii ball_2.nii --grid 17 -K 1",
            "path",
            RADII[2],
        ),
        // As much larger again.
        ("extend path -K 1", "beyond", 12.0),
        ("transport path ball_1.nii --steps 1", "beside", 11.0),
        (
            &format!("length ball_0.nii ball_3.nii --grid 17 {like}"),
            "length",
            RADII[3],
        ),
    ] {
        let words: Vec<&str> = command.split_whitespace().collect();
        succeeded(&place.compute(&[&words[..], &["-o", out]].concat()));
        let results = Results::read(&place.path(out));
        let shapes = if out == "beyond" { 3 } else { 2 };
        let end = format!("shape_{:03}", shapes - 1);
        for extension in ["stl", "ply", "vtp"] {
            let found = radius(&results, &format!("{end}.{extension}"));
            assert!((found - last).abs() < 0.7, "{out} {found}");
        }
        assert_volume(&results, &end, last);
        assert!(results.path("inverse_warp_001.nii.gz").is_file(), "{out}");
        let of_input = i32::from(out == "length");
        assert_eq!(results.json["world"]["of_input"], of_input);
    }
    let run = place.run(&[
        "length",
        "ball_0.nii",
        "ball_3.nii",
        "--like",
        "ball_1.nii",
        "-o",
        "x",
    ]);
    assert_eq!(run.status.code(), Some(2));
}

/// The table has a line for every input with what `result.json` has of it, and the volume of the average is said.
fn subjects(found: &Results, names: &[String], printed: &str) {
    let text = std::fs::read_to_string(found.path("subjects.csv")).unwrap();
    let files: Vec<&str> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').nth(1).unwrap())
        .collect();
    assert!(
        files
            .iter()
            .zip(names)
            .all(|(file, name)| file.ends_with(name))
            && files.len() == 4
    );
    for (column_name, place) in [
        ("volume", "/input/{}/volume"),
        ("volume_input_units", "/input/{}/volume_input_units"),
        ("elastic", "/energy/elastic/{}"),
        ("mismatch", "/energy/mismatch/{}"),
        ("dice", "/dice/{}"),
        ("distance_mean_mm", "/hausdorff_input_units/{}/mean"),
        ("distance_95_mm", "/hausdorff_input_units/{}/percentile_95"),
        ("distance_max_mm", "/hausdorff_input_units/{}/maximum"),
        ("least_determinant", "/strain/{}/determinant/least"),
    ] {
        for (i, value) in column(&text, column_name).into_iter().enumerate() {
            let stated = found.number(&place.replace("{}", &i.to_string()));
            assert!(
                (value - stated).abs() <= 1e-9 * stated.abs(),
                "{column_name}"
            );
        }
    }
    let spacing = found.number("/world/spacing/0");
    let [inner, outer] =
        ["distance_max_spacings", "distance_max_mm"].map(|name| column(&text, name));
    assert!((inner[3] * spacing - outer[3]).abs() < 1e-9);
    let volume = found.number("/average/volume_input_units");
    let line = printed
        .lines()
        .find_map(|line| line.trim().strip_prefix("volume "));
    let said: f64 = line
        .unwrap()
        .trim()
        .strip_suffix(" mm^3")
        .unwrap()
        .parse()
        .unwrap();
    assert!((said / volume - 1.0).abs() < 1e-3, "{said} {volume}");
}

/// Inside, the volume changes as that of the whole ball, seen at the samples of the average.
fn changes_of_volume(found: &Results, mean: f64) {
    let sources = Sources::files();
    let read = |name: &str| sources.read_numbers(&found.path(name)).unwrap();
    let distance = read("average_distance.nii.gz");
    for (input, radius) in RADII.iter().enumerate() {
        let jacobian = read(&format!("jacobian_{input:03}.nii.gz"));
        assert_eq!(jacobian.size, distance.size);
        let samples = distance.values.iter().zip(&jacobian.values);
        let inner = samples.filter(|(distance, _)| **distance > 0.4 * mean);
        let inner: Vec<f64> = inner.map(|(_, det)| *det).collect();
        let found = inner.iter().sum::<f64>() / inner.len() as f64;
        let expected = (mean / radius).powi(3);
        assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
    }
    let file = std::fs::read(found.path("average.vti")).unwrap();
    let header = String::from_utf8_lossy(&file[..4000]).into_owned();
    assert!(header.contains("Name=\"jacobian_003\" NumberOfComponents=\"1\""));
}

/// The surfaces of the inputs lie at their places, and their arrays carry them onto the average.
fn carried_inputs(found: &Results, mean: f64) {
    for (input, radius) in RADII.iter().enumerate() {
        let path = found.path(&format!("input_{input:03}.vtp"));
        let points = read_mesh(&path).unwrap().points;
        let ways = read_point_array(&path, "displacement").unwrap();
        for (point, way) in points.iter().zip(ways.as_chunks::<3>().0) {
            assert!((away(*point) - radius).abs() < 0.6, "{point:?}");
            let there = std::array::from_fn(|k| point[k] + way[k]);
            assert!((away(there) - mean).abs() < 0.9, "{point:?} {way:?} {mean}");
        }
        let missing = read_point_array(&path, "nothing").unwrap_err();
        assert!(missing.to_string().contains("input_"), "{missing}");
    }
    let scene = scene(found);
    let overlays = scene["overlays"].as_array().unwrap();
    assert_eq!(overlays.len(), RADII.len());
    assert!(overlays[3]["name"].as_str().unwrap().contains('3'));
    for overlay in overlays {
        let [points, offsets] = ["points", "offsets"].map(|key| letters(&overlay[key]));
        assert!(points > 600 && points == offsets, "{points} {offsets}");
    }
}

/// The table, the surface and the report of a comparison state millimetres.
fn differences(found: &Results, mean: f64) {
    let text = std::fs::read_to_string(found.path("boundary.csv")).unwrap();
    assert!(text.starts_with("x_mm_RAS,y_mm_RAS,z_mm_RAS,f,"), "{text}");
    let axes = ["x_mm_RAS", "y_mm_RAS", "z_mm_RAS"].map(|name| column(&text, name));
    for q in 0..axes[0].len() {
        let from_middle = away([axes[0][q], axes[1][q], axes[2][q]]);
        assert!((from_middle - mean).abs() < 0.9, "{from_middle} {mean}");
    }
    let lengths = column(&text, "difference_mm");
    let most = lengths.iter().copied().fold(0.0, f64::max);
    // The mean radii differ by 1.5 millimetres, of which the coarse grid shows about a half.
    assert!((0.5..1.6).contains(&most), "{most}");
    let stated = found.number("/boundary/largest_difference_mm");
    assert!((most / stated - 1.0).abs() < 1e-12);
    let surface = found.path("boundary.vtp");
    let stored = read_point_array(&surface, "difference_mm").unwrap();
    assert_eq!(stored.len(), lengths.len());
    let same = stored.iter().zip(&lengths);
    assert!(same.into_iter().all(|(a, b)| (a - b).abs() < 1e-5));
    let points = read_mesh(&surface).unwrap().points;
    assert_eq!(points.len(), lengths.len());
    assert!((points[7][1] - axes[1][7]).abs() < 1e-9);
    assert!(radius(found, "mean_000.ply") < radius(found, "mean_001.ply"));
    // All views are first seen from one side.
    let page = std::fs::read_to_string(found.path("report.html")).unwrap();
    let sides = page.split("\"azimuth\":").skip(1);
    let sides: Vec<&str> = sides.filter_map(|rest| rest.split(',').next()).collect();
    let same = sides.iter().all(|side| *side == sides[0]);
    assert!(sides.len() > 1 && same, "{sides:?}");
    // Balls grow with their age.
    let predicted = [
        "predicted_000.vtp",
        "predicted_001.stl",
        "predicted_002.ply",
    ];
    let predicted = predicted.map(|name| radius(found, name));
    assert!(
        predicted.is_sorted() && predicted[2] - predicted[0] > 0.5,
        "{predicted:?}"
    );
    assert!((predicted[1] - mean).abs() < 0.3, "{predicted:?} {mean}");

    let scene = scene(found);
    let bars = scene["bars"].as_array().unwrap();
    assert_eq!(bars[0]["name"], "difference of the means (mm)");
    assert_eq!(bars[1]["name"], "false discovery rate, white above .05");
    let page = std::fs::read_to_string(found.path("report.html")).unwrap();
    assert!(page.contains("\"name\":\"mean of large\""));
    for bar in bars {
        let shares = letters(&bar["shares"]);
        assert_eq!(6 * shares, letters(&scene["frames"][0]["points"]));
        assert!(bar["marks"].as_array().unwrap().len() > 1);
    }
}
