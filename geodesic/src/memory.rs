//! Estimate of the memory of a path, available before it is computed.

use crate::descent::HISTORY;
use crate::params::{DomainChoice, Form, GeodesicParams};
use fe_grid::Grid;
use fe_grid::minimise::LeastEigenvalueParams;
use hyperelastic::CycleMemory;

/// Size of a number in double precision, in bytes; pairs of the minimiser have half of it.
const DOUBLE: u64 = 8;
/// Vectors of the minimiser: the state, that before a step, the gradients of both, and the direction.
const MINIMISER: u64 = 5;
/// Fields while a viscous flow is computed, on its grid: as many were measured.
const FLOW: u64 = 300;

/// Estimates the most memory that the computation of a path needs at one time, in bytes, with shapes of
/// some components on a finest grid.
///
/// Counted are all arrays of the minimisation on the finest level whose size grows with the grid, and the
/// shapes; on small grids, those of the viscous flow that level sets start from. The program itself,
/// boundaries and pictures are not.
pub fn memory_estimate<const D: usize>(
    params: &GeodesicParams,
    n_components: usize,
    grid: &Grid<D>,
) -> u64 {
    let (d, steps, components) = (D as u64, params.steps as u64, n_components as u64);
    let field = |grid: &Grid<D>| DOUBLE * grid.n_nodes() as u64;
    let cycle = CycleMemory::on(grid);
    let pairs = 2 * HISTORY as u64 / 2;
    let vectors = MINIMISER + pairs;
    let shapes = 2 * components;
    let path = match params.form {
        Form::Lagrangian => {
            // The path with the identity in front, its gradient, and the increments of the metric. On the domain of a
            // shape between both the first deformation is unknown, too.
            let between = matches!(params.domain, DomainChoice::Better | DomainChoice::Middle);
            let unknown = steps + u64::from(between);
            let fields = (vectors + 3) * unknown * d + 2 * d;
            // Of each component both level sets, a copy of the start's and, at the points of the end
            // domain, the end and what is covered; the preimages of these points.
            let points = 1 << D;
            let matched = components * (3 + 2 * points) + 1 + points / 2;
            let (matched, cycles) = if between {
                (2 * matched, steps.min(2) + 1)
            } else {
                (matched, steps.min(2))
            };
            (fields + matched) * field(grid) + cycles * cycle.matrices + cycle.work_space
        }
        Form::LevelSets => {
            let state = steps * (d + components);
            // For motions of the shapes: slopes of the level sets, gradients of the deformations, cells
            // and positions of the images of nodes; forces, increments and velocities.
            let motions = steps * (components * (d + 2) + d * d + 1 + d + 3 * d);
            // The equations of the level sets, and a pair of both with its gradient.
            let equations = 3u64.pow(D as u32).div_ceil(2) + 2 + 4 * (d + components);
            let cycles = (steps + if steps > 1 { steps } else { 0 }) * cycle.matrices;
            (vectors * state + motions + equations) * field(grid) + cycles + cycle.work_space
        }
    };
    // A path of deformations starts from a flow only if no other start reaches the end.
    let flow = match params.form {
        Form::Lagrangian => 0,
        Form::LevelSets => FLOW * field(&grid.hierarchy(params.flow_nodes)[0]),
    };
    shapes * field(grid) + path.max(flow)
}

/// Estimates the most memory that [`stable_path`](crate::stable_path()) needs at one time beside the path that it is
/// given, in bytes, as [`memory_estimate`] does that of a path.
pub fn memory_estimate_of_stability<const D: usize>(
    params: &GeodesicParams,
    n_components: usize,
    grid: &Grid<D>,
) -> u64 {
    if params.form != Form::Lagrangian {
        return 0;
    }
    let (d, steps, components) = (D as u64, params.steps as u64, n_components as u64);
    let planes = d * (d - 1) / 2;
    // Directions, a guess, the state, the mass, and three vectors of the action of the Hessian.
    let vectors = LeastEigenvalueParams::VECTORS as u64 + 6;
    // Rigid motions of the shapes between the ends, each with its product with the mass.
    let motions = 2 * (steps - 1) * (d + planes);
    // As in a minimisation: of each component the level sets and the points of the end domain, the path and its gradient.
    let points = 1 << D;
    let matched = components * (3 + 2 * points) + 1 + points / 2;
    let fields = (vectors + 2) * steps * d + motions * d + 2 * d + matched;
    let cycle = CycleMemory::on(grid);
    let cycles = steps.min(2) * cycle.matrices + cycle.work_space;
    fields * DOUBLE * grid.n_nodes() as u64 + cycles
}
