//! Marching cubes on one cube, without a table: the segments of its six faces form closed
//! loops, and each loop is filled by triangles.
//!
//! Two cubes that share a face draw the same segments on it (see [`crate::quad`]), therefore
//! the surface has no holes whatever the values are. A loop is filled without a chord in a
//! face of the cube, so that no edge can meet an edge of the neighbouring cube; where every fan
//! would have such a chord, the loop gets a point in its middle.

use crate::quad;
use crate::vector::{norm, sub};

/// An edge of a cube: the corner of lower position (bit `k` set: far side along axis `k`) and
/// the axis along which it runs.
pub(crate) type Edge = (usize, usize);

/// Longest loop: a cube has twelve edges.
const MAX_LOOP: usize = 12;

/// Corners of the face at the low or high side of an axis, counter-clockwise as seen from
/// outside the cube.
fn face_corners(axis: usize, high: bool) -> [usize; 4] {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = if high { 1 << axis } else { 0 };
    let (a, b) = if high { (u, v) } else { (v, u) };
    [base, base + a, base + a + b, base + b]
}

/// Returns the edge between two neighbouring corners.
fn edge(a: usize, b: usize) -> Edge {
    (a & b, (a ^ b).trailing_zeros() as usize)
}

/// Returns the loops around the object in a cube with the given corner values, as lists of crossed
/// edges whose normal points out of the object.
pub(crate) fn loops(values: &[f64; 8]) -> Vec<Vec<Edge>> {
    // next[corner][axis]: the edge that follows this one on its loop.
    let mut next: [[Option<Edge>; 3]; 8] = [[None; 3]; 8];
    for axis in 0..3 {
        for high in [false, true] {
            let corners = face_corners(axis, high);
            let side = |s: usize| edge(corners[s], corners[(s + 1) % 4]);
            for &(from, to) in quad::segments(corners.map(|c| values[c])).as_slice() {
                // Seen from outside, face segments run clockwise around the outward normal.
                let (corner, along) = side(to);
                next[corner][along] = Some(side(from));
            }
        }
    }
    let mut loops = Vec::new();
    for corner in 0..8 {
        for axis in 0..3 {
            let mut ring = Vec::new();
            let mut here = (corner, axis);
            while let Some(following) = next[here.0][here.1].take() {
                ring.push(here);
                here = following;
            }
            if !ring.is_empty() {
                loops.push(ring);
            }
        }
    }
    loops
}

/// Triangulation of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fill {
    /// Triangles from the point of this position in the loop to all others.
    Fan(usize),
    /// Triangles from a new point in the middle.
    Middle,
}

/// Returns the fan with the shortest chords of which none lies in a face of the cube, if there is
/// one.
pub(crate) fn fill(ring: &[Edge], positions: &[[f64; 3]]) -> Fill {
    let n = ring.len();
    debug_assert!(n <= MAX_LOOP);
    let mut best = (f64::INFINITY, Fill::Middle);
    for apex in 0..n {
        let chords = (2..n - 1).map(|k| (apex + k) % n);
        if chords.clone().any(|k| share_face(ring[apex], ring[k])) {
            continue;
        }
        let length: f64 = chords
            .map(|k| norm(&sub(&positions[apex], &positions[k])))
            .sum();
        if length < best.0 {
            best = (length, Fill::Fan(apex));
        }
    }
    best.1
}

/// Returns whether two edges of a cube lie in a common face.
fn share_face(a: Edge, b: Edge) -> bool {
    (0..3).any(|axis| axis != a.1 && axis != b.1 && (a.0 ^ b.0) >> axis & 1 == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_share_each_edge_in_opposite_directions() {
        let mut balance = [[0i32; 8]; 8];
        for axis in 0..3 {
            for high in [false, true] {
                let corners = face_corners(axis, high);
                for s in 0..4 {
                    let (a, b) = (corners[s], corners[(s + 1) % 4]);
                    balance[a][b] += 1;
                    balance[b][a] -= 1;
                }
            }
        }
        assert!(balance.iter().flatten().all(|&b| b == 0));
    }

    #[test]
    fn every_sign_pattern_gives_closed_loops_over_all_crossed_edges() {
        for pattern in 0..256usize {
            let values = std::array::from_fn(|c| if pattern >> c & 1 == 1 { 1.0 } else { -1.0 });
            let mut seen: Vec<Edge> = loops(&values).concat();
            let n = seen.len();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(
                seen.len(),
                n,
                "an edge is crossed twice in pattern {pattern}"
            );
            let crossed = (0..8usize)
                .flat_map(|c| (0..3).map(move |k| (c, k)))
                .filter(|&(c, k)| c >> k & 1 == 0)
                .filter(|&(c, k)| (pattern >> c ^ pattern >> (c | 1 << k)) & 1 == 1)
                .count();
            assert_eq!(n, crossed, "pattern {pattern}");
            for ring in loops(&values) {
                assert!(ring.len() >= 3);
                for i in 0..ring.len() {
                    assert!(share_face(ring[i], ring[(i + 1) % ring.len()]));
                }
            }
        }
    }
}
