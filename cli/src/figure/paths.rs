//! Paths between the shapes of a figure.

use ::geodesic::{Geodesic, GeodesicParams, Shape, geodesic, geodesic_near};
use fe_grid::ScalarField;
use fe_grid::minimise::Observer;
use shapespace_picture::{Canvas, INK, WHITE, colour, mix, time};

use super::scene::Scene;
use super::sheet::Tiles;
use crate::error::CliError;

/// Parameters of a path of this number of steps, with the law and the limits of a figure.
pub(super) fn params<const D: usize>(scene: &Scene<'_, D>, steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        law: scene.params.law,
        ..GeodesicParams::default()
    }
}

/// The path from one shape to another.
///
/// # Errors
/// Those of the path, and [`CliError::Stopped`] where Ctrl-C has been pressed.
pub(super) fn path<const D: usize>(
    scene: &Scene<'_, D>,
    what: &str,
    [start, end]: [&ScalarField<f64, D>; 2],
    params: &GeodesicParams,
) -> Result<Geodesic<D>, CliError> {
    observed(scene, what, params, start, |watch| {
        Ok(geodesic(start, end, params, watch)?)
    })
}

/// The path of the number of steps of the parameters in the valley of one of another number.
///
/// # Errors
/// As [`path`].
pub(super) fn path_from<const D: usize>(
    scene: &Scene<'_, D>,
    what: &str,
    [start, end]: [&ScalarField<f64, D>; 2],
    known: &Geodesic<D>,
    params: &GeodesicParams,
) -> Result<Geodesic<D>, CliError> {
    let ends = [start, end].map(|u| Shape::new(u.clone()));
    observed(scene, what, params, start, |watch| {
        let found = geodesic_near(&ends[0], &ends[1], known, params, watch)?;
        found.map_or_else(|| Ok(geodesic(start, end, params, watch)?), Ok)
    })
}

/// Computes a path under the eyes of an observer, and keeps its doubts.
fn observed<const D: usize>(
    scene: &Scene<'_, D>,
    what: &str,
    params: &GeodesicParams,
    start: &ScalarField<f64, D>,
    compute: impl FnOnce(&mut dyn Observer) -> Result<Geodesic<D>, CliError>,
) -> Result<Geodesic<D>, CliError> {
    let session = scene.session;
    session.progress.note(format!("{what}:"));
    let grids = start.grid().hierarchy(params.coarsest_nodes);
    let mut checkpointer = scene.checkpointer.borrow_mut();
    let mut watch = checkpointer.observe(session.observer(&grids));
    let found = compute(&mut watch)?;
    watch.finish();
    if session.interrupt.asked() {
        return Err(CliError::Stopped);
    }
    scene.doubts.borrow_mut().extend(found.doubts(params));
    Ok(found)
}

/// The pairs of shapes that paths join: in every group its first with each of the others.
pub(super) fn pairs<const D: usize>(scene: &Scene<'_, D>) -> Vec<[usize; 2]> {
    let mut found = Vec::new();
    let mut first = 0;
    for n in &scene.groups {
        found.extend((first + 1..first + n).map(|other| [first, other]));
        first += n;
    }
    found
}

/// The name of the path between two shapes.
pub(super) fn name<const D: usize>(scene: &Scene<'_, D>, [start, end]: [usize; 2]) -> String {
    format!("{} to {}", scene.names[start], scene.names[end])
}

/// All shapes of a path over each other, and the end shape as a thin line.
pub(super) fn overlaid<const D: usize>(
    tiles: &Tiles<D>,
    path: &Geodesic<D>,
    end: &ScalarField<f64, D>,
) -> Canvas {
    let mut tile = tiles.slice.painted(|_| WHITE);
    let last = (path.level_sets.len() - 1).max(1) as f64;
    for (k, shape) in path.level_sets.iter().enumerate() {
        let hue = time(k as f64 / last);
        tiles.slice.level(&mut tile, shape, 0.0, 1.2, hue);
    }
    tiles.slice.level(&mut tile, end, 0.0, 0.6, INK);
    tile
}

/// One shape of a path, filled, and the end shape as a thin line.
pub(super) fn portrait<const D: usize>(
    tiles: &Tiles<D>,
    path: &Geodesic<D>,
    step: usize,
    end: &ScalarField<f64, D>,
) -> Canvas {
    let shape = &path.level_sets[step];
    let last = (path.level_sets.len() - 1).max(1) as f64;
    let fill = mix(WHITE, time(step as f64 / last), 0.5);
    let spacing = shape.grid().spacing();
    // Half a spacing to both sides of the boundary the colour changes.
    let share = |x| (0.5 + shape.sample(x)[0] / spacing).clamp(0.0, 1.0) as f32;
    let mut tile = tiles.slice.painted(|x| mix(WHITE, fill, share(x)));
    tiles.slice.level(&mut tile, shape, 0.0, 1.2, INK);
    if step + 1 == path.level_sets.len() {
        tiles.slice.level(&mut tile, end, 0.0, 0.8, colour(1));
    }
    tile
}

/// Whether a path arrives at its end, in a word.
pub(super) fn verdict<const D: usize>(path: &Geodesic<D>, params: &GeodesicParams) -> &'static str {
    if !path.end_reached() {
        "does not arrive"
    } else if path.doubts(params).is_empty() {
        "sound"
    } else {
        "doubtful"
    }
}
