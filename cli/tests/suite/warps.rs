//! Images and points that are carried between the shapes of results without a place in the world.

use crate::average::averaged;
use crate::common::{Place, Results, array, draw, grey_png, npy_f64, succeeded};

/// Three blobs as pictures of 60 x 48 samples.
fn blobs(place: &Place) -> Vec<String> {
    let names = ["a.png", "b.png", "c.png"];
    for (k, name) in names.iter().enumerate() {
        place.write(name, &blob(k));
    }
    names.map(String::from).to_vec()
}

const SIZE: [usize; 2] = [60, 48];

/// A bulged disk at another place in every picture; the shares of the samples at its boundary are grey.
fn blob(k: usize) -> Vec<u8> {
    let k = k as f64;
    let value = |index: usize| {
        let [x, y] = [index % SIZE[0], index / SIZE[0]].map(|i| i as f64);
        let [x, y] = [x - 28.0 - 2.0 * k, y - 24.0 + k];
        let angle = y.atan2(x);
        let radius = 13.0 + (2.5 - k) * (2.0 * angle - 0.4 * k).cos() + (3.0 * angle).sin();
        (127.5 * (1.0 + (radius - x.hypot(y)).clamp(-1.0, 1.0))).round() as u8
    };
    let grey: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(value).collect();
    grey_png(SIZE[0] as u32, SIZE[1] as u32, &grey)
}

/// A picture of two bytes a sample, everywhere 1000.
fn deep_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().unwrap();
    let samples = 1000u16.to_be_bytes().repeat(SIZE[0] * SIZE[1]);
    writer.write_image_data(&samples).unwrap();
    writer.finish().unwrap();
    bytes
}

/// The samples of a picture, and how many there are.
fn picture(place: &Place, name: &str) -> (Vec<usize>, Vec<f64>) {
    let sources = shapespace_input::Sources::files();
    let image = sources.read_numbers(&place.path(name)).unwrap();
    (image.size, image.values)
}

fn dice(a: &[bool], b: &[bool]) -> f64 {
    assert_eq!(a.len(), b.len());
    let both = a.iter().zip(b).filter(|(a, b)| **a && **b).count();
    let count = |m: &[bool]| m.iter().filter(|&&x| x).count();
    2.0 * both as f64 / (count(a) + count(b)) as f64
}

fn above(values: &[f64], level: f64) -> Vec<bool> {
    values.iter().map(|&value| value > level).collect()
}

/// The points of a table, from its second line.
fn points(place: &Place, name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(place.path(name)).unwrap();
    let row = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

fn refused(place: &Place, arguments: &[&str], words: &str) {
    let run = place.run(arguments);
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    let report = report.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(run.status.code(), Some(2), "{report}");
    assert!(report.contains(words), "{arguments:?}: {report}");
    assert!(!place.path("refused").exists());
}

#[test]
fn pictures_and_outlines_go_to_the_average_and_to_other_inputs() {
    let place = Place::new();
    let inputs = blobs(&place);
    let options = ["--grid", "65", "--align", "rigid"];
    let found = averaged(&place, &inputs, &options, "mean");
    let carry = |files: &[&str], options: &[&str], out: &str| {
        let command = [&["warp", "mean"], files, options, &["-o", out]].concat();
        succeeded(&place.compute(&command))
    };
    let linear = ["--interpolation", "linear"];
    for (k, name) in inputs.iter().enumerate() {
        let number = k.to_string();
        let out = format!("there{k}");
        carry(
            &[name],
            &[&["--shape", &number], &linear[..]].concat(),
            &out,
        );
        let (size, values) = picture(&place, &format!("{out}/{name}"));
        assert_eq!(size, [65, 65]);
        // The nodes of the average, of which the deformed shape covers as much as its overlap says.
        let mean: Vec<bool> = found
            .mask("average_mask.npy")
            .1
            .iter()
            .map(|&m| m == 1)
            .collect();
        let overlap = dice(&above(&values, 127.5), &mean);
        let expected = found.numbers("/dice")[k];
        assert!((overlap - expected).abs() < 0.01, "{overlap} {expected}");
    }
    // From one input to another, with its samples; alignments are part of it.
    let onto = [&["--shape", "0", "--to-shape", "2"], &linear[..]].concat();
    carry(&["a.png"], &onto, "onto");
    let (size, values) = picture(&place, "onto/a.png");
    assert_eq!(size, SIZE);
    let third = picture(&place, "c.png").1;
    let overlap = dice(&above(&values, 127.5), &above(&third, 127.5));
    let before = picture(&place, "a.png").1;
    let before = dice(&above(&before, 127.5), &above(&third, 127.5));
    assert!(overlap > 0.97 && before < 0.9, "{overlap} {before}");
    // Between the nodes, and back from there.
    carry(
        &["a.png"],
        &[&["--shape", "0", "--refine", "3"], &linear[..]].concat(),
        "fine",
    );
    assert_eq!(picture(&place, "fine/a.png").0, [193, 193]);
    let back = [&["--shape", "0", "--inverse"], &linear[..]].concat();
    carry(&["fine/a.png"], &back, "back");
    let (size, values) = picture(&place, "back/a.png");
    assert_eq!(size, SIZE);
    let overlap = dice(
        &above(&values, 127.5),
        &above(&picture(&place, "a.png").1, 127.5),
    );
    assert!(overlap > 0.99, "{overlap}");
    // The outline of the average becomes that of an input: its points lie where that is half grey.
    std::fs::copy(found.path("average_outline.csv"), place.path("outline.csv")).unwrap();
    carry(&["outline.csv"], &["--shape", "1", "--inverse"], "outlined");
    let (_, grey) = picture(&place, "b.png");
    let outline = points(&place, "outlined/outline.csv");
    assert!(outline.len() > 50);
    let off = |row: &Vec<f64>| {
        assert_eq!(row[0], 0.0, "the piece");
        let [x, y] = [row[1], row[2]].map(|x| x.round() as usize);
        // Half a step from a sample to the next changes grey values by at most a half.
        (grey[x + SIZE[0] * y] / 255.0 - 0.5).abs()
    };
    let mean = outline.iter().map(off).sum::<f64>() / outline.len() as f64;
    assert!(mean < 0.35, "{mean}");
    // The same curve as a drawing lies at the same places, with points between them.
    std::fs::copy(found.path("average_outline.svg"), place.path("drawn.svg")).unwrap();
    carry(&["drawn.svg"], &["--shape", "1", "--inverse"], "drawn");
    let moved = shapespace_input::read_outline(&place.path("drawn/drawn.svg")).unwrap();
    let moved = moved.whole().into_owned();
    assert!(moved.points().len() > outline.len() && moved.n_components() == 1);
    for row in &outline {
        let gap = |p: &[f64; 2]| (p[0] - row[1]).hypot(p[1] - row[2]);
        let nearest = moved.points().iter().map(gap).fold(f64::MAX, f64::min);
        assert!(nearest < 1e-3, "{row:?}");
    }
    // Pictures keep grey values beyond 255.
    place.write("deep.png", &deep_png());
    carry(&["deep.png"], &["--shape", "0"], "deep");
    let (_, values) = picture(&place, "deep/deep.png");
    let deep = values.iter().filter(|&&value| value == 1000.0).count();
    assert!(deep > 100 && values.iter().all(|&value| value == 1000.0 || value == 0.0));
    let small = grey_png(10, 10, &[0; 100]);
    place.write("small.png", &small);
    let warp = |more: &[&'static str]| [&["warp", "mean"], more, &["-o", "refused"]].concat();
    refused(
        &place,
        &warp(&["small.png", "--shape", "0"]),
        "the samples of input 0: 60 x 48",
    );
    refused(
        &place,
        &warp(&["a.png", "--shape", "0", "--inverse"]),
        "65 x 65 nodes",
    );
    refused(
        &place,
        &warp(&["a.png", "--shape", "0", "--refine", "65"]),
        "not in 1..=64",
    );
    refused(&place, &warp(&["a.png"]), "--shape that is missing");
    refused(
        &place,
        &warp(&["a.png", "--shape", "0", "--to-shape", "3"]),
        "inputs 0 to 2",
    );
    refused(&place, &warp(&["a.png", "--time", "1"]), "give --shape");
    for (name, text, words) in [
        ("line.csv", "x,y\n1\n", "line 2 does not have 2"),
        (
            "names.csv",
            "id,lon,lat\n1,10,20\n",
            "names no columns x, y",
        ),
        ("none.csv", "x,y\n", "it has no points"),
    ] {
        place.write(name, text.as_bytes());
        refused(&place, &warp(&[name, "--shape", "0"]), words);
    }
    refused(
        &place,
        &warp(&["a.png", "a.png", "--shape", "0"]),
        "given twice",
    );
}

/// Coordinates are found by their names, with units; the other columns stay as they are, with their quotes.
#[test]
fn columns_of_points_have_names() {
    let place = Place::new();
    let inputs = blobs(&place);
    averaged(&place, &inputs, &["--grid", "17"], "mean");
    let tables = [
        "10,12\n",
        "x,y\n10,12\n",
        "id,x_mm,y_mm\n7,10,12\n",
        "name,Y [mm],X [mm]\n\"left, upper\",12,10\n",
    ];
    let mut found = Vec::new();
    for (k, text) in tables.into_iter().enumerate() {
        let (name, out) = (format!("{k}.csv"), format!("out{k}"));
        place.write(&name, text.as_bytes());
        let command = ["warp", "mean", &name, "--shape", "0", "-o", &out];
        succeeded(&place.compute(&command));
        let text = std::fs::read_to_string(place.path(&format!("{out}/{name}"))).unwrap();
        found.push(text.lines().last().unwrap().to_owned());
    }
    let [x, y] = [0, 1].map(|k| found[0].split(',').nth(k).unwrap());
    assert_ne!((x, y), ("10.000000", "12.000000"), "nothing is tested");
    assert_eq!(found[1], found[0]);
    assert_eq!(found[2], format!("7,{x},{y}"));
    assert_eq!(found[3], format!("\"left, upper\",{y},{x}"));
    // Files of the same name in two folders have their results.
    for folder in ["left", "right"] {
        std::fs::create_dir(place.path(folder)).unwrap();
        place.write(&format!("{folder}/p.csv"), b"10,12\n");
    }
    let both = [
        "warp",
        "mean",
        "left/p.csv",
        "right/p.csv",
        "--shape",
        "0",
        "-o",
        "both",
    ];
    succeeded(&place.compute(&both));
    for name in ["both/left_p.csv", "both/right_p.csv"] {
        assert!(place.path(name).is_file(), "{name}");
    }
    // What was carried is part of the result.
    let checked = |code| assert_eq!(place.run(&["check", "out1"]).status.code(), Some(code));
    let doubtful = Results::read(&place.path("out1")).json["verdict"] != "sound";
    checked(if doubtful { 3 } else { 0 });
    place.write("out1/1.csv", b"x,y\n1,2\n");
    checked(2);
    std::fs::remove_file(place.path("out1/1.csv")).unwrap();
    checked(2);
}

#[test]
fn objects_outside_of_the_box_are_doubted() {
    let place = Place::new();
    for (name, radius) in [("a.png", 6.0), ("b.png", 7.0)] {
        // A disk of label 1, and a square of label 2 far from it.
        let label = |i: u32, j: u32| -> u8 {
            let distance = (f64::from(i) - 31.5).hypot(f64::from(j) - 31.5);
            match (i, j) {
                (2..7, 2..7) => 2,
                _ => u8::from(distance < radius),
            }
        };
        let labels: Vec<u8> = (0..64 * 64).map(|n| label(n % 64, n / 64)).collect();
        place.write(name, &grey_png(64, 64, &labels));
    }
    let average = ["average", "a.png", "b.png", "--label", "1", "--grid", "17"];
    succeeded(&place.compute(&[&average[..], &["-o", "average"]].concat()));
    let warp = ["warp", "average", "a.png", "--shape", "0", "-o", "out"];
    let run = place.run(&warp);
    assert_eq!(run.status.code(), Some(3));
    let found = Results::read(&place.path("out"));
    let doubts = found.json["doubts"].as_array().unwrap();
    let lost = doubts
        .iter()
        .find(|doubt| doubt["what"] == "outside_box")
        .unwrap();
    assert_eq!(lost["shape"], "a");
    let disk =
        (0..64 * 64).filter(|n| (f64::from(n % 64) - 31.5).hypot(f64::from(n / 64) - 31.5) < 6.0);
    let share = 25.0 / (25.0 + disk.count() as f64);
    assert!(
        (lost["figure"].as_f64().unwrap() - share).abs() < 1e-12,
        "{lost}"
    );
    assert_eq!(found.number("/carried/0/outside"), 25.0);
}

#[test]
fn a_path_carries_its_first_shape_to_all_times() {
    let place = Place::new();
    draw(
        &place,
        "bar.npy",
        &["bar", "--angle", "180", "--grid", "65"],
    );
    draw(
        &place,
        "bent.npy",
        &["bar", "--angle", "130", "--grid", "65"],
    );
    succeeded(&place.compute(&[
        "geodesic", "bar.npy", "bent.npy", "-K", "4", "--grid", "65", "-o", "path",
    ]));
    let found = Results::read(&place.path("path"));
    let first = array(&place.path("path/shape_000.npy")).1;
    place.write("first.npy", &npy_f64(&[65, 65], &first));
    let carry = |options: &[&str], out: &str| {
        succeeded(
            &place.compute(&[&["warp", "path", "first.npy"], options, &["-o", out]].concat()),
        );
        above(&picture(&place, &format!("{out}/first.npy")).1, 0.0)
    };
    for (time, shape) in [("0.25", 1), ("0.5", 2), ("1", 4)] {
        let carried = carry(&["--time", time], &format!("at{time}"));
        let expected = above(&found.array(&format!("shape_00{shape}.npy")).1, 0.0);
        let overlap = dice(&carried, &expected);
        assert!(overlap > 0.985, "{time}: {overlap}");
        let still = dice(&above(&first, 0.0), &expected);
        assert!(still < overlap - 0.01, "{time}: {still}");
    }
    // The last shape has the samples of the end.
    let command = ["warp", "path", "bar.npy", "--time", "1", "-o", "end"];
    succeeded(&place.compute(&command));
    let [end, expected] = ["end/bar.npy", "bent.npy"].map(|name| picture(&place, name).1);
    let overlap = dice(&above(&end, 0.5), &above(&expected, 0.5));
    assert!(overlap > 0.97, "{overlap}");
    // Times in between, there and back.
    place.write("points.csv", b"name,x,y\nleft,20.5,32\nright,45,31.5\n");
    let run = |files: &str, options: &[&str], out: &str| {
        succeeded(&place.compute(&[&["warp", "path", files], options, &["-o", out]].concat()))
    };
    run("points.csv", &["--time", ".4"], "there");
    run(
        "there/points.csv",
        &["--from-time", ".4", "--time", ".9"],
        "on",
    );
    run("on/points.csv", &["--time", ".9", "--inverse"], "back");
    let text = std::fs::read_to_string(place.path("back/points.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[1][0], "left");
    for (row, expected) in rows[1..].iter().zip([[20.5, 32.0], [45.0, 31.5]]) {
        for k in 0..2 {
            let x: f64 = row[k + 1].parse().unwrap();
            assert!((x - expected[k]).abs() < 1e-3, "{row:?}");
        }
    }
    let moved = std::fs::read_to_string(place.path("there/points.csv")).unwrap();
    assert!(!moved.contains("left,20.5"), "{moved}");
    let warp =
        |more: &[&'static str]| [&["warp", "path", "first.npy"], more, &["-o", "refused"]].concat();
    std::fs::remove_file(place.path("path/deformation_003.npy")).unwrap();
    refused(&place, &warp(&["--time", "1"]), "deformation_003.npy");
    refused(&place, &warp(&["--time", "1.5"]), "a time from 0 to 1");
    refused(&place, &warp(&["--shape", "0"]), "give --time");
}

#[test]
fn modes_carry_the_average_as_synthesize_does() {
    let place = Place::new();
    let inputs = blobs(&place);
    let mean = averaged(&place, &inputs, &["--grid", "33"], "mean");
    succeeded(&place.compute(&["pca", "mean", "-o", "modes"]));
    succeeded(&place.compute(&["synthesize", "modes", "--scores", "-1.5", "-o", "shape"]));
    std::fs::copy(mean.path("average_outline.csv"), place.path("outline.csv")).unwrap();
    let carry = |from: &str, options: &[&str], out: &str| {
        let command = [&["warp", from, "outline.csv"], options, &["-o", out]].concat();
        succeeded(&place.compute(&command));
        points(&place, &format!("{out}/outline.csv"))
    };
    let by_scores = carry("modes", &["--scores", "-1.5"], "by_scores");
    let by_shape = carry("shape", &[], "by_shape");
    assert_eq!(by_scores, by_shape);
    // The outline is that of the shape: its area is the one that is recorded.
    let area = |outline: &[Vec<f64>]| {
        let next = outline.iter().cycle().skip(1);
        let pieces = outline.iter().zip(next);
        0.5 * pieces
            .map(|(p, q)| p[1] * q[2] - q[1] * p[2])
            .sum::<f64>()
            .abs()
    };
    let recorded = Results::read(&place.path("shape"));
    let ratio = recorded.number("/size") / recorded.number("/average_size");
    let found = area(&by_scores) / area(&points(&place, "outline.csv"));
    assert!((ratio - 1.0).abs() > 0.005, "{ratio}: nothing is tested");
    assert!((found - ratio).abs() < 1e-3, "{found} {ratio}");
    // A shape that folds is doubted, whichever of the two computes it.
    succeeded(&place.compute(&["synthesize", "modes", "--scores", "40", "-o", "folded"]));
    carry("modes", &["--scores", "40"], "carried");
    let causes = |folder: &str| -> Vec<String> {
        let found = Results::read(&place.path(folder));
        let doubts = found.json["doubts"].as_array().unwrap();
        doubts
            .iter()
            .map(|doubt| doubt["what"].to_string())
            .collect()
    };
    assert!(causes("folded").contains(&"\"determinant\"".into()));
    assert_eq!(causes("carried"), causes("folded"));
    assert_eq!(causes("by_scores"), causes("shape"));
    let warp = |more: &[&'static str]| {
        [&["warp", "modes", "outline.csv"], more, &["-o", "refused"]].concat()
    };
    refused(
        &place,
        &warp(&["--scores", "1,1,1,1"]),
        "modes: give at most",
    );
    refused(&place, &warp(&[]), "--scores that is missing");
}
