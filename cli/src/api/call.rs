//! Runs a command for another program.

use std::path::PathBuf;
use std::sync::PoisonError;

use toml::Table;

use super::computed::{Computed, Held};
use crate::average::{Average, AverageConfig, AverageRun, JointAverage, Sweep};
use crate::calculus::{ExtendConfig, TransportConfig};
use crate::compare::CompareConfig;
use crate::config::{Config, allow, keys_of, over_file, resolve};
use crate::distances::{DistanceStudy, DistancesConfig};
use crate::error::CliError;
use crate::geodesic::GeodesicConfig;
use crate::interrupt::Interrupt;
use crate::length::LengthConfig;
use crate::metric::MetricConfig;
use crate::options::{CheckpointOption, RunOptions};
use crate::output::{OutputError, ResultDir};
use crate::pca::{PcaConfig, ScoreConfig, SynthesizeConfig};
use crate::pool::in_pool;
use crate::progress::{Listener, Progress};
use crate::segment::SegmentConfig;
use crate::session::{Command, Session};
use shapespace_input::Sources;
use shapespace_input::bytes::bytes;
use shapespace_input::dimension::Dim;
use shapespace_input::memory::set_limit;

/// The commands that can be called.
pub const COMMANDS: [&str; 12] = [
    "average",
    "geodesic",
    "length",
    "metric",
    "distances",
    "pca",
    "score",
    "synthesize",
    "compare",
    "segment",
    "extend",
    "transport",
];

/// Those of them that store checkpoints.
const LONG: [&str; 10] = [
    "average",
    "geodesic",
    "length",
    "metric",
    "pca",
    "score",
    "synthesize",
    "segment",
    "extend",
    "transport",
];

/// Where a computation stores checkpoints, and how often. The same call resumes from them after a sudden
/// end; they are removed when the result is complete.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    /// They are stored in the folder of this name with the ending `.partial`.
    pub folder: PathBuf,
    /// Time between two of them.
    pub minutes: f64,
}

/// Asks a computation to end, from any thread. A computation that is asked to end before it has a
/// result fails; one that has a result ends with the state that it has reached.
#[derive(Clone, Debug)]
pub struct Stop(Interrupt);

impl Default for Stop {
    fn default() -> Self {
        Self(Interrupt::of_call())
    }
}

impl Stop {
    /// Asks it to end.
    pub fn ask(&self) {
        self.0.ask();
    }

    /// Whether it was asked to end.
    pub fn is_asked(&self) -> bool {
        self.0.asked()
    }
}

/// The call of a command.
#[derive(Clone, Default)]
pub struct Call {
    /// The options and the inputs, by the keys of the command's configuration.
    pub options: Table,
    /// A file with options and inputs that are not among these, as `--config`.
    pub config: Option<PathBuf>,
    /// Arrays by their names.
    pub sources: Sources,
    /// Number of threads, all cores without. The result does not depend on it.
    pub threads: Option<u32>,
    /// Memory limit in bytes, as `--memory` of an average.
    pub memory: Option<u64>,
    /// Pairs that distances compute at the same time, as `--at-once`.
    pub at_once: Option<u32>,
    /// Whether result directories are used without verification, as `--trust`.
    pub trust: bool,
    /// Checkpoints of commands that have `--checkpoint`; none without.
    pub checkpoints: Option<Checkpoints>,
    /// Hears of the work.
    pub listener: Option<Listener>,
    /// Ends the work.
    pub stop: Stop,
}

impl Call {
    /// Runs one of the [`COMMANDS`].
    ///
    /// # Errors
    /// [`CliError`], as the command line; [`CliError::Key`] for a command or an option that does not
    /// exist.
    pub fn run(&self, command: &str) -> Result<Computed, CliError> {
        let threads = self.threads.unwrap_or(1);
        allow(
            (1..=4096).contains(&threads),
            "threads",
            &threads,
            "1 to 4096",
        )?;
        if let Some(checkpoints) = &self.checkpoints {
            let minutes = checkpoints.minutes;
            let positive = minutes > 0.0 && minutes.is_finite();
            let name = "checkpoint";
            allow(positive, name, &minutes, "a positive number of minutes")?;
            if !LONG.contains(&command) {
                return Err(CliError::Key {
                    message: format!("`{command}` stores no checkpoints"),
                    remedy: format!("these commands do: {}", LONG.join(", ")),
                });
            }
        }
        // A process has a single memory, hence a single limit: that of the last call.
        set_limit(self.memory);
        match command {
            "average" => self.average(),
            "geodesic" => self.configured::<GeodesicConfig>(),
            "length" => self.configured::<LengthConfig>(),
            "metric" => self.configured::<MetricConfig>(),
            "distances" => {
                let config: DistancesConfig = self.configuration()?;
                self.hold(DistanceStudy {
                    config,
                    at_once: self.at_once,
                    shard: None,
                    merge: Vec::new(),
                })
            }
            "pca" => self.configured::<PcaConfig>(),
            "score" => self.configured::<ScoreConfig>(),
            "synthesize" => self.configured::<SynthesizeConfig>(),
            "compare" => self.configured::<CompareConfig>(),
            "segment" => self.configured::<SegmentConfig>(),
            "extend" => self.configured::<ExtendConfig>(),
            "transport" => self.configured::<TransportConfig>(),
            other => Err(no_command(other)),
        }
    }

    fn average(&self) -> Result<Computed, CliError> {
        let config: AverageConfig = self.configuration()?;
        let run = AverageRun {
            common: RunOptions {
                output: std::env::temp_dir().join("shapespace"),
                threads: self.threads,
                allow_doubtful: false,
                trust: self.trust,
                quiet: true,
                log: None,
            },
            checkpoint: self.checkpoint(),
            memory: self.memory,
        };
        if config.joint {
            self.hold(JointAverage { config, run })
        } else if let Some(side) = config.sweep {
            self.hold(Sweep { config, side })
        } else {
            self.hold(Average {
                config,
                run,
                images: None,
            })
        }
    }

    fn configured<C: Config + Command + Send + 'static>(&self) -> Result<Computed, CliError> {
        self.hold(self.configuration::<C>()?)
    }

    /// The configuration by the options and the file.
    fn configuration<C: Config>(&self) -> Result<C, CliError> {
        resolve(&over_file::<C>(self.config.as_deref(), &self.options)?)
    }

    fn checkpoint(&self) -> CheckpointOption {
        let minutes = self.checkpoints.as_ref().map(|given| given.minutes);
        minutes.map_or(CheckpointOption::NONE, |minutes| CheckpointOption {
            minutes,
        })
    }

    /// Plans and computes as [`crate::session::run`], and keeps the result.
    fn hold<C: Command + Send + 'static>(&self, command: C) -> Result<Computed, CliError> {
        // For unfinished work, which distances keep in files.
        let place = tempfile::tempdir().map_err(OutputError::at(&std::env::temp_dir()))?;
        let output = match &self.checkpoints {
            Some(checkpoints) => checkpoints.folder.clone(),
            None => place.path().join("result"),
        };
        let computed = in_pool(self.threads, || {
            let session = Session {
                progress: Progress::told(self.listener.clone()),
                interrupt: self.stop.0.clone(),
                sources: self.sources.clone(),
                trust: self.trust,
                checkpoint: self.checkpoint(),
                ..Session::alone(&output)
            };
            let computed = match command.plan(&session)? {
                Dim::D2(plan) => held(command, plan, &session),
                Dim::D3(plan) => held(command, plan, &session),
            }?;
            let obsolete = session.obsolete.into_inner();
            let obsolete = obsolete.unwrap_or_else(PoisonError::into_inner);
            // Nobody has the result of a call that was asked to end: the next one resumes.
            match obsolete {
                Some(work) if !computed.interrupted() => work.remove()?,
                _ => {}
            }
            Ok(computed)
        })?;
        Ok(computed.with_place(place))
    }
}

/// The options of a command, by their keys.
///
/// # Errors
/// [`CliError::Key`] for a command that does not exist.
pub fn keys(command: &str) -> Result<Vec<String>, CliError> {
    Ok(match command {
        "average" => keys_of::<AverageConfig>(),
        "geodesic" => keys_of::<GeodesicConfig>(),
        "length" => keys_of::<LengthConfig>(),
        "metric" => keys_of::<MetricConfig>(),
        "distances" => keys_of::<DistancesConfig>(),
        "pca" => keys_of::<PcaConfig>(),
        "score" => keys_of::<ScoreConfig>(),
        "synthesize" => keys_of::<SynthesizeConfig>(),
        "compare" => keys_of::<CompareConfig>(),
        "segment" => keys_of::<SegmentConfig>(),
        "extend" => keys_of::<ExtendConfig>(),
        "transport" => keys_of::<TransportConfig>(),
        other => return Err(no_command(other)),
    })
}

/// A number of bytes such as `4GiB`, as the command line reads it.
///
/// # Errors
/// [`CliError::Parameter`].
pub fn memory(text: &str) -> Result<u64, CliError> {
    bytes(text).map_err(|expected| CliError::Parameter {
        name: "memory",
        value: text.into(),
        expected,
    })
}

fn no_command(name: &str) -> CliError {
    CliError::Key {
        message: format!("there is no command `{name}`"),
        remedy: format!("the commands are {}", COMMANDS.join(", ")),
    }
}

fn held<C: Command + Send + 'static, const D: usize>(
    command: C,
    plan: C::Plan<D>,
    session: &Session<'_>,
) -> Result<Computed, CliError> {
    let mut outcome = command.compute(plan, session)?;
    let work = C::work(&mut outcome);
    let directory = ResultDir::in_memory();
    let summary = command.write(&outcome, session, &directory)?;
    let held = Held::<C, D> { command, outcome };
    Ok(Computed::new(held, work, directory.into_kept(), &summary))
}
