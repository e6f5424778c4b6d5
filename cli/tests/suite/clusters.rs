//! The scripts for clusters in docs/cluster, with a local stand-in for the scheduler: the variables
//! that it sets, one process for each task.

use crate::common::{Place, Results};
use crate::distances::{exact, measured, shapes, timeless};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PARTS: usize = 3;

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../docs/cluster")
        .join(name)
}

/// Runs a shell with the program on its path.
fn shell(place: &Place, arguments: &[&str], variables: &[(&str, &str)]) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_shapespace"));
    let mut path = program.parent().unwrap().as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap());
    Command::new("/bin/sh")
        .args(arguments)
        .env("PATH", path)
        .envs(variables.iter().copied())
        .current_dir(place.path("."))
        .output()
        .unwrap()
}

fn code(output: &Output) -> i32 {
    let report = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code().unwrap();
    assert!(matches!(code, 0 | 3), "exit code {code}: {report}");
    code
}

/// Draws shapes into `masks` and measures them without parts.
fn whole(place: &Place) -> Results {
    let names = shapes(place);
    std::fs::create_dir(place.path("masks")).unwrap();
    for name in names {
        std::fs::rename(place.path(name), place.path("masks").join(name)).unwrap();
    }
    measured(place, &["masks"], &["--classes", "prefix"], "whole")
}

fn same(merged: &Path, whole: &Results) {
    let merged = Results::read(merged);
    assert_eq!(timeless(&merged), timeless(whole));
    assert_eq!(exact(&merged), exact(whole));
}

#[test]
fn an_array_of_slurm_jobs_gives_the_whole() {
    let place = Place::new();
    let whole = whole(&place);
    let file = script("distances.slurm");
    let file = file.to_str().unwrap();
    let options = ["masks", "--grid", "33", "-K", "2", "--classes", "prefix"];
    let submit = |parts: &str, task: &str| {
        let arguments = [&[file, parts, "out"][..], &options].concat();
        let variables = [("SLURM_ARRAY_TASK_ID", task), ("SLURM_CPUS_PER_TASK", "2")];
        shell(&place, &arguments, &variables)
    };
    // The tasks end in any order.
    for task in ["3", "1", "2"] {
        assert_eq!(code(&submit(&PARTS.to_string(), task)), 0);
        let part = Results::read(&place.path(&format!("out/part_{task}")));
        assert_eq!(part.json["shard"], format!("{task}/{PARTS}"));
    }
    // A task that is submitted once more has nothing to do.
    let again = submit(&PARTS.to_string(), "2");
    assert_eq!(code(&again), 0);
    assert_eq!(
        String::from_utf8_lossy(&again.stdout),
        format!("part 2 of {PARTS} is complete\n")
    );
    code(&submit("merge", ""));
    same(&place.path("out/all"), &whole);
    assert_eq!(shell(&place, &[file, "8"], &[]).status.code(), Some(2));
}

/// Returns the shell commands of the containers, which stand behind `- |`.
fn commands(manifest: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut lines = manifest.lines();
    while let Some(line) = lines.next() {
        if line.trim() == "- |" {
            let indent = line.len() - line.trim_start().len();
            let inner = lines.by_ref().take_while(|line| {
                let deeper = line.len() - line.trim_start().len() > indent;
                deeper || line.trim().is_empty()
            });
            commands.push(inner.collect::<Vec<_>>().join("\n"));
        }
    }
    commands
}

#[test]
fn indexed_jobs_of_kubernetes_give_the_whole() {
    let place = Place::new();
    let whole = whole(&place);
    let manifest = std::fs::read_to_string(script("distances.yaml")).unwrap();
    let [part, merge] = &commands(&manifest)[..] else {
        panic!("one command for the parts and one that merges");
    };
    // Eight parts in the manifest, fewer here; the small grid is that of the whole.
    assert!(
        manifest.contains("completions: 8") && manifest.contains("{name: PARTS, value: \"8\"}")
    );
    assert_eq!(manifest.matches("value: \"--classes prefix\"").count(), 2);
    let options = "--classes prefix --grid 33 -K 2";
    for index in (0..PARTS).map(|index| index.to_string()) {
        let variables = [
            ("JOB_COMPLETION_INDEX", index.as_str()),
            ("PARTS", &PARTS.to_string()),
            ("OPTIONS", options),
        ];
        for _ in ["first", "again"] {
            assert_eq!(code(&shell(&place, &["-euc", part], &variables)), 0);
        }
    }
    code(&shell(&place, &["-euc", merge], &[("OPTIONS", options)]));
    same(&place.path("out/all"), &whole);
}
