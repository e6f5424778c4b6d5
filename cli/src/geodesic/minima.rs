//! `shapespace geodesic --starts`: minimisations from several starts, and the paths that they end in.

use ::geodesic::{
    Geodesic, GeodesicError, GeodesicParams, PathMinima, PathMinimum, Shape, doubts_of_minima,
    geodesic_between, geodesic_from, stable_path,
};
use fe_grid::minimise::Status;
use fe_grid::{Field, Grid, ScalarField};
use shape_average::{AverageParams, Start, starts};

use crate::checkpoint::Checkpointer;
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::session::Session;
use crate::starts::{Found, Run, curvature, from_each, numbers, rounded};
use crate::summary::Summary;
use levelset::Doubt;

/// The minimal paths that were found, the shortest that arrives first.
pub(super) type FoundPaths = Found<PathMinimum>;

/// Both ends of a path.
pub(super) struct Ends<'a, const D: usize> {
    pub shapes: [&'a Shape<D>; 2],
    pub distances: [&'a ScalarField<f64, D>; 2],
}

/// Minimises from `n` starts; the first is the usual one. Returns the best path with its history.
///
/// # Errors
/// Those of the alignment, of paths and of checkpoints.
pub(super) fn shortest_of<const D: usize>(
    n: usize,
    ends: &Ends<'_, D>,
    params: &GeodesicParams,
    grids: &[Grid<D>],
    checkpointer: &mut Checkpointer<'_>,
    session: &Session<'_>,
) -> Result<(Geodesic<D>, Vec<HistoryPoint>, FoundPaths), CliError> {
    let [start, end] = ends.distances;
    // Poses are those that carry the start shape onto the end shape.
    let like_averages = AverageParams {
        coarsest_nodes: params.coarsest_nodes,
        ..AverageParams::default()
    };
    let all = starts(&[end.clone(), start.clone()], &like_averages, n)?;
    let centre = centre_of(start);
    let mut minima = PathMinima::new();
    let [from, to] = ends.shapes;
    let (found, history) = from_each(
        all,
        grids,
        checkpointer,
        session,
        &|first, watch| {
            let path = match deformations(&first, grids[0], params.steps, centre) {
                Some(first) => geodesic_from(from, to, &first, params, watch)?,
                None => geodesic_between(from, to, params, watch)?,
            };
            let result = stable_path(from, to, path, params, watch)?;
            // An interruption beside a saddle point leaves the path that had been found.
            let cancelled = result.path.status == Status::Cancelled || session.interrupt.asked();
            Ok(Run { result, cancelled })
        },
        &mut |path| Ok(minima.add(path)),
    )?;
    // There is at least one start.
    let (result, minima) = minima.finish().ok_or(GeodesicError::Given)?;
    Ok((result, history, found.with(minima)))
}

/// The displacements of all shapes from the first to the last of a path: parts of a motion, or shares of a
/// displacement; `None` for the usual start.
fn deformations<const D: usize>(
    start: &Start<D>,
    grid: Grid<D>,
    steps: usize,
    centre: [f64; D],
) -> Option<Vec<Field<f64, D, D>>> {
    let displacement = start.displacements.get(1)?;
    let motion = start.motions.get(1);
    let at = |k: usize| {
        let share = k as f64 / steps as f64;
        if let Some(motion) = motion {
            return motion.part(share, centre).displacement(grid);
        }
        let mut part = displacement.clone();
        for value in part.as_mut_slice() {
            *value *= share;
        }
        part
    };
    Some((1..=steps).map(at).collect())
}

/// The mean of the nodes inside of a shape.
fn centre_of<const D: usize>(distance: &ScalarField<f64, D>) -> [f64; D] {
    let grid = distance.grid();
    let (mut sum, mut count) = ([0.0; D], 0.0f64);
    for (node, _) in distance
        .as_slice()
        .iter()
        .enumerate()
        .filter(|(_, u)| **u > 0.0)
    {
        let x = grid.position(grid.node(node));
        for k in 0..D {
            sum[k] += x[k];
        }
        count += 1.0;
    }
    sum.map(|sum| sum / count.max(1.0))
}

/// The doubts about the paths, and about starts that are missing.
pub(super) fn doubts(found: &FoundPaths) -> Vec<Doubt> {
    found.doubts(doubts_of_minima)
}

/// Adds a table to a summary.
pub(super) fn add_paths(summary: &mut Summary, found: &FoundPaths) {
    let header = format!(
        "{:<13} {:<9} {:<11} {:<8} {:<9} {:<8} starts",
        "length", "excess", "curvature", "Dice", "arrives", "points"
    );
    found.add_to(summary, ["path", "paths"], header, |_, minimum| {
        let arrives = if minimum.end_reached { "yes" } else { "no" };
        format!(
            "{:<13.6e} {:<9} {:<11} {:<8.4} {arrives:<9} {:<8.3} {}",
            minimum.length,
            rounded(minimum.excess),
            curvature(minimum.least_eigenvalue.as_ref()),
            minimum.dice_end,
            minimum.distance,
            numbers(&minimum.starts)
        )
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use shape_average::StartKind;

    /// The deformations end in the motion or the displacement itself, and a turn is a turn all the way.
    #[test]
    fn starts_are_parts_of_motions_and_displacements() {
        let grid = Grid::<2>::cube(17);
        let disk = |[a, b]: [f64; 2]| {
            ScalarField::from_fn(grid, move |[x, y]: [f64; 2]| {
                [1.0 - ((x - 0.5) / a).hypot((y - 0.5) / b)]
            })
        };
        // A long ellipse on one that stands: it is turned by a quarter.
        let shapes = [disk([0.15, 0.35]), disk([0.35, 0.15])];
        let params = AverageParams {
            coarsest_nodes: 17,
            ..AverageParams::default()
        };
        let all = starts(&shapes, &params, 3).unwrap();
        let centre = centre_of(&shapes[1]);
        assert!(deformations(&all[0], grid, 4, centre).is_none());
        for start in &all[1..] {
            let found = deformations(start, grid, 4, centre).unwrap();
            assert_eq!(found.len(), 4);
            let [first, last] = [&found[0], &found[3]];
            let whole = start.displacements[1].as_slice();
            let apart = last.as_slice().iter().zip(whole);
            assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-9);
            if start.kind == StartKind::Pose {
                // A quarter of a quarter of a turn about the centre: no part of it is a compression.
                assert!(fe_grid::certify(&grid, first.as_slice(), 0.999).certified);
                let turn = start.motions[1].angle();
                assert!((turn - std::f64::consts::FRAC_PI_2).abs() < 0.05, "{turn}");
            }
        }
    }
}
