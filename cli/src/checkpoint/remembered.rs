//! The memory of a run in files, from which a run resumes to the same bits.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use fe_grid::minimise::{Ended, Evaluations, Memory, MemoryPair};
use serde::{Deserialize, Serialize};

use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::integrity::Sums;
use crate::output::{OutputError, sync};
use shapespace_input::files;

const STATE: &str = "state.bin";
const GRADIENT: &str = "gradient.bin";
const OBJECTIVE: &str = "objective.bin";

/// The numbers of a memory; its vectors are in files of a folder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Remembered {
    /// Which of the runs the memory is from.
    pub run: usize,
    /// Number of unknowns.
    dim: usize,
    /// Length of the gradient.
    gradient: usize,
    /// What the objective remembers.
    objective: usize,
    /// Inverse curvature and ratio of every pair.
    pairs: Vec<[f64; 2]>,
    energies: Vec<f64>,
    first_gradient_norm: f64,
    step_length: f64,
    evaluations: Evaluations,
    /// How the run has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<Ended>,
    /// The convergence history of this run so far.
    pub history: Vec<HistoryPoint>,
}

impl Remembered {
    /// Writes the vectors of a memory to a folder.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn save(
        folder: &Path,
        run: usize,
        memory: &Memory<'_>,
        history: &[HistoryPoint],
    ) -> Result<Self, OutputError> {
        write(folder, STATE, &memory.x, f64::to_le_bytes)?;
        write(folder, GRADIENT, &memory.gradient, f64::to_le_bytes)?;
        write(folder, OBJECTIVE, &memory.objective, f64::to_le_bytes)?;
        for (k, pair) in memory.pairs.iter().enumerate() {
            let [step, change] = names(k);
            write(folder, &step, &pair.step.numbers(), f32::to_le_bytes)?;
            write(folder, &change, &pair.change.numbers(), f32::to_le_bytes)?;
        }
        sync(folder)?;
        let numbers = |pair: &MemoryPair<'_>| [pair.inverse_curvature, pair.ratio];
        Ok(Self {
            run,
            dim: memory.x.len(),
            gradient: memory.gradient.len(),
            objective: memory.objective.len(),
            pairs: memory.pairs.iter().map(numbers).collect(),
            energies: memory.energies.to_vec(),
            first_gradient_norm: memory.first_gradient_norm,
            step_length: memory.step_length,
            evaluations: memory.evaluations,
            ended: memory.ended,
            history: history.to_vec(),
        })
    }

    /// Reads the memory from its folder, whose files have these checksums.
    ///
    /// # Errors
    /// [`CliError`] for files that are missing or have changed.
    pub fn load(&self, folder: &Path, sums: &Sums) -> Result<Memory<'static>, CliError> {
        let doubles = |name: &str, n| read(folder, name, n, sums, f64::from_le_bytes);
        let singles = |name: &str| read(folder, name, self.dim, sums, f32::from_le_bytes);
        let pairs = self.pairs.iter().enumerate();
        let pairs = pairs.map(|(k, [inverse_curvature, ratio])| {
            let [step, change] = names(k);
            Ok(MemoryPair {
                step: singles(&step)?.into(),
                change: singles(&change)?.into(),
                inverse_curvature: *inverse_curvature,
                ratio: *ratio,
            })
        });
        Ok(Memory {
            x: doubles(STATE, self.dim)?.into(),
            gradient: doubles(GRADIENT, self.gradient)?.into(),
            pairs: pairs.collect::<Result<_, CliError>>()?,
            energies: self.energies.clone().into(),
            first_gradient_norm: self.first_gradient_norm,
            step_length: self.step_length,
            evaluations: self.evaluations,
            objective: doubles(OBJECTIVE, self.objective)?.into(),
            ended: self.ended,
        })
    }
}

/// The files of a pair.
fn names(pair: usize) -> [String; 2] {
    ["step", "change"].map(|kind| format!("{kind}_{pair:03}.bin"))
}

/// Writes numbers one after the other.
fn write<T: Copy, const W: usize>(
    folder: &Path,
    name: &str,
    values: &[T],
    bytes: fn(T) -> [u8; W],
) -> Result<(), OutputError> {
    let path = folder.join(name);
    let failed = OutputError::at(&path);
    let mut writer = BufWriter::new(File::create(&path).map_err(&failed)?);
    for value in values {
        writer.write_all(&bytes(*value)).map_err(&failed)?;
    }
    writer.flush().map_err(&failed)?;
    sync(&path)
}

/// Reads this number of numbers.
fn read<T, const W: usize>(
    folder: &Path,
    name: &str,
    count: usize,
    sums: &Sums,
    number: fn([u8; W]) -> T,
) -> Result<Vec<T>, CliError> {
    let path = folder.join(name);
    let bytes = files::read(&path, (W * count) as u64).map_err(OutputError::at(&path))?;
    sums.verify(folder, Path::new(name), &bytes)?;
    let (numbers, rest) = bytes.as_chunks::<W>();
    if numbers.len() != count || !rest.is_empty() {
        return Err(CliError::Damaged {
            path,
            reason: format!("it has {} bytes, not {}", bytes.len(), W * count),
        });
    }
    Ok(numbers.iter().map(|bytes| number(*bytes)).collect())
}
