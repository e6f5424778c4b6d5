//! `report.md`: the analysis in words.

use std::path::Path;

use shape_pca::{Metric, PcaParams, Variation};
use shapespace_report::table::Table;

use super::outliers::Outlier;
use super::record::{Analysis, PcaRecord};
use crate::output::{OutputError, write_text};

/// Maximum number of modes in the table.
const ROWS: usize = 12;

/// Writes the report.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_report<const D: usize>(
    path: &Path,
    record: &PcaRecord<'_, D>,
) -> Result<(), OutputError> {
    let found = &record.body;
    let n = found.n_shapes;
    let text = format!(
        "# Modes of variation of {n} shapes\n\n{}\n\n\
         ![Modes: shapes at -2, -1, 0, 1, 2 standard deviations](modes.png)\n\n\
         {}\n\
         Generalisation is the residual of a shape with the first modes of the other shapes. \
         Specificity is the distance of random shapes of these modes to the nearest input. Both are \
         in the norm of the inner product. A shape with score s in mode j is \
         {}.\n\n\
         ![Eigenvalues](scree.svg)\n\n![Generalisation and specificity](quality.svg)\n",
        properties(found, &record.parameters.params),
        table(found).markdown(),
        shape_of_scores(record.parameters.params.variation),
    );
    write_text(path, &text)
}

/// The shape of a score.
fn shape_of_scores(variation: Variation) -> &'static str {
    match variation {
        Variation::Stress => "(1 - s sqrt(eigenvalue) y_j)(S)",
        Variation::Displacement => {
            "(1 - m - s sqrt(eigenvalue) y_j)(S) with the mean displacement m, and the mean is (1 - m)(S)"
        }
    }
}

/// The properties of an analysis as a list.
fn properties(found: &Analysis<'_>, params: &PcaParams) -> String {
    let metric = match params.metric {
        Metric::L2 => "L2: the integral of u . v over the average object",
        Metric::Hessian => "Hessian: the second variation of the elastic energy",
    };
    let state = if params.at_rest {
        "at rest, without the stresses of the deformations"
    } else {
        "under the stresses of all deformations"
    };
    let definite = if found.definite {
        "positive definite"
    } else {
        "**not positive definite**"
    };
    let counted = found.weights.iter().filter(|weight| **weight > 0.0).count();
    let left_out = found.quality.left_out.iter();
    let largest = left_out.fold(0.0, |most, scores| {
        f64::max(most, scores.mahalanobis.distance)
    });
    let variation = match params.variation {
        Variation::Stress => {
            "Variation: the linear elastic responses to the stresses of the deformations onto the \
             average; they sum to"
        }
        Variation::Displacement => {
            "Variation: the displacements of the average to the shapes, by the inverse deformations; \
             they sum to"
        }
    };
    let outliers: Vec<String> = found.outliers.iter().map(Outlier::in_words).collect();
    let outliers = (!outliers.is_empty()).then(|| {
        format!(
            "Outliers in the modes of the other inputs, with p-values times the number of inputs: {}.",
            outliers.join(", ")
        )
    });
    let properties = [
        format!("Inner product: {metric}."),
        format!("The average object is {state}."),
        format!(
            "{variation} {:.1} % of their mean norm.",
            100.0 * found.balance
        ),
        format!(
            "The object under its stresses is {definite} (smallest curvature found: {:.2e}, \
             relative to the same material at rest).",
            found.least_curvature
        ),
        format!(
            "Mahalanobis distances of the inputs, divided by sqrt(n): root mean square {:.4}; \
             sqrt(modes/n) = {:.4}, with the n inputs whose weight is not zero.",
            found.mahalanobis_over_n_rms,
            (found.n_modes as f64 / counted as f64).sqrt()
        ),
        format!("Mahalanobis distances in the modes of the other inputs: at most {largest:.3}."),
    ];
    let lines = properties.into_iter().chain(outliers);
    let lines: Vec<String> = lines.map(|property| format!("- {property}")).collect();
    lines.join("\n")
}

/// The eigenvalues and the quality of the first modes.
fn table(found: &Analysis<'_>) -> Table {
    let mut table = Table::new([
        "modes",
        "eigenvalue",
        "ratio",
        "share of variance",
        "generalisation",
        "specificity",
    ]);
    for m in 1..=found.n_modes.min(ROWS) {
        let general = found.quality.generalisation.get(m);
        table.texts([
            m.to_string(),
            format!("{:.3e}", found.eigenvalues[m - 1]),
            format!("{:.3}", found.ratios[m - 1]),
            format!("{:.1} %", 100.0 * found.quality.compactness[m - 1]),
            general.map_or_else(|| "–".to_owned(), |g| format!("{g:.3e}")),
            format!("{:.3e}", found.quality.specificity[m - 1]),
        ]);
    }
    table
}
