//! Helpers of the tests of several crates: reference values, pools of threads, processes, minima, Python.

#![forbid(unsafe_code)]

pub mod python;

/// The corners of a cuboid, and two triangles for each of its faces, with normals outwards.
pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corner = |n: usize| std::array::from_fn(|k| if n >> k & 1 == 0 { low[k] } else { high[k] });
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

use serde_json::Value;
use std::path::{Path, PathBuf};

/// Returns a file of reference values in the folder `SHAPESPACE_ORACLE` or in `shared/oracle` of a
/// folder above; `None`, with the reason printed, if there is no such folder.
///
/// # Panics
/// If the folder does not have the file, or the file is not JSON.
pub fn oracle(name: &str) -> Option<Value> {
    let given = std::env::var_os("SHAPESPACE_ORACLE").map(PathBuf::from);
    let folder = given.or_else(|| {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .map(|above| above.join("shared/oracle"))
            .find(|folder| folder.is_dir())
    });
    let Some(folder) = folder else {
        eprintln!("skipped: no folder of reference values (set SHAPESPACE_ORACLE)");
        return None;
    };
    let path = folder.join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let json = serde_json::from_str(&text);
    Some(json.unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

/// Returns a number of a JSON object.
///
/// # Panics
/// If there is no such number.
pub fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}"))
}

/// Returns all numbers of nested lists, in order.
///
/// # Panics
/// If there is something else in them.
pub fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(flat).collect(),
        number => vec![
            number
                .as_f64()
                .unwrap_or_else(|| panic!("no number: {number}")),
        ],
    }
}

/// Runs `work` on a pool of `n` threads.
///
/// # Panics
/// If the threads cannot be started.
pub fn on_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.unwrap_or_else(|e| panic!("{e}")).install(work)
}

/// Returns the minimum of a unimodal function between two numbers, by golden section.
pub fn golden_section([mut low, mut high]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..80 {
        let section = 0.381_966 * (high - low);
        if value(low + section) < value(high - section) {
            high -= section;
        } else {
            low += section;
        }
    }
    0.5 * (low + high)
}

/// Runs a test in a process of its own, for measurements of what a whole process uses, which tests beside it would
/// disturb: a test that is called so runs its program again for that test alone, and the copy does the work.
///
/// # Panics
/// If the program has no test of this name, or the test fails; then with what it printed.
pub fn in_own_process(test: &str, work: impl FnOnce()) {
    const ALONE: &str = "SHAPESPACE_TEST_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return work();
    }
    let program = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let mut again = std::process::Command::new(program);
    again.args(["--exact", test, "--nocapture"]).env(ALONE, "1");
    let run = again.output().unwrap_or_else(|e| panic!("{e}"));
    let printed = [run.stdout, run.stderr].concat();
    let printed = String::from_utf8_lossy(&printed);
    println!("{printed}");
    assert!(run.status.success(), "the copy fails: {}", run.status);
    assert!(
        printed.contains("\ntest result: ok. 1 passed"),
        "no test is called {test}"
    );
}
