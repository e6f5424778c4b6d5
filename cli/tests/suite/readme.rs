//! The commands of the README do what it says.
//!
//! Every line of its `sh` blocks is run, in order and in one folder, as a reader would. Its Rust
//! blocks run as documentation tests of the library.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{Place, document, picture_size};
use crate::verify::assert_every_statement_holds;

fn readme() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    std::fs::read_to_string(path).unwrap()
}

/// Commands that write a directory, and the headings over the tables of their files.
/// Of several beginnings of a command the first counts; those without a table have no heading.
const TABLES: [(&str, &str); 16] = [
    ("shapespace average --joint", "### Several images together"),
    ("shapespace average --sweep", ""),
    // Files of labels are listed in docs/formats.md.
    ("shapespace average parts/*.npy --labels", ""),
    ("shapespace pca average_bar", ""),
    ("shapespace segment", "## Shapes in images"),
    ("shapespace average", "## What it writes"),
    ("shapespace pca", "## Modes of variation"),
    ("shapespace geodesic", "## Geodesics"),
    ("shapespace length", "### The length of a given path"),
    ("shapespace metric", "### The metric at a shape"),
    ("shapespace compare", "### Groups"),
    (
        "shapespace distances blob_x",
        "### New shapes and stored ones",
    ),
    (
        "shapespace distances blobs stars",
        "### Neighbours and maps without all distances",
    ),
    ("shapespace distances", "## Distances, clusters and maps"),
    ("shapespace verify --quick", ""),
    (
        "shapespace verify misprint",
        "## Theory, tried by experiments",
    ),
];

/// Commands whose results have a verdict.
const COMPUTING: [&str; 13] = [
    "average",
    "compare",
    "distances",
    "extend",
    "figure",
    "geodesic",
    "length",
    "metric",
    "pca",
    "score",
    "segment",
    "synthesize",
    "transport",
];

/// The lines of all blocks of commands.
fn commands(text: &str) -> Vec<String> {
    let blocks = document::blocks(text);
    let shell = blocks.iter().filter(|block| block.info == "sh");
    let lines = shell.flat_map(document::commands);
    lines.map(str::to_owned).collect()
}

fn run(place: &Place, command: &str) -> Output {
    let arguments = document::words(place, command);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // On the coarse grids of the examples some results are doubtful, as the README says.
    let output = if COMPUTING.contains(&arguments[0]) {
        place.compute(&arguments)
    } else {
        place.run(&arguments)
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "`{command}` fails:\n{errors}");
    output
}

/// The directory after `-o` of a command.
fn output_directory(place: &Place, command: &str) -> PathBuf {
    let (_, rest) = command.split_once("-o ").unwrap();
    place.path(rest.split_whitespace().next().unwrap())
}

/// Files in the table of outputs of a section, for flat shapes.
fn promised_files(text: &str, heading: &str) -> Vec<String> {
    let (_, section) = text.split_once(heading).unwrap();
    let (section, _) = section.split_once("\n##").unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    rows.filter(|row| !row.contains("3D only"))
        .flat_map(|row| row.split('|').nth(1).unwrap().split('`').skip(1).step_by(2))
        .map(str::to_owned)
        .collect()
}

/// The last line that the program printed names a picture, and it is there.
fn assert_names_a_picture(place: &Place, output: &Output) {
    let printed = [output.stderr.as_slice(), output.stdout.as_slice()].concat();
    let printed = String::from_utf8(printed).unwrap();
    let last = printed.lines().rfind(|line| !line.trim().is_empty());
    let mut words = last.expect("something is printed").split_whitespace();
    let picture = words.find(|word| Path::new(word).extension().is_some_and(|e| e == "png"));
    let picture = place.path(picture.expect("the last line names a picture"));
    let [width, height] = picture_size(&picture);
    assert!(width > 100 && height > 100, "{width} x {height}");
}

#[test]
fn every_command_of_the_readme_works() {
    let text = readme();
    let place = Place::new();
    let commands = commands(&text);
    assert!(commands.iter().any(|c| c.contains("demo")));
    let mut verified = false;
    for command in &commands {
        if command.starts_with("cargo test") {
            eprintln!("not run here: `{command}`, which runs this test");
            continue;
        }
        let output = run(&place, command);
        if command.ends_with(" demo") {
            assert_names_a_picture(&place, &output);
        }
        if command == "shapespace verify --quick -o verified" {
            assert_every_statement_holds(&place, &output, "verified");
            verified = true;
        }
        let table = TABLES.iter().find(|(start, _)| command.starts_with(start));
        if let Some((_, heading)) = table.filter(|(_, heading)| !heading.is_empty()) {
            let directory = output_directory(&place, command);
            for name in promised_files(&text, heading) {
                assert!(
                    directory.join(&name).is_file(),
                    "`{command}` writes no {name}"
                );
            }
        }
    }
    assert!(verified, "the README runs `verify` on all statements");
}

#[test]
fn blocks_and_tables_are_found() {
    let text = readme();
    assert!(commands(&text).contains(&"cargo test --workspace".to_owned()));
    let promised = promised_files(&text, "## What it writes");
    assert!(promised.contains(&"result.json".to_owned()));
    assert!(promised.contains(&"energy.csv".to_owned()));
    assert!(!promised.contains(&"average.stl".to_owned()));
    let promised = promised_files(&text, "## Geodesics");
    assert!(promised.contains(&"geodesic.png".to_owned()));
    for (start, _) in TABLES {
        assert!(
            commands(&text).iter().any(|c| c.starts_with(start)),
            "{start}"
        );
    }
}
