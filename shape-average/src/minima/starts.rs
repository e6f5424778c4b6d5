//! Deformations to start minimisations from.

use crate::align::{Alignment, RigidMotion, poses};
use crate::error::AverageError;
use crate::params::{AverageParams, BoundaryCondition};
use fe_grid::random::noise;
use fe_grid::{Field, Grid, ScalarField};
use serde::Serialize;
use std::f64::consts::PI;

/// Largest norm of the gradient of a random displacement: its determinant is above .36 in 2D and
/// .2 in 3D. Half as much ends in the minimum of the identity in most cases, and much more in folds.
const STRAIN: f64 = 0.4;
/// Waves of a random displacement along an axis: half a wave and a whole one, as a bar bends.
const WAVES: usize = 2;
/// Poses by which a shape is turned less than this (2D, 3D), in radians, and moved less than the next
/// constant, are no other starts.
const LEAST_TURN: [f64; 2] = [0.2, 0.4];
/// Share of the longest side of the box.
const LEAST_SHIFT: f64 = 0.1;

/// Where a minimisation starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StartKind {
    /// The usual start.
    Usual,
    /// Other poses of shapes, see [`poses`].
    Pose,
    /// Smooth random deformations.
    Random,
}

/// Deformations to start from.
#[derive(Clone, Debug)]
pub struct Start<const D: usize> {
    /// How they were made.
    pub kind: StartKind,
    /// One displacement per shape; empty for the usual start.
    pub displacements: Vec<Field<f64, D, D>>,
    /// The motions that these are; empty but for other poses.
    pub motions: Vec<RigidMotion<D>>,
}

/// Computes `n` starts of an average that differ: the usual one; and then in turn other poses and random
/// deformations, on the coarsest grid.
///
/// The first pose start turns and moves every shape to where it fits the first shape best. Each of the
/// others has one shape at another of its good poses, in the order of their mismatch. There are none with
/// fixed faces, which rotations do not keep. Random displacements are sums of products of cosines with at
/// most two half waves along an axis, with random factors from fixed seeds, other ones for
/// every shape, and a gradient of at most 0.4, so that they are admissible; on fixed faces they are zero.
///
/// # Errors
/// Those of the alignment.
pub fn starts<const D: usize>(
    signed_distances: &[ScalarField<f64, D>],
    params: &AverageParams,
    n: usize,
) -> Result<Vec<Start<D>>, AverageError> {
    let Some(first) = signed_distances.first() else {
        return Err(AverageError::NoShapes);
    };
    let mut list = vec![Start {
        kind: StartKind::Usual,
        displacements: Vec::new(),
        motions: Vec::new(),
    }];
    if n < 2 {
        return Ok(list);
    }
    let coarsest = first.grid().hierarchy(params.coarsest_nodes)[0];
    let free = params.boundary == BoundaryCondition::Natural;
    let mut posed = if free {
        pose_starts(signed_distances)?
    } else {
        Vec::new()
    }
    .into_iter();
    let mut seed = 0;
    while list.len() < n {
        // The second, the fourth ..: a pose if there is one left.
        let motions = if list.len() % 2 == 1 {
            posed.next()
        } else {
            None
        };
        list.push(if let Some(motions) = motions {
            Start {
                kind: StartKind::Pose,
                displacements: motions.iter().map(|m| m.displacement(coarsest)).collect(),
                motions,
            }
        } else {
            seed += 1;
            let shapes = 0..signed_distances.len() as u64;
            let random = |shape| random(coarsest, free, seed << 32 | shape);
            Start {
                kind: StartKind::Random,
                displacements: shapes.map(random).collect(),
                motions: Vec::new(),
            }
        });
    }
    Ok(list)
}

/// Motions of all shapes to start from.
fn pose_starts<const D: usize>(
    shapes: &[ScalarField<f64, D>],
) -> Result<Vec<Vec<RigidMotion<D>>>, AverageError> {
    let extent = shapes[0].grid().extent();
    let middle: [f64; D] = std::array::from_fn(|k| 0.5 * extent[k]);
    let longest = extent.iter().fold(0.0f64, |a, &b| a.max(b));
    let differ = |a: &RigidMotion<D>, b: &RigidMotion<D>| {
        let squares = a.map(middle).into_iter().zip(b.map(middle));
        let shift: f64 = squares.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let turn = a.after(&b.inverse()).angle();
        turn > LEAST_TURN[usize::from(D == 3)] || shift > LEAST_SHIFT * longest
    };
    let usual = vec![RigidMotion::identity(); shapes.len()];
    let mut best = usual.clone();
    let mut others: Vec<(f64, usize, RigidMotion<D>)> = Vec::new();
    for (i, shape) in shapes.iter().enumerate().skip(1) {
        let found = poses(&shapes[0], shape)?;
        let Some(Alignment { motion, mismatch }) = found.first().copied() else {
            continue;
        };
        if differ(&motion, &best[i]) {
            best[i] = motion;
        }
        let worse = |pose: &Alignment<D>| (pose.mismatch - mismatch, i, pose.motion);
        others.extend(found.iter().skip(1).map(worse));
    }
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut list: Vec<Vec<RigidMotion<D>>> = Vec::new();
    let mut add = |motions: Vec<RigidMotion<D>>| {
        let mut known = std::iter::once(&usual).chain(&list);
        let differs =
            |other: &Vec<RigidMotion<D>>| motions.iter().zip(other).any(|(a, b)| differ(a, b));
        if known.all(differs) {
            list.push(motions);
        }
    };
    add(best.clone());
    for (_, shape, motion) in others {
        let mut motions = best.clone();
        motions[shape] = motion;
        add(motions);
    }
    Ok(list)
}

/// A smooth random displacement.
fn random<const D: usize>(grid: Grid<D>, free: bool, seed: u64) -> Field<f64, D, D> {
    let extent = grid.extent();
    let waves: Vec<[usize; D]> = (1..(WAVES + 1).pow(D as u32))
        .map(|code| std::array::from_fn(|k| code / (WAVES + 1).pow(k as u32) % (WAVES + 1)))
        .collect();
    let factors = noise(D * waves.len(), seed);
    let at = |x: [f64; D]| {
        let mut value = [0.0; D];
        for (j, wave) in waves.iter().enumerate() {
            let square: usize = wave.iter().map(|k| k * k).sum();
            let mut product = 1.0 / square as f64;
            for k in 0..D {
                let phase = PI * wave[k] as f64 * x[k] / extent[k];
                product *= phase.cos();
                if !free {
                    // Zero on the faces.
                    product *= (PI * x[k] / extent[k]).sin();
                }
            }
            for k in 0..D {
                value[k] += factors[k * waves.len() + j] * product;
            }
        }
        value
    };
    let mut field: Field<f64, D, D> = Field::from_fn(grid, at);
    let steepest = largest_difference(&grid, field.as_slice());
    let scale = if steepest > 0.0 {
        STRAIN / steepest
    } else {
        0.0
    };
    for value in field.as_mut_slice() {
        *value *= scale;
    }
    field
}

/// A bound of the norm of the gradient on all cells: the root of the sum of the squares of the largest
/// differences over an edge, by component and axis, relative to the spacing.
fn largest_difference<const D: usize>(grid: &Grid<D>, values: &[f64]) -> f64 {
    let (n, strides, nodes) = (grid.n_nodes(), grid.strides(), grid.nodes_per_axis());
    let mut sum = 0.0;
    for component in values.chunks_exact(n) {
        for k in 0..D {
            let edges = (0..n).filter(|&i| grid.node(i)[k] + 1 < nodes[k]);
            let slopes = edges.map(|i| (component[i + strides[k]] - component[i]).abs());
            let largest = slopes.fold(0.0, f64::max) / grid.spacing();
            sum += largest * largest;
        }
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::certify;

    #[test]
    fn random_starts_differ_and_are_admissible() {
        fn check<const D: usize>(least: f64) {
            let grid = Grid::<D>::dyadic(3);
            for seed in 0..20 {
                for free in [true, false] {
                    let field = random(grid, free, seed);
                    let certificate = certify(&grid, field.as_slice(), 0.0);
                    assert!(certificate.certified);
                    assert!(certificate.min_det > least, "{}", certificate.min_det);
                    let other = random(grid, free, seed + 1);
                    let difference: f64 = (field.as_slice().iter())
                        .zip(other.as_slice())
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max);
                    assert!(difference > 0.02, "{difference}");
                }
            }
        }
        check::<2>(0.36);
        check::<3>(0.2);
    }
}
