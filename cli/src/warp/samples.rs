//! Images at both ends of a map: where their samples lie, and their values there.

use std::path::Path;

use fe_grid::Grid;

use super::fields::{border_of, within_box};
use super::route::WorldMap;
use crate::error::CliError;
use crate::shapes::{Coordinates, InputRecord};
use shapespace_input::Numbers;
use shapespace_input::lattice::Lattice;

/// How the samples of an image are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Placing {
    /// By its file, in the world.
    World,
    /// They are those of an input.
    Input(usize),
    /// They lie in a plane of the world by their file, or are those of an input there.
    Plane(usize),
    /// They are the nodes of the grid, or lie between them at equal distances.
    Nodes,
}

/// The images at one end of a map.
#[derive(Clone, Debug)]
pub(crate) struct Side {
    placing: Placing,
    /// The samples of images that are written; for nodes without those between them.
    lattice: Lattice,
    /// Samples in a spacing of the grid.
    refine: usize,
}

/// How values between samples are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// The multilinear interpolation of the samples around.
    Linear,
    /// The value of the nearest sample.
    Nearest,
}

/// An image that was carried.
pub(crate) struct Carried {
    /// The values, `x` fastest.
    pub values: Vec<f32>,
    /// Samples whose place has no exact inverse.
    pub inexact: usize,
}

impl Side {
    /// That of an input.
    pub fn of_input<const D: usize>(
        number: usize,
        input: &InputRecord<D>,
        coordinates: &Coordinates<D>,
    ) -> Option<Self> {
        let placing = if D == 3 && input.states_place() {
            Placing::World
        } else if input.states_place() {
            Placing::Plane(number)
        } else {
            Placing::Input(number)
        };
        Some(Self {
            placing,
            lattice: coordinates.samples(input)?,
            refine: 1,
        })
    }

    /// That of a result: in the world the samples of an input, continued where needed, in the box of the
    /// grid, else its nodes.
    pub fn of_result<const D: usize>(
        leading: &InputRecord<D>,
        coordinates: &Coordinates<D>,
        grid: &Grid<D>,
        refine: usize,
    ) -> Option<Self> {
        if D == 3 && leading.states_place() && !coordinates.is_box() {
            let samples = coordinates.samples(leading)?;
            let position = |unit| coordinates.position(unit);
            return Some(Self {
                placing: Placing::World,
                lattice: within_box(&samples, grid, border_of(leading), &position),
                refine: 1,
            });
        }
        Some(Self {
            placing: Placing::Nodes,
            lattice: coordinates.lattice(grid.nodes_per_axis(), grid.spacing()),
            refine,
        })
    }

    /// Number of samples of images that are written, if it is not beyond all bounds.
    pub fn samples(&self) -> Option<usize> {
        let along = |n: usize| n.saturating_sub(1).checked_mul(self.refine)?.checked_add(1);
        let mut axes = self.lattice.size.iter();
        axes.try_fold(1usize, |count, &n| count.checked_mul(along(n)?))
    }

    /// Whether images state their place in the world.
    pub fn in_world(&self) -> bool {
        self.placing == Placing::World
    }

    /// The samples of images that are written.
    pub fn target(&self) -> Lattice {
        self.lattice.refined(self.refine)
    }

    /// The samples of an image that is read.
    ///
    /// # Errors
    /// [`CliError::Option`] for one with other samples.
    pub fn lattice_of(&self, path: &Path, image: &Numbers) -> Result<Lattice, CliError> {
        let size = &image.size;
        let axes = |size: [usize; 3]| -> String {
            let some = size.iter().filter(|&&n| n > 1).map(usize::to_string);
            some.collect::<Vec<_>>().join(" x ")
        };
        let whole: [usize; 3] = std::array::from_fn(|k| size.get(k).copied().unwrap_or(1));
        let refused = |remedy: String| CliError::Option {
            option: "FILE",
            value: format!("'{}' of {} samples", path.display(), axes(whole)),
            remedy,
        };
        let own = self.lattice.size;
        if let (Placing::Plane(_), Some(affine)) = (self.placing, &image.affine) {
            return Ok(Lattice {
                size: whole,
                affine: in_plane(affine),
            });
        }
        match self.placing {
            Placing::World => {
                let affine = image.affine.filter(|_| size.len() == 3);
                let affine = affine
                    .ok_or_else(|| shapespace_input::InputError::Placeless { path: path.into() })?;
                Ok(Lattice {
                    size: whole,
                    affine,
                })
            }
            Placing::Plane(_) | Placing::Input(_) if whole == own => Ok(self.lattice),
            Placing::Plane(number) | Placing::Input(number) => Err(refused(format!(
                "without a place in the world, give an image with the samples of input {number}: {}",
                axes(own)
            ))),
            Placing::Nodes => {
                let between = whole[0].saturating_sub(1) / (own[0] - 1);
                let lattice = self.lattice.refined(between.max(1));
                if lattice.size == whole {
                    return Ok(lattice);
                }
                Err(refused(format!(
                    "give an image with the {} nodes of the grid, or one that was carried there with \
                     --refine",
                    axes(own)
                )))
            }
        }
    }
}

/// The affine map of samples in a plane, without their height.
fn in_plane(affine: &[[f64; 4]; 3]) -> [[f64; 4]; 3] {
    let [x, y, _] = affine;
    [
        [x[0], x[1], 0.0, x[3]],
        [y[0], y[1], 0.0, y[3]],
        [0.0, 0.0, 1.0, 0.0],
    ]
}

/// The values of an image at the samples of a lattice, whose points a map sends back into it; 0 outside
/// of it. Whole numbers are taken from the nearest sample unless asked otherwise.
pub(crate) fn carried(
    (image, lattice): (&Numbers, &Lattice),
    (target, back): (&Lattice, &WorldMap),
    between: Between,
    small: f64,
) -> Carried {
    let value = |index: usize| {
        let found = back.point(target.position(index));
        let mut sample = lattice.to_sample(found.position);
        if between == Between::Nearest {
            sample = sample.map(f64::round);
        }
        // Samples stand for boxes that reach half a spacing to both sides.
        let inside = (0..3).all(|k| (-0.5..=lattice.size[k] as f64 - 0.5).contains(&sample[k]));
        if inside {
            let value = interpolated(&image.values, lattice.size, sample);
            (value as f32, value != 0.0 && found.defect > small)
        } else {
            (0.0, false)
        }
    };
    let along = target.size[0];
    let mut values = vec![0.0; target.count()];
    let mut inexact = vec![0; target.count() / along];
    let rows = values.chunks_exact_mut(along).zip(&mut inexact);
    fe_grid::parallel::for_each(rows.enumerate(), &|(row, (values, inexact))| {
        for (i, out) in values.iter_mut().enumerate() {
            let (value, is_inexact) = value(along * row + i);
            *out = value;
            *inexact += usize::from(is_inexact);
        }
    });
    Carried {
        values,
        inexact: inexact.iter().sum(),
    }
}

/// The samples of the objects of a label image that lie outside of the box of the grid, on a way from there, and all
/// samples of its objects.
pub(super) fn beyond_box(
    (image, lattice): (&Numbers, &Lattice),
    there: &WorldMap,
    small: f64,
) -> [usize; 2] {
    let along = lattice.size[0];
    let rows = image.values.chunks(along).enumerate();
    let counts = fe_grid::parallel::map(rows, &|(row, values)| {
        let mut found = [0, 0];
        for (i, _) in values
            .iter()
            .enumerate()
            .filter(|(_, value)| **value != 0.0)
        {
            let place = there.point(lattice.position(along * row + i));
            found[0] += usize::from(place.outside > small);
            found[1] += 1;
        }
        found
    });
    let counts = counts.into_iter();
    counts.fold([0, 0], |sum, found| [sum[0] + found[0], sum[1] + found[1]])
}

/// The multilinear interpolation of samples, beyond the outermost of which the nearest counts.
fn interpolated(values: &[f64], size: [usize; 3], sample: [f64; 3]) -> f64 {
    let (mut base, mut share) = ([0; 3], [0.0; 3]);
    for k in 0..3 {
        let x = sample[k].clamp(0.0, (size[k] - 1) as f64);
        base[k] = (x as usize).min(size[k].saturating_sub(2));
        share[k] = x - base[k] as f64;
    }
    let strides = [1, size[0], size[0] * size[1]];
    let mut sum = 0.0;
    for corner in 0..8 {
        let (mut weight, mut index) = (1.0, 0);
        for k in 0..3 {
            let upper = corner >> k & 1;
            weight *= if upper == 1 { share[k] } else { 1.0 - share[k] };
            index += strides[k] * (base[k] + upper);
        }
        if weight > 0.0 {
            sum += weight * values[index];
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_interpolated_along_axes_of_any_length() {
        let flat: Vec<f64> = (0..6).map(f64::from).collect();
        // x + 3 y at the samples (x, y).
        assert_eq!(interpolated(&flat, [3, 2, 1], [1.5, 0.25, 0.0]), 2.25);
        assert_eq!(interpolated(&flat, [3, 2, 1], [2.4, 1.3, 0.2]), 5.0);
        assert_eq!(interpolated(&flat, [1, 2, 3], [0.0, 0.5, 1.5]), 3.5);
    }

    #[test]
    fn images_without_a_place_have_the_samples_of_the_input_or_of_the_grid() {
        let lattice = Lattice {
            size: [5, 3, 1],
            affine: [
                [2.0, 0.0, 0.0, 1.0],
                [0.0, 4.0, 0.0, 1.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
        };
        let side = |placing| Side {
            placing,
            lattice,
            refine: 2,
        };
        let image = |size: [usize; 2]| Numbers {
            values: vec![0.0; size[0] * size[1]],
            size: size.to_vec(),
            affine: None,
        };
        let path = Path::new("x.png");
        let nodes = side(Placing::Nodes);
        assert_eq!(nodes.target().size, [9, 5, 1]);
        for (size, spacing) in [([5, 3], 2.0), ([9, 5], 1.0), ([13, 7], 2.0 / 3.0)] {
            let found = nodes.lattice_of(path, &image(size)).unwrap();
            assert_eq!((found.size[0], found.affine[0][0]), (size[0], spacing));
        }
        for size in [[3, 5], [9, 3], [4, 3]] {
            assert!(nodes.lattice_of(path, &image(size)).is_err(), "{size:?}");
        }
        let input = side(Placing::Input(1));
        assert!(input.lattice_of(path, &image([5, 3])).is_ok());
        let error = input.lattice_of(path, &image([9, 5])).unwrap_err();
        assert!(error.to_string().contains("9 x 5"), "{error}");
        assert!(
            side(Placing::World)
                .lattice_of(path, &image([5, 3]))
                .is_err()
        );
    }
}
