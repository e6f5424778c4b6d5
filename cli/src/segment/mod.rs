//! `shapespace segment`: computes edges and objects of grey images.
//!
//! `args` are the options, `plan` reads and validates the images, `compute` finds edges and
//! objects, `record` and `write` write the result directory, `draw` its picture.

mod args;
mod compute;
mod draw;
mod plan;
mod record;
mod write;

pub use args::{Object, SegmentConfig};

use crate::error::CliError;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::summary::Summary;
use compute::Found;
use plan::{SegmentPlan, plan_segment};

impl Command for SegmentConfig {
    type Plan<const D: usize> = SegmentPlan<D>;
    type Outcome<const D: usize> = (SegmentConfig, Vec<Found<D>>);

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        let n = self.inputs.len();
        session.progress.stage(format!("reading {n} images"));
        plan_segment(self.clone(), &session.sources)
    }

    fn compute<const D: usize>(
        &self,
        plan: SegmentPlan<D>,
        session: &Session<'_>,
    ) -> Result<Self::Outcome<D>, CliError> {
        compute::compute(plan, session)
    }

    fn write<const D: usize>(
        &self,
        (config, found): &Self::Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        write::write_all(directory, config, found, session)
    }
}
