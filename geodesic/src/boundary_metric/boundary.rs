//! The boundary of an object as quadrature points with normals.

use super::shape::{corner_weights, offset};
use crate::error::GeodesicError;
use fe_grid::{Field, Grid, ScalarField, locate};
use levelset::{BoxEdge, contour};

/// Passes of the smoothing of the distance before its gradient gives the normals, each with the
/// weights 1/4, 1/2, 1/4 along every axis. The contour of a mask has steps; the normals of its segments
/// do not converge, those of the smoothed distance do.
const SMOOTHING: usize = 4;
/// Smallest weight of a point relative to its share of the contour.
const LEAST_SHARE: f64 = 0.1;
/// Cells along each side of a patch.
const PATCH: usize = 2;
/// Patches with a smaller boundary, in sides of a cell, belong to their largest neighbour: their
/// multipliers would converge slowly.
const LEAST_PATCH: f64 = 0.5;

/// A quadrature point on the boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryPoint<const D: usize> {
    /// Its position.
    pub position: [f64; D],
    /// The unit normal, out of the object.
    pub normal: [f64; D],
    /// Its share of the boundary: the length or area of its part of the contour, projected onto the
    /// plane of the normal.
    pub weight: f64,
    /// Its cell, and the number of its patch.
    pub(super) cell: usize,
    pub(super) patch: usize,
    /// The first node of its cell, and its position in the cell.
    node: usize,
    local: [f64; D],
}

/// The quadrature points of a boundary: two on each segment, three on each triangle of the contour.
#[derive(Clone, Debug)]
pub struct BoundaryPoints<const D: usize> {
    grid: Grid<D>,
    points: Vec<BoundaryPoint<D>>,
    /// Of every patch, the sum of the weights.
    patches: Vec<f64>,
}

impl<const D: usize> BoundaryPoints<D> {
    /// The points of the boundary of `{u > 0}`, closed at the faces of the box.
    ///
    /// # Errors
    /// [`GeodesicError::Shape`] for a level set that is not finite.
    pub fn new(level_set: &ScalarField<f64, D>) -> Result<Self, GeodesicError> {
        let grid = *level_set.grid();
        let contour = contour(level_set, 0.0, BoxEdge::Closed)?;
        let slope = smoothed_gradient(level_set);
        let strides = grid.strides();
        let mut points = Vec::new();
        let mut owner = vec![usize::MAX; grid.n_cells()];
        let mut patches = Vec::new();
        for corners in contour.all_corners() {
            let (flat, measure) = normal_of(&corners);
            if measure <= 0.0 {
                continue;
            }
            let middle = combined(&corners, &[1.0 / D as f64; D]);
            // All points of a simplex belong to the cell that it lies in.
            let (cell, _) = locate(&grid, middle);
            let first = grid.node_index(cell);
            let number = grid.cell_index(cell);
            let patch_cell = grid.cell_index(cell.map(|c| c / PATCH * PATCH));
            if owner[patch_cell] == usize::MAX {
                owner[patch_cell] = patches.len();
                patches.push(0.0);
            }
            let patch = owner[patch_cell];
            for share in shares::<D>() {
                let position = combined(&corners, &share);
                let corner = grid.position(cell);
                let local = std::array::from_fn(|k| {
                    ((position[k] - corner[k]) / grid.spacing()).clamp(0.0, 1.0)
                });
                let mut normal = [0.0; D];
                for (c, weight) in corner_weights(&local).into_iter().enumerate().take(1 << D) {
                    let node = first + offset(&strides, c);
                    for k in 0..D {
                        normal[k] -= weight * slope.component(k)[node];
                    }
                }
                let size = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
                // Where the distance has no slope, such as between two parts, the contour has.
                let normal = if size > 1e-3 {
                    normal.map(|n| n / size)
                } else {
                    flat
                };
                let along: f64 = (0..D).map(|k| normal[k] * flat[k]).sum();
                let weight = measure / shares::<D>().len() as f64 * along.max(LEAST_SHARE);
                patches[patch] += weight;
                points.push(BoundaryPoint {
                    position,
                    normal,
                    weight,
                    cell: number,
                    patch,
                    node: first,
                    local,
                });
            }
        }
        let joined = joined_patches(&grid, &owner, &patches);
        let mut sums = vec![0.0; patches.len()];
        for point in &mut points {
            point.patch = joined[point.patch];
            sums[point.patch] += point.weight;
        }
        Ok(Self {
            grid,
            points,
            patches: sums,
        })
    }

    /// The points.
    pub fn points(&self) -> &[BoundaryPoint<D>] {
        &self.points
    }

    /// The number of patches.
    pub(super) fn n_patches(&self) -> usize {
        self.patches.len()
    }

    /// The length or area of the boundary.
    pub fn measure(&self) -> f64 {
        self.patches.iter().sum()
    }

    /// The norm of a function on the boundary, `(int f^2)^(1/2)`, from its values at the points.
    pub fn norm(&self, values: &[f64]) -> f64 {
        let squares = self
            .points
            .iter()
            .zip(values)
            .map(|(p, f)| p.weight * f * f);
        squares.sum::<f64>().sqrt()
    }

    /// The means of a function over the patches.
    pub(super) fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.patches.len()];
        for (point, value) in self.points.iter().zip(values) {
            means[point.patch] += point.weight / self.patches[point.patch] * value;
        }
        means
    }

    /// The norm of a function that is constant on patches.
    pub(super) fn norm_of_means(&self, means: &[f64]) -> f64 {
        let squares = self.patches.iter().zip(means).map(|(w, f)| w * f * f);
        squares.sum::<f64>().sqrt()
    }

    /// Computes `v . n` at the points.
    pub fn normal_component(&self, velocity: &[f64]) -> Vec<f64> {
        let (n, strides) = (self.grid.n_nodes(), self.grid.strides());
        let at = |point: &BoundaryPoint<D>| {
            let mut sum = 0.0;
            for (c, weight) in corner_weights(&point.local)
                .into_iter()
                .enumerate()
                .take(1 << D)
            {
                let node = point.node + offset(&strides, c);
                for k in 0..D {
                    sum += weight * point.normal[k] * velocity[k * n + node];
                }
            }
            sum
        };
        self.points.iter().map(at).collect()
    }

    /// Adds `int f w . n` for all nodal velocities `w`, from the values of `f` at the points.
    pub(super) fn add_load(&self, values: &[f64], factor: f64, load: &mut [f64]) {
        let (n, strides) = (self.grid.n_nodes(), self.grid.strides());
        for (point, value) in self.points.iter().zip(values) {
            let value = factor * point.weight * value;
            for (c, weight) in corner_weights(&point.local)
                .into_iter()
                .enumerate()
                .take(1 << D)
            {
                let node = point.node + offset(&strides, c);
                for k in 0..D {
                    load[k * n + node] += weight * point.normal[k] * value;
                }
            }
        }
    }
}

/// For every patch the one that it belongs to: itself, or its largest neighbour if it is small.
fn joined_patches<const D: usize>(grid: &Grid<D>, owner: &[usize], patches: &[f64]) -> Vec<usize> {
    let least = LEAST_PATCH * grid.spacing().powi(D as i32 - 1);
    let mut joined: Vec<usize> = (0..patches.len()).collect();
    for (number, &patch) in owner.iter().enumerate() {
        if patch == usize::MAX || patches[patch] >= least {
            continue;
        }
        let cell = grid.cell(number);
        let mut best = patch;
        for code in 0..3usize.pow(D as u32) {
            let step = |k: usize| code / 3usize.pow(k as u32) % 3;
            let near: [usize; D] =
                std::array::from_fn(|k| (cell[k] + step(k) * PATCH).wrapping_sub(PATCH));
            if (0..D).any(|k| near[k] >= grid.cells_per_axis()[k]) {
                continue;
            }
            let other = owner[grid.cell_index(near)];
            if other != usize::MAX && patches[other] > patches[best] {
                best = other;
            }
        }
        // A neighbour that is small itself would be passed on.
        if patches[best] >= least {
            joined[patch] = best;
        }
    }
    joined
}

/// The gradient of the smoothed level set at the nodes, by central differences.
fn smoothed_gradient<const D: usize>(level_set: &ScalarField<f64, D>) -> Field<f64, D, D> {
    let grid = *level_set.grid();
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut values = level_set.as_slice().to_vec();
    let mut before = values.clone();
    for _ in 0..SMOOTHING {
        for k in 0..D {
            before.copy_from_slice(&values);
            for (index, value) in values.iter_mut().enumerate() {
                let i = index / strides[k] % nodes[k];
                // Linear beyond the faces of the box, where it is not smoothed.
                if i > 0 && i + 1 < nodes[k] {
                    let sides = before[index - strides[k]] + before[index + strides[k]];
                    *value = 0.25 * sides + 0.5 * before[index];
                }
            }
        }
    }
    let mut gradient = Field::zeros(grid);
    for k in 0..D {
        for (index, slope) in gradient.component_mut(k).iter_mut().enumerate() {
            let i = index / strides[k] % nodes[k];
            let low = if i > 0 { index - strides[k] } else { index };
            let high = if i + 1 < nodes[k] {
                index + strides[k]
            } else {
                index
            };
            let steps = ((high - low) / strides[k]).max(1);
            *slope = (values[high] - values[low]) / (steps as f64 * grid.spacing());
        }
    }
    gradient
}

/// The unit normal of a segment or triangle, out of the object, and its length or area.
fn normal_of<const D: usize>(corners: &[[f64; D]; D]) -> ([f64; D], f64) {
    let along = |j: usize, k: usize| corners[j][k] - corners[0][k];
    let mut normal = [0.0; D];
    if D == 2 {
        normal[0] = along(1, 1);
        normal[1] = -along(1, 0);
    } else {
        for k in 0..D {
            let (i, j) = ((k + 1) % D, (k + 2) % D);
            normal[k] = 0.5 * (along(1, i) * along(2, j) - along(1, j) * along(2, i));
        }
    }
    let size = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    (normal.map(|n| n / size.max(1e-300)), size)
}

/// Barycentric coordinates of the quadrature points of a segment (exact for cubics) or triangle
/// (exact for quadratics); their weights are equal.
fn shares<const D: usize>() -> Vec<[f64; D]> {
    let (one, other) = if D == 2 {
        let gauss = 0.5 + 0.5 / 3f64.sqrt();
        (gauss, 1.0 - gauss)
    } else {
        (2.0 / 3.0, 1.0 / 6.0)
    };
    (0..D)
        .map(|i| std::array::from_fn(|j| if i == j { one } else { other }))
        .collect()
}

fn combined<const D: usize>(corners: &[[f64; D]; D], shares: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| (0..D).map(|j| shares[j] * corners[j][k]).sum())
}
