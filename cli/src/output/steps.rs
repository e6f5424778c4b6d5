//! The steps of a path as a table and as plots.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::OutputError;
use super::plot::{Chart, Series, colour, stacked};

const SIZE: (u32, u32) = (900, 840);

/// What is known of every step and shape.
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
    let mut text = format!("shape,energy,length,{}\n", table.size);
    for (k, size) in table.sizes.iter().enumerate() {
        let step = k.checked_sub(1).and_then(|step| table.energies.get(step));
        let step = step.map_or_else(
            || ",".to_owned(),
            |energy| format!("{energy:e},{:e}", energy.max(0.0).sqrt()),
        );
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{k},{step},{size:e}");
    }
    fs::write(path, text).map_err(OutputError::at(path))
}

/// Writes `steps.svg`: energies, lengths and sizes over the number of the step or shape.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_steps_plot(path: &Path, table: &StepTable<'_>) -> Result<(), OutputError> {
    let text = plot(table).map_err(|error| OutputError::at(path)(std::io::Error::other(error)))?;
    fs::write(path, text).map_err(OutputError::at(path))
}

fn plot(table: &StepTable<'_>) -> Result<String, String> {
    let line = |k: usize, points: Vec<(f64, f64)>| {
        [Series {
            label: String::new(),
            colour: colour(k),
            points,
        }]
    };
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
    let chart = |title, axis, series| Chart {
        title,
        axis,
        logarithmic: false,
        series,
    };
    stacked(
        SIZE,
        &[
            chart("energy of each step, W_k", "step", &energies),
            chart("length of each step, sqrt W_k", "step", &lengths),
            chart(&format!("{} of each shape", table.size), "shape", &sizes),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(text.matches("<circle").count(), 2 + 2 + 3);
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
        assert!(plot(&table).is_ok());
    }
}
