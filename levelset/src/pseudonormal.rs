//! Inside-outside test for closed contours.
//!
//! The sign of `(p - c) . n` with `c` the nearest point of the contour, where `n` is the normal
//! of the triangle, edge or corner that `c` belongs to: at an edge the sum of the adjacent
//! normals, at a corner their sum weighted by the angles there. Bærentzen & Aanæs, *Signed
//! distance computation using the angle weighted pseudonormal*, IEEE TVCG 11 (2005), prove that it
//! is correct for closed polyhedra. Near slivers, whose normals are unreliable, and for undecided
//! angles the winding number is used instead.

use std::collections::HashMap;

use crate::vector::{add_scaled, angle, area_normal, dot, norm, sub};

/// A segment shorter, or a triangle less high, than this fraction of the largest coordinate has no
/// reliable normal: coordinates have relative rounding errors of 1e-16, so a direction is accurate
/// to 1e-6.
const SLIVER: f64 = 1e-10;
/// For cosines below this the winding number is used.
const UNDECIDED: f64 = 1e-6;

/// Normals of all parts of a contour's simplices, in the order of these simplices.
#[derive(Clone, Debug)]
pub(crate) struct Pseudonormals<const D: usize> {
    face: Vec<Option<[f64; D]>>,
    /// Normal at each corner; `None` if a sliver is involved.
    corner: Vec<[Option<[f64; D]>; D]>,
    /// Normal of the edge opposite to each corner (3D only).
    edge: Vec<[Option<[f64; D]>; D]>,
}

/// A sum of normals, invalidated by any sliver.
#[derive(Clone, Copy)]
struct Sum<const D: usize>(Option<[f64; D]>);

impl<const D: usize> Sum<D> {
    fn add(&mut self, weight: f64, normal: Option<[f64; D]>) {
        self.0 = match (self.0, normal) {
            (Some(sum), Some(n)) => Some(add_scaled(&sum, weight, &n)),
            _ => None,
        };
    }
}

impl<const D: usize> Pseudonormals<D> {
    pub(crate) fn new(simplices: &[[[f64; D]; D]]) -> Self {
        let ids = merge_points(simplices);
        let coordinates = simplices.iter().flatten().flatten();
        let least_height = SLIVER * coordinates.fold(0.0, |m: f64, x| m.max(x.abs()));
        let face: Vec<_> = simplices
            .iter()
            .map(|corners| unit_normal(corners, least_height))
            .collect();
        let empty = Sum(Some([0.0; D]));
        let n_points = ids.iter().flatten().max().map_or(0, |&m| m as usize + 1);
        let mut at_point = vec![empty; n_points];
        let mut at_edge: HashMap<[u32; 2], Sum<D>> = HashMap::new();
        for (i, corners) in simplices.iter().enumerate() {
            for c in 0..D {
                at_point[ids[i][c] as usize].add(corner_weight(corners, c), face[i]);
                if D == 3 {
                    let sum = at_edge.entry(opposite(&ids[i], c)).or_insert(empty);
                    sum.add(1.0, face[i]);
                }
            }
        }
        let corner = ids
            .iter()
            .map(|id| id.map(|point| at_point[point as usize].0))
            .collect();
        let edge = ids
            .iter()
            .map(|id| {
                std::array::from_fn(|c| {
                    let sum = at_edge.get(&opposite(id, c));
                    sum.and_then(|s| s.0)
                })
            })
            .collect();
        Self { face, corner, edge }
    }

    /// Returns whether `point` lies inside, given its offset from the nearest point of a simplex
    /// and that point's barycentric weights; `None` if this is undecided.
    pub(crate) fn is_inside(
        &self,
        simplex: usize,
        weights: &[f64; D],
        offset: &[f64; D],
    ) -> Option<bool> {
        let n_active = weights.iter().filter(|&&w| w != 0.0).count();
        let normal = if n_active == D {
            self.face[simplex]
        } else if n_active == 1 {
            let c = weights.iter().position(|&w| w != 0.0)?;
            self.corner[simplex][c]
        } else {
            let c = weights.iter().position(|&w| w == 0.0)?;
            self.edge[simplex][c]
        }?;
        let along = dot(&normal, offset);
        if along.abs() <= UNDECIDED * norm(&normal) * norm(offset) {
            return None;
        }
        Some(along < 0.0)
    }
}

/// Computes the winding number of a closed contour around a point: 1 inside, 0 outside.
///
/// Sum of the signed angles (2D) or solid angles (3D; van Oosterom & Strackee, IEEE Trans.
/// Biomed. Eng. 30 (1983)) under which the simplices are seen, over the full angle.
pub(crate) fn winding_number<const D: usize>(simplices: &[[[f64; D]; D]], point: &[f64; D]) -> f64 {
    let sum: f64 = simplices.iter().map(|c| seen_angle(c, point)).sum();
    let full = if D == 2 { 1.0 } else { 2.0 } * std::f64::consts::TAU;
    sum / full
}

fn seen_angle<const D: usize>(corners: &[[f64; D]; D], point: &[f64; D]) -> f64 {
    let rays: [[f64; D]; D] = std::array::from_fn(|c| sub(&corners[c], point));
    if D == 2 {
        let cross = rays[0][0] * rays[1][1] - rays[0][1] * rays[1][0];
        return cross.atan2(dot(&rays[0], &rays[1]));
    }
    let (a, b, c) = (&rays[0], &rays[1], &rays[2]);
    let (la, lb, lc) = (norm(a), norm(b), norm(c));
    let triple: f64 = (0..3)
        .map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            a[k] * (b[i] * c[j] - b[j] * c[i])
        })
        .sum();
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * triple.atan2(below)
}

/// Assigns an index to each distinct corner position: equal positions have equal indices, which
/// connects a loose list of triangles, as in an STL file.
fn merge_points<const D: usize>(simplices: &[[[f64; D]; D]]) -> Vec<[u32; D]> {
    let mut known: HashMap<[u64; D], u32> = HashMap::new();
    simplices
        .iter()
        .map(|corners| {
            corners.map(|p| {
                // Adding zero turns -0 into +0, so that both have the same bits.
                let bits = p.map(|x| (x + 0.0).to_bits());
                let fresh = known.len() as u32;
                *known.entry(bits).or_insert(fresh)
            })
        })
        .collect()
}

fn opposite<const D: usize>(ids: &[u32; D], corner: usize) -> [u32; 2] {
    let (a, b) = (ids[(corner + 1) % D], ids[(corner + 2) % D]);
    [a.min(b), a.max(b)]
}

/// Returns the normal of a segment of at least this length, or a triangle of at least this height.
fn unit_normal<const D: usize>(corners: &[[f64; D]; D], least_height: f64) -> Option<[f64; D]> {
    let normal = area_normal(corners);
    let measure = norm(&normal);
    let height = if D == 2 {
        measure
    } else {
        let sides = (0..D).map(|c| norm(&sub(&corners[c], &corners[(c + 1) % D])));
        2.0 * measure / sides.fold(f64::MIN_POSITIVE, f64::max)
    };
    (height > least_height).then(|| normal.map(|x| x / measure))
}

fn corner_weight<const D: usize>(corners: &[[f64; D]; D], corner: usize) -> f64 {
    if D == 2 {
        return 1.0;
    }
    let here = &corners[corner];
    let to = |k: usize| sub(&corners[(corner + k) % D], here);
    angle(&to(1), &to(2))
}
