//! Commands called by other programs, on arrays in memory.

use std::path::Path;
use std::sync::{Arc, Mutex};

use shapespace::api::{
    ArrayType, COMMANDS, Call, CliError, Event, KeptNumbers, NamedArray, Sources, Trial, keys,
};
use toml::Table;

use crate::common::{Place, array, npy_f64, succeeded};

/// A rectangle in a picture of 17 samples a side.
fn rectangle(width: usize, height: usize) -> Vec<f64> {
    let inside = |at: usize| (at % 17).abs_diff(8) <= width && (at / 17).abs_diff(8) <= height;
    (0..17 * 17)
        .map(|at| f64::from(u8::from(inside(at))))
        .collect()
}

fn masks() -> [(&'static str, Vec<f64>); 2] {
    [("wide", rectangle(5, 3)), ("high", rectangle(3, 5))]
}

fn call() -> Call {
    let mut sources = Sources::files();
    for (name, values) in masks() {
        let array = NamedArray {
            values,
            numbers: ArrayType::Real,
            size: vec![17, 17],
            spacing: None,
            affine: None,
        };
        sources.insert(Path::new(name), array).unwrap();
    }
    let names = masks().map(|(name, _)| name).to_vec();
    let mut options = Table::new();
    options.insert("inputs".into(), names.into());
    options.insert("grid".into(), 17.into());
    Call {
        options,
        sources,
        ..Call::default()
    }
}

#[test]
fn a_result_in_memory_is_that_of_the_program() {
    let place = Place::new();
    for (name, values) in masks() {
        place.write(&format!("{name}.npy"), &npy_f64(&[17, 17], &values));
    }
    let inputs = ["average", "wide.npy", "high.npy", "--grid", "17"];
    let run = place.compute(&[&inputs[..], &["-o", "out"]].concat());
    let printed = succeeded(&run);
    let mut found = call().run("average").unwrap();
    // Lines with times and names of files aside.
    let energy = |text: &str| -> Option<String> {
        let mut lines = text.lines().map(str::to_owned);
        lines.find(|line| line.contains("energy"))
    };
    assert!(energy(&printed).is_some());
    assert_eq!(energy(found.summary()), energy(&printed));
    assert_eq!(found.record()["parameters"]["grid"], 17);
    let arrays = found.take_arrays();
    assert_eq!(arrays.len(), 12, "average, mask, and five for each shape");
    for kept in &arrays {
        let KeptNumbers::Real(values) = &kept.numbers else {
            assert_eq!(kept.name, "average_mask");
            continue;
        };
        let (shape, written) = array(&place.path(&format!("out/{}.npy", kept.name)));
        assert!(kept.shape.iter().map(|&n| n as u64).eq(shape));
        assert!(
            values
                .iter()
                .map(|v| v.to_bits())
                .eq(written.iter().map(|v| v.to_bits())),
            "{}",
            kept.name
        );
    }
    // What has been handed over is written nevertheless.
    assert!(found.arrays().is_empty());
    let saved = found.save(&place.path("saved"), true).unwrap();
    for name in ["average.png", "average_mask.npy", "deformation_001.npy"] {
        let [one, other] = [saved.join(name), place.path("out").join(name)];
        assert_eq!(
            std::fs::read(one).unwrap(),
            std::fs::read(other).unwrap(),
            "{name}"
        );
    }
    let plain = found.save(&place.path("plain"), false).unwrap();
    assert!(plain.join("result.json").is_file() && !plain.join("average.png").exists());
}

#[test]
fn wrong_calls_are_refused_with_a_remedy() {
    let wrong = |key: &str, value: toml::Value, command: &str| -> CliError {
        let mut call = call();
        call.options.insert(key.into(), value);
        call.run(command).err().unwrap()
    };
    let error = wrong("gird", 17.into(), "average");
    assert_eq!(error.to_string(), "there is no key `gird`");
    assert_eq!(error.help(), "did you mean `grid`?");
    let error = wrong("grid", "fine".into(), "average");
    assert!(error.to_string().contains("`grid` cannot be"), "{error}");
    let error = wrong("grid", 40.into(), "average");
    assert_eq!(error.to_string(), "--grid 40 is not allowed");
    let error = wrong("grid", 17.into(), "averag");
    assert!(matches!(error, CliError::Key { .. }), "{error}");
    let call = Call {
        threads: Some(0),
        ..call()
    };
    assert!(call.run("average").is_err());
    for command in COMMANDS {
        assert!(!keys(command).unwrap().is_empty());
    }
}

#[test]
fn a_listener_hears_and_stops_a_computation() {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let mut call = call();
    let (into, stop) = (Arc::clone(&heard), call.stop.clone());
    call.listener = Some(Arc::new(move |event| {
        if matches!(event, Event::Iteration { .. }) {
            stop.ask();
        }
        into.lock().unwrap().push(event);
    }));
    let found = call.run("average").unwrap();
    assert!(found.interrupted());
    assert_eq!(found.record()["status"], "cancelled");
    let heard = heard.lock().unwrap();
    assert_eq!(heard[0], Event::Stage("reading 2 masks".into()));
    let iterations = heard
        .iter()
        .filter(|event| matches!(event, Event::Iteration { .. }));
    assert_eq!(iterations.count(), 1, "it ends at once");
    // Another call is not concerned.
    let other = self::call().run("average").unwrap();
    assert!(!other.interrupted());
}

#[test]
fn a_stopped_trial_begins_no_experiment() {
    let trial = Trial {
        names: vec!["laws-rest".into()],
        quick: true,
        ..Trial::default()
    };
    trial.stop.ask();
    assert!(matches!(trial.run(), Err(CliError::Stopped)));
}

#[test]
fn far_pairs_are_skipped_in_memory() {
    let mut call = call();
    call.options.insert("steps".into(), 1.into());
    call.options.insert("skip_far".into(), 0.1.into());
    call.options.insert("neighbours".into(), 1.into());
    let mut found = call.run("distances").unwrap();
    // The sample has both shapes.
    assert_eq!(found.record()["skipped"]["computed"], 1);
    assert_eq!(
        found.record()["neighbours"]["of"][1]["nearest"][0]["object"],
        0
    );
    let arrays = found.take_arrays();
    let matrix = arrays.iter().find(|kept| kept.name == "distances").unwrap();
    assert_eq!(matrix.shape, [2, 2]);
    call.options.insert("skip_far".into(), 2.0.into());
    let error = call.run("distances").err().unwrap();
    assert_eq!(error.to_string(), "--skip-far 2 is not allowed");
}
