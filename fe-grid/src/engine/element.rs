//! The multilinear element with a tensor rule of two points an axis, by sum factorisation: every
//! operation works along one axis at a time.
//!
//! The points stand at a distance `offset` from the faces, in units of the cell: [`GAUSS`] for
//! the Gauss rule, [`CORNERS`] for the rule whose points are the corners. Corners and quadrature
//! points carry the same numbering: bit `k` of the number says on which side along axis `k` it
//! stands.

use crate::Lane;

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

/// Interpolation along axis `k` from the two sides to the two points. The matrix is
/// symmetric, so that this is also the transposed operation.
#[inline(always)]
pub fn interpolate_axis<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS], k: usize, offset: f64) {
    let (near, far) = (L::splat(1.0 - offset), L::splat(offset));
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            let (low, high) = (v[c], v[c | 1 << k]);
            v[c] = high.mul_add(far, low * near);
            v[c | 1 << k] = high.mul_add(near, low * far);
        }
    }
}

/// Values at the quadrature points from values at the corners, and its own transpose.
#[inline(always)]
pub fn interpolate<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS], offset: f64) {
    for k in 0..D {
        interpolate_axis::<L, D>(v, k, offset);
    }
}

/// Differences along axis `k` at the quadrature points from values at the corners. They do not vary
/// along `k`: only the entries with bit `k` unset are meant.
#[inline(always)]
pub fn differences<L: Lane, const D: usize>(
    corners: &[L; MAX_CORNERS],
    k: usize,
    offset: f64,
) -> [L; MAX_CORNERS] {
    let mut v = *corners;
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            v[c] = corners[c | 1 << k] - corners[c];
        }
    }
    interpolate_other_axes::<L, D>(&mut v, k, offset);
    v
}

/// Interpolation along all axes but `k` of the entries with bit `k` unset.
#[inline(always)]
fn interpolate_other_axes<L: Lane, const D: usize>(
    v: &mut [L; MAX_CORNERS],
    k: usize,
    offset: f64,
) {
    let (near, far) = (L::splat(1.0 - offset), L::splat(offset));
    for j in 0..D {
        if j == k {
            continue;
        }
        for c in 0..1 << D {
            if c >> k & 1 == 0 && c >> j & 1 == 0 {
                let (low, high) = (v[c], v[c | 1 << j]);
                v[c] = high.mul_add(far, low * near);
                v[c | 1 << j] = high.mul_add(near, low * far);
            }
        }
    }
}

/// Transpose of [`differences`]: adds to the corners what belongs to the fluxes along axis `k`,
/// which stand in the entries with bit `k` unset.
#[inline(always)]
pub fn add_differences_transposed<L: Lane, const D: usize>(
    mut flux: [L; MAX_CORNERS],
    k: usize,
    corners: &mut [L; MAX_CORNERS],
    offset: f64,
) {
    interpolate_other_axes::<L, D>(&mut flux, k, offset);
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            corners[c] -= flux[c];
            corners[c | 1 << k] += flux[c];
        }
    }
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
