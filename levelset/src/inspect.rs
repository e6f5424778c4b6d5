//! Properties of single shapes that make results doubtful: contact with the border, specks, and
//! parts that a grid does not resolve.

use fe_grid::{Field, Grid, compiled_once};

use crate::components::{Adjacency, components};
use crate::distance::signed_distance;
use crate::error::LevelsetError;

/// Size of a speck relative to the largest component: smaller ones are specks.
const SPECK: f64 = 0.02;
/// Radius of the ball of an opening, in spacings: it leaves parts of three cells and more.
const RADIUS: f64 = 1.5;
/// Tolerance of distances, in spacings: the contour of eroded shapes is piecewise linear. It also
/// keeps most of the nodes at right-angled corners, from which a ball of three cells is .6 spacings
/// away.
const TOLERANCE: f64 = 0.25;

/// The share of the outermost layer of nodes that lies in the object `{field > level}`: 0 for an
/// object that does not touch the border of the box, 1 for one that surrounds the rest of it.
pub fn border_share<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> f64 {
    let (mut inside, mut all) = (0usize, 0usize);
    for (index, &value) in field.as_slice().iter().enumerate() {
        if on_border(field.grid(), index) {
            all += 1;
            inside += usize::from(value > level);
        }
    }
    inside as f64 / all as f64
}

fn on_border<const D: usize>(grid: &Grid<D>, index: usize) -> bool {
    let (node, n_nodes) = (grid.node(index), grid.nodes_per_axis());
    (0..D).any(|k| node[k] == 0 || node[k] + 1 == n_nodes[k])
}

/// The number of components of the object `{field > level}` with less than a fiftieth of the nodes
/// of the largest one. Nodes that touch by a corner are connected.
pub fn specks<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> usize {
    let sizes = components(field, level, Adjacency::Corners).sizes;
    let largest = sizes.iter().copied().max().unwrap_or(0) as f64;
    let small = |&&size: &&usize| (size as f64) < SPECK * largest;
    sizes.iter().filter(small).count()
}

compiled_once! {
    /// The share of an object, given by its signed distances (positive inside), that lies in parts
    /// thinner than three cells of the grid: what a morphological opening with a ball of radius 1.5
    /// spacings removes, up to a quarter of a spacing.
    ///
    /// Parts of less than three cells are always counted. As depths are known at nodes only, parts
    /// of three to four cells are counted or not depending on their position; thicker ones are not.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyObject`], [`LevelsetError::FullObject`] and
    /// [`LevelsetError::NonFinite`].
    pub fn thin_share<'a, D>(
        distance: &'a Field<f64, D, 1>,
    ) -> Result<f64, LevelsetError> = thin_share_in;
}

fn thin_share_in<const D: usize>(distance: &Field<f64, D, 1>) -> Result<f64, LevelsetError> {
    let spacing = distance.grid().spacing();
    let values = distance.as_slice();
    let inside = values.iter().filter(|&&d| d > 0.0).count();
    if inside == 0 {
        return Err(LevelsetError::EmptyObject { level: 0.0 });
    }
    let to_eroded = match signed_distance(distance, RADIUS * spacing) {
        // No ball fits into any part.
        Err(LevelsetError::EmptyObject { .. }) => return Ok(1.0),
        found => found?,
    };
    let reach = -(RADIUS + TOLERANCE) * spacing;
    let removed = values.iter().zip(to_eroded.as_slice());
    let removed = removed.filter(|&(&d, &e)| d > 0.0 && e < reach).count();
    Ok(removed as f64 / inside as f64)
}
