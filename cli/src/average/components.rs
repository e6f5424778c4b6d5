//! `--labels`: shapes of several components, from their label images to what is written of each.

use fe_grid::{Field, Grid, ScalarField};
use levelset::{BoxEdge, Contour, contour, enclosed_volume};
use serde::Serialize;
use shape_average::ComponentResult;

use super::Outcome;
use super::record::{Distance, distances};
use crate::error::CliError;
use crate::output::ResultDir;
use crate::shapes::{
    Components, Input, InputRecord, ResultPlace, SizeRecord, VisibilityMask, common_scale,
    inspect_thinness,
};
use crate::warp::write_labels;
use shapespace_picture::Shape;

/// The components of all inputs.
pub(super) struct Parts<const D: usize> {
    /// The labels, in the order of the components.
    pub labels: Vec<i64>,
    /// Signed distances, all of the first input before those of the second.
    pub distances: Vec<ScalarField<f64, D>>,
}

impl<const D: usize> Parts<D> {
    /// Computes the signed distances of components, and adds the doubts about those that the grid does not
    /// resolve to their inputs.
    ///
    /// # Errors
    /// [`CliError`] with exit code 2 for components without a node of the grid.
    pub fn new(
        components: &Components<D>,
        inputs: &mut [Input<D>],
        views: &[Option<VisibilityMask<D>>],
        grid: Grid<D>,
    ) -> Result<Self, CliError> {
        let mut distances = Vec::new();
        for (number, input) in inputs.iter_mut().enumerate() {
            let own = match views.get(number) {
                Some(Some(view)) => components.visible_distances(number, input, view, grid)?,
                _ => components.distances(number, input, grid)?,
            };
            let doubts = own
                .iter()
                .enumerate()
                .filter_map(|(c, distance)| Some(inspect_thinness(distance)?.within(c)));
            input.doubts.extend(doubts);
            distances.extend(own);
        }
        Ok(Self {
            labels: components.labels.clone(),
            distances,
        })
    }

    /// The boundaries of the components of an input.
    ///
    /// # Errors
    /// Those of the contours.
    pub fn outlines(&self, number: usize) -> Result<Vec<Contour<D>>, CliError> {
        let m = self.labels.len();
        boundaries(&self.distances[number * m..(number + 1) * m])
    }
}

/// The boundaries of shapes given by their signed distances; the faces of the box close them.
///
/// # Errors
/// Those of the contours.
pub(crate) fn boundaries<const D: usize>(
    distances: &[ScalarField<f64, D>],
) -> Result<Vec<Contour<D>>, CliError> {
    let boundaries = distances.iter().map(|u| contour(u, 0.0, BoxEdge::Closed));
    let boundaries = boundaries.collect::<Result<_, _>>();
    Ok(boundaries?)
}

/// A component in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ComponentRecord<'a> {
    /// Its label in the inputs.
    label: i64,
    /// Of the component of every shape and that of the average.
    dice: &'a [f64],
    mean_dice: f64,
    /// In length units of the unit box.
    hausdorff: Vec<Distance>,
    /// In the length units of each input.
    hausdorff_input_units: Vec<Distance>,
    average: SizeRecord,
}

impl ComponentRecord<'_> {
    /// Its overlap in words.
    pub fn in_words(&self) -> String {
        let least = self.dice.iter().copied().fold(1.0, f64::min);
        let (label, mean) = (self.label, self.mean_dice);
        format!("label {label}: Dice {mean:.4} on average, {least:.4} at least")
    }
}

/// The records of the components of an average with these boundaries; none of shapes of one.
///
/// # Errors
/// Those of the volumes of contours.
pub(super) fn records<'a, const D: usize>(
    outcome: &'a Outcome<D>,
    outlines: &[Contour<D>],
) -> Result<Vec<ComponentRecord<'a>>, CliError> {
    let inputs = &outcome.inputs;
    let scale = common_scale(inputs.iter().map(Input::scale));
    let components = outcome.result.components.iter().zip(labels_of(outcome));
    let mut records = Vec::new();
    for ((component, label), outline) in components.zip(outlines) {
        let volume = enclosed_volume(outline)?;
        records.push(ComponentRecord {
            label: *label,
            dice: &component.dice,
            mean_dice: component.dice.iter().sum::<f64>() / component.dice.len() as f64,
            hausdorff: distances(&component.hausdorff, |_| 1.0),
            hausdorff_input_units: distances(&component.hausdorff, |i| inputs[i].scale()),
            average: SizeRecord::new::<D>(volume, scale),
        });
    }
    Ok(records)
}

/// The labels of the components; none of shapes of one.
pub(super) fn labels_of<const D: usize>(outcome: &Outcome<D>) -> &[i64] {
    outcome.parts.as_ref().map_or(&[], |parts| &parts.labels)
}

/// The boundary of a component of the average; the faces of the box close it.
pub(super) fn outline<const D: usize>(
    component: &ComponentResult<D>,
) -> Result<Contour<D>, levelset::LevelsetError> {
    contour(&component.average_indicator, 0.5, BoxEdge::Closed)
}

/// The boundaries of the components of the average.
///
/// # Errors
/// Those of the contours.
pub(super) fn average_outlines<const D: usize>(
    outcome: &Outcome<D>,
) -> Result<Vec<Contour<D>>, CliError> {
    let outlines = outcome.result.components.iter().map(outline);
    let outlines = outlines.collect::<Result<_, _>>();
    Ok(outlines?)
}

/// The same to be drawn.
pub(super) fn shapes_of<const D: usize>(outlines: &[Contour<D>]) -> Vec<Shape> {
    outlines.iter().map(Shape::of).collect()
}

/// The label of the average at every node, 0 in the void: in the object that of the component with the
/// largest share of the shapes there.
pub(super) fn label_field<const D: usize>(outcome: &Outcome<D>) -> ScalarField<f64, D> {
    let result = &outcome.result;
    let labels = labels_of(outcome);
    let mut found = Field::zeros(*result.average.grid());
    for (node, value) in found.as_mut_slice().iter_mut().enumerate() {
        let share = |c: usize| result.components[c].average_indicator.as_slice()[node];
        let first = (0..labels.len()).reduce(|a, b| if share(b) > share(a) { b } else { a });
        let inside = result.average_mask.as_slice()[node] > 0.5;
        if let Some(c) = first.filter(|&c| inside && share(c) > 0.0) {
            *value = labels[c] as f64;
        }
    }
    found
}

/// Writes the components of the average: phase fields, shares and labels as arrays, boundaries in files of
/// their own, and a label image in the world.
///
/// # Errors
/// [`CliError::Output`], and [`CliError::Computation`] for a component without a boundary.
pub(super) fn write_components<const D: usize>(
    directory: &ResultDir,
    (outcome, inputs): (&Outcome<D>, &[InputRecord<D>]),
    place: &ResultPlace<D>,
    whole: &Contour<D>,
    outlines: &[Contour<D>],
) -> Result<(), CliError> {
    let labels = labels_of(outcome);
    if labels.is_empty() {
        return Ok(());
    }
    directory.array("average_labels.npy", &label_field(outcome))?;
    for (c, component) in outcome.result.components.iter().enumerate() {
        directory.array(format!("average_component_{c}.npy"), &component.average)?;
        let name = format!("average_component_{c}_indicator.npy");
        directory.array(name, &component.average_indicator)?;
    }
    for (label, outline) in labels.iter().zip(outlines) {
        place.write(directory, &format!("average_label_{label}"), outline)?;
    }
    let grid = *outcome.result.average.grid();
    write_labels(
        directory,
        "average",
        inputs,
        whole,
        (labels, outlines),
        grid,
    )
}

/// Writes the phase fields of the inputs: of several components each in a file of its own.
///
/// # Errors
/// [`CliError::Output`].
pub(super) fn write_phase_fields<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
) -> Result<(), CliError> {
    let shapes = &outcome.result.shapes;
    let m = shapes.n_components();
    if m == 1 {
        return Ok(directory.arrays("phasefield", 0, &shapes.phase_fields)?);
    }
    for (place, field) in shapes.phase_fields.iter().enumerate() {
        let (shape, c) = (place / m, place % m);
        directory.array(format!("phasefield_{shape:03}_component_{c}.npy"), field)?;
    }
    Ok(())
}
