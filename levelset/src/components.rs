//! Connected components of an object.

use fe_grid::{Field, compiled_once};

use crate::error::LevelsetError;

/// The components of an object: sets of nodes connected by edges of the grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Label of the component of each node, counted from 1 by first node; 0 is background.
    pub labels: Vec<u32>,
    /// Number of nodes of each component.
    pub sizes: Vec<usize>,
}

compiled_once! {
    /// The components of the object `{field > level}`. Nodes that touch by a corner only stay
    /// apart, as they do in the contour of a mask.
    pub fn connected_components<'a, D>(
        field: &'a Field<f64, D, 1>,
        level: f64,
    ) -> Components = connected_components_in;
}

fn connected_components_in<const D: usize>(field: &Field<f64, D, 1>, level: f64) -> Components {
    let grid = field.grid();
    let (n_nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let values = field.as_slice();
    let mut labels = vec![0u32; values.len()];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for first in 0..values.len() {
        if labels[first] != 0 || values[first].is_nan() || values[first] <= level {
            continue;
        }
        let label = sizes.len() as u32 + 1;
        let mut size = 0;
        labels[first] = label;
        stack.push(first);
        while let Some(index) = stack.pop() {
            size += 1;
            let node = grid.node(index);
            for k in 0..D {
                let below = (node[k] > 0).then(|| index - strides[k]);
                let above = (node[k] + 1 < n_nodes[k]).then(|| index + strides[k]);
                for next in below.into_iter().chain(above) {
                    if labels[next] == 0 && values[next] > level {
                        labels[next] = label;
                        stack.push(next);
                    }
                }
            }
        }
        sizes.push(size);
    }
    Components { labels, sizes }
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
