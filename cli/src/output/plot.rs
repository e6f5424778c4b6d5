//! Charts of lines with dots, one above the other, as SVG.

use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::picture;

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// A line of a chart.
pub(crate) struct Series {
    /// Its name in the legend; without one it has no place there.
    pub label: String,
    pub colour: RGBColor,
    pub points: Vec<(f64, f64)>,
}

/// One chart.
pub(crate) struct Chart<'a> {
    pub title: &'a str,
    /// What runs along the horizontal axis.
    pub axis: &'a str,
    /// Whether the vertical axis is logarithmic; otherwise it begins at zero.
    pub logarithmic: bool,
    pub series: &'a [Series],
}

/// A colour of the pictures.
pub(crate) fn colour(index: usize) -> RGBColor {
    let [r, g, b] = picture::colour(index).map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

/// Charts of equal height, one above the other.
///
/// # Errors
/// What the plotting library says.
pub(crate) fn stacked(size: (u32, u32), charts: &[Chart]) -> Result<String, String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        let parts = area.split_evenly((charts.len(), 1));
        for (part, chart) in parts.iter().zip(charts) {
            chart.draw(part)?;
        }
        area.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

impl Chart<'_> {
    fn draw(&self, area: &Area) -> Result<(), String> {
        let (columns, rows) = self.ranges();
        let mut builder = ChartBuilder::on(area);
        builder
            .caption(
                self.title,
                ("sans-serif", 17).into_font().color(&RGBColor(33, 38, 46)),
            )
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(76);
        if self.logarithmic {
            let chart = builder.build_cartesian_2d(columns, rows.log_scale());
            self.fill(chart.map_err(|e| e.to_string())?, |y| format!("{y:.0e}"))
        } else {
            let chart = builder.build_cartesian_2d(columns, rows);
            self.fill(chart.map_err(|e| e.to_string())?, |y| format!("{y:.2e}"))
        }
    }

    fn fill<'a, Y: Ranged<ValueType = f64> + ValueFormatter<f64>>(
        &self,
        mut chart: ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, Y>>,
        number: impl Fn(&f64) -> String,
    ) -> Result<(), String> {
        let label = ("sans-serif", 14).into_font().color(&RGBColor(70, 75, 82));
        // Whole numbers run along the axis: no more labels than there are of them.
        let last = chart.x_range().end as usize;
        chart
            .configure_mesh()
            .x_labels((last + 1).min(11))
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(228, 230, 233))
            .axis_style(RGBColor(140, 145, 152))
            .label_style(label.clone())
            .x_desc(self.axis)
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&number)
            .draw()
            .map_err(|e| e.to_string())?;
        for line in self.series.iter().filter(|line| !line.points.is_empty()) {
            let colour = line.colour;
            let drawn = chart
                .draw_series(LineSeries::new(
                    line.points.iter().copied(),
                    colour.stroke_width(2),
                ))
                .map_err(|e| e.to_string())?;
            if !line.label.is_empty() {
                drawn.label(line.label.clone()).legend(move |(x, y)| {
                    PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(3))
                });
            }
            let dots = line
                .points
                .iter()
                .map(|&p| Circle::new(p, 2, colour.filled()));
            chart.draw_series(dots).map_err(|e| e.to_string())?;
        }
        if self.series.iter().all(|line| line.label.is_empty()) {
            return Ok(());
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
    fn ranges(&self) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
        let all = || self.series.iter().flat_map(|line| line.points.iter());
        let last = all().map(|p| p.0).fold(1.0, f64::max);
        let low = all().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let high = all().map(|p| p.1).fold(0.0, f64::max);
        if !self.logarithmic {
            let high = if high > 0.0 { 1.15 * high } else { 1.0 };
            return (0.0..1.02 * last, 0.0..high);
        }
        let rows = if low <= high {
            low / 2.0..high * 2.0
        } else {
            0.1..1.0
        };
        // Room for the legend on the right.
        (0.0..1.22 * last, rows)
    }
}
