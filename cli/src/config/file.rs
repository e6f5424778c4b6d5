//! Configuration files, read key by key, so that a wrong one is named with its line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::DeTable;
use toml::{Table, Value};

use super::Config;
use super::options::{check_entry, over, write_one};
use crate::error::CliError;
use shapespace_input::files::read_text;

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
        let text = read_text(path).map_err(|error| CliError::Config {
            path: path.into(),
            line: 0,
            message: format!("it cannot be read: {error}"),
            remedy: write_one::<C>(),
        })?;
        Self::parse::<C>(&text, path)
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse<C: Config>(text: &str, path: &Path) -> Result<Self, CliError> {
        let wrong = |line, message, remedy| CliError::Config {
            path: path.into(),
            line,
            message,
            remedy,
        };
        let line = |span: Option<Range<usize>>| {
            let before = text.get(..span.map_or(0, |span| span.start));
            1 + before.unwrap_or_default().matches('\n').count()
        };
        let syntax = |error: toml::de::Error| {
            let message = error.message().to_owned();
            wrong(line(error.span()), message, write_one::<C>())
        };
        let places = DeTable::parse(text).map_err(syntax)?;
        let mut values: Table = toml::from_str(text).map_err(syntax)?;
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
        let entries = self.entries.iter().map(|(key, value, _)| (key, value));
        over(base, entries)?.map_err(|message| CliError::Config {
            path: self.path.clone(),
            line: 0,
            message,
            remedy: write_one::<C>(),
        })
    }

    /// The keys and values.
    pub fn into_table(self) -> Table {
        let entries = self.entries.into_iter();
        entries.map(|(key, value, _)| (key, value)).collect()
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
