//! The coordinates and lengths in which what is found on the boundary is written.

use levelset::Contour;

use super::source::{Compared, Kind};
use crate::shapes::{ResultPlace, WorldFrame};

/// Millimetres in the world of the result, or the unit box where it has none.
pub(super) struct Units<const D: usize> {
    world: Option<WorldFrame<D>>,
    place: ResultPlace<D>,
}

impl<const D: usize> Compared<D> {
    /// The units of its boundary.
    pub(super) fn units(&self) -> Units<D> {
        let (world, place) = match &self.kind {
            Kind::Modes(stored, _) => (stored.average.world, stored.average.place),
            Kind::Distances(_) => (None, ResultPlace::UNIT_BOX),
        };
        Units {
            place: world.map_or(ResultPlace::UNIT_BOX, |_| place),
            world,
        }
    }
}

impl<const D: usize> Units<D> {
    /// The coordinates in which the boundary is written.
    pub fn place(&self) -> &ResultPlace<D> {
        &self.place
    }

    /// The boundary in these coordinates.
    pub fn placed(&self, boundary: &Contour<D>) -> Contour<D> {
        self.place.placed(boundary)
    }

    /// A length of the box.
    pub fn length(&self, of_box: f64) -> f64 {
        self.world.map_or(1.0, |world| world.length()) * of_box
    }

    /// The unit of lengths, to be read.
    pub fn name(&self) -> &'static str {
        match self.world {
            Some(_) => "mm",
            None => "unit box",
        }
    }

    /// The names of the columns of positions.
    pub fn axes(&self) -> impl Iterator<Item = String> + use<D> {
        let suffix = self.world.map_or("", |_| "_mm_RAS");
        let axes = ["x", "y", "z"].into_iter().take(D);
        axes.map(move |axis| format!("{axis}{suffix}"))
    }

    /// The name of a column of lengths.
    pub fn column(&self, name: &str) -> String {
        match self.world {
            Some(_) => format!("{name}_mm"),
            None => name.into(),
        }
    }
}
