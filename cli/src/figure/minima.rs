//! Minima of an average that several starts lead to.

use fe_grid::minimise::Status;
use levelset::Contour;
use shape_average::{AverageResult, Minima, Start, average_from, doubts_of_minima, starts};
use shapespace_picture::colour;
use shapespace_report::table::{Cell, Table};

use super::scene::{Scene, outline};
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;
use crate::report::word;

/// Number of starts.
const STARTS: usize = 4;
/// Points of the line from the middle of a shape to its tip.
const POINTS: usize = 40;

/// Averages from several starts, a tile for each different minimum.
pub(super) fn minima<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let shapes = &scene.distances;
    let params = scene.params.clone();
    let grids = scene.grid().hierarchy(params.coarsest_nodes);
    let mut found = Minima::new(&params);
    let (mut results, mut kinds) = (Vec::new(), Vec::new());
    for (i, start) in starts(shapes, &params, STARTS)?.into_iter().enumerate() {
        let Start {
            kind,
            displacements,
            ..
        } = start;
        let kind = word(&kind);
        let progress = &scene.session.progress;
        progress.note(format!("start {} of {STARTS} ({kind}):", i + 1));
        let mut checkpointer = scene.checkpointer.borrow_mut();
        let mut watch = checkpointer.observe(scene.session.observer(&grids));
        let result = average_from(shapes, &[], &displacements, &params, &mut watch)?;
        watch.finish();
        let status = result.levels.last().map(|level| level.status);
        if status == Some(Status::Cancelled) || scene.session.interrupt.asked() {
            return Err(CliError::Stopped);
        }
        kinds.push(kind);
        results.push(result.clone());
        found.add(result)?;
    }
    let (lowest, minima) = found
        .finish()?
        .ok_or(shape_average::AverageError::NoShapes)?;
    scene.doubts.borrow_mut().extend(lowest.doubts(&params));
    scene.doubts.borrow_mut().extend(doubts_of_minima(&minima));
    let mut table = Table::new([
        "minimum",
        "energy",
        "elastic energy",
        "excess",
        "least eigenvalue",
        "average",
        "points",
        "starts",
    ]);
    let mut tiles = Tiles::new(&scene.grid(), minima.len().min(3) + 1);
    tiles.shapes("shapes", shapes, 0.0);
    for (place, minimum) in minima.iter().enumerate() {
        let average = match (place, minimum.other_shape) {
            (0, _) => "lowest",
            (_, true) => "other",
            (_, false) => "same",
        };
        let eigenvalue = minimum.least_eigenvalue.map(|found| found.value);
        let from = minimum.starts.iter();
        let from: Vec<String> = from.map(|k| format!("{k} ({})", kinds[k - 1])).collect();
        table.row([
            Cell::from(place + 1),
            minimum.energy.into(),
            minimum.elastic.into(),
            minimum.excess.into(),
            eigenvalue.map_or_else(|| None::<String>.into(), Cell::from),
            average.into(),
            minimum.state_distance.into(),
            from.join(", ").into(),
        ]);
        // A minimum of some start is that of its first.
        if let Some(result) = minimum.starts.first().map(|k| &results[k - 1]) {
            let value = eigenvalue.map_or("unknown".to_owned(), |value| format!("{value:.3}"));
            let label = format!(
                "{}: energy {:.5}, least eigenvalue {value}",
                place + 1,
                minimum.energy
            );
            tiles.push(&label, tile(&tiles, scene, result)?);
        }
    }
    Ok(Sheet {
        title: "Minima of one average",
        text: format!(
            "Minimisations from {STARTS} starts, as by `shapespace average --starts {STARTS}`. The excess is \
             the energy above the lowest, relative to the elastic energy of the lowest; the least \
             eigenvalue is that of the Hessian without rigid motions of all shapes together; `points` is \
             how far the points of the objects are apart from where the lowest minimum has them, relative to the size of the \
             average. The lines in the pictures run from the middle of a shape to its farthest point, \
             deformed with the shape: minima of one average may identify other points. A smaller --tolerance \
             may lead from a state in which a minimisation has become slow to another minimum."
        ),
        table,
        picture: tiles.draw(),
    })
}

/// An average, and the deformed line of each shape from its middle to its tip.
fn tile<const D: usize>(
    tiles: &Tiles<D>,
    scene: &Scene<'_, D>,
    result: &AverageResult<D>,
) -> Result<shapespace_picture::Canvas, CliError> {
    let mut tile = tiles.averaged(result);
    for (i, displacement) in result.displacements.iter().enumerate() {
        let own = levelset::contour(&scene.distances[i], 0.0, levelset::BoxEdge::Closed);
        let own = own?;
        let [middle, tip] = spoke(&own);
        let line: Vec<[f64; D]> = (0..POINTS)
            .map(|k| {
                let t = k as f64 / (POINTS - 1) as f64;
                displacement.image(std::array::from_fn(|c| {
                    middle[c] + t * (tip[c] - middle[c])
                }))
            })
            .collect();
        tiles.slice.line(&mut tile, &line, 2.2, colour(i));
    }
    // The boundary is drawn last.
    let boundary = outline(result)?;
    tiles
        .slice
        .outline(&mut tile, &boundary, 1.4, shapespace_picture::INK);
    Ok(tile)
}

/// The middle of the points of a boundary, and the point that is farthest from it.
fn spoke<const D: usize>(boundary: &Contour<D>) -> [[f64; D]; 2] {
    let points = boundary.points();
    let n = points.len().max(1) as f64;
    let middle: [f64; D] = std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let away = |p: &[f64; D]| -> f64 { p.iter().zip(&middle).map(|(a, b)| (a - b).powi(2)).sum() };
    let farther = |a: [f64; D], b: &[f64; D]| if away(b) > away(&a) { *b } else { a };
    [middle, points.iter().fold(middle, farther)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spoke_ends_at_the_farthest_point() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [3.0, 2.0], [0.0, 2.0]];
        let boundary = Contour::new(points, vec![[0, 1], [1, 2], [2, 3], [3, 0]]).unwrap();
        assert_eq!(spoke(&boundary), [[1.0, 1.0], [3.0, 2.0]]);
    }
}
