//! Marching squares on one square: the contour's segments between crossings of its four sides.

/// A side of a square is named by the corner it starts from, counter-clockwise.
type Side = usize;

/// The segments of one square, each from a side to a side: at most two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Segments {
    list: [(Side, Side); 2],
    n: usize,
}

impl Segments {
    pub(crate) fn as_slice(&self) -> &[(Side, Side)] {
        &self.list[..self.n]
    }

    fn push(&mut self, from: Side, to: Side) {
        self.list[self.n] = (from, to);
        self.n += 1;
    }
}

/// Returns the segments that separate the object (positive corner values) from the background, with
/// the object to their left; corners are listed counter-clockwise.
///
/// With two opposite corners inside, the saddle value `(v0 v2 - v1 v3)/(v0 + v2 - v1 - v3)` of
/// the bilinear interpolant decides: if positive, the two corners are connected, otherwise they are
/// separated. The decision depends on the four values alone, so two cubes that share the square
/// agree. Corners of a binary mask are separated: there the object is connected by sides of pixels,
/// the background by corners.
pub(crate) fn segments(values: [f64; 4]) -> Segments {
    let inside = values.map(|v| v > 0.0);
    let leaves = |s: Side| inside[s] && !inside[(s + 1) % 4];
    let enters = |s: Side| !inside[s] && inside[(s + 1) % 4];
    let n_leaves = (0..4).filter(|&s| leaves(s)).count();
    let joined = n_leaves == 2 && {
        let (even, odd) = (values[0] * values[2], values[1] * values[3]);
        if inside[0] { even > odd } else { odd > even }
    };
    let mut result = Segments::default();
    for from in (0..4).filter(|&s| leaves(s)) {
        // Joined corners: cut off the background corner that follows; else cut off the object
        // corner that precedes. With one segment only, both are the same.
        let to = (1..4)
            .map(|k| {
                if joined {
                    (from + k) % 4
                } else {
                    (from + 4 - k) % 4
                }
            })
            .find(|&s| enters(s));
        if let Some(to) = to {
            result.push(from, to);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_corner_keeps_the_object_left() {
        assert_eq!(segments([1.0, -1.0, -1.0, -1.0]).as_slice(), &[(0, 3)]);
        assert_eq!(segments([-1.0, 1.0, 1.0, 1.0]).as_slice(), &[(3, 0)]);
        assert_eq!(segments([1.0, 1.0, -1.0, -1.0]).as_slice(), &[(1, 3)]);
    }

    #[test]
    fn no_crossing_no_segment() {
        assert!(segments([1.0; 4]).as_slice().is_empty());
        assert!(segments([0.0; 4]).as_slice().is_empty());
    }

    #[test]
    fn saddle_follows_the_bilinear_value() {
        // Corners with large values are connected, others and ties are separated.
        assert_eq!(
            segments([3.0, -1.0, 3.0, -1.0]).as_slice(),
            &[(0, 1), (2, 3)]
        );
        assert_eq!(
            segments([1.0, -3.0, 1.0, -3.0]).as_slice(),
            &[(0, 3), (2, 1)]
        );
        assert_eq!(
            segments([-0.5, 0.5, -0.5, 0.5]).as_slice(),
            &[(1, 0), (3, 2)]
        );
    }
}
