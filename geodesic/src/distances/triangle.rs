//! Violations of the triangle inequality.

use serde::Serialize;

/// Relative excess up to which a violation is attributed to rounding.
const ROUNDING: f64 = 1e-12;

/// Statistics of the triangles among objects, and of those of which one side is longer than the
/// other two together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TriangleReport {
    /// Number of triangles whose three sides are known.
    pub count: usize,
    /// Number of triangles that violate the inequality.
    pub violations: usize,
    /// Largest excess, as a fraction of the sum of the other two sides; zero without violations.
    pub worst: f64,
    /// The ends of the longest side of the worst triangle, and the vertex between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_triangle: Option<[usize; 3]>,
}

/// Checks `d(i, j) <= d(i, k) + d(k, j)` in all triangles of `n` objects whose three sides are
/// given by `side`, which is called for `i < j`. At most one of the three inequalities of a
/// triangle is violated, unless all sides are zero.
pub fn triangles(n: usize, side: impl Fn(usize, usize) -> Option<f64>) -> TriangleReport {
    let mut report = TriangleReport {
        count: 0,
        violations: 0,
        worst: 0.0,
        worst_triangle: None,
    };
    for i in 0..n {
        for j in i + 1..n {
            for k in j + 1..n {
                let (Some(ij), Some(jk), Some(ik)) = (side(i, j), side(j, k), side(i, k)) else {
                    continue;
                };
                report.count += 1;
                for (long, by, triangle) in [
                    (ij, ik + jk, [i, j, k]),
                    (jk, ij + ik, [j, k, i]),
                    (ik, ij + jk, [i, k, j]),
                ] {
                    if long > by * (1.0 + ROUNDING) {
                        report.violations += 1;
                        // Division by zero is avoided if the way through the third object has
                        // length zero.
                        let excess = (long - by) / by.max(f64::MIN_POSITIVE);
                        let excess = excess.min(f64::MAX);
                        if excess > report.worst {
                            (report.worst, report.worst_triangle) = (excess, Some(triangle));
                        }
                    }
                }
            }
        }
    }
    report
}
