//! Small `D` x `D` matrices of lanes, and the algebra of the laws.
//!
//! They are plain arrays, and all functions are inlined: every operation must use the instruction
//! set that the kernel is compiled for.

use crate::lane::Lane;

/// A `D` x `D` matrix, row by row: `a[i][k]` is the derivative of component `i` along axis `k`.
pub type Tensor<L, const D: usize> = [[L; D]; D];

/// Zero matrix.
#[inline(always)]
pub fn zero<L: Lane, const D: usize>() -> Tensor<L, D> {
    [[L::zero(); D]; D]
}

/// `1 + h`.
#[inline(always)]
pub fn add_identity<L: Lane, const D: usize>(h: &Tensor<L, D>) -> Tensor<L, D> {
    let mut a = *h;
    for i in 0..D {
        a[i][i] += L::one();
    }
    a
}

/// `a + b`.
#[inline(always)]
pub fn add<L: Lane, const D: usize>(a: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
    let mut c = *a;
    for i in 0..D {
        for k in 0..D {
            c[i][k] += b[i][k];
        }
    }
    c
}

/// `s a`.
#[inline(always)]
pub fn scale<L: Lane, const D: usize>(a: &Tensor<L, D>, s: L) -> Tensor<L, D> {
    let mut c = *a;
    for row in &mut c {
        for x in row {
            *x *= s;
        }
    }
    c
}

/// `a + s b`, fused.
#[inline(always)]
pub fn add_scaled<L: Lane, const D: usize>(
    a: &Tensor<L, D>,
    s: L,
    b: &Tensor<L, D>,
) -> Tensor<L, D> {
    let mut c = *a;
    for i in 0..D {
        for k in 0..D {
            c[i][k] = b[i][k].mul_add(s, a[i][k]);
        }
    }
    c
}

/// `a : b`, the sum of products of entries.
#[inline(always)]
pub fn contract<L: Lane, const D: usize>(a: &Tensor<L, D>, b: &Tensor<L, D>) -> L {
    let mut s = a[0][0] * b[0][0];
    for i in 0..D {
        for k in 0..D {
            if i + k > 0 {
                s = a[i][k].mul_add(b[i][k], s);
            }
        }
    }
    s
}

/// Sum of the diagonal.
#[inline(always)]
pub fn trace<L: Lane, const D: usize>(a: &Tensor<L, D>) -> L {
    let mut s = a[0][0];
    for i in 1..D {
        s += a[i][i];
    }
    s
}

/// Transpose.
#[inline(always)]
pub fn transpose<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    let mut c = *a;
    for i in 0..D {
        for k in 0..D {
            c[i][k] = a[k][i];
        }
    }
    c
}

/// Matrix product `a b`.
#[inline(always)]
pub fn product<L: Lane, const D: usize>(a: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
    let mut c = zero::<L, D>();
    for i in 0..D {
        for k in 0..D {
            let mut s = a[i][0] * b[0][k];
            for j in 1..D {
                s = a[i][j].mul_add(b[j][k], s);
            }
            c[i][k] = s;
        }
    }
    c
}

/// `a^T b`.
#[inline(always)]
pub fn transposed_product<L: Lane, const D: usize>(
    a: &Tensor<L, D>,
    b: &Tensor<L, D>,
) -> Tensor<L, D> {
    product(&transpose(a), b)
}

/// `a b^T`.
#[inline(always)]
pub fn product_transposed<L: Lane, const D: usize>(
    a: &Tensor<L, D>,
    b: &Tensor<L, D>,
) -> Tensor<L, D> {
    product(a, &transpose(b))
}

/// `a b - c d`.
#[inline(always)]
fn minor<L: Lane>(a: L, b: L, c: L, d: L) -> L {
    a.mul_add(b, -(c * d))
}

/// Cofactor matrix, `det(a) a^{-T}` where `a` is invertible.
///
/// # Panics
/// For `D` other than 2 and 3, at compile time.
#[inline(always)]
pub fn cofactor<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    const { assert!(D == 2 || D == 3) };
    let mut c = zero::<L, D>();
    if D == 2 {
        c[0][0] = a[1][1];
        c[0][1] = -a[1][0];
        c[1][0] = -a[0][1];
        c[1][1] = a[0][0];
    } else {
        for i in 0..3 {
            let (p, q) = ((i + 1) % 3, (i + 2) % 3);
            for k in 0..3 {
                let (r, s) = ((k + 1) % 3, (k + 2) % 3);
                c[i][k] = minor(a[p][r], a[q][s], a[p][s], a[q][r]);
            }
        }
    }
    c
}

/// Determinant, given the cofactor matrix.
#[inline(always)]
pub fn determinant_with<L: Lane, const D: usize>(a: &Tensor<L, D>, cofactor: &Tensor<L, D>) -> L {
    let mut s = a[0][0] * cofactor[0][0];
    for k in 1..D {
        s = a[0][k].mul_add(cofactor[0][k], s);
    }
    s
}

/// Determinant.
#[inline(always)]
pub fn determinant<L: Lane, const D: usize>(a: &Tensor<L, D>) -> L {
    determinant_with(a, &cofactor(a))
}

/// Inverse transpose `a^{-T}`.
#[inline(always)]
pub fn inverse_transpose<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    let c = cofactor(a);
    scale(&c, L::one() / determinant_with(a, &c))
}

/// Derivative of the cofactor matrix at `a` in direction `b`, linear in both in 3D and constant
/// in `a` in 2D.
#[inline(always)]
pub fn cofactor_derivative<L: Lane, const D: usize>(
    a: &Tensor<L, D>,
    b: &Tensor<L, D>,
) -> Tensor<L, D> {
    if D == 2 {
        return cofactor(b);
    }
    let mut c = zero::<L, D>();
    for i in 0..D {
        let (p, q) = ((i + 1) % 3, (i + 2) % 3);
        for k in 0..D {
            let (r, s) = ((k + 1) % 3, (k + 2) % 3);
            c[i][k] = minor(a[p][r], b[q][s], a[p][s], b[q][r])
                + minor(b[p][r], a[q][s], b[p][s], a[q][r]);
        }
    }
    c
}

/// `det(1 + h) - 1`, without cancellation for small `h`.
#[inline(always)]
pub fn determinant_excess<L: Lane, const D: usize>(h: &Tensor<L, D>) -> L {
    let c = cofactor(h);
    if D == 2 {
        return trace(h) + determinant_with(h, &c);
    }
    // det(1 + h) = 1 + tr h + tr cof h + det h
    (trace(h) + trace(&c)) + determinant_with(h, &c)
}

/// `|1 + h|^2 - D = 2 tr h + |h|^2`, without cancellation for small `h`.
#[inline(always)]
pub fn squared_norm_excess<L: Lane, const D: usize>(h: &Tensor<L, D>) -> L {
    trace(h).mul_add(L::splat(2.0), contract(h, h))
}

/// `cof(1 + h) - 1` without cancellation for small `h`, given `cof h`.
///
/// In 2D the cofactor matrix is linear; in 3D `cof(1 + h) = 1 + tr(h) 1 - h^T + cof h`.
#[inline(always)]
pub fn cofactor_excess<L: Lane, const D: usize>(
    h: &Tensor<L, D>,
    cofactor: &Tensor<L, D>,
) -> Tensor<L, D> {
    let mut c = *cofactor;
    if D == 3 {
        let trace = trace(h);
        for i in 0..D {
            for k in 0..D {
                c[i][k] -= h[k][i];
            }
            c[i][i] += trace;
        }
    }
    c
}

/// `a - b`.
#[inline(always)]
pub fn sub<L: Lane, const D: usize>(a: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
    let mut c = *a;
    for i in 0..D {
        for k in 0..D {
            c[i][k] -= b[i][k];
        }
    }
    c
}

/// `s 1`, a multiple of the identity.
#[inline(always)]
pub fn diagonal<L: Lane, const D: usize>(s: L) -> Tensor<L, D> {
    let mut c = zero::<L, D>();
    for i in 0..D {
        c[i][i] = s;
    }
    c
}

/// Symmetric part `(a + a^T) / 2`.
#[inline(always)]
pub fn symmetric_part<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    let mut c = *a;
    for i in 0..D {
        for k in 0..D {
            if i != k {
                c[i][k] = (a[i][k] + a[k][i]).scale(0.5);
            }
        }
    }
    c
}

/// `tr(a) 1 - a^T`, the derivative of the cofactor matrix at the identity in direction `a`.
#[inline(always)]
pub fn cofactor_derivative_at_identity<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    sub(&diagonal(trace(a)), &transpose(a))
}
