//! `bench --check`: instructions of the kernels against a committed baseline.
//!
//! Every kernel runs on a small grid in a child process under `valgrind`, once and three times;
//! half the difference is the count of one run, without setup. The count does not depend on the
//! load of the machine. Valgrind does not support AVX-512, so that the copies for 256-bit vectors
//! are counted.

use std::path::Path;
use std::process::Command;

use super::baseline::{Baseline, compare};
use super::case::{Case, Real, Work};
use super::flops::Verb;
use super::job::Job;
use super::{machine, output};
use crate::outcome::Outcome;

/// Path of the baseline, relative to the folder of this crate.
const FOLDER: &str = "baseline";
const FILE: &str = "instructions.json";
/// Environment of the kernels: the instruction set.
const VECTORS: &str = "256";

/// Counts instructions, and compares them with the baseline or writes it.
pub fn run(bless: bool) -> Outcome<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(FOLDER);
    let counter = counter_version()?;
    let mut counted = Baseline {
        compiler: machine::compiler(),
        counter,
        vectors: VECTORS.into(),
        instructions: std::collections::BTreeMap::new(),
    };
    for case in cases() {
        let instructions = one_run(case)?;
        eprintln!("  {case}: {instructions}");
        counted.instructions.insert(case.to_string(), instructions);
    }
    if bless {
        return output::write_json(&folder, FILE, &counted);
    }
    let place = folder.join(FILE);
    let text = std::fs::read_to_string(&place).map_err(|error| {
        format!(
            "the baseline '{}' cannot be read ({error}); bench --check --bless makes one",
            place.display()
        )
    })?;
    let comparison = compare(&serde_json::from_str(&text)?, &counted);
    println!("{comparison}");
    if comparison.passes() {
        Ok(())
    } else {
        Err("the kernels take more instructions than they did".into())
    }
}

/// All kernels, on small grids.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (dimension, nodes) in [(2, 65), (3, 17)] {
        let mut add = |work, real| {
            cases.push(Case {
                work,
                dimension,
                real,
                nodes,
            });
        };
        for verb in [Verb::Value, Verb::Gradient, Verb::Hessian] {
            add(Work::Elastic(verb), Real::F64);
        }
        add(Work::Elastic(Verb::Gradient), Real::F32);
        add(Work::Anchor(Verb::Gradient), Real::F64);
        add(Work::MassStiffness, Real::F64);
        add(Work::MassStiffness, Real::F32);
        for work in Work::IN_DOUBLE {
            add(work, Real::F64);
        }
        add(Work::Functional, Real::F64);
    }
    cases
}

/// Name and version of the counting program.
fn counter_version() -> Outcome<String> {
    let output = Command::new("valgrind").arg("--version").output();
    let output = output.map_err(|error| {
        format!("bench --check counts with valgrind, which cannot be started: {error}")
    })?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Instructions of one run of a kernel.
fn one_run(case: Case) -> Outcome<u64> {
    let (once, thrice) = (runs(case, 1)?, runs(case, 3)?);
    Ok(thrice.saturating_sub(once) / 2)
}

/// Counts the instructions of a child process that runs a kernel a number of times.
fn runs(case: Case, times: usize) -> Outcome<u64> {
    let job = Job::Repeat {
        case: case.to_string(),
        times,
    };
    let output = Command::new("valgrind")
        .args(["--tool=cachegrind", "--cache-sim=no"])
        .arg("--cachegrind-out-file=/dev/null")
        .arg(Job::program()?)
        .args(job.arguments()?)
        // The size of the environment shifts the stack, and changes some counts by a few per mille.
        .env_clear()
        .env("PATH", std::env::var_os("PATH").unwrap_or_default())
        .env("SHAPESPACE_SIMD", VECTORS)
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let counted = instructions(&said).filter(|_| output.status.success());
    counted.ok_or_else(|| format!("valgrind did not count {case}:\n{said}").into())
}

/// The number after `I refs:` in the output of cachegrind.
fn instructions(said: &str) -> Option<u64> {
    let line = said
        .lines()
        .find(|l| l.contains("I ") && l.contains("refs:"))?;
    let digits = line.rsplit(':').next()?.trim().replace(',', "");
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_read_from_what_valgrind_says() {
        let said = "==7== Cachegrind\n==7== \n==7== I   refs:      12,345,678\n";
        assert_eq!(instructions(said), Some(12_345_678));
        assert_eq!(instructions("==7== Command: ls\n"), None);
    }

    #[test]
    fn every_case_of_the_check_can_be_named_to_a_child() {
        for case in cases() {
            assert_eq!(case.to_string().parse(), Ok(case));
        }
    }
}
