//! The curvature of the energy at a path, and a state beyond a saddle point.

use super::objective::PathObjective;
use super::solve::{Domain, on_domain};
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use crate::shape::Shape;
use fe_grid::minimise::{
    Curvature, LeastEigenvalue, LeastEigenvalueParams, Objective, SecondOrder,
};
use fe_grid::vector::{add_scaled_into, dot, max_abs, multiply_into};
use fe_grid::{Field, Grid, Motion, ScalarField, object_mass, rigid_motions};

/// Energies are compared over a step that moves the farthest node by this many spacings.
const STEP: f64 = 0.25;
/// A path is moved along the direction of negative curvature by this many spacings at the farthest node: out
/// of what the minimiser would call converged, and less than what folds the void.
const PUSH: f64 = 3.0;
/// How often that is halved where it folds a deformation.
const HALVINGS: usize = 4;
/// Mass of the void relative to its stiffness, both relative to the object: so light that the void has no soft
/// modes of its own.
const VOID_MASS: f64 = 1e-2;
/// Share of the least eigenvalue that its estimated error may have: the iteration is slow where a soft direction has to
/// be found first.
const RELATIVE_ERROR: f64 = 1e-3;
/// Most applications of the Hessian, of two gradients each.
const MAX_ACTIONS: usize = 60;
/// The shift whose difference quotient is a direction to begin with, relative to its speed.
const TURN: f64 = 1e-3;

/// A path of one domain on the grid of the shapes, with the factor that the weight of the mismatch had.
pub(crate) struct OwnPath<'a, const D: usize> {
    pub domain: Domain,
    pub displacements: &'a [Field<f64, D, D>],
    pub factor: f64,
    pub dissipation: f64,
}

/// The least curvature of the energy at a path.
pub(crate) struct Stability {
    pub curvature: Curvature,
    /// Where it is negative, all displacements after a small step along its direction, one after the other.
    pub beyond: Option<Vec<f64>>,
}

/// The least eigenvalue of the Hessian at a path, for the mass
///
/// ```text
/// v . M v = 1/K sum_k int chi |v_k|^2 / int chi,
/// ```
///
/// `chi` the indicator of the domain's shape, over all directions but the rigid motions of the shapes between
/// the ends, which cost nothing. The Hessian is taken from differences of gradients. Falls are relative to the
/// dissipation `K sum_k W_k`. `None` where a curvature is not finite, or
/// its error as large as itself: at states far from a minimum.
pub(crate) fn stability<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &OwnPath<'_, D>,
    params: &GeodesicParams,
) -> Result<Option<Stability>, GeodesicError> {
    let grid = *start.grid();
    let steps = path.displacements.len();
    let params = on_domain(params, path.domain, path.factor);
    let shapes = path.domain.order(start, end);
    let [from, to] = shapes.map(|shape| shape.on_grid(&grid));
    let mut objective = PathObjective::between(from, to, steps, &params)?;
    let parts = path.displacements.iter().map(Field::as_slice);
    let x: Vec<f64> = parts.flatten().copied().collect();
    let void = params.void_stiffness.max(params.void_viscosity);
    let chi = objective.indicator();
    let level_set = objective.level_set().clone();
    let mass = object_mass::<D>(&vec![&chi[..]; steps], &vec![1.0; steps], VOID_MASS * void);
    let dim = x.len() / steps;
    let rigid = |k: usize| {
        let own = &mass[k * dim..][..dim];
        rigid_motions(&path.displacements[k..=k], own, k * dim)
    };
    // The end resists those of the last shape.
    let inner: Vec<Motion> = (0..steps - 1).flat_map(rigid).collect();
    let guesses = [softest(
        &mut objective,
        &x,
        &mass,
        slides(path, &level_set),
    )?];
    let search = LeastEigenvalueParams {
        max_actions: MAX_ACTIONS,
        relative_error: RELATIVE_ERROR,
        absolute_error: 0.0,
    };
    let step = STEP * grid.spacing();
    let Some(found) = search.find(&mut objective, &x, &mass, &inner, &guesses)? else {
        return Ok(None);
    };
    drop(guesses);
    if found.error > found.value.abs() {
        return Ok(None);
    }
    let scale = path.dissipation.max(f64::MIN_POSITIVE);
    let Some(curvature) = Curvature::along(&found, &mut objective, &x, step, scale)? else {
        return Ok(None);
    };
    let beyond = if curvature.value + curvature.error < 0.0 {
        beyond(&mut objective, &grid, &x, &found)?
    } else {
        None
    };
    Ok(Some(Stability { curvature, beyond }))
}

/// The direction of the least quotient `v . H v / v . M v` among some.
fn softest<const D: usize>(
    objective: &mut PathObjective<D>,
    x: &[f64],
    mass: &[f64],
    directions: Vec<Vec<f64>>,
) -> Result<Vec<f64>, GeodesicError> {
    let mut best: Option<(f64, Vec<f64>)> = None;
    let mut image = vec![0.0; x.len()];
    for direction in directions {
        objective.hessian_action(x, &direction, &mut image)?;
        let curvature = dot(&direction, &image);
        multiply_into(mass, &direction, &mut image);
        let quotient = curvature / dot(&direction, &image);
        if best.as_ref().is_none_or(|(least, _)| quotient < *least) {
            best = Some((quotient, direction));
        }
    }
    Ok(best.map(|(_, direction)| direction).unwrap_or_default())
}

/// The state after a step along a direction, to the side where the energy is lower; `None` where every step
/// folds a deformation.
fn beyond<const D: usize>(
    objective: &mut PathObjective<D>,
    grid: &Grid<D>,
    x: &[f64],
    found: &LeastEigenvalue,
) -> Result<Option<Vec<f64>>, GeodesicError> {
    let mut step = PUSH * grid.spacing() / max_abs(&found.direction);
    for _ in 0..=HALVINGS {
        let mut best: Option<(f64, Vec<f64>)> = None;
        for sign in [1.0, -1.0] {
            let mut moved = vec![0.0; x.len()];
            add_scaled_into(x, sign * step, &found.direction, &mut moved);
            if let Some(energy) = objective.value(&moved)?.energy()
                && best.as_ref().is_none_or(|(lowest, _)| energy < *lowest)
            {
                best = Some((energy, moved));
            }
        }
        if let Some((_, moved)) = best {
            return Ok(Some(moved));
        }
        step *= 0.5;
    }
    Ok(None)
}

/// Directions that let the matter of a shape slide around while the shapes stay where they are, the more the later,
/// `k/K d/dt psi_k(x + t w(x))`, one for each plane: another part of the start shape is carried onto each part of the
/// end. `w` is tangential to all level sets of the signed distance `u` of the shape, `w = (m - u) J grad u` with the
/// largest distance `m` and the quarter turn `J` in the plane: the turn of a disk.
fn slides<const D: usize>(path: &OwnPath<'_, D>, level_set: &ScalarField<f64, D>) -> Vec<Vec<f64>> {
    let grid = *level_set.grid();
    let steps = path.displacements.len();
    let h = grid.spacing();
    let most = level_set.as_slice().iter().copied().fold(0.0, f64::max);
    let slide = |i: usize, j: usize| {
        let along = |x: [f64; D], axis: usize| {
            let shifted = |by: f64| {
                let mut y = x;
                y[axis] += by;
                level_set.sample(y)[0]
            };
            (shifted(h) - shifted(-h)) / (2.0 * h)
        };
        let mut vector = Vec::with_capacity(steps * D * grid.n_nodes());
        for (k, psi) in path.displacements.iter().enumerate() {
            let share = (k + 1) as f64 / steps as f64;
            let moved = Field::<f64, D, D>::from_fn(grid, |x| {
                let speed = (most - level_set.sample(x)[0]).min(2.0 * most);
                let mut slid = x;
                slid[i] += TURN * speed * along(x, j);
                slid[j] -= TURN * speed * along(x, i);
                let (before, after) = (psi.sample(x), psi.sample(slid));
                std::array::from_fn(|c| share * (slid[c] + after[c] - x[c] - before[c]) / TURN)
            });
            vector.extend_from_slice(moved.as_slice());
        }
        vector
    };
    let planes = (0..D).flat_map(|i| (0..i).map(move |j| (i, j)));
    planes.map(|(i, j)| slide(i, j)).collect()
}
