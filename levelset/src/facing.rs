//! Where a boundary faces itself: slits of the outside, and films of the inside.
//!
//! A deformation keeps the topology of a shape. Where the shape should merge or split, the deformed
//! boundary is pressed together instead: parts that should become one are left with a slit between
//! them, a part that should break remains connected by a film. Both have two sides with opposite
//! normals and almost no volume.

use fe_grid::compiled_once;

use crate::contour::Contour;
use crate::distance::ContourDistance;
use crate::error::LevelsetError;
use crate::vector::{add_scaled, area_normal, dot, norm, sub};

/// What lies between two pieces of a boundary that face each other at a small distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layer {
    /// A layer of the outside.
    Slit,
    /// A layer of the inside.
    Film,
}

/// A piece of a boundary that faces another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// What lies between them.
    pub layer: Layer,
    /// Index in the contour of the segment or triangle on the other side.
    pub other: usize,
}

/// Largest cosine between the normals of two sides that face each other: 120 degrees or more apart.
const OPPOSITE: f64 = -0.5;

compiled_once! {
    /// For every segment or triangle of a closed boundary: another one with the opposite normal that
    /// lies within `width` across the outside ([`Layer::Slit`]) or across the inside
    /// ([`Layer::Film`]), if there is one. A slit is reported where there are both.
    ///
    /// The other one is the nearest to the point `width / 2` ahead of the centroid, or behind it.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyContour`].
    pub fn facing<'a, D>(
        contour: &'a Contour<D>,
        width: f64,
    ) -> Result<Vec<Option<Facing>>, LevelsetError> = facing_in;
}

fn facing_in<const D: usize>(
    contour: &Contour<D>,
    width: f64,
) -> Result<Vec<Option<Facing>>, LevelsetError> {
    let distance = ContourDistance::new(contour)?;
    let all: Vec<[[f64; D]; D]> = contour.all_corners().collect();
    let of_simplex = |corners: &[[f64; D]; D]| {
        let area = area_normal(corners);
        let size = norm(&area);
        // A degenerate simplex has no sides.
        if size == 0.0 {
            return None;
        }
        let normal = area.map(|x| x / size);
        let centre: [f64; D] =
            std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / D as f64);
        let across = |direction: f64| {
            let ahead = add_scaled(&centre, 0.5 * direction * width, &normal);
            let found = distance.nearest(ahead);
            let other = area_normal(&all[found.simplex]);
            let close = norm(&sub(&found.point, &centre)) <= width;
            let opposite = dot(&other, &normal) <= OPPOSITE * norm(&other);
            (close && opposite).then_some(found.simplex)
        };
        [(Layer::Slit, 1.0), (Layer::Film, -1.0)]
            .into_iter()
            .find_map(|(layer, direction)| {
                let other = across(direction)?;
                Some(Facing { layer, other })
            })
    };
    Ok(all.iter().map(of_simplex).collect())
}
