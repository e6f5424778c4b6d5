//! Properties of single shapes that make results doubtful: contact with the border, specks, and
//! parts and gaps that a grid does not resolve.

use fe_grid::{Field, Grid, compiled_once};

use crate::components::{Adjacency, components};
use crate::contour::Contour;
use crate::error::LevelsetError;
use crate::facing::facing;

/// Size of a speck relative to the largest component: smaller ones are specks.
const SPECK: f64 = 0.02;
/// Radius of the smallest ball in a part that is resolved, in spacings: half of three cells.
const RADIUS: f64 = 1.5;
/// Distance from a ball up to which a node belongs to it, in spacings: balls are known about nodes
/// only, and the edges of a cuboid are up to .6 spacings away from a ball of this radius.
const TOLERANCE: f64 = 0.5;
/// Steps from a node near the boundary to the nodes about which balls are sought, along every axis:
/// more than `RADIUS + TOLERANCE` and the half diagonal of a cell.
const STEPS: usize = 3;

/// The share of the outermost layer of nodes that lies in the object `{field > level}`: 0 for an
/// object that does not touch the border of the box, 1 for one that surrounds the rest of it.
pub fn border_share<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> f64 {
    let values = field.as_slice();
    border_share_of(field.grid(), &|index| values[index] > level)
}

/// The same for the object of the nodes inside.
pub fn border_share_of<const D: usize>(grid: &Grid<D>, inside: &dyn Fn(usize) -> bool) -> f64 {
    let (mut object, mut all) = (0usize, 0usize);
    for index in (0..grid.n_nodes()).filter(|index| on_border(grid, *index)) {
        all += 1;
        object += usize::from(inside(index));
    }
    object as f64 / all as f64
}

pub(crate) fn on_border<const D: usize>(grid: &Grid<D>, index: usize) -> bool {
    let (node, n_nodes) = (grid.node(index), grid.nodes_per_axis());
    (0..D).any(|k| node[k] == 0 || node[k] + 1 == n_nodes[k])
}

/// The number of components of the object `{field > level}` with less than a fiftieth of the nodes
/// of the largest one. Nodes that touch by a corner are connected.
pub fn specks<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> usize {
    let values = field.as_slice();
    specks_of(field.grid(), &|index| values[index] > level)
}

/// The same for the object of the nodes inside.
pub fn specks_of<const D: usize>(grid: &Grid<D>, inside: &dyn Fn(usize) -> bool) -> usize {
    let sizes = components(grid, inside, Adjacency::Corners).sizes;
    let largest = sizes.iter().copied().max().unwrap_or(0) as f64;
    let small = |&&size: &&usize| (size as f64) < SPECK * largest;
    sizes.iter().filter(small).count()
}

compiled_once! {
    /// The share of an object, given by its signed distances (positive inside), that lies in parts
    /// thinner than three cells of the grid: the nodes inside that are not in the ball about any
    /// node whose distance from the boundary is 1.5 spacings or more, up to half a spacing. This is
    /// a morphological opening, computed from the distances. It is 0 for an empty object.
    ///
    /// Parts of less than three cells are always counted. As depths are known at nodes only, parts
    /// of three to four and a half cells (in 3D, five and a half) are counted or not depending on
    /// their position.
    pub fn thin_share<'a, D>(distance: &'a Field<f64, D, 1>) -> f64 = thin_share_in;
}

fn thin_share_in<const D: usize>(distance: &Field<f64, D, 1>) -> f64 {
    let (grid, values) = (distance.grid(), distance.as_slice());
    let inside = values.iter().filter(|&&d| d > 0.0).count();
    let shallow = 0.0..RADIUS * grid.spacing();
    let thin = (0..values.len()).filter(|&index| {
        let d = values[index];
        d > 0.0 && shallow.contains(&d) && !in_a_ball(distance, grid.node(index))
    });
    thin.count() as f64 / inside.max(1) as f64
}

compiled_once! {
    /// The share of a closed boundary that faces itself across a gap of the outside narrower than
    /// `width`, as the fingers of a closed hand do. Segments and triangles longer than the width are
    /// divided first, so that the share hardly depends on how the boundary is cut into pieces.
    ///
    /// # Errors
    /// Those of [`facing`].
    pub fn narrow_gap_share<'a, D>(
        contour: &'a Contour<D>,
        width: f64,
    ) -> Result<f64, LevelsetError> = narrow_gap_share_in;
}

fn narrow_gap_share_in<const D: usize>(
    contour: &Contour<D>,
    width: f64,
) -> Result<f64, LevelsetError> {
    let fine = contour.refined(width);
    let found = facing(&fine, width)?;
    let narrow = |i: &usize| found[*i].slit.is_some();
    let gaps = (0..found.len()).filter(narrow);
    // From zero: an empty sum is minus zero.
    Ok(gaps.fold(0.0, |sum, i| sum + fine.size(i)) / fine.perimeter())
}

/// Whether a node lies in a ball of at least the radius about a node nearby, inside the object.
fn in_a_ball<const D: usize>(distance: &Field<f64, D, 1>, node: [usize; D]) -> bool {
    let (grid, h) = (distance.grid(), distance.grid().spacing());
    let (n_nodes, side) = (grid.nodes_per_axis(), 2 * STEPS + 1);
    (0..side.pow(D as u32)).any(|mut number| {
        let (mut centre, mut square) = (node, 0);
        for k in 0..D {
            let Some(i) = (node[k] + number % side).checked_sub(STEPS) else {
                return false;
            };
            if i >= n_nodes[k] {
                return false;
            }
            centre[k] = i;
            square += i.abs_diff(node[k]).pow(2);
            number /= side;
        }
        let radius = distance.as_slice()[grid.node_index(centre)];
        radius >= RADIUS * h && (square as f64).sqrt() * h <= radius + TOLERANCE * h
    })
}
