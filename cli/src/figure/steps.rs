//! Lengths and dissipations of paths of more and more steps, each from the one before, and their limits.

use ::geodesic::{Geodesic, GeodesicParams};
use shapespace_picture::{LinePlot, PlotLine};
use shapespace_report::error_bar::{ErrorBar, OrderFrom};
use shapespace_report::table::{Cell, Table};

use super::paths::{name, overlaid, pairs, params, path, path_from};
use super::scene::Scene;
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;

/// Numbers of steps, each twice the one before.
const STEPS: [usize; 4] = [4, 8, 16, 32];
/// The order where none is observed: that of a path in one direction
/// ([`richardson`](::geodesic::distances::richardson)).
const ASSUMED_ORDER: f64 = 1.0;
/// Differences between lengths are small: minimisers have to end closer to the minimum than usual.
const TOLERANCE: f64 = 1e-6;
/// Iterations that this takes.
const MAX_ITERATIONS: usize = 2000;

/// Paths of all numbers of steps between the same shapes.
pub(super) fn steps<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let of = |symbol: &str| {
        let values = STEPS.map(|k| format!("{symbol}, K = {k}"));
        let last = ["order", "limit", "error"].map(|word| format!("{symbol} {word}"));
        [values.to_vec(), last.to_vec()].concat()
    };
    let columns = [
        vec!["path".to_owned()],
        of("L"),
        of("Diss"),
        vec!["arrive".into()],
    ];
    let mut table = Table::new(columns.concat());
    let mut tiles = Tiles::new(&scene.grid(), STEPS.len() + 1);
    for pair in pairs(scene) {
        let ends = pair.map(|k| &scene.distances[k]);
        let name = name(scene, pair);
        let mut lengths = Vec::new();
        let mut dissipations = Vec::new();
        let mut arrived = 0;
        let mut known: Option<Geodesic<D>> = None;
        for k in STEPS {
            let own = GeodesicParams {
                tolerance: TOLERANCE,
                max_iterations: Some(MAX_ITERATIONS),
                ..params(scene, k)
            };
            let what = format!("{name}, K = {k}");
            let found = match &known {
                None => path(scene, &what, ends, &own)?,
                Some(known) => path_from(scene, &what, ends, known, &own)?,
            };
            lengths.push(found.length());
            dissipations.push(found.dissipation());
            arrived += usize::from(found.end_reached());
            let tile = overlaid(&tiles, &found, ends[1]);
            tiles.push(&what, tile);
            known = Some(found);
        }
        let (length, dissipation) = (bar(&lengths), bar(&dissipations));
        tiles.push(
            "length over 1/K, and its limit",
            chart(&tiles, &lengths, length.as_ref()),
        );
        let mut row: Vec<Cell> = vec![name.into()];
        for (values, bar) in [(&lengths, &length), (&dissipations, &dissipation)] {
            row.extend(values.iter().map(|value| Cell::from(*value)));
            row.extend(limit(bar.as_ref()));
        }
        row.push(format!("{arrived} of {}", STEPS.len()).into());
        table.row(row);
    }
    Ok(Sheet {
        title: "Paths of more and more steps",
        text: format!(
            "Lengths `L = sum sqrt W_k` and dissipations `Diss = K sum W_k` of paths of K steps on one grid, to \
             a tolerance of {TOLERANCE:e}, each from the one of half as many steps, so that all are in one \
             valley, and their limits for infinitely many: from the last three, of \
             which the differences give an order; the error is the distance of the last from the limit. \
             Where the differences do not shrink by any order from 0.5 to 3 there is a dash, the limit is \
             the last value, and the error the largest difference. In one direction the error of few steps \
             is of order one in general, and of either sign. The error of the grid is not among them. \
             The pictures have all shapes of a path over each other."
        ),
        table,
        picture: tiles.draw(),
    })
}

/// The error bar of the values for increasing numbers of steps.
fn bar(values: &[f64]) -> Option<ErrorBar> {
    let finest_first: Vec<f64> = values.iter().rev().copied().collect();
    ErrorBar::of(&finest_first, ASSUMED_ORDER)
}

/// Order, limit and error.
fn limit(bar: Option<&ErrorBar>) -> [Cell; 3] {
    let Some(bar) = bar else {
        return [(); 3].map(|()| None::<String>.into());
    };
    let order = match bar.order_from {
        OrderFrom::ThreeGrids => bar.order.into(),
        OrderFrom::TwoGrids | OrderFrom::NotAsymptotic => None::<String>.into(),
    };
    [order, bar.limit().into(), bar.error.into()]
}

/// The lengths over the inverse number of steps.
fn chart<const D: usize>(
    tiles: &Tiles<D>,
    lengths: &[f64],
    bar: Option<&ErrorBar>,
) -> shapespace_picture::Canvas {
    let at = |k: usize| (k as f64).recip();
    let points = STEPS.iter().zip(lengths).map(|(k, l)| [at(*k), *l]);
    let mut lines = vec![PlotLine {
        points: points.collect(),
        category: 0,
    }];
    if let Some(bar) = bar {
        let (limit, error) = (bar.limit(), bar.error);
        lines.push(PlotLine {
            points: vec![[0.0, limit - error], [0.0, limit], [0.0, limit + error]],
            category: 1,
        });
    }
    // The last is too close to zero to have a name.
    let named = &STEPS[..STEPS.len() - 1];
    let mut ticks: Vec<(f64, String)> = named.iter().map(|k| (at(*k), format!("1/{k}"))).collect();
    ticks.push((0.0, "0".into()));
    LinePlot {
        size: tiles.slice.size(),
        lines: &lines,
        ticks: &ticks,
    }
    .draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The values come with the fewest steps first.
    #[test]
    fn the_limit_is_that_of_many_steps() {
        let values = STEPS.map(|k| 0.25 + 0.1 / k as f64);
        let bar = bar(&values).unwrap();
        assert_relative_eq!(bar.limit(), 0.25, epsilon = 1e-12);
        assert_relative_eq!(bar.error, 0.1 / 32.0, epsilon = 1e-12);
        assert_relative_eq!(bar.order, 1.0, epsilon = 1e-9);
    }
}
