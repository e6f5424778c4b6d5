//! Errors against steps on logarithmic axes, beside the slope that is expected of them.

use plotters::prelude::*;

use super::plot::colour;

/// Most letters of a name in the legend.
const MOST_LETTERS: usize = 48;

/// Errors of one figure.
pub(crate) struct Errors<'a> {
    /// Its name in the legend.
    pub label: &'a str,
    /// Steps and errors, all positive and finite.
    pub points: &'a [(f64, f64)],
    /// The order that is expected.
    pub order: f64,
}

/// A chart: dots for the errors, and for each a dashed line of the expected slope through the finest.
///
/// # Errors
/// What the plotting library says.
pub(crate) fn convergence_plot(
    size: (u32, u32),
    title: &str,
    axis: &str,
    all: &[Errors<'_>],
) -> Result<String, String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        draw(&area, title, axis, all)?;
        area.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

fn draw(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    title: &str,
    axis: &str,
    all: &[Errors<'_>],
) -> Result<(), String> {
    let points = || all.iter().flat_map(|e| e.points.iter().copied());
    let (across, up) = (
        points().map(|p| p.0).fold(None, bounds),
        points().map(|p| p.1).fold(None, bounds),
    );
    // Powers of ten alone have labels, and a short axis may have none.
    let axis = match across {
        Some((low, high)) => format!("{axis}, from {} to {}", step(low), step(high)),
        None => axis.to_owned(),
    };
    let columns = padded(across, 1.25);
    // Room for the legend below the lines, which rise to the right.
    let mut rows = padded(up, 2.0);
    rows.start /= (rows.end / rows.start).powf(0.12 + 0.085 * all.len() as f64);
    let label = ("sans-serif", 13).into_font().color(&RGBColor(70, 75, 82));
    let mut chart = ChartBuilder::on(area)
        .caption(
            title,
            ("sans-serif", 16).into_font().color(&RGBColor(33, 38, 46)),
        )
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(66)
        .build_cartesian_2d(columns.clone().log_scale(), rows.clone().log_scale())
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(228, 230, 233))
        .axis_style(RGBColor(140, 145, 152))
        .label_style(label.clone())
        .x_desc(axis.as_str())
        .x_labels(6)
        .y_labels(7)
        .x_label_formatter(&|x| step(*x))
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()
        .map_err(|e| e.to_string())?;
    for (k, errors) in all.iter().enumerate() {
        let colour = colour(k);
        if let Some(&(x, y)) = finest(errors.points) {
            // Only as much of the slope as lies in the chart.
            let far = errors.points.iter().map(|p| p.0).fold(x, f64::max);
            let line = [(x, y), (far, y * (far / x).powf(errors.order))];
            let dashes = DashedLineSeries::new(line, 5, 4, colour.mix(0.6).stroke_width(1));
            chart.draw_series(dashes).map_err(|e| e.to_string())?;
        }
        let line = LineSeries::new(errors.points.iter().copied(), colour.stroke_width(2));
        let name = format!(
            "{} (dashed: {})",
            short(errors.label),
            rounded(errors.order)
        );
        chart
            .draw_series(line)
            .map_err(|e| e.to_string())?
            .label(name)
            .legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 16, y)], colour.stroke_width(3))
            });
        let dots = errors.points.iter();
        chart
            .draw_series(dots.map(|&p| Circle::new(p, 3, colour.filled())))
            .map_err(|e| e.to_string())?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(214, 217, 221))
        .label_font(label)
        .position(SeriesLabelPosition::LowerRight)
        .draw()
        .map_err(|e| e.to_string())
}

fn bounds(range: Option<(f64, f64)>, x: f64) -> Option<(f64, f64)> {
    range.map_or(Some((x, x)), |(low, high)| Some((low.min(x), high.max(x))))
}

/// The point of the smallest step.
fn finest(points: &[(f64, f64)]) -> Option<&(f64, f64)> {
    points.iter().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A range, made wider by a factor.
fn padded(range: Option<(f64, f64)>, factor: f64) -> std::ops::Range<f64> {
    range.map_or(0.1..1.0, |(low, high)| low / factor..high * factor)
}

/// A name that fits in the chart.
fn short(label: &str) -> String {
    if label.chars().count() <= MOST_LETTERS {
        return label.into();
    }
    let mut short: String = label.chars().take(MOST_LETTERS - 1).collect();
    short.push('…');
    short
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_and_names_are_there_and_nothing_makes_a_plot_too() {
        let points = [(0.1, 1e-2), (0.05, 2.5e-3), (0.025, 6e-4)];
        let errors = [Errors {
            label: "Diss",
            points: &points,
            order: 2.0,
        }];
        let text = convergence_plot((500, 360), "balls", "step", &errors).unwrap();
        assert_eq!(text.matches("<circle").count(), 3);
        for word in ["balls", "step", "Diss", "dashed: 2)"] {
            assert!(text.contains(word), "{word}");
        }
        assert!(convergence_plot((500, 360), "none", "step", &[]).is_ok());
    }
}
