//! Scores and measures of quality as tables and charts.

use std::path::Path;

use shape_pca::{Quality, Scores};
use shapespace_report::chart::{Axis, Chart, Series};
use shapespace_report::table::{Table, exact, exact_or_empty};

use crate::groups::Labelled;
use crate::output::{OutputError, write_charts, write_text};

/// Writes `scores.csv`: a line for every shape, scores in standard deviations. For training shapes,
/// whose own distances say little, those in the modes of the other shapes stand beside them. Groups are in the last column.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_scores(
    path: &Path,
    names: &[String],
    scores: &[Scores],
    left_out: &[Scores],
    labelled: Option<&Labelled>,
) -> Result<(), OutputError> {
    let modes = scores.first().map_or(0, |s| s.scores.len());
    let quantities = ["mahalanobis", "p_value", "mahalanobis_over_n", "residual"];
    let of_left_out = quantities.iter().map(|name| format!("left_out_{name}"));
    let of_left_out = of_left_out.filter(|_| !left_out.is_empty());
    let mut head = vec!["shape".to_owned()];
    head.extend(quantities.map(String::from));
    head.extend(of_left_out);
    head.extend((0..modes).map(|j| format!("score_{j}")));
    head.extend(labelled.map(|_| "group".to_owned()));
    let mut table = Table::new(head);
    for (k, (name, s)) in names.iter().zip(scores).enumerate() {
        let mut numbers = quantities_of(s).to_vec();
        numbers.extend(left_out.get(k).iter().flat_map(|s| quantities_of(s)));
        numbers.extend(&s.scores);
        let numbers = numbers.into_iter().map(exact);
        let group = labelled.map(|labelled| labelled.name_of(k).to_owned());
        table.texts([name.clone()].into_iter().chain(numbers).chain(group));
    }
    write_text(path, &table.csv())
}

fn quantities_of(scores: &Scores) -> [f64; 4] {
    let distance = scores.mahalanobis;
    [
        distance.distance,
        distance.p_value,
        distance.over_n,
        scores.residual(),
    ]
}

fn numbered(from: usize, values: &[f64]) -> Vec<(f64, f64)> {
    let values = values.iter().enumerate();
    values.map(|(m, v)| ((m + from) as f64, *v)).collect()
}

/// A chart of numbers from zero over a number of modes.
fn over_modes<'a>([axis, up]: [&'a str; 2], title: &'a str, series: &'a [Series]) -> Chart<'a> {
    Chart {
        title,
        across: Axis::counts(axis),
        up: Axis::linear(up),
        series,
    }
}

/// The size of two charts.
const SIZE: (u32, u32) = (900, 680);

/// Writes `scree.svg`: the eigenvalues relative to the first, and their sums.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_scree(
    path: &Path,
    ratios: &[f64],
    compactness: &[f64],
) -> Result<(), OutputError> {
    let modes = compactness.len();
    // The first mode is number 0, as its files and pictures are.
    let ratios = [Series::new("", 0, numbered(0, &ratios[..modes]))];
    let sums = [Series::new("", 1, numbered(1, compactness))];
    write_charts(
        path,
        SIZE,
        &[
            over_modes(
                ["mode", "eigenvalue"],
                "eigenvalues relative to the first",
                &ratios,
            ),
            over_modes(
                ["number of modes", "share"],
                "share of the variance in the first modes",
                &sums,
            ),
        ],
    )
}

/// Writes `quality.svg` and `quality.csv`: generalisation and specificity over the number of modes.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_quality(
    plot: &Path,
    table: &Path,
    quality: &Quality,
) -> Result<(), OutputError> {
    let general = [Series::new("", 0, numbered(0, &quality.generalisation))];
    let specific = [Series::new("", 1, numbered(1, &quality.specificity))];
    let chart = |up, title, series| over_modes(["number of modes", up], title, series);
    write_charts(
        plot,
        SIZE,
        &[
            chart(
                "error",
                "generalisation: error of shapes left out",
                &general,
            ),
            chart(
                "distance",
                "specificity: distance of random shapes to the nearest input",
                &specific,
            ),
        ],
    )?;
    let mut lines = Table::new(["modes", "compactness", "generalisation", "specificity"]);
    let rows = quality
        .generalisation
        .len()
        .max(quality.specificity.len() + 1);
    for m in 0..rows {
        let before = m.checked_sub(1);
        let numbers = [
            before.and_then(|m| quality.compactness.get(m)),
            quality.generalisation.get(m),
            before.and_then(|m| quality.specificity.get(m)),
        ];
        let cells = numbers.map(|number| exact_or_empty(number.copied()));
        lines.texts([m.to_string()].into_iter().chain(cells));
    }
    write_text(table, &lines.csv())
}

/// Writes `reconstruction.svg`: residuals of new shapes with the first modes.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_reconstruction(
    path: &Path,
    names: &[String],
    errors: &[Vec<f64>],
    distances: &[Vec<f64>],
) -> Result<(), OutputError> {
    // A legend of very many lines leaves no room for them.
    let label = |name: &String| if names.len() <= 24 { name.as_str() } else { "" }.to_owned();
    let lines = |all: &[Vec<f64>]| -> Vec<Series> {
        let pairs = names.iter().zip(all).enumerate();
        pairs
            .map(|(k, (name, values))| Series::new(label(name), k, numbered(0, values)))
            .collect()
    };
    let (errors, distances) = (lines(errors), lines(distances));
    let chart = |up, title, series| over_modes(["number of modes", up], title, series);
    write_charts(
        path,
        SIZE,
        &[
            chart(
                "residual",
                "relative residual displacement with the first modes",
                &errors,
            ),
            chart(
                "distance",
                "distance of the reconstructed boundary",
                &distances,
            ),
        ],
    )
}
