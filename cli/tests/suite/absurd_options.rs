//! A table of absurd option values: each is refused with exit code 2, one report and no result.

use crate::common::{Place, drawn, grey_png};

/// The values that no number takes.
const NO_NUMBERS: [&str; 4] = ["nan", "x", "", "1e400"];

/// A command, an option, its values, and a part of the report beside the name of the option.
type Row<'a> = (&'a str, &'a str, &'a [&'a str], &'a str);

const AVERAGE: &str = "average BARS --grid 9 -o out";
const SEGMENT: &str = "segment grey.png --grid 9 -o out";
const DISK: &str = "generate disk -o out.npy";
const POSITIVE: &[&str] = &["-1", "0", "1e300", "inf"];
const COUNT: &[&str] = &["-1", "0", "1.5", "99999999999999999999"];

const ROWS: &[Row<'static>] = &[
    (AVERAGE, "mismatch-weight", POSITIVE, "positive"),
    (AVERAGE, "length-weight", POSITIVE, "positive"),
    (AVERAGE, "void-stiffness", POSITIVE, ""),
    (AVERAGE, "void-stiffness", &["1.1"], "at most 1"),
    (AVERAGE, "interface-cells", POSITIVE, ""),
    (AVERAGE, "interface-cells", &["1001"], "at most 1000"),
    (AVERAGE, "tolerance", POSITIVE, ""),
    (AVERAGE, "tolerance", &["0.6", "1"], "at most 0.5"),
    (
        AVERAGE,
        "min-determinant",
        &["-1", "0", "0.95", "1e300"],
        "",
    ),
    (AVERAGE, "filter-width", POSITIVE, "positive"),
    (
        "average BARS --grid 9 --mean median -o out",
        "median-reference",
        POSITIVE,
        "positive",
    ),
    (AVERAGE, "median-reference", &["0.1"], "--mean median"),
    (AVERAGE, "lambda", &["-1", "1e300", "inf"], "0 to 1e12"),
    (AVERAGE, "mu", POSITIVE, "1e-12 to 1e12"),
    (AVERAGE, "max-iterations", COUNT, ""),
    (AVERAGE, "threads", COUNT, ""),
    (AVERAGE, "threads", &["4097"], "1..=4096"),
    (AVERAGE, "sweep", COUNT, ""),
    (AVERAGE, "sweep", &["1", "66"], "2 to 65"),
    (AVERAGE, "label", &["1.5", "99999999999999999999"], ""),
    (
        AVERAGE,
        "max-iterations",
        &["9223372036854775808"],
        "a number above",
    ),
    (AVERAGE, "mismatch-weight", &["1e-300"], "from 1e-18"),
    (
        AVERAGE,
        "weights",
        &["1,1", "1e308,1e308", "1", "0,0"],
        "weights",
    ),
    (AVERAGE, "weights", &["-1,2", "1,nan", ",", "1,0,0"], ""),
    (AVERAGE, "memory", &["0", "-1", "1e40", "4 gigs"], "byte"),
    (AVERAGE, "memory", &["1B"], "of memory"),
    (AVERAGE, "checkpoint", &["-1", "inf"], ""),
    (AVERAGE, "smooth", &["1"], "--joint"),
    (AVERAGE, "align", &["both"], "rigid"),
    (AVERAGE, "law", &["none"], "logdet"),
    (AVERAGE, "config", &["nowhere.toml"], "nowhere.toml"),
    ("average BARS -o out", "grid", COUNT, ""),
    (
        "average BARS -o out",
        "grid",
        &["8", "40", "8193"],
        "2^L + 1",
    ),
    (SEGMENT, "smooth", POSITIVE, "positive"),
    (SEGMENT, "contrast", POSITIVE, "positive"),
    (
        SEGMENT,
        "threshold",
        &["1e300", "-1e300", "256", "-1"],
        "grey values",
    ),
    (SEGMENT, "threshold", &["inf"], "a number"),
    (SEGMENT, "classes", &["0", "1", "9"], "2 to 8"),
    (
        "segment grey.png --object enclosed -o out",
        "classes",
        &["3"],
        "bright or dark",
    ),
    (SEGMENT, "tolerance", POSITIVE, ""),
    (SEGMENT, "edge-conductance", POSITIVE, ""),
    (SEGMENT, "interface-cells", POSITIVE, ""),
    (SEGMENT, "max-iterations", COUNT, ""),
    (DISK, "radius", &["-1", "0", "inf"], ""),
    (DISK, "rotate", &["inf"], "finite"),
    (DISK, "shift", &["0", "1,2,3", "inf,0"], ""),
    (DISK, "contrast", &["-1", "2"], "from 0 to 1"),
    (DISK, "noise", &["-1", "2", "inf"], ""),
    (DISK, "grid", &["1", "-1", "99999"], ""),
    (DISK, "dimension", &["1", "4"], "2..=3"),
    (DISK, "noise-seed", &["-1", "1.5"], ""),
    (
        "generate bar -o out.npy",
        "angle",
        &["0", "400"],
        "20 to 340",
    ),
    ("generate star -o out.npy", "pins", &["0", "65"], "1..=64"),
    (
        "generate blob -o out.npy",
        "roughness",
        &["-1", "2"],
        "from 0 to .9",
    ),
    ("pca nowhere -o out", "amplitude", POSITIVE, "at most 1000"),
    ("pca nowhere -o out", "tolerance", POSITIVE, ""),
    ("pca nowhere -o out", "modes", COUNT, ""),
    (
        "synthesize nowhere -o out",
        "scores",
        &["1e300", "-1001", ","],
        "scores",
    ),
    (
        "synthesize nowhere --scores 1 -o out",
        "load-steps",
        &["0", "1001"],
        "1 to 1000",
    ),
    (
        "figure weights -o out",
        "grid",
        &["0", "8", "99999999999"],
        "2^L + 1",
    ),
    ("figure force-balance -o out", "grid", &["9"], "three grids"),
];

/// Values that no option of a number accepts.
const NUMBERS: &[(&str, &str)] = &[
    (AVERAGE, "mismatch-weight"),
    (AVERAGE, "tolerance"),
    (AVERAGE, "mu"),
    (AVERAGE, "max-iterations"),
    (AVERAGE, "memory"),
    (AVERAGE, "checkpoint"),
    (SEGMENT, "threshold"),
    (SEGMENT, "classes"),
    (DISK, "radius"),
    (DISK, "noise"),
    ("synthesize nowhere -o out", "scores"),
    ("pca nowhere -o out", "amplitude"),
];

/// Whole commands.
const COMMANDS: &[(&str, &str)] = &[
    ("nothing", "unrecognized subcommand"),
    ("average -o out", "at least 2 inputs"),
    ("average BARS", "--output"),
    ("average BARS --grid 9 --start nowhere -o out", "nowhere"),
    (
        "generate disk --radius 1e300 -o out.npy",
        "covers the whole box",
    ),
    ("average BARS -o bars", "exists already"),
    ("average BARS -o ..", "exists already"),
    ("average BARS -o /", "exists already"),
    ("average BARS -o nowhere/out", "does not exist"),
    ("average BARS -o out --mean middle", "median"),
    (
        "generate disk --shift 100,100 -o out.npy",
        "the shape is empty",
    ),
    (
        "generate disk --radius 9 -o out.npy",
        "covers the whole box",
    ),
    (
        "generate disk --grid 2 --radius .1 -o out.npy",
        "the shape is empty",
    ),
    ("generate disk -o out.xyz", "in this format"),
    ("generate disk --dimension 3 -o out.png", "in this format"),
    ("generate letter z -o out.npy", "invalid value"),
    ("figure weights BARS BARS -o out", "2 to 3 shapes"),
    ("figure nothing -o out", "invalid value"),
    ("verify nothing -o out", "similar names"),
    ("config nothing", "invalid value"),
    ("pca nowhere -o out", "nowhere"),
    ("synthesize nowhere -o out", "scores"),
    // Options that would do nothing.
    (
        "geodesic BARS --form level-sets --domain end -o out",
        "no domain",
    ),
    (
        "geodesic BARS --form level-sets --deformed-share 1 -o out",
        "--deformed-share",
    ),
    (
        "distances BARS --form level-sets --domain end -o out",
        "no domain",
    ),
    (
        "pca nowhere --variation displacement --at-rest -o out",
        "nothing is elastic",
    ),
];

#[test]
fn every_absurd_value_is_refused() {
    let place = Place::new();
    let bars = drawn(&place, "bars", "2", "9").join(" ");
    let grey: Vec<u8> = (0..81u8).map(|k| 3 * k).collect();
    place.write("grey.png", &grey_png(9, 9, &grey));
    let before = place.listing();
    let mut rows: Vec<(String, String, String)> = Vec::new();
    for (command, option, values, words) in ROWS {
        let row = |v: &&str| (format!("--{option}={v}"), (*words).to_owned());
        rows.extend(
            values
                .iter()
                .map(row)
                .map(|(o, w)| ((*command).to_owned(), o, w)),
        );
    }
    for (command, option) in NUMBERS {
        let row = |v: &str| {
            (
                (*command).to_owned(),
                format!("--{option}={v}"),
                (*option).to_owned(),
            )
        };
        rows.extend(NO_NUMBERS.map(row));
    }
    let row = |(c, w): &(&str, &str)| ((*c).to_owned(), String::new(), (*w).to_owned());
    rows.extend(COMMANDS.iter().map(row));
    assert!(rows.len() >= 200, "{} rows", rows.len());
    let mut wrong = Vec::new();
    for (command, option, words) in &rows {
        let command = command.replace("BARS", &bars);
        let mut arguments: Vec<&str> = command.split_whitespace().collect();
        arguments.extend((!option.is_empty()).then_some(option.as_str()));
        let run = place.run(&arguments);
        let report = String::from_utf8_lossy(&run.stderr);
        let code = run.status.code();
        let named = option
            .trim_start_matches("--")
            .split('=')
            .next()
            .unwrap_or_default();
        let names_it = report.contains(named) || words == "2^L + 1";
        let is_short = report.len() < 1500;
        if code != Some(2) || !report.contains(words.as_str()) || !names_it || !is_short {
            wrong.push(format!(
                "{arguments:?}: {code:?}, no '{words}' in: {report}"
            ));
        }
        assert_eq!(place.listing(), before, "{arguments:?}");
    }
    assert!(wrong.is_empty(), "of {}:\n{}", rows.len(), wrong.join("\n"));
}
