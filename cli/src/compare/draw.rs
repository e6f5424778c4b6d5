//! The pictures of a comparison.

use std::collections::HashMap;

use super::record::differences;
use super::scale::{difference_bar, rate_bar, rate_share};
use super::tests::{Found, OfModes, Outcome};
use crate::error::CliError;
use crate::output::ResultDir;
use crate::pca::ScoreMap;
use shapespace_picture::{Camera, Canvas, Colour, HeatMap, INK, Shape, TileRows, colour};

/// Tiles in a row.
const COLUMNS: usize = 3;
/// Side of a mark in a matrix.
const MARK: usize = 12;
/// Scores at the ends of the axes.
const AMPLITUDE: f64 = 2.0;

/// `compare.png` and, of modes, `scores.png`.
pub(super) fn pictures<const D: usize>(
    outcome: &Outcome<D>,
    directory: &ResultDir,
) -> Result<(), CliError> {
    match &outcome.found {
        Found::Modes(found) => {
            directory.picture("compare.png", || sheet(outcome, found))?;
            let drawn = found.tests.f.len() > 1 && directory.has_files();
            if let Some(map) = drawn.then(|| scores(outcome, found)).flatten() {
                directory.picture("scores.png", || map)?;
            }
        }
        Found::Distances(_) => {
            directory.picture("compare.png", || matrix(outcome))?;
        }
    }
    Ok(())
}

/// The means of the groups, the boundary with the differences and their false discovery rates, and the shapes
/// that the covariates predict.
fn sheet<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Canvas {
    let labelled = &outcome.compared.labelled;
    let mean = Shape::of(&found.outline);
    let means: Vec<Shape> = found.means.iter().map(|m| Shape::of(&m.outline)).collect();
    let of_covariates = found.covariates.iter().flat_map(|c| &c.shapes);
    let predicted: Vec<Shape> = of_covariates
        .map(|shape| Shape::of(&shape.outline))
        .collect();
    let all: Vec<Shape> = [mean.clone()]
        .into_iter()
        .chain(means.iter().cloned())
        .chain(predicted.iter().cloned())
        .collect();
    let camera = Camera::around(&all, TileRows::width(COLUMNS));
    let mut rows = TileRows::new(COLUMNS);
    let over = |shape: &Shape, tone: Colour| {
        let mut canvas = camera.portrait(shape, tone);
        camera.outline_over(&mut canvas, &mean, INK);
        canvas
    };
    for (g, (name, shape)) in labelled.names.iter().zip(&means).enumerate() {
        let size = labelled.groups.sizes()[g];
        rows.push(format!("mean of {name} ({size})"), over(shape, colour(g)));
    }
    rows.end_row();
    let points = Nearest::of(found.outline.points());
    let at = |values: &[f64], p: &[f64]| values[points.find(p)];
    let differences = differences(&found.displacements);
    let most = differences.iter().copied().fold(0.0, f64::max);
    let units = outcome.compared.units();
    let (unit, longest) = (units.name(), units.length(most));
    let bars = [difference_bar(longest, unit), rate_bar()];
    let share = |p: &[f64]| at(&differences, p) / most.max(f64::MIN_POSITIVE);
    let shade = |p: &[f64]| (bars[0].colour)(share(p));
    rows.push(
        format!("difference of the means, up to {longest:.3} ({unit})"),
        camera.shaded(&mean, INK, shade),
    );
    let rates = &found.points.false_discovery_rate;
    let rate = |p: &[f64]| (bars[1].colour)(rate_share(at(rates, p)));
    rows.push("false discovery rate", camera.shaded(&mean, INK, rate));
    rows.end_row();
    for bar in &bars {
        rows.push(bar.title.clone(), bar.draw(TileRows::width(COLUMNS)));
    }
    rows.end_row();
    let mut shapes = predicted.iter();
    for covariate in &found.covariates {
        let p = covariate.regression.p_value_overall;
        for value in covariate.values {
            if let Some(shape) = shapes.next() {
                let label = format!("{} = {value:.4} (p {p:.4})", covariate.name);
                rows.push(label, over(shape, INK));
            }
        }
    }
    rows.draw()
}

/// Finds the nearest of the points of a boundary.
struct Nearest<'a, const D: usize> {
    points: &'a [[f64; D]],
    /// The first point with these coordinates: the vertices of a surface are points themselves.
    same: HashMap<[u64; D], usize>,
}

impl<'a, const D: usize> Nearest<'a, D> {
    fn of(points: &'a [[f64; D]]) -> Self {
        let mut same = HashMap::new();
        for (q, p) in points.iter().enumerate() {
            same.entry(p.map(f64::to_bits)).or_insert(q);
        }
        Self { points, same }
    }

    /// Its index.
    fn find(&self, place: &[f64]) -> usize {
        let known = <[f64; D]>::try_from(place).ok();
        if let Some(&q) = known.and_then(|p| self.same.get(&p.map(f64::to_bits))) {
            return q;
        }
        let distance =
            |p: &[f64; D]| -> f64 { p.iter().zip(place).map(|(a, b)| (a - b) * (a - b)).sum() };
        let by_distance = |(_, a): &(usize, f64), (_, b): &(usize, f64)| a.total_cmp(b);
        let all = self.points.iter().map(distance).enumerate();
        all.min_by(by_distance).map_or(0, |(q, _)| q)
    }
}

/// The shapes at their scores in the first two modes.
fn scores<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Option<Canvas> {
    let compared = &outcome.compared;
    let super::source::Kind::Modes(stored, _) = &compared.kind else {
        return None;
    };
    let map = ScoreMap {
        average: &found.outline,
        space: &stored.space,
        scores: &found.scores,
        names: &compared.names,
        groups: compared.labelled.groups.labels(),
        group_names: &compared.labelled.names,
        amplitude: AMPLITUDE,
    };
    map.draw()
}

/// The distances, by groups.
fn matrix<const D: usize>(outcome: &Outcome<D>) -> Canvas {
    let compared = &outcome.compared;
    let groups = compared.labelled.groups.labels();
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_key(|&i| groups[i]);
    let marks: Vec<Canvas> = groups.iter().map(|_| Canvas::new(MARK, MARK)).collect();
    let value = |i: usize, j: usize| match &compared.kind {
        super::source::Kind::Distances(matrix) => Some(matrix[i][j]),
        super::source::Kind::Modes(..) => None,
    };
    HeatMap {
        names: &compared.names,
        marks: &marks,
        groups,
        rows: &order,
        columns: &order,
        value: &value,
        skipped: &|_, _| false,
        title: "distance L",
    }
    .draw()
}
