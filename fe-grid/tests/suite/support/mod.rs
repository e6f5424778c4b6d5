//! Shared by the integration tests.

pub mod assembled;
pub mod objectives;

use fe_grid::Grid;
use std::path::PathBuf;

/// Pseudo-random numbers in [-1, 1], the same in every run.
pub fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..n).map(|_| next()).collect()
}

/// Largest difference of two vectors.
pub fn distance(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len());
    let differences = x.iter().zip(y).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

/// Runs `work` on a pool of so many threads.
pub fn on_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.expect("threads can be started").install(work)
}

/// The folder of reference values: `SHAPESPACE_ORACLE`, or `shared/oracle` in a folder above.
pub fn oracle_folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("SHAPESPACE_ORACLE") {
        return Some(folder.into());
    }
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let folders = here.ancestors().map(|above| above.join("shared/oracle"));
    folders.into_iter().find(|folder| folder.is_dir())
}

/// A file of reference values, or `None` (with the reason printed) where there is none.
pub fn oracle(name: &str) -> Option<serde_json::Value> {
    let Some(folder) = oracle_folder() else {
        eprintln!("skipped: no folder of reference values (set SHAPESPACE_ORACLE)");
        return None;
    };
    let path = folder.join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    Some(serde_json::from_str(&text).expect("reference values are JSON"))
}

/// A list of numbers of a JSON object.
pub fn numbers(object: &serde_json::Value, key: &str) -> Vec<f64> {
    let list = object[key].as_array();
    let list = list.unwrap_or_else(|| panic!("{key} is a list"));
    list.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// A smooth displacement of size `amplitude` times the box.
pub fn smooth_displacement<const D: usize>(grid: &Grid<D>, amplitude: f64, seed: u64) -> Vec<f64> {
    let phases = noise(4 * D * D, seed);
    let extent = grid.extent();
    let mut u = Vec::with_capacity(D * grid.n_nodes());
    for m in 0..D {
        for i in 0..grid.n_nodes() {
            let x = grid.position(grid.node(i));
            let mut s = 1.0;
            for k in 0..D {
                let p = &phases[4 * (m * D + k)..];
                s *= (3.0 * p[0] * x[k] / extent[k] + 3.0 * p[1]).sin();
            }
            u.push(amplitude * extent[m] * s);
        }
    }
    u
}
