//! Runs commands on arrays in memory, as the Python package does: the average of drawn ellipses and
//! its modes.
//!
//! `cargo run --release --example calls -- 129 8`: nodes a side, and number of shapes.

#![forbid(unsafe_code)]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use shapespace::api::{ArrayType, Call, NamedArray, Sources};

/// An ellipse in a picture of `n` samples a side, as bytes 0 and 255.
fn ellipse(n: usize, [a, b]: [f64; 2]) -> NamedArray {
    let place = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    let inside = |at: usize| {
        let (x, y) = (place(at % n), place(at / n));
        (x / a).powi(2) + (y / b).powi(2) < 1.0
    };
    NamedArray {
        values: (0..n * n)
            .map(|at| if inside(at) { 255.0 } else { 0.0 })
            .collect(),
        numbers: ArrayType::U8,
        size: vec![n, n],
        spacing: None,
        affine: None,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let numbers: Result<Vec<usize>, _> = std::env::args().skip(1).map(|n| n.parse()).collect();
    let numbers = numbers?;
    let nodes = numbers.first().copied().unwrap_or(33);
    let shapes = numbers.get(1).copied().unwrap_or(3);
    let mut sources = Sources::files();
    let names: Vec<String> = (0..shapes).map(|k| format!("ellipse_{k}")).collect();
    for (k, name) in names.iter().enumerate() {
        let share = k as f64 / shapes as f64;
        let axes = [0.20 + 0.12 * share, 0.30 - 0.10 * share * share];
        sources.insert(Path::new(name), ellipse(nodes, axes))?;
    }
    let mut options = toml::Table::new();
    options.insert("inputs".into(), names.into());
    options.insert("grid".into(), toml::Value::try_from(nodes)?);
    options.insert("align".into(), "none".into());
    let call = Call {
        options,
        sources,
        ..Call::default()
    };
    let start = Instant::now();
    let average = call.run("average")?;
    println!("{}", average.summary());
    println!("{:.3} s", start.elapsed().as_secs_f64());
    let place = tempfile::tempdir()?;
    let folder = average.save(&place.path().join("average"), false)?;
    let folder = folder.to_string_lossy().into_owned();
    let modes = Call {
        options: toml::Table::from_iter([("average".to_owned(), folder.into())]),
        ..Call::default()
    };
    println!("{}", modes.run("pca")?.summary());
    Ok(())
}
