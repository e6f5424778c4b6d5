//! The elastic averages of a group of shapes, and the lengths and energies between them.

use ::geodesic::GeodesicParams;
use fe_grid::ScalarField;
use hyperelastic::{LameModuli, LawName, LawSpec};
use shape_average::AverageParams;

use super::Group;
use crate::error::CliError;
use crate::figure::paths::{params, path};
use crate::figure::scene::Scene;

/// Steps of the paths whose lengths are distances.
const STEPS: usize = 4;

/// The average of a group with some parameters changed, as a signed distance.
///
/// # Errors
/// Those of averages.
pub(super) fn average<const D: usize>(
    scene: &Scene<'_, D>,
    group: &Group<'_, D>,
    what: &str,
    change: impl FnOnce(&mut AverageParams),
) -> Result<ScalarField<f64, D>, CliError> {
    let before = scene.doubts.borrow().len();
    let result = scene.average_of(what, group.distances, &[], change)?;
    // Doubts name shapes by their number in the figure.
    for doubt in &mut scene.doubts.borrow_mut()[before..] {
        doubt.shape = doubt.shape.map(|shape| shape + group.first);
    }
    let distance = levelset::signed_distance(&result.average_indicator, 0.5);
    Ok(distance?)
}

/// The lengths of the viscous paths of all pairs, and how many of them arrive at their ends.
///
/// # Errors
/// Those of paths.
pub(super) fn path_lengths<const D: usize>(
    scene: &Scene<'_, D>,
    group: &Group<'_, D>,
) -> Result<(Vec<f64>, usize), CliError> {
    lengths(scene, group, "path", &params(scene, STEPS))
}

/// The roots of the energies of linear elasticity of one deformation of each shape into each of the later
/// ones: paths of one step.
///
/// # Errors
/// Those of paths.
pub(super) fn linear_energies<const D: usize>(
    scene: &Scene<'_, D>,
    group: &Group<'_, D>,
) -> Result<(Vec<f64>, usize), CliError> {
    let own = GeodesicParams {
        law: linear(scene.params.law.moduli)?,
        ..params(scene, 1)
    };
    lengths(scene, group, "linear deformation", &own)
}

/// Linear elasticity of these moduli, `lambda/2 (tr e)^2 + mu tr e^2`, `e` the symmetric part of the
/// gradient of the displacement.
pub(super) fn linear(moduli: LameModuli) -> Result<LawSpec, CliError> {
    let law: LawName = "linear".parse().map_err(|source| CliError::Law {
        law: "linear".into(),
        source,
    })?;
    Ok(law.with(moduli))
}

fn lengths<const D: usize>(
    scene: &Scene<'_, D>,
    group: &Group<'_, D>,
    what: &str,
    params: &GeodesicParams,
) -> Result<(Vec<f64>, usize), CliError> {
    let (mut found, mut arrived) = (Vec::new(), 0);
    for [i, j] in group.pairs() {
        let what = format!("{what} from {} to {}", group.names[i], group.names[j]);
        let ends = [&group.distances[i], &group.distances[j]];
        let path = path(scene, &what, ends, params)?;
        found.push(path.length());
        arrived += usize::from(path.end_reached());
    }
    Ok((found, arrived))
}
