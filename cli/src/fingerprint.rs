//! Fingerprints of unfinished results.
//!
//! A result that is computed over several runs is stored in `DIR.partial` until it is complete. The
//! folder holds `work.json`, which states what the work depends on: the version of the program, the
//! parameters, and the contents of all inputs, as hashes of the values read. A run resumes from
//! such a folder if these agree, and rejects it otherwise.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::CliError;
use crate::integrity::Sums;
use crate::output::{DESCRIPTION, OutputError, WorkDir, unsealed};
use shapespace_input::Image;
use shapespace_input::files::read_text;

/// Everything that a result depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Fingerprint {
    version: String,
    parameters: Value,
    /// A hash for each input.
    inputs: Vec<String>,
}

impl Fingerprint {
    /// Of a configuration and of hashes of inputs, which may have other names.
    pub fn new(config: &impl Serialize, inputs: Vec<String>) -> Self {
        // Keys that are not set are left out.
        let table = toml::Table::try_from(config).unwrap_or_default();
        let parameters = serde_json::to_value(table).unwrap_or_default();
        let mut fingerprint = Self {
            version: env!("CARGO_PKG_VERSION").into(),
            parameters,
            inputs,
        };
        fingerprint.leave_out("inputs");
        fingerprint
    }

    /// Of a configuration and of result directories, whose paths do not matter.
    ///
    /// # Errors
    /// [`CliError::Damaged`] for a record that cannot be read.
    pub fn of_results(config: &impl Serialize, directories: &[&Path]) -> Result<Self, CliError> {
        let digest = |directory: &&Path| {
            // Verified where they are read.
            let sums = Sums::of(directory, true)?;
            Ok(sums.digest().unwrap_or_else(|| "no checksums".into()))
        };
        let inputs: Result<_, CliError> = directories.iter().map(digest).collect();
        Ok(Self::new(config, inputs?))
    }

    /// Depends on more inputs.
    pub fn and(mut self, inputs: impl Iterator<Item = String>) -> Self {
        self.inputs.extend(inputs);
        self
    }

    /// Does not depend on a key of the configuration.
    pub fn leave_out(&mut self, key: &str) {
        if let Some(all) = self.parameters.as_object_mut() {
            all.remove(key);
        }
    }

    /// Creates the folder of an unfinished result, or resumes one with the same parameters and
    /// inputs.
    ///
    /// # Errors
    /// [`CliError::OtherWork`] with what differs; as [`WorkDir::open`]; and
    /// [`OutputError::Exists`] for a folder of this name that is something else.
    pub fn work_dir(&self, target: &Path) -> Result<WorkDir, CliError> {
        let work = WorkDir::open(target)?;
        match work.get::<Self>(DESCRIPTION) {
            Some(found) => {
                let differences = self.differences(&found);
                if !differences.is_empty() {
                    return Err(CliError::OtherWork {
                        path: work.path().into(),
                        differences: differences.join("; "),
                    });
                }
            }
            None if work.file(DESCRIPTION).is_file() => {
                return Err(CliError::OtherWork {
                    path: work.path().into(),
                    differences: format!("its {DESCRIPTION} is damaged"),
                });
            }
            None if !work.is_new() => {
                let path = work.path().into();
                return Err(OutputError::Exists { path }.into());
            }
            None => work.put(DESCRIPTION, self)?,
        }
        Ok(work)
    }

    /// Checks that a directory is of the same inputs and parameters.
    ///
    /// # Errors
    /// [`CliError::OtherPaths`] with what differs.
    pub fn check(&self, directory: &Path) -> Result<(), CliError> {
        let text = read_text(&directory.join(DESCRIPTION)).ok();
        let found = text.and_then(|text| unsealed::<Self>(&text));
        let differences = found.map_or_else(
            || vec![format!("it has no {DESCRIPTION} of this program")],
            |found| self.differences(&found),
        );
        if differences.is_empty() {
            return Ok(());
        }
        Err(CliError::OtherPaths {
            path: directory.into(),
            differences: differences.join("; "),
        })
    }

    /// The differences, as text.
    fn differences(&self, found: &Self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.version != found.version {
            lines.push(format!(
                "version {} there, {} here",
                found.version, self.version
            ));
        }
        if lines.is_empty() && few_in_common(&found.parameters, &self.parameters) {
            return vec!["it is one of another command".into()];
        }
        differences("", &found.parameters, &self.parameters, &mut lines);
        let (there, here) = (found.inputs.len(), self.inputs.len());
        if there != here {
            lines.push(format!("{there} inputs there, {here} here"));
        }
        let both = found.inputs.iter().zip(&self.inputs).enumerate();
        let changed = both.filter(|(_, (there, here))| there != here);
        lines.extend(changed.map(|(i, _)| format!("input {} is another shape", i + 1)));
        lines
    }
}

/// Whether less than half of the parameters have names that occur in both: those that are not set are left
/// out, so that commands are told apart by most of them.
fn few_in_common(there: &Value, here: &Value) -> bool {
    let (Some(there), Some(here)) = (there.as_object(), here.as_object()) else {
        return false;
    };
    let common = there.keys().filter(|key| here.contains_key(*key)).count();
    2 * common < there.len().max(here.len())
}

/// Compares two parameters of one name, and all those inside.
fn differences(name: &str, there: &Value, here: &Value, lines: &mut Vec<String>) {
    match (there, here) {
        (Value::Object(old), Value::Object(new)) => {
            let mut keys: Vec<&String> = old.keys().chain(new.keys()).collect();
            keys.sort();
            keys.dedup();
            for key in keys {
                let inner = if name.is_empty() {
                    key.clone()
                } else {
                    format!("{name}.{key}")
                };
                let of = |values: &serde_json::Map<String, Value>| {
                    values.get(key).cloned().unwrap_or_default()
                };
                differences(&inner, &of(old), &of(new), lines);
            }
        }
        _ if there == here => {}
        _ => lines.push(format!(
            "{name} {} there, {} here",
            plain(there),
            plain(here)
        )),
    }
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => "unset".into(),
        Value::String(text) => text.clone(),
        Value::Object(_) => "set".into(),
        other => other.to_string(),
    }
}

/// FNV-1a of all values of a mask: sufficient against mistakes, not against malice.
pub(crate) fn hash<const D: usize>(image: &Image<D>) -> String {
    let mut state: u64 = 0xcbf2_9ce4_8422_2325;
    let mut take = |number: u64| {
        for byte in number.to_le_bytes() {
            state = (state ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for k in 0..D {
        take(image.size[k] as u64);
        take(image.spacing[k].to_bits());
        take(image.origin[k].to_bits());
    }
    for number in image.direction.iter().flatten().flatten() {
        take(number.to_bits());
    }
    take(u64::from(image.plain_array));
    for value in image.values.iter() {
        take(value.to_bits());
    }
    if let Some(outline) = &image.outline {
        for number in outline.points().iter().flatten() {
            take(number.to_bits());
        }
        for &corner in outline.simplices().iter().flatten() {
            take(u64::from(corner));
        }
    }
    format!("{state:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn fingerprint(parameters: Value, inputs: &[&str]) -> Fingerprint {
        Fingerprint {
            version: "1".into(),
            parameters,
            inputs: inputs.iter().map(|i| (*i).into()).collect(),
        }
    }

    #[test]
    fn what_differs_is_named() {
        let old = fingerprint(json!({"grid": 33, "law": "logdet"}), &["a", "b"]);
        assert!(old.differences(&old).is_empty());
        let new = fingerprint(
            json!({"grid": 65, "law": "logdet", "retry": {"form": "x"}}),
            &["a", "c"],
        );
        assert_eq!(
            new.differences(&old),
            [
                "grid 33 there, 65 here",
                "retry unset there, set here",
                "input 2 is another shape"
            ]
        );
        let other = fingerprint(json!({"grid": 33, "modes": 3, "metric": "x"}), &["a"]);
        assert_eq!(other.differences(&old), ["it is one of another command"]);
        let more = fingerprint(old.parameters.clone(), &["a", "b", "c"]);
        assert_eq!(more.differences(&old), ["2 inputs there, 3 here"]);
    }

    #[test]
    fn masks_that_differ_have_another_hash() {
        let image = |value: f64| Image::<2> {
            values: vec![0.0, value, 1.0, 0.0].into(),
            size: [2, 2],
            spacing: [1.0; 2],
            origin: [0.0; 2],
            path: "a.png".into(),
            affine: None,
            direction: None,
            plain_array: false,
            outline: None,
            remark: None,
        };
        let one = hash(&image(1.0));
        let renamed = Image {
            path: "b.png".into(),
            ..image(1.0)
        };
        let wider = Image {
            spacing: [1.0, 2.0],
            ..image(1.0)
        };
        assert_eq!(one, hash(&renamed));
        assert_ne!(one, hash(&image(0.5)));
        assert_ne!(one, hash(&wider));
    }

    #[test]
    fn a_folder_of_other_things_is_left_alone() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let other = place.path().join("out.partial");
        std::fs::create_dir(&other).unwrap();
        std::fs::write(other.join("mine.txt"), "x").unwrap();
        let print = fingerprint(json!({}), &[]);
        assert!(matches!(
            print.work_dir(&target),
            Err(CliError::Output(OutputError::Exists { .. }))
        ));
        std::fs::remove_file(other.join("mine.txt")).unwrap();
        drop(print.work_dir(&target).unwrap());
        let changed = fingerprint(json!({"grid": 9}), &[]);
        assert!(matches!(
            changed.work_dir(&target),
            Err(CliError::OtherWork { .. })
        ));
    }
}
