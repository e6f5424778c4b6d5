//! Averages, modes, scores and distances on several processes. With the feature `mpi` they are started by `mpirun`, where it is
//! installed; without, several processes are refused.

use crate::common::Place;

#[cfg(not(feature = "mpi"))]
mod without_mpi {
    use super::*;

    /// The first of two processes reports that they cannot exchange messages; the other is silent.
    #[test]
    fn several_processes_are_refused() {
        let place = Place::new();
        let arguments = ["average", "a.npy", "b.npy", "-o", "out"];
        for [size, rank] in [
            ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
            ["PMI_SIZE", "PMI_RANK"],
        ] {
            let run = |number| place.run_with(&arguments, &[(size, "2"), (rank, number)]);
            let [first, second] = ["0", "1"].map(run);
            assert_eq!([&first, &second].map(|run| run.status.code()), [Some(2); 2]);
            let report = String::from_utf8(first.stderr).unwrap();
            assert!(report.contains("2 processes were started"), "{report}");
            assert!(report.contains("--features mpi"), "{report}");
            assert!(second.stderr.is_empty());
        }
        assert!(place.listing().is_empty());
    }

    /// `mpirun` starts processes that work together; `srun` may start parts of an array.
    #[test]
    fn other_commands_are_refused_under_mpirun_alone() {
        let place = Place::new();
        let arguments = ["generate", "disk", "--grid", "17", "-o", "disk.npy"];
        let mpirun = [("OMPI_COMM_WORLD_SIZE", "2"), ("OMPI_COMM_WORLD_RANK", "0")];
        let run = place.run_with(&arguments, &mpirun);
        let report = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(2));
        assert!(report.contains("runs on one process"), "{report}");
        assert!(place.listing().is_empty());
        let srun = [("SLURM_STEP_NUM_TASKS", "2"), ("SLURM_PROCID", "1")];
        assert!(place.run_with(&arguments, &srun).status.success());
        assert_eq!(place.listing(), ["disk.npy"]);
    }
}

#[cfg(feature = "mpi")]
mod with_mpi {
    use super::*;
    use crate::common::{Results, arrays, draw, drawn};
    use crate::distances::{arguments as paths, exact, measured, shapes, timeless};
    use std::process::{Command, Output};

    /// Runs the program on some processes, on one thread each; `None`, with a printed reason, where there
    /// is no `mpirun`.
    fn mpirun(place: &Place, processes: usize, arguments: &[&str]) -> Option<Output> {
        if Command::new("mpirun").arg("--version").output().is_err() {
            println!("skipped: there is no mpirun");
            return None;
        }
        let output = Command::new("mpirun")
            .args(["--oversubscribe", "-n", &processes.to_string()])
            .arg(env!("CARGO_BIN_EXE_shapespace"))
            .args(arguments)
            .args(["--threads", "1"])
            .envs([
                ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
                ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            ])
            .current_dir(place.path("."))
            .output();
        Some(output.unwrap())
    }

    /// The record without times and the memory of processes.
    fn record(results: &Results) -> serde_json::Value {
        let mut record = results.json.clone();
        let all = record.as_object_mut().unwrap();
        for key in [
            "seconds",
            "solver_seconds",
            "memory_estimate",
            "peak_memory_bytes",
            "record_sha256",
        ] {
            all.remove(key);
        }
        let levels = all
            .get_mut("levels")
            .and_then(|levels| levels.as_array_mut());
        for level in levels.into_iter().flatten() {
            level.as_object_mut().unwrap().remove("seconds");
        }
        all.remove("files");
        record
    }

    /// Compares the results of some numbers of processes with that of one, `COMMAND_alone`.
    fn check(place: &Place, arguments: &[&str], numbers: &[usize]) {
        let output = format!("{}_alone", arguments[0]);
        let alone = [
            arguments,
            &["--allow-doubtful", "--threads", "1", "-o", &output],
        ]
        .concat();
        let alone = place.run(&alone);
        assert!(
            alone.status.success(),
            "{}",
            String::from_utf8_lossy(&alone.stderr)
        );
        let alone = Results::read(&place.path(&output));
        for processes in numbers {
            let out = format!("{}_on_{processes}", arguments[0]);
            let arguments = [arguments, &["--allow-doubtful", "-o", &out]].concat();
            let Some(run) = mpirun(place, *processes, &arguments) else {
                return;
            };
            let report = String::from_utf8_lossy(&run.stderr);
            assert!(run.status.success(), "{processes} processes: {report}");
            let results = Results::read(&place.path(&out));
            assert!(arrays(&results) == arrays(&alone), "{processes} processes");
            assert_eq!(record(&results), record(&alone), "{processes} processes");
        }
    }

    #[test]
    fn averages_have_the_same_bits_on_any_number_of_processes() {
        let place = Place::new();
        let names = drawn(&place, "stars", "2", "65");
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let arguments = [&["average"][..], &names, &["--grid", "33"]].concat();
        check(&place, &arguments, &[2, 3, 5]);
        let median = [&arguments[..], &["--mean", "median"]].concat();
        let place = Place::new();
        drawn(&place, "stars", "2", "65");
        check(&place, &median, &[2]);
    }

    #[test]
    fn averages_of_volumes_have_the_same_bits() {
        let place = Place::new();
        let names = drawn(&place, "blobs", "3", "33");
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        check(
            &place,
            &[&["average"][..], &names, &["--grid", "17"]].concat(),
            &[2, 3],
        );
    }

    /// All pairs in their own alignment, with far ones skipped: some rounds of pairs.
    #[test]
    fn distances_have_the_same_bits_on_any_number_of_processes() {
        let place = Place::new();
        let inputs = shapes(&place);
        let one = ["--threads", "1"];
        for (k, options) in [
            &["--align", "rigid", "--size", "equal"][..],
            &["--skip-far", "0.1", "--neighbours", "2"],
        ]
        .into_iter()
        .enumerate()
        {
            let alone = format!("alone_{k}");
            let alone = measured(&place, &inputs, &[options, &one].concat(), &alone);
            for processes in [2, 4] {
                let out = format!("on_{k}_{processes}");
                let options = [options, &["--allow-doubtful"]].concat();
                let Some(run) = mpirun(&place, processes, &paths(&inputs, &options, &out)) else {
                    return;
                };
                let report = String::from_utf8_lossy(&run.stderr);
                assert!(run.status.success(), "{report}");
                let found = Results::read(&place.path(&out));
                assert_eq!(timeless(&found), timeless(&alone), "{processes} processes");
                assert_eq!(exact(&found), exact(&alone), "{processes} processes");
                assert!(!place.path(&format!("{out}.partial")).exists());
            }
        }
    }

    /// The modes of an average, and the scores of its shapes in them.
    #[test]
    fn modes_and_scores_have_the_same_bits_on_any_number_of_processes() {
        for (family, dimension, grid, numbers) in [
            ("stars", "2", ["65", "33"], &[2, 3, 5][..]),
            ("blobs", "3", ["33", "17"], &[2, 3]),
        ] {
            let place = Place::new();
            let names = drawn(&place, family, dimension, grid[0]);
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let average = [&["average"][..], &names, &["--grid", grid[1]]].concat();
            let average = place.compute(&[&average[..], &["-o", "average"]].concat());
            assert!(average.status.success());
            check(&place, &["pca", "average"], numbers);
            let score = [&["score"][..], &names, &["--pca", "pca_alone"]].concat();
            check(&place, &score, numbers);
        }
    }

    #[test]
    fn averages_of_images_have_the_same_bits() {
        let place = Place::new();
        let names = ["a.npy", "b.npy", "c.npy"];
        for (name, radius) in names.iter().zip([".2", ".23", ".26"]) {
            let disk = ["disk", "--radius", radius, "--grid", "33"];
            let grey = ["--contrast", ".6", "--noise", ".03"];
            draw(&place, name, &[&disk[..], &grey[..]].concat());
        }
        let joint = [&["average", "--joint"][..], &names, &["--grid", "33"]].concat();
        check(&place, &joint, &[2, 4]);
    }

    /// One process that is killed ends all; the checkpoint is resumed on another number of processes.
    fn check_resume(place: &Place, arguments: &[&str]) {
        let out = format!("{}_on_2", arguments[0]);
        let partial = format!("{out}.partial");
        let resumed = [arguments, &["--checkpoint", "0.0001"]].concat();
        let long = [&resumed[..], &["--allow-doubtful", "-o", &out]].concat();
        let state = format!("{partial}/state.json");
        let Some(run) = std::thread::scope(|scope| {
            let run = scope.spawn(|| mpirun(place, 3, &long));
            while !run.is_finished() {
                if place.path(&state).exists() {
                    kill_one_of(place);
                }
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            run.join().unwrap()
        }) else {
            return;
        };
        assert!(!run.status.success());
        assert!(!place.path(&out).exists() && place.path(&partial).exists());
        check(place, &resumed, &[2]);
        assert!(!place.path(&partial).exists());
    }

    #[test]
    fn a_process_that_is_killed_ends_all_and_the_rest_is_resumed() {
        let place = Place::new();
        let names = drawn(&place, "stars", "2", "129");
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let average = [&["average"][..], &names, &["--grid", "129"]].concat();
        check_resume(&place, &average);
        check_resume(&place, &["pca", "average_alone"]);
        let score = [&["score"][..], &names, &["--pca", "pca_alone"]].concat();
        check_resume(&place, &score);
    }

    /// Kills the newest of the processes that work in a place.
    fn kill_one_of(place: &Place) {
        let here = place.path(".").canonicalize().unwrap();
        let mut found: Vec<u32> = Vec::new();
        for entry in std::fs::read_dir("/proc").unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().parse();
            let (Ok(id), Ok(folder)) = (name, entry.path().join("cwd").read_link()) else {
                continue;
            };
            let command = std::fs::read_to_string(entry.path().join("comm")).unwrap_or_default();
            if folder == here && command.trim() == "shapespace" {
                found.push(id);
            }
        }
        if let Some(newest) = found.iter().max() {
            let _ = Command::new("kill")
                .args(["-9", &newest.to_string()])
                .status();
        }
    }

    /// The job of Slurm, with variables that the scheduler sets.
    #[test]
    fn a_job_of_slurm_runs_on_several_processes() {
        let place = Place::new();
        let names = drawn(&place, "stars", "2", "33");
        if Command::new("mpirun").arg("--version").output().is_err() {
            println!("skipped: there is no mpirun");
            return;
        }
        let script =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cluster/average.slurm");
        let program = std::path::Path::new(env!("CARGO_BIN_EXE_shapespace"));
        let mut path = program.parent().unwrap().as_os_str().to_owned();
        path.push(":");
        path.push(std::env::var_os("PATH").unwrap());
        let run = Command::new("/bin/sh")
            .arg(script)
            .arg("out")
            .args(&names)
            .args(["--grid", "33", "--allow-doubtful"])
            .env("PATH", path)
            .envs([
                ("SLURM_NTASKS", "2"),
                ("SLURM_CPUS_PER_TASK", "1"),
                ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
                ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            ])
            .current_dir(place.path("."))
            .output()
            .unwrap();
        let report = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{report}");
        assert!(Results::read(&place.path("out")).number("/energy/total") > 0.0);
    }

    /// Everything that cannot be done ends all processes with one report.
    #[test]
    fn errors_end_all_processes() {
        let place = Place::new();
        draw(&place, "a.npy", &["bar", "--grid", "33"]);
        for (arguments, text) in [
            (
                &["average", "a.npy", "missing.npy", "-o", "out"][..],
                "missing.npy",
            ),
            (
                &["average", "a.npy", "a.npy", "--sweep", "3", "-o", "out"],
                "runs on one process",
            ),
            (
                &["geodesic", "a.npy", "a.npy", "-o", "out"],
                "runs on one process",
            ),
            (
                &[
                    "average", "a.npy", "a.npy", "--solver", "descent", "--grid", "17", "-o", "out",
                ],
                "runs on one process",
            ),
        ] {
            let Some(run) = mpirun(&place, 2, arguments) else {
                return;
            };
            let report = String::from_utf8_lossy(&run.stderr);
            assert_eq!(run.status.code(), Some(2), "{report}");
            assert_eq!(report.matches(text).count(), 1, "{report}");
            assert!(!report.contains("interrupted"), "{report}");
        }
        assert!(!place.path("out").exists());
        // A log has its last line instead of a report.
        place.write("there", b"");
        let logged = ["average", "a.npy", "a.npy", "--log", "json", "-o", "there"];
        if let Some(run) = mpirun(&place, 2, &logged) {
            let log = String::from_utf8_lossy(&run.stderr);
            assert_eq!(run.status.code(), Some(2), "{log}");
            assert_eq!(log.matches("\"event\":\"error\"").count(), 1, "{log}");
        }
    }
}
