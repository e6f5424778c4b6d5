//! Sizes, moments and overlap of shapes.

use fe_grid::{Field, Grid, compiled_once, mutant};
use nalgebra::{SMatrix, SVector};

use crate::contour::Contour;
use crate::error::LevelsetError;
use crate::extract::check_finite;
use crate::vector;
use crate::vector::{area_normal, dot};

/// Volume (area in 2D), centroid and second central moments of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<const D: usize> {
    /// `V = int_O dx`.
    pub volume: f64,
    /// `c = (1/V) int_O x dx`.
    pub centroid: SVector<f64, D>,
    /// `(1/V) int_O (x - c)(x - c)^T dx`, symmetric.
    pub covariance: SMatrix<f64, D, D>,
}

impl<const D: usize> Moments<D> {
    /// Computes the exact moments of the polygon or polyhedron inside a closed contour: the sum
    /// over the signed simplices that join each segment or triangle to one point.
    ///
    /// # Errors
    /// [`LevelsetError::OpenContour`]; [`LevelsetError::EmptyContour`] if the enclosed volume is
    /// zero, and [`LevelsetError::InsideOut`] if it is negative; [`LevelsetError::NonFinitePoint`].
    pub fn of_contour(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        moments_of_contour(contour)
    }

    fn of_contour_in(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        if !contour.is_closed() {
            return Err(LevelsetError::OpenContour);
        }
        // Any apex gives the same sums; one on the shape reduces rounding errors.
        let Some(&apex) = contour.points().first() else {
            return Err(LevelsetError::EmptyContour);
        };
        let (mut volume, mut first, mut second) = (
            0.0,
            SVector::<f64, D>::zeros(),
            SMatrix::<f64, D, D>::zeros(),
        );
        let dim = D as f64;
        let factor = mutant!((dim + 1.0) * (dim + 2.0), MomentsFactor => dim + 1.0);
        for corners in contour.all_corners() {
            let rays = corners.map(|c| vector::sub(&c, &apex));
            let piece = dot(&rays[0], &area_normal(&corners)) / dim;
            let mut sum = SVector::<f64, D>::zeros();
            let mut squares = SMatrix::<f64, D, D>::zeros();
            for ray in rays.map(SVector::from) {
                sum += ray;
                squares += ray * ray.transpose();
            }
            volume += piece;
            first += sum * (piece / mutant!(dim + 1.0, CentroidFactor => dim));
            second += (squares + sum * sum.transpose()) * (piece / factor);
        }
        let (origin, error) = (SVector::from(apex), || failed(contour, volume));
        Self::from_sums(volume, first, second, origin).ok_or_else(error)
    }

    /// Computes the moments of a density: `int w dx`, `int w x dx`, ... by the trapezoidal rule
    /// over the nodes. For the indicator of a mask this counts nodes.
    ///
    /// # Errors
    /// [`LevelsetError::NonFinite`]; [`LevelsetError::EmptyObject`] if the sum of the density is
    /// not positive.
    pub fn of_density(density: &Field<f64, D, 1>) -> Result<Self, LevelsetError> {
        moments_of_density(density)
    }

    fn of_density_in(density: &Field<f64, D, 1>) -> Result<Self, LevelsetError> {
        check_finite(density, 0.0)?;
        let grid = density.grid();
        let (mut volume, mut first, mut second) = (
            0.0,
            SVector::<f64, D>::zeros(),
            SMatrix::<f64, D, D>::zeros(),
        );
        let middle = SVector::from(grid.extent()) / 2.0;
        for (index, &weight) in density.as_slice().iter().enumerate() {
            if weight == 0.0 {
                continue;
            }
            let x = SVector::from(grid.position(grid.node(index))) - middle;
            volume += weight;
            first += x * weight;
            second += x * x.transpose() * weight;
        }
        let moments = Self::from_sums(volume, first, second, middle);
        let scaled = moments.map(|m| Self {
            volume: m.volume * grid.cell_volume(),
            ..m
        });
        scaled.ok_or(LevelsetError::EmptyObject { level: 0.0 })
    }

    /// Computes moments from plain sums about an origin; `None` without a positive volume.
    fn from_sums(
        volume: f64,
        first: SVector<f64, D>,
        second: SMatrix<f64, D, D>,
        origin: SVector<f64, D>,
    ) -> Option<Self> {
        if !(volume > 0.0 && volume.is_finite()) {
            return None;
        }
        let mean = first / volume;
        Some(Self {
            volume,
            centroid: origin + mean,
            covariance: second / volume - mean * mean.transpose(),
        })
    }
}

/// Why a contour has no moments.
fn failed<const D: usize>(contour: &Contour<D>, volume: f64) -> LevelsetError {
    let wrong = |p: &[f64; D]| !p.iter().all(|x| x.is_finite());
    match contour.points().iter().position(wrong) {
        Some(point) => LevelsetError::NonFinitePoint {
            point,
            position: contour.points()[point].to_vec(),
        },
        None if volume < 0.0 => LevelsetError::InsideOut,
        None => LevelsetError::EmptyContour,
    }
}

compiled_once! {
    fn moments_of_contour<'a, D>(
        contour: &'a Contour<D>,
    ) -> Result<Moments<D>, LevelsetError> = Moments::of_contour_in;
}

compiled_once! {
    fn moments_of_density<'a, D>(
        density: &'a Field<f64, D, 1>,
    ) -> Result<Moments<D>, LevelsetError> = Moments::of_density_in;
}

/// Computes the area or volume inside a closed contour, as [`Moments::of_contour`] does; zero for a shape that has
/// vanished: of an empty contour, and of one that is flat or, by rounding, inside out.
///
/// # Errors
/// [`LevelsetError::OpenContour`] and [`LevelsetError::NonFinitePoint`].
pub fn enclosed_volume<const D: usize>(contour: &Contour<D>) -> Result<f64, LevelsetError> {
    match Moments::of_contour(contour) {
        Ok(moments) => Ok(moments.volume),
        Err(LevelsetError::EmptyContour | LevelsetError::InsideOut) => Ok(0.0),
        Err(error) => Err(error),
    }
}

/// Computes the share of the area or volume inside a boundary that lies outside of the box of a grid; zero
/// for a boundary within the box, one for a shape beside it.
///
/// What lies inside the box is measured by moving every point of the boundary to the nearest one of the box,
/// which leaves no volume to the rest. The error is that of the segments or triangles that cross a face.
///
/// # Errors
/// Those of [`Moments::of_contour`], for boundaries that leave the box.
pub fn share_outside<const D: usize>(
    contour: &Contour<D>,
    grid: &Grid<D>,
) -> Result<f64, LevelsetError> {
    let ends = grid.extent();
    let nearest = |p: [f64; D]| -> [f64; D] { std::array::from_fn(|k| p[k].clamp(0.0, ends[k])) };
    if contour.points().iter().all(|&p| nearest(p) == p) {
        return Ok(0.0);
    }
    let all = Moments::of_contour(contour)?.volume;
    Ok(1.0 - enclosed_volume(&contour.map(nearest))? / all)
}

/// Whether a field is a mask rather than a signed distance: it is negative nowhere, or has two values only. Distances of a
/// shape that fills the box, zero on its faces, are taken for a mask, too; they tell nothing of an outside.
pub fn is_mask<const D: usize>(field: &Field<f64, D, 1>) -> bool {
    let values = field.as_slice();
    let first = values.first();
    let mut others = values.iter().filter(|v| Some(*v) != first);
    let second = others.next();
    values.iter().all(|v| *v >= 0.0) || others.all(|v| Some(v) == second)
}

/// Area or volume of the mask `{field > level}` by counting: `h^D` for every node inside.
pub fn mask_volume<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> f64 {
    let n_inside = field.as_slice().iter().filter(|&&v| v > level).count();
    n_inside as f64 * field.grid().cell_volume()
}

/// Computes the Dice overlap of two objects, `2 |A and B| / (|A| + |B|)`, from the nodes above the
/// level of each: 1 for equal objects, 0 for disjoint ones.
///
/// # Errors
/// [`LevelsetError::GridMismatch`]; [`LevelsetError::EmptyObject`] if both are empty;
/// [`LevelsetError::Parameter`] for levels that are not numbers.
pub fn dice<const D: usize>(
    a: &Field<f64, D, 1>,
    level_a: f64,
    b: &Field<f64, D, 1>,
    level_b: f64,
) -> Result<f64, LevelsetError> {
    dice_within(a, level_a, b, level_b, None)
}

/// Computes the Dice overlap with a weight per node, given on the same grid.
///
/// # Errors
/// As [`dice`], and [`LevelsetError::NonFinite`] where a weight counts that is not finite.
pub fn dice_within<const D: usize>(
    a: &Field<f64, D, 1>,
    level_a: f64,
    b: &Field<f64, D, 1>,
    level_b: f64,
    weight: Option<&Field<f64, D, 1>>,
) -> Result<f64, LevelsetError> {
    let others = [Some(b), weight];
    for other in others.into_iter().flatten() {
        if a.grid() != other.grid() {
            return Err(LevelsetError::GridMismatch {
                left: a.grid().nodes_per_axis().to_vec(),
                right: other.grid().nodes_per_axis().to_vec(),
            });
        }
    }
    for value in [level_a, level_b] {
        if value.is_nan() {
            let name = "level";
            return Err(LevelsetError::Parameter { name, value });
        }
    }
    let (mut both, mut sum) = (0.0, 0.0);
    for (node, (&u, &v)) in a.as_slice().iter().zip(b.as_slice()).enumerate() {
        let (in_a, in_b) = (u > level_a, v > level_b);
        if !(in_a || in_b) {
            continue;
        }
        let w = weight.map_or(1.0, |weight| weight.as_slice()[node]);
        both += if in_a && in_b { w } else { 0.0 };
        sum += w * f64::from(u8::from(in_a) + u8::from(in_b));
    }
    if let (false, Some(weight)) = (f64::is_finite(sum), weight) {
        check_finite(weight, 0.0)?;
    }
    if sum <= 0.0 {
        return Err(LevelsetError::EmptyObject { level: level_a });
    }
    Ok(mutant!(2.0 * both / sum, DiceFactor => both / (sum - both)))
}
