//! Sampled images, and how the numbers of files become their values.

use std::path::PathBuf;

use levelset::Contour;

use crate::dimension::Dim;
use crate::values::Values;

/// The value that separates the object from the rest.
pub const LEVEL: f64 = 0.5;

/// How the numbers of a file are converted to values in `[0, 1]`.
///
/// Without a label: numbers of exactly two levels become 0 and 1; 8-bit and 16-bit images are
/// divided by their full range (numbers that are only 0 and 1 stay); floating-point numbers must
/// lie in `[0, 1]` already. In volumes of integers every number but 0 is the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The object is where the number equals this label.
    pub label: Option<i64>,
    /// The object is dark, and the background bright.
    pub invert: bool,
}

impl ReadOptions {
    /// These, or others where nothing is stated.
    #[must_use]
    pub fn or(self, others: Self) -> Self {
        if self == Self::default() {
            others
        } else {
            self
        }
    }
}

/// A sampled image with values in `[0, 1]`. Sample `i` stands for the box of one spacing about
/// the point `origin + i * spacing`.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<const D: usize> {
    /// The values, `x` fastest.
    pub values: Values,
    /// Samples along each axis, `x` first.
    pub size: [usize; D],
    /// Distance of neighbouring samples along each axis, in the units of the file.
    pub spacing: [f64; D],
    /// Position of sample 0.
    pub origin: [f64; D],
    /// The file.
    pub path: PathBuf,
    /// Affine map from sample indices to world coordinates (rows of a 3x4 matrix), if the file
    /// states it.
    pub affine: Option<[[f64; 4]; 3]>,
    /// Directions of the axes in the world, row by row, for an image that is placed in the world
    /// ([`Image::in_world`]): then sample `i` stands for the box about
    /// `direction (i * spacing) + origin`, in millimetres.
    pub direction: Option<[[f64; D]; D]>,
    /// Whether the values are the unchanged numbers of the file, so that they can be used as nodal
    /// values.
    pub plain_array: bool,
    /// The exact boundary in (fractional) sample indices, where the file has one; the values are
    /// then samples of what it encloses.
    pub outline: Option<Contour<D>>,
    /// What was mended when the file was read.
    pub remark: Option<String>,
}

/// Distance of two places, in spacings, up to which they are one: affine maps are stored in single precision.
const SAME_PLACE: f64 = 1e-3;

impl<const D: usize> Image<D> {
    /// Whether it has the axes of another image in the world, in whatever order and direction, and one of its corner
    /// samples at the place of one of the other's: the same affine map, up to how the samples are stored.
    pub fn has_axes_of(&self, other: &Self) -> bool {
        let (Some(own), Some(there)) = (&self.affine, &other.affine) else {
            return false;
        };
        if own == there {
            return true;
        }
        let column = |affine: &[[f64; 4]; 3], k: usize| affine.map(|row| row[k]);
        let moved = |p: [f64; 3], by: f64, q: [f64; 3]| std::array::from_fn(|i| p[i] + by * q[i]);
        let length = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let shortest = (0..D).map(|k| length(column(there, k)));
        let near = SAME_PLACE * shortest.fold(f64::INFINITY, f64::min);
        let mut taken = [false; D];
        for k in 0..D {
            let along = |j: usize, sign: f64| {
                length(moved(column(own, k), -sign, column(there, j))) <= near
            };
            let mut free = (0..D).filter(|&j| !taken[j]);
            let Some(j) = free.find(|&j| along(j, 1.0) || along(j, -1.0)) else {
                return false;
            };
            taken[j] = true;
        }
        let corners = |affine: &[[f64; 4]; 3], size: [usize; D]| -> Vec<[f64; 3]> {
            let corner = |bits: usize| {
                let last = (0..D).filter(|k| bits >> k & 1 == 1);
                last.fold(column(affine, 3), |p, k| {
                    moved(p, (size[k] - 1) as f64, column(affine, k))
                })
            };
            (0..1 << D).map(corner).collect()
        };
        let theirs = corners(there, other.size);
        let is_theirs = |p: &[f64; 3]| theirs.iter().any(|q| length(moved(*p, -1.0, *q)) <= near);
        corners(own, self.size).iter().any(is_theirs)
    }

    /// Position in memory of a sample.
    pub fn index(&self, sample: [usize; D]) -> usize {
        (0..D)
            .rev()
            .fold(0, |index, k| index * self.size[k] + sample[k])
    }

    /// The sample at a position in memory.
    pub fn sample(&self, mut index: usize) -> [usize; D] {
        self.size.map(|n| {
            let i = index % n;
            index /= n;
            i
        })
    }

    /// First and last sample of the object along each axis, or `None` where there is no object.
    pub fn object_bounds(&self) -> Option<[[usize; 2]; D]> {
        let mut bounds: Option<[[usize; 2]; D]> = None;
        for (index, value) in self.values.iter().enumerate() {
            if value > LEVEL {
                let sample = self.sample(index);
                let bounds = bounds.get_or_insert_with(|| sample.map(|i| [i, i]));
                for k in 0..D {
                    bounds[k] = [bounds[k][0].min(sample[k]), bounds[k][1].max(sample[k])];
                }
            }
        }
        bounds
    }
}

/// Returns an image that is 1 from one sample to another along each axis, both included, and 0
/// elsewhere.
pub fn block<const D: usize>(
    size: [usize; D],
    spacing: [f64; D],
    low: [usize; D],
    high: [usize; D],
) -> Image<D> {
    let mut image = Image {
        values: Vec::<u8>::new().into(),
        size,
        spacing,
        origin: [0.0; D],
        path: "block".into(),
        affine: None,
        direction: None,
        plain_array: false,
        outline: None,
        remark: None,
    };
    let inside = |index| {
        let sample = image.sample(index);
        u8::from((0..D).all(|k| (low[k]..=high[k]).contains(&sample[k])))
    };
    let values: Vec<u8> = (0..size.iter().product()).map(inside).collect();
    image.values = values.into();
    image
}

/// An image of either dimension.
pub type AnyImage = Dim<Image<2>, Image<3>>;

/// Images of one dimension.
pub type AnyImages = Dim<Vec<Image<2>>, Vec<Image<3>>>;

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(size: [usize; 3], affine: [[f64; 4]; 3]) -> Image<3> {
        Image {
            affine: Some(affine),
            ..block(size, [1.0; 3], [0; 3], [0; 3])
        }
    }

    #[test]
    fn axes_are_the_same_in_another_order() {
        let image = stored(
            [4, 5, 6],
            [
                [2.0, 0.0, 0.0, 7.0],
                [0.0, 1.0, 0.0, -3.0],
                [0.0, 0.0, 3.0, 1.0],
            ],
        );
        // The first axis is the last one here, and reversed.
        let reversed = [
            [0.0, 0.0, -2.0, 13.0],
            [0.0, 1.0, 0.0, -3.0],
            [3.0, 0.0, 0.0, 1.0],
        ];
        let other = stored([6, 5, 4], reversed);
        assert!(image.has_axes_of(&image) && other.has_axes_of(&image));
        assert!(image.has_axes_of(&other));
        let mut moved = reversed;
        moved[0][3] += 0.01;
        assert!(!stored([6, 5, 4], moved).has_axes_of(&image));
        // One with more samples begins at the same place, however both are stored.
        let larger = stored([7, 6, 8], image.affine.unwrap());
        let mut last = reversed;
        last[0][3] = 21.0;
        let reversed_larger = stored([7, 6, 8], last);
        assert!(larger.has_axes_of(&image) && larger.has_axes_of(&other));
        assert!(reversed_larger.has_axes_of(&image) && reversed_larger.has_axes_of(&larger));
        last[0][3] = 20.0;
        assert!(!stored([7, 6, 8], last).has_axes_of(&image));
        let mut turned = reversed;
        turned[1][2] = 0.1;
        assert!(!stored([6, 5, 4], turned).has_axes_of(&image));
        let nowhere = Image {
            affine: None,
            ..image.clone()
        };
        assert!(!image.has_axes_of(&nowhere));
    }
}
