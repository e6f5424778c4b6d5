//! The multilinear element with the tensor Gauss rule of two points an axis, by sum
//! factorisation: every operation works along one axis at a time.
//!
//! Corners and quadrature points carry the same numbering: bit `k` of the number says on which
//! side along axis `k` it stands.

use crate::Lane;

/// Distance of the first Gauss point from the lower face, `1/2 - 1/(2 sqrt 3)`.
pub const GAUSS: f64 = 0.211_324_865_405_187_1;

/// Corners of a cell in three dimensions; in two, half of an array of this length is idle.
pub const MAX_CORNERS: usize = 8;

/// Coordinate of Gauss point `q` along axis `k`, in the unit cell.
#[inline(always)]
pub fn gauss_coordinate(q: usize, k: usize) -> f64 {
    if q >> k & 1 == 1 { 1.0 - GAUSS } else { GAUSS }
}

/// Interpolation along axis `k` from the two sides to the two Gauss points. The matrix is
/// symmetric, so that this is also the transposed operation.
#[inline(always)]
pub fn interpolate_axis<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS], k: usize) {
    let (near, far) = (L::splat(1.0 - GAUSS), L::splat(GAUSS));
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            let (low, high) = (v[c], v[c | 1 << k]);
            v[c] = high.mul_add(far, low * near);
            v[c | 1 << k] = high.mul_add(near, low * far);
        }
    }
}

/// Values at the Gauss points from values at the corners, and its own transpose.
#[inline(always)]
pub fn interpolate<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS]) {
    for k in 0..D {
        interpolate_axis::<L, D>(v, k);
    }
}

/// Differences along axis `k` at the Gauss points from values at the corners. They do not vary
/// along `k`: only the entries with bit `k` unset are meant.
#[inline(always)]
pub fn differences<L: Lane, const D: usize>(
    corners: &[L; MAX_CORNERS],
    k: usize,
) -> [L; MAX_CORNERS] {
    let mut v = *corners;
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            v[c] = corners[c | 1 << k] - corners[c];
        }
    }
    interpolate_other_axes::<L, D>(&mut v, k);
    v
}

/// Interpolation along all axes but `k` of the entries with bit `k` unset.
#[inline(always)]
fn interpolate_other_axes<L: Lane, const D: usize>(v: &mut [L; MAX_CORNERS], k: usize) {
    let (near, far) = (L::splat(1.0 - GAUSS), L::splat(GAUSS));
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
) {
    interpolate_other_axes::<L, D>(&mut flux, k);
    for c in 0..1 << D {
        if c >> k & 1 == 0 {
            corners[c] -= flux[c];
            corners[c | 1 << k] += flux[c];
        }
    }
}

/// Shape function of corner `c` at Gauss point `q`.
#[inline(always)]
pub fn shape_value<const D: usize>(c: usize, q: usize) -> f64 {
    let mut product = 1.0;
    for k in 0..D {
        product *= if (c ^ q) >> k & 1 == 0 {
            1.0 - GAUSS
        } else {
            GAUSS
        };
    }
    product
}

/// Derivative along axis `k` of the shape function of corner `c` at Gauss point `q`, times `h`.
#[inline(always)]
pub fn shape_derivative<const D: usize>(c: usize, q: usize, k: usize) -> f64 {
    let mut product = if c >> k & 1 == 1 { 1.0 } else { -1.0 };
    for j in 0..D {
        if j != k {
            product *= if (c ^ q) >> j & 1 == 0 {
                1.0 - GAUSS
            } else {
                GAUSS
            };
        }
    }
    product
}
