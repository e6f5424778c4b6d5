//! Connected components of an object.

use fe_grid::{Field, Grid, compiled_once, mutant};

use crate::error::LevelsetError;

/// The components of an object: sets of nodes connected by edges of the grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Label of the component of each node, counted from 1 by first node; 0 is background.
    pub labels: Vec<u32>,
    /// Number of nodes of each component.
    pub sizes: Vec<usize>,
}

/// The components of the object `{field > level}`. Nodes that touch by a corner only stay
/// apart, as they do in the contour of a mask.
pub fn connected_components<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> Components {
    let adjacency = mutant!(Adjacency::Edges, ComponentsByCorners => Adjacency::Corners);
    let values = field.as_slice();
    components(field.grid(), &|index| values[index] > level, adjacency)
}

/// Which nodes are neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Adjacency {
    /// Both ends of an edge of the grid.
    Edges,
    /// All corners of a cell.
    Corners,
}

compiled_once! {
    /// The components of the object, the nodes inside, for this adjacency.
    pub(crate) fn components<'a, D>(
        grid: &'a Grid<D>,
        inside: &'a dyn Fn(usize) -> bool,
        adjacency: Adjacency,
    ) -> Components = components_in;
}

fn components_in<const D: usize>(
    grid: &Grid<D>,
    inside: &dyn Fn(usize) -> bool,
    adjacency: Adjacency,
) -> Components {
    let offsets = offsets::<D>(adjacency);
    let mut labels = vec![0u32; grid.n_nodes()];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for first in 0..labels.len() {
        if labels[first] != 0 || !inside(first) {
            continue;
        }
        let label = sizes.len() as u32 + 1;
        let mut size = 0;
        labels[first] = label;
        stack.push(first);
        while let Some(index) = stack.pop() {
            size += 1;
            let node = grid.node(index);
            for next in offsets
                .iter()
                .filter_map(|offset| neighbour(grid, node, offset))
            {
                if labels[next] == 0 && inside(next) {
                    labels[next] = label;
                    stack.push(next);
                }
            }
        }
        sizes.push(size);
    }
    Components { labels, sizes }
}

/// The steps from a node to its neighbours.
fn offsets<const D: usize>(adjacency: Adjacency) -> Vec<[isize; D]> {
    let digit = |number: usize, k: usize| (number / 3usize.pow(k as u32) % 3) as isize - 1;
    let all = (0..3usize.pow(D as u32)).map(|number| std::array::from_fn(|k| digit(number, k)));
    let axes = |offset: &[isize; D]| offset.iter().filter(|&&step| step != 0).count();
    let most = match adjacency {
        Adjacency::Edges => 1,
        Adjacency::Corners => D,
    };
    all.filter(|offset| (1..=most).contains(&axes(offset)))
        .collect()
}

/// The node one step away, unless it lies outside the grid.
fn neighbour<const D: usize>(
    grid: &Grid<D>,
    node: [usize; D],
    offset: &[isize; D],
) -> Option<usize> {
    let n_nodes = grid.nodes_per_axis();
    let mut next = node;
    for k in 0..D {
        next[k] = node[k].checked_add_signed(offset[k])?;
        if next[k] >= n_nodes[k] {
            return None;
        }
    }
    Some(grid.node_index(next))
}

/// Returns the mask, 1 inside and 0 outside, of the largest component of `{field > level}`; of
/// equally large ones the first.
///
/// # Errors
/// [`LevelsetError::EmptyObject`].
pub fn largest_component<const D: usize>(
    field: &Field<f64, D, 1>,
    level: f64,
) -> Result<Field<f64, D, 1>, LevelsetError> {
    let Components { labels, sizes } = connected_components(field, level);
    let largest = (0..sizes.len()).rev().max_by_key(|&i| sizes[i]);
    let Some(largest) = largest else {
        return Err(LevelsetError::EmptyObject { level });
    };
    let chosen = largest as u32 + 1;
    let mask = labels.iter().map(|&l| f64::from(u8::from(l == chosen)));
    Ok(Field::from_vec(*field.grid(), mask.collect())?)
}
