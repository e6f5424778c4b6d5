//! The convergence history of a minimisation as a plot, and the same numbers as a table.

use std::path::Path;

use shapespace_report::chart::{Axis, Chart, Scale, Series};
use shapespace_report::table::{Table, exact, exact_or_empty};

use super::{OutputError, ResultDir, write_charts, write_text};
use crate::history::HistoryPoint;

/// Differences below this part of the energy are rounding, and are left out of the plot.
const RESOLUTION: f64 = 1e-15;

/// The energy after one iteration.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EnergyPoint {
    /// The accepted step.
    pub step: HistoryPoint,
    /// The terms of the energy with their weights, where they are known.
    pub parts: Option<Vec<f64>>,
}

/// Writes `energy.csv` and `energy.svg` of a convergence history; `parts` are the named terms of the
/// energy at the end of a level.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_energy(
    directory: &ResultDir,
    history: &[HistoryPoint],
    names: &[&str],
    parts: impl Fn(usize) -> Option<Vec<f64>>,
) -> Result<(), OutputError> {
    let points = energy_points(history, parts);
    directory.with_file("energy.csv", |path| {
        write_energy_table(path, &points, names)
    })?;
    directory.with_file("energy.svg", |path| write_energy_plot(path, &points, names))
}

/// The points of a convergence history, with the terms of the energy at the end of each level.
pub(crate) fn energy_points(
    history: &[HistoryPoint],
    parts: impl Fn(usize) -> Option<Vec<f64>>,
) -> Vec<EnergyPoint> {
    let point = |(i, step): (usize, &HistoryPoint)| {
        let next = history.get(i + 1);
        let is_last = next.is_none_or(|next| next.level != step.level);
        EnergyPoint {
            step: *step,
            parts: is_last.then(|| parts(step.level)).flatten(),
        }
    };
    history.iter().enumerate().map(point).collect()
}

/// Writes `energy.csv`: one line per point, the named terms last, which are empty where they are not
/// known.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_energy_table(
    path: &Path,
    points: &[EnergyPoint],
    names: &[&str],
) -> Result<(), OutputError> {
    let counts = ["nodes", "iteration", "evaluations", "total"];
    let mut table = Table::new(counts.iter().chain(names).copied());
    for p in points {
        let counts =
            [p.step.nodes, p.step.iteration, p.step.evaluations].map(|count| count.to_string());
        let part = |k: usize| p.parts.as_ref().and_then(|parts| parts.get(k).copied());
        let parts = (0..names.len()).map(|k| exact_or_empty(part(k)));
        table.texts(
            counts
                .into_iter()
                .chain([exact(p.step.energy)])
                .chain(parts),
        );
    }
    write_text(path, &table.csv())
}

/// Writes `energy.svg`: above, for each level the energy less its last value there; below, the
/// named parts of the energy; both on logarithmic scales over the number of evaluations.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_energy_plot(
    path: &Path,
    points: &[EnergyPoint],
    names: &[&str],
) -> Result<(), OutputError> {
    let chart = |title, series| Chart {
        title,
        across: Axis::counts("evaluations"),
        up: Axis {
            title: "",
            scale: Scale::Logarithmic,
            number: |y| format!("{y:.0e}"),
        },
        series,
    };
    let (descents, parts) = (descents(points), parts(points, names));
    let charts = [
        chart("E - E_final on each level", &descents),
        chart("parts of E", &parts),
    ];
    write_charts(path, (900, 760), &charts)
}

/// For each level, in the order of the points, the energies less the last one.
fn descents(points: &[EnergyPoint]) -> Vec<Series> {
    points
        .chunk_by(|a, b| a.step.level == b.step.level)
        .enumerate()
        .map(|(k, level)| {
            let last = level[level.len() - 1].step.energy;
            let points = level
                .iter()
                .map(|p| (p.step.evaluations as f64, p.step.energy - last))
                .filter(|(_, difference)| *difference > RESOLUTION * last.abs());
            let name = format!("{} nodes a side", level[0].step.nodes);
            Series::new(name, k, points.collect())
        })
        .collect()
}

fn parts(points: &[EnergyPoint], names: &[&str]) -> Vec<Series> {
    let part = |(k, name): (usize, &&str)| {
        let points = points
            .iter()
            .filter_map(|p| Some((p.step.evaluations as f64, *p.parts.as_ref()?.get(k)?)))
            .filter(|(_, value)| *value > 0.0 && value.is_finite());
        Series::new(*name, k, points.collect())
    };
    names.iter().enumerate().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const NAMES: [&str; 3] = ["elastic", "mismatch", "length"];

    fn history() -> Vec<EnergyPoint> {
        let mut evaluations = 0;
        let mut points = Vec::new();
        for (level, nodes) in [9, 17, 33, 65].into_iter().enumerate() {
            for iteration in 0..15 {
                evaluations += 1 + usize::from(iteration % 4 == 0);
                let rest = 0.3 / nodes as f64 * (-0.6 * iteration as f64).exp();
                points.push(EnergyPoint {
                    step: HistoryPoint {
                        level,
                        nodes,
                        iteration,
                        evaluations,
                        energy: 0.52 + rest,
                    },
                    parts: (iteration % 2 == 0)
                        .then(|| vec![0.01 - 0.2 * rest, 0.51 + 1.2 * rest, 2e-4]),
                });
            }
        }
        points
    }

    #[test]
    fn the_plot_names_every_grid_and_part_and_the_table_every_point() {
        let place = tempfile::tempdir().unwrap();
        let (plot, table) = (place.path().join("e.svg"), place.path().join("e.csv"));
        write_energy_plot(&plot, &history(), &NAMES).unwrap();
        write_energy_table(&table, &history(), &NAMES).unwrap();
        let text = fs::read_to_string(&plot).unwrap();
        if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
            fs::write(Path::new(&folder).join("energy.svg"), &text).unwrap();
        }
        for word in [
            "9 nodes",
            "65 nodes",
            "elastic",
            "mismatch",
            "length",
            "evaluations",
        ] {
            assert!(text.contains(word), "{word}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"));
        // Eight points of each of 4 grids below, three parts each; above, the last of each of 4
        // grids has no logarithm.
        let markers = text.matches("<circle").count() + text.matches("<polygon").count();
        // Each of the seven lines has one in the legend, too.
        assert_eq!(markers, 96 + 56 + 7);
        let rows = fs::read_to_string(&table).unwrap();
        assert_eq!(rows.lines().count(), 61);
        assert!(rows.lines().nth(2).unwrap().ends_with(",,,"));
        let total: f64 = rows
            .lines()
            .nth(1)
            .unwrap()
            .split(',')
            .nth(3)
            .unwrap()
            .parse()
            .unwrap();
        assert_eq!(total, history()[0].step.energy);
    }

    #[test]
    fn an_empty_or_flat_course_makes_a_plot_too() {
        let place = tempfile::tempdir().unwrap();
        for points in [&[], &history()[..1]] {
            let path = place.path().join(format!("{}.svg", points.len()));
            write_energy_plot(&path, points, &NAMES).unwrap();
        }
    }
}
