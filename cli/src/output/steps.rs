//! The steps of a path as a table and as plots.

use std::path::Path;

use shapespace_report::chart::{Axis, Chart, Series};
use shapespace_report::table::{Table, exact, exact_or_empty};

use super::{OutputError, write_charts, write_text};

/// The steps and shapes of a path.
#[derive(Clone, Copy, Debug)]
pub struct StepTable<'a> {
    /// Energies `W_1, ..., W_K`.
    pub energies: &'a [f64],
    /// Areas or volumes of the shapes `0, ..., K`.
    pub sizes: &'a [f64],
    /// `area` or `volume`.
    pub size: &'a str,
}

/// Writes `steps.csv`: a line for every shape; energy and length are those of the step to it, and
/// empty for the first shape.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_steps_table(path: &Path, table: &StepTable<'_>) -> Result<(), OutputError> {
    let mut rows = Table::new(["shape", "energy", "length", table.size]);
    for (k, size) in table.sizes.iter().enumerate() {
        let step = k.checked_sub(1).and_then(|step| table.energies.get(step));
        let energy = step.copied();
        let length = energy.map(|energy| energy.max(0.0).sqrt());
        let step = [energy, length].map(exact_or_empty);
        rows.texts(
            [k.to_string()]
                .into_iter()
                .chain(step)
                .chain([exact(*size)]),
        );
    }
    write_text(path, &rows.csv())
}

/// Writes `steps.svg`: energies, lengths and sizes over the number of the step or shape.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_steps_plot(path: &Path, table: &StepTable<'_>) -> Result<(), OutputError> {
    let line = |k, points| [Series::new("", k, points)];
    let steps = |value: fn(f64) -> f64| {
        let numbered = table.energies.iter().enumerate();
        numbered
            .map(|(k, energy)| ((k + 1) as f64, value(*energy)))
            .collect()
    };
    let energies = line(0, steps(|energy| energy));
    let lengths = line(1, steps(|energy| energy.max(0.0).sqrt()));
    let shapes = table.sizes.iter().enumerate();
    let sizes = line(2, shapes.map(|(k, size)| (k as f64, *size)).collect());
    let chart = |title, axes: [_; 2], series| Chart {
        title,
        across: Axis::counts(axes[0]),
        up: Axis::linear(axes[1]),
        series,
    };
    let size = format!("{} of each shape", table.size);
    let charts = [
        chart("energy of each step, W_k", ["step", "W_k"], &energies),
        chart(
            "length of each step, sqrt W_k",
            ["step", "sqrt W_k"],
            &lengths,
        ),
        chart(&size, ["shape", table.size], &sizes),
    ];
    write_charts(path, (900, 840), &charts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn every_step_and_shape_is_there() {
        let place = tempfile::tempdir().unwrap();
        let (csv, svg) = (place.path().join("s.csv"), place.path().join("s.svg"));
        let table = StepTable {
            energies: &[4e-4, 9e-4],
            sizes: &[0.1, 0.2, 0.3],
            size: "area",
        };
        write_steps_table(&csv, &table).unwrap();
        let text = fs::read_to_string(&csv).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "shape,energy,length,area");
        assert_eq!(lines[1], "0,,,1e-1");
        assert_eq!(lines[2], "1,4e-4,2e-2,2e-1");
        assert_eq!(lines.len(), 4);
        write_steps_plot(&svg, &table).unwrap();
        let text = fs::read_to_string(&svg).unwrap();
        let markers = text.matches("<circle").count() + text.matches("<polygon").count();
        assert_eq!(markers, 2 + 2 + 3);
        for word in ["area", "W_k", "sqrt"] {
            assert!(text.contains(word), "{word}");
        }
    }

    #[test]
    fn nothing_makes_a_plot_too() {
        let table = StepTable {
            energies: &[0.0],
            sizes: &[0.0, 0.0],
            size: "volume",
        };
        let place = tempfile::tempdir().unwrap();
        write_steps_plot(&place.path().join("s.svg"), &table).unwrap();
    }
}
