//! Reference values.

use serde_json::Value;
use std::path::PathBuf;

/// A file of reference values in `SHAPESPACE_ORACLE` or in `shared/oracle` of a folder above, or
/// `None` (with the reason printed) where there is no such folder.
pub fn oracle(name: &str) -> Option<Value> {
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

/// A number of an object.
pub fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}"))
}

/// All numbers of nested lists, in order.
pub fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}
