//! The flow that follows a transport without folds.
//!
//! Let `p_i = psi(x_i)` be the present positions of the points and `t_i` their targets. In every step all nodes move
//! with the velocity
//!
//! ```text
//! v(y) = sum_i G(y - p_i) (t_i - p_i) / (sum_i G(y - p_i) + delta),
//! ```
//!
//! with a Gaussian `G`: a mean over the points nearby, which fades outside of the shape. The steps are so short that
//! the deformation keeps a positive determinant on all cells, up to the boundary of the box.

use super::{Cloud, targets};
use crate::shape::{Shape, on_grid};
use fe_grid::{Field, Grid, certify, parallel, vector};

/// Standard deviation of the Gaussian, in cells.
const WIDTH: f64 = 2.0;
/// The sum of the weights at which the velocity is half the mean.
const FADING: f64 = 1e-3;
/// Most steps.
const STEPS: usize = 30;
/// Largest displacement of a step, in cells, and largest share of the way that is left.
const LONGEST: [f64; 2] = [1.0, 0.7];
/// Root mean square of the ways left, in cells, at which the targets are reached.
const REACHED: f64 = 0.2;
/// Halvings of a step until the flow ends.
const HALVINGS: usize = 6;
/// Least determinant of the deformation.
const LEAST_DETERMINANT: f64 = 0.02;

/// Computes the displacement of a deformation of one shape towards another one: none where no node lies inside of one of
/// them.
pub(crate) fn along_transport<const D: usize>(
    from: &Shape<D>,
    to: &Shape<D>,
    grid: &Grid<D>,
) -> Vec<f64> {
    let [from, to] = [from, to].map(|shape| Cloud::new(&on_grid(grid, &shape.union())));
    let mut psi = Field::zeros(*grid);
    if from.nodes.is_empty() || to.nodes.is_empty() {
        return psi.into_vec();
    }
    let goals = targets(&from, &to, grid);
    for _ in 0..STEPS {
        let Some(next) = step(&from, &goals, &psi) else {
            break;
        };
        psi = next;
    }
    psi.into_vec()
}

/// Moves a deformation towards the targets; `None` where they are reached, or every step folds.
fn step<const D: usize>(
    from: &Cloud<D>,
    goals: &[[f64; D]],
    psi: &Field<f64, D, D>,
) -> Option<Field<f64, D, D>> {
    let grid = *psi.grid();
    let h = grid.spacing();
    // The present positions, and what is left to the targets.
    let ways: Vec<([f64; D], [f64; D])> = from
        .nodes
        .iter()
        .zip(goals)
        .map(|(&node, goal)| {
            let point = psi.deformed(node);
            (point, std::array::from_fn(|k| goal[k] - point[k]))
        })
        .collect();
    let left: f64 = ways.iter().flat_map(|(_, way)| way).map(|x| x * x).sum();
    if left <= ways.len() as f64 * (REACHED * h).powi(2) {
        return None;
    }
    let sharpness = -0.5 / (WIDTH * h).powi(2);
    let velocities = parallel::map(0..grid.n_nodes(), &|node| {
        let y = psi.deformed(node);
        let (mut total, mut sum) = (FADING, [0.0; D]);
        for (point, way) in &ways {
            let apart: f64 = point.iter().zip(&y).map(|(p, y)| (p - y).powi(2)).sum();
            let weight = (sharpness * apart).exp();
            total += weight;
            for (sum, way) in sum.iter_mut().zip(way) {
                *sum += weight * way;
            }
        }
        sum.map(|sum| sum / total)
    });
    let mut velocity = Field::<f64, D, D>::zeros(grid);
    for k in 0..D {
        for (v, own) in velocity.component_mut(k).iter_mut().zip(&velocities) {
            *v = own[k];
        }
    }
    let largest = vector::max_abs(velocity.as_slice()).max(f64::MIN_POSITIVE);
    let mut factor = (LONGEST[0] * h / largest).min(LONGEST[1]);
    for _ in 0..HALVINGS {
        let mut next = psi.clone();
        for (u, v) in next.as_mut_slice().iter_mut().zip(velocity.as_slice()) {
            *u += factor * v;
        }
        if certify(&grid, next.as_slice(), LEAST_DETERMINANT).certified {
            return Some(next);
        }
        factor *= 0.5;
    }
    None
}
