//! Charts of lines with markers on linear or logarithmic axes, and of bars, as SVG.

mod bars;
mod mark;
mod ruler;

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use self::mark::Mark;
use self::ruler::{Ruler, has_place};
use crate::font;
use crate::palette::{self, Colour, Marker};

pub use self::bars::{Bars, bars};
pub use self::ruler::round_above;

/// Font families of nearly the same widths, and fallbacks.
const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";
/// Height of capitals in labels and in titles.
const TEXT: [f32; 2] = [8.5, 10.0];
/// Height of the title, and of a line of the legend.
const LINES: [i32; 2] = [30, 20];
/// Space at the sides of a chart, and between the entries of a legend.
const SPACES: [i32; 2] = [14, 20];
/// Length of the line beside a name.
const SAMPLE: i32 = 26;
/// Approximate maximal number of markers of a line.
const MARKERS: usize = 40;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Axes<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Ruler, Ruler>>;

/// A chart that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the chart cannot be drawn: {0}")]
pub struct ChartError(String);

impl ChartError {
    fn new(error: impl std::fmt::Display) -> Self {
        Self(error.to_string())
    }
}

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Counts, from zero.
    Counts,
    /// Numbers from zero.
    Linear,
    /// Positive numbers on a logarithmic scale.
    Logarithmic,
}

/// One of the two axes.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// The label.
    pub title: &'a str,
    /// The scale.
    pub scale: Scale,
    /// Format of the numbers.
    pub number: fn(f64) -> String,
}

/// A line.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend; a line without a name is not in the legend.
    pub label: String,
    /// Its number, which determines colour, markers and dashes.
    pub category: usize,
    /// Its points.
    pub points: Vec<(f64, f64)>,
    /// Whether it is a guide: thin, dashed and without markers.
    pub guide: bool,
}

impl Series {
    /// A line with markers.
    pub fn new(label: impl Into<String>, category: usize, points: Vec<(f64, f64)>) -> Self {
        Self {
            label: label.into(),
            category,
            points,
            guide: false,
        }
    }

    /// Creates a guide for the line of the same number.
    pub fn guide(category: usize, points: Vec<(f64, f64)>) -> Self {
        Self {
            guide: true,
            ..Self::new("", category, points)
        }
    }
}

/// A pair of axes with lines.
#[derive(Clone, Debug)]
pub struct Chart<'a> {
    /// The title.
    pub title: &'a str,
    /// The horizontal axis.
    pub across: Axis<'a>,
    /// The vertical axis.
    pub up: Axis<'a>,
    /// The lines.
    pub series: &'a [Series],
}

/// Draws charts of equal height, one above the other.
///
/// # Errors
/// Those of the plotting library.
pub fn stacked(size: (u32, u32), charts: &[Chart<'_>]) -> Result<String, ChartError> {
    drawing(size, |area| {
        let parts = area.split_evenly((charts.len().max(1), 1));
        parts
            .iter()
            .zip(charts)
            .try_for_each(|(part, chart)| chart.draw(part))
    })
}

/// Creates a white picture of this size, and draws on it with a function.
fn drawing(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), ChartError>,
) -> Result<String, ChartError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(ChartError::new)?;
        draw(&area)?;
        area.present().map_err(ChartError::new)?;
    }
    Ok(text)
}

impl Chart<'_> {
    fn draw(&self, area: &Area<'_>) -> Result<(), ChartError> {
        let (width, height) = area.dim_in_pixel();
        let (width, height) = (width as i32, height as i32);
        let entries = self.entries(width - 2 * SPACES[0]);
        let legend = entries.last().map_or(0, |(_, [_, y])| y + LINES[1]);
        let (top, bottom) = area.split_vertically(height - legend - SPACES[0] / 2);
        let title = style_of(TEXT[1], palette::INK, (HPos::Center, VPos::Center));
        let at = (width / 2, SPACES[0] / 2 + LINES[0] / 2);
        write(&top, self.title, at, &title)?;
        let (_, axes) = top.split_vertically(SPACES[0] / 2 + LINES[0]);
        self.lines(&axes)?;
        for (series, [x, y]) in entries {
            series.entry(&bottom, (SPACES[0] + x, y + LINES[1] / 2))?;
        }
        Ok(())
    }

    /// The axes and the lines between them.
    fn lines(&self, area: &Area<'_>) -> Result<(), ChartError> {
        let of = |k: usize| {
            let points = self.series.iter().flat_map(|line| &line.points);
            points.map(move |p| [p.0, p.1][k])
        };
        let [columns, rows] = [self.across.ruler(of(0)), self.up.ruler(of(1))];
        let described = if self.up.title.is_empty() { 76 } else { 90 };
        let mut axes = ChartBuilder::on(area)
            .margin_left(SPACES[0])
            .margin_right(SPACES[0] + 10)
            .x_label_area_size(44)
            .y_label_area_size(described)
            .build_cartesian_2d(columns, rows)
            .map_err(ChartError::new)?;
        axes.configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(rgb(palette::PALE))
            .axis_style(rgb(palette::GREY))
            .label_style(style_of(TEXT[0], palette::GREY, (HPos::Left, VPos::Top)))
            .x_desc(self.across.title)
            .y_desc(self.up.title)
            .x_label_formatter(&|x| (self.across.number)(*x))
            .y_label_formatter(&|y| (self.up.number)(*y))
            .draw()
            .map_err(ChartError::new)?;
        // Guides are drawn below the lines.
        for guide in [true, false] {
            for line in self.series.iter().filter(|line| line.guide == guide) {
                line.draw(&mut axes)?;
            }
        }
        Ok(())
    }

    /// The lines with names, and their positions in the legend.
    fn entries(&self, width: i32) -> Vec<(&Series, [i32; 2])> {
        let named = self.series.iter().filter(|line| !line.label.is_empty());
        let (mut x, mut y) = (0, 0);
        let place = |series| {
            let used = SAMPLE + font::width(&shown(series), TEXT[0]).ceil() as i32;
            if x > 0 && x + used > width {
                (x, y) = (0, y + LINES[1]);
            }
            let at = [x, y];
            x += used + SPACES[1];
            (series, at)
        };
        named.map(place).collect()
    }
}

impl<'a> Axis<'a> {
    /// An axis of counts.
    pub fn counts(title: &'a str) -> Self {
        Self {
            title,
            scale: Scale::Counts,
            number: |x| format!("{x:.0}"),
        }
    }

    /// An axis of numbers from zero.
    pub fn linear(title: &'a str) -> Self {
        Self {
            title,
            scale: Scale::Linear,
            number,
        }
    }
}

/// A number of four digits, without zeros at its end.
fn number(y: f64) -> String {
    if y == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&y.abs()) {
        return format!("{y:.1e}");
    }
    let digits = (3.0 - y.abs().log10().floor()).max(0.0) as usize;
    let text = format!("{y:.digits$}");
    if digits == 0 {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').into()
}

impl Series {
    fn colour(&self) -> RGBColor {
        rgb(palette::colour(self.category))
    }

    /// Draws the line and its markers; points outside the axes are left out.
    fn draw(&self, axes: &mut Axes<'_>) -> Result<(), ChartError> {
        let positive = [axes.x_range().start, axes.y_range().start].map(|start| start > 0.0);
        let shown = |p: &&(f64, f64)| has_place(p.0, positive[0]) && has_place(p.1, positive[1]);
        let places: Vec<(f64, f64)> = self.points.iter().filter(shown).copied().collect();
        let colour = self.colour();
        let points = places.iter().copied();
        let dashes = palette::dashes(self.category).map(|d| d.map(|length| length as i32));
        let drawn = match (self.guide, dashes) {
            (true, _) => {
                let line = DashedLineSeries::new(points, 5, 4, colour.mix(0.6).stroke_width(1));
                axes.draw_series(line).map(|_| ())
            }
            (_, Some([dash, gap])) => {
                let line = DashedLineSeries::new(points, dash, gap, colour.stroke_width(2));
                axes.draw_series(line).map(|_| ())
            }
            _ => axes
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .map(|_| ()),
        };
        drawn.map_err(ChartError::new)?;
        if self.guide {
            return Ok(());
        }
        let every = places.len().div_ceil(MARKERS).max(1);
        let markers = places.iter().step_by(every).map(|at| self.marker(*at));
        axes.draw_series(markers).map_err(ChartError::new)?;
        Ok(())
    }

    fn marker<C>(&self, at: C) -> Mark<C> {
        Mark {
            at,
            marker: Marker::of(self.category),
            colour: self.colour(),
        }
    }

    /// Draws the entry of the legend at a position.
    fn entry(&self, area: &Area<'_>, (x, y): (i32, i32)) -> Result<(), ChartError> {
        let ends = [(x, y), (x + SAMPLE - 6, y)];
        let style = self.colour().stroke_width(2);
        let drawn = match palette::dashes(self.category) {
            None => area.draw(&PathElement::new(ends, style)),
            Some([dash, gap]) => {
                let line = DashedPathElement::new(ends, dash as i32, gap as i32, style);
                area.draw(&line)
            }
        };
        drawn.map_err(ChartError::new)?;
        let middle = (x + SAMPLE / 2 - 3, y);
        area.draw(&self.marker(middle)).map_err(ChartError::new)?;
        let beside = style_of(TEXT[0], palette::GREY, (HPos::Left, VPos::Center));
        write(area, &shown(self), (x + SAMPLE, y), &beside)
    }
}

/// The name of a line in the legend.
fn shown(series: &Series) -> String {
    font::shortened(&series.label, TEXT[0], 480.0)
}

/// Text with capitals of this height.
fn style_of(height: f32, colour: Colour, (h, v): (HPos, VPos)) -> TextStyle<'static> {
    // The library writes sizes divided by this.
    const WRITTEN: f64 = 1.24;
    let size = WRITTEN * f64::from(font::size(height));
    let font = (FAMILY, size).into_font().color(&rgb(colour));
    font.pos(Pos::new(h, v))
}

fn write(
    area: &Area<'_>,
    text: &str,
    at: (i32, i32),
    style: &TextStyle<'_>,
) -> Result<(), ChartError> {
    area.draw_text(text, style, at).map_err(ChartError::new)
}

fn rgb(colour: Colour) -> RGBColor {
    let [r, g, b] = colour.map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(scale: Scale) -> Axis<'static> {
        Axis {
            title: "x",
            scale,
            number: |x| format!("{x:.3}"),
        }
    }

    /// Markers, those of the legend among them.
    fn markers(text: &str) -> usize {
        text.matches("<circle").count() + text.matches("<polygon").count()
    }

    #[test]
    fn every_line_has_its_colour_markers_and_name() {
        let series: Vec<Series> = (0..10)
            .map(|k| {
                let points = (1..=5).map(|i| (f64::from(i), f64::from(i * (k + 1))));
                Series::new(format!("größe <{k}> & λ"), k as usize, points.collect())
            })
            .chain([Series::guide(0, vec![(1.0, 1.0), (5.0, 9.0)])])
            .collect();
        for scale in [Scale::Counts, Scale::Linear, Scale::Logarithmic] {
            let chart = Chart {
                title: "a < b",
                across: axis(scale),
                up: axis(scale),
                series: &series,
            };
            let text = stacked((900, 500), &[chart.clone(), chart]).unwrap();
            if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
                let file = format!("chart_{scale:?}.svg");
                std::fs::write(std::path::Path::new(&folder).join(file), &text).unwrap();
            }
            assert_eq!(markers(&text), 2 * 10 * (5 + 1));
            assert!(text.contains("größe &lt;9&gt; &amp; λ") && text.contains("a &lt; b"));
            assert!(text.contains(FAMILY));
            for k in 0..8 {
                let RGBColor(r, g, b) = rgb(palette::colour(k));
                assert!(text.contains(&format!("#{r:02X}{g:02X}{b:02X}")), "{k}");
            }
        }
    }

    #[test]
    fn axes_have_titles_and_plain_numbers() {
        let series = [Series::new("", 0, vec![(0.0, 0.0), (3.0, 1.0)])];
        let chart = Chart {
            title: "t",
            across: Axis::counts("mode"),
            up: Axis::linear("share of the variance"),
            series: &series,
        };
        let text = stacked((500, 400), &[chart]).unwrap();
        let words: Vec<&str> = text.lines().map(str::trim).collect();
        for word in ["mode", "share of the variance", "0", "3", "0.2", "0.8", "1"] {
            assert!(words.contains(&word), "{word}: {text}");
        }
        assert!(!text.contains("e-1"), "{text}");
    }

    #[test]
    fn charts_without_points_are_drawn_too() {
        let one = [Series::new("l", 0, vec![(1.0, 2.0)])];
        let zero = [Series::new("l", 0, vec![(0.0, 0.0)])];
        let two = [Series::new("l", 0, vec![(1.0, 2.0), (1e6, 3e-4)])];
        for series in [&[][..], &one, &zero, &two] {
            for scale in [Scale::Counts, Scale::Linear, Scale::Logarithmic] {
                let chart = Chart {
                    title: "t",
                    across: axis(scale),
                    up: axis(scale),
                    series,
                };
                let text = stacked((500, 400), &[chart]).unwrap();
                assert!(!text.contains("NaN") && !text.contains("inf"), "{scale:?}");
            }
        }
        assert!(stacked((500, 400), &[]).is_ok());
    }

    #[test]
    fn long_lines_have_few_markers() {
        let points = (0..1000).map(|i| (f64::from(i), 1.0)).collect();
        let series = [Series::new("", 0, points)];
        let chart = Chart {
            title: "t",
            across: axis(Scale::Counts),
            up: axis(Scale::Linear),
            series: &series,
        };
        assert_eq!(markers(&stacked((500, 400), &[chart]).unwrap()), MARKERS);
    }
}
