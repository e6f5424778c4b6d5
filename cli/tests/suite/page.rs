//! The report of a result as a page.

use crate::common::ball::Mesh;
use crate::common::{Place, drawn, succeeded};
use serde_json::Value;
use std::path::Path;

fn report(place: &Place) -> String {
    std::fs::read_to_string(place.path("out/report.html")).unwrap()
}

/// The contents of an element of the page, the first that begins like this.
fn within<'a>(page: &'a str, start: &str, end: &str) -> &'a str {
    let (_, rest) = page
        .split_once(start)
        .unwrap_or_else(|| panic!("no {start}"));
    rest.split_once(end).unwrap().0
}

#[test]
fn a_report_shows_what_its_directory_has() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "17");
    let evil = "<img src=x onerror=alert(1)>.npy";
    let named = if cfg!(unix) { evil } else { "it's & so.npy" };
    std::fs::copy(place.path(&inputs[0]), place.path(named)).unwrap();
    let arguments = ["average", named, &inputs[1], "--grid", "17", "-o", "out"];
    let printed = succeeded(&place.compute(&arguments));
    let page = report(&place);
    assert!(!page.contains("<img src=x"));
    for (at, _) in page.match_indices("src=\"") {
        assert!(
            page[at..].starts_with("src=\"data:image/png;base64,")
                || page[at..].starts_with("src=\"data:image/svg+xml;base64,")
        );
    }
    assert!(!page.contains("http://") && !page.contains("https://"));
    // The verdict as printed.
    let doubtful = printed.contains("doubtful");
    let verdict = within(&page, "<section class=\"verdict ", "</section>");
    assert_eq!(verdict.starts_with("fair"), doubtful, "{verdict}");
    assert_eq!(verdict.contains("Remedy: "), doubtful);
    // The figures of the record.
    let json: Value =
        serde_json::from_slice(&std::fs::read(place.path("out/result.json")).unwrap()).unwrap();
    let energy = json["energy"]["total"].as_f64().unwrap();
    let shown = within(&page, "<dt>energy</dt><dd>", "</dd>");
    assert!((shown.parse::<f64>().unwrap() / energy - 1.0).abs() < 1e-3);
    assert!(within(&page, "<pre>shapespace average", "</pre>").ends_with("--allow-doubtful"));
    assert!(page.contains("grid = 17"));
    // The pictures of the directory, the plots, the tables, the files.
    assert_eq!(page.matches("data:image/png;").count(), 2);
    assert_eq!(page.matches("data:image/svg+xml;").count(), 2);
    assert!(page.contains("energy.csv") && page.contains("href=\"deformation_001.npy\""));
    // It is no array, and checksums are of arrays.
    let check = place.run(&["check", "out"]).status.code();
    assert_eq!(check, Some(if doubtful { 3 } else { 0 }));
}

#[test]
fn surfaces_are_in_the_report_with_16_bits() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "3", "17");
    let arguments = [
        "average", &inputs[0], &inputs[1], "--grid", "9", "-o", "out",
    ];
    succeeded(&place.compute(&arguments));
    let page = report(&place);
    let scene = scene(&page);
    let [frame] = &scene["frames"].as_array().unwrap()[..] else {
        panic!("one surface is expected");
    };
    assert_eq!(frame["name"], "average.stl");
    let header = std::fs::read(place.path("out/average.ply")).unwrap();
    let header = String::from_utf8_lossy(&header[..300]).into_owned();
    let count = |word: &str| -> usize {
        let number = within(&header, word, "\n");
        number.parse().unwrap()
    };
    let letters = |key: &str| frame[key].as_str().unwrap().trim_end_matches('=').len() * 3 / 4;
    assert_eq!(letters("points"), 6 * count("element vertex "));
    assert_eq!(letters("corners"), 6 * count("element face "));
}

/// The scene of a page.
fn scene(page: &str) -> Value {
    let start = "<script type=\"application/json\" id=\"scene-0\">";
    serde_json::from_str(within(page, start, "</script>")).unwrap()
}

/// A page stays below 8 MB, however large the surfaces of its result are: they are shown with fewer triangles, the
/// coordinates in 16 bits.
#[test]
fn pages_of_large_surfaces_are_small() {
    const MOST: usize = 8_000_000;
    let place = Place::new();
    let inputs = drawn(&place, "disks", "3", "17");
    let average = ["average", &inputs[0], &inputs[1], "--grid", "9"];
    succeeded(&place.compute(&[&average[..], &["-o", "mean"]].concat()));
    let ball = Mesh::ball([8.0; 3], 5.0, 600);
    place.write("ball.stl", &ball.stl(""));
    succeeded(&place.compute(&["warp", "mean", "ball.stl", "--shape", "0", "-o", "out"]));
    // Its coordinates and corners in 32 bits are more than a page may have.
    let whole = 12 * (ball.points.len() + ball.triangles.len());
    assert!(whole / 3 * 4 > MOST, "{whole}");
    let page = report(&place);
    let scene = scene(&page);
    let frame = &scene["frames"][0];
    let bytes = |key: &str| frame[key].as_str().unwrap().len() / 4 * 3;
    let [points, corners] = ["points", "corners"].map(bytes);
    assert!(page.len() < MOST, "{}", page.len());
    // What is left is a surface: twice as many triangles as points.
    let triangles = corners / if frame["wide"] == true { 12 } else { 6 };
    let points = points / 6;
    assert!((2_000..ball.points.len()).contains(&points), "{points}");
    assert!((triangles as f64 / points as f64 - 2.0).abs() < 0.1);
}

/// What was carried is shown before and after, with the options and the way to repeat it.
#[test]
fn the_report_of_a_warp_shows_what_was_carried() {
    let place = Place::new();
    let inputs = drawn(&place, "disks", "2", "17");
    let arguments = [
        "average", &inputs[0], &inputs[1], "--grid", "17", "-o", "mean",
    ];
    place.compute(&arguments);
    place.write("corners.csv", b"x,y\n8,8\n9,7\n");
    place.write("square.svg", b"<svg><path d='M6 6h4v4h-4z'/></svg>");
    let files = [&inputs[0], "corners.csv", "square.svg"];
    let options = ["--shape", "0", "-o", "out"];
    let run = place.compute(&[&["warp", "mean"], &files[..], &options].concat());
    let printed = succeeded(&run);
    assert!(
        printed.contains("report       out/report.html"),
        "{printed}"
    );
    let told = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(told.contains("memory: about"), "{told}");
    let page = report(&place);
    assert_eq!(page.matches("data:image/png;").count(), 1);
    assert_eq!(page.matches("data:image/svg+xml;").count(), 1);
    for word in [
        "before_and_after.png",
        "corners.csv",
        "To repeat it",
        "--shape 0",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert_eq!(within(&page, "<dt>files</dt><dd>", "</dd>"), "3");
    let json: Value =
        serde_json::from_slice(&std::fs::read(place.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(json["command"], "warp");
    assert_eq!(json["parameters"]["shape"], 0);
    assert_eq!(json["carried"][1]["what"], "points");
    assert_eq!(json["carried"][1]["count"], 2);
    // A file of the name of the picture would be lost.
    place.write(
        "before_and_after.svg",
        b"<svg><path d='M6 6h4v4h-4z'/></svg>",
    );
    let again = [
        "warp",
        "mean",
        "before_and_after.svg",
        "--shape",
        "0",
        "-o",
        "again",
    ];
    succeeded(&place.compute(&again));
}

/// A browser of the Chromium family: `SHAPESPACE_BROWSER`, or one of the path.
fn browser() -> Option<String> {
    let named = std::env::var("SHAPESPACE_BROWSER").ok().into_iter();
    let usual = ["chromium", "chromium-browser", "google-chrome"].map(String::from);
    named.chain(usual).find(|name| {
        let version = std::process::Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    })
}

/// Surfaces that turn, and the map of distances, are made by scripts: each paints something, and none writes to the
/// console.
#[test]
fn reports_work_in_a_browser() {
    let Some(browser) = browser() else {
        println!("skipped: no Chromium, and no SHAPESPACE_BROWSER");
        return;
    };
    let place = Place::new();
    let files = [
        drawn(&place, "blobs", "3", "17"),
        drawn(&place, "letters", "2", "17"),
    ];
    let [solids, flat] = files.each_ref().map(|all| all.join(" "));
    let names = files[0].iter();
    let names = names.map(|file| Path::new(file).file_stem().unwrap());
    let rows = names
        .zip(["x", "y"].iter().cycle())
        .map(|(name, group)| format!("{},{group}\n", name.display()));
    let groups = rows.fold("shape,group\n".to_owned(), |all, row| all + &row);
    place.write("groups.csv", groups.as_bytes());
    let pair = files[0][..2].join(" ");
    for (command, output) in [
        (format!("average {solids} --grid 17"), "average"),
        (format!("geodesic {pair} --grid 17"), "path"),
        (format!("distances {flat} --grid 17"), "map"),
        ("pca average".into(), "modes"),
        (
            "compare modes --groups groups.csv --permutations 99".into(),
            "groups",
        ),
    ] {
        let words: Vec<&str> = command.split_whitespace().collect();
        succeeded(&place.compute(&[&words[..], &["-o", output]].concat()));
        let page = place.path(&format!("{output}/report.html"));
        let folder = format!("--user-data-dir={}", place.path("browser").display());
        let seen = std::process::Command::new(&browser)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu"])
            .args(["--enable-unsafe-swiftshader", "--enable-logging=stderr"])
            .args(["--virtual-time-budget=3000", "--dump-dom", &folder])
            .arg(format!("file://{}", page.canonicalize().unwrap().display()))
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&seen.stderr);
        let said = log.lines().filter(|line| line.contains("CONSOLE"));
        // What the driver says of its speed is none of the page.
        let said: Vec<_> = said.filter(|line| !line.contains("GL Driver")).collect();
        assert!(said.is_empty(), "{output}: {said:?}");
        // Scripts set the size of what they paint on.
        let dom = String::from_utf8_lossy(&seen.stdout);
        let tags = dom.split("<canvas").skip(1);
        let tags: Vec<_> = tags.filter_map(|rest| rest.split_once('>')).collect();
        let painted = tags.iter().filter(|(tag, _)| tag.contains(" width="));
        assert!(
            !tags.is_empty() && painted.count() == tags.len(),
            "{output}: {tags:?}"
        );
    }
}
