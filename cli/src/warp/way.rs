//! Between which shapes of a result something is carried.

use std::path::Path;

use clap::Args;

use crate::error::CliError;
use crate::results::of_another;

/// Two shapes of a result: which options there are depends on the result.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub struct Way {
    /// Of an average: from the input of this number, from 0, to the average.
    #[arg(long, value_name = "K", help_heading = "From where to where")]
    pub shape: Option<usize>,
    /// Of an average: on to the input of this number.
    #[arg(long, value_name = "J", help_heading = "From where to where")]
    pub to_shape: Option<usize>,
    /// Of a geodesic, or of a path of given shapes: to the shape at this time, from 0 (the first input) to 1 (the
    /// last).
    #[arg(long, value_name = "T", help_heading = "From where to where")]
    pub time: Option<f64>,
    /// Of a path: from the shape at this time [default: 0].
    #[arg(long, value_name = "T", help_heading = "From where to where")]
    pub from_time: Option<f64>,
    /// Of modes: from the average to the shape of these scores in the first modes, in standard
    /// deviations. (Of a result of `synthesize`, the shape is known.)
    #[arg(
        long,
        value_name = "S,S,..",
        value_delimiter = ',',
        allow_hyphen_values = true,
        help_heading = "From where to where"
    )]
    pub scores: Vec<f64>,
}

/// The shapes of one kind of result.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Between {
    /// From an input to the average, or to another input.
    Inputs(usize, Option<usize>),
    /// Between two times of a path.
    Times(f64, f64),
    /// From the average to the shape of these scores.
    Scores(Vec<f64>),
    /// From the average to the shape of the result.
    Synthesized,
}

/// Why shapes that were scored are not carried, and what is done instead.
const OF_SCORES: &str = ", which keeps no deformations; an average with these shapes, too, at a weight of 0 \
    (--weights) has them";

/// The error for a directory that has no deformations.
pub(super) fn unfit(directory: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: directory.into(),
        command: "average`, `geodesic`, `length`, `pca` or `synthesize",
        reason,
    }
}

impl Way {
    /// The shapes of a result of this command.
    ///
    /// # Errors
    /// [`CliError::Option`] for options of other results, and for those that are missing or out of range;
    /// [`CliError::NoResult`] for results without deformations.
    pub(super) fn between(&self, directory: &Path, command: &str) -> Result<Between, CliError> {
        let allowed: &[&str] = match command {
            "average" => &["--shape", "--to-shape"],
            "geodesic" | "length" => &["--time", "--from-time"],
            "pca" => &["--scores"],
            "synthesize" => &[],
            "score" => return Err(unfit(directory, of_another(command) + OF_SCORES)),
            other => return Err(unfit(directory, of_another(other))),
        };
        let given = [
            ("--shape", self.shape.is_some()),
            ("--to-shape", self.to_shape.is_some()),
            ("--time", self.time.is_some()),
            ("--from-time", self.from_time.is_some()),
            ("--scores", !self.scores.is_empty()),
        ];
        let wrong = |(option, given): &(&'static str, bool)| {
            (*given && !allowed.contains(option)).then_some(*option)
        };
        let refused = |option: &'static str, value: String, remedy: &str| CliError::Option {
            option,
            value,
            remedy: remedy.into(),
        };
        let of_result = format!(
            "for '{}', a result of `shapespace {command}`,",
            directory.display()
        );
        if let Some(option) = given.iter().find_map(wrong) {
            let remedy = match allowed {
                [] => "leave it out: the shape is that of the result".to_owned(),
                [first, ..] => format!("give {first}"),
            };
            return Err(refused(option, of_result, &remedy));
        }
        let time = |option: &'static str, time: f64| {
            if (0.0..=1.0).contains(&time) {
                Ok(time)
            } else {
                Err(refused(option, time.to_string(), "give a time from 0 to 1"))
            }
        };
        let missing = |option: &'static str, remedy: &str| {
            refused(option, format!("that is missing {of_result}"), remedy)
        };
        Ok(match command {
            "average" => {
                let remedy = "give the number of an input, from 0";
                let shape = self.shape.ok_or_else(|| missing("--shape", remedy))?;
                Between::Inputs(shape, self.to_shape)
            }
            "geodesic" | "length" => {
                let to = self
                    .time
                    .ok_or_else(|| missing("--time", "give a time from 0 to 1"))?;
                let from = self.from_time.unwrap_or(0.0);
                Between::Times(time("--from-time", from)?, time("--time", to)?)
            }
            "pca" if self.scores.is_empty() => {
                return Err(missing("--scores", "give standard deviations, such as 0,2"));
            }
            "pca" => {
                if let Some(score) = self.scores.iter().find(|score| !score.is_finite()) {
                    let remedy = "give finite numbers";
                    return Err(refused("--scores", format!("with {score}"), remedy));
                }
                Between::Scores(self.scores.clone())
            }
            _ => Between::Synthesized,
        })
    }
}
