//! Closed polygons of the plane, given by their corners; the first is not repeated at the end.

/// Returns the sides, each from a corner to the next.
pub fn sides(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// Returns the enclosed area by the shoelace formula: positive where the inside lies to the left of the sides.
pub fn area(corners: &[[f64; 2]]) -> f64 {
    let pieces = sides(corners).map(|[a, b]| a[0] * b[1] - a[1] * b[0]);
    0.5 * pieces.sum::<f64>()
}

/// Returns whether a ray from a point crosses the sides an odd number of times.
pub fn encloses(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let crossed = sides(corners).filter(|[a, b]| {
        (a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])
    });
    crossed.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L, and the same in the other sense.
    #[test]
    fn polygons_have_an_area_and_an_inside() {
        let mut corners = vec![
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        assert_eq!(sides(&corners).count(), 6);
        for expected in [4.0, -4.0] {
            assert_eq!(area(&corners), expected);
            assert!(encloses(&corners, [0.5, 2.5]) && encloses(&corners, [1.5, 0.5]));
            assert!(!encloses(&corners, [1.5, 1.5]) && !encloses(&corners, [-0.5, 0.5]));
            corners.reverse();
        }
        assert_eq!(area(&[]), 0.0);
    }
}
