//! Lattices of samples in the world.

use fe_grid::tensor::inverse_transpose;
use levelset::bounds;

use super::frame::FrameTransform;

/// Samples in the world, and how many there are along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Samples along each axis, `x` first.
    pub size: [usize; 3],
    /// Sample indices to world coordinates.
    pub affine: [[f64; 4]; 3],
}

impl Lattice {
    /// The lattice of the samples of an image that lies in the world; `None` for any other frame.
    pub fn of_frame<const D: usize>(size: &[usize], frame: &FrameTransform<D>) -> Option<Self> {
        if D != 3 || !frame.in_world() {
            return None;
        }
        let place = |sample: [f64; D]| frame.to_physical(frame.to_unit(sample));
        let origin = place([0.0; D]);
        let ends: [[f64; D]; D] =
            std::array::from_fn(|k| place(std::array::from_fn(|i| f64::from(u8::from(i == k)))));
        Some(Self {
            size: size.try_into().ok()?,
            affine: std::array::from_fn(|i| {
                let step = |j: usize| ends[j][i] - origin[i];
                [step(0), step(1), step(2), origin[i]]
            }),
        })
    }

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.size.iter().product()
    }

    /// Distance of neighbouring samples along each axis.
    pub fn spacing(&self) -> [f64; 3] {
        let square = |j: usize| self.affine.iter().map(|row| row[j] * row[j]).sum::<f64>();
        std::array::from_fn(|j| square(j).sqrt())
    }

    /// The sample at a position in memory.
    pub fn sample(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// World coordinates of a (fractional) sample.
    pub fn to_world(&self, sample: [f64; 3]) -> [f64; 3] {
        self.affine
            .map(|row| (0..3).map(|j| row[j] * sample[j]).sum::<f64>() + row[3])
    }

    /// World coordinates of the sample at a position in memory.
    pub fn position(&self, index: usize) -> [f64; 3] {
        self.to_world(self.sample(index).map(|i| i as f64))
    }

    /// The sample at a point of the world.
    pub fn to_sample(&self, world: [f64; 3]) -> [f64; 3] {
        let matrix: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| self.affine[i][j]));
        let inverse = inverse_transpose(&matrix);
        let relative: [f64; 3] = std::array::from_fn(|i| world[i] - self.affine[i][3]);
        std::array::from_fn(|j| (0..3).map(|i| inverse[i][j] * relative[i]).sum())
    }

    /// The samples of this lattice with others between them, at a whole fraction of their distance.
    #[must_use]
    pub fn refined(&self, parts: usize) -> Self {
        let parts = parts.max(1);
        let mut affine = self.affine;
        for step in affine.iter_mut().flat_map(|row| &mut row[..3]) {
            *step /= parts as f64;
        }
        Self {
            size: self.size.map(|n| n.saturating_sub(1) * parts + 1),
            affine,
        }
    }

    /// The samples of this lattice, continued where needed, in the box around points of the world.
    #[must_use]
    pub fn around(&self, points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let [low, high] = bounds(points.into_iter().map(|point| self.to_sample(point)));
        // Corners that are samples but for rounding are taken in.
        let first = low.map(|x| (x - 1e-6).ceil());
        let size =
            std::array::from_fn(|k| ((high[k] + 1e-6).floor() - first[k]).max(1.0) as usize + 1);
        let origin = self.to_world(first);
        let mut affine = self.affine;
        for (row, x) in affine.iter_mut().zip(origin) {
            row[3] = x;
        }
        Self { size, affine }
    }
}

/// Largest cosine of the angle of two axes that are taken for orthogonal. ITK refuses 1e-4 already, and affine maps
/// are stored in single precision.
const SKEW: f64 = 1e-5;

impl Lattice {
    /// Whether its axes are orthogonal, as programs on ITK ask for.
    pub fn is_orthogonal(&self) -> bool {
        let spacing = self.spacing();
        [[0, 1], [0, 2], [1, 2]].into_iter().all(|[j, k]| {
            let product: f64 = self.affine.iter().map(|row| row[j] * row[k]).sum();
            product.abs() <= SKEW * spacing[j] * spacing[k]
        })
    }

    /// World coordinates of its eight corners.
    pub fn corners(&self) -> [[f64; 3]; 8] {
        let last = self.size.map(|n| n.saturating_sub(1) as f64);
        std::array::from_fn(|c| {
            self.to_world(std::array::from_fn(|k| {
                if c >> k & 1 == 1 { last[k] } else { 0.0 }
            }))
        })
    }

    /// This lattice, continued until points of the world lie in it, and how many samples have been added
    /// before the first one along each axis.
    #[must_use]
    pub fn reaching(&self, points: impl IntoIterator<Item = [f64; 3]>) -> (Self, [usize; 3]) {
        let mut first = [0.0f64; 3];
        let mut last = self.size.map(|n| n.saturating_sub(1) as f64);
        for point in points {
            let sample = self.to_sample(point);
            for k in 0..3 {
                // Those that lie on a face but for rounding lie inside.
                first[k] = first[k].min((sample[k] + 1e-6).floor());
                last[k] = last[k].max((sample[k] - 1e-6).ceil());
            }
        }
        let origin = self.to_world(first);
        let mut affine = self.affine;
        for (row, x) in affine.iter_mut().zip(origin) {
            row[3] = x;
        }
        let size = std::array::from_fn(|k| (last[k] - first[k]) as usize + 1);
        (Self { size, affine }, first.map(|x| -x as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Axes in another order, of which one is sheared.
    fn sheared(by: f64) -> Lattice {
        Lattice {
            size: [4, 5, 6],
            affine: [
                [0.0, -2.0, 0.0, 1.0],
                [1.0, by, 0.0, 2.0],
                [0.0, 0.0, 3.0, 3.0],
            ],
        }
    }

    #[test]
    fn sheared_axes_are_not_orthogonal() {
        assert!(sheared(0.0).is_orthogonal() && sheared(1e-6).is_orthogonal());
        assert!(!sheared(1e-3).is_orthogonal());
    }

    #[test]
    fn a_lattice_is_continued_until_it_reaches_points() {
        let lattice = sheared(0.5);
        assert_eq!(lattice.reaching(lattice.corners()), (lattice, [0; 3]));
        let point = lattice.to_world([-1.5, 2.0, 6.2]);
        let (more, before) = lattice.reaching([point]);
        assert_eq!((more.size, before), ([6, 5, 8], [2, 0, 0]));
        assert_eq!(more.to_world([2.0, 0.0, 0.0]), lattice.to_world([0.0; 3]));
    }

    #[test]
    fn samples_around_points_lie_on_the_lattice() {
        let lattice = sheared(0.5);
        let sample = lattice.to_sample(lattice.position(77));
        assert_eq!(lattice.sample(77), [1, 4, 3]);
        for (found, expected) in sample.into_iter().zip([1.0, 4.0, 3.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        let corners = [[-1.0, -2.5, 1.0], [5.0, 1.0, -1.0]].map(|sample| lattice.to_world(sample));
        let part = lattice.around(corners);
        assert_eq!(part.size, [7, 4, 3]);
        let first = lattice.to_sample(part.position(0));
        for (found, expected) in first.into_iter().zip([-1.0, -2.0, -1.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
    }
}
