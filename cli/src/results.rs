//! Reads result directories.

use std::path::Path;

use fe_grid::{Field, Grid, ScalarField};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::config::Config;
use crate::error::CliError;
use crate::integrity::Sums;
use crate::output::numbered;
use crate::report::{RESULT, Record};
use shapespace_input::dimension::Dim;
use shapespace_input::files::read_text;
use shapespace_input::{bytes_of, decode_array};

/// The commands that take the results of others.
const TAKEN_BY: [(&str, &[&str]); 6] = [
    ("average", &["pca", "warp", "average --start"]),
    ("geodesic", &["extend", "transport", "warp"]),
    ("length", &["warp"]),
    ("pca", &["synthesize", "score", "compare", "warp"]),
    ("synthesize", &["warp"]),
    ("distances", &["compare", "distances --merge"]),
];

/// That a directory is a result of another command, and who takes it.
pub(crate) fn of_another(command: &str) -> String {
    let takers = TAKEN_BY.iter().find(|(name, _)| *name == command);
    let takers = takers.map_or_else(String::new, |(_, takers)| {
        let takers: Vec<String> = takers.iter().map(|name| format!("`{name}`")).collect();
        let verb = if takers.len() == 1 { "takes" } else { "take" };
        format!(", which {} {verb}", listed(&takers))
    });
    format!("it is one of `shapespace {command}`{takers}")
}

/// Words with commas, and an `and` before the last.
fn listed(words: &[String]) -> String {
    match words {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => words.join(""),
    }
}

/// The record of a directory that the command with this configuration has written.
///
/// # Errors
/// A description of the defect.
pub(crate) fn read_record<C: Config, T: DeserializeOwned, const D: usize>(
    directory: &Path,
) -> Result<Record<C, T, D>, String> {
    match command_in(directory) {
        // Another command has other fields.
        Some(command) if command != C::COMMAND => Err(of_another(&command)),
        _ => read(directory),
    }
}

/// The dimension of the shapes of a directory.
///
/// # Errors
/// As [`read_record`].
pub(crate) fn read_dimension(directory: &Path) -> Result<Dim<(), ()>, String> {
    #[derive(Deserialize)]
    struct Shapes {
        dimension: usize,
    }
    let Shapes { dimension } = read(directory)?;
    match dimension {
        2 => Ok(Dim::D2(())),
        3 => Ok(Dim::D3(())),
        other => Err(format!("it has {other} dimensions")),
    }
}

/// Some of the contents of the record of a directory.
///
/// # Errors
/// As [`read_record`].
pub(crate) fn read_contents<T: DeserializeOwned>(directory: &Path) -> Result<T, String> {
    read(directory)
}

/// The command whose result a directory is, if it says so.
pub(crate) fn command_in(directory: &Path) -> Option<String> {
    command_of(&read_text(&directory.join(RESULT)).ok()?)
}

fn read<T: DeserializeOwned>(directory: &Path) -> Result<T, String> {
    let text = read_text(&directory.join(RESULT))
        .map_err(|error| format!("its {RESULT} cannot be read: {error}"))?;
    serde_json::from_str(&text).map_err(|error| match command_of(&text) {
        // Another command has other fields.
        Some(command) if error.to_string().starts_with("missing field") => of_another(&command),
        Some(command) => {
            format!("it is one of `shapespace {command}`, with other contents: {error}")
        }
        None => format!("its {RESULT} has other contents: {error}"),
    })
}

/// The command that has written a record.
fn command_of(text: &str) -> Option<String> {
    #[derive(Deserialize)]
    struct Written {
        command: String,
    }
    serde_json::from_str::<Written>(text)
        .ok()
        .map(|written| written.command)
}

/// The arrays of a directory, which are verified by the checksums of its record.
pub(crate) struct ResultFields<'a> {
    directory: &'a Path,
    /// The error for missing or unsuitable contents.
    unfit: fn(&Path, String) -> CliError,
    sums: Sums,
    /// The spacing of the grid, if the record states it.
    spacing: Option<f64>,
}

/// The spacing in a record.
#[derive(Deserialize)]
struct Spacing {
    #[serde(default)]
    spacing: Option<f64>,
}

/// A grid of these nodes. Without a spacing, or with one that is so up to rounding, its longest side is
/// one: results of earlier versions do not state it.
pub(crate) fn stored_grid<const D: usize>(size: &[usize], spacing: Option<f64>) -> Option<Grid<D>> {
    let nodes: [usize; D] = size.try_into().ok()?;
    if nodes.iter().any(|&n| n < 3) {
        return None;
    }
    let cells = nodes.into_iter().fold(0, usize::max) as f64 - 1.0;
    let usual = 1.0 / cells;
    let is_usual = |spacing: &f64| (spacing * cells - 1.0).abs() < 1e-12;
    let spacing = spacing
        .filter(|spacing| !is_usual(spacing))
        .unwrap_or(usual);
    Grid::with_nodes(nodes, spacing).ok()
}

impl<'a> ResultFields<'a> {
    /// Those of a directory, with the error for missing or unsuitable contents. Trusted arrays are
    /// not verified.
    ///
    /// # Errors
    /// [`CliError::Damaged`] where the record cannot be read.
    pub fn new(
        directory: &'a Path,
        unfit: fn(&Path, String) -> CliError,
        trust: bool,
    ) -> Result<Self, CliError> {
        Ok(Self::listed(directory, unfit, Sums::of(directory, trust)?))
    }

    /// Arrays with these checksums.
    pub fn listed(directory: &'a Path, unfit: fn(&Path, String) -> CliError, sums: Sums) -> Self {
        let spacing = read_contents::<Spacing>(directory).ok();
        Self {
            directory,
            unfit,
            sums,
            spacing: spacing.and_then(|record| record.spacing),
        }
    }

    /// The checksums of the record.
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    fn read(&self, name: &Path) -> Result<(Vec<usize>, Vec<f64>), CliError> {
        let path = self.directory.join(name);
        let bytes = bytes_of(&path)?;
        self.sums.verify(self.directory, name, &bytes)?;
        Ok(decode_array(&bytes, &path)?)
    }

    /// A scalar field, `name.npy`.
    ///
    /// # Errors
    /// Those of reading the array, and the error of `unfit` for an array of another shape.
    pub fn scalar<const D: usize>(&self, name: &Path) -> Result<ScalarField<f64, D>, CliError> {
        let (size, values) = self.read(name)?;
        let grid = self.grid(&size).ok_or_else(|| self.wrong_size(name))?;
        Ok(ScalarField::from_vec(grid, values)?)
    }

    /// The grid of arrays of this many nodes along each axis; none in another dimension, or with fewer
    /// than three a side.
    pub fn grid<const D: usize>(&self, size: &[usize]) -> Option<Grid<D>> {
        stored_grid(size, self.spacing)
    }

    /// One of several scalar fields.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn numbered_scalar<const D: usize>(
        &self,
        kind: &str,
        k: usize,
    ) -> Result<ScalarField<f64, D>, CliError> {
        self.scalar(&numbered(kind, k, "npy"))
    }

    /// A vector field on a grid.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn vector<const D: usize>(
        &self,
        grid: &Grid<D>,
        name: &Path,
    ) -> Result<Field<f64, D, D>, CliError> {
        let (size, values) = self.read(name)?;
        let mut asked = grid.nodes_per_axis().to_vec();
        asked.push(D);
        if size != asked {
            return Err(self.wrong_size(name));
        }
        Ok(Field::from_vec(*grid, values)?)
    }

    /// The nodes along each axis of a field of vectors.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn nodes(&self, name: &Path) -> Result<Vec<usize>, CliError> {
        let (mut size, _) = self.read(name)?;
        size.pop();
        Ok(size)
    }

    /// A field of positions, one of several, read as displacements.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn displacement<const D: usize>(
        &self,
        grid: &Grid<D>,
        kind: &str,
        k: usize,
    ) -> Result<Field<f64, D, D>, CliError> {
        self.positions(grid, &numbered(kind, k, "npy"))
    }

    /// A field of positions, read as displacements.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn positions<const D: usize>(
        &self,
        grid: &Grid<D>,
        name: &Path,
    ) -> Result<Field<f64, D, D>, CliError> {
        let mut field = self.vector(grid, name)?;
        let identity = Field::<f64, D, D>::identity(*grid);
        for (value, x) in field.as_mut_slice().iter_mut().zip(identity.as_slice()) {
            *value -= x;
        }
        Ok(field)
    }

    /// The error for an array of another size than the others.
    pub fn wrong_size(&self, name: &Path) -> CliError {
        let reason = format!("{} has another size than the other arrays", name.display());
        (self.unfit)(self.directory, reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_of_others_name_who_takes_them() {
        assert_eq!(
            of_another("geodesic"),
            "it is one of `shapespace geodesic`, which `extend`, `transport` and `warp` take"
        );
        assert_eq!(
            of_another("length"),
            "it is one of `shapespace length`, which `warp` takes"
        );
        assert_eq!(of_another("metric"), "it is one of `shapespace metric`");
    }

    #[test]
    fn grids_have_the_spacing_of_the_record() {
        let cube = stored_grid::<2>(&[50, 50], None).unwrap();
        assert_eq!(cube, Grid::cube(50));
        assert_eq!(
            stored_grid(&[50, 50], Some(cube.spacing() + 1e-17)),
            Some(cube)
        );
        let long = stored_grid::<3>(&[65, 17, 33], None).unwrap();
        assert_eq!(long.extent(), [1.0, 0.25, 0.5]);
        let spaced = stored_grid::<2>(&[17, 9], Some(0.07)).unwrap();
        assert_eq!(spaced.spacing(), 0.07);
        assert_eq!(stored_grid::<2>(&[17, 9, 9], None), None);
        assert_eq!(stored_grid::<2>(&[17, 2], None), None);
        assert_eq!(stored_grid::<2>(&[17, 9], Some(-1.0)), None);
    }
}
