//! Energies and forces of steps between deformations of one start shape.

use super::metric::form;
use super::params::CalculusParams;
use super::rigid::Matter;
use crate::cells::{ObjectWeights, solid_cells};
use crate::error::GeodesicError;
use crate::laws::{Kind, StepTerm};
use fe_grid::multigrid::MultigridParams;
use fe_grid::{Element, Grid, GridError, ScalarField, certify_within, restrain_step};
use hyperelastic::{CompiledLaw, Corotational, CorotationalMultigrid};
use levelset::{Compact, Step};

/// A start shape, and what a step between two of its deformations costs.
pub(super) struct Geometry<const D: usize> {
    pub grid: Grid<D>,
    pub params: CalculusParams,
    law: CompiledLaw<D>,
    level_set: ScalarField<f64, D>,
    weights: ObjectWeights,
    /// The cells that must not fold; `None` if these are all cells.
    solid: Option<Vec<bool>>,
    pub matter: Matter<D>,
}

impl<const D: usize> Geometry<D> {
    pub fn new(
        level_set: &ScalarField<f64, D>,
        params: &CalculusParams,
    ) -> Result<Self, GeodesicError> {
        params.check()?;
        let law = params.law.compile::<D>()?;
        if !law.hypotheses().frame_indifferent {
            return Err(GeodesicError::FrameDependent {
                law: params.law.law,
            });
        }
        let grid = *level_set.grid();
        let shape = "start";
        if let Some(node) = level_set.as_slice().iter().position(|u| !u.is_finite()) {
            return Err(GeodesicError::NotFinite { which: shape, node });
        }
        if level_set.as_slice().iter().all(|&u| u <= 0.0) {
            return Err(GeodesicError::Degenerate {
                which: shape,
                what: "empty",
            });
        }
        let indicator = Step::Compact(Compact::new(params.indicator_cells * grid.spacing())?);
        let values = level_set.as_slice();
        let density = values.iter().map(|&u| indicator.value(u)).collect();
        Ok(Self {
            grid,
            solid: (params.void_stiffness == 0.0).then(|| solid_cells(&grid, values, indicator)),
            matter: Matter::new(grid, density),
            weights: ObjectWeights {
                indicator,
                void_stiffness: params.void_stiffness,
                void_viscosity: params.void_viscosity * params.law.moduli.mu,
            },
            params: params.clone(),
            law,
            level_set: level_set.clone(),
        })
    }

    /// Computes `W(a, b)` for the displacements `a` and `b`, one after the other; adds its
    /// derivatives to `forces` unless that is empty. `None` if it is not finite.
    pub fn energy(&self, pair: &[f64], forces: &mut [f64]) -> Result<Option<f64>, GeodesicError> {
        let term = StepTerm {
            kind: Kind::Path,
            law: &self.law,
            weights: self.weights,
            level_set: self.level_set.as_slice(),
            state: pair,
            factor: 1.0,
            gradient: forces,
        };
        match term.add(&self.grid) {
            Ok(energy) => Ok(Some(energy)),
            Err(GridError::Inadmissible { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Returns whether a deformation satisfies the determinant bound on all cells that must not
    /// fold.
    pub fn admits(&self, displacement: &[f64]) -> bool {
        let bound = self.params.min_determinant;
        let solid = self.solid.as_deref();
        certify_within(&self.grid, displacement, bound, bound, solid).certified
    }

    /// Shortens a step that would fold a deformation.
    pub fn restrain(&self, displacement: &[f64], step: &mut [f64]) {
        let bound = self.params.min_determinant;
        restrain_step(&self.grid, displacement, step, bound, self.solid.as_deref());
    }

    /// Returns the quadratic form of the metric at a deformation: the law and its data per cell.
    pub fn form<O: Element>(&self, displacement: &[f64]) -> (Corotational<D>, Vec<Vec<O>>) {
        let moduli = self.params.law.moduli;
        let level_set = self.level_set.as_slice();
        form(&self.grid, moduli, self.weights, level_set, displacement)
    }

    /// Nearly the inverse of that form.
    pub fn cycle(&self, displacement: &[f64]) -> Result<CorotationalMultigrid<D>, GeodesicError> {
        let (law, cells) = self.form(displacement);
        let params = MultigridParams::default();
        Ok(CorotationalMultigrid::new(self.grid, law, cells, params)?)
    }
}
