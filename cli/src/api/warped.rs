//! Images and points that are carried from one shape of a result to another.

use std::path::Path;

use crate::error::CliError;
use crate::pool::in_pool;
use crate::warp::{Interpolation, StoredMap, Way, between, carried};
use shapespace_input::Sources;

/// The deformations between two shapes of a result, as `shapespace warp` uses them.
pub struct Warp {
    stored: StoredMap,
    inverse: bool,
}

/// An image at other samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Warped {
    /// The values, `x` fastest.
    pub values: Vec<f32>,
    /// Samples along each axis, `x` first; one along the last in the plane.
    pub size: [usize; 3],
    /// Sample indices to the world, or to the coordinates of the result or of the input.
    pub affine: [[f64; 4]; 3],
}

impl Warp {
    /// The deformations of a result between two of its shapes, or `inverse`. Images of results without a
    /// place in the world have `refine` samples in a spacing of the grid.
    ///
    /// # Errors
    /// [`CliError`] for a directory without deformations, and for options that do not fit it.
    pub fn read(
        result: &Path,
        way: &Way,
        (inverse, refine): (bool, usize),
        trust: bool,
    ) -> Result<Self, CliError> {
        Ok(Self {
            stored: StoredMap::read(result, way, refine, trust)?,
            inverse,
        })
    }

    /// Dimension of the shapes.
    pub fn dimension(&self) -> usize {
        self.stored.dimension()
    }

    /// Where points go; in the plane the third coordinate is 0.
    pub fn points(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let map = self.stored.direction(self.inverse);
        points
            .iter()
            .map(|point| map.point(*point).position)
            .collect()
    }

    /// An image, by its name among the sources or its path.
    ///
    /// # Errors
    /// [`CliError::Input`] for an image that cannot be read, or has no place in the world where it needs
    /// one, and [`CliError::Option`] for one with other samples than the input.
    pub fn image(
        &self,
        sources: &Sources,
        name: &Path,
        interpolation: Option<Interpolation>,
        threads: Option<u32>,
    ) -> Result<Warped, CliError> {
        in_pool(threads, || {
            let image = sources.read_numbers(name)?;
            let [from, to] = self.stored.sides(self.inverse);
            let lattice = from.lattice_of(name, &image)?;
            let target = to.target();
            let back = self.stored.direction(!self.inverse);
            let between = between(image.are_labels(), interpolation);
            let small = self.stored.small();
            let found = carried((&image, &lattice), (&target, &back), between, small);
            Ok(Warped {
                values: found.values,
                size: target.size,
                affine: target.affine,
            })
        })
    }
}
