//! Averages of shapes of several components: what modes and their shapes need of them.

use std::path::Path;

use fe_grid::{ScalarField, VectorField};
use levelset::{BoxEdge, Contour, ContourDistance, contour};
use serde::Deserialize;
use shape_pca::{Average, push_forward};

use crate::error::CliError;
use crate::results::ResultFields;
use crate::shapes::Components;
use shapespace_input::Image;
use shapespace_picture::{Colour, colour};

/// A component of an average.
pub(crate) struct StoredComponent<const D: usize> {
    /// Its label in the inputs.
    pub label: i64,
    /// Its phase field.
    pub phase_field: ScalarField<f64, D>,
    /// The share of the shapes at every node, of which the level 1/2 is its boundary.
    pub indicator: ScalarField<f64, D>,
}

impl<const D: usize> StoredComponent<D> {
    /// Its boundary.
    ///
    /// # Errors
    /// [`CliError::Computation`] where there is none.
    pub fn outline(&self) -> Result<Contour<D>, CliError> {
        contour(&self.indicator, 0.5, BoxEdge::Closed).map_err(CliError::from)
    }
}

/// The labels of an average in its record.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct StoredLabels {
    #[serde(default)]
    components: Vec<StoredLabel>,
}

#[derive(Clone, Debug, Deserialize)]
struct StoredLabel {
    label: i64,
}

impl StoredLabels {
    /// The components, from the arrays of their average; none of shapes of one.
    ///
    /// # Errors
    /// Those of reading the arrays.
    pub fn read<const D: usize>(
        &self,
        fields: &ResultFields<'_>,
    ) -> Result<Vec<StoredComponent<D>>, CliError> {
        let all = self.components.iter().enumerate();
        all.map(|(c, stored)| {
            Ok(StoredComponent {
                label: stored.label,
                phase_field: fields.scalar(Path::new(&phase_field_name(c)))?,
                indicator: fields
                    .scalar(Path::new(&format!("average_component_{c}_indicator.npy")))?,
            })
        })
        .collect()
    }
}

/// New shapes: their masks, and the masks of their components if there are several.
pub(crate) struct NewShapes<const D: usize> {
    /// The masks of all that is labelled, or the masks.
    pub images: Vec<Image<D>>,
    /// Those of their components.
    pub parts: Option<Components<D>>,
}

impl<const D: usize> NewShapes<D> {
    /// Splits label images where the average has components.
    ///
    /// # Errors
    /// [`CliError::Option`] for images of other labels than those of the average.
    pub fn new(images: Vec<Image<D>>, components: &[StoredComponent<D>]) -> Result<Self, CliError> {
        if components.is_empty() {
            return Ok(Self {
                images,
                parts: None,
            });
        }
        let (whole, parts) = Components::each(&images)?;
        let labels: Vec<i64> = components.iter().map(|c| c.label).collect();
        if parts.labels != labels {
            return Err(CliError::Option {
                option: "--pca",
                value: format!("with the labels {labels:?}"),
                remedy: format!(
                    "'{}' has the labels {:?}: give new shapes with those of the average",
                    images
                        .first()
                        .map_or(Path::new(""), |i| i.path.as_path())
                        .display(),
                    parts.labels
                ),
            });
        }
        Ok(Self {
            images: whole,
            parts: Some(parts),
        })
    }
}

/// The name of the phase field of a component of the average.
pub(super) fn phase_field_name(component: usize) -> String {
    format!("average_component_{component}.npy")
}

/// The names of the phase fields of a shape: one file, or one for each component.
pub(super) fn phase_field_names(shape: usize, n_components: usize) -> Vec<String> {
    if n_components == 0 {
        return vec![format!("phasefield_{shape:03}.npy")];
    }
    let of = |c| format!("phasefield_{shape:03}_component_{c}.npy");
    (0..n_components).map(of).collect()
}

/// Moves components with an average that has been continued: all of its deformations are followed by the
/// same one, which is that of any shape onto the new average after that from the old one.
pub(super) fn follow<const D: usize>(
    components: &mut [StoredComponent<D>],
    [before, after]: [&Average<D>; 2],
) {
    let (Some(old), Some(new)) = (
        before.displacements().first(),
        after.displacements().first(),
    ) else {
        return;
    };
    for component in components {
        let on_shape = component.indicator.compose(old.as_slice());
        component.indicator = push_forward(&on_shape, new, 0.0);
    }
}

/// The boundaries of components, each with its label.
///
/// # Errors
/// [`CliError::Computation`] for a component without a boundary.
pub(super) fn outlines<const D: usize>(
    components: &[StoredComponent<D>],
) -> Result<Vec<(i64, Contour<D>)>, CliError> {
    let of = |component: &StoredComponent<D>| Ok((component.label, component.outline()?));
    components.iter().map(of).collect()
}

/// Boundaries displaced by a multiple of a displacement, each in the colour of its component.
pub(super) fn displaced<const D: usize>(
    outlines: &[(i64, Contour<D>)],
    u: &VectorField<f64, D>,
    factor: f64,
) -> Vec<(Contour<D>, Colour)> {
    let all = outlines.iter().enumerate();
    all.map(|(c, (_, outline))| (outline.displaced(u, factor), colour(c)))
        .collect()
}

/// The label at every node of a shape given by its level set and the boundaries of its components: that of
/// the component whose inside the node lies in most deeply, or whose boundary is nearest; 0 in the void.
///
/// # Errors
/// [`CliError::Computation`] for a component without a boundary.
pub(super) fn label_field<const D: usize>(
    level_set: &ScalarField<f64, D>,
    labels: &[i64],
    components: &[(Contour<D>, Colour)],
) -> Result<ScalarField<f64, D>, CliError> {
    let grid = *level_set.grid();
    let mut deepest = vec![f64::NEG_INFINITY; grid.n_nodes()];
    let mut found = ScalarField::zeros(grid);
    for (label, (outline, _)) in labels.iter().zip(components) {
        let own = ContourDistance::new(outline)?.sample(grid);
        let nodes = found.as_mut_slice().iter_mut().zip(&mut deepest);
        for ((found, deepest), (own, whole)) in
            nodes.zip(own.as_slice().iter().zip(level_set.as_slice()))
        {
            if *whole > 0.0 && own > deepest {
                (*found, *deepest) = (*label as f64, *own);
            }
        }
    }
    Ok(found)
}
