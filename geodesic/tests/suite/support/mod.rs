//! Shared by the integration tests.

use std::path::PathBuf;

/// Largest absolute value.
pub fn max_abs(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, b| a.max(b.abs()))
}

/// Largest difference of two vectors.
pub fn distance(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len());
    let differences = x.iter().zip(y).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

/// A file of reference values in `SHAPESPACE_ORACLE` or in `shared/oracle` of a folder above, or
/// `None` (with the reason printed) where there is no such folder.
pub fn oracle(name: &str) -> Option<serde_json::Value> {
    let given = std::env::var_os("SHAPESPACE_ORACLE").map(PathBuf::from);
    let folder = given.or_else(|| {
        PathBuf::from(env!("CARGO_MANIFEST_DIR"))
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
    Some(serde_json::from_str(&text).expect("reference values are JSON"))
}

/// Runs `work` on a pool of so many threads.
pub fn on_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.expect("threads can be started").install(work)
}
