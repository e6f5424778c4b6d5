//! The coordinates of files: from the box of the grid to what an input, or a result, states.

use fe_grid::tensor::inverse_transpose;
use levelset::Contour;
use nalgebra::{SMatrix, SVector};

use super::{InputRecord, common_scale};
use shapespace_input::lattice::Lattice;

/// From the box to the coordinates of a file and back, `coordinates = matrix unit + shift`. In three
/// dimensions; the third coordinate of flat shapes is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coordinates<const D: usize> {
    matrix: [[f64; D]; D],
    /// Its inverse.
    inverse: [[f64; D]; D],
    shift: [f64; D],
}

impl<const D: usize> Coordinates<D> {
    /// The coordinates of the box itself.
    const UNIT: Self = {
        let mut unit = [[0.0; D]; D];
        let mut k = 0;
        while k < D {
            unit[k][k] = 1.0;
            k += 1;
        }
        Self {
            matrix: unit,
            inverse: unit,
            shift: [0.0; D],
        }
    };

    /// An affine map, by where it sends points; `None` where it is singular.
    fn of(place: impl Fn([f64; D]) -> [f64; D]) -> Option<Self> {
        let axis = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
        let shift = place([0.0; D]);
        let ends: [[f64; D]; D] = std::array::from_fn(|k| place(axis(k)));
        let matrix = std::array::from_fn(|i| std::array::from_fn(|k| ends[k][i] - shift[i]));
        let transposed = inverse_transpose(&matrix);
        let inverse: [[f64; D]; D] =
            std::array::from_fn(|i| std::array::from_fn(|k| transposed[k][i]));
        let finite = inverse.iter().flatten().all(|x| x.is_finite());
        finite.then_some(Self {
            matrix,
            inverse,
            shift,
        })
    }

    /// Those of the file of an input: of the world, where it states its place there, else those of its
    /// samples times their distance, or of its outline. `None` for a record that is damaged.
    pub fn of_input(input: &InputRecord<D>) -> Option<Self> {
        let motion = input.motion();
        let factor = input.size_factor.unwrap_or(1.0);
        Self::of(|unit| {
            let unaligned = motion.map_back(unit);
            match &input.affine {
                Some(rows) => {
                    let sample = input.frame.to_sample(unaligned);
                    let along = |i: usize| (0..D).map(|j| rows[i][j] * sample[j]).sum::<f64>();
                    std::array::from_fn(|i| along(i) + rows[i][3])
                }
                None => input.frame.to_physical(unaligned).map(|x| x / factor),
            }
        })
    }

    /// Those of a result, and the number of the input whose coordinates these are: of the one that leads,
    /// or with which the others are aligned; the box where the inputs have no common scale.
    pub fn of_result(inputs: &[InputRecord<D>]) -> Option<(Self, usize)> {
        let leads = |input: &InputRecord<D>| input.leads;
        let is_reference =
            |input: &InputRecord<D>| input.alignment.is_some_and(|alignment| alignment.reference);
        let number = inputs.iter().position(leads);
        let number = number.or_else(|| inputs.iter().position(is_reference));
        let number = number.unwrap_or(0);
        let of_input = Self::of_input(inputs.get(number)?)?;
        let common = common_scale(inputs.iter().map(InputRecord::scale)).is_some();
        Some((if common { of_input } else { Self::UNIT }, number))
    }

    /// Where a point of the box lies.
    pub fn position(&self, unit: [f64; D]) -> [f64; 3] {
        let along = |i: usize| (0..D).map(|k| self.matrix[i][k] * unit[k]).sum::<f64>();
        let position: [f64; D] = std::array::from_fn(|i| along(i) + self.shift[i]);
        in_space(position)
    }

    /// A boundary in these coordinates, with its inside where it was.
    pub fn placed(&self, shape: &Contour<D>) -> Contour<D> {
        let matrix = SMatrix::<f64, D, D>::from_fn(|i, k| self.matrix[i][k]);
        let shift = SVector::<f64, D>::from_fn(|i, _| self.shift[i]);
        shape.transformed(&matrix, &shift)
    }

    /// The point of the box at these coordinates.
    pub fn unit(&self, position: [f64; 3]) -> [f64; D] {
        let from_shift: [f64; D] = std::array::from_fn(|i| position[i] - self.shift[i]);
        std::array::from_fn(|k| (0..D).map(|i| self.inverse[k][i] * from_shift[i]).sum())
    }

    /// Whether these are the coordinates of the box.
    pub fn is_box(&self) -> bool {
        *self == Self::UNIT
    }

    /// The nodes of a grid of the box, of this many nodes at this distance.
    pub fn lattice(&self, nodes: [usize; D], spacing: f64) -> Lattice {
        lattice(nodes, |node: [f64; D]| {
            self.position(node.map(|i| spacing * i))
        })
    }

    /// The samples of an input.
    pub fn samples(&self, input: &InputRecord<D>) -> Option<Lattice> {
        let motion = input.motion();
        let place = |sample| self.position(motion.map(input.frame.to_unit(sample)));
        Some(lattice(input.size.as_slice().try_into().ok()?, place))
    }
}

/// The lattice with samples at these places, which depend on them in an affine way.
fn lattice<const D: usize>(size: [usize; D], place: impl Fn([f64; D]) -> [f64; 3]) -> Lattice {
    let axis = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
    let origin = place([0.0; D]);
    let column = |i: usize, k: usize| {
        if k < D {
            place(axis(k))[i] - origin[i]
        } else {
            f64::from(u8::from(i == k))
        }
    };
    Lattice {
        size: std::array::from_fn(|k| size.get(k).copied().unwrap_or(1)),
        affine: std::array::from_fn(|i| [column(i, 0), column(i, 1), column(i, 2), origin[i]]),
    }
}

/// A point of three coordinates, 0 where there are fewer.
pub(crate) fn in_space<const D: usize>(p: [f64; D]) -> [f64; 3] {
    std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))
}
