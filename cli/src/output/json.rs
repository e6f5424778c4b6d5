//! JSON files in which every number is finite.

use std::fs;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::OutputError;

/// A value as JSON. A number that is not finite becomes `null` in JSON, so nulls
/// are an error: missing values have to be left out.
///
/// # Errors
/// [`OutputError::NotFinite`] with the place of the first null.
pub(super) fn json(path: &Path, value: &impl Serialize) -> Result<Value, OutputError> {
    let failed = |error: serde_json::Error| OutputError::at(path)(error.into());
    let value = serde_json::to_value(value).map_err(failed)?;
    match first_null(&value) {
        Some(key) => Err(OutputError::NotFinite { key }),
        None => Ok(value),
    }
}

/// Writes a value as indented JSON, in which there are no nulls.
///
/// # Errors
/// [`OutputError::NotFinite`] with the place of the first null, [`OutputError::Unwritable`].
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), OutputError> {
    let text = text_of(path, &json(path, value)?)?;
    fs::write(path, text).map_err(OutputError::at(path))
}

/// The indented text of a value.
pub(super) fn text_of(path: &Path, value: &Value) -> Result<String, OutputError> {
    let failed = |error: serde_json::Error| OutputError::at(path)(error.into());
    let mut text = serde_json::to_string_pretty(value).map_err(failed)?;
    text.push('\n');
    Ok(text)
}

/// Place of the first null, such as `energy.elastic[1]`.
fn first_null(value: &Value) -> Option<String> {
    match value {
        Value::Null => Some(String::new()),
        Value::Array(items) => items.iter().enumerate().find_map(|(i, item)| {
            let inner = first_null(item)?;
            Some(format!("[{i}]{}", dotted(&inner)))
        }),
        Value::Object(entries) => entries.iter().find_map(|(key, item)| {
            let inner = first_null(item)?;
            Some(format!("{key}{}", dotted(&inner)))
        }),
        _ => None,
    }
}

fn dotted(inner: &str) -> String {
    if inner.is_empty() || inner.starts_with('[') {
        inner.to_owned()
    } else {
        format!(".{inner}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_read_back_exactly_and_nan_is_named() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("r.json");
        let numbers = [0.1, 1.0 / 3.0, 6.02e23, -5e-324];
        write_json(&path, &json!({ "a": numbers })).unwrap();
        let read: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        for (value, number) in read["a"].as_array().unwrap().iter().zip(numbers) {
            assert_eq!(value.as_f64(), Some(number));
        }
        let bad = json!({ "energy": { "elastic": [1.0, f64::NAN] } });
        match write_json(&path, &bad) {
            Err(OutputError::NotFinite { key }) => assert_eq!(key, "energy.elastic[1]"),
            other => panic!("{other:?}"),
        }
    }
}
