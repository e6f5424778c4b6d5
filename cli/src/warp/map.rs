//! The map of an input of an average onto it, or back, in the world.

use std::path::Path;

use fe_grid::{Field, ScalarField};

use super::fields::inverted;
use crate::average::AverageConfig;
use crate::error::CliError;
use crate::report::Record;
use crate::results::{ResultFields, read_dimension, read_record};
use crate::shapes::WorldFrame;
use shapespace_input::lattice::Lattice;

/// Steps that refine the inverse at a point between nodes.
const STEPS: usize = 8;

/// From one world to another, by way of the box.
pub(crate) struct WorldMap {
    from: WorldFrame<3>,
    to: WorldFrame<3>,
    displacement: Field<f64, 3, 3>,
    /// The displacement of the deformation whose inverse this is.
    inverse_of: Option<Field<f64, 3, 3>>,
}

/// An input of an average, with both maps and lattices.
pub(crate) struct StoredMap {
    displacement: Field<f64, 3, 3>,
    average: WorldFrame<3>,
    subject: WorldFrame<3>,
    /// The samples of the input, and of the one in whose world the average lies.
    lattices: [Lattice; 2],
}

fn unfit(directory: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: directory.into(),
        command: "average",
        reason,
    }
}

impl StoredMap {
    /// Reads the deformation of one input.
    ///
    /// # Errors
    /// [`CliError::NoResult`] for results that have no place in the world,
    /// [`CliError::Option`] for a number that no input has, and those of reading the arrays.
    pub fn read(directory: &Path, shape: usize, trust: bool) -> Result<Self, CliError> {
        let dimension = read_dimension(directory).map_err(|reason| unfit(directory, reason))?;
        if dimension.dimension() != 3 {
            return Err(unfit(
                directory,
                "its shapes are flat; warps are those of volumes".into(),
            ));
        }
        let record: Record<AverageConfig, (), 3> =
            read_record(directory).map_err(|reason| unfit(directory, reason))?;
        let inputs = &record.input;
        if shape >= inputs.len() {
            return Err(CliError::Option {
                option: "--shape",
                value: shape.to_string(),
                remedy: format!(
                    "the average has the inputs 0 to {}",
                    inputs.len().saturating_sub(1)
                ),
            });
        }
        let placeless = || {
            let reason = "its inputs have no common place in the world: the average of files with affine \
                          maps, with --frame physical or centred, has one";
            unfit(directory, reason.into())
        };
        let average = WorldFrame::of_records(inputs).ok_or_else(placeless)?;
        let subject = WorldFrame::of_record(inputs, shape).ok_or_else(placeless)?;
        let lattice =
            |number: usize| Lattice::of_frame(&inputs[number].size, &inputs[number].frame);
        let [own, leading] = [lattice(shape), lattice(average.number())];
        let lattices = own.zip(leading).ok_or_else(placeless)?.into();
        let fields = ResultFields::new(directory, unfit, trust)?;
        let grid = *fields.scalar::<3>(Path::new("average.npy"))?.grid();
        Ok(Self {
            displacement: fields.displacement(&grid, "deformation", shape)?,
            average,
            subject,
            lattices,
        })
    }

    /// The map from the input to the average, or back.
    pub fn direction(&self, inverse: bool) -> WorldMap {
        let (average, subject) = (self.average, self.subject);
        if inverse {
            WorldMap {
                from: average,
                to: subject,
                displacement: inverted(&self.displacement),
                inverse_of: Some(self.displacement.clone()),
            }
        } else {
            WorldMap {
                from: subject,
                to: average,
                displacement: self.displacement.clone(),
                inverse_of: None,
            }
        }
    }

    /// The samples on which images are written that are carried to the average, or back.
    pub fn target(&self, inverse: bool) -> Lattice {
        let [own, leading] = &self.lattices;
        if inverse {
            *own
        } else {
            super::fields::within_box(leading, &self.average, self.displacement.grid())
        }
    }
}

impl WorldMap {
    /// Where a point goes.
    pub fn point(&self, world: [f64; 3]) -> [f64; 3] {
        let unit = self.from.unit(world);
        let mut image = moved(&self.displacement, unit);
        if let Some(forward) = &self.inverse_of {
            let residual = |x: [f64; 3]| {
                let y = moved(forward, x);
                let r: [f64; 3] = std::array::from_fn(|k| y[k] - unit[k]);
                (r.iter().map(|r| r * r).sum::<f64>(), r)
            };
            let mut best = residual(image);
            for _ in 0..STEPS {
                let next = std::array::from_fn(|k| image[k] - best.1[k]);
                let found = residual(next);
                if found.0 >= best.0 {
                    break;
                }
                (image, best) = (next, found);
            }
        }
        self.to.position(image)
    }
}

fn moved(displacement: &Field<f64, 3, 3>, unit: [f64; 3]) -> [f64; 3] {
    let u = displacement.sample(unit);
    std::array::from_fn(|k| unit[k] + u[k])
}

/// How values between samples are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// The multilinear interpolation of the samples around.
    Linear,
    /// The value of the nearest sample.
    Nearest,
}

/// An image at the points of another lattice that a map sends into it; 0 outside of it.
pub(super) fn pulled_back(
    image: (&ScalarField<f64, 3>, &Lattice),
    between: Between,
    target: &Lattice,
    map: &WorldMap,
) -> Vec<f32> {
    let (field, lattice) = image;
    let value = |index: usize| {
        let mut sample = lattice.to_sample(map.point(target.position(index)));
        if between == Between::Nearest {
            sample = sample.map(f64::round);
        }
        // Samples stand for boxes that reach half a spacing to both sides.
        let inside = (0..3).all(|k| (-0.5..=lattice.size[k] as f64 - 0.5).contains(&sample[k]));
        if inside {
            field.sample(sample)[0] as f32
        } else {
            0.0
        }
    };
    let indices: Vec<usize> = (0..target.count()).collect();
    fe_grid::parallel::map(&indices, &|&index| value(index))
}
