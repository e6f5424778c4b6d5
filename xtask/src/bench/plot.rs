//! Pictures of figures: bars, and lines on logarithmic axes.

use plotters::coord::Shift;
use plotters::prelude::*;
use shapespace::picture;

use crate::outcome::Outcome;

const INK: RGBColor = RGBColor(33, 38, 46);
const GREY: RGBColor = RGBColor(110, 116, 124);
const PALE: RGBColor = RGBColor(228, 230, 233);
const BAR: u32 = 18;
const GAP: u32 = 8;

fn colour(index: usize) -> RGBColor {
    let [r, g, b] = picture::colour(index).map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

/// A row of a bar chart.
pub struct Bars {
    /// What stands to the left.
    pub label: String,
    /// Lengths, one for each of the chart's series; one that is missing draws nothing.
    pub values: Vec<Option<f64>>,
    /// What stands to the right of each bar.
    pub notes: Vec<String>,
}

/// Horizontal bars from zero, a row each. The longest fills the width.
pub fn bars(title: &str, series: &[&str], rows: &[Bars]) -> Outcome<String> {
    let height = |bars: &Bars| bars.values.len() as u32 * (BAR + 2) + GAP;
    let total: u32 = rows.iter().map(height).sum();
    let size = (1100, total + 90);
    let longest = rows
        .iter()
        .flat_map(|row| row.values.iter().flatten())
        .fold(f64::MIN_POSITIVE, |a, &b| a.max(b));
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE)?;
        let label = ("sans-serif", 14).into_font();
        let titled = ("sans-serif", 18).into_font().color(&INK);
        area.draw(&Text::new(title.to_owned(), (20, 14), titled))?;
        for (i, name) in series.iter().enumerate() {
            let x = 20 + 220 * i as i32;
            let swatch = Rectangle::new([(x, 44), (x + 16, 56)], colour(i).filled());
            area.draw(&swatch)?;
            let text = Text::new((*name).to_owned(), (x + 22, 43), label.clone().color(&GREY));
            area.draw(&text)?;
        }
        let (left, width) = (330, 560.0);
        let mut y = 76;
        for row in rows {
            let text = Text::new(row.label.clone(), (20, y + 1), label.clone().color(&INK));
            area.draw(&text)?;
            for (i, value) in row.values.iter().enumerate() {
                if let Some(value) = value {
                    let right = left + (width * value / longest).round() as i32;
                    let corners = [(left, y), (right.max(left + 1), y + BAR as i32 - 2)];
                    area.draw(&Rectangle::new(corners, colour(i).filled()))?;
                    let note = row.notes.get(i).cloned().unwrap_or_default();
                    let at = (right + 6, y + 1);
                    area.draw(&Text::new(note, at, label.clone().color(&GREY)))?;
                }
                y += BAR as i32 + 2;
            }
            y += GAP as i32;
        }
        area.present()?;
    }
    Ok(text)
}

/// A line of points, each positive.
pub struct Line {
    /// Its name in the legend.
    pub label: String,
    /// Points of the line.
    pub points: Vec<(f64, f64)>,
}

/// One set of axes, both logarithmic.
pub struct Chart<'a> {
    /// Above the axes.
    pub title: &'a str,
    /// Under the horizontal axis.
    pub across: &'a str,
    /// Beside the vertical axis.
    pub up: &'a str,
    /// The lines.
    pub lines: Vec<Line>,
}

/// Charts one above the other.
pub fn charts(charts: &[Chart<'_>]) -> Outcome<String> {
    let size = (900, 430 * charts.len().max(1) as u32);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE)?;
        for (part, chart) in area
            .split_evenly((charts.len().max(1), 1))
            .iter()
            .zip(charts)
        {
            draw(part, chart)?;
        }
        area.present()?;
    }
    Ok(text)
}

fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, chart: &Chart<'_>) -> Outcome<()> {
    let points = || chart.lines.iter().flat_map(|l| l.points.iter());
    let columns = range(points().map(|p| p.0), 3.0);
    let rows = range(points().map(|p| p.1), 1.5);
    let label = ("sans-serif", 14).into_font().color(&GREY);
    let said = |e: &dyn std::fmt::Display| e.to_string();
    let mut axes = ChartBuilder::on(area)
        .caption(chart.title, ("sans-serif", 17).into_font().color(&INK))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(columns.log_scale(), rows.log_scale())
        .map_err(|e| said(&e))?;
    axes.configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(PALE)
        .axis_style(GREY)
        .label_style(label.clone())
        .x_desc(chart.across)
        .y_desc(chart.up)
        .x_label_formatter(&|x| number(*x))
        .y_label_formatter(&|y| number(*y))
        .draw()
        .map_err(|e| said(&e))?;
    for (i, line) in chart.lines.iter().enumerate() {
        let colour = colour(i);
        axes.draw_series(LineSeries::new(
            line.points.iter().copied(),
            colour.stroke_width(2),
        ))
        .map_err(|e| said(&e))?
        .label(line.label.clone())
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(3)));
        let dots = line
            .points
            .iter()
            .map(|&p| Circle::new(p, 3, colour.filled()));
        axes.draw_series(dots).map_err(|e| said(&e))?;
    }
    axes.configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(PALE)
        .label_font(label)
        .position(SeriesLabelPosition::UpperRight)
        .draw()
        .map_err(|e| said(&e))?;
    Ok(())
}

/// From a little below the least to a little above the largest; never empty.
fn range(values: impl Iterator<Item = f64> + Clone, room: f64) -> std::ops::Range<f64> {
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(0.0, f64::max);
    if low <= high && low > 0.0 {
        low / 1.3..high * room
    } else {
        0.1..1.0
    }
}

fn number(x: f64) -> String {
    if (1e-2..1e4).contains(&x) {
        let digits = if x < 1.0 { 2 } else { 0 };
        format!("{x:.digits$}")
    } else {
        format!("{x:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_values() {
        let rows = [2.0, 1.0].map(|x| Bars {
            label: format!("row {x}"),
            values: vec![Some(x), None],
            notes: vec![format!("{x} units"), String::new()],
        });
        let text = bars("title", &["a", "b"], &rows).unwrap();
        for word in ["title", "row 2", "row 1", "1 units"] {
            assert!(text.contains(word), "{word}");
        }
        let widths = |w: i32| text.contains(&format!("width=\"{w}\""));
        assert!(widths(560) && widths(280), "{text}");
    }

    #[test]
    fn charts_without_points_are_drawn_too() {
        let chart = |points| Chart {
            title: "t",
            across: "x",
            up: "y",
            lines: vec![Line {
                label: "l".into(),
                points,
            }],
        };
        let text = charts(&[chart(vec![]), chart(vec![(1.0, 2.0), (1e6, 3e-4)])]).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert_eq!(text.matches("<circle").count(), 2);
    }
}
