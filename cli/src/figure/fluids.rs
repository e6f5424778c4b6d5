//! Paths in fluids that keep lengths, and in fluids that keep areas.

use ::geodesic::{GeodesicError, GeodesicParams};
use hyperelastic::{LameModuli, LawSpec};
use levelset::{BoxEdge, contour, enclosed_volume};
use shapespace_report::table::{Cell, Table};

use super::paths::{name, pairs, params, path, portrait, verdict};
use super::scene::Scene;
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;

/// The ratios `lambda / mu`.
const RATIOS: [f64; 3] = [0.01, 1.0, 100.0];
/// Steps of a path.
const STEPS: usize = 8;
/// The shapes of a path that are drawn.
const SHOWN: [usize; 5] = [0, 2, 4, 6, 8];

/// The same paths for all ratios, with `mu = 1`.
pub(super) fn fluids<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let mut table = Table::new([
        "path",
        "lambda / mu",
        "length",
        "dissipation",
        "Dice at the end",
        "least det",
        "least area over the ends",
        "verdict",
    ]);
    let mut tiles = Tiles::new(&scene.grid(), SHOWN.len());
    for pair in pairs(scene) {
        let ends = pair.map(|k| &scene.distances[k]);
        let name = name(scene, pair);
        for ratio in RATIOS {
            let usual = params(scene, STEPS);
            let own = GeodesicParams {
                law: LawSpec {
                    moduli: LameModuli {
                        lambda: ratio,
                        mu: 1.0,
                    },
                    ..usual.law
                },
                ..usual
            };
            let found = path(scene, &format!("{name}, lambda/mu {ratio}"), ends, &own)?;
            let areas = found.level_sets.iter().map(|shape| {
                let outline = contour(shape, 0.0, BoxEdge::Closed)?;
                Ok(enclosed_volume(&outline)?)
            });
            let areas = areas.collect::<Result<Vec<f64>, GeodesicError>>()?;
            let (first, last) = (areas[0], areas[areas.len() - 1]);
            // Relative to the area of a steady change from one end to the other.
            let steady = |k: usize| first + (last - first) * k as f64 / (areas.len() - 1) as f64;
            let shares = areas.iter().enumerate().map(|(k, area)| area / steady(k));
            table.row([
                Cell::from(name.as_str()),
                ratio.into(),
                found.length().into(),
                found.dissipation().into(),
                found.dice_end.into(),
                found.certificate.min_det.into(),
                shares.fold(f64::INFINITY, f64::min).into(),
                verdict(&found, &own).into(),
            ]);
            for step in SHOWN {
                let label = match step {
                    0 => format!("lambda/mu = {ratio}"),
                    _ => format!("t = {}", step as f64 / STEPS as f64),
                };
                tiles.push(&label, portrait(&tiles, &found, step, ends[1]));
            }
        }
    }
    Ok(Sheet {
        title: "Fluids that keep lengths, and fluids that keep areas",
        text: format!(
            "The dissipation `lambda/2 (tr e)^2 + mu tr e^2` of a path of {STEPS} steps for three ratios \
             `lambda / mu`, mu = 1. Where lambda is small, areas may change on the way, and what is \
             expensive is shear; where it is large, matter flows around in order to keep its area. The least area is \
             that of a shape on the way, relative to a steady change from the area of the first to that of \
             the last. A path is sound where it arrives at the end shape, which is drawn over its last, and \
             nothing else is doubtful."
        ),
        table,
        picture: tiles.draw(),
    })
}
