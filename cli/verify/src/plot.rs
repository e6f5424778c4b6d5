//! Plots of errors against steps on logarithmic axes, with the expected orders.

use shapespace_report::chart::{Axis, Chart, ChartError, Scale, Series, stacked};

use crate::record::{LineRecord, StatementRecord, VerifyRecord};

/// The plot of a statement.
pub struct Plot {
    /// The statement's name.
    pub name: &'static str,
    /// The picture.
    pub svg: String,
}

/// A plot for every statement that has an order.
///
/// # Errors
/// The error of the plotting library.
pub fn plots(record: &VerifyRecord) -> Result<Vec<Plot>, ChartError> {
    let drawn = record.statements.iter().filter_map(plot);
    drawn.collect()
}

fn plot(statement: &StatementRecord) -> Option<Result<Plot, ChartError>> {
    let lines: Vec<&LineRecord> = statement
        .lines
        .iter()
        .filter(|line| line.points.len() > 1)
        .collect();
    // If the axes differ between lines, each has its own name.
    let mut axes: Vec<&str> = lines.iter().map(|line| line.axis.as_str()).collect();
    axes.dedup();
    let name = statement.name;
    (!lines.is_empty()).then(|| {
        let svg = convergence(name, &axes.join(", "), &lines);
        svg.map(|svg| Plot { name, svg })
    })
}

/// Markers for the errors, and for each line a dashed one of the expected slope through the finest.
///
/// # Errors
/// The error of the plotting library.
pub fn convergence(title: &str, steps: &str, lines: &[&LineRecord]) -> Result<String, ChartError> {
    let slopes = lines.iter().enumerate().filter_map(|(k, line)| {
        let &(x, y) = finest(&line.points)?;
        let far = line.points.iter().map(|p| p.0).fold(x, f64::max);
        let end = (far, y * (far / x).powf(line.order));
        Some(Series::guide(k, vec![(x, y), end]))
    });
    let errors = lines.iter().enumerate().map(|(k, line)| {
        let name = format!("{} (dashed: {})", line.label, rounded(line.order));
        Series::new(name, k, line.points.clone())
    });
    let series: Vec<Series> = slopes.chain(errors).collect();
    let axis = |title, number| Axis {
        title,
        scale: Scale::Logarithmic,
        number,
    };
    let chart = Chart {
        title,
        across: axis(steps, step),
        up: axis("", |y| format!("{y:.0e}")),
        series: &series,
    };
    stacked((560, 380), &[chart])
}

/// The point of the smallest step.
fn finest(points: &[(f64, f64)]) -> Option<&(f64, f64)> {
    points.iter().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// An order with two digits at most.
fn rounded(order: f64) -> String {
    format!("{order:.2}")
        .trim_end_matches('0')
        .trim_end_matches('.')
        .into()
}

fn step(x: f64) -> String {
    if (0.001..1000.0).contains(&x) {
        format!("{x:.4}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .into()
    } else {
        format!("{x:.0e}")
    }
}
