//! Runs the blocks of a chapter.

use std::process::{Command, Output};

use test_support::python::install_package;

use crate::common::Place;
use crate::common::document::{Block, blocks, commands, words};
use crate::formats::python;

/// What a block has printed, and whether a result of it is doubtful.
struct Printed {
    text: String,
    doubtful: bool,
}

/// Runs a chapter.
pub fn chapter(name: &str) {
    let place = Place::new();
    let mut printed: Option<Printed> = None;
    let blocks = blocks(&super::chapter(name));
    for (i, block) in blocks.iter().enumerate() {
        let (kind, file) = block.info.split_once(' ').unwrap_or((&block.info, ""));
        match kind {
            "sh" => printed = Some(shell(&place, block)),
            "python" => {
                let Some(output) = script(&place, block) else {
                    let rest = blocks.len() - i;
                    println!("skipped: the last {rest} blocks of {name}, for want of Python");
                    return;
                };
                printed = Some(output);
            }
            "text" => {
                let printed = printed.take();
                let printed = printed.expect("a block of text follows what has printed it");
                assert_shown(&block.lines, &printed.text);
            }
            "rust" => assert_of_an_example(block),
            "csv" | "toml" if !file.is_empty() => {
                let text = block.lines.join("\n") + "\n";
                place.write(file, text.as_bytes());
            }
            other => panic!("{name}: this test does not know what to do with a block of {other}"),
        }
        // A reader meets exit code 3 where the page shows the doubt.
        let said = |next: &Block| next.info == "text" && next.lines.join(" ").contains("doubtful");
        if printed.as_ref().is_some_and(|printed| printed.doubtful) {
            let said = blocks.get(i + 1).is_some_and(said);
            assert!(said, "{name} hides a doubt after {:?}", block.lines);
        }
    }
}

fn both(output: &Output) -> String {
    let text = [output.stderr.as_slice(), output.stdout.as_slice()].concat();
    String::from_utf8(text).unwrap()
}

fn shell(place: &Place, block: &Block) -> Printed {
    let mut printed = Printed {
        text: String::new(),
        doubtful: false,
    };
    for command in commands(block) {
        if let Some(folder) = command.strip_prefix("mkdir ") {
            std::fs::create_dir(place.path(folder)).unwrap();
            continue;
        }
        let arguments = words(place, command);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = place.run(&arguments);
        let text = both(&output);
        let code = output.status.code();
        assert!(matches!(code, Some(0 | 3)), "`{command}` fails:\n{text}");
        printed.doubtful |= code == Some(3);
        printed.text += &text;
    }
    printed
}

/// Runs a script with the package of this build; none, with the reason printed, without it.
fn script(place: &Place, block: &Block) -> Option<Printed> {
    let program = python("numpy")?;
    let package = tempfile::tempdir().unwrap();
    if let Err(error) = install_package(package.path()) {
        println!("the Python module is not built: {error}");
        return None;
    }
    let output = Command::new(program)
        .args(["-c", &block.lines.join("\n")])
        .current_dir(place.path("."))
        .env("PYTHONPATH", package.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let text = both(&output);
    assert!(output.status.success(), "{text}");
    Some(Printed {
        text,
        doubtful: false,
    })
}

/// A block of Rust is a part of a file that is compiled with the tests.
fn assert_of_an_example(block: &Block) {
    for line in &block.lines {
        let included = line.starts_with("{{#include ") && line.contains("/examples/");
        assert!(included, "not of an example: {line}");
    }
}

/// Every line that is shown was printed, in this order, but for times and the last digits of numbers.
/// Lines of three dots stand for others.
fn assert_shown(shown: &[String], printed: &str) {
    let mut lines = printed.lines();
    for line in shown.iter().filter(|line| line.trim() != "...") {
        let found = lines.any(|printed| same(line, printed));
        assert!(found, "not printed, or not here: {line}\n{printed}");
    }
}

fn same(shown: &str, printed: &str) -> bool {
    let [shown, printed] = [shown, printed].map(stable);
    shown.len() == printed.len() && shown.iter().zip(&printed).all(|(a, b)| same_word(a, b))
}

/// The words of a line without the time at its end.
fn stable(line: &str) -> Vec<&str> {
    let mut words: Vec<&str> = line.split_whitespace().collect();
    if let [.., time, "s"] = words[..]
        && time.parse::<f64>().is_ok()
    {
        words.truncate(words.len() - 2);
    }
    words
}

/// Equal words, or numbers within one per cent with the same signs around them.
fn same_word(a: &str, b: &str) -> bool {
    let parts = |word: &'_ str| -> Option<(String, f64)> {
        let core = word.trim_matches(|c: char| "(),;%=".contains(c));
        let number = core.parse().ok().filter(|x: &f64| x.is_finite())?;
        Some((word.replacen(core, "", 1), number))
    };
    a == b
        || match (parts(a), parts(b)) {
            (Some((around_a, a)), Some((around_b, b))) => {
                around_a == around_b && (a - b).abs() <= 0.01 * a.abs().max(b.abs())
            }
            _ => false,
        }
}

#[test]
fn shown_lines_are_compared_with_printed_ones() {
    let printed = "first\n  energy   1.234e-1, 5.0 %\nAverage in 12 steps, 3.4 s\n";
    let check = |shown: &[&str]| {
        let shown: Vec<String> = shown.iter().map(|&line| line.into()).collect();
        std::panic::catch_unwind(|| assert_shown(&shown, printed)).is_ok()
    };
    assert!(check(&[
        "energy 1.235e-1, 5.0 %",
        "...",
        "Average in 12 steps, 9.9 s"
    ]));
    assert!(check(&["  energy   1.234e-1, 5.0 %"]));
    assert!(!check(&["energy 1.334e-1, 5.0 %"]), "another number");
    assert!(!check(&["energy 1.234e-1, 5.0"]), "a word less");
    assert!(!check(&["Average in 12 steps", "first"]), "another order");
    assert!(!check(&["Average in 13 steps, 3.4 s"]), "another count");
    assert!(!check(&["(12) steps"]), "another line");
}
