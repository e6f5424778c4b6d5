//! What users do naturally: folders and patterns as inputs, dark objects, and mistakes that get an
//! answer.

use std::f64::consts::TAU;
use std::process::Output;

use crate::common::{Place, Results, grey_png, npy_f64, succeeded};

/// The report of a run that is refused.
fn refused(run: &Output) -> String {
    assert_eq!(run.status.code(), Some(2));
    // Reports are wrapped to the width of the terminal.
    let report = String::from_utf8_lossy(&run.stderr);
    let words = report.split_whitespace().filter(|word| *word != "│");
    words.collect::<Vec<_>>().join(" ")
}

/// A disk of this radius in a picture of 33 pixels a side, bright or dark.
fn disk(radius: f64, bright: bool) -> Vec<u8> {
    let pixel = |i: usize| {
        let [x, y] = [i % 33, i / 33].map(|k| k as f64 - 16.0);
        u8::from((x.hypot(y) < radius) == bright) * 255
    };
    grey_png(33, 33, &(0..33 * 33).map(pixel).collect::<Vec<_>>())
}

const QUICK: [&str; 4] = ["--grid", "17", "--max-iterations", "1"];

fn averaged(place: &Place, inputs: &[&str], out: &str) -> (Results, String) {
    let command = [&["average"], inputs, &QUICK[..], &["-o", out]].concat();
    let run = place.compute(&command);
    succeeded(&run);
    let report = String::from_utf8(run.stderr).unwrap();
    (Results::read(&place.path(out)), report)
}

fn names(results: &Results) -> Vec<String> {
    let inputs = results.json["input"].as_array().unwrap();
    let name = |input: &serde_json::Value| {
        let path = input["path"].as_str().unwrap();
        path.rsplit('/').next().unwrap().to_owned()
    };
    inputs.iter().map(name).collect()
}

#[test]
fn folders_and_patterns_are_inputs() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("masks/deeper")).unwrap();
    for (name, radius) in [("d10", 10.0), ("d9", 9.0), ("D2", 8.0)] {
        place.write(&format!("masks/{name}.png"), &disk(radius, true));
    }
    place.write("masks/manifest.csv", b"file,class\nd9.png,a\n");
    place.write("masks/notes.txt", b"");
    place.write("masks/.hidden.png", b"");
    let (results, report) = averaged(&place, &["masks"], "one");
    assert_eq!(names(&results), ["D2.png", "d9.png", "d10.png"]);
    let skipped =
        "'masks': 3 files, without 'deeper', 'manifest.csv', 'notes.txt', which are no inputs";
    assert!(report.contains(skipped), "{report}");
    let (results, report) = averaged(&place, &["masks/d*.png"], "two");
    assert_eq!(names(&results), ["d9.png", "d10.png"]);
    assert!(!report.contains("no inputs"), "{report}");
    // A file whose name looks like a pattern is that file.
    place.write("d[1].png", &disk(7.0, true));
    let (results, _) = averaged(&place, &["d[1].png", "masks/d9.png"], "three");
    assert_eq!(names(&results), ["d[1].png", "d9.png"]);

    let report = refused(&place.run(&["average", "masks/deeper", "-o", "x"]));
    assert!(
        report.contains("nothing to read in 'masks/deeper': no files"),
        "{report}"
    );
    let report = refused(&place.run(&["average", "masks/*.tif", "-o", "x"]));
    assert!(
        report.contains("nothing to read in 'masks/*.tif'"),
        "{report}"
    );
    let report = refused(&place.run(&["average", "one", "-o", "x"]));
    assert!(
        report.contains("'one' is a result of the program"),
        "{report}"
    );
    // Surfaces and outlines are no images.
    place.write("masks/deeper/a.svg", b"<svg/>");
    let report = refused(&place.run(&["segment", "masks/deeper", "-o", "x"]));
    assert!(
        report.contains("'masks/deeper': 1 file of another kind"),
        "{report}"
    );
}

#[test]
fn a_folder_of_outlines_is_read() {
    let place = Place::new();
    std::fs::create_dir(place.path("curves")).unwrap();
    for side in [3, 4] {
        let square = format!("0,0\n{side},0\n{side},{side}\n0,{side}\n");
        place.write(&format!("curves/{side}.csv"), square.as_bytes());
    }
    let (results, _) = averaged(&place, &["curves"], "out");
    assert_eq!(names(&results), ["3.csv", "4.csv"]);
}

#[test]
fn dark_objects_are_inverted() {
    let place = Place::new();
    for (name, bright) in [("bright", true), ("dark", false)] {
        place.write(&format!("{name}8.png"), &disk(8.0, bright));
        place.write(&format!("{name}9.png"), &disk(9.0, bright));
    }
    let (results, _) = averaged(&place, &["bright8.png", "bright9.png"], "one");
    let area = results.number("/average/area");
    let (results, _) = averaged(&place, &["dark8.png", "dark9.png", "--invert"], "two");
    assert_eq!(results.number("/average/area"), area);
    let (results, _) = averaged(&place, &["dark8.png", "dark9.png"], "three");
    let doubts = results.json["doubts"].to_string();
    assert!(doubts.contains("use --invert"), "{doubts}");
    // A full mask names the remedy, too.
    place.write("full.npy", &npy_f64(&[4, 4], &[1.0; 16]));
    let report = refused(&place.run(&["average", "full.npy", "dark8.png", "-o", "x"]));
    assert!(report.contains("--invert reads dark objects"), "{report}");
    place.write("a.svg", b"<svg><rect width='2' height='3'/></svg>");
    let report = refused(&place.run(&["average", "a.svg", "a.svg", "--invert", "-o", "x"]));
    assert!(report.contains("no background"), "{report}");
}

#[test]
fn mistakes_get_an_answer() {
    let place = Place::new();
    place.write("a.png", &disk(8.0, true));
    place.write("b.png", &disk(9.0, true));
    averaged(&place, &["a.png", "b.png"], "mean");
    let wrong = |command: &[&str], words: &str| {
        let report = refused(&place.run(command));
        assert!(report.contains(words), "{command:?}: {report}");
    };
    let average = ["average", "a.png", "b.png", "-o", "x"];
    let with = |more: [&'static str; 2]| [&average[..], &more].concat();
    wrong(&with(["--memory", "4"]), "give a unit, such as 4GiB");
    for (option, value, allowed) in [
        ("--mu", "-1", "help: allowed: 1e-12 to 1e12"),
        ("--mu", "0", "help: allowed: 1e-12 to 1e12"),
        ("--lambda", "-2", "help: allowed: 0 to 1e12"),
    ] {
        let given = with([option, value]);
        wrong(&given, &format!("{option} "));
        wrong(&given, &format!("is not allowed {allowed}"));
    }
    let another = "it is one of `shapespace average`";
    wrong(&["extend", "mean", "-o", "x"], another);
    // Fields of another command are no defect of a file.
    let taken = format!("{another}, which `pca`, `warp` and `average --start` take help:");
    wrong(&["extend", "mean", "-o", "x"], &taken);
    let any = "name a directory that `shapespace average`, `geodesic`, `length`, `pca` or `synthesize` has written";
    wrong(&["warp", ".", "a.png", "-o", "x"], any);
    succeeded(&place.compute(&[
        "metric", "a.png", "--mode", "2", "--grid", "17", "-o", "metric",
    ]));
    wrong(&["warp", "metric", "a.png", "-o", "x"], any);
    wrong(&["score", "a.png", "--pca", "mean", "-o", "x"], another);
    wrong(&["synthesize", "mean", "--scores", "1", "-o", "x"], another);
    succeeded(&place.compute(&["pca", "mean", "-o", "modes"]));
    let solid: Vec<f64> = (0..125).map(|i| f64::from(u8::from(i == 62))).collect();
    place.write("solid.npy", &npy_f64(&[5, 5, 5], &solid));
    wrong(
        &["score", "solid.npy", "--pca", "modes", "-o", "x"],
        "its shapes are 2D and 'solid.npy' is 3D",
    );
    wrong(
        &["warp", "modes", "a.png", "--shape", "0", "-o", "x"],
        "a result of `shapespace pca`",
    );
    wrong(&["average", "nowhere", "-o", "x"], "cannot read 'nowhere'");
    // A disk in another unit of length.
    let point = |k: u32| {
        let [x, y] = [0.0, 0.25].map(|turn| ((f64::from(k) / 60.0 + turn) * TAU).sin());
        format!("{},{}\n", 9000.0 * x, 9000.0 * y)
    };
    let points: String = (0..60).map(point).collect();
    place.write("micrometres.csv", points.as_bytes());
    let scored = [
        "score",
        "a.png",
        "micrometres.csv",
        "--pca",
        "modes",
        "-o",
        "x",
    ];
    wrong(
        &scored,
        "'micrometres.csv', 1081 times as large as the average",
    );
    let sized = [
        "score",
        "micrometres.csv",
        "--pca",
        "modes",
        "--size",
        "equal",
    ];
    succeeded(&place.compute(&[&sized[..], &["-o", "sized"]].concat()));
    wrong(
        &["warp", "sized", "a.png", "--shape", "0", "-o", "x"],
        "`shapespace score`, which keeps no deformations; an average with these shapes, too, at a weight of 0",
    );
    // An average and its modes that were moved together find each other.
    std::fs::create_dir(place.path("moved")).unwrap();
    for name in ["mean", "modes"] {
        std::fs::rename(place.path(name), place.path(&format!("moved/{name}"))).unwrap();
    }
    succeeded(&place.compute(&["synthesize", "moved/modes", "--scores", "1", "-o", "made"]));
    std::fs::rename(place.path("moved/mean"), place.path("lost")).unwrap();
    wrong(
        &["synthesize", "moved/modes", "--scores", "1", "-o", "x"],
        "put it beside the modes",
    );
}

/// Files of formats that are not read say what to make of them, and what is left out or misspelled is named.
#[test]
fn other_files_and_words_get_an_answer() {
    let place = Place::new();
    for (name, radius) in [("flat_one", 7.0), ("round_two", 8.0), ("long_three", 9.0)] {
        place.write(&format!("{name}.png"), &disk(radius, true));
    }
    for (name, words) in [
        ("a.npz", "by numpy.save, as .npy"),
        ("a.dcm", "dcm2niix"),
        ("a.gif", "save the picture as .png"),
        ("a.nii.bz2", "unpack it"),
        ("a.docx", "use .png, .jpg"),
    ] {
        place.write(name, b"PK");
        for command in ["average", "geodesic", "segment"] {
            let report = refused(&place.run(&[command, name, "flat_one.png", "-o", "x"]));
            assert!(report.contains(&format!("'{name}'")), "{report}");
            assert!(report.contains(words), "{command} {name}: {report}");
        }
    }
    let pair = ["flat_one.png", "round_two.png"];
    for (command, words) in [
        (["average", "--align", "similarity"], "none, rigid"),
        (["averge", "--grid", "17"], "'average'"),
        (["average", "--labls", "--invert"], "'--labels'"),
        (
            ["score", "--align", "none"],
            "--pca help: give it on the command line",
        ),
    ] {
        let run = place.run(&[&command[..1], &pair, &command[1..], &["-o", "x"]].concat());
        let report = refused(&run);
        assert!(report.contains(words), "{command:?}: {report}");
    }
    // Classes of one shape each agree with nothing.
    let distances = [&["distances"], &pair[..], &["long_three.png"], &QUICK].concat();
    let run = place.compute(
        &[
            &distances[..],
            &["-K", "1", "--classes", "prefix", "-o", "all"],
        ]
        .concat(),
    );
    let text = succeeded(&run);
    assert!(text.contains("none has two shapes"), "{text}");
    assert!(!text.contains("purity"), "{text}");
}

/// Subjects keep their names in tables, plots and reports, whatever their letters.
#[test]
fn subjects_are_named() {
    let place = Place::new();
    let subjects = ["Größe Müller", "Łódź", "λ_Straße, 2"];
    let files = subjects.map(|name| format!("{name}.png"));
    for (file, radius) in files.iter().zip([8.0, 9.0, 10.0]) {
        place.write(file, &disk(radius, true));
    }
    let files = files.each_ref().map(String::as_str);
    averaged(&place, &files, "mean");
    succeeded(&place.compute(&["pca", "mean", "-o", "modes"]));
    let few = [&QUICK[..], &["-K", "1", "-o", "all"]].concat();
    succeeded(&place.compute(&[&["distances"], &files[..], &few].concat()));
    for table in ["mean/subjects.csv", "modes/scores.csv", "all/distances.csv"] {
        let text = std::fs::read_to_string(place.path(table)).unwrap();
        for name in subjects {
            let cell = if name.contains(',') {
                format!("\"{name}\"")
            } else {
                name.to_owned()
            };
            assert!(text.contains(&cell), "{table}: {text}");
        }
    }
    for page in ["mean", "modes", "all"] {
        let page = std::fs::read_to_string(place.path(&format!("{page}/report.html"))).unwrap();
        assert!(subjects.iter().all(|name| page.contains(name)));
    }
}
