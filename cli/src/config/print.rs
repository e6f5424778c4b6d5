//! Configurations, written as TOML.

use std::fs;
use std::path::Path;

use clap::{Arg, Args, ValueEnum};
use toml::Table;

use super::{Config, absolute, arguments, table};
use crate::average::AverageConfig;
use crate::calculus::{ExtendConfig, TransportConfig};
use crate::compare::CompareConfig;
use crate::distances::DistancesConfig;
use crate::error::{CliError, Exit};
use crate::figure::FigureConfig;
use crate::geodesic::GeodesicConfig;
use crate::length::LengthConfig;
use crate::metric::MetricConfig;
use crate::output::OutputError;
use crate::pca::{PcaConfig, ScoreConfig, SynthesizeConfig};
use crate::print::print;
use crate::segment::SegmentConfig;

/// Options of `shapespace config`.
#[derive(Clone, Debug, Args)]
pub struct ConfigArgs {
    /// Command whose configuration is printed.
    #[arg(value_enum)]
    command: Configurable,
}

/// Commands that read a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Configurable {
    /// Averages of masks or grey images.
    Average,
    /// Geodesics between two shapes.
    Geodesic,
    /// Lengths of given paths.
    Length,
    /// The metric of a variation of a shape.
    Metric,
    /// Distances between all pairs of shapes.
    Distances,
    /// Modes of variation.
    Pca,
    /// Shapes from scores.
    Synthesize,
    /// Scores of shapes.
    Score,
    /// Comparison of groups.
    Compare,
    /// Continuation of geodesics.
    Extend,
    /// Parallel transport of variations along geodesics.
    Transport,
    /// Segmentation of grey images.
    Segment,
    /// Figures and tables.
    Figure,
}

/// Prints the default configuration of a command, with comments.
///
/// # Errors
/// [`CliError::Output`] where standard output cannot be written.
pub fn run_config(args: &ConfigArgs) -> Result<Exit, CliError> {
    let text = match args.command {
        Configurable::Average => usual::<AverageConfig>(),
        Configurable::Geodesic => usual::<GeodesicConfig>(),
        Configurable::Length => usual::<LengthConfig>(),
        Configurable::Metric => usual::<MetricConfig>(),
        Configurable::Distances => usual::<DistancesConfig>(),
        Configurable::Pca => usual::<PcaConfig>(),
        Configurable::Synthesize => usual::<SynthesizeConfig>(),
        Configurable::Score => usual::<ScoreConfig>(),
        Configurable::Compare => usual::<CompareConfig>(),
        Configurable::Extend => usual::<ExtendConfig>(),
        Configurable::Transport => usual::<TransportConfig>(),
        Configurable::Segment => usual::<SegmentConfig>(),
        Configurable::Figure => usual::<FigureConfig>(),
    };
    print(&text?)?;
    Ok(Exit::Success)
}

/// Maximum number of columns of a comment.
const COLUMNS: usize = 98;

/// The default configuration with all keys, each after a comment that explains it; keys without a
/// value are commented out.
fn usual<C: Config>() -> Result<String, CliError> {
    let values = table(&C::default())?;
    let entries = arguments::<C>().map(|argument| entry(&argument, &values));
    Ok(header::<C>() + &entries.collect::<String>())
}

fn header<C: Config>() -> String {
    format!("# shapespace {} --config THIS_FILE -o NEW\n", C::USAGE)
}

/// The lines of a key.
fn entry(argument: &Arg, values: &Table) -> String {
    let key = argument.get_id().as_str();
    let meaning = argument.get_long_help().or(argument.get_help());
    let mut text = meaning.map(ToString::to_string).unwrap_or_default();
    let names: Vec<String> = argument
        .get_possible_values()
        .iter()
        .map(|value| value.get_name().replace('-', "_"))
        .collect();
    if !names.is_empty() {
        text = format!("{} ({})", text.trim_end_matches('.'), names.join(", "));
    }
    let comment: String = text.lines().flat_map(wrapped).collect();
    let names = argument.get_value_names().unwrap_or_default();
    let value = values.get(key).map_or_else(
        || {
            format!(
                "# {key} = {}",
                names.first().map_or("", |name| name.as_str())
            )
        },
        |value| format!("{key} = {value}"),
    );
    format!("\n{comment}{value}\n")
}

/// Wraps a line of text into comment lines.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::from("#")];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if lines[last].len() + 1 + word.len() > COLUMNS && lines[last].len() > 1 {
            lines.push(format!("# {word}"));
        } else {
            lines[last].push(' ');
            lines[last].push_str(word);
        }
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

/// Writes a configuration that repeats the command from any folder.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_config<C: Config>(path: &Path, config: &C) -> Result<(), CliError> {
    let mut config = config.clone();
    for name in config.paths() {
        *name = absolute(name);
    }
    let text = toml::to_string(&config)
        .map_err(|error| OutputError::at(path)(std::io::Error::other(error)))?;
    Ok(fs::write(path, header::<C>() + "\n" + &text).map_err(OutputError::at(path))?)
}
