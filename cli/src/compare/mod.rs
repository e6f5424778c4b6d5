//! `shapespace compare`: whether groups of shapes differ, where, and whether they can be told apart.
//!
//! `source` reads the result that is compared and its groups, `tests` computes, `units` are those
//! of the boundary, `record` is the content of `result.json`, and `draw` and `write` make the rest of the
//! directory, in the colours of `scale`.

mod args;
mod draw;
mod record;
mod scale;
mod source;
mod tests;
mod units;
mod write;

use crate::error::CliError;
use crate::memory::{announce, in_short};
use crate::output::ResultDir;
use crate::pca::StoredPca;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;

pub use args::CompareConfig;
pub(crate) use scale::{difference_bar, rate_bar, rate_share};
pub(crate) use source::Compared;
use source::Kind;
pub(crate) use tests::Outcome;

/// Estimates the memory of a comparison of modes, in bytes: of the modes, of the shapes that groups and covariates
/// predict, and of the displacement that one of them is computed by.
fn memory<const D: usize>(compared: &Compared<D>, stored: &StoredPca<D>) -> u64 {
    let labelled = &compared.labelled;
    let predicted = labelled.names.len() + 3 * labelled.covariates.len();
    let numbers = (predicted + 2 * D + 1) * stored.space.object.grid().n_nodes();
    stored.bytes() + (size_of::<f64>() * numbers) as u64
}

impl Command for CompareConfig {
    type Plan<const D: usize> = Compared<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the result");
        source::read(self, session.trust)
    }

    fn compute<const D: usize>(
        &self,
        compared: Compared<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        match &compared.kind {
            Kind::Modes(stored, _) => {
                let grid = stored.space.object.grid();
                announce(memory(&compared, stored), grid, &session.progress)?;
            }
            Kind::Distances(matrix) => {
                // With a copy whose missing entries are filled.
                let needed = 2 * size_of::<f64>() * matrix.len().pow(2);
                session.progress.note(in_short(needed as u64));
            }
        }
        session.progress.stage("relabelling the shapes");
        tests::compute(self, compared)
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        write::arrays(outcome, directory)?;
        write::tables(outcome, directory)?;
        write::boundaries(outcome, directory)?;
        draw::pictures(outcome, directory)?;
        let record = record::record(self, outcome, session.start);
        record.write(directory)?;
        Ok(record::summary(&record, outcome))
    }
}
