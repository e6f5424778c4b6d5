//! Signed distances, positive inside the object.

use fe_grid::{Field, Grid};
use rayon::prelude::*;

use crate::bvh::Bvh;
use crate::contour::Contour;
use crate::extract::{BoxEdge, check_finite, contour};
use crate::pseudonormal::{Pseudonormals, winding_number};
use crate::vector::{add_scaled, sub};
use crate::{LevelsetError, vector};

/// The signed distance to the contour of the object `{field > level}`, at every node.
///
/// `|u|` is the exact Euclidean distance, to rounding, to the contour that
/// [`contour`](crate::contour()) draws ([`BoxEdge::Open`]: the edge of the box is no boundary);
/// `u > 0` exactly where `field > level`, up to nodes that lie on the contour, where `u = 0`.
/// A binary mask so gets the distance to the midpoints between its pixels, a grey image or a
/// level set a distance of sub-cell accuracy.
///
/// # Errors
/// [`LevelsetError::EmptyObject`] and [`LevelsetError::FullObject`], as there is no contour to
/// be far from; [`LevelsetError::NonFinite`] with the node of a NaN or infinity.
///
/// # Example
/// ```
/// use fe_grid::{Field, Grid};
/// // A disk of radius 0.3, given by a function that is no distance.
/// let disk = Field::<f64, 2, 1>::from_fn(Grid::dyadic(5), |[x, y]| {
///     [0.09 - (x - 0.5).powi(2) - (y - 0.5).powi(2)]
/// });
/// let u = levelset::signed_distance(&disk, 0.0)?;
/// assert!((u.sample([0.5, 0.5])[0] - 0.3).abs() < 1e-3);
/// # Ok::<(), levelset::LevelsetError>(())
/// ```
pub fn signed_distance<const D: usize>(
    field: &Field<f64, D, 1>,
    level: f64,
) -> Result<Field<f64, D, 1>, LevelsetError> {
    check_finite(field, level)?;
    let n_inside = field.as_slice().iter().filter(|&&v| v > level).count();
    if n_inside == 0 {
        return Err(LevelsetError::EmptyObject { level });
    }
    if n_inside == field.as_slice().len() {
        return Err(LevelsetError::FullObject { level });
    }
    let contour = contour(field, level, BoxEdge::Open)?;
    let tree = Tree::new(&contour)?;
    let mut distance = Field::zeros(*field.grid());
    let values = field.as_slice();
    tree.for_each_node(&mut distance, |index, _, near| {
        let d = near.distance;
        if values[index] > level { d } else { -d }
    });
    Ok(distance)
}

/// The nearest point of a contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest<const D: usize> {
    /// Euclidean distance, not negative.
    pub distance: f64,
    /// The nearest point.
    pub point: [f64; D],
    /// Position in the contour of the segment or triangle that it lies on.
    pub simplex: usize,
}

/// Distances from arbitrary points to a contour, which may come from another grid, from a file
/// or from a map of either.
#[derive(Clone, Debug)]
pub struct ContourDistance<const D: usize> {
    tree: Tree<D>,
    normals: Pseudonormals<D>,
}

impl<const D: usize> ContourDistance<D> {
    /// Prepares a contour for queries.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyContour`].
    pub fn new(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        let tree = Tree::new(contour)?;
        let normals = Pseudonormals::new(tree.bvh.all_corners());
        Ok(Self { tree, normals })
    }

    /// The nearest point of the contour.
    pub fn nearest(&self, point: [f64; D]) -> Nearest<D> {
        let near = self.tree.nearest(&point, 0);
        Nearest {
            distance: near.distance,
            point: near.point,
            simplex: self.tree.bvh.origin(near.stored),
        }
    }

    /// The signed distance, positive inside. The contour must be closed; for an open one the
    /// sign is that of the nearest segment or triangle.
    pub fn signed_distance(&self, point: [f64; D]) -> f64 {
        let near = self.tree.nearest(&point, 0);
        if self.is_inside(&point, &near) {
            near.distance
        } else {
            -near.distance
        }
    }

    /// The signed distance at every node of a grid; see [`ContourDistance::signed_distance`].
    pub fn sample(&self, grid: Grid<D>) -> Field<f64, D, 1> {
        let mut distance = Field::zeros(grid);
        self.tree.for_each_node(&mut distance, |_, point, near| {
            if self.is_inside(point, near) {
                near.distance
            } else {
                -near.distance
            }
        });
        distance
    }

    fn is_inside(&self, point: &[f64; D], near: &Near<D>) -> bool {
        let offset = sub(point, &near.point);
        self.normals
            .is_inside(near.stored, &near.weights, &offset)
            .unwrap_or_else(|| winding_number(self.tree.bvh.all_corners(), point) > 0.5)
    }
}

struct Near<const D: usize> {
    distance: f64,
    point: [f64; D],
    weights: [f64; D],
    stored: usize,
}

/// Unsigned distances to a contour.
#[derive(Clone, Debug)]
struct Tree<const D: usize> {
    bvh: Bvh<D>,
}

impl<const D: usize> Tree<D> {
    fn new(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        if contour.is_empty() {
            return Err(LevelsetError::EmptyContour);
        }
        let simplices: Vec<_> = contour.all_corners().collect();
        Ok(Self {
            bvh: Bvh::new(&simplices),
        })
    }

    fn nearest(&self, point: &[f64; D], guess: usize) -> Near<D> {
        let (stored, closest) = self.bvh.nearest(point, guess);
        let corners = self.bvh.corners(stored);
        let mut foot = corners[0];
        for k in 1..D {
            let edge = vector::sub(&corners[k], &corners[0]);
            foot = add_scaled(&foot, closest.weights[k], &edge);
        }
        Near {
            distance: closest.distance_squared.sqrt(),
            point: foot,
            weights: closest.weights,
            stored,
        }
    }

    /// Fills a field row by row, in parallel; each node starts its search from the simplex
    /// that was nearest to the node before it.
    fn for_each_node(
        &self,
        field: &mut Field<f64, D, 1>,
        value: impl Fn(usize, &[f64; D], &Near<D>) -> f64 + Sync,
    ) {
        let grid = *field.grid();
        let row = grid.nodes_per_axis()[0];
        let rows = field.as_mut_slice().par_chunks_mut(row).enumerate();
        rows.for_each(|(r, values)| {
            let mut guess = 0;
            for (i, out) in values.iter_mut().enumerate() {
                let index = r * row + i;
                let point = grid.position(grid.node(index));
                let near = self.nearest(&point, guess);
                guess = near.stored;
                *out = value(index, &point, &near);
            }
        });
    }
}
