//! Charts of horizontal bars, as SVG.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{ChartError, drawing, rgb, style_of, write};
use crate::palette;

/// Height of a bar, and space between rows.
const BAR: i32 = 18;
const GAP: i32 = 8;
/// Height of capitals in labels and in the title.
const TEXT: [f32; 2] = [8.5, 11.0];
/// Position of the start of the bars, and length of the longest.
const BARS: [i32; 2] = [330, 560];
/// Height above the rows.
const HEAD: i32 = 76;

/// A row of a bar chart.
#[derive(Clone, Debug)]
pub struct Bars {
    /// The label on the left.
    pub label: String,
    /// Lengths, one for each series of the chart; `None` draws nothing.
    pub values: Vec<Option<f64>>,
    /// The label to the right of each bar.
    pub notes: Vec<String>,
}

/// Draws horizontal bars from zero, one row each. The longest fills the width.
///
/// # Errors
/// Those of the plotting library.
pub fn bars(title: &str, series: &[&str], rows: &[Bars]) -> Result<String, ChartError> {
    let height = |bars: &Bars| bars.values.len() as i32 * (BAR + 2) + GAP;
    let total: i32 = rows.iter().map(height).sum();
    let longest = rows
        .iter()
        .flat_map(|row| row.values.iter().flatten())
        .fold(f64::MIN_POSITIVE, |a, &b| a.max(b));
    drawing((1100, (total + HEAD + 14) as u32), |area| {
        let left = (HPos::Left, VPos::Center);
        let [label, titled] = [0, 1].map(|k| style_of(TEXT[k], palette::INK, left));
        let note = style_of(TEXT[0], palette::GREY, left);
        let rectangle = |corners, index| {
            let bar = Rectangle::new(corners, rgb(palette::colour(index)).filled());
            area.draw(&bar).map_err(ChartError::new)
        };
        write(area, title, (20, 22), &titled)?;
        for (i, name) in series.iter().enumerate() {
            let x = 20 + 220 * i as i32;
            rectangle([(x, 44), (x + 16, 56)], i)?;
            write(area, name, (x + 22, 50), &note)?;
        }
        let mut y = HEAD;
        for row in rows {
            write(area, &row.label, (20, y + BAR / 2), &label)?;
            for (i, value) in row.values.iter().enumerate() {
                if let Some(value) = value {
                    let length = (f64::from(BARS[1]) * value / longest).round() as i32;
                    let right = BARS[0] + length.max(1);
                    rectangle([(BARS[0], y), (right, y + BAR - 2)], i)?;
                    let said = row.notes.get(i).map_or("", String::as_str);
                    write(area, said, (right + 6, y + BAR / 2), &note)?;
                }
                y += BAR + 2;
            }
            y += GAP;
        }
        Ok(())
    })
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
}
