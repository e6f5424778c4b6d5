//! The doubts about segmentations.

use super::solve::Segmentation;
use levelset::{Cause, Contour, Doubt, centroid};

/// Where the phase field is above this value there is no edge: at distances of `2 eps ln 4` and more from it. A
/// region between edges ends where it is one half.
const NO_EDGE: f64 = 0.75;

impl<const D: usize> Segmentation<D> {
    /// Returns the doubts about a segmentation: levels that ended before they converged.
    pub fn doubts(&self) -> Vec<Doubt> {
        let ended = self.levels.iter().filter(|level| !level.status.converged());
        let doubt = Doubt::check(Cause::NotConverged, ended.count() as f64);
        doubt.into_iter().collect()
    }

    /// The share of the boundary of an object, by its size, that does not lie on an edge: where the phase
    /// field is above 3/4 at the centre of a segment or triangle. Those on the faces of the box, which close the
    /// boundary, are left out; 0 where there are no others.
    pub fn off_edges(&self, boundary: &Contour<D>) -> f64 {
        let extent = self.phase_field.grid().extent();
        let least = 1e-6 * self.phase_field.grid().spacing();
        let (mut all, mut off) = (0.0, 0.0);
        for (piece, corners) in boundary.all_corners().enumerate() {
            let on_a_face = |k: usize, face: f64| {
                corners
                    .iter()
                    .all(|corner| (corner[k] - face).abs() < least)
            };
            if (0..D).any(|k| on_a_face(k, 0.0) || on_a_face(k, extent[k])) {
                continue;
            }
            let size = boundary.size(piece);
            all += size;
            if self.phase_field.sample(centroid(&corners))[0] > NO_EDGE {
                off += size;
            }
        }
        if all > 0.0 { off / all } else { 0.0 }
    }
}
