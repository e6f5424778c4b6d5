//! `shapespace pca`: the modes of variation of an average.

use std::fs;

use shape_pca::{Compound, Pca, Quality, Variation};

use super::args::PcaConfig;
use super::balance::{Continuation, balanced};
use super::read::{StoredAverage, read_average};
use super::write::write_all;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;
use shapespace_input::dimension::per_dimension;

/// The result of an analysis.
pub(crate) struct Outcome<const D: usize> {
    pub(super) config: PcaConfig,
    pub(super) stored: StoredAverage<D>,
    pub(super) continuation: Option<Continuation>,
    pub(super) pca: Pca<D>,
    pub(super) quality: Quality,
}

impl Command for PcaConfig {
    type Plan<const D: usize> = (PcaConfig, StoredAverage<D>);
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the average");
        let stored = read_average(&self.average, session.trust)?;
        let mut config = self.clone();
        // The modes refer to the directory of the average, which is read again with them.
        config.average = fs::canonicalize(&self.average).unwrap_or(config.average);
        Ok(per_dimension!(stored, stored => (config, stored)))
    }

    fn compute<const D: usize>(
        &self,
        (config, mut stored): (PcaConfig, StoredAverage<D>),
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let params = stored.pca_params(config.params);
        let mut fingerprint = Fingerprint::of_results(&config, &[&config.average])?;
        fingerprint.leave_out("average");
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let mut watch = checkpointer.observe(session.observer(&[*stored.average.grid()]));
        let most = config.modes.unwrap_or(usize::MAX);
        let mut continuation = None;
        // Only modes of stresses rest on their balance.
        if !config.keep_average && params.variation == Variation::Stress {
            session.progress.stage("balancing the stresses");
            continuation = balanced(&mut stored, &params, &mut watch)?;
        }
        session.progress.stage("assembling the compound operator");
        let compound = Compound::new(&stored.average, &params)?;
        let n = stored.average.n_shapes();
        session
            .progress
            .stage(format!("solving for {n} displacements"));
        let pca = Pca::new(&stored.average, &compound, most, &mut watch)?;
        watch.finish();
        session.ended(checkpointer);
        Ok(Outcome {
            quality: Quality::new(&pca.gram, params.zero_eigenvalue, most)?,
            config,
            stored,
            continuation,
            pca,
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        write_all(directory, outcome, session)
    }
}
