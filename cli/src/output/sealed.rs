//! JSON files that state their own checksum.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::OutputError;
use super::json::{json, text_of};

/// The key of the checksum, that of the text with zeros in its place.
const OWN_SUM: &str = "record_sha256";
/// As many digits as a checksum has.
const ZERO: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// The SHA-256 of bytes, in hexadecimal digits.
pub(crate) fn sum_of(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}

/// A value as in [`write_json`](super::write_json), with the checksum of the text if it is an object.
///
/// # Errors
/// [`OutputError::NotFinite`] with the place of the first null.
pub(crate) fn sealed_text(path: &Path, value: &impl Serialize) -> Result<String, OutputError> {
    let mut value = json(path, value)?;
    if let Value::Object(entries) = &mut value {
        entries.insert(OWN_SUM.into(), ZERO.into());
    }
    let text = text_of(path, &value)?;
    let sum = sum_of(text.as_bytes());
    Ok(text.replacen(&entry(ZERO), &entry(&sum), 1))
}

/// Whether a text is the one that was written; unknown for those without a checksum of their own.
pub(crate) fn is_as_written(text: &str) -> Option<bool> {
    is_sealed(text, &serde_json::from_str(text).ok()?)
}

fn is_sealed(text: &str, value: &Value) -> Option<bool> {
    let stated = value.get(OWN_SUM)?;
    let is_its_sum = |stated: &str| {
        let text = text.replacen(&entry(stated), &entry(ZERO), 1);
        sum_of(text.as_bytes()) == stated
    };
    Some(stated.as_str().is_some_and(is_its_sum))
}

/// As it stands in a text, and cannot stand in one of its strings.
fn entry(sum: &str) -> String {
    format!("\"{OWN_SUM}\": \"{sum}\"")
}

/// The value of a text; none where it is another value, or no longer what was written.
pub(crate) fn unsealed<T: DeserializeOwned>(text: &str) -> Option<T> {
    let mut value: Value = serde_json::from_str(text).ok()?;
    if is_sealed(text, &value) == Some(false) {
        return None;
    }
    if let Value::Object(entries) = &mut value {
        entries.remove(OWN_SUM);
    }
    serde_json::from_value(value).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn texts_that_were_changed_are_told() {
        let value = BTreeMap::from([("a".to_owned(), 0.1 + 0.2), (ZERO.to_owned(), 0.0)]);
        let text = sealed_text(Path::new("x"), &value).unwrap();
        assert_eq!(is_as_written(&text), Some(true));
        assert_eq!(unsealed(&text), Some(value));
        let changed = [
            text.replace("0.30000000000000004", "0.3"),
            text.replace('\n', ""),
            text.replacen(char::is_numeric, "x", 1),
        ];
        for text in changed {
            assert_eq!(is_as_written(&text), Some(false), "{text}");
            assert_eq!(unsealed::<Value>(&text), None);
        }
        let number = text
            .replace("sha256\": \"", "sha256\": [\"")
            .replace("\"\n}", "\"]\n}");
        assert_eq!(is_as_written(&number), Some(false), "{number}");
        // Without a checksum nothing is known.
        assert_eq!(is_as_written("{\"a\": 1}"), None);
        assert_eq!(unsealed("[1.5]"), Some([1.5]));
        assert_eq!(
            sealed_text(Path::new("x"), &[1.5]).unwrap(),
            "[\n  1.5\n]\n"
        );
        assert_eq!(unsealed::<f64>("{"), None);
    }
}
