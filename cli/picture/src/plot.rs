//! A small chart of lines, as a tile among pictures.

use super::{Canvas, GREY, INK, Marker, PALE, colour, text};

/// Space left of the axis, above it, right of it and below.
const MARGINS: [f32; 4] = [62.0, 14.0, 20.0, 34.0];
/// Radius of a marker.
const RADIUS: f32 = 4.0;
/// Steps between the numbers of the vertical axis.
const STEPS: usize = 4;

/// A line with markers.
#[derive(Clone, Debug)]
pub struct PlotLine {
    /// Its points.
    pub points: Vec<[f64; 2]>,
    /// Its number, which has its colour and marker.
    pub category: usize,
}

/// Lines on two linear axes, the second upwards.
#[derive(Clone, Copy, Debug)]
pub struct LinePlot<'a> {
    /// Pixels along both sides.
    pub size: [usize; 2],
    /// The lines. Points that are not finite are left out.
    pub lines: &'a [PlotLine],
    /// Places on the horizontal axis, with their names.
    pub ticks: &'a [(f64, String)],
}

impl LinePlot<'_> {
    /// Draws the chart.
    pub fn draw(&self) -> Canvas {
        let [width, height] = self.size;
        let mut canvas = Canvas::new(width, height);
        let [left, top, right, bottom] = MARGINS;
        let inner = [width as f32 - left - right, height as f32 - top - bottom];
        let finite = |p: &&[f64; 2]| p[0].is_finite() && p[1].is_finite();
        let points = || self.lines.iter().flat_map(|l| &l.points).filter(finite);
        let across = range(self.ticks.iter().map(|t| t.0).chain(points().map(|p| p[0])));
        let up = range(points().map(|p| p[1]));
        let share = |value: f64, [low, high]: [f64; 2]| ((value - low) / (high - low)) as f32;
        let place = |p: [f64; 2]| {
            [
                left + inner[0] * share(p[0], across),
                top + inner[1] * (1.0 - share(p[1], up)),
            ]
        };
        for k in 0..=STEPS {
            let value = up[0] + (up[1] - up[0]) * k as f64 / STEPS as f64;
            let [x, y] = place([across[0], value]);
            canvas.line(&[[x, y], [x + inner[0], y]], false, 1.0, PALE);
            // Enough digits that neighbours differ.
            let digits = (1.0 - (up[1] - up[0]).log10().floor()).clamp(0.0, 9.0) as usize;
            let number = format!("{value:.digits$}");
            let at = x - 6.0 - text::width(&number, text::SMALL);
            text::draw(&mut canvas, &number, [at, y - 4.0], text::SMALL, GREY);
        }
        for (value, name) in self.ticks {
            let [x, y] = place([*value, up[0]]);
            canvas.line(&[[x, y], [x, y + 4.0]], false, 1.0, GREY);
            let middle = [x, y + 9.0];
            text::centred(&mut canvas, name, middle, text::SMALL, 60.0, GREY);
        }
        let [x, y] = place([across[0], up[0]]);
        canvas.line(&[[x, y], [x + inner[0], y]], false, 1.0, INK);
        for line in self.lines {
            let hue = colour(line.category);
            let points: Vec<[f32; 2]> = line
                .points
                .iter()
                .filter(finite)
                .map(|p| place(*p))
                .collect();
            canvas.line(&points, false, 1.6, hue);
            for [x, y] in points {
                let outline = Marker::of(line.category).outline(RADIUS);
                let placed = outline.iter().map(|p| [x + p[0], y + p[1]]).collect();
                canvas.fill(&[placed], hue);
            }
        }
        canvas
    }
}

/// The least and greatest value with some room around them; never empty.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    const ROOM: f64 = 0.06;
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values.fold(empty, |[low, high], v| [low.min(v), high.max(v)]);
    if low > high {
        return [0.0, 1.0];
    }
    let room = ROOM * (high - low);
    // Equal values are in the middle.
    let room = if room > 1e-12 * low.abs().max(high.abs()) && room > 0.0 {
        room
    } else {
        (0.1 * low.abs()).max(1e-12)
    };
    [low - room, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_never_empty() {
        assert_eq!(range([].into_iter()), [0.0, 1.0]);
        for values in [vec![0.0], vec![2.0, 2.0], vec![-1.0, 1.0], vec![1e-300]] {
            let [low, high] = range(values.iter().copied());
            assert!(values.iter().all(|v| low < *v && *v < high), "{values:?}");
        }
    }

    /// The marker of a greater value is higher, and that of a later one further to the right.
    #[test]
    fn markers_are_at_their_places() {
        let of = |points: Vec<[f64; 2]>| {
            let plot = LinePlot {
                size: [260, 200],
                lines: &[PlotLine {
                    points,
                    category: 0,
                }],
                ticks: &[(0.0, "0".into()), (1.0, "1".into())],
            };
            let canvas = plot.draw();
            let all = (0..260 * 200).map(|i| (i % 260, i / 260));
            let near = |p: [f32; 3]| p.iter().zip(colour(0)).all(|(a, b)| (a - b).abs() < 0.05);
            let coloured: Vec<_> = all.filter(|(x, y)| near(canvas.pixel(*x, *y))).collect();
            let n = coloured.len() as f64;
            assert!(n > 20.0);
            let sum = |f: fn(&(usize, usize)) -> usize| coloured.iter().map(f).sum::<usize>();
            [sum(|p| p.0) as f64 / n, sum(|p| p.1) as f64 / n]
        };
        // A second point that is not finite is left out.
        let [x, _] = of(vec![[0.2, 1.0], [0.5, f64::NAN]]);
        let [right, _] = of(vec![[0.8, 1.0]]);
        assert!(right > x + 60.0);
        let [_, rising] = of(vec![[0.0, 1.0], [0.1, 2.0], [0.2, 3.0], [1.0, 3.0]]);
        let [_, falling] = of(vec![[0.0, 3.0], [0.1, 2.0], [0.2, 1.0], [1.0, 1.0]]);
        assert!(rising < falling - 15.0, "{rising} {falling}");
    }
}
