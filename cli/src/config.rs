//! Configurations: the parameters of a command, from its options and from a file.
//!
//! Each command has one type that holds its inputs, their treatment, and the parameters of its
//! theory. Its fields are the options of the command line and the keys of the file for `--config`;
//! they are written to `result.json`, and to the `config.toml` next to it, which repeats the run.
//! Options override the file, and the file overrides the defaults.
//!
//! `file` reads such files, `options` resolves the keys and values of a calling program, `print`
//! writes files, `headings` groups options in the help.

mod file;
mod headings;
mod options;
mod print;

use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use clap::builder::StyledStr;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::error::CliError;
use file::ConfigFile;
use headings::heading;
use shapespace_input::{Kinds, expand};

pub(crate) use headings::RUN;
pub(crate) use options::{keys_of, resolve};
pub(crate) use print::write_config;
pub use print::{ConfigArgs, run_config};

/// Name of the option for the file.
const FILE: &str = "config";

/// The configuration of a command.
pub trait Config: Args + Clone + Default + Serialize + DeserializeOwned {
    /// The command.
    const COMMAND: &'static str;

    /// The command with what it needs beside its configuration.
    const USAGE: &'static str = Self::COMMAND;

    /// Defaults of keys that are not set, if these depend on other keys.
    fn base(&self) -> Option<Self> {
        None
    }

    /// Checks what can be checked before the inputs are read.
    ///
    /// # Errors
    /// [`CliError`] for a value that is not allowed.
    fn check(&self) -> Result<(), CliError>;

    /// Whether `--align rigid` may be a remedy: it exists, and was not used.
    fn may_align(&self) -> bool {
        false
    }

    /// Whether `--starts` may be a remedy: it agrees with the other options.
    fn may_start(&self) -> bool {
        true
    }

    /// The lists of inputs, in which folders and patterns stand for their files.
    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        Vec::new()
    }

    /// The files and directories that it names.
    fn paths(&mut self) -> Vec<&mut PathBuf>;
}

/// The configuration that a file describes, checked; what it does not say is as usual.
///
/// # Errors
/// As [`Configured::run`].
pub(crate) fn parse<C: Config>(text: &str, path: &Path) -> Result<C, CliError> {
    let file = ConfigFile::parse::<C>(text, path)?;
    let config = over_defaults(|base: &C| file.over(base))?;
    config.check()?;
    Ok(config)
}

/// The configuration over the usual defaults, or over those that it asks for itself ([`Config::base`]).
fn over_defaults<C: Config>(over: impl Fn(&C) -> Result<C, CliError>) -> Result<C, CliError> {
    let config = over(&C::default())?;
    match config.base() {
        Some(base) => over(&base),
        None => Ok(config),
    }
}

/// Options over those of a file, as a command line gives them over `--config`.
///
/// # Errors
/// [`CliError::Config`] for a file with a wrong key or value.
pub(crate) fn over_file<C: Config>(
    file: Option<&Path>,
    options: &Table,
) -> Result<Table, CliError> {
    let file = file.map(ConfigFile::read::<C>).transpose()?;
    let mut all = file.map_or_else(Table::new, ConfigFile::into_table);
    all.extend(options.clone());
    Ok(all)
}

/// The options of a configuration, and `--config`.
#[derive(Clone, Debug)]
pub struct Configured<C> {
    file: Option<PathBuf>,
    options: ArgMatches,
    config: PhantomData<C>,
}

impl<C: Config> Configured<C> {
    /// Resolves the configuration and runs the command with it.
    ///
    /// # Errors
    /// [`CliError::Config`] for a file with a wrong key or value, [`CliError::Parameter`] for an
    /// option that is out of range, and those of the command.
    pub fn run<R>(&self, run: impl FnOnce(C) -> Result<R, CliError>) -> Result<R, CliError> {
        let file = self
            .file
            .as_deref()
            .map(ConfigFile::read::<C>)
            .transpose()?;
        let mut config = over_defaults(|base: &C| self.over(base, file.as_ref()))?;
        let mut lists = config.inputs().into_iter();
        let expanded = lists.try_for_each(|(inputs, kinds)| expand(inputs, kinds));
        let expanded = expanded.map_err(CliError::from);
        let checked = expanded
            .and_then(|()| table(&config))
            .and_then(|_| config.check());
        checked
            .and_then(|()| run(config))
            .map_err(|error| self.located(error, file.as_ref()))
    }

    /// The configuration with the values of the file and the options, and the others from `base`.
    fn over(&self, base: &C, file: Option<&ConfigFile>) -> Result<C, CliError> {
        let mut config = match file {
            Some(file) => file.over(base)?,
            None => base.clone(),
        };
        config
            .update_from_arg_matches(&self.options)
            .unwrap_or_else(|error| error.exit());
        Ok(config)
    }

    /// Adds the line of the file to an error about a key, unless an option sets the key.
    fn located(&self, error: CliError, file: Option<&ConfigFile>) -> CliError {
        let (Some(file), Some(key)) = (file, error.key()) else {
            return error;
        };
        let source = self.options.try_contains_id(&key).ok();
        let set_by = source.and_then(|_| self.options.value_source(&key));
        match file.line(&key) {
            Some(line) if set_by != Some(ValueSource::CommandLine) => CliError::Config {
                path: file.path().into(),
                line,
                message: error.to_string(),
                remedy: error.help().into_owned(),
            },
            _ => error,
        }
    }
}

impl<C: Config> FromArgMatches for Configured<C> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self {
            file: matches.get_one::<PathBuf>(FILE).cloned(),
            options: matches.clone(),
            config: PhantomData,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<C: Config> Args for Configured<C> {
    fn augment_args(command: Command) -> Command {
        let defaults = table(&C::default()).unwrap_or_default();
        let file = Arg::new(FILE)
            .long(FILE)
            .value_name("FILE")
            .value_parser(value_parser!(PathBuf))
            .help(format!(
                "Read what other options do not say from a file, such as `shapespace config {}` \
                 prints, or the config.toml of a result",
                C::COMMAND
            ));
        command
            .args(arguments::<C>().map(|argument| option(argument, &defaults)))
            .arg(file)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// The arguments of a configuration, in order; none is required, nor has a default.
fn arguments<C: Config>() -> impl Iterator<Item = Arg> {
    let command = C::augment_args_for_update(Command::new(C::COMMAND));
    let arguments: Vec<Arg> = command.get_arguments().cloned().collect();
    arguments.into_iter()
}

/// An argument as an option of a command, with the default appended to its help, and under its heading.
fn option(mut argument: Arg, defaults: &Table) -> Arg {
    if let Some(default) = defaults.get(argument.get_id().as_str()).and_then(plain) {
        let with_default = |text: &StyledStr| format!("{text} [default: {default}]");
        let (short, long) = (
            argument.get_help().map(with_default),
            argument.get_long_help().map(with_default),
        );
        if let Some(short) = short {
            argument = argument.help(short);
        }
        if let Some(long) = long {
            argument = argument.long_help(long);
        }
    }
    if !argument.is_positional() && argument.get_help_heading().is_none() {
        let own = heading(argument.get_id().as_str());
        argument = argument.help_heading(own);
    }
    if matches!(argument.get_action(), ArgAction::SetTrue) {
        return argument
            .action(ArgAction::Set)
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value("true")
            .value_name("true|false")
            .hide_possible_values(true);
    }
    if argument.is_positional() {
        argument
    } else {
        argument.allow_negative_numbers(true)
    }
}

/// A default as text; empty lists and names, and false, have none.
fn plain(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.replace('_', "-")).filter(|text| !text.is_empty()),
        Value::Boolean(false) | Value::Array(_) => None,
        other => Some(other.to_string()),
    }
}

/// The keys and values of a configuration.
fn table<C: Serialize>(config: &C) -> Result<Table, CliError> {
    Table::try_from(config).map_err(|error| {
        let (option, value, remedy) = if let Some(key) = too_large(config) {
            let value = format!("{} after --{}", i64::MAX, key.replace('_', "-"));
            ("a number above", value, "give a smaller number".into())
        } else {
            let remedy = format!("give files names that can be written: {error}");
            ("a name", "of a file".into(), remedy)
        };
        CliError::Option {
            option,
            value,
            remedy,
        }
    })
}

/// The key of a number that a configuration file cannot hold.
fn too_large<C: Serialize>(config: &C) -> Option<String> {
    let value = serde_json::to_value(config).ok()?;
    let is_large = |value: &serde_json::Value| value.as_u64().is_some_and(|n| n > i64::MAX as u64);
    let mut entries = value.as_object()?.iter();
    let (key, _) = entries.find(|(_, value)| is_large(value))?;
    Some(key.clone())
}

/// The absolute path, which is valid from every folder.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

/// Rejects a value that is not allowed.
///
/// # Errors
/// [`CliError::Parameter`].
pub(crate) fn allow(
    allowed: bool,
    name: &'static str,
    value: &impl ToString,
    expected: &str,
) -> Result<(), CliError> {
    if allowed {
        return Ok(());
    }
    Err(CliError::Parameter {
        name,
        value: value.to_string(),
        expected: expected.into(),
    })
}
