//! Modes of images in pictures: the average image, deformed.

use fe_grid::ScalarField;
use shape_pca::{ModeSpace, push_forward};

use super::draw::displacement;
use shapespace_picture::{Canvas, Slice, TileRows};

/// Maximum number of modes in the strip.
const ROWS: usize = 5;
/// Images of a mode in the strip: the average in the middle.
const COLUMNS: usize = 5;
/// Frames of an animation, from one end to the other.
const FRAMES: usize = 17;

/// The drawn modes.
pub(super) struct ImageModes<'a, const D: usize> {
    /// The average image.
    pub image: &'a ScalarField<f64, D>,
    /// Its modes.
    pub space: &'a ModeSpace<D>,
    /// In standard deviations.
    pub amplitude: f64,
}

impl<const D: usize> ImageModes<'_, D> {
    /// The image with one score, `u o (1 - a sqrt Lambda_j y_j)^-1`; black where the box has not been
    /// deformed to.
    fn image(&self, j: usize, score: f64) -> ScalarField<f64, D> {
        let mut moved = displacement(self.space, j, score);
        fe_grid::vector::scale(-1.0, moved.as_mut_slice());
        push_forward(self.image, &moved, 0.0)
    }

    /// Modes in rows: images at even scores, from one end to the other.
    pub fn strip(&self) -> Canvas {
        let slice = Slice::middle(self.image.grid(), TileRows::width(COLUMNS));
        let mut rows = TileRows::new(COLUMNS);
        let first = self.space.eigenvalues.first().copied().unwrap_or(1.0);
        for j in 0..self.space.fields.len().min(ROWS) {
            for i in 0..COLUMNS {
                let share = 2.0 * i as f64 / (COLUMNS - 1) as f64 - 1.0;
                let score = share * self.amplitude;
                let label = if i == COLUMNS / 2 {
                    let ratio = self.space.eigenvalues[j] / first;
                    format!("mode {j}, ratio {ratio:.2}")
                } else {
                    format!("{score:+.1} s.d.")
                };
                rows.push(label, slice.grey(&self.image(j, score)));
            }
        }
        rows.draw()
    }

    /// One mode in motion.
    pub fn animation(&self, j: usize) -> Vec<Canvas> {
        let slice = Slice::middle(self.image.grid(), TileRows::width(COLUMNS));
        (0..FRAMES)
            .map(|i| {
                let share = 2.0 * i as f64 / (FRAMES - 1) as f64 - 1.0;
                slice.grey(&self.image(j, share * self.amplitude))
            })
            .collect()
    }
}
