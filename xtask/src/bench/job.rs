//! Jobs of this program in child processes: one task with its own memory and processor time, which
//! prints one line of JSON.

use std::path::PathBuf;
use std::process::Command;

use clap::Args;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::averages::AverageJob;
use super::case::Case;
use super::descents::DescentJob;
use super::measure::use_threads;
use super::paths::PathJob;
use super::score::ScoreJob;
use crate::outcome::Outcome;

/// A job.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Job {
    /// Runs a kernel a number of times, for counting its instructions.
    Repeat {
        /// The kernel.
        case: String,
        /// Number of runs.
        times: usize,
    },
    /// Computes an average.
    Average(Box<AverageJob>),
    /// Computes a geodesic.
    Path(Box<PathJob>),
    /// Runs the gradient descent to given energies.
    Descent(DescentJob),
    /// Scores a state.
    Score(ScoreJob),
}

/// The hidden task of child processes.
#[derive(Args)]
pub struct Arguments {
    /// The job, as JSON.
    job: String,
}

/// Runs the job and prints its result.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    match serde_json::from_str(&arguments.job)? {
        Job::Repeat { case, times } => {
            use_threads(1)?;
            let mut kernel = case.parse::<Case>()?.prepare()?;
            for _ in 0..times {
                (kernel.run)();
            }
            print(&times)
        }
        Job::Average(job) => print(&job.run()?),
        Job::Path(job) => print(&job.run()?),
        Job::Descent(job) => print(&job.run()?),
        Job::Score(job) => print(&job.run()?),
    }
}

fn print(result: &impl Serialize) -> Outcome<()> {
    println!("{}", serde_json::to_string(result)?);
    Ok(())
}

impl Job {
    /// The program of this process.
    pub fn program() -> Outcome<PathBuf> {
        Ok(std::env::current_exe()?)
    }

    /// Arguments of a child process for this job.
    pub fn arguments(&self) -> Outcome<[String; 3]> {
        let job = serde_json::to_string(self)?;
        Ok(["bench".into(), "job".into(), job])
    }

    /// Runs the job in a child process and returns its output.
    pub fn in_child<R: DeserializeOwned>(&self) -> Outcome<R> {
        let output = Command::new(Self::program()?)
            .args(self.arguments()?)
            .stderr(std::process::Stdio::inherit())
            .output()?;
        if !output.status.success() {
            return Err(format!("a child ended with {}: {self:?}", output.status).into());
        }
        Ok(serde_json::from_slice(&output.stdout)?)
    }
}
