//! Second deformations for shapes that fit much worse than the others: by way of another shape.
//!
//! From coarse grids to fine, a shape that differs much from the average can end in a wrong minimum: of
//! twenty hands the one with the fingers spread had two fingers of the average between two of its own,
//! with ten times the energy of the others. Onto most other hands it is deformed well, and these onto the
//! average. So a shape `k` with a large energy is deformed onto a near shape `j` with a small one, by
//! `psi`, and `phi_j o psi` is where it starts anew, alone, with the average fixed. The deformation with
//! the smaller energy is kept: the functional never grows.
//!
//! A composition of deformations on a grid may fold in the void. Therefore it is approached from `psi`, by
//! steps that are damped around cells that would.
//!
//! This is done on the second finest grid, where it costs little; all shapes go on from there together.

use crate::error::AverageError;
use crate::floor::{energies_above, floors};
use crate::hierarchy::{Levels, inject, levels_of_visible, solve_levels, targets_of};
use crate::level::{LevelShapes, shape};
use crate::objective::AverageObjective;
use crate::params::{AverageParams, Mean};
use crate::quiet::Quiet;
use crate::reached::Reached;
use crate::result::Rematch;
use crate::second::SecondDeformations;
use crate::shapes::Shapes;
use fe_grid::minimise::{Control, Evaluation, Observer, Silent};
use fe_grid::{Distribution, Field, Grid, ScalarField, repair, restrain_step, vector};

/// A shape is deformed anew if its energy is this multiple of the median. Of horses, of frames of a dancer, and
/// of beetles with bats the largest is 1.2 to 1.9 times the median; of hands 9 times, where fingers lie on
/// wrong ones. With 1.5 in place of 3 a horse and a frame of a dancer changed by .1 and .02 % of their energy, for a
/// quarter more time.
const POOR: f64 = 3.0;
/// At most one shape in so many.
const ONE_IN: usize = 4;
/// Most other shapes that are tried on the coarser grid, those with the least energies.
const CANDIDATES: usize = 12;
/// Number of them by way of which it is deformed.
const WAYS: usize = 2;
/// Number of steps in which a composed deformation is approached.
const STEPS: usize = 4;
/// Fewer shapes have no median that tells which of them fits badly.
const LEAST_SHAPES: usize = 4;

/// The shapes of an average, of which those that fit badly are deformed anew.
pub(crate) struct ByOthers<'a, const D: usize> {
    /// The signed distances of all shapes on the finest level.
    pub signed_distances: &'a [ScalarField<f64, D>],
}

impl<const D: usize> SecondDeformations<D> for ByOthers<'_, D> {
    fn improve(
        &self,
        objective: &mut AverageObjective<D>,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<bool, AverageError> {
        rematch(objective, x, self.signed_distances, observer)
    }
}

/// Deforms shapes anew that fit badly; returns whether any was. Collective.
fn rematch<const D: usize>(
    objective: &mut AverageObjective<D>,
    x: &mut [f64],
    signed_distances: &[ScalarField<f64, D>],
    observer: &mut dyn Observer,
) -> Result<bool, AverageError> {
    // The last evaluation may have been that of a rejected trial.
    let Evaluation::Value(_) = objective.evaluate_energy(x)? else {
        return Ok(false);
    };
    let energies = energies_above(
        &floors(objective.shapes())?,
        &objective.weights().shapes,
        objective.weights().mismatch,
        objective.energy(),
    );
    let (poor, good) = poor_and_good(&energies);
    if poor.is_empty() {
        return Ok(false);
    }
    let distribution = objective.shapes().distribution().clone();
    let grid = *objective.grid();
    let dim = objective.shape_dim();
    let distances: Vec<_> = signed_distances.iter().map(|d| inject(&grid, d)).collect();
    let own = x.chunks_exact(dim).map(<[f64]>::to_vec).collect();
    let all = distribution.share_vectors(own, dim);
    let first = distribution.own().start;
    // Whether a shape of this process is deformed anew is known to this process only.
    let mut silent = Silent;
    let mut quiet = Quiet(observer);
    let observer: &mut dyn Observer = if distribution.is_alone() {
        &mut quiet
    } else {
        &mut silent
    };
    let mut found = vec![[0.0; 4]; distribution.own().len()];
    for k in poor {
        if !distribution.own().contains(&k) {
            continue;
        }
        let own = k - first;
        let least =
            objective.params().tolerance * objective.elastic_scale() / energies.len() as f64;
        let Some(before) = energy_of(objective, own, shape(x, own, dim))? else {
            continue;
        };
        let mut best = before - least;
        for j in nearest(&distances, k, &good, objective.params(), observer)? {
            if observer.between() == Control::Cancel {
                break;
            }
            let way = Way {
                shape: &distances[k],
                other: &distances[j],
                onward: &Field::from_vec(grid, all[j].clone())?,
            };
            let Some(u) = way.follow(objective, own, observer)? else {
                continue;
            };
            match energy_of(objective, own, &u)? {
                Some(energy) if energy < best => {
                    best = energy;
                    x[own * dim..][..dim].copy_from_slice(&u);
                    found[own] = [1.0, j as f64, before, energy];
                }
                _ => {}
            }
        }
    }
    let all = distribution.share(&found);
    objective.rematched = (0..).zip(all).filter_map(rematch_of).collect();
    Ok(!objective.rematched.is_empty())
}

fn rematch_of((shape, [found, other, before, after]): (usize, [f64; 4])) -> Option<Rematch> {
    (found > 0.0).then_some(Rematch {
        shape,
        by_way_of: other as usize,
        energies: [before, after],
    })
}

/// Returns the shapes with large energies, the largest first, and those with the least, the least first.
fn poor_and_good(energies: &[f64]) -> (Vec<usize>, Vec<usize>) {
    if energies.len() < LEAST_SHAPES {
        return (Vec::new(), Vec::new());
    }
    let mut order: Vec<usize> = (0..energies.len()).collect();
    order.sort_by(|&i, &j| energies[j].total_cmp(&energies[i]));
    let median = energies[order[order.len() / 2]];
    let poor = order.iter().filter(|&&i| energies[i] > POOR * median);
    let poor = poor.take(energies.len().div_ceil(ONE_IN)).copied();
    let good = order
        .iter()
        .rev()
        .take_while(|&&i| energies[i] <= median)
        .take(CANDIDATES);
    (poor.collect(), good.copied().collect())
}

/// Returns the shapes onto which shape `k` is deformed with the least energy, the first the least, as far as
/// the next coarser grid tells. Overlaps do not: two hands that are spread differently overlap best with
/// fingers on wrong ones.
fn nearest<const D: usize>(
    distances: &[ScalarField<f64, D>],
    k: usize,
    among: &[usize],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Vec<usize>, AverageError> {
    let Some(grid) = distances[k].grid().coarser() else {
        return Ok(Vec::new());
    };
    let params = AverageParams {
        weights: None,
        mean: Mean::Arithmetic,
        ..params.clone()
    };
    let own = inject(&grid, &distances[k]);
    let mut others: Vec<(f64, usize)> = Vec::new();
    for &j in among {
        let reached = deform(&own, &inject(&grid, &distances[j]), &params, observer)?;
        if reached.cancelled() {
            return Ok(Vec::new());
        }
        others.push((reached.energy().total, j));
    }
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(others.into_iter().map(|(_, j)| j).take(WAYS).collect())
}

/// Deforms a shape onto another one.
fn deform<const D: usize>(
    shape: &ScalarField<f64, D>,
    other: &ScalarField<f64, D>,
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Reached<D>, AverageError> {
    let [shape, other] = [shape, other].map(|field| Shapes::new(std::slice::from_ref(field)));
    let levels = levels_of_visible(shape, &[], params, &Distribution::alone(1))?;
    let problem = Levels::new(levels, params).onto(targets_of(other, params)?);
    solve_levels(problem, observer)
}

/// The weighted terms of one shape of this process, `None` where it folds.
fn energy_of<const D: usize>(
    objective: &AverageObjective<D>,
    own: usize,
    displacement: &[f64],
) -> Result<Option<f64>, AverageError> {
    let Some(corner) = objective.admissible(displacement) else {
        return Ok(None);
    };
    let terms = objective.shape_energy(own, displacement, corner, &mut [])?;
    Ok(terms.map(|terms| objective.weigh(own, &terms)))
}

/// A way to the average.
struct Way<'a, const D: usize> {
    shape: &'a ScalarField<f64, D>,
    other: &'a ScalarField<f64, D>,
    /// Displacement of the other shape onto the average.
    onward: &'a Field<f64, D, D>,
}

impl<const D: usize> Way<'_, D> {
    /// The displacement of the shape onto the average that minimises its terms, from the way by the other
    /// shape; `None` where this is cancelled.
    fn follow(
        &self,
        objective: &AverageObjective<D>,
        own: usize,
        observer: &mut dyn Observer,
    ) -> Result<Option<Vec<f64>>, AverageError> {
        let grid = *objective.grid();
        // The elastic weight of one shape, relative to the full weight of its mismatch.
        let n = objective.shapes().n_shapes() as f64;
        let first = objective.shapes().distribution().own().start;
        let params = AverageParams {
            weights: Some(vec![n * objective.weights().shapes[first + own]]),
            mean: Mean::Arithmetic,
            ..objective.params().clone()
        };
        let reached = deform(self.shape, self.other, &params, observer)?;
        if reached.cancelled() || *reached.shapes.grid() != grid {
            return Ok(None);
        }
        let way = self.composed(&grid, &reached.x, params.min_determinant);
        let level = LevelShapes::new(grid, std::slice::from_ref(self.shape), &params)?;
        let problem = Levels::new(vec![level], &params)
            .onto(vec![objective.average().to_vec()])
            .from(vec![&way]);
        let reached = solve_levels(problem, observer)?;
        Ok((!reached.cancelled()).then(|| reached.x.to_vec()))
    }

    /// The displacement of `phi_j o psi`, given that of `psi`. In the void it may fold; from `psi`, which does
    /// not, it is approached by steps that are damped there.
    fn composed(&self, grid: &Grid<D>, psi: &[f64], least_determinant: f64) -> Vec<f64> {
        let mut goal = self.onward.compose(psi).into_vec();
        vector::axpy(1.0, psi, &mut goal);
        let mut way = psi.to_vec();
        for _ in 0..STEPS {
            let mut step: Vec<f64> = goal.iter().zip(&way).map(|(g, w)| g - w).collect();
            restrain_step(grid, &way, &mut step, least_determinant, None);
            vector::axpy(1.0, &step, &mut way);
        }
        repair(grid, &mut way, least_determinant, None);
        way
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_far_above_the_median_are_poor_and_those_below_are_ways() {
        let energies = [1.0, 2.9, 0.5, 3.1, 0.8, 9.0, 1.2];
        // The median is 1.2.
        assert_eq!(poor_and_good(&energies), (vec![5], vec![2, 4, 0, 6]));
        let energies = [1.0, 9.0, 0.5, 8.0, 0.8, 7.0, 1.2];
        assert_eq!(poor_and_good(&energies).0, [1, 3], "one in four");
        assert_eq!(poor_and_good(&[1.0; 40]).0, [0usize; 0]);
        assert_eq!(poor_and_good(&[1.0; 40]).1.len(), CANDIDATES);
        assert_eq!(poor_and_good(&[1.0, 1.0, 9.0]).0, [0usize; 0], "too few");
    }
}
