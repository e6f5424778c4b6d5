//! `shapespace geodesic`: computes the shortest path between two masks.
//!
//! `plan` reads and validates the inputs, `error_bars` repeats a path with fewer steps and on coarser grids, `path` holds the boundaries and densities along the
//! result, `record` and `write` write the result directory, `draw` its pictures.

mod args;
pub(crate) mod draw;
mod error_bars;
mod minima;
pub(crate) mod path;
mod plan;
mod record;
pub(crate) mod write;

use std::time::Instant;

use ::geodesic::{
    Form, Geodesic, GeodesicParams, Known, Shape, geodesic_between, memory_estimate,
    memory_estimate_of_stability,
};
use fe_grid::{Grid, ScalarField};
use levelset::Doubt;

use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::memory::announce;
use crate::output::ResultDir;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{Components, Input, VisibilityMask, doubts_of, settle, view_of};
use crate::summary::Summary;
use error_bars::{ErrorBars, error_bars};
use minima::{Ends, FoundPaths, doubts as doubts_of_starts, shortest_of};
use plan::{GeodesicPlan, plan_geodesic};

pub use args::{GeodesicConfig, Occluded};
pub(crate) use args::{check_form, check_path};

/// The result of a computation.
pub(crate) struct Outcome<const D: usize> {
    /// Start and end.
    inputs: Vec<Input<D>>,
    config: GeodesicConfig,
    /// The labels of their components, if there are several.
    labels: Vec<i64>,
    result: Geodesic<D>,
    doubts: Vec<Doubt>,
    /// With several starts.
    minima: Option<FoundPaths>,
    error_bars: Option<ErrorBars>,
    /// Whether the user stopped the coarser paths.
    interrupted: bool,
    history: Vec<HistoryPoint>,
    /// Seconds of the minimisation.
    solver_seconds: f64,
}

impl Command for GeodesicConfig {
    type Plan<const D: usize> = GeodesicPlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        session.progress.stage("reading 2 masks");
        plan_geodesic(self.clone(), &session.sources)
    }

    fn compute<const D: usize>(
        &self,
        plan: GeodesicPlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let (config, parts) = (plan.config, plan.parts);
        let mut checkpointer = session.checkpointer(plan.fingerprint)?;
        let settled = settle(
            plan.placed,
            &plan.views,
            parts.as_ref(),
            &session.progress,
            &session.processes,
        )?;
        let grid = settled.grid;
        let (inputs, distances) = settled.measure(&session.progress, &session.processes)?;
        // Several starts need the distances themselves, too.
        let own = config.starts.map(|n| (n, distances.clone()));
        let [first, last] = shapes(
            &inputs,
            distances,
            parts.as_ref(),
            plan.views,
            config.occluded,
            grid,
        )?;
        let components = first.components().len();
        let mut needed = memory_estimate(&config.params, components, &grid);
        if config.starts.is_some() {
            let stability = memory_estimate_of_stability(&config.params, components, &grid);
            needed = needed.max(stability);
        }
        announce(needed, &grid, &session.progress)?;
        session.progress.stage("computing the initial path");
        let begin = Instant::now();
        let grids = grid.hierarchy(first_nodes(&config.params));
        let (result, history, minima) = if let Some((n, own)) = &own {
            let ends = Ends {
                shapes: [&first, &last],
                distances: [&own[0], &own[1]],
            };
            let checks = &mut checkpointer;
            let (result, history, found) =
                shortest_of(*n, &ends, &config.params, &grids, checks, session)?;
            (result, history, Some(found))
        } else {
            let mut watch = checkpointer.observe(session.observer(&grids));
            let result = geodesic_between(&first, &last, &config.params, &mut watch)?;
            (result, watch.finish(), None)
        };
        let of_path = result.doubts(&config.params);
        let of_minima = minima.as_ref().map(doubts_of_starts).unwrap_or_default();
        let error_bars = if config.error_bars && !session.interrupt.asked() {
            let (params, checks) = (&config.params, &mut checkpointer);
            let ends = [&first, &last];
            Some(error_bars(&result, ends, params, checks, session)?)
        } else {
            None
        };
        // The path itself says whether it was.
        let interrupted = config.error_bars && session.interrupt.asked();
        session.ended(checkpointer);
        Ok(Outcome {
            doubts: [doubts_of(&inputs), of_path, of_minima].concat(),
            minima,
            error_bars,
            interrupted,
            inputs,
            config,
            labels: parts.map(|parts| parts.labels).unwrap_or_default(),
            result,
            history,
            solver_seconds: begin.elapsed().as_secs_f64(),
        })
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

/// Nodes per side of the first level.
fn first_nodes(params: &GeodesicParams) -> usize {
    match params.form {
        Form::Lagrangian => params.coarsest_nodes,
        Form::LevelSets => params.flow_nodes,
    }
}

/// Both shapes with their components and visibility.
fn shapes<const D: usize>(
    inputs: &[Input<D>],
    distances: Vec<ScalarField<f64, D>>,
    parts: Option<&Components<D>>,
    views: [Option<VisibilityMask<D>>; 2],
    occluded: Option<Occluded>,
    grid: Grid<D>,
) -> Result<[Shape<D>; 2], CliError> {
    let hidden = |which| occluded == Some(which) || occluded == Some(Occluded::Both);
    let hidden = [hidden(Occluded::Start), hidden(Occluded::End)];
    let mut found = Vec::new();
    for (number, ((input, distance), view)) in inputs.iter().zip(distances).zip(views).enumerate() {
        let mut components = vec![distance];
        if let Some(parts) = parts {
            components.extend(parts.distances(number, input, grid)?);
        }
        let known = match view {
            Some(view) => {
                let view = view_of(&view, input, grid)?;
                components[0] = view.distance;
                Known::Within(view.weight)
            }
            None if hidden[number] => Known::Inside,
            None => Known::Everywhere,
        };
        found.push(Shape::of_components(components)?.with_known(known));
    }
    found
        .try_into()
        .map_err(|found: Vec<_>| CliError::TooFewInputs {
            command: "geodesic",
            needed: 2,
            found: found.len(),
        })
}
