//! Modes in pictures: a strip of shapes for each, and each in motion.

use fe_grid::{Grid, VectorField};
use levelset::topology::Topology;
use levelset::{Contour, ContourDistance};
use shape_pca::ModeSpace;

use super::components::displaced;
use crate::error::CliError;
use crate::geodesic::draw::{portraits, portraits_of_parts};
use shapespace_picture::{Canvas, Colour, Tiles, deviation};

/// Most modes in the strip.
const ROWS: usize = 5;
/// Shapes of a mode in the strip: the average in the middle.
const COLUMNS: usize = 5;
/// Frames of an animation, from one end to the other.
const FRAMES: usize = 17;

/// The numbers of parts, holes and tunnels that a grid shows of what a boundary encloses.
///
/// # Errors
/// [`CliError::Computation`] for a boundary without a distance.
pub(super) fn topology<const D: usize>(
    shape: &Contour<D>,
    grid: Grid<D>,
) -> Result<Topology, CliError> {
    let distance = ContourDistance::new(shape)?;
    Ok(Topology::of(&distance.sample(grid)))
}

/// The displacement of the average to the shape with one score.
pub(super) fn displacement<const D: usize>(
    space: &ModeSpace<D>,
    j: usize,
    score: f64,
) -> VectorField<f64, D> {
    let mut u = space.fields[j].clone();
    fe_grid::vector::scale(score * space.eigenvalues[j].sqrt(), u.as_mut_slice());
    space.from_average(u)
}

/// Modes that are drawn.
pub(super) struct DrawnModes<'a, const D: usize> {
    pub average: &'a Contour<D>,
    /// The boundaries of its components with their labels, each drawn in a colour of its own; none of a shape
    /// of one, which has the colour of its score.
    pub components: &'a [(i64, Contour<D>)],
    pub space: &'a ModeSpace<D>,
    /// In standard deviations.
    pub amplitude: f64,
}

impl<const D: usize> DrawnModes<'_, D> {
    /// Pictures of shapes with one score in a mode each, `(1 - a sqrt Lambda_j y_j)(S)`.
    fn pictures(&self, scores: &[(usize, f64)]) -> Vec<Canvas> {
        let moves = scores.iter().map(|&(j, score)| {
            let u = displacement(self.space, j, score);
            (
                self.average.displaced(&u, -1.0),
                displaced(self.components, &u, -1.0),
                score,
            )
        });
        let moves: Vec<_> = moves.collect();
        if self.components.is_empty() {
            let one = |score: f64| deviation(score / self.amplitude);
            let shapes = moves.iter().map(|(whole, _, score)| (whole, one(*score)));
            return portraits(&shapes.collect::<Vec<(&Contour<D>, Colour)>>());
        }
        let shapes = moves.iter().map(|(whole, parts, _)| (whole, &parts[..]));
        portraits_of_parts(&shapes.collect::<Vec<_>>())
    }

    /// Modes in rows: shapes at even scores, from one end to the other.
    pub fn strip(&self) -> Canvas {
        let rows = self.space.fields.len().min(ROWS);
        let score = |i: usize| self.amplitude * (2.0 * i as f64 / (COLUMNS - 1) as f64 - 1.0);
        let mut shapes = Vec::new();
        let mut names = Vec::new();
        for j in 0..rows {
            for i in 0..COLUMNS {
                shapes.push((j, score(i)));
                let ratio = self.space.eigenvalues[j] / self.space.eigenvalues[0];
                names.push(if i == COLUMNS / 2 {
                    format!("mode {j}, ratio {ratio:.2}")
                } else {
                    format!("{:+.1} s.d.", score(i))
                });
            }
        }
        let pictures = self.pictures(&shapes);
        let tiles: Vec<(String, Canvas)> = names.into_iter().zip(pictures).collect();
        Tiles {
            tiles: &tiles,
            columns: COLUMNS,
            side: 200,
        }
        .draw()
    }

    /// One mode in motion.
    pub fn animation(&self, j: usize) -> Vec<Canvas> {
        let share = |i: usize| 2.0 * i as f64 / (FRAMES - 1) as f64 - 1.0;
        let scores = (0..FRAMES).map(|i| (j, share(i) * self.amplitude));
        self.pictures(&scores.collect::<Vec<_>>())
    }
}

/// How many modes are drawn in motion.
pub(super) fn animated(modes: usize) -> usize {
    modes.min(ROWS)
}
