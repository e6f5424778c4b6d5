//! Sudden ends: signals, closed pipes, full disks, and what earlier runs have left.
#![cfg(target_os = "linux")]

use std::fs::{self, OpenOptions};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::{
    Place, Results, arrays, draw, drawn, grey_png, interrupted, killed, signalled, succeeded,
};

/// A statement whose experiment takes a moment.
const QUICK: &str = "laws-linear-rotation";

/// A checkpoint names no folder outside of its own.
#[test]
fn a_checkpoint_names_no_other_folder() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let mut arguments = vec!["average", "--checkpoint", "1e-6", "-o", "out"];
    arguments.extend(["--grid", "65", "--align", "none"]);
    arguments.extend(inputs.iter().map(String::as_str));
    let state = place.path("out.partial/state.json");
    killed(&place, &arguments, || state.is_file());
    let mut json: serde_json::Value = serde_json::from_slice(&fs::read(&state).unwrap()).unwrap();
    let number = json["checkpoint"].as_u64().unwrap();
    let own = place.path(&format!("out.partial/checkpoint_{number:03}"));
    fs::rename(own, place.path("precious")).unwrap();
    json["folder"] = "../precious".into();
    json["checkpoint"] = "../precious".into();
    fs::write(&state, json.to_string()).unwrap();
    let run = place.compute(&arguments);
    let report = String::from_utf8_lossy(&run.stderr);
    assert!(matches!(run.status.code(), Some(0 | 2)), "{report}");
    assert!(place.path("precious/state.bin").is_file());
}

/// A damaged checkpoint is set aside with a note, and the computation begins anew.
#[test]
fn damaged_checkpoints_are_set_aside() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let mut arguments = vec![
        "average",
        "--grid",
        "65",
        "-o",
        "whole",
        "--checkpoint",
        "1e-6",
    ];
    arguments.extend(inputs.iter().map(String::as_str));
    succeeded(&place.compute(&arguments));
    arguments[4] = "out";
    let whole = arrays(&Results::read(&place.path("whole")));
    let state = place.path("out.partial/state.json");
    let array = |name: &str| {
        let json: serde_json::Value = serde_json::from_slice(&fs::read(&state).unwrap()).unwrap();
        let number = json["checkpoint"].as_u64().unwrap();
        place.path(&format!("out.partial/checkpoint_{number:03}/{name}"))
    };
    let damages: [&dyn Fn(); 4] = [
        &|| fs::write(&state, "{").unwrap(),
        &|| fs::remove_file(array("gradient.bin")).unwrap(),
        &|| {
            let path = array("state.bin");
            let bytes = fs::read(&path).unwrap();
            fs::write(&path, &bytes[..bytes.len() - 8]).unwrap();
        },
        &|| {
            let path = array("state.bin");
            let mut bytes = fs::read(&path).unwrap();
            *bytes.last_mut().unwrap() ^= 1;
            fs::write(&path, &bytes).unwrap();
        },
    ];
    for damage in damages {
        killed(&place, &arguments, || state.is_file());
        damage();
        let run = place.compute(&arguments);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        succeeded(&run);
        assert!(report.contains("damaged_000"), "{report}");
        assert!(arrays(&Results::read(&place.path("out"))) == whole);
        assert_eq!(place.listing(), ["crosses", "out", "whole"]);
        fs::remove_dir_all(place.path("out")).unwrap();
    }
}

#[test]
fn an_interrupted_sweep_says_so() {
    let place = Place::new();
    let inputs = drawn(&place, "crosses", "2", "33");
    let mut arguments = vec!["average", "--sweep", "5", "-o", "out", "--grid", "129"];
    arguments.extend(inputs[..2].iter().map(String::as_str));
    assert_eq!(interrupted(&place, &arguments, "level 1 of"), Some(130));
    let results = Results::read(&place.path("out"));
    assert_eq!(results.json["status"], "cancelled");
}

/// Every signal ends the program, and nothing is left but the outcomes from which it goes on.
#[test]
fn every_signal_is_heard() {
    let place = Place::new();
    // Under `nohup` this one is ignored, by the program too.
    let own = fs::read_to_string("/proc/self/status").unwrap();
    let ignored = own.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let hangs_up = u64::from_str_radix(ignored.unwrap().trim(), 16).unwrap() & 1 == 0;
    let signals = ["INT", "TERM", "HUP"];
    for signal in &signals[..if hangs_up { 3 } else { 2 }] {
        // Most statements are left after the first one: outcomes of an earlier run would be taken over.
        let arguments = ["verify", "--quick", "-o", "out"];
        let start = Instant::now();
        assert_eq!(
            signalled(&place, &arguments, signal, "confirmed"),
            Some(130)
        );
        assert!(start.elapsed() < Duration::from_secs(20), "{signal}");
        assert_eq!(place.listing(), ["out.partial"], "{signal}");
        fs::remove_dir_all(place.path("out.partial")).unwrap();
    }
}

/// What a killed process has left is removed by the next run.
#[test]
fn leftovers_are_swept() {
    let place = Place::new();
    let staged = || {
        place
            .listing()
            .iter()
            .any(|name| name.starts_with(".shapespace-"))
    };
    // The folder of the result comes first, that of finished experiments after it.
    let working = || staged() && place.path("out.partial/work.json").is_file();
    killed(&place, &["verify", "-o", "out"], working);
    assert!(staged());
    succeeded(&place.run(&["generate", "disk", "--grid", "9", "-o", "a.npy"]));
    assert_eq!(place.listing(), ["a.npy", "out.partial"]);
}

fn with_streams(place: &Place, arguments: &[&str], stdout: Stdio, stderr: Stdio) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shapespace"))
        .args(arguments)
        .current_dir(place.path("."))
        .stdout(stdout)
        .stderr(stderr)
        .output()
        .unwrap()
}

/// A pipe whose reader has gone.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

fn full() -> Stdio {
    OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap()
        .into()
}

#[test]
fn closed_and_full_streams_end_no_command() {
    let place = Place::new();
    for arguments in [&["verify", "--list"][..], &["config", "average"]] {
        let run = with_streams(&place, arguments, closed(), Stdio::piped());
        assert_eq!(run.status.code(), Some(0), "{arguments:?}");
        let run = with_streams(&place, arguments, full(), Stdio::piped());
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(1), "{report}");
        assert!(report.contains("standard output"), "{report}");
        assert!(!report.contains("panicked"), "{report}");
    }
    for (k, stream) in [closed as fn() -> Stdio, full].into_iter().enumerate() {
        let names = ["disk", "bars", "verified"].map(|name| format!("{name}{k}.npy"));
        for arguments in [
            &["generate", "disk", "--grid", "9", "-o", &names[0]][..],
            &["generate", "family", "bars", "--grid", "9", "-o", &names[1]],
            &["verify", "--quick", QUICK, "-o", &names[2]],
        ] {
            let run = with_streams(&place, arguments, Stdio::null(), stream());
            assert_eq!(run.status.code(), Some(0), "{arguments:?}");
        }
        for name in names {
            assert!(place.path(&name).exists(), "{name}");
        }
        let metric = format!("metric{k}");
        let shape = ["metric", "disk0.npy", "--mode", "2", "--grid", "17"];
        let arguments = [&shape[..], &["--allow-doubtful", "-o", &metric]].concat();
        let run = with_streams(&place, &arguments, stream(), Stdio::piped());
        assert_eq!(run.status.code(), Some(0), "{arguments:?}");
        assert!(place.path(&metric).exists());
    }
}

/// A name that is too long is told before anything is computed.
#[test]
fn names_that_are_too_long_are_refused_at_once() {
    let place = Place::new();
    draw(&place, "disk.npy", &["disk", "--grid", "17"]);
    for (length, code) in [(250, 1), (240, 0)] {
        let name = "x".repeat(length);
        let run = place.compute(&[
            "metric", "disk.npy", "--grid", "17", "--mode", "2", "-o", &name,
        ]);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(code), "{report}");
        assert_eq!(report.contains("too long"), code != 0, "{report}");
        assert!(code == 0 || !report.contains("reading"), "{report}");
    }
}

/// A limit of the size of files makes a write fail; it does not end the program by a signal.
#[test]
fn the_limit_of_file_sizes_is_an_error() {
    let place = Place::new();
    let program = env!("CARGO_BIN_EXE_shapespace");
    for arguments in [
        "generate disk --grid 129 -o a.npy",
        "generate family bars -o a",
    ] {
        let run = Command::new("sh")
            .args(["-c", &format!("ulimit -f 8; exec '{program}' {arguments}")])
            .current_dir(place.path("."))
            .output()
            .unwrap();
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(1), "{report}");
        assert!(report.contains("cannot write"), "{report}");
        assert_eq!(place.listing(), [""; 0]);
    }
}

/// A picture of 4096 x 4096 pixels that takes little space in its file.
fn large_picture(place: &Place, name: &str) {
    let grey: Vec<u8> = (0..4096usize * 4096)
        .map(|k| u8::from(k % 4096 < 2048) * 255)
        .collect();
    place.write(name, &grey_png(4096, 4096, &grey));
}

/// The memory of inputs is known before they are decoded, and counted in the limit.
#[test]
fn inputs_beyond_the_memory_are_refused() {
    let place = Place::new();
    large_picture(&place, "large.png");
    let run = |command: &str| {
        let program = env!("CARGO_BIN_EXE_shapespace");
        let command = command.replace("shapespace", &format!("'{program}'"));
        let run = Command::new("sh")
            .args(["-c", &command])
            .current_dir(place.path("."))
            .output();
        let run = run.unwrap();
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        report
    };
    let average = "shapespace average large.png large.png -o out";
    // One fits, with 80 MiB while it is decoded, of which 32 are kept, and the second does not.
    let report = run(&format!("{average} --memory 100MiB"));
    assert!(
        report.contains("100.0 MiB") && report.contains("--memory"),
        "{report}"
    );
    // A limit of the address space (in KiB) is a limit of memory.
    let report = run(&format!("ulimit -v 90000; exec {average} --threads 1"));
    assert!(report.contains("of memory"), "{report}");
    assert_eq!(place.listing(), ["large.png"]);
}

/// Wherever the memory ends: what is not counted beforehand, as threads' stacks and pictures, is refused by a report.
#[test]
fn the_end_of_the_memory_is_reported() {
    let place = Place::new();
    let program = env!("CARGO_BIN_EXE_shapespace");
    place.run(&["generate", "family", "bars", "--grid", "33", "-o", "bars"]);
    let limited = |limit: usize, command: &str| {
        Command::new("sh")
            .args([
                "-c",
                &format!("ulimit -v {limit}; exec '{program}' {command}"),
            ])
            .current_dir(place.path("."))
            .output()
            .unwrap()
    };
    // In KiB. With less than the first the system does not load the program.
    let starts = |limit: &usize| limited(*limit, "--version").status.success();
    let first = (20_000..400_000).step_by(4_000).find(starts).unwrap();
    let mut ends = [0; 2];
    for limit in (first..first + 120_000).step_by(6_000) {
        let run = limited(
            limit,
            "average bars --grid 33 --max-iterations 2 --threads 2 -o out",
        );
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        match run.status.code() {
            Some(0 | 3) => {
                ends[1] += 1;
                fs::remove_dir_all(place.path("out")).unwrap();
            }
            code => {
                ends[0] += 1;
                assert!(matches!(code, Some(1 | 2)), "{limit}: {report}");
                assert!(report.contains("help:"), "{limit}: {report}");
                assert!(!place.path("out").exists(), "{limit}");
            }
        }
    }
    assert!(ends.iter().all(|&n| n > 2), "{ends:?}");
}

/// What a computation needs is known before it begins.
#[test]
fn computations_beyond_the_memory_are_refused() {
    let place = Place::new();
    let square = |side: usize| {
        let inside = |i: usize| (8..8 + side).contains(&i);
        let value = |i: usize| 255 * u8::from(inside(i / 32) && inside(i % 32));
        grey_png(32, 32, &(0..32 * 32).map(value).collect::<Vec<_>>())
    };
    place.write("a.png", &square(16));
    place.write("b.png", &square(12));
    let program = env!("CARGO_BIN_EXE_shapespace");
    let limited = |kibibytes: usize, command: &str| {
        let line = format!("ulimit -v {kibibytes}; exec '{program}' {command} -o out --threads 1");
        let run = Command::new("sh")
            .args(["-c", &line])
            .current_dir(place.path("."))
            .output();
        run.unwrap()
    };
    for command in [
        "geodesic a.png b.png --align none --grid 513 -K 16",
        "distances a.png b.png --align none --grid 513 -K 16",
        "segment a.png --grid 2049",
        "average a.png b.png --joint --grid 1025",
        "metric a.png --mode 2 --grid 2049",
        "figure weights a.png b.png a.png --grid 1025",
    ] {
        let run = limited(500_000, command);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{command}: {report}");
        assert!(
            report.contains("memory: about") && report.contains("are free"),
            "{command}: {report}"
        );
        assert_eq!(place.listing(), ["a.png", "b.png"], "{command}");
    }
    let path = "geodesic a.png b.png --align none --grid 65 -K 2 -o path";
    let path: Vec<&str> = path.split_whitespace().collect();
    place.compute(&path);
    for command in ["extend path -K 1024", "transport path b.png --steps 256"] {
        let run = limited(200_000, command);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{command}: {report}");
        assert!(report.contains("are free"), "{command}: {report}");
        assert_eq!(place.listing(), ["a.png", "b.png", "path"], "{command}");
    }
}

/// Nothing waits for a pipe or reads a device without end.
#[test]
fn only_files_are_read() {
    let place = Place::new();
    place.write("a.png", &grey_png(2, 2, &[0, 255, 0, 255]));
    let made = Command::new("mkfifo")
        .arg(place.path("pipe.png"))
        .status()
        .unwrap();
    assert!(made.success());
    fs::create_dir(place.path("folder.npy")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", place.path("zero.png")).unwrap();
    std::os::unix::fs::symlink("loop.png", place.path("loop.png")).unwrap();
    let before = place.listing();
    for (name, words) in [
        ("pipe.png", "a pipe or a device"),
        ("zero.png", "a pipe or a device"),
        ("folder.npy", "a folder"),
        ("loop.png", "symbolic links"),
    ] {
        let run = place.run(&["average", "a.png", name, "-o", "out"]);
        let report = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{report}");
        assert!(report.contains(name) && report.contains(words), "{report}");
    }
    let run = place.run(&["average", "--config", "pipe.png", "-o", "out"]);
    assert_eq!(run.status.code(), Some(2));
    assert_eq!(place.listing(), before);
}

/// Of several processes with the same output one wins, and the others say so.
#[test]
fn one_of_several_processes_wins() {
    let place = Place::new();
    let start = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_shapespace"))
            .args(arguments)
            .current_dir(place.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    for arguments in [
        [
            "generate", "family", "letters", "--grid", "65", "-o", "letters",
        ],
        [
            "generate",
            "disk",
            "--radius",
            ".2",
            "--grid=257",
            "-o",
            "a.npy",
        ],
    ] {
        let all: Vec<_> = (0..8).map(|_| start(&arguments)).collect();
        let ends: Vec<Output> = all
            .into_iter()
            .map(|run| run.wait_with_output().unwrap())
            .collect();
        let codes: Vec<_> = ends.iter().map(|end| end.status.code()).collect();
        assert_eq!(
            codes.iter().filter(|code| **code == Some(0)).count(),
            1,
            "{codes:?}"
        );
        for end in ends.iter().filter(|end| end.status.code() != Some(0)) {
            let report = String::from_utf8_lossy(&end.stderr);
            assert_eq!(end.status.code(), Some(2), "{report}");
            assert!(report.contains("exists already"), "{report}");
        }
    }
    assert_eq!(place.listing(), ["a.npy", "letters"]);

    let inputs = drawn(&place, "crosses", "2", "33");
    let mut arguments = vec![
        "average",
        "--grid",
        "1025",
        "--checkpoint",
        "1e-6",
        "-o",
        "out",
    ];
    arguments.extend(inputs.iter().map(String::as_str));
    let mut first = start(&arguments);
    while !place.path("out.partial/state.json").exists() {
        assert_eq!(first.try_wait().unwrap(), None);
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = place.run(&arguments);
    let report = String::from_utf8_lossy(&second.stderr).into_owned();
    assert_eq!(second.status.code(), Some(2), "{report}");
    assert!(report.contains("another run uses"), "{report}");
    first.kill().unwrap();
    first.wait().unwrap();

    // The checkpoints of who comes second with the result are of no use.
    arguments[2] = "129";
    arguments[6] = "late";
    let late = start(&arguments);
    while !place.path("late.partial/state.json").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    fs::create_dir(place.path("late")).unwrap();
    let end = late.wait_with_output().unwrap();
    let report = String::from_utf8_lossy(&end.stderr).into_owned();
    assert_eq!(end.status.code(), Some(2), "{report}");
    assert!(report.contains("exists already"), "{report}");
    assert!(!place.path("late.partial").exists());
}
