//! `shapespace compare`: whether groups of shapes differ, where, and whether they can be told apart.
//!
//! `table` reads the groups, `source` the result that is compared, `tests` computes, `record` is the
//! content of `result.json`, and `draw` and `write` make the rest of the directory.

mod args;
mod draw;
mod record;
mod source;
mod table;
mod tests;
mod write;

use crate::error::CliError;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;

pub use args::CompareConfig;
pub(crate) use source::Compared;
pub(crate) use tests::Outcome;

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
        draw::pictures(outcome, directory)?;
        let record = record::record(self, outcome, session.start);
        record.write(directory)?;
        Ok(record::summary(&record, outcome))
    }
}
