//! The common part of every `result.json`.

use std::time::Instant;

use fe_grid::minimise::Status;
use fe_grid::{Certificate, Grid};
use levelset::Verdict;
use serde::{Deserialize, Serialize, Serializer};

use crate::config::{Config, write_config};
use crate::doubts::DoubtRecord;
use crate::error::CliError;
use crate::numbers::rounded;
use crate::output::ResultDir;
pub(crate) use crate::output::{CANCELLED, RESULT};
use crate::shapes::{InputRecord, WorldFrame, WorldRecord, common_scale};
use shapespace_input::memory;

/// The page that shows it, if there is one.
pub(crate) const PAGE: &str = "report.html";

/// The contents of a `result.json`. Missing values are left out; there are no nulls.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound(
    serialize = "C: Serialize, T: Serialize",
    deserialize = "C: Deserialize<'de>, T: Deserialize<'de>"
))]
pub(crate) struct Record<C, T, const D: usize> {
    pub version: String,
    /// The command whose result it is.
    #[serde(default)]
    pub command: String,
    /// Status of the computation, in one word.
    pub status: String,
    #[serde(default)]
    pub verdict: Verdict,
    #[serde(default)]
    pub doubts: Vec<DoubtRecord>,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<usize>,
    /// Distance of neighbouring nodes, in units of length of the computation: the side of the unit box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// The same in length units of the inputs, which are millimetres in the world, if they have a common
    /// one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_input_units: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub input: Vec<InputRecord<D>>,
    /// The nodes in the world, where the inputs have a place there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldRecord>,
    /// The configuration with all defaults resolved.
    #[serde(serialize_with = "without_nulls")]
    pub parameters: C,
    /// The result.
    #[serde(flatten)]
    pub body: T,
    /// Seconds from the start to the writing of this record.
    pub seconds: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

impl<C: Config, T: Serialize, const D: usize> Record<C, T, D> {
    /// The record of a result on a grid, if it has one, with the doubts about it, computed since
    /// `start`.
    pub fn new(
        status: impl Into<String>,
        grid: Option<&Grid<D>>,
        config: &C,
        body: T,
        doubts: Vec<DoubtRecord>,
        start: Instant,
    ) -> Self {
        let of_options = |mut doubt: DoubtRecord| {
            if !config.may_align() {
                doubt = doubt.of_aligned();
            }
            if !config.may_start() {
                doubt = doubt.of_one_start();
            }
            doubt
        };
        let doubts = doubts.into_iter().map(of_options).collect();
        Self {
            nodes: grid.map_or_else(Vec::new, |grid| grid.nodes_per_axis().to_vec()),
            spacing: grid.map(Grid::spacing),
            ..Self::without_grid(C::COMMAND, status, config.clone(), body, doubts, start)
        }
    }

    /// The same with the inputs.
    pub fn of(mut self, input: Vec<InputRecord<D>>) -> Self {
        let world = WorldFrame::of_inputs(&input);
        let units = self
            .spacing
            .zip(common_scale(input.iter().map(InputRecord::scale)));
        self.spacing_input_units = units.map(|(spacing, scale)| spacing / scale);
        self.input = input;
        self.within(world.as_ref())
    }

    /// The same on a grid that lies in the world.
    pub fn within(mut self, world: Option<&WorldFrame<D>>) -> Self {
        let placed = world.zip(self.spacing);
        self.world = placed.map(|(world, spacing)| world.record(spacing));
        self
    }

    /// Writes `config.toml` and `result.json` to an incomplete directory.
    ///
    /// # Errors
    /// [`CliError::Output`].
    pub fn write(&self, directory: &ResultDir) -> Result<(), CliError> {
        directory.with_file("config.toml", |path| write_config(path, &self.parameters))?;
        Ok(directory.record(RESULT, self)?)
    }
}

impl<C, T, const D: usize> Record<C, T, D> {
    /// The record of a result of a command that has no grid of its own, computed since `start`.
    pub fn without_grid(
        command: &str,
        status: impl Into<String>,
        parameters: C,
        body: T,
        doubts: Vec<DoubtRecord>,
        start: Instant,
    ) -> Self {
        let doubts = doubts.into_iter().map(|doubt| doubt.of_command(command));
        let doubts: Vec<DoubtRecord> = doubts.collect();
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            command: command.into(),
            status: status.into(),
            verdict: Verdict::of(&doubts),
            doubts,
            dimension: D,
            nodes: Vec::new(),
            spacing: None,
            spacing_input_units: None,
            input: Vec::new(),
            world: None,
            parameters,
            body,
            seconds: start.elapsed().as_secs_f64(),
            peak_memory_bytes: memory::peak(),
        }
    }

    /// The numbers of nodes as text.
    pub fn grid(&self) -> String {
        let nodes: Vec<String> = self.nodes.iter().map(ToString::to_string).collect();
        nodes.join(" x ")
    }

    /// The distance of neighbouring nodes as text: in millimetres in the world, elsewhere in units of the
    /// inputs for grids that are not the usual cube.
    pub fn spacing(&self) -> Option<String> {
        if let Some(world) = &self.world {
            return Some(format!("{} mm", rounded(*world.spacing.first()?)));
        }
        let cells = self.nodes.iter().max()?.saturating_sub(1) as f64;
        let is_unit = self
            .spacing
            .is_some_and(|h| (h * cells - 1.0).abs() < 1e-12);
        let is_cube = self.nodes.windows(2).all(|n| n[0] == n[1]);
        let spacing = self.spacing_input_units.filter(|_| !(is_cube && is_unit))?;
        Some(format!("{} in units of the inputs", rounded(spacing)))
    }

    /// The status as text.
    pub fn state(&self) -> String {
        self.status.replace('_', " ")
    }

    /// Whether the user stopped the computation.
    pub fn cancelled(&self) -> bool {
        self.status == CANCELLED
    }
}

/// A configuration as TOML, which leaves out keys that are not set.
fn without_nulls<C: Serialize, S: Serializer>(config: &C, out: S) -> Result<S::Ok, S::Error> {
    let table = toml::Table::try_from(config).map_err(serde::ser::Error::custom)?;
    table.serialize(out)
}

/// A certificate as text.
pub(crate) fn certified(certificate: &Certificate) -> &'static str {
    if certificate.certified {
        "certified without folds"
    } else {
        "NOT certified"
    }
}

/// The status of a successful computation.
pub(crate) const CONVERGED: &str = "converged";

/// The status of a whole computation, and that of its last level, in one word.
pub(crate) fn overall(status: Status, last: Option<Status>) -> String {
    if last == Some(Status::Cancelled) {
        return CANCELLED.into();
    }
    if status.converged() {
        return CONVERGED.into();
    }
    word(&status)
}

/// The status of a command: that of its computations, unless the user stopped one of them.
pub(crate) fn unless_cancelled(cancelled: bool, status: impl Into<String>) -> String {
    if cancelled {
        CANCELLED.into()
    } else {
        status.into()
    }
}

/// The status of several computations: the first that has not converged.
pub(crate) fn first_failure<'a>(mut all: impl Iterator<Item = &'a str>) -> &'a str {
    all.find(|status| *status != CONVERGED).unwrap_or(CONVERGED)
}

/// The serialised name of a value.
pub(crate) fn word(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        _ => "other".into(),
    }
}
