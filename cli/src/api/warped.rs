//! Volumes and points that are carried from an input of an average to the average, or back.

use std::path::Path;

use crate::error::CliError;
use crate::pool::in_pool;
use crate::warp::{Interpolation, StoredMap, carried};
use shapespace_input::Sources;

/// The deformation of one input of an average, as `shapespace warp` uses it.
pub struct Warp {
    stored: StoredMap,
    /// From the average to the input.
    inverse: bool,
}

/// A volume at the samples of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Warped {
    /// The values, `x` fastest.
    pub values: Vec<f32>,
    /// Samples along each axis, `x` first.
    pub size: [usize; 3],
    /// Sample indices to the world.
    pub affine: [[f64; 4]; 3],
}

impl Warp {
    /// The deformation of the input of this number, from the input to the average, or `inverse`.
    ///
    /// # Errors
    /// [`CliError`] for a directory that is no average of volumes with a place in the world.
    pub fn read(
        average: &Path,
        shape: usize,
        inverse: bool,
        trust: bool,
    ) -> Result<Self, CliError> {
        Ok(Self {
            stored: StoredMap::read(average, shape, trust)?,
            inverse,
        })
    }

    /// Where points of the world go.
    pub fn points(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let map = self.stored.direction(self.inverse);
        points.iter().map(|point| map.point(*point)).collect()
    }

    /// A volume, by its name among the sources or its path.
    ///
    /// # Errors
    /// [`CliError::Input`] for a volume that cannot be read, or has no place in the world.
    pub fn volume(
        &self,
        sources: &Sources,
        name: &Path,
        interpolation: Option<Interpolation>,
        threads: Option<u32>,
    ) -> Result<Warped, CliError> {
        in_pool(threads, || {
            let image = sources.read_numbers(name)?;
            let target = self.stored.target(self.inverse);
            let back = self.stored.direction(!self.inverse);
            let (values, _) = carried(image, (&target, &back), interpolation)?;
            Ok(Warped {
                values,
                size: target.size,
                affine: target.affine,
            })
        })
    }
}
