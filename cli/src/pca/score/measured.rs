//! What is found of a new shape. As a row of numbers it goes from one process to another, and to checkpoints.

use fe_grid::VectorField;
use levelset::{Cause, Contour, Doubt};
use shape_pca::{ModeSpace, Scores};

/// A new shape and its scores.
pub(super) struct Measured<const D: usize> {
    /// Overlap of the shape, deformed onto the average, with the average.
    pub overlap: f64,
    /// Stored energy of this deformation.
    pub elastic: f64,
    pub doubts: Vec<Doubt>,
    /// Inner products of the displacement with the modes, and with itself.
    pub products: Vec<f64>,
    pub scores: Scores,
    /// Of the reconstruction by the first `m` modes.
    pub dice: Vec<f64>,
    pub distance: Vec<f64>,
    /// If it is shown, its boundary and those of the reconstructions by the [shown modes](shown_modes).
    pub outlines: Vec<Contour<D>>,
    pub displacement: VectorField<f64, D>,
}

/// The numbers of modes whose reconstructions are shown: none, half of them, and all.
pub(super) fn shown_modes(n_modes: usize) -> [usize; 3] {
    [0, n_modes.div_ceil(2), n_modes]
}

impl<const D: usize> Measured<D> {
    /// The numbers of modes of the outlines after the first.
    pub fn shown_modes(&self) -> [usize; 3] {
        shown_modes(self.scores.scores.len())
    }

    /// All of it in a row.
    pub fn into_numbers(self) -> Vec<f64> {
        let mut row = vec![self.overlap, self.elastic];
        row.push(self.doubts.len() as f64);
        for doubt in &self.doubts {
            let index = |index: Option<usize>| index.map_or(-1.0, |index| index as f64);
            row.extend([index(doubt.shape), index(doubt.component)]);
            row.extend([doubt.figure, doubt.limit]);
        }
        // Causes have names, no numbers.
        let causes: Vec<Cause> = self.doubts.iter().map(|doubt| doubt.cause).collect();
        let causes = serde_json::to_vec(&causes).unwrap_or_default();
        put(&mut row, causes.into_iter().map(f64::from));
        for numbers in [self.products, self.dice, self.distance] {
            put(&mut row, numbers);
        }
        row.push(self.outlines.len() as f64);
        for outline in &self.outlines {
            put(&mut row, outline.points().iter().flatten().copied());
            let corners = outline.simplices().iter().flatten();
            put(&mut row, corners.map(|corner| f64::from(*corner)));
        }
        row.extend(self.displacement.into_vec());
        row
    }

    /// The inverse, of a shape in these modes; `None` for numbers of something else.
    pub fn of_numbers(numbers: &[f64], space: &ModeSpace<D>) -> Option<Self> {
        let mut row = Row(numbers);
        let [overlap, elastic] = row.take()?;
        let mut doubts = Vec::new();
        let n_doubts = row.count()?;
        for _ in 0..n_doubts {
            let [shape, component, figure, limit] = row.take()?;
            let index = |number: f64| (number >= 0.0).then_some(number as usize);
            doubts.push((index(shape), index(component), figure, limit));
        }
        let causes: Vec<u8> = row.part()?.iter().map(|byte| *byte as u8).collect();
        let causes: Vec<Cause> = serde_json::from_slice(&causes).ok()?;
        let [products, dice, distance] = [row.part()?, row.part()?, row.part()?];
        let fits = [products, dice, distance].map(|all| all.len() == space.fields.len() + 1);
        let mut outlines = Vec::new();
        let n_outlines = row.count()?;
        for _ in 0..n_outlines {
            let (points, []) = row.part()?.as_chunks() else {
                return None;
            };
            let (simplices, []) = row.part()?.as_chunks::<D>() else {
                return None;
            };
            let simplices = simplices.iter().map(|corners| corners.map(|c| c as u32));
            outlines.push(Contour::new(points.to_vec(), simplices.collect()).ok()?);
        }
        let displacement = VectorField::from_vec(*space.object.grid(), row.0.to_vec()).ok()?;
        let fits = fits == [true; 3] && causes.len() == doubts.len();
        fits.then(|| Self {
            overlap,
            elastic,
            doubts: doubts
                .into_iter()
                .zip(causes)
                .map(|((shape, component, figure, limit), cause)| Doubt {
                    shape,
                    component,
                    cause,
                    figure,
                    limit,
                })
                .collect(),
            scores: space.scores_of(products),
            products: products.to_vec(),
            dice: dice.to_vec(),
            distance: distance.to_vec(),
            outlines,
            displacement,
        })
    }
}

/// Adds numbers to a row, after their count.
fn put(row: &mut Vec<f64>, numbers: impl IntoIterator<Item = f64>) {
    let place = row.len();
    row.push(0.0);
    row.extend(numbers);
    row[place] = (row.len() - place - 1) as f64;
}

/// What is left of a row of numbers.
struct Row<'a>(&'a [f64]);

impl<'a> Row<'a> {
    fn take<const N: usize>(&mut self) -> Option<[f64; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    /// A count of things that are in the row.
    fn count(&mut self) -> Option<usize> {
        let [count] = self.take()?;
        let is_count = count >= 0.0 && count <= self.0.len() as f64;
        is_count.then_some(count as usize)
    }

    /// So many numbers as the next one says.
    fn part(&mut self) -> Option<&'a [f64]> {
        let count = self.count()?;
        let (part, rest) = self.0.split_at(count);
        self.0 = rest;
        Some(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Grid, ScalarField};
    use shape_pca::{PcaParams, SampleSize};

    #[test]
    fn numbers_are_all_of_it() {
        let grid = Grid::<2>::dyadic(2);
        let field = |factor: f64| VectorField::from_fn(grid, |[x, y]| [factor * x, y.sin()]);
        let space = ModeSpace {
            params: PcaParams::default(),
            object: ScalarField::from_fn(grid, |_| [1.0]),
            mean: field(0.1),
            eigenvalues: vec![0.5, 0.1],
            fields: vec![field(0.2), field(-0.3)],
            sample: SampleSize::equal(3),
        };
        let outline = |x: f64| {
            let points = vec![[x, 0.1], [0.7, 0.3], [0.2, 0.6]];
            Contour::new(points, vec![[0, 1], [1, 2], [2, 0]]).unwrap()
        };
        let products = vec![0.1, 1.0 / 3.0, 2.0];
        let doubt = |shape, component, cause, figure| Doubt {
            shape,
            component,
            cause,
            figure,
            limit: 0.95,
        };
        let measured = || Measured {
            overlap: 0.9,
            elastic: 1e-3,
            doubts: vec![
                doubt(None, Some(1), Cause::Overlap, 0.9),
                doubt(Some(2), None, Cause::Determinant, f64::INFINITY),
            ],
            scores: space.scores_of(&products),
            products: products.clone(),
            dice: vec![0.7, 0.8, 0.9],
            distance: vec![0.03, 0.02, 0.01],
            outlines: vec![outline(0.0), outline(0.1)],
            displacement: field(0.7),
        };
        let numbers = measured().into_numbers();
        let (found, expected) = (Measured::of_numbers(&numbers, &space).unwrap(), measured());
        assert_eq!(found.doubts, expected.doubts);
        assert_eq!(found.scores, expected.scores);
        assert_eq!(found.outlines, expected.outlines);
        assert_eq!(found.displacement, expected.displacement);
        assert_eq!(found.into_numbers(), numbers);
        // Of anything else there is nothing.
        for (place, wrong) in [(2, 1e9), (2, f64::NAN), (2, 1.0), (11, 3.0), (11, -1.0)] {
            let mut numbers = numbers.clone();
            numbers[place] = wrong;
            assert!(Measured::of_numbers(&numbers, &space).is_none(), "{place}");
        }
        for length in 0..numbers.len() {
            assert!(Measured::of_numbers(&numbers[..length], &space).is_none());
        }
    }
}
