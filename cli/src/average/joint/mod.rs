//! `shapespace average --joint`: segments and averages grey images simultaneously.

mod draw;
mod plan;
mod record;
mod write;

use std::sync::Arc;

use fe_grid::ScalarField;
use shape_average::joint::{JointParams, JointResult, joint_average_distributed, memory_estimate};

use super::args::{AverageConfig, AverageRun, not_joint};
use super::start::{compare_places, initial};
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::memory::announce;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::InputRecord;
use crate::summary::Summary;
use plan::{JointPlan, plan_joint};

/// Segments and averages images.
pub(crate) struct JointAverage {
    pub config: AverageConfig,
    pub run: AverageRun,
}

/// The result of a computation.
pub(crate) struct Outcome<const D: usize> {
    images: Vec<InputRecord<D>>,
    /// Their values on the grid.
    nodal: Vec<ScalarField<f64, D>>,
    config: AverageConfig,
    params: JointParams,
    result: JointResult<D>,
    history: Vec<HistoryPoint>,
}

impl Command for JointAverage {
    const DISTRIBUTED: bool = true;

    type Plan<const D: usize> = JointPlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        if self.run.memory.is_some() {
            return Err(not_joint("--memory"));
        }
        plan_joint(self.config.clone(), &session.sources, &session.progress)
    }

    fn compute<const D: usize>(
        &self,
        plan: JointPlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let outcome = take_part(plan, session)?;
        // The first process has a result.
        outcome.ok_or_else(|| shape_average::AverageError::NoShapes.into())
    }

    fn assist<const D: usize>(
        &self,
        plan: JointPlan<D>,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        take_part(plan, session).map(drop)
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        write::write_all(directory, outcome, session)
    }
}

/// Computes the average on all processes; the first one has it.
fn take_part<const D: usize>(
    plan: JointPlan<D>,
    session: &Session<'_>,
) -> Result<Option<Outcome<D>>, CliError> {
    let JointPlan {
        images,
        nodal,
        config,
        params,
        fingerprint,
    } = plan;
    let coarsest = params.segmentation.coarsest_nodes;
    let grids = nodal[0].grid().hierarchy(coarsest);
    let start = config.start.as_deref();
    compare_places(start, images.iter().map(|i| i.frame), &session.progress);
    let known = initial(start, nodal.len(), &grids, session.trust)?;
    let grid = nodal[0].grid();
    let needed = memory_estimate(&params, &session.distribution(nodal.len()), grid);
    announce(needed, grid, &session.progress)?;
    let mut checkpointer = session.checkpointer(fingerprint)?;
    let mut watch = checkpointer.observe(session.observer(&grids));
    let processes = Arc::clone(&session.processes);
    let result = joint_average_distributed(processes, &nodal, &known, &params, &mut watch)?;
    let history = watch.finish();
    session.ended(checkpointer);
    Ok(result.map(|result| Outcome {
        images,
        nodal,
        config,
        params,
        result,
        history,
    }))
}
