//! Scores and measures of quality as tables and charts.

use std::fs;
use std::path::Path;

use shape_pca::{Quality, Scores};

use crate::output::OutputError;
use crate::output::matrix::write_lines;
use crate::output::plot::{Chart, Series, colour, stacked};

/// Writes `scores.csv`: a line for every shape, scores in standard deviations.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_scores(
    path: &Path,
    names: &[String],
    scores: &[Scores],
) -> Result<(), OutputError> {
    let modes = scores.first().map_or(0, |s| s.scores.len());
    let head: Vec<String> = ["shape", "mahalanobis", "residual"]
        .map(String::from)
        .into_iter()
        .chain((0..modes).map(|j| format!("score_{j}")))
        .collect();
    let lines: Vec<Vec<String>> = names
        .iter()
        .zip(scores)
        .map(|(name, s)| {
            let mut line = vec![
                name.clone(),
                format!("{:e}", s.mahalanobis),
                format!("{:e}", s.residual()),
            ];
            line.extend(s.scores.iter().map(|x| format!("{x:e}")));
            line
        })
        .collect();
    write_lines(path, &head.join(","), &lines)
}

/// A line of a chart.
fn series(k: usize, label: &str, points: Vec<(f64, f64)>) -> Series {
    Series {
        label: label.to_owned(),
        colour: colour(k),
        points,
    }
}

fn numbered(from: usize, values: &[f64]) -> Vec<(f64, f64)> {
    let values = values.iter().enumerate();
    values.map(|(m, v)| ((m + from) as f64, *v)).collect()
}

fn write_charts(path: &Path, charts: &[Chart]) -> Result<(), OutputError> {
    let size = (900, 340 * charts.len() as u32);
    let text = stacked(size, charts)
        .map_err(|error| OutputError::at(path)(std::io::Error::other(error)))?;
    fs::write(path, text).map_err(OutputError::at(path))
}

/// Writes `scree.svg`: the eigenvalues over the first, and their sums.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_scree(
    path: &Path,
    ratios: &[f64],
    compactness: &[f64],
) -> Result<(), OutputError> {
    let modes = compactness.len();
    let ratios = [series(0, "", numbered(1, &ratios[..modes]))];
    let sums = [series(1, "", numbered(1, compactness))];
    let chart = |title, series| Chart {
        title,
        axis: "mode",
        logarithmic: false,
        series,
    };
    write_charts(
        path,
        &[
            chart("eigenvalues over the first", &ratios),
            chart("share of the variance in the first modes", &sums),
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
    let general = [series(0, "", numbered(0, &quality.generalisation))];
    let specific = [series(1, "", numbered(1, &quality.specificity))];
    let chart = |title, series| Chart {
        title,
        axis: "modes",
        logarithmic: false,
        series,
    };
    write_charts(
        plot,
        &[
            chart("generalisation: error of shapes left out", &general),
            chart(
                "specificity: random shapes from the nearest of the given",
                &specific,
            ),
        ],
    )?;
    let rows = quality
        .generalisation
        .len()
        .max(quality.specificity.len() + 1);
    let cell = |value: Option<&f64>| value.map_or_else(String::new, |v| format!("{v:e}"));
    let lines: Vec<Vec<String>> = (0..rows)
        .map(|m| {
            let before = m.checked_sub(1);
            vec![
                m.to_string(),
                cell(before.and_then(|m| quality.compactness.get(m))),
                cell(quality.generalisation.get(m)),
                cell(before.and_then(|m| quality.specificity.get(m))),
            ]
        })
        .collect();
    write_lines(
        table,
        "modes,compactness,generalisation,specificity",
        &lines,
    )
}

/// Writes `reconstruction.svg`: what the first modes leave of new shapes.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_reconstruction(
    path: &Path,
    names: &[String],
    errors: &[Vec<f64>],
    distances: &[Vec<f64>],
) -> Result<(), OutputError> {
    // Legends of many lines hide the lines.
    let label = |name: &String| if names.len() <= 6 { name.as_str() } else { "" }.to_owned();
    let lines = |all: &[Vec<f64>]| -> Vec<Series> {
        let pairs = names.iter().zip(all).enumerate();
        pairs
            .map(|(k, (name, values))| series(k, &label(name), numbered(0, values)))
            .collect()
    };
    let (errors, distances) = (lines(errors), lines(distances));
    let chart = |title, series| Chart {
        title,
        axis: "modes",
        logarithmic: false,
        series,
    };
    write_charts(
        path,
        &[
            chart("displacement left by the first modes, relative", &errors),
            chart("distance of the boundary from the shape's own", &distances),
        ],
    )
}
