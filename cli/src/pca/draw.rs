//! Modes in pictures: a strip of shapes for each, and each in motion.

use fe_grid::VectorField;
use levelset::Contour;
use shape_pca::ModeSpace;

use crate::error::CliError;
use crate::geodesic::draw::portraits;
use shapespace_picture::{Canvas, Colour, Tiles, deviation};

/// Most modes in the strip.
const ROWS: usize = 5;
/// Shapes of a mode in the strip: the average in the middle.
const COLUMNS: usize = 5;
/// Frames of an animation, from one end to the other.
const FRAMES: usize = 17;

/// A contour that cannot be drawn.
pub(crate) fn shown(error: impl std::fmt::Display) -> CliError {
    CliError::Computation {
        message: format!("the average cannot be drawn: {error}"),
        remedy: "check that the average contains nodes of its grid".into(),
    }
}

/// The average shape moved by a multiple of a displacement.
pub(crate) fn moved<const D: usize>(
    shape: &Contour<D>,
    u: &VectorField<f64, D>,
    factor: f64,
) -> Contour<D> {
    shape.map(|p| {
        let u = u.sample(p);
        std::array::from_fn(|k| p[k] + factor * u[k])
    })
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
    pub space: &'a ModeSpace<D>,
    /// In standard deviations.
    pub amplitude: f64,
}

impl<const D: usize> DrawnModes<'_, D> {
    /// The shape with one score, `(1 - a sqrt Lambda_j y_j)(S)`.
    fn shape(&self, j: usize, score: f64) -> Contour<D> {
        moved(self.average, &displacement(self.space, j, score), -1.0)
    }

    /// Modes in rows: shapes at even scores, from one end to the other.
    pub fn strip(&self) -> Canvas {
        let rows = self.space.fields.len().min(ROWS);
        let score = |i: usize| self.amplitude * (2.0 * i as f64 / (COLUMNS - 1) as f64 - 1.0);
        let mut shapes = Vec::new();
        let mut names = Vec::new();
        for j in 0..rows {
            for i in 0..COLUMNS {
                shapes.push((
                    self.shape(j, score(i)),
                    deviation(score(i) / self.amplitude),
                ));
                let ratio = self.space.eigenvalues[j] / self.space.eigenvalues[0];
                names.push(if i == COLUMNS / 2 {
                    format!("mode {j}, ratio {ratio:.2}")
                } else {
                    format!("{:+.1} s", score(i))
                });
            }
        }
        let pairs: Vec<(&Contour<D>, Colour)> = shapes.iter().map(|(s, c)| (s, *c)).collect();
        let pictures = portraits(&pairs);
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
        let shapes: Vec<(Contour<D>, Colour)> = (0..FRAMES)
            .map(|i| {
                let share = 2.0 * i as f64 / (FRAMES - 1) as f64 - 1.0;
                (self.shape(j, share * self.amplitude), deviation(share))
            })
            .collect();
        let pairs: Vec<(&Contour<D>, Colour)> = shapes.iter().map(|(s, c)| (s, *c)).collect();
        portraits(&pairs)
    }
}

/// How many modes are drawn in motion.
pub(super) fn animated(modes: usize) -> usize {
    modes.min(ROWS)
}
