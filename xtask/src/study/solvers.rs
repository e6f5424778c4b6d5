//! The work of both solvers.

use std::path::Path;
use std::time::Instant;

use fe_grid::ScalarField;
use fe_grid::minimise::Silent;
use shape_average::{AverageParams, AverageResult, average};
use shapespace_generate::{Family, family};
use shapespace_report::chart::{Axis, Chart, Scale, Series, stacked};

use super::{Section, shapes};
use crate::descent::LevelDescent;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Maximal number of iterations per level.
pub const ITERATIONS: usize = 40;
/// Required ratio of the evaluations of the descent to those of L-BFGS.
const RATIO: f64 = 30.0;
/// Tolerance of the run that stands for the minimum in the chart.
const MINIMUM: f64 = 1e-8;
/// Size of a chart of the energies of one group.
const CHART: (u32, u32) = (720, 300);
/// Least number of nodes along the axes of charted groups.
const CHARTED: usize = 129;

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
        text: "Levels from 9 nodes along every axis, coarsest first. At most 40 iterations are \
               allowed on each level.",
        table,
        chart: None,
    }
}

/// Evaluations of the descent until it reaches the energy of L-BFGS.
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
    let mut energies = Vec::new();
    for group in groups {
        let curves = compare(group, &mut table)?;
        // Of the groups on two grids the finer.
        if group.shapes[0].grid().nodes_per_axis()[0] >= CHARTED {
            let title = format!("Energy above the minimum: {}", group.name);
            energies.push((title, curves));
        }
    }
    Ok(Section {
        title: "The descent against L-BFGS",
        text: "Both methods proceed from coarse levels to fine, each from its own result. The \
               descent ends on a level when its energy is as low as that of L-BFGS on this level, \
               or after 60 times the evaluations. An evaluation is that of the energy of one \
               shape, with or without gradient. The remaining excess is relative to the decrease \
               by L-BFGS from the undeformed shapes. The required ratio is 30. The charts have the \
               energies on the finest level above those of L-BFGS to a tolerance of 1e-8, against \
               the evaluations on this level.",
        table,
        chart: Some(drawn(&energies)?),
    })
}

/// The charts of all groups, one above the other.
fn drawn(energies: &[(String, Vec<Series>)]) -> Outcome<String> {
    let axis = |title, scale| Axis {
        title,
        scale,
        number: |value| format!("{value:.0e}"),
    };
    let charts: Vec<Chart<'_>> = energies
        .iter()
        .map(|(title, series)| Chart {
            title,
            across: Axis {
                number: |value| format!("{value:.0}"),
                ..axis("evaluations of a shape", Scale::Logarithmic)
            },
            up: axis("energy above the minimum", Scale::Logarithmic),
            series,
        })
        .collect();
    let height = CHART.1 * charts.len().max(1) as u32;
    Ok(stacked((CHART.0, height), &charts)?)
}

/// The energies of both solvers on the finest level, above those of a run that ends later.
fn curves(group: &Group, descent: &[(usize, f64)]) -> Outcome<Vec<Series>> {
    let closer = AverageParams {
        tolerance: MINIMUM,
        ..group.params.clone()
    };
    let closer = average(&group.shapes, &closer, &mut Silent)?;
    let least = closer
        .levels
        .last()
        .map_or(f64::NAN, |level| level.energy.objective());
    let above = |points: &mut dyn Iterator<Item = (f64, f64)>| -> Vec<_> {
        let above = points.map(|(work, energy)| (work.max(1.0), energy - least));
        above.filter(|(_, energy)| *energy > 0.0).collect()
    };
    let mut lines = Vec::new();
    if let Some(report) = group.result.levels.last() {
        // Nearly every iteration evaluates all shapes once.
        let each = report.shape_evaluations as f64 / report.iterations.max(1) as f64;
        let points = report.energies.iter().enumerate();
        let mut points = points.map(|(k, energy)| (k as f64 * each, *energy));
        lines.push(Series::new("L-BFGS", 0, above(&mut points)));
    }
    let mut points = descent.iter().map(|(work, energy)| (*work as f64, *energy));
    lines.push(Series::new("descent", 1, above(&mut points)));
    Ok(lines)
}

/// Writes the rows of a group, and returns the energies of both solvers on its finest level.
fn compare(group: &Group, table: &mut Table) -> Outcome<Vec<Series>> {
    let mut descent = LevelDescent::new(&group.shapes, &group.params);
    let (mut fast, mut slow, mut capped, mut seconds) = (0, 0, false, 0.0);
    let mut curve = Vec::new();
    for (level, report) in group.result.levels.iter().enumerate() {
        let target = report.energies[report.iterations];
        let start = Instant::now();
        curve.clear();
        let mut note = |evaluations, energy| curve.push((evaluations, energy));
        let found = descent.descend(level, target, report.shape_evaluations, &mut note)?;
        let taken = start.elapsed().as_secs_f64();
        fast += report.shape_evaluations;
        slow += found.evaluations;
        capped |= !found.reached;
        seconds += taken;
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
            format!("{:.1} / {:.1}", report.seconds, taken),
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
    curves(group, &curve)
}
