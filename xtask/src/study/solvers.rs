//! The work of both solvers.

use std::path::Path;
use std::time::Instant;

use fe_grid::minimise::{Control, Iteration, Minimiser, Observer, Silent};
use fe_grid::transfer::{inject_into, prolong_into};
use fe_grid::{Field, ScalarField};
use shape_average::{
    Alternating, AverageObjective, AverageParams, AverageResult, LevelShapes, average,
};
use shapespace::generate::{Family, family};

use super::{Outcome, Section, shapes};
use crate::table::{Table, checked};

/// Most iterations that are asked for on a level.
pub const ITERATIONS: usize = 40;
/// The descent is to need this many times the evaluations of L-BFGS.
const RATIO: f64 = 30.0;
/// Its energy is looked at after these multiples; after the last it is given up on a level.
const MULTIPLES: [usize; 4] = [1, 10, 30, 60];
const CAP: usize = MULTIPLES[3];

/// A group of shapes and its average by L-BFGS.
pub struct Group {
    name: String,
    shapes: Vec<ScalarField<f64, 2>>,
    params: AverageParams,
    result: AverageResult<2>,
}

/// Bars, crosses, and four device7 silhouettes where there are data.
pub fn groups(data: Option<&Path>) -> Outcome<Vec<Group>> {
    let mut groups = Vec::new();
    for nodes in [65, 129] {
        groups.push(group(format!("bars, {nodes}²"), shapes::bars(nodes)?)?);
    }
    let crosses = family::<2>(Family::Crosses, 0).unwrap_or_default();
    let crosses: Outcome<Vec<_>> = crosses
        .iter()
        .map(|member| shapes::drawn(member.shape.as_ref(), 0.0, 65))
        .collect();
    groups.push(group("crosses, 65²".into(), crosses?)?);
    if let Some(data) = data {
        let files = [1, 2, 3, 5].map(|i| data.join(format!("mpeg7/device7/device7-{i:02}.png")));
        for nodes in [65, 129] {
            let shapes = shapes::aligned_files(&files, nodes)?;
            groups.push(group(format!("device7 01, 02, 03, 05, {nodes}²"), shapes)?);
        }
    }
    Ok(groups)
}

fn group(name: String, shapes: Vec<ScalarField<f64, 2>>) -> Outcome<Group> {
    let params = AverageParams::default();
    let result = average(&shapes, &params, &mut Silent)?;
    Ok(Group {
        name,
        shapes,
        params,
        result,
    })
}

/// Iterations on every level.
pub fn iterations(groups: &[Group]) -> Section {
    let mut table = Table::new([
        "shapes",
        "iterations by level",
        "evaluations of a shape",
        "solves for the average, CG iterations",
        "mean Dice",
        "least det",
        "seconds",
    ]);
    for group in groups {
        let levels = &group.result.levels;
        let cells = levels.iter().map(|level| {
            let text = format!("{}", level.iterations);
            checked(
                text,
                level.iterations <= ITERATIONS && level.status.converged(),
            )
        });
        let result = &group.result;
        table.row([
            group.name.clone(),
            cells.collect::<Vec<_>>().join(", "),
            result.shape_evaluations().to_string(),
            levels
                .iter()
                .map(|l| l.average_iterations)
                .sum::<usize>()
                .to_string(),
            format!("{:.4}", result.mean_dice()),
            checked(
                format!("{:.3}", result.certificate.min_det),
                result.certificate.certified,
            ),
            format!("{:.2}", result.seconds),
        ]);
    }
    Section {
        title: "Iterations of L-BFGS",
        text: "Levels from 9 nodes a side, coarsest first; 40 iterations or fewer on each are \
               asked for.",
        table,
    }
}

/// Evaluations that the descent needs to come down to the energy of L-BFGS.
pub fn against_descent(groups: &[Group]) -> Outcome<Section> {
    let mut table = Table::new([
        "shapes",
        "nodes",
        "energy of L-BFGS",
        "its evaluations",
        "evaluations of the descent",
        "ratio",
        "above it after 1, 10, 30, 60 times its evaluations",
        "seconds",
    ]);
    for group in groups {
        compare(group, &mut table)?;
    }
    Ok(Section {
        title: "The descent against L-BFGS",
        text: "Both go from coarse levels to fine, each from where it has come itself. The descent \
               goes on, level by level, until its energy is as low as that of L-BFGS on this level, \
               or until it has taken 60 times the evaluations. An evaluation is one of a single \
               shape's energy, with or without gradient. How far it still lies above on the way is \
               given as a share of what L-BFGS lies below the undeformed shapes. A ratio of 30 is \
               asked for.",
        table,
    })
}

fn compare(group: &Group, table: &mut Table) -> Outcome<()> {
    let mut descent = LevelDescent::new(group);
    let (mut fast, mut slow, mut capped, mut seconds) = (0, 0, false, 0.0);
    for (level, report) in group.result.levels.iter().enumerate() {
        let target = report.energies[report.iterations];
        let found = descent.descend(level, target, report.shape_evaluations)?;
        fast += report.shape_evaluations;
        slow += found.evaluations;
        capped |= !found.reached;
        seconds += found.seconds;
        let ratio = found.evaluations as f64 / report.shape_evaluations as f64;
        let drop = found.undeformed - target;
        let above = found.passed.iter().map(|energy| {
            let energy = energy.unwrap_or(found.energy);
            format!("{:.2}", (100.0 * (energy - target) / drop).max(0.0))
        });
        table.row([
            group.name.clone(),
            format!("{}²", report.nodes[0]),
            format!("{target:.7}"),
            report.shape_evaluations.to_string(),
            found.evaluations.to_string(),
            format!("{}{ratio:.0}", if found.reached { "" } else { "> " }),
            format!("{} %", above.collect::<Vec<_>>().join(", ")),
            format!("{:.1} / {:.1}", report.seconds, found.seconds),
        ]);
    }
    let ratio = slow as f64 / fast as f64;
    let text = format!("{}{ratio:.0}", if capped { "> " } else { "" });
    table.row([
        group.name.clone(),
        "all".into(),
        String::new(),
        fast.to_string(),
        slow.to_string(),
        checked(text, ratio >= RATIO),
        String::new(),
        format!("{:.1} / {seconds:.1}", group.result.seconds),
    ]);
    Ok(())
}

/// The descent, one level after the other.
struct LevelDescent<'a> {
    params: &'a AverageParams,
    /// Signed distances on every level, coarsest first.
    distances: Vec<Vec<ScalarField<f64, 2>>>,
    /// Displacements and average on the last level that was run.
    displacements: Vec<f64>,
    average: Vec<f64>,
}

/// What the descent did on a level.
struct Descended {
    evaluations: usize,
    energy: f64,
    /// Energy of the undeformed shapes.
    undeformed: f64,
    reached: bool,
    /// Energies when the multiples of the evaluations were passed.
    passed: [Option<f64>; MULTIPLES.len()],
    seconds: f64,
}

impl<'a> LevelDescent<'a> {
    fn new(group: &'a Group) -> Self {
        let grids = group.shapes[0]
            .grid()
            .hierarchy(group.params.coarsest_nodes);
        let mut distances = vec![group.shapes.clone()];
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
            params: &group.params,
            displacements: vec![0.0; 2 * grids[0].n_nodes() * group.shapes.len()],
            average: vec![1.0; grids[0].n_nodes()],
            distances,
        }
    }

    fn descend(&mut self, level: usize, target: f64, unit: usize) -> Outcome<Descended> {
        let start = Instant::now();
        if level > 0 {
            self.prolong(level);
        }
        let distances = &self.distances[level];
        let shapes = LevelShapes::new(*distances[0].grid(), distances, self.params)?;
        let average = self.average.clone();
        let mut objective = AverageObjective::new(shapes, self.params, average);
        let method = Alternating {
            max_iterations: usize::MAX - 1,
            tolerance: 0.0,
            energy_floor: 0.0,
            target: Some(target),
        };
        let mut count = Count {
            n_shapes: distances.len(),
            unit,
            evaluations: 0,
            passed: [None; MULTIPLES.len()],
        };
        let info = method.minimise(&mut objective, &mut self.displacements, &mut count)?;
        let energy = info.energy().ok_or("a fold on the way up")?;
        self.average = objective.average().to_vec();
        let still = vec![0.0; self.displacements.len()];
        objective.solve_average(&still)?;
        let undeformed = objective.at_present_average(&still, &mut [])?;
        Ok(Descended {
            evaluations: count.evaluations,
            energy,
            undeformed: undeformed.map_or(f64::NAN, |e| e.objective()),
            reached: energy <= target,
            passed: count.passed,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    fn prolong(&mut self, level: usize) {
        let coarse = *self.distances[level - 1][0].grid();
        let nodes = self.distances[level][0].grid().n_nodes();
        let mut finer = vec![0.0; 2 * nodes * self.distances[level].len()];
        let parts = self.displacements.chunks_exact(2 * coarse.n_nodes());
        for (u, finer) in parts.zip(finer.chunks_exact_mut(2 * nodes)) {
            prolong_into(&coarse, u, finer);
        }
        let mut average = vec![0.0; nodes];
        prolong_into(&coarse, &self.average, &mut average);
        (self.displacements, self.average) = (finer, average);
    }
}

/// Counts evaluations of single shapes, and gives up in the end.
struct Count {
    n_shapes: usize,
    /// The evaluations that L-BFGS took.
    unit: usize,
    evaluations: usize,
    passed: [Option<f64>; MULTIPLES.len()],
}

impl Observer for Count {
    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        // Every outer iteration evaluates the functional once, that is, all shapes.
        let outer = iteration.iteration + 1;
        let work = iteration.evaluations;
        self.evaluations = work.gradients + work.values - outer + self.n_shapes * outer;
        for (passed, multiple) in self.passed.iter_mut().zip(MULTIPLES) {
            if self.evaluations >= multiple * self.unit {
                passed.get_or_insert(iteration.energy);
            }
        }
        if self.evaluations >= CAP * self.unit {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}
