//! The gradient descent of the lecture notes, level by level to given energies.

use std::error::Error;

use fe_grid::minimise::{Control, Iteration, Minimiser, Observer};
use fe_grid::transfer::{inject_into, prolong_into};
use fe_grid::{Field, ScalarField};
use shape_average::{Alternating, AverageObjective, AverageParams, LevelShapes};

/// The energy is recorded after these multiples of the evaluations of the other solver; the descent
/// on a level ends after the last.
pub const MULTIPLES: [usize; 4] = [1, 10, 30, 60];
const CAP: usize = MULTIPLES[3];

/// The descent, one level after the other.
pub struct LevelDescent<'a, const D: usize> {
    params: &'a AverageParams,
    /// Signed distances on every level, coarsest first.
    distances: Vec<Vec<ScalarField<f64, D>>>,
    /// Displacements and average on the last level that was run.
    displacements: Vec<f64>,
    average: Vec<f64>,
}

/// Measurements of the descent on a level.
pub struct Descended {
    /// Evaluations of one shape's energy.
    pub evaluations: usize,
    /// Energy at the end.
    pub energy: f64,
    /// Energy of the undeformed shapes.
    pub undeformed: f64,
    /// Whether that is the required energy.
    pub reached: bool,
    /// Energies after the multiples of the evaluations.
    pub passed: [Option<f64>; MULTIPLES.len()],
}

impl<'a, const D: usize> LevelDescent<'a, D> {
    /// Creates the descent with undeformed shapes on the coarsest level.
    pub fn new(shapes: &[ScalarField<f64, D>], params: &'a AverageParams) -> Self {
        let grids = shapes[0].grid().hierarchy(params.coarsest_nodes);
        let mut distances = vec![shapes.to_vec()];
        for grid in grids.iter().rev().skip(1) {
            let coarser = distances[distances.len() - 1].iter().map(|fine| {
                let mut coarse = Field::zeros(*grid);
                inject_into(grid, fine.as_slice(), coarse.as_mut_slice());
                coarse
            });
            distances.push(coarser.collect());
        }
        distances.reverse();
        Self {
            params,
            displacements: vec![0.0; D * grids[0].n_nodes() * shapes.len()],
            average: vec![1.0; grids[0].n_nodes()],
            distances,
        }
    }

    /// Minimises on the next level until `target` is reached, or until the last of [`MULTIPLES`]
    /// times `unit` evaluations. `watch` is called with the evaluations so far and the energy of every
    /// outer iteration.
    pub fn descend(
        &mut self,
        level: usize,
        target: f64,
        unit: usize,
        watch: &mut dyn FnMut(usize, f64),
    ) -> Result<Descended, Box<dyn Error + Send + Sync>> {
        if level > 0 {
            self.prolong(level);
        }
        let distances = &self.distances[level];
        let shapes = LevelShapes::new(*distances[0].grid(), distances, self.params)?;
        let average = self.average.clone();
        let mut objective = AverageObjective::new(shapes, self.params, average)?;
        let method = Alternating {
            max_iterations: usize::MAX - 1,
            tolerance: 0.0,
            target: Some(target),
        };
        let mut count = Count {
            n_shapes: distances.len(),
            unit,
            evaluations: 0,
            passed: [None; MULTIPLES.len()],
            watch,
        };
        let info = method.minimise(&mut objective, &mut self.displacements, &mut count)?;
        let (evaluations, passed) = (count.evaluations, count.passed);
        let energy = info.energy().ok_or("a fold on the way up")?;
        self.average = objective.average().to_vec();
        let still = vec![0.0; self.displacements.len()];
        objective.solve_average(&still)?;
        let undeformed = objective.at_present_average(&still, &mut [])?;
        Ok(Descended {
            evaluations,
            energy,
            undeformed: undeformed.map_or(f64::NAN, |e| e.objective()),
            reached: energy <= target,
            passed,
        })
    }

    fn prolong(&mut self, level: usize) {
        let coarse = *self.distances[level - 1][0].grid();
        let nodes = self.distances[level][0].grid().n_nodes();
        let mut finer = vec![0.0; D * nodes * self.distances[level].len()];
        let parts = self.displacements.chunks_exact(D * coarse.n_nodes());
        for (u, finer) in parts.zip(finer.chunks_exact_mut(D * nodes)) {
            prolong_into(&coarse, u, finer);
        }
        let mut average = vec![0.0; nodes];
        prolong_into(&coarse, &self.average, &mut average);
        (self.displacements, self.average) = (finer, average);
    }
}

/// Counts evaluations of single shapes, and cancels after the last multiple.
struct Count<'a> {
    n_shapes: usize,
    /// Number of evaluations of the other solver.
    unit: usize,
    evaluations: usize,
    passed: [Option<f64>; MULTIPLES.len()],
    watch: &'a mut dyn FnMut(usize, f64),
}

impl Observer for Count<'_> {
    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        // Every outer iteration evaluates the functional, and so all shapes, once.
        let outer = iteration.iteration + 1;
        let work = iteration.evaluations;
        self.evaluations = work.gradients + work.values - outer + self.n_shapes * outer;
        for (passed, multiple) in self.passed.iter_mut().zip(MULTIPLES) {
            if self.evaluations >= multiple * self.unit {
                passed.get_or_insert(iteration.energy);
            }
        }
        (self.watch)(self.evaluations, iteration.energy);
        if self.evaluations >= CAP * self.unit {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}
