//! Where a boundary faces itself: slits of the outside, and films of the inside.
//!
//! A deformation keeps the topology of a shape. Where the shape should merge or split, the deformed
//! boundary is pressed together instead: parts that should become one are left with a slit between
//! them, a part that should break remains connected by a film. Both have two sides with opposite
//! normals and almost no volume.

use fe_grid::compiled_once;

use crate::contour::{Contour, centroid};
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

/// Which pieces of a boundary a piece faces: indices in the contour of segments or triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facing {
    /// The one on the other side of a slit.
    pub slit: Option<usize>,
    /// The one on the other side of a film.
    pub film: Option<usize>,
}

impl Facing {
    /// Returns the piece on the other side of a layer.
    pub fn across(self, layer: Layer) -> Option<usize> {
        match layer {
            Layer::Slit => self.slit,
            Layer::Film => self.film,
        }
    }
}

/// Largest cosine between the normals of two sides that face each other: 120 degrees or more apart.
const OPPOSITE: f64 = -0.5;
/// Distances at which the other side is looked for, in widths. Behind the side of a narrow layer there may be
/// further ones, which are nearer to a point far ahead.
const AHEAD: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
/// A point ahead to which nothing is nearer than this share of the way has nothing but its own side around it.
const OWN: f64 = 1.0 - 1e-6;

compiled_once! {
    /// For every segment or triangle of a closed boundary: others with the opposite normal that lie
    /// within `width` across the outside ([`Layer::Slit`]) and across the inside ([`Layer::Film`]), if there
    /// are any.
    ///
    /// The other one is the nearest to a point ahead of the centroid, or behind it: half the width, or a half, a
    /// fourth or an eighth of that where there are several layers. Pieces longer than the width should be divided
    /// before ([`Contour::refined`]): only what their centroid faces is found.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyContour`]; [`LevelsetError::Parameter`] unless the width is positive and finite.
    pub fn facing<'a, D>(
        contour: &'a Contour<D>,
        width: f64,
    ) -> Result<Vec<Facing>, LevelsetError> = facing_in;
}

fn facing_in<const D: usize>(
    contour: &Contour<D>,
    width: f64,
) -> Result<Vec<Facing>, LevelsetError> {
    if !(width > 0.0 && width.is_finite()) {
        let (name, value) = ("width", width);
        return Err(LevelsetError::Parameter { name, value });
    }
    let distance = ContourDistance::new(contour)?;
    let all: Vec<[[f64; D]; D]> = contour.all_corners().collect();
    let of_simplex = |corners: &[[f64; D]; D]| {
        let area = area_normal(corners);
        let size = norm(&area);
        // A degenerate simplex has no sides.
        if size == 0.0 {
            return Facing::default();
        }
        let normal = area.map(|x| x / size);
        let centre = centroid(corners);
        let across = |direction: f64| {
            for share in AHEAD {
                let way = share * width;
                let ahead = add_scaled(&centre, direction * way, &normal);
                let found = distance.nearest(ahead);
                if norm(&sub(&found.point, &ahead)) > OWN * way {
                    return None;
                }
                let other = area_normal(&all[found.simplex]);
                let close = norm(&sub(&found.point, &centre)) <= width;
                let opposite = dot(&other, &normal) <= OPPOSITE * norm(&other);
                if close && opposite {
                    return Some(found.simplex);
                }
            }
            None
        };
        Facing {
            slit: across(1.0),
            film: across(-1.0),
        }
    };
    Ok(all.iter().map(of_simplex).collect())
}
