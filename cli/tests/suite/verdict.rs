//! Results that mislead are doubtful, for the right reason, and sound ones are not.

use std::path::Path;

use levelset::{Cause, Limit};
use serde_json::Value;

use crate::common::{Place, Results, drawn, grey_png, npy_f64, succeeded};

const SIDE: u32 = 64;

/// A picture of these grey values, by position in pixels from the middle.
fn picture(place: &Place, name: &str, grey: impl Fn(f64, f64) -> f64) {
    let middle = 0.5 * f64::from(SIDE) - 0.5;
    let pixels: Vec<u8> = (0..SIDE * SIDE)
        .map(|i| {
            let [x, y] = [i % SIDE, i / SIDE].map(|k| f64::from(k) - middle);
            (255.0 * grey(x, y)).round() as u8
        })
        .collect();
    place.write(name, &grey_png(SIDE, SIDE, &pixels));
}

/// 1 inside an ellipse about a point, 0 outside.
fn ellipse([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    f64::from(u8::from((x / a).hypot(y / b) < 1.0))
}

fn ordinary(place: &Place, name: &str) {
    picture(place, name, |x, y| ellipse([20.0, 14.0], [x, y]));
}

/// The causes of the doubts about a shape, or about the result as a whole.
fn causes(results: &Results, shape: Option<&str>) -> Vec<String> {
    let doubts = results.json["doubts"].as_array().unwrap();
    let about = doubts
        .iter()
        .filter(|doubt| doubt.get("shape").and_then(Value::as_str) == shape);
    about
        .map(|doubt| doubt["what"].as_str().unwrap().into())
        .collect()
}

/// Runs a command that has a doubtful result, and returns that with the standard output.
fn doubtful(place: &Place, arguments: &[&str]) -> (Results, String) {
    let run = place.run(&[arguments, &["-o", "out"]].concat());
    let text = String::from_utf8(run.stdout).unwrap();
    let report = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(3), "{text}{report}");
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["verdict"], "doubtful");
    assert!(text.contains("\n  verdict      doubtful\n"), "{text}");
    for doubt in results.json["doubts"].as_array().unwrap() {
        let remedy = doubt["remedy"].as_str().unwrap();
        let [figure, limit] = ["figure", "limit"].map(|key| doubt[key].as_f64().unwrap());
        assert!(figure != limit && !remedy.is_empty(), "{doubt}");
        assert!(text.contains(&format!("remedy: {remedy}")), "{text}");
    }
    assert!(
        text.trim_end().lines().last().unwrap().contains("remedy: "),
        "{text}"
    );
    (results, text)
}

/// Averages an ordinary mask and one that has these doubts.
fn misleads(mislead: impl Fn(f64, f64) -> f64, options: &[&str], cause: &str) -> Results {
    let place = Place::new();
    ordinary(&place, "good.png");
    picture(&place, "bad.png", mislead);
    let arguments = ["average", "good.png", "bad.png", "--grid", "65"];
    let (results, text) = doubtful(&place, &[&arguments, options].concat());
    let found = causes(&results, Some("bad"));
    assert!(
        found.iter().any(|found| found == cause),
        "{cause}: {found:?}"
    );
    assert!(text.contains("    bad: "), "{text}");
    let good = causes(&results, Some("good"));
    assert!(good.iter().all(|found| found != cause), "{cause}: {good:?}");
    results
}

#[test]
fn a_speck_is_found() {
    let speck =
        |x: f64, y: f64| f64::from(u8::from((x - 28.0).abs() < 1.0 && (y - 28.0).abs() < 1.0));
    let results = misleads(
        |x, y| ellipse([20.0, 14.0], [x, y]).max(speck(x, y)),
        &[],
        "specks",
    );
    let doubts = results.json["doubts"].as_array().unwrap();
    let specks = doubts.iter().find(|doubt| doubt["what"] == "specks");
    assert_eq!(specks.unwrap()["shape"], "bad");
}

#[test]
fn an_object_that_is_cut_off_is_found() {
    misleads(|x, y| ellipse([20.0, 14.0], [x - 20.0, y]), &[], "border");
}

#[test]
fn an_inverted_mask_is_found() {
    misleads(
        |x, y| 1.0 - ellipse([20.0, 14.0], [x, y]),
        &[],
        "background",
    );
}

#[test]
fn a_grey_scan_is_found() {
    misleads(
        |x, y| (1.0 - (x / 28.0).hypot(y / 20.0)).clamp(0.0, 1.0),
        &[],
        "grey_values",
    );
}

#[test]
fn a_mask_of_few_samples_is_found_and_one_with_grey_values_is_not() {
    let place = Place::new();
    ordinary(&place, "good.png");
    // The same ellipse on 13 pixels, five spacings of the grid each; the second one with the share of every pixel.
    let coarse = |parts: u32| -> Vec<u8> {
        let fine = 13 * parts;
        let inside = |i: u32, j: u32| {
            let centred = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(fine) - 0.5);
            ellipse([20.0, 14.0], centred.map(|x| 64.0 * x))
        };
        let share = |i: u32, j: u32| -> f64 {
            let all =
                (0..parts * parts).map(|n| inside(i * parts + n % parts, j * parts + n / parts));
            all.sum::<f64>() / f64::from(parts * parts)
        };
        let grey = (0..169).map(|n| (255.0 * share(n % 13, n / 13)).round() as u8);
        grey.collect()
    };
    place.write("coarse.png", &grey_png(13, 13, &coarse(1)));
    place.write("grey.png", &grey_png(13, 13, &coarse(8)));
    let sized = ["--grid", "65", "--size", "equal"];
    let average = ["average", "good.png", "coarse.png", "grey.png"];
    let (results, _) = doubtful(&place, &[&average[..], &sized].concat());
    let is_found = |name| causes(&results, Some(name)).contains(&"coarse_samples".into());
    assert_eq!(
        ["good", "coarse", "grey"].map(is_found),
        [false, true, false]
    );
}

#[test]
fn a_bar_that_is_thinner_than_three_cells_is_found() {
    let place = Place::new();
    picture(&place, "good.png", |x, y| ellipse([24.0, 14.0], [x, y]));
    picture(&place, "bar.png", |x, y| {
        f64::from(u8::from(x.abs() < 24.0 && y.abs() < 2.0))
    });
    let (results, _) = doubtful(&place, &["average", "good.png", "bar.png", "--grid", "33"]);
    let found = causes(&results, Some("bar"));
    assert!(found.iter().any(|found| found == "thin_parts"), "{found:?}");
    assert!(!causes(&results, Some("good")).contains(&"thin_parts".into()));
}

#[test]
fn a_gap_that_is_narrower_than_a_cell_is_found_before_anything_is_computed() {
    let place = Place::new();
    // The fork has two prongs beside each other; a cell of its grid is about two and a half pixels wide.
    let fork = |gap: f64| {
        move |x: f64, y: f64| {
            let whole = x.abs() < 20.0 && y.abs() < 26.0;
            f64::from(u8::from(whole && (y > 16.0 || x.abs() >= 0.5 * gap)))
        }
    };
    picture(&place, "wide.png", fork(12.0));
    picture(&place, "closed.png", fork(1.5));
    let run = place.run(&[
        "average",
        "wide.png",
        "closed.png",
        "--grid",
        "33",
        "-o",
        "out",
    ]);
    assert_eq!(run.status.code(), Some(3));
    let results = Results::read(&place.path("out"));
    let gaps = "narrow_gaps".to_owned();
    assert!(causes(&results, Some("closed")).contains(&gaps));
    assert!(!causes(&results, Some("wide")).contains(&gaps));
    let text = String::from_utf8(run.stderr).unwrap();
    let said = text.find("closed: share of the boundary along gaps narrower than a cell");
    assert!(said.is_some() && said < text.find("level 1 of"), "{text}");
}

/// A flag: a pole with two bars on one side.
fn flag(x: f64, y: f64) -> f64 {
    let inside =
        |low: [f64; 2], high: [f64; 2]| x > low[0] && x < high[0] && y > low[1] && y < high[1];
    let parts = [
        inside([-10.0, -20.0], [-3.0, 20.0]),
        inside([-10.0, 12.0], [14.0, 20.0]),
        inside([-10.0, -4.0], [8.0, 4.0]),
    ];
    f64::from(u8::from(parts.contains(&true)))
}

#[test]
fn a_reflected_shape_is_found_and_a_turned_one_is_not() {
    let place = Place::new();
    for name in ["a.png", "b.png"] {
        picture(&place, name, flag);
    }
    picture(&place, "turned.png", |x, y| flag(y, -x));
    picture(&place, "reflected.png", |x, y| flag(-x, y));
    let arguments = ["average", "a.png", "b.png", "turned.png", "reflected.png"];
    let options = ["--align", "rigid", "--grid", "65"];
    let (results, _) = doubtful(&place, &[&arguments[..], &options].concat());
    let found = causes(&results, Some("reflected"));
    assert!(found.contains(&"reflection".into()), "{found:?}");
    for name in ["a", "b", "turned"] {
        let found = causes(&results, Some(name));
        assert!(!found.contains(&"reflection".into()), "{name}: {found:?}");
    }
}

/// The shape that all others are compared with is the first of equally large ones.
#[test]
fn the_reflected_one_of_many_is_named_whichever_is_compared() {
    let place = Place::new();
    picture(&place, "reflected.png", |x, y| flag(-x, y));
    for (name, share) in [("a.png", 1.0), ("b.png", 1.0), ("wide.png", 0.9)] {
        picture(&place, name, |x, y| flag(share * x, y));
    }
    picture(&place, "turned.png", |x, y| flag(y, -x));
    let options = ["--align", "rigid", "--grid", "33"];
    let inputs = ["average", "reflected.png", "a.png", "b.png", "turned.png"];
    let (results, _) = doubtful(&place, &[&inputs[..], &options].concat());
    let named = |name: &str| causes(&results, Some(name)).contains(&"reflection".into());
    assert!(named("reflected"), "{:?}", results.json["doubts"]);
    assert!(!named("a") && !named("b") && !named("turned"));
    // New shapes are compared with the average.
    let mean = [
        &["average", "a.png", "wide.png", "-o", "mean"],
        &options[..],
    ]
    .concat();
    succeeded(&place.compute(&mean));
    succeeded(&place.compute(&["pca", "mean", "-o", "modes"]));
    let new = [
        "score",
        "reflected.png",
        "turned.png",
        "--pca",
        "modes",
        "-o",
        "scores",
    ];
    succeeded(&place.compute(&new));
    let results = Results::read(&place.path("scores"));
    let reflected = |name: &str| causes(&results, Some(name)).contains(&"reflection".into());
    assert!(reflected("reflected"), "{:?}", results.json["doubts"]);
    assert!(!reflected("turned"), "{:?}", results.json["doubts"]);
}

/// Shapes that are their own reflections are not named, nor those that differ on both sides.
#[test]
fn symmetric_shapes_are_not_reflected() {
    let place = Place::new();
    for family in ["disks", "bars", "crosses"] {
        let files = drawn(&place, family, "2", "33");
        let out = format!("mean_of_{family}");
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        let options = [
            "--align",
            "rigid",
            "--grid",
            "33",
            "--max-iterations",
            "1",
            "-o",
            &out,
        ];
        place.compute(&[&["average"], &files[..], &options].concat());
        let results = Results::read(&place.path(&out));
        let doubts = results.json["doubts"].as_array();
        let named = |doubt: &serde_json::Value| doubt["what"] == "reflection";
        assert!(
            !doubts.is_some_and(|all| all.iter().any(named)),
            "{doubts:?}"
        );
    }
}

#[test]
fn too_few_iterations_are_found_and_can_be_allowed() {
    let place = Place::new();
    let files = drawn(&place, "bars", "2", "65");
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let short = ["--grid", "65", "--max-iterations", "1"];
    let arguments = [&["average"], &files[..], &short].concat();
    let (results, _) = doubtful(&place, &arguments);
    assert!(causes(&results, None).contains(&"not_converged".into()));
    assert_eq!(results.json["status"], "max_iterations");
    let allowed = [&arguments[..], &["--allow-doubtful", "-o", "allowed"]].concat();
    let text = succeeded(&place.run(&allowed));
    assert!(text.contains("verdict      doubtful"), "{text}");
    let again = Results::read(&place.path("allowed"));
    assert_eq!(again.json["doubts"], results.json["doubts"]);
}

#[test]
fn shapes_of_very_different_sizes_are_found() {
    let place = Place::new();
    picture(&place, "small.png", |x, y| ellipse([4.0, 4.0], [x, y]));
    picture(&place, "large.png", flag);
    let arguments = ["average", "small.png", "large.png", "--grid", "33"];
    doubtful(&place, &arguments);
}

/// Deformations of a disk have no hole.
#[test]
fn a_path_that_does_not_arrive_is_found() {
    let place = Place::new();
    let disk = |r: f64, [x, y]: [f64; 2]| ellipse([r, r], [x, y]);
    picture(&place, "disk.png", |x, y| disk(20.0, [x, y]));
    picture(&place, "ring.png", |x, y| {
        disk(22.0, [x, y]) - disk(9.0, [x, y])
    });
    let arguments = [
        "geodesic", "disk.png", "ring.png", "--grid", "33", "-K", "2", "--domain", "start",
    ];
    let (results, _) = doubtful(&place, &arguments);
    let found = causes(&results, None);
    for cause in ["path_end", "path_boundary", "path_parts"] {
        assert!(found.contains(&cause.into()), "{found:?}");
    }
    assert_eq!(results.json["end_reached"], false);
}

/// Averages a family, which must be sound.
fn sound(family: &str, dimension: &str, grid: &str, seed: &str) {
    let place = Place::new();
    let (drawn_as, output) = (["generate", "family", family], ["-o", "shapes"]);
    let shape = ["--dimension", dimension, "--grid", grid, "--seed", seed];
    succeeded(&place.run(&[&drawn_as[..], &shape, &output].concat()));
    let mut files: Vec<String> = std::fs::read_dir(place.path("shapes"))
        .unwrap()
        .map(|entry| entry.unwrap().path().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    // Volumes take long, and few of them are as telling.
    files.truncate(if dimension == "3" { 3 } else { usize::MAX });
    let files = files.iter().map(String::as_str);
    let arguments = ["average", "--grid", grid, "-o", "out"]
        .into_iter()
        .chain(files);
    let run = place.run(&arguments.collect::<Vec<_>>());
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert_eq!(run.status.code(), Some(0), "{family} {dimension}: {text}");
    assert!(text.contains("\n  verdict      sound\n"), "{text}");
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["verdict"], "sound");
    assert_eq!(results.json["doubts"], Value::Array(Vec::new()));
}

#[test]
fn families_in_the_plane_are_sound() {
    for family in ["bars", "disks", "crosses", "stars", "letters"] {
        sound(family, "2", "65", "1");
    }
}

#[test]
fn random_families_are_sound() {
    for seed in ["1", "2", "3"] {
        sound("blobs", "2", "65", seed);
    }
}

#[test]
fn families_in_space_are_sound() {
    sound("blobs", "3", "33", "1");
}

/// The page says of every cause what its criterion says.
#[test]
fn the_page_states_all_limits() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/verdict.md");
    let page = std::fs::read_to_string(path).unwrap();
    let sections = Cause::ALL.map(|cause| {
        let criterion = cause.criterion();
        let name = serde_json::to_value(cause).unwrap();
        let (bound, limit) = match criterion.limit {
            Limit::AtLeast(limit) => ("at least", limit),
            Limit::AtMost(limit) => ("at most", limit),
        };
        let [figure, reason, remedy] = [criterion.figure, criterion.reason, criterion.remedy];
        let name = name.as_str().unwrap();
        format!("## {name}\n\n{figure}: {bound} {limit}\n\n{reason}\n\nRemedy: {remedy}.\n")
    });
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let missing = sections
        .iter()
        .filter(|section| !words(&page).contains(&words(section)));
    let missing: Vec<&str> = missing.map(String::as_str).collect();
    assert!(
        missing.is_empty(),
        "missing from docs/verdict.md:\n{}",
        missing.join("\n")
    );
}

/// Every pair of distances is aligned by itself, and looked at by itself.
#[test]
fn a_reflected_shape_among_distances_is_named() {
    let place = Place::new();
    picture(&place, "a.png", flag);
    picture(&place, "turned.png", |x, y| flag(y, -x));
    picture(&place, "reflected.png", |x, y| flag(-x, y));
    let arguments = ["distances", "a.png", "turned.png", "reflected.png"];
    let options = ["--grid", "33", "-K", "1"];
    let (results, _) = doubtful(&place, &[&arguments[..], &options].concat());
    let reflection = "reflection".to_owned();
    assert!(causes(&results, Some("reflected")).contains(&reflection));
    for name in ["a", "turned"] {
        assert!(
            !causes(&results, Some(name)).contains(&reflection),
            "{name}"
        );
    }
}

/// Noise, a gradual change, the background, and what is not the true object have a mask, too.
#[test]
fn objects_without_edges_are_doubtful() {
    let place = Place::new();
    let noise = |x: f64, y: f64| {
        let mixed = ((x * 127.1 + y * 311.7).sin() * 43758.547).fract().abs();
        0.3 + 0.4 * mixed
    };
    picture(&place, "noise.png", noise);
    picture(&place, "ramp.png", |x, _| 0.5 + 0.004 * x);
    let bright = |x: f64, y: f64| 0.2 + 0.6 * ellipse([20.0, 14.0], [x, y]);
    picture(&place, "bright.png", bright);
    picture(&place, "dark.png", |x, y| 1.0 - bright(x, y));
    ordinary(&place, "truth.png");
    for (name, cause) in [
        ("noise", "off_edges"),
        ("ramp", "off_edges"),
        ("dark", "background"),
    ] {
        let run = place.run(&[
            "segment",
            &format!("{name}.png"),
            "--contrast",
            ".4",
            "-o",
            name,
        ]);
        assert_eq!(run.status.code(), Some(3), "{name}");
        let found = causes(&Results::read(&place.path(name)), Some(name));
        assert!(found.contains(&cause.to_owned()), "{name}: {found:?}");
    }
    let against = |name: &str, output: &str| {
        let image = format!("{name}.png");
        place.run(&["segment", &image, "--truth", "truth.png", "-o", output])
    };
    succeeded(&against("bright", "found"));
    assert_eq!(against("dark", "missed").status.code(), Some(3));
    let found = causes(&Results::read(&place.path("missed")), Some("dark"));
    assert!(found.contains(&"truth".to_owned()), "{found:?}");
}

/// A hole of three and a half spacings is squeezed to a sliver that the grid does not see.
#[test]
fn a_hole_that_the_average_has_not_is_named() {
    let place = Place::new();
    picture(&place, "disk.png", |x, y| ellipse([24.0; 2], [x, y]));
    picture(&place, "other.png", |x, y| ellipse([22.0, 25.0], [x, y]));
    picture(&place, "ring.png", |x, y| {
        ellipse([24.0; 2], [x, y]) - ellipse([7.0; 2], [x, y])
    });
    let arguments = [
        "average",
        "disk.png",
        "other.png",
        "ring.png",
        "--grid",
        "65",
    ];
    let (results, _) = doubtful(&place, &arguments);
    let topology = "topology".to_owned();
    assert!(causes(&results, Some("ring")).contains(&topology));
    for name in ["disk", "other"] {
        assert!(!causes(&results, Some(name)).contains(&topology), "{name}");
    }
}

/// A disk with a bright spot on its left side and one with a spot on its right side: the spots overlap where they are
/// pressed together, and nothing else says so.
#[test]
fn images_that_differ_more_when_deformed_are_doubtful() {
    let place = Place::new();
    for (name, at) in [("left.png", -7.0), ("right.png", 7.0)] {
        picture(&place, name, |x, y| {
            0.25 + 0.35 * ellipse([15.0, 15.0], [x, y]) + 0.25 * ellipse([4.0, 4.0], [x - at, y])
        });
    }
    let arguments = [
        "average",
        "--joint",
        "left.png",
        "right.png",
        "--grid",
        "65",
    ];
    let (found, _) = doubtful(&place, &arguments);
    assert!(
        causes(&found, None).contains(&"spread".to_owned()),
        "{}",
        found.json["doubts"]
    );
    assert!(found.number("/spread_after") > found.number("/spread_before"));
}

/// A ring beside an open one in space: neither has another part or a cavity.
#[test]
fn rings_and_open_rings_are_different() {
    let place = Place::new();
    let n = 40;
    let ring = |gap: f64| -> Vec<f64> {
        let at = |i: usize| i as f64 - 0.5 * (n - 1) as f64;
        let node = |i: usize| [at(i % n), at(i / n % n), at(i / (n * n))];
        let inside = |[x, y, z]: [f64; 3]| {
            let around = x.hypot(y) - 12.0;
            let open = x > 0.0 && y.abs() < gap;
            f64::from(u8::from(around.hypot(z) < 4.5 && !open))
        };
        (0..n * n * n).map(|i| inside(node(i))).collect()
    };
    place.write("ring.npy", &npy_f64(&[n; 3], &ring(0.0)));
    place.write("open.npy", &npy_f64(&[n; 3], &ring(2.5)));
    let arguments = [
        "average", "ring.npy", "open.npy", "--align", "none", "--grid", "33",
    ];
    let (found, _) = doubtful(&place, &arguments);
    let topology = "topology".to_owned();
    let named = ["ring", "open"].map(|name| causes(&found, Some(name)).contains(&topology));
    assert!(named.contains(&true), "{}", found.json["doubts"]);
}

/// A shape of scores so large that it leaves the box.
#[test]
fn synthesized_shapes_stay_in_the_box() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "33");
    let names: Vec<&str> = inputs.iter().map(String::as_str).collect();
    let average = [&["average"], &names[..], &["--grid", "33", "-o", "mean"]].concat();
    succeeded(&place.compute(&average));
    let modes = ["pca", "mean", "--variation", "displacement", "-o", "modes"];
    place.compute(&modes);
    let made = |scores: &str, out: &str| {
        place.compute(&["synthesize", "modes", "--scores", scores, "-o", out]);
        causes(&Results::read(&place.path(out)), None)
    };
    let outside = "outside_box".to_owned();
    let far = [made("15", "far"), made("-15", "farther")].concat();
    assert!(far.contains(&outside), "{far:?}");
    assert!(!made("1", "near").contains(&outside));
}

/// The parts of the energy that are printed are those of the record, also where a shape has no weight.
#[test]
fn elastic_energies_are_printed_as_they_are() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "33");
    let names: Vec<&str> = inputs.iter().map(String::as_str).collect();
    let options = ["--grid", "33", "--weights", "1,0", "-o", "out"];
    let run = place.compute(&[&["average"], &names[..], &options].concat());
    let found = Results::read(&place.path("out"));
    let elastic = format!("elastic {:.3e} ", found.numbers("/energy/parts")[0]);
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(text.contains(&elastic), "{elastic}: {text}");
}
