//! Configurations: printed, read, overridden, refused, and repeated from the directory of a result.

use ::geodesic::GeodesicParams;
use ::geodesic::calculus::CalculusParams;
use hyperelastic::{LameModuli, LawName, LawSpec, PowerCoefficients, PowerExponents, PowerOptions};
use phasefield::segmentation::{SegmentationParams, Weights};
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shape_average::joint::JointParams;
use shape_average::{AverageParams, BoundaryCondition, Mean, Precision, Solver};
use shape_pca::{Metric, PcaParams};

use crate::common::{Place, Results, draw, drawn, succeeded};

const COMMANDS: [&str; 12] = [
    "average",
    "geodesic",
    "length",
    "metric",
    "distances",
    "pca",
    "synthesize",
    "compare",
    "score",
    "extend",
    "transport",
    "segment",
];

/// The value that comes back from TOML and from JSON.
fn unchanged<T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug>(value: &T) {
    let text = toml::to_string(value).unwrap();
    assert_eq!(&toml::from_str::<T>(&text).unwrap(), value, "{text}");
    let text = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
}

fn positive() -> impl Strategy<Value = f64> {
    (1e-300..1e300f64).prop_union(1e-9..10.0f64)
}

fn law() -> impl Strategy<Value = LawSpec> {
    let names: Vec<LawName> = LawName::all().collect();
    let law = prop::sample::select(names);
    let options = (any::<bool>(), positive()).prop_map(|(some, x)| PowerOptions {
        exponents: some.then_some(PowerExponents::from([x, 2.0, 0.1, 9.0])),
        norm_share: some.then_some(x),
        coefficients: some.then_some(PowerCoefficients::from([0.1, x, 0.3])),
    });
    (law, positive(), positive(), options).prop_map(|(law, lambda, mu, power)| LawSpec {
        power,
        ..law.with(LameModuli { lambda, mu })
    })
}

proptest! {
    #[test]
    fn parameters_are_what_was_written(
        law in law(),
        x in positive(),
        y in positive(),
        n in 1usize..10_000,
        some in any::<bool>(),
    ) {
        let average = AverageParams {
            law,
            mismatch_weight: x,
            length_weight: some.then_some(y),
            weights: some.then(|| vec![x, y, 0.1]),
            mean: if some { Mean::Median } else { Mean::Arithmetic },
            median_reference: some.then_some(x),
            solver: if some { Solver::Descent } else { Solver::Lbfgs },
            boundary: BoundaryCondition::Identity,
            max_iterations: n,
            precision: some.then_some(Precision::Mixed),
            ..AverageParams::default()
        };
        unchanged(&average);
        let segmentation = SegmentationParams {
            weights: Weights { fidelity: x, smoothness: y, edges: 1.0 },
            max_iterations: n,
            ..SegmentationParams::default()
        };
        unchanged(&segmentation);
        unchanged(&JointParams { average, segmentation, tolerance: y, ..JointParams::default() });
        let geodesic = GeodesicParams {
            law,
            steps: n,
            mismatch_weight: x,
            area_weight: y,
            ..GeodesicParams::default()
        };
        unchanged(&geodesic);
        unchanged(&CalculusParams { tolerance: y, ..CalculusParams::from(&geodesic) });
        unchanged(&PcaParams {
            law,
            void_stiffness: x,
            metric: if some { Metric::Hessian } else { Metric::L2 },
            at_rest: some,
            tolerance: y,
            ..PcaParams::default()
        });
    }
}

#[test]
fn defaults_are_printed_with_comments_and_can_be_read() {
    let place = Place::new();
    for command in COMMANDS {
        let text = succeeded(&place.run(&["config", command]));
        let keys: toml::Table = text.parse().unwrap();
        assert!(!keys.is_empty());
        let lines: Vec<&str> = text.lines().collect();
        for key in keys.keys() {
            let line = lines
                .iter()
                .position(|l| l.starts_with(&format!("{key} = ")));
            assert!(
                lines[line.unwrap() - 1].starts_with("# "),
                "{command} {key}"
            );
        }
        place.write("usual.toml", text.as_bytes());
        // Nothing is wrong with it but that it names no inputs.
        let run = place.run(&[command, "--config", "usual.toml", "-o", "out"]);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{command}: {report}");
        assert!(report.contains("needs"), "{command}: {report}");
        assert!(!report.contains("usual.toml"), "{command}: {report}");
    }
    // A figure has built-in inputs.
    place.write("usual.toml", &place.run(&["config", "figure"]).stdout);
    let figure = [
        "figure",
        "stiffness",
        "--config",
        "usual.toml",
        "--grid",
        "17",
    ];
    succeeded(&place.compute(&[&figure[..], &["-o", "out"]].concat()));
}

/// Runs `geodesic` with a configuration file and options; the report must hold all the words.
fn refused(place: &Place, text: &str, options: &[&str], words: &[&str]) {
    place.write("wrong.toml", text.as_bytes());
    let fixed = [
        "geodesic",
        "a.npy",
        "b.npy",
        "-o",
        "out",
        "--config",
        "wrong.toml",
    ];
    let run = place.run(&[&fixed, options].concat());
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{text}: {report}");
    for word in words {
        assert!(report.contains(word), "no '{word}' in: {report}");
    }
}

#[test]
fn wrong_keys_and_values_are_named_with_their_lines() {
    let place = Place::new();
    let refuse = |text, words: &[&str]| refused(&place, text, &[], words);
    refuse(
        "grid = 33\n\nmismatch_wieght = 3\n",
        &[
            "wrong.toml",
            "line 3",
            "`mismatch_wieght`",
            "`mismatch_weight`",
        ],
    );
    refuse("mismatch-weight = 3", &["line 1", "`mismatch_weight`"]);
    refuse(
        "colour = 3",
        &["line 1", "`colour`", "shapespace config geodesic"],
    );
    refuse(
        "# How\nform = \"eulerian\"",
        &["line 2", "`form`", "eulerian", "lagrangian", "level_sets"],
    );
    refuse("steps = \"many\"", &["line 1", "`steps`", "many"]);
    refuse("steps = -1", &["line 1", "`steps`", "-1"]);
    refuse(
        "mu = 2.0\ntolerance = 0.0",
        &["line 2", "tolerance", "positive"],
    );
    refuse("law = \"rubber\"", &["line 1", "rubber", "logdet"]);
    refuse("steps = 3\nsteps = 4", &["line 2", "wrong.toml"]);
    refuse("steps = ", &["line 1", "wrong.toml"]);
    refuse("\nlabels = true\nlabel = 3", &["line 2", "--label"]);
    // What an option says is not the file's fault.
    refused(&place, "steps = 8", &["-K", "0"], &["--steps 0"]);
    let run = place.run(&["geodesic", "--config", "nothing.toml", "-o", "out"]);
    let report = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        report.contains("nothing.toml") && run.status.code() == Some(2),
        "{report}"
    );
}

#[test]
fn options_count_more_than_the_file_and_the_file_more_than_defaults() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "17");
    let file = format!(
        "inputs = [{:?}, {:?}]\ngrid = 17\nmax_iterations = 7\nsolver = \"descent\"\n",
        disks[0], disks[1]
    );
    place.write("mine.toml", file.as_bytes());
    let fixed = ["average", "--config", "mine.toml", "--solver", "lbfgs"];
    succeeded(&place.compute(&[&fixed[..], &["--mu", "2", "-o", "out"]].concat()));
    let results = Results::read(&place.path("out"));
    let parameter = |key: &str| results.json["parameters"][key].clone();
    assert_eq!(parameter("grid"), 17);
    assert_eq!(parameter("max_iterations"), 7);
    assert_eq!(parameter("solver"), "lbfgs");
    assert_eq!(parameter("mu"), 2.0);
    assert_eq!(parameter("lambda"), 1.0);
    // A file that says so can be told not to.
    place.write("flag.toml", b"labels = true");
    let fixed = [
        "geodesic",
        "--config",
        "flag.toml",
        "--labels=false",
        "--grid",
        "17",
    ];
    let inputs = [
        disks[0].as_str(),
        disks[1].as_str(),
        "-K",
        "1",
        "-o",
        "path",
    ];
    succeeded(&place.compute(&[&fixed[..], &inputs].concat()));
    let results = Results::read(&place.path("path"));
    assert_eq!(results.json["parameters"]["labels"], false);
}

/// All arrays of a directory.
fn arrays(place: &Place, folder: &str) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<(String, Vec<u8>)> = std::fs::read_dir(place.path(folder))
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().extension().is_some_and(|kind| kind == "npy"))
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, std::fs::read(entry.path()).unwrap())
        })
        .collect();
    found.sort();
    assert!(!found.is_empty());
    found
}

/// Runs a command twice: as it is given, and as its result says, from another folder.
fn repeated(place: &Place, arguments: &[&str], output: &str) {
    succeeded(&place.compute(&[arguments, &["-o", output]].concat()));
    let again = format!("{output}_again");
    let config = place.path(output).join("config.toml");
    std::fs::create_dir_all(place.path("elsewhere")).unwrap();
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_shapespace"))
        .args([arguments[0], "--config"])
        .arg(config)
        .arg("-o")
        .arg(place.path(&again))
        .arg("--allow-doubtful")
        .current_dir(place.path("elsewhere"))
        .output()
        .unwrap();
    succeeded(&run);
    assert!(arrays(place, output) == arrays(place, &again), "{output}");
    let json = |folder: &str| Results::read(&place.path(folder)).json["parameters"].clone();
    let (mut first, mut second) = (json(output), json(&again));
    for parameters in [&mut first, &mut second] {
        let all = parameters.as_object_mut().unwrap();
        // Named from where the command was given.
        for name in ["inputs", "start", "end", "pca", "geodesic", "variation"] {
            all.remove(name);
        }
    }
    assert_eq!(first, second);
}

#[test]
fn a_result_is_repeated_from_its_configuration_bit_for_bit() {
    let place = Place::new();
    let disks = drawn(&place, "disks", "2", "33");
    let [a, b] = [disks[0].as_str(), disks[1].as_str()];
    let average = [
        "average",
        a,
        b,
        "--grid",
        "17",
        "--weights",
        ".3333333,.6666667",
    ];
    repeated(
        &place,
        &[&average[..], &["--tolerance", "2e-3"]].concat(),
        "average",
    );
    repeated(&place, &["pca", "average", "--modes", "1"], "modes");
    repeated(&place, &["synthesize", "modes", "--scores", "-1.5"], "made");
    repeated(&place, &["score", a, "--pca", "modes"], "scored");
    let path = [
        "geodesic", a, b, "--grid", "17", "-K", "2", "--align", "rigid",
    ];
    repeated(&place, &path, "path");
    repeated(&place, &["extend", "path", "--steps", "1"], "further");
    repeated(&place, &["transport", "path", a, "--steps", "1"], "carried");
    let distances = ["distances", a, b, "--grid", "17", "-K", "1", "--one-way"];
    repeated(&place, &distances, "distances");
    for (name, radius) in [("grey_a.npy", "0.25"), ("grey_b.npy", "0.3")] {
        let shape = [
            "disk",
            "--radius",
            radius,
            "--grid",
            "33",
            "--contrast",
            ".6",
        ];
        draw(&place, name, &shape);
    }
    repeated(
        &place,
        &["segment", "grey_a.npy", "--contrast", ".3"],
        "segment",
    );
    let joint = [
        "average",
        "--joint",
        "grey_a.npy",
        "grey_b.npy",
        "--grid",
        "17",
    ];
    repeated(&place, &joint, "joint");
    repeated(
        &place,
        &["average", a, b, "--grid", "17", "--sweep", "2"],
        "sweep",
    );
}
