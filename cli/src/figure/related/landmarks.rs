//! Landmarks up to similarities: Kendall's shape space and the generalised Procrustes mean.
//!
//! Sources: D. G. Kendall: Shape manifolds, Procrustean metrics, and complex projective spaces. Bull.
//! London Math. Soc. 16 (1984); I. L. Dryden, K. V. Mardia: Statistical Shape Analysis (1998), sections
//! 4.2 and 8.3. Landmarks of the plane are complex numbers; a *preshape* has the centroid zero and the
//! norm 1, and a shape is the orbit of a preshape under rotations.

use super::curve::{Curve, Point};
use super::space::{Orbits, added, hermitian, scaled, size, turned};

/// Landmarks of an outline, at equal distances along it. Which of them correspond is not known: the
/// correspondence is the best of the cyclic shifts.
pub(super) const LANDMARKS: usize = 128;
/// Iterations of the mean. The correspondences settle after a few.
const ITERATIONS: usize = 100;

/// The preshape of some points; `None` where all are one point.
pub(super) fn preshape(points: &[Point]) -> Option<Vec<Point>> {
    let centre = centroid(points);
    let centred: Vec<Point> = points
        .iter()
        .map(|p| [p[0] - centre[0], p[1] - centre[1]])
        .collect();
    let length = size(&centred);
    (length > 0.0).then(|| scaled(&centred, length.recip()))
}

/// The mean of some points.
pub(super) fn centroid(points: &[Point]) -> Point {
    let n = points.len() as f64;
    let sum = points
        .iter()
        .fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
    [sum[0] / n, sum[1] / n]
}

/// The full Procrustes distance of two preshapes, from 0 to 1: the least distance of `z` from the
/// multiples `c w`, `c` complex, `sqrt(1 - |<w, z>|^2)` (Dryden and Mardia, equation 4.11).
pub(super) fn procrustes(z: &[Point], w: &[Point]) -> f64 {
    let [re, im] = hermitian(w, z);
    let residual: Vec<Point> = z
        .iter()
        .zip(w)
        .map(|(z, w)| {
            [
                z[0] - (re * w[0] - im * w[1]),
                z[1] - (re * w[1] + im * w[0]),
            ]
        })
        .collect();
    size(&residual)
}

/// `w` renumbered by the cyclic shift for which it fits `z` best, and turned onto `z`.
pub(super) fn aligned(z: &[Point], w: &[Point]) -> Vec<Point> {
    let shifted = |shift: usize| [&w[shift..], &w[..shift]].concat();
    let fit = |shift: usize| {
        let [re, im] = hermitian(&shifted(shift), z);
        re.hypot(im)
    };
    let best = (0..w.len()).map(|shift| (fit(shift), shift));
    // Of equal fits the first.
    let best = best.fold((-1.0, 0), |a, b| if b.0 > a.0 { b } else { a });
    let shifted = shifted(best.1);
    turned(&shifted, hermitian(&shifted, z))
}

/// Kendall's space of the shapes of an outline, whose landmarks are numbered from an unknown one.
pub(super) const SHAPES: Orbits = Orbits { aligned };

/// The full Procrustes mean: `argmin_m sum d(m, z_i)^2` of the full Procrustes distance, the dominant
/// eigenvector of `sum z_i z_i^*` (Dryden and Mardia, result 3.2), by the power iteration, with the best
/// correspondences in every iteration. It has the position of the first.
pub(super) fn procrustes_mean(shapes: &[Vec<Point>]) -> Vec<Point> {
    let first = &shapes[0];
    let mut mean = first.clone();
    for _ in 0..ITERATIONS {
        let mut sum = vec![[0.0; 2]; mean.len()];
        for shape in shapes {
            let own = aligned(&mean, shape);
            let fit = hermitian(&own, &mean)[0];
            sum = added(&sum, fit, &own);
        }
        let next = scaled(&sum, size(&sum).recip());
        let moved = size(&added(&next, -1.0, &mean));
        mean = next;
        if moved < 1e-12 {
            break;
        }
    }
    turned(&mean, hermitian(&mean, first))
}

/// The mean of the lengths `sqrt(sum |p_k - c|^2)` of some curves of landmarks, `c` their centroids.
pub(super) fn mean_size(curves: &[Curve]) -> f64 {
    let own = |curve: &Curve| {
        let centre = centroid(&curve.points);
        let centred = curve
            .points
            .iter()
            .map(|p| [p[0] - centre[0], p[1] - centre[1]]);
        size(&centred.collect::<Vec<_>>())
    };
    curves.iter().map(own).sum::<f64>() / curves.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn triangle(points: [Point; 3]) -> Vec<Point> {
        preshape(&points).unwrap()
    }

    #[test]
    fn similar_triangles_have_distance_zero() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.3, 0.8]];
        let moved = points.map(|[x, y]| [2.0 - 3.0 * y, 5.0 + 3.0 * x]);
        assert!(procrustes(&triangle(points), &triangle(moved)) < 1e-15);
        // A reflection is no similarity of shapes.
        let mirrored = points.map(|[x, y]| [-x, y]);
        assert!(procrustes(&triangle(points), &triangle(mirrored)) > 0.1);
    }

    /// The shapes of triangles are a sphere of radius 1/2, on which the equilateral ones are the poles
    /// and the flat ones the equator: at `pi/4`, whose sine is the full Procrustes distance.
    #[test]
    fn equilateral_and_flat_triangles_are_a_quarter_turn_apart() {
        let h = 0.75f64.sqrt();
        let equilateral = triangle([[0.0, 0.0], [1.0, 0.0], [0.5, h]]);
        for t in [0.5, 0.1, 3.0] {
            let flat = triangle([[0.0, 0.0], [1.0, 0.0], [t, 0.0]]);
            let distance = procrustes(&equilateral, &flat);
            assert_relative_eq!(distance, 0.5f64.sqrt(), epsilon = 1e-12);
        }
    }

    #[test]
    fn the_numbering_does_not_matter() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.3, 0.8], [0.1, 0.7]];
        let renumbered = [points[2], points[3], points[0], points[1]];
        let [a, b] = [points, renumbered].map(|p| preshape(&p).unwrap());
        assert!(procrustes(&a, &b) > 0.1);
        assert!(size(&added(&aligned(&a, &b), -1.0, &a)) < 1e-14);
    }

    /// The mean of two shapes is the middle of the geodesic between them.
    #[test]
    fn the_mean_is_as_far_from_both() {
        let [a, b] = [[0.5, 1.0], [0.7, 0.6]].map(|tip| triangle([[0.0, 0.0], [1.0, 0.0], tip]));
        let mean = procrustes_mean(&[a.clone(), b.clone()]);
        let angle = |z: &[Point], w: &[Point]| procrustes(z, &aligned(z, w)).asin();
        assert_relative_eq!(angle(&mean, &a), angle(&mean, &b), epsilon = 1e-10);
        assert_relative_eq!(2.0 * angle(&mean, &a), angle(&a, &b), epsilon = 1e-10);
    }
}
