//! `--valid`: visibility masks of the inputs.

use std::path::{Path, PathBuf};

use fe_grid::{Grid, ScalarField};

use crate::error::CliError;
use crate::shapes::{Input, VisibilityMask, read_view, view_of};
use shapespace_input::{Image, Sources};

const OPTION: &str = "--valid";
/// Denotes a mask that is bright everywhere.
pub(super) const ALL: &str = "all";

/// Checks that there is one mask per input, or none.
///
/// # Errors
/// [`CliError::Option`].
pub(super) fn check(valid: &[PathBuf], inputs: usize) -> Result<(), CliError> {
    if valid.is_empty() || valid.len() == inputs {
        return Ok(());
    }
    Err(CliError::Option {
        option: OPTION,
        value: format!("of {} masks", valid.len()),
        remedy: format!(
            "give one mask for each of the {inputs} inputs, in their order, and '{ALL}' for one that \
             is completely visible"
        ),
    })
}

/// Reads the masks of images; none at all where they hide nothing.
///
/// # Errors
/// [`CliError`] for masks that cannot be read, or have another number of axes than the inputs.
pub(super) fn read<const D: usize>(
    valid: &[PathBuf],
    images: &[Image<D>],
    sources: &Sources,
) -> Result<Vec<Option<VisibilityMask<D>>>, CliError> {
    let all = Path::new(ALL);
    let read = |(path, image): (&PathBuf, &Image<D>)| {
        let view = (path != all).then(|| read_view(path, image, sources, OPTION));
        view.transpose().map(Option::flatten)
    };
    let views = valid.iter().zip(images).map(read);
    let views = views.collect::<Result<Vec<_>, CliError>>()?;
    Ok(if views.iter().all(Option::is_none) {
        Vec::new()
    } else {
        views
    })
}

/// Replaces the signed distances of partially visible inputs by those to their visible boundary,
/// which is also drawn. Returns the visibility weights, none if everything is visible.
///
/// # Errors
/// Those of [`view_of`].
pub(super) fn apply<const D: usize>(
    views: &[Option<VisibilityMask<D>>],
    inputs: &mut [Input<D>],
    distances: &mut [ScalarField<f64, D>],
    grid: Grid<D>,
) -> Result<Vec<ScalarField<f64, D>>, CliError> {
    let mut visibility = Vec::with_capacity(views.len());
    for ((view, input), distance) in views.iter().zip(inputs).zip(distances) {
        let Some(view) = view else {
            visibility.push(ScalarField::from_fn(grid, |_| [1.0]));
            continue;
        };
        let view = view_of(view, input, grid)?;
        *distance = view.distance;
        input.contour = view.boundary;
        visibility.push(view.weight);
    }
    Ok(visibility)
}
