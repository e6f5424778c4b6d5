//! The place of images in the world.
//!
//! World coordinates are millimetres, with `x` to the right, `y` to the front and `z` upwards as
//! seen by the patient (RAS), as NIfTI defines them.

use fe_grid::tensor::determinant;

use super::Image;

/// Smallest determinant of the unit vectors along the axes: axes at right angles have 1, flat ones 0.
const LEAST_DETERMINANT: f64 = 0.1;
/// Lengths and positions beyond this, in millimetres, are damage.
const LONGEST: f64 = 1e9;
/// The smallest distance of samples, in millimetres.
const SHORTEST: f64 = 1e-6;
/// Largest sine of the angle between a picture and the plane of the first two world axes.
const MOST_TILT: f64 = 1e-3;

/// Why an affine map of `n_axes` axes cannot be used.
pub(crate) fn affine_fault(affine: &[[f64; 4]; 3], n_axes: usize) -> Option<&'static str> {
    let entries = || affine.iter().flatten();
    if !entries().all(|x| x.is_finite()) {
        return Some("its orientation is not a matrix of finite lengths");
    }
    if !entries().all(|x| x.abs() <= LONGEST) {
        return Some("its affine map has lengths of more than 1e9 mm");
    }
    // A picture does not need its third axis.
    let axes: Vec<[f64; 3]> = (0..n_axes).map(|j| column(affine, j)).collect();
    let lengths: Vec<f64> = axes.iter().map(norm).collect();
    if lengths.iter().any(|&length| length < SHORTEST) {
        return Some("its orientation has an axis of no length");
    }
    let unit = |j: usize| axes[j].map(|x| x / lengths[j]);
    let size = if n_axes == 2 {
        norm(&cross(unit(0), unit(1)))
    } else {
        determinant(&[unit(0), unit(1), unit(2)])
    };
    (size.abs() < LEAST_DETERMINANT)
        .then_some("its orientation is singular: its axes lie nearly in one plane or line")
}

impl<const D: usize> Image<D> {
    /// The image in the world, if its file states its place: with the directions and the spacings of
    /// the affine map, sheared ones included. Pictures have one if they lie in a plane of constant
    /// `z`.
    #[must_use]
    pub fn in_world(&self) -> Option<Self> {
        let affine = self.affine.as_ref()?;
        if D == 2 && (0..2).any(|j| affine[2][j].abs() > MOST_TILT * norm(&column(affine, j))) {
            return None;
        }
        let within = |j: usize| column(affine, j)[..D].iter().map(|x| x * x).sum::<f64>();
        let spacing: [f64; D] = std::array::from_fn(|j| within(j).sqrt());
        let direction = std::array::from_fn(|i| std::array::from_fn(|j| affine[i][j] / spacing[j]));
        Some(Self {
            spacing,
            direction: Some(direction),
            origin: std::array::from_fn(|i| affine[i][3]),
            plain_array: false,
            ..self.clone()
        })
    }

    /// The volume of a sample, in the length units of the image.
    pub fn sample_volume(&self) -> f64 {
        let skew = self.direction.map_or(1.0, |rows| determinant(&rows).abs());
        skew * self.spacing.iter().product::<f64>()
    }
}

fn column(affine: &[[f64; 4]; 3], j: usize) -> [f64; 3] {
    [affine[0][j], affine[1][j], affine[2][j]]
}

fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;

    #[test]
    fn affine_maps_are_judged_by_their_axes() {
        let good = [
            [2.0, 0.5, 0.0, 9.0],
            [0.0, 2.0, 0.0, 1.0],
            [0.0, 0.0, -3.0, 1.0],
        ];
        assert_eq!(affine_fault(&good, 3), None);
        let changed = |change: fn(&mut [[f64; 4]; 3]), n_axes| {
            let mut affine = good;
            change(&mut affine);
            affine_fault(&affine, n_axes).map(str::to_owned)
        };
        let fault = |change| changed(change, 3).unwrap();
        assert!(fault(|a| a[2] = [0.0; 4]).contains("no length"));
        assert!(fault(|a| a[1][3] = 1e12).contains("1e9 mm"));
        assert!(fault(|a| a[0][0] = f64::NAN).contains("finite"));
        assert!(fault(|a| a[0][1] = 50.0).contains("singular"));
        // The third axis of a picture is not used.
        assert_eq!(changed(|a| a[2] = [0.0; 4], 2), None);
        assert!(changed(|a| a[0][1] = 50.0, 2).is_some());
    }

    #[test]
    fn a_sheared_image_has_the_volume_of_its_determinant() {
        let mut image = block([9, 9, 9], [1.0; 3], [2; 3], [6; 3]);
        assert!(image.in_world().is_none());
        image.affine = Some([
            [0.0, 0.0, -2.0, 5.0],
            [1.0, 0.5, 0.0, 6.0],
            [0.0, 3.0, 0.0, 7.0],
        ]);
        let world = image.in_world().unwrap();
        assert_eq!(world.origin, [5.0, 6.0, 7.0]);
        assert!((world.sample_volume() - 6.0).abs() < 1e-14);
        assert_eq!(image.sample_volume(), 1.0);
    }

    #[test]
    fn tilted_pictures_have_no_place_in_the_plane() {
        let mut picture = block([9, 9], [1.0; 2], [2; 2], [6; 2]);
        picture.affine = Some([[0.0, -2.0, 0.0, 5.0], [2.0, 0.0, 0.0, 6.0], [0.0; 4]]);
        let world = picture.in_world().unwrap();
        assert_eq!(world.direction, Some([[0.0, -1.0], [1.0, 0.0]]));
        picture.affine = Some([[2.0, 0.0, 0.0, 5.0], [0.0; 4], [0.0, 2.0, 0.0, 7.0]]);
        assert!(picture.in_world().is_none());
    }
}
