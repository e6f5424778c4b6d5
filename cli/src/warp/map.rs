//! The maps of result directories: of an average, a path, modes, or a shape of given scores.

use std::path::{Path, PathBuf};

use fe_grid::{Field, Grid, vector};
use levelset::Doubt;
use serde::Deserialize;

use super::route::{Leg, Route, WorldMap, along};
use super::samples::Side;
use super::way::{Between, Way, unfit};
use crate::error::CliError;
use crate::output::numbered;
use crate::pca::{Displaced, read_pca};
use crate::progress::Progress;
use crate::results::{ResultFields, command_in, read_contents, read_dimension};
use crate::shapes::{Coordinates, InputRecord};
use shapespace_input::dimension::Dim;

/// Most samples of an image that is written.
const MOST_SAMPLES: usize = 1 << 28;

/// A map and the way back, with the images at both ends.
pub(crate) struct StoredMap {
    route: Dim<Route<2>, Route<3>>,
    sides: [Side; 2],
    /// Spacing of the grid, in the box.
    spacing: f64,
    /// The doubts about its deformations, where the result does not have them.
    doubts: Vec<Doubt>,
}

/// A result that is read.
struct Reading<'a, const D: usize> {
    directory: &'a Path,
    /// The inputs whose coordinates there are.
    inputs: Vec<InputRecord<D>>,
    /// Samples of images in a spacing of the grid.
    refine: usize,
    trust: bool,
}

/// One end of a route.
struct End<const D: usize> {
    coordinates: Coordinates<D>,
    side: Side,
}

impl StoredMap {
    /// Reads the map of a result. In a spacing of its grid images of results without a place in the world
    /// have `refine` samples.
    ///
    /// # Errors
    /// [`CliError::NoResult`] for results without deformations, [`CliError::Option`] for options that do
    /// not fit a result, and those of reading the arrays.
    pub fn read(directory: &Path, way: &Way, refine: usize, trust: bool) -> Result<Self, CliError> {
        let dimension = read_dimension(directory).map_err(|reason| unfit(directory, reason))?;
        let command = command_in(directory).unwrap_or_default();
        let between = way.between(directory, &command)?;
        match dimension {
            Dim::D2(()) => stored::<2>(directory, &between, refine, trust, Dim::D2),
            Dim::D3(()) => stored::<3>(directory, &between, refine, trust, Dim::D3),
        }
    }

    /// Dimension of the shapes.
    pub fn dimension(&self) -> usize {
        self.route.dimension()
    }

    /// The map, or the way back.
    pub fn direction(&self, inverse: bool) -> WorldMap {
        match &self.route {
            Dim::D2(route) if inverse => route.reversed().map(),
            Dim::D2(route) => route.clone().map(),
            Dim::D3(route) if inverse => route.reversed().map(),
            Dim::D3(route) => route.clone().map(),
        }
    }

    /// Images before they are carried, and after.
    pub fn sides(&self, inverse: bool) -> [&Side; 2] {
        let [from, to] = &self.sides;
        if inverse { [to, from] } else { [from, to] }
    }

    /// Whether the points at its ends lie in the world.
    pub fn in_world(&self) -> bool {
        self.sides.iter().all(Side::in_world)
    }

    /// Says how much memory the deformations of both directions and an image that is written need.
    ///
    /// # Errors
    /// [`CliError::TooLarge`] if less is free.
    pub fn announce(&self, inverse: bool, progress: &Progress) -> Result<(), CliError> {
        let [_, to] = self.sides(inverse);
        // The values of an image that is written and of one that is read, and those of a mask of it.
        let samples = to.samples().unwrap_or(usize::MAX) as u64;
        let image = samples.saturating_mul(4 + 8 + 1);
        match &self.route {
            Dim::D2(route) => route.announce(image, progress),
            Dim::D3(route) => route.announce(image, progress),
        }
    }

    /// The doubts about the deformations beside those of the result.
    pub fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    /// Defects of inverses up to this are small: a tenth of the spacing of the grid.
    pub fn small(&self) -> f64 {
        0.1 * self.spacing
    }
}

fn stored<const D: usize>(
    directory: &Path,
    between: &Between,
    refine: usize,
    trust: bool,
    of: impl Fn(Route<D>) -> Dim<Route<2>, Route<3>>,
) -> Result<StoredMap, CliError> {
    let source = inputs_of(directory, between)?;
    let read = Reading::<D> {
        directory,
        inputs: inputs(&source)?,
        refine,
        trust,
    };
    let mut doubts = Vec::new();
    let (grid, legs, [from, to]) = match between {
        Between::Inputs(shape, to) => read.of_average(*shape, *to)?,
        Between::Times(from, to) => read.of_path(*from, *to)?,
        Between::Scores(scores) => {
            let (ends, found) = read.of_scores(scores)?;
            doubts = found;
            ends
        }
        Between::Synthesized => read.of_shape()?,
    };
    Ok(StoredMap {
        route: of(Route {
            from: from.coordinates,
            to: to.coordinates,
            legs,
        }),
        sides: [from.side, to.side],
        spacing: grid.spacing(),
        doubts,
    })
}

/// The directory of the inputs: that of the average for modes and their shapes.
fn inputs_of(directory: &Path, between: &Between) -> Result<PathBuf, CliError> {
    #[derive(Deserialize)]
    struct Record {
        parameters: Directories,
    }
    #[derive(Deserialize)]
    struct Directories {
        #[serde(default)]
        average: Option<PathBuf>,
        #[serde(default)]
        pca: Option<PathBuf>,
    }
    let read = |directory: &Path| {
        let record = read_contents::<Record>(directory);
        record.map_err(|reason| unfit(directory, reason))
    };
    let nameless = |directory: &Path| unfit(directory, "it does not name its average".into());
    match between {
        Between::Inputs(..) | Between::Times(..) => Ok(directory.into()),
        Between::Scores(_) | Between::Synthesized => {
            let own = read(directory)?.parameters;
            match (own.average, own.pca) {
                (Some(average), _) => Ok(average),
                (None, Some(modes)) => {
                    let average = read(&modes)?.parameters.average;
                    average.ok_or_else(|| nameless(&modes))
                }
                (None, None) => Err(nameless(directory)),
            }
        }
    }
}

fn inputs<const D: usize>(directory: &Path) -> Result<Vec<InputRecord<D>>, CliError> {
    #[derive(Deserialize)]
    struct Inputs<const D: usize> {
        input: Vec<InputRecord<D>>,
    }
    let read = read_contents::<Inputs<D>>(directory);
    Ok(read.map_err(|reason| unfit(directory, reason))?.input)
}

/// The grid, the deformations, and both ends.
type Ends<const D: usize> = (Grid<D>, Vec<Leg<D>>, [End<D>; 2]);

impl<const D: usize> Reading<'_, D> {
    fn fields(&self) -> Result<ResultFields<'_>, CliError> {
        ResultFields::new(self.directory, unfit, self.trust)
    }

    fn damaged(&self) -> CliError {
        unfit(
            self.directory,
            "the placement of its inputs is damaged".into(),
        )
    }

    /// The end at an input.
    fn input(&self, option: &'static str, number: usize) -> Result<End<D>, CliError> {
        let input = self.inputs.get(number).ok_or_else(|| CliError::Option {
            option,
            value: number.to_string(),
            remedy: format!(
                "the average has the inputs 0 to {}",
                self.inputs.len().saturating_sub(1)
            ),
        })?;
        let coordinates = Coordinates::of_input(input);
        let coordinates = coordinates.ok_or_else(|| self.damaged())?;
        let side = Side::of_input(number, input, &coordinates).ok_or_else(|| self.damaged())?;
        Ok(End { coordinates, side })
    }

    /// The end at a shape of the result.
    fn result(&self, grid: &Grid<D>) -> Result<End<D>, CliError> {
        let found = Coordinates::of_result(&self.inputs);
        let (coordinates, leading) = found.ok_or_else(|| self.damaged())?;
        let side = Side::of_result(&self.inputs[leading], &coordinates, grid, self.refine);
        let side = side.ok_or_else(|| self.damaged())?;
        if side.samples().is_none_or(|count| count > MOST_SAMPLES) {
            return Err(CliError::Option {
                option: "--refine",
                value: self.refine.to_string(),
                remedy: format!("images have at most {MOST_SAMPLES} samples: choose fewer"),
            });
        }
        Ok(End { coordinates, side })
    }

    fn of_average(&self, shape: usize, other: Option<usize>) -> Result<Ends<D>, CliError> {
        let from = self.input("--shape", shape)?;
        let to = other.map(|other| self.input("--to-shape", other));
        let to = to.transpose()?;
        let fields = self.fields()?;
        let displacement = deformation(&fields, shape)?;
        let grid = *displacement.grid();
        let mut legs = vec![Leg::by(displacement)];
        if let Some(other) = other {
            legs.push(Leg::by(deformation(&fields, other)?).reversed());
        }
        let to = match to {
            Some(to) => to,
            None => self.result(&grid)?,
        };
        Ok((grid, legs, [from, to]))
    }

    fn of_path(&self, from: f64, to: f64) -> Result<Ends<D>, CliError> {
        let fields = self.fields()?;
        // All that the result had, so that none is missed.
        let last = fields.sums().numbers("deformation").into_iter().max();
        let steps: Result<Vec<_>, _> = (1..=last.unwrap_or(0))
            .map(|k| deformation(&fields, k))
            .collect();
        let steps = steps?;
        let Some(first) = steps.first() else {
            return Err(unfit(self.directory, "it has no deformations".into()));
        };
        let grid = *first.grid();
        let ends = [self.at(from, &grid)?, self.at(to, &grid)?];
        Ok((grid, along(&steps, from, to), ends))
    }

    /// The end at a time of a path: an input that lies there, or else a shape of the result.
    fn at(&self, time: f64, grid: &Grid<D>) -> Result<End<D>, CliError> {
        let place = time * self.inputs.len().saturating_sub(1) as f64;
        if place.fract() == 0.0 {
            self.input("--time", place as usize)
        } else {
            self.result(grid)
        }
    }

    /// The ends, and the doubts about the shape, which is not stored.
    fn of_scores(&self, scores: &[f64]) -> Result<(Ends<D>, Vec<Doubt>), CliError> {
        let stored = read_pca(self.directory, None, self.trust)?;
        let stored: Option<crate::pca::StoredPca<D>> = stored.of_type();
        let space = stored.ok_or_else(|| self.damaged())?.space;
        let modes = space.fields.len();
        let found = space.synthesise(scores).map_err(|_| CliError::Option {
            option: "--scores",
            value: format!("with {} numbers", scores.len()),
            remedy: format!("there are {modes} modes: give at most one score for each"),
        });
        // The shape is `(1 - u)(S)`.
        let mut displacement = found?;
        vector::scale(-1.0, displacement.as_mut_slice());
        let doubts = Displaced::new(&space.object, &displacement)?.doubts()?;
        Ok((self.of_displacement(displacement)?, doubts))
    }

    fn of_shape(&self) -> Result<Ends<D>, CliError> {
        let fields = self.fields()?;
        let name = Path::new("displacement.npy");
        let nodes = fields.nodes(name)?;
        let grid = fields.grid(&nodes).ok_or_else(|| fields.wrong_size(name))?;
        self.of_displacement(fields.vector(&grid, name)?)
    }

    /// From the average by a displacement.
    fn of_displacement(&self, displacement: Field<f64, D, D>) -> Result<Ends<D>, CliError> {
        let grid = *displacement.grid();
        let ends = [self.result(&grid)?, self.result(&grid)?];
        Ok((grid, vec![Leg::by(displacement)], ends))
    }
}

/// One of several deformations.
fn deformation<const D: usize>(
    fields: &ResultFields<'_>,
    number: usize,
) -> Result<Field<f64, D, D>, CliError> {
    let name = numbered("deformation", number, "npy");
    let nodes = fields.nodes(&name)?;
    let grid = fields
        .grid(&nodes)
        .ok_or_else(|| fields.wrong_size(&name))?;
    fields.displacement(&grid, "deformation", number)
}
