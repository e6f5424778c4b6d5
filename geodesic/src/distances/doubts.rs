//! The doubts about distances.

use super::lengths::Asymmetry;
use super::triangle::TriangleReport;
use levelset::{Cause, Doubt};

/// Returns the doubts about distances: lengths that depend on the direction, and violations of the
/// triangle inequality.
pub fn doubts(asymmetry: Option<&Asymmetry>, triangles: &TriangleReport) -> Vec<Doubt> {
    let asymmetry = asymmetry.and_then(|asymmetry| {
        let doubt = Doubt::check(Cause::Asymmetry, asymmetry.largest)?;
        Some(doubt.about(asymmetry.worst[0]))
    });
    let triangle = Doubt::check(Cause::TriangleInequality, triangles.worst).map(|doubt| {
        let longest = triangles.worst_triangle.map(|[end, ..]| end);
        longest.map_or(doubt, |shape| doubt.about(shape))
    });
    [asymmetry, triangle].into_iter().flatten().collect()
}
