//! Quantities that are measured and drawn along a path: boundaries, sizes and densities of its
//! shapes.

use ::geodesic::{Form, Geodesic, GeodesicError, GeodesicParams, dissipation_density};
use fe_grid::{Field, ScalarField, parallel};
use hyperelastic::LawSpec;
use levelset::{BoxEdge, Contour, contour, enclosed_volume};

use super::Outcome;
use crate::error::CliError;
use crate::shapes::{Input, belongs};

/// Densities up to this are rounding: moduli are of the order of one.
const ROUNDING: f64 = 1e-12;

/// The parts of a path.
pub(crate) struct Parts<const D: usize> {
    /// Level sets of the shapes `0, ..., K`.
    pub level_sets: Vec<ScalarField<f64, D>>,
    /// The displacements of the steps between them.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Energies of the steps.
    pub energies: Vec<f64>,
    /// Steps per unit time, for densities.
    pub steps: usize,
    /// Names of the shapes, for pictures.
    pub names: Vec<String>,
    /// The end shape, drawn over the last one.
    pub target: Option<Contour<D>>,
}

/// The shapes `0, ..., K` of a path.
pub(crate) struct Path<const D: usize> {
    pub parts: Parts<D>,
    /// Boundaries of the shapes; the faces of the box close them.
    pub contours: Vec<Contour<D>>,
    /// For every shape the boundaries of its labels; none where there is one component.
    pub labels: Vec<Vec<Contour<D>>>,
    /// Areas or volumes in the unit box.
    pub sizes: Vec<f64>,
    /// The density of the step that deforms each shape into the next, at the nodes; none for the
    /// last.
    pub densities: Vec<ScalarField<f64, D>>,
}

impl<const D: usize> Path<D> {
    /// The path of a result.
    ///
    /// # Errors
    /// [`CliError::Geodesic`] for level sets that are not finite.
    pub(super) fn new(outcome: &Outcome<D>) -> Result<Self, CliError> {
        let (result, inputs) = (&outcome.result, &outcome.inputs);
        let count = outcome.labels.len();
        let labels: Result<Vec<_>, GeodesicError> =
            parallel::try_map(&result.components, &|components| {
                (0..count).map(|i| label(components, i)).collect()
            });
        Ok(Self {
            labels: labels?,
            ..Self::of_geodesic([&inputs[0], &inputs[1]], result, &outcome.config.params)?
        })
    }

    /// The path of a geodesic of one component between two inputs.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_geodesic(
        [start, end]: [&Input<D>; 2],
        geodesic: &Geodesic<D>,
        params: &GeodesicParams,
    ) -> Result<Self, CliError> {
        let last = geodesic.displacements.len();
        let name = |k: usize| match k {
            0 => start.name.clone(),
            // The last shape is close to the end shape, and is named after it.
            _ if k == last => end.name.clone(),
            _ => format!("{k} of {last}"),
        };
        let lagrangian = params.form == Form::Lagrangian;
        let parts = Parts {
            level_sets: geodesic.level_sets.clone(),
            displacements: geodesic.displacements.clone(),
            energies: geodesic.energy.step_energies.clone(),
            steps: last,
            names: (0..=last).map(name).collect(),
            target: lagrangian.then(|| end.contour.clone()),
        };
        Self::of(parts, &params.law)
    }

    /// The path of these parts under a law.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(parts: Parts<D>, law: &LawSpec) -> Result<Self, CliError> {
        let contours: Vec<_> = parallel::try_map(&parts.level_sets, &|u| {
            contour(u, 0.0, BoxEdge::Closed).map_err(CliError::from)
        })?;
        let sizes: Result<Vec<_>, _> = contours.iter().map(enclosed_volume).collect();
        let densities: Result<Vec<_>, GeodesicError> = parts
            .level_sets
            .iter()
            .zip(&parts.displacements)
            .map(|(u, phi)| dissipation_density(u, phi, parts.steps, law))
            .collect();
        Ok(Self {
            parts,
            contours,
            labels: Vec::new(),
            sizes: sizes?,
            densities: densities?,
        })
    }

    /// `sum sqrt W_k`.
    pub fn length(&self) -> f64 {
        self.parts.energies.iter().map(|w| w.max(0.0).sqrt()).sum()
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.contours.len() - 1
    }

    /// The upper end of the colour scale: nearly the largest nodal density, without a few outliers.
    pub fn densest(&self) -> f64 {
        let all = self.densities.iter().flat_map(ScalarField::as_slice);
        // Equal shapes leave rounding errors, which are not shown.
        let mut values: Vec<f64> = all.copied().filter(|&value| value > ROUNDING).collect();
        if values.is_empty() {
            return 0.0;
        }
        let rank = (values.len() - 1) * 199 / 200;
        *values.select_nth_unstable_by(rank, f64::total_cmp).1
    }

    /// The boundary between shape `k` and the next, at a fraction of the step.
    pub fn between(&self, k: usize, share: f64) -> Contour<D> {
        self.moved(k, share, &self.contours[k])
    }

    /// A boundary of shape `k` at a fraction of the step to the next.
    pub fn moved(&self, k: usize, share: f64, contour: &Contour<D>) -> Contour<D> {
        contour.displaced(&self.parts.displacements[k], share)
    }
}

/// The boundary of a label: inside the level sets that it belongs to, outside the others.
fn label<const D: usize>(
    components: &[ScalarField<f64, D>],
    index: usize,
) -> Result<Contour<D>, GeodesicError> {
    let mut inside = components[0].clone();
    for (component, u) in components.iter().enumerate().skip(1) {
        let sign = if belongs(index, component) { 1.0 } else { -1.0 };
        for (inside, u) in inside.as_mut_slice().iter_mut().zip(u.as_slice()) {
            *inside = inside.min(sign * u);
        }
    }
    Ok(contour(&inside, 0.0, BoxEdge::Closed)?)
}
