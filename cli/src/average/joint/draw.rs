//! `average.png`: above, the average image, its edges, and the mean of the undeformed images; then
//! a row for each image, with its edges, the grid that its deformation makes of a regular one, and
//! how that strains it. Volumes are shown by the plane through the middle.

use fe_grid::{Field, Grid};
use shape_average::StrainMaps;

use super::Outcome;
use shapespace_picture::{Canvas, INK, Slice, TileRows, colour, heat, pale};

const COLUMNS: usize = 4;
/// Lines of the regular grid along the longest side.
const LINES: usize = 17;

/// The picture.
pub(super) fn picture<const D: usize>(outcome: &Outcome<D>, maps: &[StrainMaps]) -> Canvas {
    let result = &outcome.result;
    // An interrupted run ends on a coarser grid of the same box.
    let slice = Slice::middle(outcome.nodal[0].grid(), TileRows::width(COLUMNS));
    let mut rows = TileRows::new(COLUMNS);
    rows.push("average image", slice.grey(&result.average_image));
    rows.push("its edges", slice.grey(&result.average));
    let n = outcome.nodal.len() as f64;
    let mean = |x: [f64; D]| outcome.nodal.iter().map(|f| f.sample(x)[0]).sum::<f64>() / n;
    let plain = slice.painted(|x| [mean(x).clamp(0.0, 1.0) as f32; 3]);
    rows.push("mean without deformation", plain);
    rows.end_row();
    let norms = range(maps.iter().map(|m| &m.norm));
    let determinants = range(maps.iter().map(|m| &m.determinant));
    for (i, image) in outcome.images.iter().enumerate() {
        let mut edges = slice.painted(|x| pale(outcome.nodal[i].sample(x)[0]));
        slice.mark(&mut edges, &result.phase_fields[i], colour(1));
        rows.push(image.name.as_str(), edges);
        let mut deformed = slice.painted(|x| pale(result.pushed[i].sample(x)[0]));
        for line in grid_lines(&result.displacements[i]) {
            slice.line(&mut deformed, &line, 0.8, INK);
        }
        rows.push("deformed", deformed);
        let grid = result.displacements[i].grid();
        let map = |values: &[f64], [low, high]: [f64; 2]| {
            let width = f64::max(high - low, f64::MIN_POSITIVE);
            slice.painted(|x| heat((values[cell(grid, x)] - low) / width))
        };
        let label = |what: &str, [low, high]: [f64; 2]| format!("{what}: {low:.2} to {high:.2}");
        rows.push(label("norm of Dphi", norms), map(&maps[i].norm, norms));
        let tile = map(&maps[i].determinant, determinants);
        rows.push(label("det Dphi", determinants), tile);
    }
    rows.draw()
}

/// The least and the largest of all numbers.
fn range<'a>(maps: impl Iterator<Item = &'a Vec<f64>>) -> [f64; 2] {
    maps.flatten()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| {
            [low.min(v), high.max(v)]
        })
}

/// The cell of a point.
fn cell<const D: usize>(grid: &Grid<D>, x: [f64; D]) -> usize {
    grid.cell_index(fe_grid::locate(grid, x).0)
}

/// Lines of a regular grid in the middle plane, deformed.
fn grid_lines<const D: usize>(displacement: &Field<f64, D, D>) -> Vec<Vec<[f64; D]>> {
    let extent = displacement.grid().extent();
    let pitch = extent.iter().fold(0.0f64, |a, b| a.max(*b)) / (LINES - 1) as f64;
    let mut middle = extent.map(|side| 0.5 * side);
    let mut lines = Vec::new();
    for along in 0..2 {
        let across = 1 - along;
        let count = (extent[across] / pitch + 1e-9) as usize + 1;
        for k in 0..count {
            const PIECES: usize = 96;
            let points = (0..=PIECES).map(|piece| {
                middle[across] = k as f64 * pitch;
                middle[along] = extent[along] * piece as f64 / PIECES as f64;
                displacement.image(middle)
            });
            lines.push(points.collect());
            middle = extent.map(|side| 0.5 * side);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_undeformed_grid_is_regular() {
        let grid = Grid::<2>::with_nodes([33, 17], 1.0 / 32.0).unwrap();
        let lines = grid_lines(&Field::zeros(grid));
        // Nine lines across the shorter side, seventeen across the longer one.
        assert_eq!(lines.len(), 9 + 17);
        assert!(lines.iter().flatten().all(|p| p[0] <= 1.0 && p[1] <= 0.5));
        assert_eq!(cell(&grid, [1.0, 0.5]), grid.n_cells() - 1);
    }
}
