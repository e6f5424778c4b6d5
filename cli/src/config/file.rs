//! Configuration files, read key by key, so that a wrong one is named with its line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::DeTable;
use toml::{Table, Value};

use super::{Config, arguments, table};
use crate::error::CliError;
use crate::files::read_text;

/// Keys that are less similar than this are not suggested.
const SIMILARITY: f64 = 0.4;

/// A file and its keys.
pub(super) struct ConfigFile {
    path: PathBuf,
    /// Keys with values and lines.
    entries: Vec<(String, Value, usize)>,
}

impl ConfigFile {
    /// Reads a file, of which every key must be one of the configuration and have a value of its
    /// type.
    ///
    /// # Errors
    /// [`CliError::Config`].
    pub fn read<C: Config>(path: &Path) -> Result<Self, CliError> {
        let wrong = |line, message, remedy| CliError::Config {
            path: path.into(),
            line,
            message,
            remedy,
        };
        let text = read_text(path)
            .map_err(|error| wrong(0, format!("it cannot be read: {error}"), write_one::<C>()))?;
        let line = |span: Option<Range<usize>>| {
            let before = text.get(..span.map_or(0, |span| span.start));
            1 + before.unwrap_or_default().matches('\n').count()
        };
        let syntax = |error: toml::de::Error| {
            let message = error.message().to_owned();
            wrong(line(error.span()), message, write_one::<C>())
        };
        let places = DeTable::parse(&text).map_err(syntax)?;
        let mut values: Table = toml::from_str(&text).map_err(syntax)?;
        let mut entries = Vec::new();
        for key in places.get_ref().keys() {
            let line = line(Some(key.span()));
            let Some((name, value)) = values.remove_entry(&**key.get_ref()) else {
                continue;
            };
            check_entry::<C>(&name, &value)
                .map_err(|(message, remedy)| wrong(line, message, remedy))?;
            entries.push((name, value, line));
        }
        Ok(Self {
            path: path.into(),
            entries,
        })
    }

    /// The configuration that has the values of the file, and the rest from another.
    ///
    /// # Errors
    /// [`CliError::Config`] where they do not go together.
    pub fn over<C: Config>(&self, base: &C) -> Result<C, CliError> {
        let mut all = table(base)?;
        for (key, value, _) in &self.entries {
            all.insert(key.clone(), value.clone());
        }
        C::deserialize(all).map_err(|error| CliError::Config {
            path: self.path.clone(),
            line: 0,
            message: error.message().into(),
            remedy: write_one::<C>(),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The line of a key.
    pub fn line(&self, key: &str) -> Option<usize> {
        let found = self.entries.iter().find(|(name, ..)| name == key);
        found.map(|(_, _, line)| *line)
    }
}

fn write_one<C: Config>() -> String {
    format!(
        "`shapespace config {} > FILE` writes one with all keys",
        C::COMMAND
    )
}

/// Whether a key exists and has a value of its type: otherwise the defect and the remedy.
fn check_entry<C: Config>(key: &str, value: &Value) -> Result<(), (String, String)> {
    let Some(argument) = arguments::<C>().find(|argument| argument.get_id() == key) else {
        let nearest = arguments::<C>()
            .map(|known| known.get_id().to_string())
            .map(|known| (strsim::normalized_damerau_levenshtein(key, &known), known))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(similarity, _)| *similarity >= SIMILARITY);
        let remedy = match nearest {
            Some((_, known)) => format!("did you mean `{known}`?"),
            None => write_one::<C>(),
        };
        return Err((format!("there is no key `{key}`"), remedy));
    };
    let alone = Table::from_iter([(key.to_owned(), value.clone())]);
    let Err(error) = C::deserialize(alone) else {
        return Ok(());
    };
    let meaning = argument.get_help().map(ToString::to_string);
    Err((
        format!("`{key}` cannot be {value}: {}", error.message()),
        meaning.unwrap_or_else(write_one::<C>),
    ))
}
