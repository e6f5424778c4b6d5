//! Signed distances, positive inside the object.

use fe_grid::{Field, Grid, compiled_once, mutant, parallel};

use crate::bvh::Bvh;
use crate::contour::Contour;
use crate::error::LevelsetError;
use crate::extract::{BoxEdge, check_finite, contour};
use crate::pseudonormal::{Pseudonormals, winding_number};
use crate::search::{Found, PACKET, RUN, find_all};
use crate::vector::{add_scaled, sub};

compiled_once! {
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
    pub fn signed_distance<'a, D>(
        field: &'a Field<f64, D, 1>,
        level: f64,
    ) -> Result<Field<f64, D, 1>, LevelsetError> = signed_distance_in;
}

fn signed_distance_in<const D: usize>(
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
    let tree = tree_of(&contour)?;
    let mut distance = Field::zeros(*field.grid());
    let values = field.as_slice();
    for_each_node(&tree, &mut distance, |index, _, found| {
        let d = mutant!(found.distance, DistanceScale => 1.02 * found.distance);
        if values[index] > level { d } else { -d }
    });
    Ok(distance)
}

/// Share of the distance from the contour at which the side of a point is looked for.
const NEARBY: f64 = 0.9;

/// The nearest point of a contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest<const D: usize> {
    /// Euclidean distance, nonnegative.
    pub distance: f64,
    /// The nearest point.
    pub point: [f64; D],
    /// Index in the contour of the segment or triangle that contains it.
    pub simplex: usize,
}

/// Distances from arbitrary points to a contour, which may come from another grid, from a file
/// or from a map of either.
#[derive(Clone, Debug)]
pub struct ContourDistance<const D: usize> {
    tree: Bvh<D>,
    normals: Pseudonormals<D>,
}

impl<const D: usize> ContourDistance<D> {
    /// Prepares a contour for queries.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyContour`].
    pub fn new(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        prepare(contour)
    }

    fn new_in(contour: &Contour<D>) -> Result<Self, LevelsetError> {
        let tree = tree_of(contour)?;
        let normals = Pseudonormals::new(tree.all_corners());
        Ok(Self { tree, normals })
    }

    /// Returns the nearest point of the contour.
    pub fn nearest(&self, point: [f64; D]) -> Nearest<D> {
        let found = self.find(&point);
        let closest = self.tree.closest(found.stored, &point);
        Nearest {
            distance: found.distance,
            point: self.foot(found.stored, &closest.weights),
            simplex: self.tree.origin(found.stored),
        }
    }

    /// Returns the signed distance, positive inside. The contour must be closed; for an open one
    /// the sign is that of the nearest segment or triangle.
    pub fn signed_distance(&self, point: [f64; D]) -> f64 {
        signed_at(self, &point)
    }

    /// Returns the signed distances of many points, as [`ContourDistance::signed_distance`] does for one
    /// of them, but several times faster where points that follow each other lie near each other: they
    /// walk through the triangles together.
    pub fn signed_distances(&self, points: &[[f64; D]]) -> Vec<f64> {
        signed_at_all(self, points)
    }

    fn signed_distances_in(&self, points: &[[f64; D]]) -> Vec<f64> {
        let found = find_all(&self.tree, points);
        let mut distances = vec![0.0; points.len()];
        parallel::for_each_chunk(&mut distances, RUN, 1, &|run, distances| {
            for (i, distance) in distances.iter_mut().enumerate() {
                let i = run * RUN + i;
                *distance = self.signed(&points[i], found[i]);
            }
        });
        distances
    }

    fn signed_distance_in(&self, point: &[f64; D]) -> f64 {
        self.signed(point, self.find(point))
    }

    /// Computes the signed distance at every node of a grid; see
    /// [`ContourDistance::signed_distance`].
    pub fn sample(&self, grid: Grid<D>) -> Field<f64, D, 1> {
        sample(self, grid)
    }

    fn sample_in(&self, grid: Grid<D>) -> Field<f64, D, 1> {
        let mut distance = Field::zeros(grid);
        for_each_node(&self.tree, &mut distance, |_, point, found| {
            self.signed(point, found)
        });
        distance
    }

    /// Finds the stored simplex nearest to a point.
    pub(crate) fn find(&self, point: &[f64; D]) -> Found {
        let mut found = [Found::default()];
        self.tree.nearest(&[*point], 0, &mut found);
        found[0]
    }

    /// Returns the point of a stored simplex with these weights.
    fn foot(&self, stored: usize, weights: &[f64; D]) -> [f64; D] {
        let corners = self.tree.corners(stored);
        let mut foot = corners[0];
        for k in 1..D {
            foot = add_scaled(&foot, weights[k], &sub(&corners[k], &corners[0]));
        }
        foot
    }

    /// Returns whether a point lies inside, by the normal of what is nearest to it.
    fn is_inside(&self, point: &[f64; D], found: Found) -> Option<bool> {
        let weights = self.tree.closest(found.stored, point).weights;
        let offset = sub(point, &self.foot(found.stored, &weights));
        self.normals.is_inside(found.stored, &weights, &offset)
    }

    /// Returns the side of a point whose nearest simplex does not tell it, by points about it that are
    /// nearer to it than the contour, and so on its side. The winding number, which tells it always,
    /// visits all simplices.
    fn is_inside_nearby(&self, point: &[f64; D], distance: f64) -> Option<bool> {
        (0..2 * D).find_map(|way| {
            let mut near = *point;
            near[way / 2] += NEARBY * distance * [1.0, -1.0][way % 2];
            self.is_inside(&near, self.find(&near))
        })
    }

    fn signed(&self, point: &[f64; D], found: Found) -> f64 {
        let inside = self
            .is_inside(point, found)
            .or_else(|| self.is_inside_nearby(point, found.distance))
            .unwrap_or_else(|| winding_number(self.tree.all_corners(), point) > 0.5);
        if inside {
            found.distance
        } else {
            -found.distance
        }
    }
}

compiled_once! {
    /// A contour with what queries need.
    fn prepare<'a, D>(
        contour: &'a Contour<D>,
    ) -> Result<ContourDistance<D>, LevelsetError> = ContourDistance::new_in;
}

compiled_once! {
    /// The signed distance of a point.
    fn signed_at<'a, D>(contour: &'a ContourDistance<D>, point: &'a [f64; D]) -> f64 = ContourDistance::signed_distance_in;
}

compiled_once! {
    /// The signed distances of points.
    fn signed_at_all<'a, D>(
        contour: &'a ContourDistance<D>,
        points: &'a [[f64; D]],
    ) -> Vec<f64> = ContourDistance::signed_distances_in;
}

compiled_once! {
    /// The signed distances of all nodes.
    fn sample<'a, D>(
        contour: &'a ContourDistance<D>,
        grid: Grid<D>,
    ) -> Field<f64, D, 1> = ContourDistance::sample_in;
}

pub(crate) fn tree_of<const D: usize>(contour: &Contour<D>) -> Result<Bvh<D>, LevelsetError> {
    if contour.is_empty() {
        return Err(LevelsetError::EmptyContour);
    }
    let simplices: Vec<_> = contour.all_corners().collect();
    Ok(Bvh::new(&simplices))
}

/// Fills a field, in parallel: nodes are processed in small boxes of [`PACKET`] nodes, each of
/// which starts from the nearest simplex of the preceding box.
fn for_each_node<const D: usize>(
    tree: &Bvh<D>,
    field: &mut Field<f64, D, 1>,
    value: impl Fn(usize, &[f64; D], Found) -> f64 + Sync,
) {
    let grid = *field.grid();
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    // 4 x 4 nodes in the plane, 4 x 2 x 2 in space.
    let sides: [usize; D] = std::array::from_fn(|k| if k == 0 || D == 2 { 4 } else { 2 });
    let boxes: [usize; D] = std::array::from_fn(|k| nodes[k].div_ceil(sides[k]));
    let n_boxes = boxes[..D - 1].iter().product();
    let thickness = sides[D - 1] * strides[D - 1];
    parallel::for_each_chunk(field.as_mut_slice(), thickness, 1, &|layer, values| {
        let mut points = [[0.0; D]; PACKET];
        let mut indices = [0; PACKET];
        let mut found = [Found::default(); PACKET];
        let mut guess = 0;
        for number in 0..n_boxes {
            let first: [usize; D] = std::array::from_fn(|k| {
                let before: usize = boxes[..k].iter().product();
                let position = if k == D - 1 {
                    layer
                } else {
                    number / before % boxes[k]
                };
                position * sides[k]
            });
            let mut n_points = 0;
            for inner in 0..PACKET {
                let node: [usize; D] = std::array::from_fn(|k| {
                    let before: usize = sides[..k].iter().product();
                    first[k] + inner / before % sides[k]
                });
                if (0..D).all(|k| node[k] < nodes[k]) {
                    points[n_points] = grid.position(node);
                    indices[n_points] = grid.node_index(node);
                    n_points += 1;
                }
            }
            tree.nearest(&points[..n_points], guess, &mut found[..n_points]);
            guess = found[0].stored;
            for i in 0..n_points {
                values[indices[i] - layer * thickness] = value(indices[i], &points[i], found[i]);
            }
        }
    });
}
