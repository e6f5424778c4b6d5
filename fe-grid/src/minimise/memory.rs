//! What a solver remembers between two iterations, or of its result, to go on from there to the same bits.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::info::{Evaluations, Status};
use super::pair_vector::PairVector;

/// The memory of a run: of L-BFGS after an iteration in which the metric has been recomputed, or the
/// result of any solver at its end. With the same objective and parameters, a run that resumes from it
/// gives the bits of the run that it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory<'a> {
    /// The state.
    pub x: Cow<'a, [f64]>,
    /// The gradient there, or another vector that the solver goes on from.
    pub gradient: Cow<'a, [f64]>,
    /// The pairs, oldest first.
    pub pairs: Vec<MemoryPair<'a>>,
    /// The energies so far; the last is that of the state.
    pub energies: Cow<'a, [f64]>,
    /// Size of the gradient at the start.
    pub first_gradient_norm: f64,
    /// Factor of the last step.
    pub step_length: f64,
    /// Work so far.
    pub evaluations: Evaluations,
    /// What the objective remembers of earlier evaluations.
    pub objective: Cow<'a, [f64]>,
    /// How the run has ended; `None` within it. At the end there are no pairs and no gradient.
    pub ended: Option<Ended>,
}

/// The ways in which a run can end, by their numbers.
const STATUSES: [Status; 7] = [
    Status::GradientTolerance,
    Status::EnergyTolerance,
    Status::MaxIterations,
    Status::LineSearchFailed,
    Status::IndefiniteMetric,
    Status::Cancelled,
    Status::InadmissibleStart,
];

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// Its status.
    pub status: Status,
    /// Size of the last gradient.
    pub gradient_norm: f64,
}

/// A step and the change of the gradient along it, both scaled.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryPair<'a> {
    /// The step.
    pub step: MemoryVector<'a>,
    /// The change of the gradient.
    pub change: MemoryVector<'a>,
    /// The inverse of their scalar product.
    pub inverse_curvature: f64,
    /// The size of the step over the size of the change.
    pub ratio: f64,
}

/// A vector of a pair: numbers in single precision, however the run keeps them.
#[derive(Clone, Debug)]
pub struct MemoryVector<'a>(Kept<'a>);

#[derive(Clone, Debug)]
enum Kept<'a> {
    Here(Vec<f32>),
    InRun(&'a PairVector),
}

impl<'a> MemoryVector<'a> {
    /// That of a run, which is converted when its numbers are asked for.
    pub(super) fn of_run(vector: &'a PairVector) -> Self {
        Self(Kept::InRun(vector))
    }

    /// The numbers.
    pub fn numbers(&self) -> Cow<'_, [f32]> {
        match &self.0 {
            Kept::Here(numbers) => numbers.into(),
            Kept::InRun(vector) => vector.numbers(),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match &self.0 {
            Kept::Here(numbers) => numbers.len(),
            Kept::InRun(vector) => vector.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl PartialEq for MemoryVector<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.numbers() == other.numbers()
    }
}

impl From<Vec<f32>> for MemoryVector<'_> {
    fn from(numbers: Vec<f32>) -> Self {
        Self(Kept::Here(numbers))
    }
}

impl<'a> Memory<'a> {
    /// The result of a solver that is not a minimiser, with further numbers that describe it.
    pub fn of_result(x: &'a [f64], numbers: Vec<f64>) -> Self {
        Self {
            x: x.into(),
            gradient: Cow::Borrowed(&[]),
            pairs: Vec::new(),
            energies: Cow::Borrowed(&[]),
            first_gradient_norm: 0.0,
            step_length: 0.0,
            evaluations: Evaluations::default(),
            objective: numbers.into(),
            ended: Some(Ended {
                status: Status::GradientTolerance,
                gradient_norm: 0.0,
            }),
        }
    }

    /// The result of such a solver, and the numbers, if there are so many of each.
    pub fn result<const N: usize>(&self, dim: usize) -> Option<(&[f64], [f64; N])> {
        let numbers = self.objective.as_ref().try_into().ok()?;
        let is_result = self.ended.is_some() && self.x.len() == dim && self.energies.is_empty();
        is_result.then_some((&*self.x, numbers))
    }
}

impl Memory<'_> {
    /// A copy of its own.
    pub fn into_owned(self) -> Memory<'static> {
        let own = |pair: MemoryPair<'_>| MemoryPair {
            step: pair.step.numbers().into_owned().into(),
            change: pair.change.numbers().into_owned().into(),
            inverse_curvature: pair.inverse_curvature,
            ratio: pair.ratio,
        };
        Memory {
            x: self.x.into_owned().into(),
            gradient: self.gradient.into_owned().into(),
            pairs: self.pairs.into_iter().map(own).collect(),
            energies: self.energies.into_owned().into(),
            first_gradient_norm: self.first_gradient_norm,
            step_length: self.step_length,
            evaluations: self.evaluations,
            objective: self.objective.into_owned().into(),
            ended: self.ended,
        }
    }

    /// All but the vectors, as numbers.
    pub fn to_numbers(&self) -> [f64; 9] {
        let work = &self.evaluations;
        let (status, gradient_norm) = self.ended.map_or((-1.0, 0.0), |ended| {
            let place = STATUSES.iter().position(|status| *status == ended.status);
            (
                place.map_or(-1.0, |place| place as f64),
                ended.gradient_norm,
            )
        });
        [
            self.first_gradient_norm,
            self.step_length,
            status,
            gradient_norm,
            work.values as f64,
            work.gradients as f64,
            work.metric_applications as f64,
            work.metric_builds as f64,
            work.hessian_actions as f64,
        ]
    }

    /// Takes over what [`Self::to_numbers`] has returned.
    pub fn set_numbers(&mut self, numbers: &[f64; 9]) {
        let [first, step, status, gradient_norm, work @ ..] = *numbers;
        self.first_gradient_norm = first;
        self.step_length = step;
        let [values, gradients, applications, builds, actions] = work.map(|count| count as usize);
        self.evaluations = Evaluations {
            values,
            gradients,
            metric_applications: applications,
            metric_builds: builds,
            hessian_actions: actions,
        };
        let place = (status >= 0.0).then_some(status as usize);
        self.ended = place
            .and_then(|place| STATUSES.get(place))
            .map(|status| Ended {
                status: *status,
                gradient_norm,
            });
    }

    /// Bytes of its vectors.
    pub fn bytes(&self) -> usize {
        let pair = |pair: &MemoryPair<'_>| (pair.step.len() + pair.change.len()) * size_of::<f32>();
        size_of_val(&*self.x)
            + size_of_val(&*self.gradient)
            + size_of_val(&*self.objective)
            + self.pairs.iter().map(pair).sum::<usize>()
    }

    /// Whether it is that of a minimiser with this number of unknowns and of at most so many pairs.
    pub fn fits(&self, dim: usize, pairs: usize) -> bool {
        let fits = |pair: &MemoryPair<'_>| pair.step.len() == dim && pair.change.len() == dim;
        self.x.len() == dim
            && (self.gradient.len() == dim || self.ended.is_some())
            && self.pairs.len() <= pairs
            && self.pairs.iter().all(fits)
            && !self.energies.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_restore_all_but_the_vectors() {
        let mut memory = Memory::of_result(&[], Vec::new());
        memory.first_gradient_norm = 0.5;
        memory.step_length = 0.25;
        memory.evaluations = Evaluations {
            values: 1,
            gradients: 2,
            metric_applications: 3,
            metric_builds: 4,
            hessian_actions: 5,
        };
        for status in STATUSES.map(Some).into_iter().chain([None]) {
            memory.ended = status.map(|status| Ended {
                status,
                gradient_norm: 0.125,
            });
            let mut copy = Memory::of_result(&[], Vec::new());
            copy.set_numbers(&memory.to_numbers());
            assert_eq!(copy, memory);
        }
    }
}
