//! Extension of displacements that are known at some of the nodes.

use fe_grid::vector::axpy;
use fe_grid::{Field, Grid, InverseDeformation};

/// Computes the displacement `sample(x, phi^{-1}(x))` at the nodes in the image of a deformation
/// `phi`, and extends it to the others.
pub(crate) fn through_inverse<const D: usize>(
    deformation: &Field<f64, D, D>,
    sample: impl Fn([f64; D]) -> [f64; D],
) -> Field<f64, D, D> {
    let grid = *deformation.grid();
    let n = grid.n_nodes();
    let inverse = InverseDeformation::new(deformation);
    let mut displacement = Field::zeros(grid);
    let mut known = vec![false; n];
    for node in 0..n {
        if let Some(x) = inverse.position(node) {
            let value = sample(x);
            for k in 0..D {
                displacement.component_mut(k)[node] = value[k];
            }
            known[node] = true;
        }
    }
    extend(&grid, &mut displacement, known);
    displacement
}

/// Returns the displacement from the image of a point under one deformation to that under another, with cubic
/// interpolation: multilinear interpolation takes a fifth of the energy of a step from an object of ten cells'
/// thickness.
pub(crate) fn change_between<const D: usize>(
    before: &Field<f64, D, D>,
    after: &Field<f64, D, D>,
) -> impl Fn([f64; D]) -> [f64; D] + use<D> {
    let mut change = after.clone();
    axpy(-1.0, before.as_slice(), change.as_mut_slice());
    move |x| change.sample_cubic(x)
}

/// Computes the displacement of the inverse of a deformation: `-u(phi^{-1}(x))`.
pub(crate) fn inverse_displacement<const D: usize>(u: &Field<f64, D, D>) -> Field<f64, D, D> {
    through_inverse(u, |x| u.sample(x).map(|value| -value))
}

/// Assigns to each unknown node the mean of its known neighbours, layer by layer.
fn extend<const D: usize>(grid: &Grid<D>, field: &mut Field<f64, D, D>, mut known: Vec<bool>) {
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut missing: Vec<usize> = (0..known.len()).filter(|&i| !known[i]).collect();
    while !missing.is_empty() && missing.len() < known.len() {
        let mut found = Vec::new();
        for &index in &missing {
            let node = grid.node(index);
            let mut neighbours = Vec::with_capacity(2 * D);
            for k in 0..D {
                if node[k] > 0 {
                    neighbours.push(index - strides[k]);
                }
                if node[k] + 1 < nodes[k] {
                    neighbours.push(index + strides[k]);
                }
            }
            neighbours.retain(|&i| known[i]);
            if !neighbours.is_empty() {
                let mut mean = [0.0; D];
                for &i in &neighbours {
                    let value = field.at(i);
                    for k in 0..D {
                        mean[k] += value[k] / neighbours.len() as f64;
                    }
                }
                found.push((index, mean));
            }
        }
        for (index, mean) in &found {
            for k in 0..D {
                field.component_mut(k)[*index] = mean[k];
            }
            known[*index] = true;
        }
        missing.retain(|&i| !known[i]);
    }
}
