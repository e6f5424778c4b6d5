//! Short vectors as plain arrays.

/// `a - b`.
#[inline]
pub(crate) fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `a + s b`.
#[inline]
pub(crate) fn add_scaled<const D: usize>(a: &[f64; D], s: f64, b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] + s * b[k])
}

/// `a . b`.
#[inline]
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut s = a[0] * b[0];
    for k in 1..D {
        s += a[k] * b[k];
    }
    s
}

/// `|a|`.
#[inline]
pub(crate) fn norm<const D: usize>(a: &[f64; D]) -> f64 {
    dot(a, a).sqrt()
}

/// Returns the angle between two vectors, in `[0, pi]`, accurate for small and for straight angles.
pub(crate) fn angle<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let (la, lb) = (norm(a), norm(b));
    let minus: [f64; D] = std::array::from_fn(|k| a[k] * lb - b[k] * la);
    let plus: [f64; D] = std::array::from_fn(|k| a[k] * lb + b[k] * la);
    2.0 * norm(&minus).atan2(norm(&plus))
}

/// Returns the normal of a segment (`D = 2`) or triangle (`D = 3`) whose norm is the segment's
/// length or the triangle's area: to the right of a segment, by the right-hand rule for a triangle.
pub(crate) fn area_normal<const D: usize>(corners: &[[f64; D]; D]) -> [f64; D] {
    let mut n = [0.0; D];
    let a = sub(&corners[1], &corners[0]);
    if D == 2 {
        n[0] = a[1];
        n[1] = -a[0];
    } else {
        let b = sub(&corners[2], &corners[0]);
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            n[k] = 0.5 * (a[i] * b[j] - a[j] * b[i]);
        }
    }
    n
}
