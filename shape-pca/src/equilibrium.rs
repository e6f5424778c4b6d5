//! Brings the stresses of an average into balance by motions of the average itself.
//!
//! A displacement `w` of the average changes all deformations alike, `phi_i -> (1 + w) o phi_i`, and
//! leaves the shapes matched with each other. The elastic energy of the objects
//!
//! ```text
//! E[w] = sum_i lambda_i int_(O_i) W(D((1 + w) o phi_i))
//! ```
//!
//! has the derivative `sum_i lambda_i int_O sigma_i : D.` at `w = 0`: at its minimum the stresses
//! balance, in the object and on its boundary. A minimum of the functional of averages is not one of
//! `E`, because there the length of the boundary, the void, and the mismatch, which on a grid depends
//! on the place of the boundary, balance the rest; and its minimiser ends before the minimum.
//!
//! `E` is minimised by Newton's method: in every round its gradient and its Hessian at zero are those of
//! [`Compound`], and the deformations `(1 + w) o phi_i` are interpolated on the grid.

use crate::average::Average;
use crate::error::PcaError;
use crate::operator::Compound;
use crate::params::PcaParams;
use crate::product::object_product;
use fe_grid::minimise::{Memory, Observer, together};
use fe_grid::vector::{axpy, dot, scale};
use fe_grid::{Field, GridError, VectorField, compiled_once, restrain_step};
use serde::Serialize;

/// Most rounds.
const MOST_ROUNDS: usize = 8;
/// Most halvings of a motion that does not lower the energy.
const MOST_HALVINGS: usize = 4;
/// Share of the residual of a Newton step, by whose size the imbalance is measured.
const FORCING: f64 = 1e-3;
/// The same of the displacements of single shapes, of which the mean size is needed.
const FORCING_OF_SHAPES: f64 = 1e-2;
/// Most iterations of a linear solve. Where the operator is hardly definite more of them follow what is
/// hardly determined.
const MOST_ITERATIONS: usize = 200;

/// When the stresses of an average balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balancing {
    /// An imbalance of at most this is balance: nothing is changed there, and a change that does not reach
    /// it is taken back.
    pub enough: f64,
    /// What is changed is changed until the imbalance is at most this, if it can be.
    pub target: f64,
    /// Lower bound of the determinants of the deformations.
    pub min_determinant: f64,
}

impl Default for Balancing {
    /// The first is below the limit of [`levelset::Cause::StressBalance`] by the error of the measurement,
    /// which is less exact than that of [`Pca`](crate::Pca). Of fish at 129 nodes a side the last rounds
    /// reach 0.023: interpolation of the deformations then costs more energy than a motion wins.
    fn default() -> Self {
        Self {
            enough: 0.028,
            target: 0.01,
            min_determinant: 1e-3,
        }
    }
}

/// What was done to balance the stresses.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BalanceReport {
    /// `|sum lambda_k u_k| / sum lambda_k |u_k|` in `L^2` of the object, at first and after every round.
    pub imbalance: Vec<f64>,
    /// The elastic energy of the objects, at first and after every round.
    pub elastic: Vec<f64>,
    /// Whether the stresses balance in the end; the average is left as it was where they do not.
    pub balanced: bool,
}

impl BalanceReport {
    /// Returns whether the average has changed.
    pub fn changed(&self) -> bool {
        self.balanced && self.imbalance.len() > 1
    }
}

compiled_once! {
    fn balance<'a, D>(
        balancing: &'a Balancing,
        average: &'a Average<D>,
        params: &'a PcaParams,
        observer: &'a mut dyn Observer,
    ) -> Result<(Average<D>, BalanceReport), PcaError> = Balancing::rounds;
}

impl Balancing {
    /// Moves an average until its stresses balance; returns it with a report. It stays as it is where
    /// they balance already, and where they cannot be balanced: parts that are folded almost have large
    /// stresses in directions of negative curvature, and the modes would be those of the folds. The observer
    /// is given the state after every round, and may have one from an earlier run. Of an average that is
    /// [distributed](Average::distributed) the observer of the first process is asked. Collective.
    ///
    /// # Errors
    /// Those of the law and of the linear solves.
    pub fn balance<const D: usize>(
        &self,
        average: &Average<D>,
        params: &PcaParams,
        observer: &mut dyn Observer,
    ) -> Result<(Average<D>, BalanceReport), PcaError> {
        together(average.distribution(), observer, |observer| {
            balance(self, average, params, observer)
        })
    }

    fn rounds<const D: usize>(
        &self,
        average: &Average<D>,
        params: &PcaParams,
        observer: &mut dyn Observer,
    ) -> Result<(Average<D>, BalanceReport), PcaError> {
        let params = PcaParams {
            at_rest: false,
            ..*params
        };
        let memory = observer.resume();
        let known = memory.and_then(|memory| Rounds::of_memory(&memory, average));
        let Rounds {
            mut moving,
            mut report,
            typical,
            ended,
        } = match known {
            Some(rounds) => rounds,
            None => Rounds::first(average, &params)?,
        };
        if !ended {
            let mut compound = Compound::new(&moving, &params)?;
            loop {
                let step = compound.descend(compound.imbalance(), FORCING, MOST_ITERATIONS);
                let found = size(&moving, &step) / typical;
                let first = report.imbalance.is_empty();
                report.imbalance.push(found);
                report.elastic.push(compound.energy());
                let limit = if first { self.enough } else { self.target };
                if found <= limit || report.imbalance.len() > MOST_ROUNDS {
                    break;
                }
                let Some(lower) = self.lower(&moving, &compound, step)? else {
                    break;
                };
                // The old one is freed first; two at a time would double the memory.
                drop(compound);
                compound = Compound::new(&lower, &params)?;
                moving = lower;
                remember(&moving, &report, typical, false, observer);
            }
            remember(&moving, &report, typical, true, observer);
        }
        report.balanced = report
            .imbalance
            .last()
            .is_some_and(|last| *last <= self.enough);
        let found = if report.changed() {
            moving
        } else {
            average.clone()
        };
        Ok((found, report))
    }

    /// The average moved against a step, or by a part of it; `None` where that does not lower the energy.
    fn lower<const D: usize>(
        &self,
        average: &Average<D>,
        compound: &Compound<D>,
        step: Vec<f64>,
    ) -> Result<Option<Average<D>>, PcaError> {
        let mut motion = VectorField::from_vec(*average.grid(), step)?;
        scale(-1.0, motion.as_mut_slice());
        for _ in 0..=MOST_HALVINGS {
            let moved = self.moved(average, &motion)?;
            match compound.energy_of(&moved) {
                Ok(energy) if energy < compound.energy() => return Ok(Some(moved)),
                Ok(_) | Err(PcaError::Grid(GridError::Inadmissible { .. })) => {}
                Err(error) => return Err(error),
            }
            scale(0.5, motion.as_mut_slice());
        }
        Ok(None)
    }

    /// The average with `(1 + w) o phi_i` for `phi_i`, interpolated at the nodes. Where that folds,
    /// mostly in squeezed parts of the void, the change is damped.
    fn moved<const D: usize>(
        &self,
        average: &Average<D>,
        motion: &VectorField<f64, D>,
    ) -> Result<Average<D>, PcaError> {
        let own = average.displacements()[average.distribution().own()].iter();
        let own = own.map(|u| {
            let mut step = motion.compose(u.as_slice()).into_vec();
            restrain_step(
                average.grid(),
                u.as_slice(),
                &mut step,
                self.min_determinant,
                None,
            );
            let mut moved = u.clone().into_vec();
            axpy(1.0, &step, &mut moved);
            moved
        });
        average.with(average.share_displacements(own.collect())?)
    }
}

/// What the rounds go on from.
struct Rounds<const D: usize> {
    moving: Average<D>,
    report: BalanceReport,
    /// Mean size of the displacements of the shapes.
    typical: f64,
    /// Whether there are no more rounds.
    ended: bool,
}

impl<const D: usize> Rounds<D> {
    fn first(average: &Average<D>, params: &PcaParams) -> Result<Self, PcaError> {
        let typical = typical_size(average, &Compound::new(average, params)?)?;
        Ok(Self {
            moving: average.clone(),
            report: BalanceReport::default(),
            typical: typical.max(f64::MIN_POSITIVE),
            ended: false,
        })
    }

    /// The inverse of [`remember`]; `None` for the memory of something else.
    fn of_memory(memory: &Memory<'_>, average: &Average<D>) -> Option<Self> {
        let distribution = average.distribution();
        let dim = D * average.grid().n_nodes();
        let numbers = memory.objective.split_first();
        let fits = memory.x.len() == dim * distribution.own().len()
            && numbers.is_some_and(|(_, numbers)| numbers.len().is_multiple_of(2));
        // All processes go on together.
        let (typical, numbers) = numbers.filter(|_| distribution.all(fits))?;
        let (imbalance, elastic) = numbers.split_at(numbers.len() / 2);
        let report = BalanceReport {
            imbalance: imbalance.to_vec(),
            elastic: elastic.to_vec(),
            balanced: false,
        };
        let own = memory.x.chunks_exact(dim).map(<[f64]>::to_vec);
        let displacements = average.share_displacements(own.collect()).ok()?;
        Some(Self {
            moving: average.with(displacements).ok()?,
            report,
            typical: *typical,
            ended: memory.ended.is_some(),
        })
    }
}

/// Gives the state after a round to an observer.
fn remember<const D: usize>(
    moving: &Average<D>,
    report: &BalanceReport,
    typical: f64,
    ended: bool,
    observer: &mut dyn Observer,
) {
    let own = moving.displacements()[moving.distribution().own()].iter();
    let x: Vec<f64> = own.flat_map(Field::as_slice).copied().collect();
    let numbers = [&[typical][..], &report.imbalance, &report.elastic].concat();
    let result = Memory::of_result(&x, numbers);
    observer.memory(&Memory {
        ended: result.ended.filter(|_| ended),
        ..result
    });
}

/// The `L^2` norm of a displacement on the object.
fn size<const D: usize>(average: &Average<D>, u: &[f64]) -> f64 {
    dot(u, &object_product(average.object(), u)).max(0.0).sqrt()
}

/// `sum lambda_k |u_k|`.
fn typical_size<const D: usize>(
    average: &Average<D>,
    compound: &Compound<D>,
) -> Result<f64, PcaError> {
    let distribution = average.distribution();
    let of = |i: usize| {
        let load = compound.load(average.source(i))?;
        let u = compound.descend(&load, FORCING_OF_SHAPES, MOST_ITERATIONS);
        Ok([size(average, &u)])
    };
    let own: Result<Vec<_>, PcaError> = distribution.own().map(of).collect();
    let sizes = distribution.share(&own?).into_iter();
    let parts = average.weights().iter().zip(sizes);
    Ok(parts.fold(0.0, |sum, (weight, [size])| sum + weight * size))
}
