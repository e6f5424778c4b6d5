//! The boundary of an object as oriented segments or triangles.

use std::collections::HashMap;

use nalgebra::{SMatrix, SVector};

use crate::error::LevelsetError;
use crate::vector::{area_normal, norm};

/// Oriented segments around a 2D object, or oriented triangles around a 3D object: shared
/// points, and for every simplex the positions of its `D` corners in the list of points.
///
/// Orientation: the object lies to the left of a segment; the normal of a triangle, by the
/// right-hand rule, points out of the object.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Contour<const D: usize> {
    points: Vec<[f64; D]>,
    simplices: Vec<Simplex<D>>,
}

/// Positions of the corners of a segment or triangle in the list of points.
pub type Simplex<const D: usize> = [u32; D];

impl<const D: usize> Contour<D> {
    /// A contour from its points and its segments or triangles.
    ///
    /// # Errors
    /// [`LevelsetError::MissingPoint`] and [`LevelsetError::NonFinitePoint`].
    pub fn new(points: Vec<[f64; D]>, simplices: Vec<Simplex<D>>) -> Result<Self, LevelsetError> {
        for (simplex, corners) in simplices.iter().enumerate() {
            if let Some(&point) = corners.iter().find(|&&c| c as usize >= points.len()) {
                return Err(LevelsetError::MissingPoint {
                    simplex,
                    point: point as usize,
                    n_points: points.len(),
                });
            }
        }
        if let Some(point) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(LevelsetError::NonFinitePoint {
                point,
                position: points[point].to_vec(),
            });
        }
        Ok(Self { points, simplices })
    }

    /// The points.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The segments or triangles.
    pub fn simplices(&self) -> &[Simplex<D>] {
        &self.simplices
    }

    /// Whether there is no segment or triangle at all.
    pub fn is_empty(&self) -> bool {
        self.simplices.is_empty()
    }

    /// Positions of the corners of one segment or triangle.
    pub fn corners(&self, simplex: usize) -> [[f64; D]; D] {
        self.simplices[simplex].map(|c| self.points[c as usize])
    }

    /// Positions of the corners of every segment or triangle.
    pub fn all_corners(&self) -> impl Iterator<Item = [[f64; D]; D]> + '_ {
        (0..self.simplices.len()).map(|i| self.corners(i))
    }

    /// The segments or triangles whose corners pass a test; what is left may be open, or empty. All
    /// points stay.
    #[must_use]
    pub fn part(&self, keep: impl Fn(&[[f64; D]; D]) -> bool) -> Self {
        let all = self.all_corners().zip(&self.simplices);
        let kept = all.filter(|(corners, _)| keep(corners));
        Self {
            points: self.points.clone(),
            simplices: kept.map(|(_, simplex)| *simplex).collect(),
        }
    }

    /// The contour with every point moved. The map must keep the orientation (for one that
    /// does not, follow it by [`Contour::flipped`]).
    pub fn map(&self, f: impl Fn([f64; D]) -> [f64; D]) -> Self {
        Self {
            points: self.points.iter().map(|&p| f(p)).collect(),
            simplices: self.simplices.clone(),
        }
    }

    /// The contour under `x -> matrix x + translation`, oriented as before: a reflection turns
    /// the simplices round.
    pub fn transformed(&self, matrix: &SMatrix<f64, D, D>, translation: &SVector<f64, D>) -> Self {
        let moved = self.map(|p| (matrix * SVector::from(p) + translation).into());
        if determinant(matrix) < 0.0 {
            moved.flipped()
        } else {
            moved
        }
    }

    /// The same simplices with the opposite orientation.
    pub fn flipped(mut self) -> Self {
        for corners in &mut self.simplices {
            corners.swap(0, 1);
        }
        self
    }

    /// Both contours as one.
    pub fn joined(mut self, other: &Self) -> Self {
        let shift = self.points.len() as u32;
        self.points.extend_from_slice(&other.points);
        let moved = other.simplices.iter().map(|s| s.map(|c| c + shift));
        self.simplices.extend(moved);
        self
    }

    /// Length of a 2D contour, area of a 3D one.
    pub fn perimeter(&self) -> f64 {
        self.all_corners().map(|c| norm(&area_normal(&c))).sum()
    }

    /// Whether the contour has no rim: every end of a segment, or every edge of a triangle, is
    /// met in one direction as often as in the other.
    pub fn is_closed(&self) -> bool {
        let mut balance: HashMap<[u32; 2], i64> = HashMap::new();
        for corners in &self.simplices {
            for omitted in 0..D {
                let (rim, sign) = rim(corners, omitted);
                *balance.entry(rim).or_default() += sign;
            }
        }
        balance.values().all(|&sum| sum == 0)
    }

    /// Points minus edges (plus triangles): 2 for a sphere, 0 for a torus, twice the number of
    /// spheres for several; always 0 for closed curves.
    pub fn euler_number(&self) -> i64 {
        let mut used: Vec<u32> = self.simplices.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for corners in &self.simplices {
            for i in 0..D {
                for j in 0..i {
                    edges.push([corners[i].min(corners[j]), corners[i].max(corners[j])]);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let faces = if D == 3 { self.simplices.len() } else { 0 };
        used.len() as i64 - edges.len() as i64 + faces as i64
    }

    /// Number of pieces: sets of simplices that hang together by shared points.
    pub fn n_components(&self) -> usize {
        let mut parent: Vec<usize> = (0..self.points.len()).collect();
        for corners in &self.simplices {
            let a = root(&mut parent, corners[0] as usize);
            for &c in &corners[1..] {
                let b = root(&mut parent, c as usize);
                parent[b] = a;
            }
        }
        let mut roots: Vec<usize> = self
            .simplices
            .iter()
            .map(|corners| root(&mut parent, corners[0] as usize))
            .collect();
        roots.sort_unstable();
        roots.dedup();
        roots.len()
    }
}

/// The part of a simplex's rim opposite to one corner, as a sorted key with its orientation.
fn rim<const D: usize>(corners: &Simplex<D>, omitted: usize) -> ([u32; 2], i64) {
    if D == 2 {
        let sign = if omitted == 0 { 1 } else { -1 };
        return ([corners[1 - omitted], 0], sign);
    }
    let (a, b) = (corners[(omitted + 1) % D], corners[(omitted + 2) % D]);
    match a.cmp(&b) {
        std::cmp::Ordering::Less => ([a, b], 1),
        std::cmp::Ordering::Equal => ([a, b], 0),
        std::cmp::Ordering::Greater => ([b, a], -1),
    }
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

/// `det(matrix)` for `D = 2, 3`, without bounds on the dimension.
fn determinant<const D: usize>(matrix: &SMatrix<f64, D, D>) -> f64 {
    let m = |i: usize, j: usize| matrix[(i, j)];
    if D == 2 {
        return m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
    }
    (0..3)
        .map(|j| {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            m(0, j) * (m(1, k) * m(2, l) - m(1, l) * m(2, k))
        })
        .sum()
}
