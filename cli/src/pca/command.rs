//! `shapespace pca`: the modes of variation of an average.

use std::fs;
use std::sync::Arc;

use fe_grid::Distribution;
use shape_average::memory_estimate as memory_of_average;
use shape_pca::{Compound, Pca, PcaParams, Quality, Variation, memory_estimate};

use super::args::PcaConfig;
use super::balance::{Continuation, balanced};
use super::read::{StoredAverage, read_average};
use super::write::write_all;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::groups::{self, Known, Labelled};
use crate::memory::announce;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;
use shapespace_input::dimension::per_dimension;

/// The result of an analysis.
pub(crate) struct Outcome<const D: usize> {
    pub(super) config: PcaConfig,
    pub(super) stored: StoredAverage<D>,
    /// The groups of its shapes, if they were asked for.
    pub(super) labelled: Option<Labelled>,
    pub(super) continuation: Option<Continuation>,
    pub(super) pca: Pca<D>,
    pub(super) quality: Quality,
}

/// What an analysis is made from.
pub(crate) struct Plan<const D: usize> {
    config: PcaConfig,
    stored: StoredAverage<D>,
    labelled: Option<Labelled>,
}

impl PcaConfig {
    /// The groups of the shapes of an average, if they are asked for.
    ///
    /// # Errors
    /// As [`groups::read`]; [`CliError::Option`] for an average of images, whose modes are no shapes.
    fn labelled<const D: usize>(
        &self,
        stored: &StoredAverage<D>,
    ) -> Result<Option<Labelled>, CliError> {
        let Some(wanted) = self.wanted() else {
            return Ok(None);
        };
        if stored.image.is_some() {
            return Err(CliError::Option {
                option: "--groups",
                value: wanted.groups.display().to_string(),
                remedy: "leave it out: this is an average of images, and only shapes are drawn at their scores".into(),
            });
        }
        let known = Known {
            names: &stored.names,
            files: &stored.files,
        };
        Ok(Some(groups::read(&wanted, &known)?))
    }

    /// Whether the stresses of the average are balanced first: only modes of stresses rest on that.
    fn balances(&self, params: &PcaParams) -> bool {
        !self.keep_average && params.variation == Variation::Stress
    }

    /// Estimates the memory of the computation, in bytes.
    fn memory<const D: usize>(&self, stored: &StoredAverage<D>, params: &PcaParams) -> u64 {
        let (grid, n) = (stored.average.grid(), stored.average.n_shapes());
        let balances = self.balances(params) && !stored.phase_fields.is_empty();
        let most = self.modes.unwrap_or(usize::MAX);
        let own = memory_estimate(n, most, balances, grid);
        let fields = |n: usize| (size_of::<f64>() * grid.n_nodes() * n) as u64;
        // How shapes fit before and after a balancing is measured by the functional of their average.
        let fitted = if balances {
            let average = &stored.params;
            let distribution = Distribution::alone(n);
            let components = stored.components.len().max(1);
            let of_functional = memory_of_average(average, &distribution, components, false, grid);
            // Without a minimiser and metrics.
            let unused = of_functional.minimiser + of_functional.history + of_functional.metric;
            of_functional.memory.saturating_sub(unused) + fields(2 * n * (D + 1))
        } else {
            0
        };
        own.max(fitted) + fields(stored.phase_fields.len() + 1)
    }
}

impl Command for PcaConfig {
    const DISTRIBUTED: bool = true;

    type Plan<const D: usize> = Plan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading the average");
        let stored = read_average(&self.average, session.trust)?;
        let mut config = self.clone();
        // The modes refer to the directory of the average, which is read again with them.
        config.average = fs::canonicalize(&self.average).unwrap_or(config.average);
        Ok(per_dimension!(stored, stored => Plan {
            labelled: config.labelled(&stored)?,
            config,
            stored,
        }))
    }

    fn compute<const D: usize>(
        &self,
        plan: Plan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let Plan {
            config,
            mut stored,
            labelled,
        } = plan;
        let params = stored.pca_params(config.params);
        stored.average = stored.average.distributed(Arc::clone(&session.processes));
        let mut fingerprint = Fingerprint::of_results(&config, &[&config.average])?;
        // The modes do not depend on groups.
        for key in ["average", "groups", "column"] {
            fingerprint.leave_out(key);
        }
        announce(
            self.memory(&stored, &params),
            stored.average.grid(),
            &session.progress,
        )?;
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let mut watch = checkpointer.observe(session.observer(&[*stored.average.grid()]));
        let most = config.modes.unwrap_or(usize::MAX);
        let mut continuation = None;
        if self.balances(&params) {
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
            quality: Quality::new(
                &pca.gram,
                stored.average.weights(),
                params.zero_eigenvalue,
                most,
            )?,
            config,
            stored,
            labelled,
            continuation,
            pca,
        })
    }

    /// All processes have the modes.
    fn assist<const D: usize>(
        &self,
        plan: Self::Plan<D>,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        self.compute(plan, session).map(drop)
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
