//! `pca`, `synthesize` and `score` from files to files.

use std::path::Path;

use crate::common::{Place, Results, array, arrays, draw, drawn, npy_f64, picture_size, succeeded};

/// The average of shapes of a family, and its modes.
fn analysed(place: &Place, shapes: &[String], grid: &str, options: &[&str]) -> Results {
    let mut arguments = vec!["average"];
    arguments.extend(shapes.iter().map(String::as_str));
    arguments.extend(["-o", "average", "--grid", grid]);
    arguments.extend(["--length-weight", "1e-5", "--tolerance", "2e-4"]);
    succeeded(&place.compute(&arguments));
    let mut arguments = vec!["pca", "average", "-o", "modes"];
    arguments.extend(options);
    let printed = succeeded(&place.compute(&arguments));
    assert!(printed.contains("modes of variation"), "{printed}");
    Results::read(&place.path("modes"))
}

/// What every directory holds.
fn check_files(results: &Results, size: &[u64], shapes: usize, modes: usize) {
    let mut vector = vec![size.len() as u64];
    vector.extend(size);
    for (kind, count) in [("mode", modes), ("displacement", shapes)] {
        for k in 0..count {
            assert_eq!(results.array(&format!("{kind}_{k:03}.npy")).0, vector);
        }
        assert!(!results.path(&format!("{kind}_{count:03}.npy")).exists());
    }
    let boundaries = ["mean", "mode_000_minus", "mode_000_plus"];
    let endings: &[&str] = if size.len() == 2 {
        &["_outline.csv", "_outline.svg", "_outline.geojson"]
    } else {
        &[".stl", ".ply", ".vtp"]
    };
    for name in boundaries {
        for ending in endings {
            assert!(results.path(&format!("{name}{ending}")).is_file());
        }
    }
    let n = shapes as u64;
    assert_eq!(results.array("gram.npy").0, [n, n]);
    let table = std::fs::read_to_string(results.path("scores.csv")).unwrap();
    assert_eq!(table.lines().count(), shapes + 1);
    let map = (modes > 1).then_some("scores.png");
    for name in ["modes.png", "mode_000.apng"].into_iter().chain(map) {
        let [width, height] = picture_size(&results.path(name));
        assert!(width > 100 && height > 100, "{name}");
    }
    for name in [
        "report.md",
        "scree.svg",
        "quality.svg",
        "quality.csv",
        "modes.vti",
    ] {
        assert!(results.path(name).is_file(), "{name}");
    }
}

#[test]
fn bars_have_one_mode_which_bends_them() {
    let place = Place::new();
    let bars = drawn(&place, "bars", "2", "65");
    let results = analysed(&place, &bars, "65", &[]);
    check_files(&results, &[65, 65], 2, 1);
    let ratios = results.numbers("/ratios");
    assert!(ratios.len() == 2 && ratios[1].abs() < 1e-10, "{ratios:?}");
    assert!(
        results.number("/balance") < 0.1,
        "{}",
        results.number("/balance")
    );
    assert_eq!(results.json["definite"], true);
    // The first bar, straight, comes back from the bent average but for its curvature.
    assert!(results.numbers("/procrustes").iter().all(|r| *r < 0.04));
    let rms = results.number("/mahalanobis_over_n_rms");
    assert!((rms - 0.5f64.sqrt()).abs() < 1e-8, "{rms}");

    // A shape with the score of the first bar is about that bar.
    let table = std::fs::read_to_string(results.path("scores.csv")).unwrap();
    let first: Vec<&str> = table.lines().nth(1).unwrap().split(',').collect();
    let arguments = ["synthesize", "modes", "--scores", first[9], "-o"];
    let run = |output: &str, more: &[&str]| {
        let mut arguments = arguments.to_vec();
        arguments.push(output);
        arguments.extend(more);
        succeeded(&place.compute(&arguments));
        Results::read(&place.path(output))
    };
    let made = run("linear", &[]);
    let curved = run("nonlinear", &["--nonlinear"]);
    assert_eq!(made.array("shape.npy").0, [65, 65]);
    assert_eq!(curved.number("/load_share"), 1.0);
    let inside = |values: &[f64], level: f64| values.iter().map(|v| *v > level).collect::<Vec<_>>();
    let (_, drawn) = array(Path::new(&bars[0]));
    let bar = inside(&drawn, 0.5);
    for shape in [&made, &curved] {
        let mask = inside(&shape.array("shape.npy").1, 0.0);
        let both = mask.iter().zip(&bar).filter(|(a, b)| **a && **b).count();
        let all = mask.iter().chain(&bar).filter(|a| **a).count();
        let dice = 2.0 * both as f64 / all as f64;
        assert!(dice > 0.9, "{dice}");
    }

    // A training shape that is scored as a new one is where it was.
    let arguments = [
        "score", &bars[0], &bars[1], "--pca", "modes", "-o", "scored",
    ];
    succeeded(&place.compute(&arguments));
    let scored = Results::read(&place.path("scored"));
    let (found, known) = (
        scored.numbers("/mahalanobis"),
        results.numbers("/mahalanobis"),
    );
    for (found, known) in found.iter().zip(&known) {
        // The average is matched again, to the tolerance of the minimiser.
        assert!((found / known - 1.0).abs() < 0.1, "{found} {known}");
    }
    assert!(
        scored
            .numbers("/dice")
            .iter()
            .all(|d| (0.9..=1.0).contains(d))
    );
    assert!(scored.numbers("/residual").iter().all(|r| *r < 0.3));
    assert!(scored.path("score.png").is_file() && scored.path("reconstruction.svg").is_file());
}

/// Modes of finite displacements give the shapes back exactly, however far they bend; the average need not
/// be in equilibrium.
#[test]
fn modes_of_displacements_are_finite() {
    let place = Place::new();
    let bars = drawn(&place, "bars", "2", "65");
    let finite = ["--variation", "displacement"];
    let results = analysed(&place, &bars, "65", &finite);
    check_files(&results, &[65, 65], 2, 1);
    assert!(results.json["continuation"].is_null());
    // The boundaries return to where they were, but for the interpolation of the inverse between nodes.
    let residuals = results.numbers("/procrustes");
    assert!(residuals.iter().all(|r| *r < 2e-3), "{residuals:?}");

    let table = std::fs::read_to_string(results.path("scores.csv")).unwrap();
    let (_, drawn) = array(Path::new(&bars[1]));
    let second: Vec<&str> = table.lines().nth(2).unwrap().split(',').collect();
    let synthesize = ["synthesize", "modes", "--scores", second[9], "-o", "made"];
    succeeded(&place.compute(&synthesize));
    let made = Results::read(&place.path("made")).array("shape.npy").1;
    let pairs = || made.iter().zip(&drawn).map(|(a, b)| (*a > 0.0, *b > 0.5));
    let both = pairs().filter(|(a, b)| *a && *b).count();
    let all = pairs()
        .map(|(a, b)| u32::from(a) + u32::from(b))
        .sum::<u32>();
    // The folded bar lies where it lay but for the motion that aligns it with the average: a cell at most.
    let dice = 2.0 * both as f64 / f64::from(all);
    assert!(dice > 0.9, "{dice}");

    // The mean is the shape of zero scores, and not the average.
    succeeded(&place.compute(&["synthesize", "modes", "--scores", "0", "-o", "zero"]));
    let outline = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
    assert_eq!(
        outline("modes/mean_outline.csv"),
        outline("zero/shape_outline.csv")
    );

    let refused = place.run(&[&synthesize[..5], &["other", "--nonlinear"]].concat());
    assert_eq!(refused.status.code(), Some(2));
    let report = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(report.contains("--nonlinear"), "{report}");

    let score = ["score", &bars[1], "--pca", "modes", "-o", "scored"];
    succeeded(&place.compute(&score));
    let scored = Results::read(&place.path("scored"));
    let (found, known) = (
        scored.numbers("/mahalanobis")[0],
        results.numbers("/mahalanobis")[1],
    );
    // The average is matched again, to the tolerance of the minimiser.
    assert!((found / known - 1.0).abs() < 0.05, "{found} {known}");
    assert!(scored.numbers("/residual")[0] < 0.2);
}

#[test]
fn threads_and_instruction_set_do_not_matter_and_modes_can_be_few() {
    let place = Place::new();
    let crosses = drawn(&place, "crosses", "2", "65");
    let results = analysed(
        &place,
        &crosses,
        "33",
        &["--modes", "2", "--metric", "hessian"],
    );
    check_files(&results, &[33, 33], 4, 2);
    assert_eq!(results.numbers("/eigenvalues").len(), 4);
    let run = |threads: &str, instructions: &str| {
        let output = format!("on{threads}{instructions}");
        let arguments = [
            "pca",
            "average",
            "-o",
            &output,
            "--threads",
            threads,
            "--at-rest",
            "--allow-doubtful",
        ];
        let variables = [("SHAPESPACE_SIMD", instructions)];
        succeeded(&place.run_with(&arguments, &variables));
        arrays(&Results::read(&place.path(&output)))
    };
    let vectors = run("1", "256");
    assert!(vectors == run("3", "256"));
    assert!(vectors == run("1", "scalar"));
}

/// Nearly round shapes turn in themselves for next to nothing. That their minimisations go on for long is no doubt:
/// the scores are those of the analysis.
#[test]
fn nearly_round_training_shapes_have_their_own_scores() {
    let place = Place::new();
    let side = 65;
    let mut names = Vec::new();
    for (k, [wide, sharp]) in [[0.1, 0.02], [-0.06, 0.05], [0.03, -0.04], [-0.09, -0.01]]
        .into_iter()
        .enumerate()
    {
        let value = |node: usize| {
            let [x, y] = [node % side, node / side].map(|i| i as f64 - 32.0);
            let angle = y.atan2(x);
            let radius = 19.0 * (1.0 + wide * (2.0 * angle).cos() + sharp * (3.0 * angle).cos());
            (0.5 + radius - x.hypot(y)).clamp(0.0, 1.0)
        };
        let values: Vec<f64> = (0..side * side).map(value).collect();
        names.push(format!("{k}.npy"));
        place.write(&names[k], &npy_f64(&[side, side], &values));
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let own = ["--align", "none", "--grid", "33", "-o", "average"];
    succeeded(&place.compute(&[&["average"], &names[..], &own].concat()));
    succeeded(&place.compute(&["pca", "average", "-o", "modes"]));
    let modes = Results::read(&place.path("modes"));
    let own = ["--pca", "modes", "-o", "scored"];
    succeeded(&place.compute(&[&["score"], &names[..], &own].concat()));
    let scored = Results::read(&place.path("scored"));
    assert_eq!(scored.json["verdict"], "sound", "{}", scored.json["doubts"]);
    for k in 0..4 {
        for j in 0..2 {
            let [own, again] = [&modes, &scored].map(|r| r.number(&format!("/scores/{k}/{j}")));
            assert!((own - again).abs() < 0.05, "{own} {again}");
        }
    }
}

#[test]
fn volumes_have_modes_too() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "3", "17");
    let results = analysed(&place, &disks, "17", &[]);
    check_files(&results, &[17, 17, 17], 2, 1);
    let arguments = ["synthesize", "modes", "--scores", "1", "-o", "made"];
    succeeded(&place.compute(&arguments));
    assert!(place.path("made/shape.stl").is_file());
    let arguments = ["score", &disks[0], "--pca", "modes", "-o", "scored"];
    succeeded(&place.compute(&arguments));
}

fn refused(place: &Place, arguments: &[&str], words: &[&str]) {
    let before = place.listing();
    let run = place.run(arguments);
    let report = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{report}");
    for word in words {
        assert!(report.contains(word), "{word}: {report}");
    }
    assert_eq!(place.listing(), before);
}

#[test]
fn what_cannot_be_used_is_refused() {
    let place = Place::new();
    let bars = drawn(&place, "bars", "2", "33");
    analysed(&place, &bars, "17", &[]);
    refused(
        &place,
        &["pca", "nothing", "-o", "on"],
        &["nothing", "result.json", "average"],
    );
    refused(
        &place,
        &["pca", "modes", "-o", "on"],
        &["shapespace average"],
    );
    refused(
        &place,
        &["pca", "average", "-o", "average"],
        &["exists already"],
    );
    let many = ["synthesize", "modes", "--scores", "1,2", "-o", "on"];
    refused(&place, &many, &["--scores", "1 modes"]);
    let none = ["score", &bars[0], "--pca", "average", "-o", "on"];
    refused(&place, &none, &["shapespace pca"]);
}

/// A shape far from the others is named with its p-value; without one nothing is said.
#[test]
fn outliers_are_named() {
    let place = Place::new();
    let mut inputs = Vec::new();
    for (k, radius) in [".2", ".207", ".21", ".216", ".22", ".224", ".23", ".34"]
        .into_iter()
        .enumerate()
    {
        let name = format!("disk{k}.npy");
        draw(&place, &name, &["disk", "--radius", radius, "--grid", "33"]);
        inputs.push(name);
    }
    let analysed = |inputs: &[String], out: &str| {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        let average = format!("{out}_average");
        let fixed = ["--grid", "33", "-o", &average];
        succeeded(&place.compute(&[&["average"], &inputs[..], &fixed].concat()));
        let printed = succeeded(&place.compute(&["pca", &average, "-o", out]));
        let results = Results::read(&place.path(out));
        let report = std::fs::read_to_string(results.path("report.md")).unwrap();
        (results, printed, report)
    };
    let (results, printed, report) = analysed(&inputs, "with");
    let outliers = results.json["outliers"].as_array().unwrap();
    assert_eq!(outliers.len(), 1, "{outliers:?}");
    assert_eq!(outliers[0]["shape"], "disk7");
    let p = results.number("/outliers/0/p_value");
    assert!((results.number("/outliers/0/p_value_of_all") / p - 8.0).abs() < 1e-12);
    let words = format!("disk7 (p = {:.2e})", 8.0 * p);
    assert!(
        printed.contains(&format!("outliers     {words}")),
        "{printed}"
    );
    assert!(report.contains(&words), "{report}");

    let (results, printed, report) = analysed(&inputs[..7], "without");
    assert!(results.json["outliers"].is_null());
    let all = [printed, report].concat().to_lowercase();
    assert!(!all.contains("outlier"), "{all}");
}
