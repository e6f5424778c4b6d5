//! Where and when a path merges or splits parts.

use crate::arrival::{Pressed, WIDTH};
use levelset::{Contour, Facing, Layer, LevelsetError, facing};
use serde::Serialize;
use std::collections::HashMap;

/// What happens to the topology of the shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// Two parts of the boundary meet: separate parts become one, or an opening is closed.
    Merge,
    /// A layer of material vanishes: a part breaks, or an opening forms.
    Split,
}

/// A part of the boundary that is pressed together by a path: a change of topology, which a
/// deformation cannot carry out.
///
/// The two sides of a slit inside the shape at the other end would merge; the layer between the two
/// sides of a film outside of it would vanish.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// Seen from the start to the end.
    pub change: Change,
    /// The shape, of `0, ..., K`, from which on parts are merged or separate.
    pub step: usize,
    /// Its middle in that shape, in the unit box.
    pub centre: Vec<f64>,
    /// Length or area, of both sides together, in powers of the spacing.
    pub size: f64,
}

/// Slits and films with a smaller size than this, in powers of the spacing, are sharp notches and corners: a
/// slit has two sides, each of at least two spacings.
const LEAST_SIZE: f64 = 4.0;

/// Collects the pieces of the carried boundary that belong to slits or films into contacts.
///
/// `pressed` has for each segment or triangle what it faces at the other end, if it belongs to a slit
/// or film; `carried` has the boundary in all shapes up to that end, which is that of the path or its start.
pub(crate) fn contacts<const D: usize>(
    pressed: &[Option<Pressed>],
    carried: &[Contour<D>],
    at_end: bool,
    spacing: f64,
) -> Result<Vec<Contact>, LevelsetError> {
    let Some(last) = carried.last() else {
        return Ok(Vec::new());
    };
    let faced: Vec<Vec<Facing>> = carried[..carried.len() - 1]
        .iter()
        .map(|contour| facing(contour, WIDTH * spacing))
        .collect::<Result<_, _>>()?;
    let mut found = Vec::new();
    for group in groups(pressed, last) {
        let area = |i: &usize| last.size(*i);
        let total: f64 = group.iter().map(area).sum();
        let size = total / spacing.powi(D as i32 - 1);
        if size < LEAST_SIZE {
            continue;
        }
        let Some(layer) = pressed[group[0]].map(|f| f.layer) else {
            continue;
        };
        // The first shape from which on most of it is closed.
        let closed = |shape: &Vec<Facing>| {
            let same = group.iter().filter(|&&i| shape[i].across(layer).is_some());
            2.0 * same.map(area).sum::<f64>() >= total
        };
        let open_until = faced.iter().rposition(|shape| !closed(shape));
        let shape = open_until.map_or(0, |k| k + 1);
        let middle = |k: usize| {
            let weighted = group.iter().map(|i| {
                let corners = carried[shape].corners(*i);
                area(i) * corners.iter().map(|p| p[k]).sum::<f64>() / D as f64
            });
            weighted.sum::<f64>() / total
        };
        // In reverse, what was pressed together opens.
        let merges = (layer == Layer::Slit) == at_end;
        found.push(Contact {
            change: if merges { Change::Merge } else { Change::Split },
            step: if at_end {
                shape
            } else {
                carried.len() - 1 - shape
            },
            centre: (0..D).map(middle).collect(),
            size,
        });
    }
    found.sort_by(|a, b| b.size.total_cmp(&a.size));
    Ok(found)
}

/// Groups the pieces of slits and films that share points or face each other.
fn groups<const D: usize>(pressed: &[Option<Pressed>], contour: &Contour<D>) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..pressed.len()).collect();
    let mut of_point: HashMap<u32, usize> = HashMap::new();
    for (i, found) in pressed.iter().enumerate() {
        let Some(found) = found else { continue };
        let sharing = contour.simplices()[i].map(|point| *of_point.entry(point).or_insert(i));
        let across = pressed[found.other].map(|_| found.other);
        for neighbour in sharing.into_iter().chain(across) {
            let (a, b) = (root(&group, i), root(&group, neighbour));
            // The smallest index leads, whatever the order of the pieces.
            group[a.max(b)] = a.min(b);
        }
    }
    let mut found: Vec<Vec<usize>> = vec![Vec::new(); pressed.len()];
    for i in (0..pressed.len()).filter(|&i| pressed[i].is_some()) {
        found[root(&group, i)].push(i);
    }
    found.retain(|group| !group.is_empty());
    found
}

fn root(group: &[usize], mut i: usize) -> usize {
    while group[i] != i {
        i = group[i];
    }
    i
}
