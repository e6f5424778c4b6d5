//! What a geodesic is made of, whatever form it was computed in.

use crate::cells::{self, object_cells};
use crate::lagrangian::{LagrangianPath, lagrangian_path};
use crate::level_sets::{PathState, flow, level_set_path, on_grid};
use crate::{Form, GeodesicError, GeodesicParams};
use fe_grid::minimise::{Info, Observer, Status};
use fe_grid::{Certificate, Field, Grid, InverseDeformation, ScalarField, certify_within};
use levelset::{BoxEdge, ContourDistance, contour};
use rayon::prelude::*;

/// Overlap with the end shape from which on it counts as reached: on coarse grids the boundary is a
/// share of a cell away from it.
const REACHED: f64 = 0.95;
/// Steps of the flow that make one of the first path, at most.
const FLOW_STEPS: usize = 6;

/// What happened on one level of the computation.
#[derive(Clone, Debug)]
pub struct LevelReport {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Steps of the path.
    pub steps: usize,
    /// The minimiser's record.
    pub info: Info,
    /// Energies `W_k` of the steps at the end.
    pub step_energies: Vec<f64>,
    /// Unweighted matches at the end: of the last shape with the end shape, or of every shape with
    /// the next.
    pub matches: Vec<f64>,
    /// Boundary areas of the shapes `1, ..., K`; paths of level sets only.
    pub areas: Vec<f64>,
    /// What was minimised, at the end.
    pub total: f64,
}

/// A discrete geodesic: shapes and the deformations between them.
#[derive(Clone, Debug)]
pub struct Geodesic<const D: usize> {
    /// Level sets `u_0, ..., u_K`, positive inside.
    pub level_sets: Vec<ScalarField<f64, D>>,
    /// Displacements of `phi_1, ..., phi_K`: `phi_k(x) = x + displacement(x)` deforms the shape
    /// `k - 1` into the shape `k`.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Displacements of `psi_1, ..., psi_K`, the deformations of the start shape into every other;
    /// paths of one start domain only.
    pub motions: Vec<Field<f64, D, D>>,
    /// Energies `W_k` of the steps.
    pub step_energies: Vec<f64>,
    /// Unweighted matches; see [`LevelReport::matches`].
    pub matches: Vec<f64>,
    /// What was minimised.
    pub total: f64,
    /// The worst deformation inside its shape: certified where the determinant is positive on all
    /// cells that meet it.
    pub certificate: Certificate,
    /// Dice overlap of the end shape with what the deformations make of the start shape.
    pub dice_end: f64,
    /// Dice overlap of the start shape with the end shape pulled back through all steps: void that
    /// was closed up counts against it.
    pub dice_pulled: f64,
    /// What happened, in order.
    pub levels: Vec<LevelReport>,
    /// Converged, or the last level's reason why not.
    pub status: Status,
}

impl<const D: usize> Geodesic<D> {
    /// Whether the deformations carry the start shape to the end shape, by and large: a minimiser
    /// that has converged may have done so on the way.
    pub fn end_reached(&self) -> bool {
        self.dice_end >= REACHED
    }

    /// The length `sum sqrt W_k`.
    pub fn length(&self) -> f64 {
        cells::length(&self.step_energies)
    }

    /// The dissipation `K sum W_k`, never less than the square of the length.
    pub fn dissipation(&self) -> f64 {
        cells::dissipation(&self.step_energies)
    }
}

/// The geodesic between two shapes given by their signed distances (positive inside) on one grid.
///
/// The observer hears of every level and iteration and may cancel; what has been reached by then
/// is the result.
///
/// # Errors
/// [`GeodesicError`] for parameters out of range, shapes on different grids or without inside or
/// outside. Not to converge is not an error: the status says so.
pub fn geodesic<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    params.check()?;
    check(start, "start")?;
    check(end, "end")?;
    if start.grid() != end.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    match params.form {
        Form::Lagrangian => {
            let path = lagrangian_path(start, end, params, observer)?;
            let (level_sets, displacements) = eulerian(start, &path)?;
            let levels = path.levels.into_iter().map(|level| LevelReport {
                nodes: level.nodes,
                steps: level.steps,
                info: level.info,
                step_energies: level.energy.step_energies,
                matches: vec![level.energy.mismatch],
                areas: Vec::new(),
                total: level.energy.total,
            });
            let mut found = finish(end, level_sets, displacements, levels.collect())?;
            found.motions = path.displacements;
            Ok(found)
        }
        Form::LevelSets => {
            let first = first_path(start, end, params)?;
            let path = level_set_path(first, start, end, params, observer)?;
            let PathState {
                level_sets,
                displacements,
            } = path.state;
            let levels = path.levels.into_iter().map(|level| LevelReport {
                nodes: level.nodes,
                steps: level.steps,
                info: level.info,
                step_energies: level.energy.step_energies,
                matches: level.energy.mismatches,
                areas: level.energy.areas,
                total: level.energy.total,
            });
            finish(end, level_sets, displacements, levels.collect())
        }
    }
}

/// A first path of level sets: a flow on a coarse grid, cut into small steps.
fn first_path<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
) -> Result<PathState<D>, GeodesicError> {
    let grids = start.grid().hierarchy(params.flow_nodes);
    let grid = grids[0];
    let (coarse_start, coarse_end) = (on_grid(&grid, start), on_grid(&grid, end));
    let flow = flow(&coarse_start, &coarse_end, params)?;
    let mut steps = params.steps;
    while steps * FLOW_STEPS < flow.motions.len() {
        steps *= 2;
    }
    let mut first = flow.cut(steps);
    first.level_sets[steps] = coarse_end;
    Ok(first)
}

fn check<const D: usize>(
    shape: &ScalarField<f64, D>,
    which: &'static str,
) -> Result<(), GeodesicError> {
    let values = shape.as_slice();
    if let Some(node) = values.iter().position(|u| !u.is_finite()) {
        return Err(GeodesicError::NotFinite { which, node });
    }
    let inside = values.iter().filter(|&&u| u > 0.0).count();
    if inside == 0 || inside == values.len() {
        let what = if inside == 0 { "empty" } else { "full" };
        return Err(GeodesicError::Degenerate { which, what });
    }
    Ok(())
}

/// The shapes along a path of one start domain, and the deformations of each into the next.
fn eulerian<const D: usize>(
    start: &ScalarField<f64, D>,
    path: &LagrangianPath<D>,
) -> Result<(Vec<ScalarField<f64, D>>, Vec<Field<f64, D, D>>), GeodesicError> {
    // A path that was cancelled ends on a coarser grid than that of the shapes.
    let grid = path
        .displacements
        .first()
        .map_or(*start.grid(), |u| *u.grid());
    let start = ScalarField::from_fn(grid, |x| start.sample(x));
    let outline = contour(&start, 0.0, BoxEdge::Open)?;
    let mut level_sets = vec![start];
    for displacement in &path.displacements {
        let moved = outline.map(|p| {
            let u = displacement.sample(p);
            std::array::from_fn(|k| p[k] + u[k])
        });
        level_sets.push(ContourDistance::new(&moved)?.sample(grid));
    }
    let displacements = (0..path.displacements.len())
        .into_par_iter()
        .map(|k| match k {
            0 => path.displacements[0].clone(),
            _ => step_between(&path.displacements[k - 1], &path.displacements[k]),
        })
        .collect();
    Ok((level_sets, displacements))
}

/// The displacement of `psi_k o psi_{k-1}^{-1}`.
pub(crate) fn step_between<const D: usize>(
    before: &Field<f64, D, D>,
    after: &Field<f64, D, D>,
) -> Field<f64, D, D> {
    let grid = *before.grid();
    let n = grid.n_nodes();
    let inverse = InverseDeformation::new(before);
    let mut step = Field::zeros(grid);
    let mut known = vec![false; n];
    for node in 0..n {
        if let Some(x) = inverse.position(node) {
            let (u, v) = (before.sample(x), after.sample(x));
            for k in 0..D {
                step.component_mut(k)[node] = v[k] - u[k];
            }
            known[node] = true;
        }
    }
    extend(&grid, &mut step, known);
    step
}

/// Gives nodes that nothing is known of the mean of their known neighbours, from near to far.
fn extend<const D: usize>(grid: &Grid<D>, field: &mut Field<f64, D, D>, mut known: Vec<bool>) {
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut missing: Vec<usize> = (0..known.len()).filter(|&i| !known[i]).collect();
    while !missing.is_empty() && missing.len() < known.len() {
        let mut found = Vec::new();
        for &index in &missing {
            let node = grid.node(index);
            let mut neighbours = Vec::with_capacity(2 * D);
            for k in 0..D {
                if node[k] > 0 {
                    neighbours.push(index - strides[k]);
                }
                if node[k] + 1 < nodes[k] {
                    neighbours.push(index + strides[k]);
                }
            }
            neighbours.retain(|&i| known[i]);
            if !neighbours.is_empty() {
                let mut mean = [0.0; D];
                for &i in &neighbours {
                    let value = field.at(i);
                    for k in 0..D {
                        mean[k] += value[k] / neighbours.len() as f64;
                    }
                }
                found.push((index, mean));
            }
        }
        for (index, mean) in &found {
            for k in 0..D {
                field.component_mut(k)[*index] = mean[k];
            }
            known[*index] = true;
        }
        missing.retain(|&i| !known[i]);
    }
}

fn finish<const D: usize>(
    end: &ScalarField<f64, D>,
    level_sets: Vec<ScalarField<f64, D>>,
    displacements: Vec<Field<f64, D, D>>,
    levels: Vec<LevelReport>,
) -> Result<Geodesic<D>, GeodesicError> {
    let grid = *level_sets[0].grid();
    let mut worst: Option<Certificate> = None;
    for (u, displacement) in level_sets.iter().zip(&displacements) {
        let object = object_cells(u);
        let found = certify_within(
            &grid,
            displacement.as_slice(),
            0.0,
            f64::INFINITY,
            Some(&object),
        );
        worst = Some(worst.map_or(found, |w| if found.min_det < w.min_det { found } else { w }));
    }
    let certificate = worst.unwrap_or(Certificate {
        certified: true,
        min_det: 1.0,
        min_corner_det: 1.0,
        cell: 0,
    });
    let carry = |x: [f64; D]| {
        displacements.iter().fold(x, |y, displacement| {
            let u = displacement.sample(y);
            std::array::from_fn(|k| y[k] + u[k])
        })
    };
    let pulled = ScalarField::from_fn(grid, |x| end.sample(carry(x)));
    let dice_pulled = levelset::dice(&pulled, 0.0, &level_sets[0], 0.0)?;
    let carried = contour(&level_sets[0], 0.0, BoxEdge::Open)?.map(carry);
    let carried = ContourDistance::new(&carried)?.sample(grid);
    let target = on_grid(&grid, end);
    let dice_end = levelset::dice(&carried, 0.0, &target, 0.0)?;
    let last = levels.last();
    Ok(Geodesic {
        step_energies: last.map(|l| l.step_energies.clone()).unwrap_or_default(),
        matches: last.map(|l| l.matches.clone()).unwrap_or_default(),
        total: last.map_or(0.0, |l| l.total),
        status: last.map_or(Status::InadmissibleStart, |l| l.info.status),
        level_sets,
        displacements,
        motions: Vec::new(),
        certificate,
        dice_end,
        dice_pulled,
        levels,
    })
}
