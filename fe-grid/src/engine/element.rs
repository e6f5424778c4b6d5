//! The multilinear element with a tensor rule of two points an axis, by sum factorisation: every
//! operation works along one axis at a time.
//!
//! The points stand at a distance `offset` from the faces, in units of the cell: [`GAUSS`] for
//! the Gauss rule, [`CORNERS`] for the rule whose points are the corners. Corners and quadrature
//! points carry the same numbering: bit `k` of the number says on which side along axis `k` it
//! stands.

use crate::lane::Lane;

/// Distance of the first Gauss point from the lower face, `1/2 - 1/(2 sqrt 3)`.
pub const GAUSS: f64 = 0.211_324_865_405_187_1;

/// The points of the trapezoid rule are the corners themselves.
pub const CORNERS: f64 = 0.0;

/// Corners of a cell in three dimensions; in two, half of an array of this length is idle.
pub const MAX_CORNERS: usize = 8;

/// Coordinate of quadrature point `q` along axis `k`, in the unit cell.
#[inline(always)]
pub fn point_coordinate(offset: f64, q: usize, k: usize) -> f64 {
    if q >> k & 1 == 1 {
        1.0 - offset
    } else {
        offset
    }
}

/// Corners of a face: derivatives along an axis do not vary along it, so that one number for each
/// corner of the face across the axis holds them.
pub const MAX_FACE_CORNERS: usize = 4;

/// The corner of the face across axis `k` that a corner of the cell lies on or above: the bits of
/// `c` without bit `k`.
#[inline(always)]
pub const fn face_corner(c: usize, k: usize) -> usize {
    let low = (1 << k) - 1;
    (c & low) | (c >> 1 & !low)
}

/// The corner of the cell on the lower face across axis `k`, from its number on the face.
#[inline(always)]
const fn cell_corner(f: usize, k: usize) -> usize {
    let low = (1 << k) - 1;
    (f & low) | (f & !low) << 1
}

/// Interpolation from the corners to the points along `AXES` axes, less a factor `near` an axis.
///
/// Along one axis `near low + far high` and `far low + near high` are `near` times
/// `low + r high` and `high + r low`, `r = far / near`: one fused operation each. The factors of
/// all axes are left to the caller, who has something to multiply with anyway. The matrix is
/// symmetric, so that this is also the transposed operation.
#[inline(always)]
fn interpolate_unscaled<L: Lane, const N: usize>(v: &mut [L; N], axes: usize, offset: f64) {
    let ratio = L::splat(offset / (1.0 - offset));
    for k in 0..axes {
        for c in 0..1 << axes {
            if c >> k & 1 == 0 {
                let (low, high) = (v[c], v[c | 1 << k]);
                v[c] = high.mul_add(ratio, low);
                v[c | 1 << k] = low.mul_add(ratio, high);
            }
        }
    }
}

/// What [`interpolate_unscaled`] leaves out along `axes` axes.
#[inline(always)]
fn interpolation_scale(axes: usize, offset: f64) -> f64 {
    (0..axes).fold(1.0, |scale, _| scale * (1.0 - offset))
}

/// Values at the quadrature points, times `factor`, from values at the corners; and its own
/// transpose.
#[inline(always)]
pub fn interpolate<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS], factor: f64, offset: f64) {
    interpolate_unscaled(v, D, offset);
    let scale = L::splat(factor * interpolation_scale(D, offset));
    for c in 0..1 << D {
        v[c] *= scale;
    }
}

/// Differences along axis `k` at the quadrature points, times `factor`, from values at the
/// corners, one for each point of the face across the axis. Other entries of `differences` are not
/// written.
#[inline(always)]
pub fn differences_into<L: Lane, const D: usize>(
    corners: &[L; MAX_CORNERS],
    k: usize,
    factor: f64,
    offset: f64,
    differences: &mut [L; MAX_FACE_CORNERS],
) {
    let scale = L::splat(factor * interpolation_scale(D - 1, offset));
    let mut v = [L::zero(); MAX_FACE_CORNERS];
    for f in 0..1 << (D - 1) {
        let c = cell_corner(f, k);
        v[f] = (corners[c | 1 << k] - corners[c]) * scale;
    }
    interpolate_unscaled(&mut v, D - 1, offset);
    differences[..1 << (D - 1)].copy_from_slice(&v[..1 << (D - 1)]);
}

/// Transpose of [`differences_into`] for all axes at once: the corner values that belong to the fluxes
/// along each axis, times `factor`.
#[inline(always)]
pub fn differences_transposed<L: Lane, const D: usize>(
    fluxes: &[[L; MAX_FACE_CORNERS]; D],
    factor: f64,
    offset: f64,
) -> [L; MAX_CORNERS] {
    let mut corners = [L::zero(); MAX_CORNERS];
    for k in 0..D {
        let mut flux = fluxes[k];
        interpolate_unscaled(&mut flux, D - 1, offset);
        for c in 0..1 << D {
            let f = flux[face_corner(c, k)];
            corners[c] = match (k, c >> k & 1) {
                (0, 0) => -f,
                (0, _) => f,
                (_, 0) => corners[c] - f,
                _ => corners[c] + f,
            };
        }
    }
    let scale = L::splat(factor * interpolation_scale(D - 1, offset));
    for c in 0..1 << D {
        corners[c] *= scale;
    }
    corners
}

/// Shape function of corner `c` at quadrature point `q`.
#[inline(always)]
pub fn shape_value<const D: usize>(c: usize, q: usize, offset: f64) -> f64 {
    let mut product = 1.0;
    for k in 0..D {
        product *= if (c ^ q) >> k & 1 == 0 {
            1.0 - offset
        } else {
            offset
        };
    }
    product
}

/// Derivative along axis `k` of the shape function of corner `c` at quadrature point `q`, times `h`.
#[inline(always)]
pub fn shape_derivative<const D: usize>(c: usize, q: usize, k: usize, offset: f64) -> f64 {
    let mut product = if c >> k & 1 == 1 { 1.0 } else { -1.0 };
    for j in 0..D {
        if j != k {
            product *= if (c ^ q) >> j & 1 == 0 {
                1.0 - offset
            } else {
                offset
            };
        }
    }
    product
}

/// Value and derivatives of a multilinear function with these corner values at a point of the
/// unit cell. One axis after the other halves the corners; derivatives taken so far go along.
#[inline(always)]
pub fn multilinear<L: Lane, const D: usize>(
    corners: [L; MAX_CORNERS],
    local: &[L; D],
) -> (L, [L; D]) {
    let mut value = corners;
    let mut slope = [[L::zero(); MAX_CORNERS]; D];
    for k in 0..D {
        for c in 0..(1usize << D) >> (k + 1) {
            for s in &mut slope[..k] {
                s[c] = (s[2 * c + 1] - s[2 * c]).mul_add(local[k], s[2 * c]);
            }
            slope[k][c] = value[2 * c + 1] - value[2 * c];
            value[c] = slope[k][c].mul_add(local[k], value[2 * c]);
        }
    }
    (value[0], slope.map(|s| s[0]))
}
