//! Configurations from keys and values.

use toml::{Table, Value};

use super::{Config, arguments, over_defaults, table};
use crate::error::CliError;

/// Keys that are less similar than this are not suggested.
const SIMILARITY: f64 = 0.4;

/// The configuration of a command that is called with these options, checked; the others have their
/// defaults.
///
/// # Errors
/// [`CliError::Key`] for a wrong key or value, and those of [`Config::check`].
pub(crate) fn resolve<C: Config>(options: &Table) -> Result<C, CliError> {
    let wrong = |(message, remedy)| CliError::Key { message, remedy };
    let mut values = Table::new();
    for (key, value) in options {
        let value = spelled::<C>(key, value);
        check_entry::<C>(key, &value).map_err(wrong)?;
        values.insert(key.clone(), value);
    }
    let together = |base: &C| -> Result<C, CliError> {
        over(base, &values)?.map_err(|message| wrong((message, write_one::<C>())))
    };
    let config = over_defaults(together)?;
    config.check()?;
    Ok(config)
}

/// The keys of a configuration, in order.
pub(crate) fn keys_of<C: Config>() -> Vec<String> {
    let keys = arguments::<C>().map(|argument| argument.get_id().to_string());
    keys.collect()
}

/// A value whose words may be joined as on the command line, `level-sets` for `level_sets`.
fn spelled<C: Config>(key: &str, value: &Value) -> Value {
    let is_word = arguments::<C>()
        .find(|argument| argument.get_id() == key)
        .is_some_and(|argument| !argument.get_possible_values().is_empty());
    match value {
        Value::String(text) if is_word => Value::String(text.replace('-', "_")),
        other => other.clone(),
    }
}

/// The configuration that has these values, and the rest from another, or what does not go together.
pub(super) fn over<'a, C: Config>(
    base: &C,
    entries: impl IntoIterator<Item = (&'a String, &'a Value)>,
) -> Result<Result<C, String>, CliError> {
    let mut all = table(base)?;
    for (key, value) in entries {
        all.insert(key.clone(), value.clone());
    }
    Ok(C::deserialize(all).map_err(|error| error.message().into()))
}

/// The remedy for a wrong key.
pub(super) fn write_one<C: Config>() -> String {
    format!(
        "`shapespace config {} > FILE` writes one with all keys",
        C::COMMAND
    )
}

/// Whether a key exists and has a value of its type: otherwise the defect and the remedy.
pub(super) fn check_entry<C: Config>(key: &str, value: &Value) -> Result<(), (String, String)> {
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
