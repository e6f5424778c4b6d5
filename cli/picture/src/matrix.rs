//! A matrix of distances as colours.

use super::{Canvas, Colour, GREY, LABEL, PALE, WHITE, colour, heat, key, scale};

/// Side of all cells together, about.
const SIDE: usize = 780;
/// Smallest and largest cell.
const CELLS: [usize; 2] = [4, 64];
const BORDER: usize = 18;
/// Width of the names.
const NAMES: usize = 150;
/// Width of the stripe of colours.
const STRIPE: usize = 6;
/// Sizes of a cell from which names are legible, and small pictures visible.
const LEGIBLE: [usize; 2] = [12, 20];

/// Everything in the picture of a matrix.
#[derive(Clone, Copy)]
pub struct HeatMap<'a> {
    /// Names of the objects.
    pub names: &'a [String],
    /// Small pictures of them, of one size.
    pub marks: &'a [Canvas],
    /// The numbers of their groups, which have the colours of them.
    pub groups: &'a [usize],
    /// The objects of the rows, from above.
    pub rows: &'a [usize],
    /// The objects of the columns, from the left.
    pub columns: &'a [usize],
    /// What there is between two of them; a cell without a number is crossed out.
    pub value: &'a dyn Fn(usize, usize) -> Option<f64>,
    /// Which cells without a number are left white instead.
    pub skipped: &'a dyn Fn(usize, usize) -> bool,
    /// The title of the colour scale.
    pub title: &'a str,
}

impl HeatMap<'_> {
    /// Draws the matrix: names and small pictures on the left and above, the scale below.
    pub fn draw(&self) -> Canvas {
        let size = [self.columns.len(), self.rows.len()];
        let cell = (SIDE / size[0].max(size[1]).max(1)).clamp(CELLS[0], CELLS[1]);
        let (named, pictured) = (cell >= LEGIBLE[0], cell >= LEGIBLE[1]);
        let left = BORDER + if named { NAMES } else { 0 } + if pictured { cell } else { 0 };
        let top = BORDER + if pictured { cell } else { 0 };
        let [left, top] = [left, top].map(|edge| edge + STRIPE + 4);
        let sides = size.map(|n| n * cell);
        // The scale needs its room even under a small matrix.
        let width = (left + sides[0] + BORDER).max(420);
        let mut canvas = Canvas::new(width, top + sides[1] + BORDER + LABEL);
        let most = self.largest();
        let small = |i: usize| {
            let small = self.marks[i].reduced(cell - 2);
            let spare = small.size().map(|side| (cell - side) / 2);
            (small, spare)
        };
        for (row, &i) in self.rows.iter().enumerate() {
            let y = top + row * cell;
            for (column, &j) in self.columns.iter().enumerate() {
                let x = left + column * cell;
                match (self.value)(i, j) {
                    Some(value) => fill(&mut canvas, [x, y], [cell; 2], heat(value / most)),
                    None if (self.skipped)(i, j) => {}
                    None => cross_out(&mut canvas, [x, y], cell),
                }
            }
            let group = colour(self.groups[i]);
            let stripe = left - STRIPE - 2;
            fill(&mut canvas, [stripe, y], [STRIPE, cell], group);
            if named {
                let end = left - STRIPE - 8 - if pictured { cell } else { 0 };
                let middle = [end as f32, y as f32 + 0.5 * cell as f32];
                let room = NAMES as f32 - 10.0;
                key::before(&mut canvas, self.groups[i], &self.names[i], middle, room);
            }
            if pictured {
                let (small, spare) = small(i);
                let beside = left - STRIPE - 4 - cell;
                canvas.overlay(&small, [beside + spare[0], y + spare[1]]);
            }
        }
        for (column, &j) in self.columns.iter().enumerate() {
            let x = left + column * cell;
            let above = top - STRIPE - 2;
            fill(
                &mut canvas,
                [x, above],
                [cell, STRIPE],
                colour(self.groups[j]),
            );
            if pictured {
                let (small, spare) = small(j);
                let over = top - STRIPE - 4 - cell;
                canvas.overlay(&small, [x + spare[0], over + spare[1]]);
            }
        }
        canvas.frame([left - 1, top - 1], sides.map(|side| side + 2), PALE);
        let bottom = [BORDER, top + sides[1] + BORDER - 4];
        scale::legend(&mut canvas, self.title, most, bottom, width - 2 * BORDER);
        canvas
    }

    fn largest(&self) -> f64 {
        let pairs = self
            .rows
            .iter()
            .flat_map(|&i| self.columns.iter().map(move |&j| (i, j)));
        let values = pairs.filter_map(|(i, j)| (self.value)(i, j));
        let most = values.fold(0.0, f64::max);
        if most > 0.0 { most } else { 1.0 }
    }
}

fn fill(canvas: &mut Canvas, [x, y]: [usize; 2], size: [usize; 2], colour: Colour) {
    for j in 0..size[1] {
        for i in 0..size[0] {
            canvas.blend(x + i, y + j, colour, 1.0);
        }
    }
}

fn cross_out(canvas: &mut Canvas, [x, y]: [usize; 2], cell: usize) {
    fill(canvas, [x, y], [cell; 2], WHITE);
    let (x, y, s) = (x as f32 + 1.5, y as f32 + 1.5, cell as f32 - 3.0);
    canvas.line(&[[x, y], [x + s, y + s]], false, 1.0, GREY);
    canvas.line(&[[x + s, y], [x, y + s]], false, 1.0, GREY);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stand_in_their_order() {
        for n in [2, 12, 300] {
            let names: Vec<String> = (0..n).map(|i| format!("shape-{i:02}")).collect();
            let mut mark = Canvas::new(44, 44);
            mark.line(&[[4.0, 4.0], [40.0, 40.0]], false, 3.0, [0.0; 3]);
            let marks = vec![mark; n];
            let groups: Vec<usize> = (0..n).map(|i| i % 3).collect();
            let order: Vec<usize> = (0..n).rev().collect();
            let value = |i: usize, j: usize| (i + j != 1).then(|| i.abs_diff(j) as f64);
            let canvas = HeatMap {
                names: &names,
                marks: &marks,
                groups: &groups,
                rows: &order,
                columns: &order,
                value: &value,
                skipped: &|_, _| false,
                title: "distance",
            }
            .draw();
            if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
                let name = format!("matrix_{n}.png");
                canvas
                    .write_png(&std::path::Path::new(&folder).join(name))
                    .unwrap();
            }
            let cell = (SIDE / n).clamp(CELLS[0], CELLS[1]);
            let [width, height] = canvas.size();
            let top = height - BORDER - LABEL - n * cell;
            let left = top + if cell >= LEGIBLE[0] { NAMES } else { 0 };
            assert!(left + n * cell <= width);
            let middle = |row: usize, column: usize| {
                canvas.pixel(left + column * cell + cell / 2, top + row * cell + cell / 2)
            };
            // Rounding of the mixing of colours.
            let near = |a: Colour, b: Colour| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-5);
            assert!(near(middle(0, 0), heat(0.0)));
            if n > 2 {
                assert!(near(middle(0, n - 1), heat(1.0)));
                let share = (n - 3) as f64 / (n - 1) as f64;
                assert!(near(middle(1, n - 2), heat(share)));
            }
            // The last two are 1 and 0, which have no number: the lines cross in the middle.
            let crossed = middle(n - 1, n - 2);
            assert!(crossed[0] < 0.96 && crossed[0] > 0.3, "{crossed:?}");
        }
    }

    #[test]
    fn rows_and_columns_may_be_different_objects() {
        let names: Vec<String> = (0..12).map(|i| format!("shape-{i:02}")).collect();
        let marks = vec![Canvas::new(44, 44); 12];
        let groups: Vec<usize> = (0..12).map(|i| i % 3).collect();
        let columns: Vec<usize> = (2..12).collect();
        let value = |i: usize, j: usize| {
            let known = i < 2 && j >= 2 && [i, j] != [1, 11];
            known.then_some((j - 2 + i) as f64)
        };
        let canvas = HeatMap {
            names: &names,
            marks: &marks,
            groups: &groups,
            rows: &[0, 1],
            columns: &columns,
            value: &value,
            skipped: &|i, j| [i, j] == [1, 11],
            title: "distance",
        }
        .draw();
        let [width, height] = canvas.size();
        let cell = CELLS[1];
        let top = height - BORDER - LABEL - 2 * cell;
        let left = top + NAMES;
        assert_eq!(width, left + 10 * cell + BORDER);
        let middle = |row: usize, column: usize| {
            canvas.pixel(left + column * cell + cell / 2, top + row * cell + cell / 2)
        };
        for (row, column) in [(0, 0), (1, 3), (0, 9)] {
            let (found, sought) = (middle(row, column), heat((row + column) as f64 / 9.0));
            assert!(
                (0..3).all(|k| (found[k] - sought[k]).abs() < 1e-5),
                "{row} {column}"
            );
        }
        assert_eq!(middle(1, 9), WHITE);
        // The stripe above has the colours of the groups of the columns.
        let stripe = canvas.pixel(left + cell / 2, top - STRIPE / 2 - 2);
        assert!((0..3).all(|k| (stripe[k] - colour(2)[k]).abs() < 1e-5));
    }
}
