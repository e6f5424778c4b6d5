//! The record of a minimisation in rounds, see [`confirm`](crate::confirm).

use fe_grid::minimise::{Evaluations, Info};

/// Factor of the tolerance from each round to the next.
const TIGHTER: f64 = 0.2;

/// What the rounds before the present one have left.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Rounds {
    pub count: usize,
    /// Energies of their iterations.
    pub energies: Vec<f64>,
    evaluations: Evaluations,
}

impl Rounds {
    /// Factor of the tolerance in the present round.
    pub fn tightening(&self) -> f64 {
        TIGHTER.powi(self.count as i32)
    }

    /// The record as numbers, for a checkpoint.
    pub fn to_numbers(&self) -> Vec<f64> {
        let work = &self.evaluations;
        let counts = [
            self.count,
            work.values,
            work.gradients,
            work.metric_applications,
            work.metric_builds,
            work.hessian_actions,
        ];
        let counts = counts.into_iter().map(|count| count as f64);
        counts.chain(self.energies.iter().copied()).collect()
    }

    /// The inverse of [`Self::to_numbers`]; the first round where there are too few numbers.
    pub fn from_numbers(numbers: &[f64]) -> Self {
        let Some((counts, energies)) = numbers.split_first_chunk() else {
            return Self::default();
        };
        let [count, values, gradients, applications, builds, actions]: [usize; 6] =
            counts.map(|count: f64| count as usize);
        Self {
            count,
            energies: energies.to_vec(),
            evaluations: Evaluations {
                values,
                gradients,
                metric_applications: applications,
                metric_builds: builds,
                hessian_actions: actions,
            },
        }
    }

    /// Adds the record of a round; returns that of all.
    pub fn append(&mut self, round: &Info) -> Info {
        // A round begins with the last state of the one before.
        let known = usize::from(!self.energies.is_empty());
        self.energies.extend(round.energies.iter().skip(known));
        self.evaluations += round.evaluations;
        self.count += 1;
        Info {
            iterations: self.energies.len().saturating_sub(1),
            evaluations: self.evaluations,
            energies: self.energies.clone(),
            ..round.clone()
        }
    }
}
