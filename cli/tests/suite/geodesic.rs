//! `geodesic` from files to files.

#[cfg(target_os = "linux")]
use crate::common::interrupted;
use crate::common::{
    Place, Results, array, arrays, draw, drawn, nifti, npy_f64, picture_size, succeeded,
};

const KEYS: [&str; 22] = [
    "boundaries",
    "certificate",
    "dice_end",
    "dice_pulled",
    "dimension",
    "dissipation",
    "evaluations",
    "input",
    "iterations",
    "length",
    "length_input_units",
    "levels",
    "mismatches",
    "nodes",
    "parameters",
    "seconds",
    "solver_seconds",
    "status",
    "step_energies",
    "total",
    "version",
    "volumes",
];

fn connected(place: &Place, ends: &[String], options: &[&str], output: &str) -> Results {
    let mut arguments = vec!["geodesic", &ends[0], &ends[1], "-o", output];
    arguments.extend(options);
    succeeded(&place.compute(&arguments));
    Results::read(&place.path(output))
}

/// Everything that holds for every path of so many steps.
fn check(results: &Results, steps: usize, shape: &[u64]) {
    for key in KEYS {
        assert!(!results.json[key].is_null(), "no {key} in result.json");
    }
    assert_eq!(results.json["input"].as_array().unwrap().len(), 2);
    let energies = results.numbers("/step_energies");
    assert_eq!(energies.len(), steps);
    let (length, dissipation) = (results.number("/length"), results.number("/dissipation"));
    let lengths: f64 = energies.iter().map(|w| w.sqrt()).sum();
    // The same sums in the same order.
    assert!((length - lengths).abs() <= 1e-14 * length);
    // Cauchy and Schwarz; equal steps are equal up to rounding.
    assert!(length * length <= dissipation * (1.0 + 1e-12));
    let sizes = results.numbers("/volumes");
    assert_eq!(sizes.len(), steps + 1);
    assert!(sizes.iter().all(|size| *size > 0.0));
    check_levels(results);
    check_files(results, steps, shape);
}

fn check_levels(results: &Results) {
    let levels = results.json["levels"].as_array().unwrap();
    let sum = |key: &str| -> u64 { levels.iter().map(|l| l[key].as_u64().unwrap()).sum() };
    assert_eq!(results.json["iterations"], sum("iterations"));
    assert_eq!(results.json["evaluations"], results.evaluations());
    let last = levels.last().unwrap();
    assert_eq!(last["step_energies"], results.json["step_energies"]);
    assert_eq!(last["total"], results.json["total"]);
    assert_eq!(last["nodes"], results.json["nodes"]);
    let table = std::fs::read_to_string(results.path("energy.csv")).unwrap();
    let points = sum("iterations") as usize + levels.len();
    assert_eq!(table.lines().count(), 1 + points);
}

fn check_files(results: &Results, steps: usize, shape: &[u64]) {
    let mut vector = vec![shape.len() as u64];
    vector.extend(shape);
    for k in 0..=steps {
        let (found, level_set) = results.array(&format!("shape_{k:03}.npy"));
        assert_eq!(found, shape);
        assert!(level_set.iter().any(|u| *u > 0.0) && level_set.iter().any(|u| *u < 0.0));
        let file = std::fs::read(results.path(&format!("shape_{k:03}.vti"))).unwrap();
        let header = String::from_utf8_lossy(&file[..1000.min(file.len())]).into_owned();
        for field in ["level_set", "displacement", "dissipation"] {
            assert!(header.contains(&format!("Name=\"{field}\"")), "{header}");
        }
    }
    for k in 1..=steps {
        assert_eq!(results.array(&format!("deformation_{k:03}.npy")).0, vector);
    }
    for none in [
        format!("shape_{:03}.npy", steps + 1),
        "deformation_000.npy".into(),
        format!("deformation_{:03}.npy", steps + 1),
    ] {
        assert!(!results.path(&none).exists(), "{none}");
    }
    let series = std::fs::read_to_string(results.path("geodesic.pvd")).unwrap();
    let files: Vec<&str> = series.split("file=\"").skip(1).collect();
    assert_eq!(files.len(), steps + 1);
    for file in files {
        assert!(results.path(file.split('"').next().unwrap()).is_file());
    }
    let table = std::fs::read_to_string(results.path("steps.csv")).unwrap();
    assert_eq!(table.lines().count(), steps + 2);
    for name in ["geodesic.png", "geodesic.apng"] {
        let [width, height] = picture_size(&results.path(name));
        assert!(width > 100 && height > 100, "{name}");
    }
    for name in ["energy.svg", "steps.svg"] {
        let text = std::fs::read_to_string(results.path(name)).unwrap();
        assert!(text.contains("<svg") && !text.contains("NaN"), "{name}");
    }
}

#[test]
fn a_growing_disk_has_the_length_of_the_theory() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "65");
    let options = ["--grid", "65", "-K", "4"];
    let results = connected(&place, &disks, &options, "out");
    check(&results, 4, &[65, 65]);
    assert_eq!(results.json["status"], "converged");
    assert_eq!(results.json["certificate"]["certified"], true);
    // The disk grows as a whole, and the area of its trace is that of the metric: per unit of
    // radius the length is sqrt((2 lambda + 2 mu) pi), from .2 to .3.
    let exact = (4.0 * std::f64::consts::PI).sqrt() * 0.1;
    let length = results.number("/length");
    assert!((length / exact - 1.0).abs() < 0.02, "{length} {exact}");
    // A length of the plane is one of areas' roots: 64 samples a side.
    let own = results.number("/length_input_units");
    assert!((own / length - 64.0).abs() < 1e-9);
    assert!(results.number("/dice_end") > 0.985);
    let sizes = results.numbers("/volumes");
    assert!(sizes.windows(2).all(|pair| pair[0] < pair[1]), "{sizes:?}");
    assert!((sizes[0] / (0.04 * std::f64::consts::PI) - 1.0).abs() < 0.01);
    assert!((sizes[4] / (0.09 * std::f64::consts::PI) - 1.0).abs() < 0.02);
    // From the first shape to the second is one step.
    assert_eq!(
        results.array("psi_001.npy"),
        results.array("deformation_001.npy")
    );
    assert_eq!(results.array("psi_004.npy").0, [2, 65, 65]);
    // The first deformation moves what lies right of the middle to the right. A turn of a disk costs
    // nothing: the default tolerance leaves one of some degrees.
    let (_, positions) = results.array("deformation_001.npy");
    let node = 32 * 65 + 40;
    assert!(positions[node] > 40.0 / 64.0 + 0.005, "{}", positions[node]);
    let off = positions[65 * 65 + node] - 0.5;
    assert!(off.abs() < 0.01, "{off}");
    assert!(!results.path("shape_000.stl").exists());
    // The outline in samples has the area that is recorded.
    assert_eq!(results.json["outline"]["coordinates"], "input");
    let text = std::fs::read_to_string(results.path("shape_002_outline.csv")).unwrap();
    let row = |line: &str| -> Vec<f64> { line.split(',').map(|x| x.parse().unwrap()).collect() };
    let points: Vec<Vec<f64>> = text.lines().skip(1).map(row).collect();
    let pieces = points.iter().zip(points.iter().cycle().skip(1));
    let area = 0.5 * pieces.map(|(p, q)| p[1] * q[2] - q[1] * p[2]).sum::<f64>();
    let expected = results.number("/volumes_input_units/2");
    assert!((area / expected - 1.0).abs() < 1e-4, "{area} {expected}");
    assert_eq!(place.listing(), ["disks", "out"]);
}

#[test]
fn a_path_in_space_has_its_surfaces() {
    let place = Place::new();
    let balls = drawn(&place, "disks", "3", "17");
    let results = connected(&place, &balls, &["--grid", "17", "-K", "2"], "out");
    check(&results, 2, &[17, 17, 17]);
    assert_eq!(results.json["surface"]["coordinates"], "input");
    let width = |k: usize| {
        let mut file = std::fs::File::open(results.path(&format!("shape_{k:03}.stl"))).unwrap();
        let mesh = stl_io::read_stl(&mut file).unwrap();
        mesh.validate().unwrap();
        let axis = || mesh.vertices.iter().map(|v| v.0[0]);
        axis().fold(0.0, f32::max) - axis().fold(16.0, f32::min)
    };
    // Balls of radius 3.2 and 4.8 samples.
    assert!((width(0) - 6.4).abs() < 0.2, "{}", width(0));
    assert!(width(1) > width(0) + 0.5 && width(2) > width(1) + 0.5);
}

#[test]
fn level_sets_connect_shapes_of_different_topology() {
    let place = Place::new();
    draw(&place, "m.npy", &["letter", "m", "--grid", "33"]);
    draw(&place, "o.npy", &["letter", "o", "--grid", "33"]);
    let ends = ["m.npy".to_owned(), "o.npy".to_owned()];
    let options = [
        "--grid",
        "33",
        "--steps",
        "3",
        "--form",
        "level-sets",
        "--area-weight",
        "2e-3",
        // Enough to see that it falls; the rest is the library's to test.
        "--max-iterations",
        "15",
    ];
    let results = connected(&place, &ends, &options, "out");
    check(&results, 3, &[33, 33]);
    assert_eq!(results.number("/parameters/area_weight"), 2e-3);
    assert_eq!(results.numbers("/mismatches").len(), 3);
    let table = std::fs::read_to_string(results.path("energy.csv")).unwrap();
    assert!(table.starts_with("nodes,iteration,evaluations,total,dissipation,mismatch,area\n"));
}

#[test]
fn aligned_shapes_are_turned_onto_the_first() {
    let place = Place::new();
    let bar = ["bar", "--angle", "100", "--grid", "65"];
    draw(&place, "a.npy", &bar);
    let mut turned = bar.to_vec();
    turned.extend(["--rotate", "70", "--shift", ".04,-.03"]);
    draw(&place, "b.npy", &turned);
    let ends = ["a.npy".to_owned(), "b.npy".to_owned()];
    let options = ["--grid", "33", "-K", "2", "--align", "rigid"];
    let results = connected(&place, &ends, &options, "out");
    check(&results, 2, &[33, 33]);
    let angle = |i: usize| results.number(&format!("/input/{i}/alignment/angle_degrees"));
    assert_eq!(angle(0), 0.0);
    assert!((angle(1) - 70.0).abs() < 0.5, "{}", angle(1));
    // What is left is a shift of hundredths of a cell.
    assert!(results.number("/dissipation") < 1e-3);
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let place = Place::new();
    let flat = drawn(&place, "bars", "2", "33");
    let solid = drawn(&place, "disks", "3", "17");
    for (name, ends, form) in [
        ("flat", &flat, "lagrangian"),
        ("level_sets", &flat, "level-sets"),
        ("solid", &solid, "lagrangian"),
    ] {
        let grid = if name == "solid" { "17" } else { "33" };
        let runs: Vec<Results> = ["1", "2"]
            .iter()
            .map(|threads| {
                let options = [
                    "--grid",
                    grid,
                    "-K",
                    "2",
                    "--form",
                    form,
                    "--threads",
                    threads,
                    "--max-iterations",
                    "15",
                ];
                connected(&place, ends, &options, &format!("{name}_{threads}"))
            })
            .collect();
        let (one, two) = (arrays(&runs[0]), arrays(&runs[1]));
        // Shapes and steps; deformations of the first shape where there is one domain, and of the last shape where
        // it is that one's.
        let motions = match (form, runs[0].json["domain"].as_str()) {
            ("lagrangian", Some("end")) => 4,
            ("lagrangian", _) => 2,
            _ => 0,
        };
        assert_eq!(one.len(), 3 + 2 + motions);
        for ((file, a), (_, b)) in one.iter().zip(&two) {
            assert!(a == b, "{name}: {file} differs");
        }
        assert_eq!(runs[0].json["levels"], runs[1].json["levels"]);
    }
}

#[test]
fn the_summary_ends_with_the_picture() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "17");
    let run = place.run(&[
        "geodesic", &disks[0], &disks[1], "-o", "out", "--grid", "17",
    ]);
    let text = succeeded(&run);
    let last = text.lines().last().unwrap();
    assert!(last.ends_with("out/geodesic.png"), "{last}");
    for word in ["Geodesic of 8 steps", "length", "Dice", "certified"] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    // One level for each of 1, 2, 4 and 8 steps, on either domain, from the identity and to targets; and the path
    // from the targets; then the best of them once more, to the end.
    let progress = String::from_utf8(run.stderr).unwrap();
    assert_eq!(
        progress.matches(" of 18, 17 nodes a side").count(),
        18,
        "{progress}"
    );
}

#[test]
fn what_cannot_work_is_refused_before_anything_is_written() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "17");
    place.write("empty.npy", &npy_f64(&[17, 17], &[0.0; 289]));
    let mut labels = [0u8; 64];
    labels[21] = 2;
    place.write("volume.nii", &nifti([4, 4, 4], [1.0; 3], &labels));
    std::fs::create_dir(place.path("taken")).unwrap();
    let before = place.listing();
    let (a, b) = (disks[0].as_str(), disks[1].as_str());
    for (arguments, words) in [
        (vec![a, "-o", "out"], vec!["END"]),
        (vec![a, b, a, "-o", "out"], vec!["unexpected"]),
        (vec![a, b, "-o", "taken"], vec!["'taken'", "exists already"]),
        (vec![a, b, "-o", "no/where"], vec!["no"]),
        (
            vec![a, "empty.npy", "-o", "out"],
            vec!["empty.npy", "empty shape"],
        ),
        (
            vec![a, "volume.nii", "-o", "out"],
            vec!["volume.nii", "picture"],
        ),
        (vec![a, "none.png", "-o", "out"], vec!["none.png"]),
        (vec![a, b, "-o", "out", "--grid", "64"], vec!["--grid 65"]),
        (vec![a, b, "-o", "out", "-K", "0"], vec!["--steps"]),
        (
            vec![a, b, "-o", "out", "--area-weight", "1"],
            vec!["--area-weight", "level-sets"],
        ),
        (
            vec![a, b, "-o", "out", "--void-stiffness", "2"],
            vec!["--void-stiffness"],
        ),
        (
            vec![
                a,
                b,
                "-o",
                "out",
                "--law",
                "power_two_term",
                "--lambda",
                ".01",
            ],
            vec!["power_two_term", "--lambda"],
        ),
    ] {
        let run = place.run(&[vec!["geodesic"], arguments.clone()].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {report}");
        for word in words {
            assert!(report.contains(word), "no '{word}' in: {report}");
        }
        assert!(!report.contains("panicked"), "{report}");
        assert_eq!(place.listing(), before);
    }
}

/// Ctrl-C ends the minimisation, and what has been reached is written: fewer steps, if it was
/// pressed early.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_writes_what_is_reached() {
    let place = Place::new();
    let bars = drawn(&place, "bars", "2", "33");
    // Far too fine to end by itself in the time of this test.
    let arguments = [
        "geodesic", &bars[0], &bars[1], "--grid", "1025", "-o", "out",
    ];
    assert_eq!(interrupted(&place, &arguments, "level 1 of"), Some(130));
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["status"], "cancelled");
    let nodes = results.numbers("/nodes")[0] as u64;
    assert!(nodes < 1025);
    let steps = results.numbers("/step_energies").len();
    check(&results, steps, &[nodes, nodes]);
    let listing = place.listing();
    assert!(
        listing.starts_with(&["bars".to_owned(), "out".to_owned()]),
        "{listing:?}"
    );
}

/// A square of 33 x 33 samples with a bar across, labelled 1 left of a border and 2 right of it.
fn halves(border: usize) -> Vec<f64> {
    let mut values = vec![0.0; 33 * 33];
    for y in 12..21 {
        for x in 6..27 {
            values[33 * y + x] = if x < border { 1.0 } else { 2.0 };
        }
    }
    values
}

#[test]
fn labels_are_components_of_one_motion() {
    let place = Place::new();
    place.write("a.npy", &npy_f64(&[33, 33], &halves(16)));
    place.write("b.npy", &npy_f64(&[33, 33], &halves(19)));
    let ends = ["a.npy".to_owned(), "b.npy".to_owned()];
    let options = ["--grid", "33", "-K", "2", "--labels"];
    let results = connected(&place, &ends, &options, "parts");
    check(&results, 2, &[33, 33]);
    assert_eq!(results.numbers("/labels"), [1.0, 2.0]);
    assert_eq!(results.numbers("/dice_components").len(), 2);
    // The outline stays, and the border between the labels moves: a third of the bar is stretched
    // by .3, the other compressed; an outline alone would have the length 0.
    let length = results.number("/length");
    assert!((0.03..0.3).contains(&length), "{length}");
    let (_, component) = results.array("shape_002_component_1.npy");
    // Right of the border is inside of the second label's level set.
    assert!(component[33 * 16 + 22] > 0.0 && component[33 * 16 + 16] < 0.0);

    let mut other = halves(16);
    other[33 * 13 + 8] = 5.0;
    place.write("c.npy", &npy_f64(&[33, 33], &other));
    let run = place.run(&["geodesic", "a.npy", "c.npy", "-o", "out", "--labels"]);
    assert_eq!(run.status.code(), Some(2));
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    for word in ["--labels", "c.npy", "5"] {
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
}

#[test]
fn a_shape_that_is_hidden_in_part_is_restored() {
    let place = Place::new();
    draw(
        &place,
        "whole.npy",
        &["bar", "--angle", "130", "--grid", "65"],
    );
    draw(
        &place,
        "template.npy",
        &["bar", "--angle", "150", "--grid", "65"],
    );
    let (_, mut values) = array(&place.path("whole.npy"));
    let mut view = vec![1.0; values.len()];
    // A piece in the middle of one arm is covered.
    for (index, (value, seen)) in values.iter_mut().zip(&mut view).enumerate() {
        if (40..46).contains(&(index % 65)) {
            (*value, *seen) = (0.0, 0.0);
        }
    }
    place.write("seen.npy", &npy_f64(&[65, 65], &values));
    place.write("view.npy", &npy_f64(&[65, 65], &view));
    let run = |end: &str, output: &str, options: &[&str]| {
        let ends = ["template.npy".to_owned(), end.to_owned()];
        let mut all = vec!["--grid", "65", "-K", "2"];
        all.extend(options);
        connected(&place, &ends, &all, output)
    };
    let full = run("whole.npy", "full", &[]);
    let partial = run("seen.npy", "partial", &["--valid-end", "view.npy"]);
    check(&partial, 2, &[65, 65]);
    let change = partial.number("/length") / full.number("/length") - 1.0;
    assert!(change.abs() < 0.1, "the distance changes by {change}");
    let area = |results: &Results| results.numbers("/volumes")[2];
    assert!((area(&partial) / area(&full) - 1.0).abs() < 0.03);
    // Without a mask of what was seen, what is there has to be covered, and no more.
    let inside = run("seen.npy", "inside", &["--occluded", "end"]);
    assert_eq!(inside.json["parameters"]["occluded"], "end");
    assert!(inside.number("/length") < 1.1 * full.number("/length"));
    assert!(area(&inside) > 0.9 * area(&full));
    // With deformations nothing would be compared; and a mask says where the shape is hidden.
    for (options, word) in [
        (&["--occluded", "both"][..], "--form level-sets"),
        (
            &["--occluded", "both", "--form", "level-sets", "-K", "1"],
            "two steps",
        ),
        (
            &["--occluded", "end", "--valid-end", "view.npy"],
            "--valid-end",
        ),
    ] {
        let ends = ["geodesic", "template.npy", "seen.npy", "-o", "none"];
        let run = place.run(&[&ends, options].concat());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(
            report.contains("--occluded") && report.contains(word),
            "{report}"
        );
    }
    // The mask has to fit its shape.
    place.write("small.npy", &npy_f64(&[2, 2], &[0.0, 1.0, 1.0, 1.0]));
    let run = place.run(&[
        "geodesic",
        "template.npy",
        "seen.npy",
        "-o",
        "out",
        "--valid-end",
        "small.npy",
    ]);
    assert_eq!(run.status.code(), Some(2));
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        report.contains("--valid-end") && report.contains("small.npy"),
        "{report}"
    );
}

#[test]
fn a_path_of_a_shape_between_is_checked_and_continued() {
    let place = Place::new();
    for (name, radius) in [("a.npy", "0.2"), ("b.npy", "0.26")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "33"]);
    }
    let ends = ["a.npy".to_owned(), "b.npy".to_owned()];
    let options = ["--grid", "33", "-K", "2", "--domain", "middle"];
    let results = connected(&place, &ends, &options, "path");
    assert_eq!(results.json["domain"], "middle");
    assert_eq!(results.numbers("/step_energies").len(), 2);
    for file in [
        "middle_shape.npy",
        "middle_000.npy",
        "middle_002.npy",
        "psi_002.npy",
    ] {
        assert!(results.path(file).is_file(), "no {file}");
    }
    let forms: Vec<_> = results.json["levels"].as_array().unwrap().iter().collect();
    assert_eq!(forms[0]["form"], "level_sets");
    assert_eq!(forms[forms.len() - 1]["form"], "lagrangian");
    let report = place.run(&["check", "path"]);
    succeeded(&report);
    let text = String::from_utf8_lossy(&report.stdout);
    assert!(
        text.contains("energy of step 2") && !text.contains("WRONG"),
        "{text}"
    );
    succeeded(&place.compute(&["extend", "path", "-K", "1", "-o", "further"]));
    // A disk that grows goes on to grow.
    let further = Results::read(&place.path("further"));
    let sizes = further.numbers("/volumes");
    assert!(
        sizes[sizes.len() - 1] > 1.05 * sizes[sizes.len() - 2],
        "{sizes:?}"
    );
}

/// A ring that is thinner than the cells of the grid has no boundary at the end of a path: doubted, and no failure.
#[test]
fn what_vanishes_on_the_grid_is_doubted() {
    let place = Place::new();
    let nodes = 65;
    let field = |inside: &dyn Fn(f64) -> bool| -> Vec<f64> {
        let places = (0..nodes * nodes).map(|i| [i % nodes, i / nodes]);
        let radii = places.map(|[i, j]| (i as f64 / 64.0 - 0.5).hypot(j as f64 / 64.0 - 0.5));
        radii.map(|r| f64::from(u8::from(inside(r)))).collect()
    };
    let ring = field(&|r| (r - 0.3).abs() < 0.009);
    let dot = field(&|r| r < 0.02);
    for (name, values) in [("ring.npy", ring), ("dot.npy", dot)] {
        std::fs::write(place.path(name), npy_f64(&[nodes, nodes], &values)).unwrap();
    }
    let ends = ["ring.npy".to_owned(), "dot.npy".to_owned()];
    let options = ["--grid", "33", "-K", "1", "--align", "none"];
    let results = connected(&place, &ends, &options, "path");
    assert_eq!(results.json["verdict"], "doubtful");
    // The comparison with the geodesic leaves out what has no figure, too.
    let film = [
        &["length", &ends[0], &ends[1], "-o", "film"],
        &options[..2],
        &options[4..],
    ]
    .concat();
    succeeded(&place.compute(&film));
    let film = Results::read(&place.path("film"));
    assert_eq!(film.json["verdict"], "doubtful");
    assert!(film.json["geodesic"].get("arrival").is_none());
}
