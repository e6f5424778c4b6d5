//! The course of a minimisation as a plot, and the same numbers as a table.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use plotters::prelude::*;

use super::OutputError;
use crate::picture;

const SIZE: (u32, u32) = (900, 760);
/// Differences below this part of the energy are rounding, and are left out of the plot.
const RESOLUTION: f64 = 1e-15;

/// The energy after one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyPoint {
    /// Nodes a side of the grid.
    pub nodes: usize,
    /// Iterations on this grid so far.
    pub iteration: usize,
    /// Evaluations of the functional so far, on all grids.
    pub evaluations: usize,
    /// The functional, or what else the minimiser lowers.
    pub total: f64,
    /// Its parts, where they are known.
    pub parts: Option<EnergyParts>,
}

/// The parts of the functional, with their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyParts {
    /// Elastic.
    pub elastic: f64,
    /// Mismatch.
    pub mismatch: f64,
    /// Length.
    pub length: f64,
}

/// Writes `energy.csv`: one line a point; parts that are not known are left empty.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_energy_table(path: &Path, points: &[EnergyPoint]) -> Result<(), OutputError> {
    let mut text = "nodes,iteration,evaluations,total,elastic,mismatch,length\n".to_owned();
    for p in points {
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{:e},{}",
            p.nodes,
            p.iteration,
            p.evaluations,
            p.total,
            p.parts.map_or_else(
                || ",,".to_owned(),
                |p| format!("{:e},{:e},{:e}", p.elastic, p.mismatch, p.length)
            )
        );
    }
    fs::write(path, text).map_err(OutputError::at(path))
}

/// Writes `energy.svg`: above, for each grid the energy less its last value there; below, the
/// parts of the energy; both on logarithmic scales over the number of evaluations.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_energy_plot(path: &Path, points: &[EnergyPoint]) -> Result<(), OutputError> {
    let text =
        energy_plot(points).map_err(|error| OutputError::at(path)(std::io::Error::other(error)))?;
    fs::write(path, text).map_err(OutputError::at(path))
}

/// A line of a plot.
struct Series {
    label: String,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
}

fn energy_plot(points: &[EnergyPoint]) -> Result<String, String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        let (upper, lower) = area.split_vertically(SIZE.1 / 2);
        chart(&upper, "E - E_final on each grid", &descents(points))?;
        chart(&lower, "parts of E", &parts(points))?;
        area.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

/// For each grid, in the order of the points, the energies less the last one.
fn descents(points: &[EnergyPoint]) -> Vec<Series> {
    points
        .chunk_by(|a, b| a.nodes == b.nodes)
        .enumerate()
        .map(|(k, level)| {
            let last = level[level.len() - 1].total;
            Series {
                label: format!("{} nodes a side", level[0].nodes),
                colour: colour(k),
                points: level
                    .iter()
                    .map(|p| (p.evaluations as f64, p.total - last))
                    .filter(|(_, difference)| *difference > RESOLUTION * last.abs())
                    .collect(),
            }
        })
        .collect()
}

fn parts(points: &[EnergyPoint]) -> Vec<Series> {
    let part = |k: usize, label: &str, value: fn(&EnergyParts) -> f64| Series {
        label: label.into(),
        colour: colour(k),
        points: points
            .iter()
            .filter_map(|p| Some((p.evaluations as f64, value(p.parts.as_ref()?))))
            .filter(|(_, value)| *value > 0.0 && value.is_finite())
            .collect(),
    };
    vec![
        part(0, "elastic", |p| p.elastic),
        part(1, "mismatch", |p| p.mismatch),
        part(2, "length", |p| p.length),
    ]
}

fn colour(index: usize) -> RGBColor {
    let [r, g, b] = picture::colour(index).map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

fn chart(
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    title: &str,
    series: &[Series],
) -> Result<(), String> {
    let (columns, rows) = ranges(series);
    let label = ("sans-serif", 14).into_font().color(&RGBColor(70, 75, 82));
    let mut chart = ChartBuilder::on(area)
        .caption(
            title,
            ("sans-serif", 17).into_font().color(&RGBColor(33, 38, 46)),
        )
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(columns, rows.log_scale())
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(228, 230, 233))
        .axis_style(RGBColor(140, 145, 152))
        .label_style(label.clone())
        .x_desc("evaluations")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()
        .map_err(|e| e.to_string())?;
    for line in series.iter().filter(|line| !line.points.is_empty()) {
        let colour = line.colour;
        chart
            .draw_series(LineSeries::new(
                line.points.iter().copied(),
                colour.stroke_width(2),
            ))
            .map_err(|e| e.to_string())?
            .label(line.label.clone())
            .legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(3))
            });
        let dots = line
            .points
            .iter()
            .map(|&p| Circle::new(p, 2, colour.filled()));
        chart.draw_series(dots).map_err(|e| e.to_string())?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(214, 217, 221))
        .label_font(label)
        .position(SeriesLabelPosition::UpperRight)
        .draw()
        .map_err(|e| e.to_string())
}

/// Ranges of the axes, never empty.
fn ranges(series: &[Series]) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
    let all = || series.iter().flat_map(|line| line.points.iter());
    let last = all().map(|p| p.0).fold(1.0, f64::max);
    let low = all().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let high = all().map(|p| p.1).fold(0.0, f64::max);
    let rows = if low <= high {
        low / 2.0..high * 2.0
    } else {
        0.1..1.0
    };
    // Room for the legend on the right.
    (0.0..1.22 * last, rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course() -> Vec<EnergyPoint> {
        let mut evaluations = 0;
        let mut points = Vec::new();
        for nodes in [9, 17, 33, 65] {
            for iteration in 0..15 {
                evaluations += 1 + usize::from(iteration % 4 == 0);
                let rest = 0.3 / nodes as f64 * (-0.6 * iteration as f64).exp();
                points.push(EnergyPoint {
                    nodes,
                    iteration,
                    evaluations,
                    total: 0.52 + rest,
                    parts: (iteration % 2 == 0).then_some(EnergyParts {
                        elastic: 0.01 - 0.2 * rest,
                        mismatch: 0.51 + 1.2 * rest,
                        length: 2e-4,
                    }),
                });
            }
        }
        points
    }

    #[test]
    fn the_plot_names_every_grid_and_part_and_the_table_every_point() {
        let place = tempfile::tempdir().unwrap();
        let (plot, table) = (place.path().join("e.svg"), place.path().join("e.csv"));
        write_energy_plot(&plot, &course()).unwrap();
        write_energy_table(&table, &course()).unwrap();
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
        assert_eq!(text.matches("<circle").count(), 96 + 56);
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
        assert_eq!(total, course()[0].total);
    }

    #[test]
    fn an_empty_or_flat_course_makes_a_plot_too() {
        assert!(energy_plot(&[]).is_ok());
        assert!(energy_plot(&course()[..1]).is_ok());
    }
}
