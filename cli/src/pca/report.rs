//! `report.md`: the analysis in words.

use std::fmt::Write as _;
use std::path::Path;

use shape_pca::{Metric, PcaParams};
use shapespace_report::table::Table;

use super::record::{Analysis, PcaRecord};
use crate::output::{self, OutputError};

/// Most lines of a table.
const ROWS: usize = 12;

/// Writes the report.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_report<const D: usize>(
    path: &Path,
    record: &PcaRecord<'_, D>,
) -> Result<(), OutputError> {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_text(&mut text, &record.body, &record.parameters.params);
    output::write_text(path, &text)
}

fn write_text(text: &mut String, r: &Analysis<'_>, params: &PcaParams) -> std::fmt::Result {
    writeln!(text, "# Modes of variation of {} shapes\n", r.n_shapes)?;
    let metric = match params.metric {
        Metric::L2 => "L2: the integral of u . v over the average object",
        Metric::Hessian => "Hessian: the second variation of the elastic energy",
    };
    writeln!(text, "- Inner product: {metric}.")?;
    let state = if params.at_rest {
        "at rest, without the stresses of the deformations"
    } else {
        "under the stresses of all deformations"
    };
    writeln!(text, "- The average object is {state}.")?;
    writeln!(
        text,
        "- Balance of the stresses: the displacements add up to {:.1} % of their mean size.",
        100.0 * r.balance
    )?;
    writeln!(
        text,
        "- The object under its stresses is {} (least curvature met: {:.2e} of that of the same \
         material at rest).",
        if r.definite {
            "positive definite"
        } else {
            "**not positive definite**"
        },
        r.least_curvature
    )?;
    writeln!(
        text,
        "- Mahalanobis distances of the shapes themselves: root mean square {:.4}; \
         sqrt((n-1)/n) = {:.4}.",
        r.mahalanobis_rms,
        ((r.n_shapes as f64 - 1.0) / r.n_shapes as f64).sqrt()
    )?;
    let left_out = r.quality.left_out.iter().map(|scores| scores.mahalanobis);
    let largest = left_out.fold(0.0, f64::max);
    writeln!(
        text,
        "- Each in the modes of the others: at most {largest:.3}. A shape much farther off is of \
         another kind.\n"
    )?;
    writeln!(
        text,
        "![Modes: shapes at -2, -1, 0, 1, 2 standard deviations](modes.png)\n"
    )?;
    let mut table = Table::new([
        "modes",
        "eigenvalue",
        "ratio",
        "share of variance",
        "generalisation",
        "specificity",
    ]);
    for m in 1..=r.n_modes.min(ROWS) {
        let general = r.quality.generalisation.get(m);
        table.texts([
            m.to_string(),
            format!("{:.3e}", r.eigenvalues[m - 1]),
            format!("{:.3}", r.ratios[m - 1]),
            format!("{:.1} %", 100.0 * r.quality.compactness[m - 1]),
            general.map_or_else(|| "–".to_owned(), |g| format!("{g:.3e}")),
            format!("{:.3e}", r.quality.specificity[m - 1]),
        ]);
    }
    text.push_str(&table.markdown());
    writeln!(
        text,
        "\nGeneralisation is what the first modes of the other shapes leave of a shape, specificity \
         how far random shapes of these modes are from the nearest shape, both in the norm of the \
         inner product. A shape with score s in mode j is (1 - s sqrt(eigenvalue) y_j)(S).\n"
    )?;
    writeln!(
        text,
        "![Eigenvalues](scree.svg)\n\n![Generalisation and specificity](quality.svg)"
    )
}
