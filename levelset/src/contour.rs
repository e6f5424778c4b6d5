//! The boundary of an object as oriented segments or triangles.

use std::collections::HashMap;

use fe_grid::VectorField;
use nalgebra::{SMatrix, SVector};

use crate::error::LevelsetError;
use crate::vector::{area_normal, norm, sub};

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

/// Length of the shortest edges that are divided, relative to the extent of a contour.
const SHORTEST: f64 = 1e-4;

/// Positions of the corners of a segment or triangle in the list of points.
pub type Simplex<const D: usize> = [u32; D];

/// The centroid of a segment or triangle, the mean of its corners.
pub fn centroid<const D: usize>(corners: &[[f64; D]; D]) -> [f64; D] {
    std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / D as f64)
}

/// The least and the greatest coordinates of points: infinite, and the least above the greatest, if there are none.
pub fn bounds<const D: usize>(points: impl IntoIterator<Item = [f64; D]>) -> [[f64; D]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for p in points {
        for k in 0..D {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    [low, high]
}

impl<const D: usize> Contour<D> {
    /// Creates a contour from its points and its segments or triangles.
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

    /// Returns the points.
    pub fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// Returns the segments or triangles.
    pub fn simplices(&self) -> &[Simplex<D>] {
        &self.simplices
    }

    /// Returns whether there are no segments or triangles.
    pub fn is_empty(&self) -> bool {
        self.simplices.is_empty()
    }

    /// Returns the positions of the corners of one segment or triangle.
    pub fn corners(&self, simplex: usize) -> [[f64; D]; D] {
        self.simplices[simplex].map(|c| self.points[c as usize])
    }

    /// Returns the positions of the corners of every segment or triangle.
    pub fn all_corners(&self) -> impl Iterator<Item = [[f64; D]; D]> + '_ {
        (0..self.simplices.len()).map(|i| self.corners(i))
    }

    /// Returns the contour of the segments or triangles whose corners pass a test; it may be open,
    /// or empty. All points are retained.
    #[must_use]
    pub fn part(&self, keep: impl Fn(&[[f64; D]; D]) -> bool) -> Self {
        let all = self.all_corners().zip(&self.simplices);
        let kept = all.filter(|(corners, _)| keep(corners));
        Self {
            points: self.points.clone(),
            simplices: kept.map(|(_, simplex)| *simplex).collect(),
        }
    }

    /// Returns the contour with every point moved. The map must preserve the orientation (otherwise
    /// apply [`Contour::flipped`] to the result).
    pub fn map(&self, f: impl Fn([f64; D]) -> [f64; D]) -> Self {
        Self {
            points: self.points.iter().map(|&p| f(p)).collect(),
            simplices: self.simplices.clone(),
        }
    }

    /// Returns the contour under `x -> x + factor u(x)`, by the multilinear interpolant of the displacement `u`. It
    /// must preserve the orientation, as in [`Contour::map`].
    pub fn displaced(&self, displacement: &VectorField<f64, D>, factor: f64) -> Self {
        self.map(|p| {
            let u = displacement.sample(p);
            std::array::from_fn(|k| p[k] + factor * u[k])
        })
    }

    /// Returns the contour under `x -> matrix x + translation`, oriented as before: for a
    /// reflection the simplices are flipped.
    pub fn transformed(&self, matrix: &SMatrix<f64, D, D>, translation: &SVector<f64, D>) -> Self {
        let moved = self.map(|p| (matrix * SVector::from(p) + translation).into());
        if determinant(matrix) < 0.0 {
            moved.flipped()
        } else {
            moved
        }
    }

    /// Returns the same simplices with the opposite orientation.
    pub fn flipped(mut self) -> Self {
        for corners in &mut self.simplices {
            corners.swap(0, 1);
        }
        self
    }

    /// Returns the union of both contours.
    pub fn joined(mut self, other: &Self) -> Self {
        let shift = self.points.len() as u32;
        self.points.extend_from_slice(&other.points);
        let moved = other.simplices.iter().map(|s| s.map(|c| c + shift));
        self.simplices.extend(moved);
        self
    }

    /// Returns the same boundary in pieces of which no edge is longer than `length`: longer ones are
    /// bisected, the longest of a triangle first. Pieces that share an edge divide it at the same
    /// points, so that a closed contour remains closed. Edges shorter than a ten thousandth of the
    /// extent are never divided, which bounds the number of pieces.
    pub fn refined(&self, length: f64) -> Self {
        if length.is_nan() {
            return self.clone();
        }
        let [low, high] = self.bounds();
        let length = length.max(SHORTEST * norm(&sub(&high, &low)));
        let mut points = self.points.clone();
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let (mut open, mut done) = (self.simplices.clone(), Vec::new());
        open.reverse();
        while let Some(simplex) = open.pop() {
            let Some([i, j]) = longest_edge(&points, &simplex, length) else {
                done.push(simplex);
                continue;
            };
            let (a, b) = (simplex[i], simplex[j]);
            let middle = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let [p, q] = [a, b].map(|corner| points[corner as usize]);
                points.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
                points.len() as u32 - 1
            });
            for corner in [i, j] {
                let mut half = simplex;
                half[corner] = middle;
                open.push(half);
            }
        }
        Self {
            points,
            simplices: done,
        }
    }

    /// Returns the length of one segment, or the area of one triangle.
    pub fn size(&self, simplex: usize) -> f64 {
        norm(&area_normal(&self.corners(simplex)))
    }

    /// Returns the [`bounds`] of its points.
    pub fn bounds(&self) -> [[f64; D]; 2] {
        bounds(self.points.iter().copied())
    }

    /// Returns the length of a 2D contour, or the area of a 3D one.
    pub fn perimeter(&self) -> f64 {
        // From zero: an empty sum is minus zero.
        let sizes = self.all_corners().map(|c| norm(&area_normal(&c)));
        sizes.fold(0.0, |sum, size| sum + size)
    }

    /// Returns whether the contour has no boundary: every end of a segment, or every edge of a
    /// triangle, occurs equally often in both directions.
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

    /// Returns the Euler characteristic, points minus edges (plus triangles): 2 for a sphere, 0 for
    /// a torus, twice the number of spheres for several; always 0 for closed curves.
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

    /// Returns the number of components: sets of simplices connected by shared points.
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

/// The ends of the longest edge of a simplex, as positions among its corners, if it is longer than
/// `length`.
fn longest_edge<const D: usize>(
    points: &[[f64; D]],
    simplex: &Simplex<D>,
    length: f64,
) -> Option<[usize; 2]> {
    let pairs = (0..D).flat_map(|i| (i + 1..D).map(move |j| [i, j]));
    let measured = pairs.map(|[i, j]| {
        let [p, q] = [i, j].map(|corner| points[simplex[corner] as usize]);
        (norm(&sub(&p, &q)), [i, j])
    });
    let longest = measured.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (longest.0 > length).then_some(longest.1)
}
