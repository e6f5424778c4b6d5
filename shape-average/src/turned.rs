//! Shapes that lie turned among the others.
//!
//! A rotation of a whole shape costs nothing. But a minimiser that begins with the identity follows rotations up to some 45
//! degrees only, and shapes that lie upside down are bent the short way. Whether they should be turned is not known: tall
//! and wide ellipses may be one ellipse in two positions, or two that lie as they should, as organs do in a scanner. So
//! nothing is turned here, and shapes are named that overlap much better after a rotation, see [`Turn`], if the functional
//! is clearly smaller from there, too.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::hierarchy::{Levels, solve_levels};
use crate::level::LevelShapes;
use crate::params::{AverageParams, BoundaryCondition};
use crate::quiet::Quiet;
use fe_grid::minimise::{Control, Observer};
use fe_grid::{Field, ScalarField, parallel};
use levelset::{Cause, Doubt, Turn};
use serde::Serialize;

/// Number of nodes along the longest side of the first grid that tells from where the functional is smaller.
const COMPARED_NODES: usize = 17;
/// Shapes of less mismatch as they lie are near each other. Nearly round ones that swell to one side and to the other
/// have .1 to .2, ellipses whose axes differ by a half, across each other, .4.
const APART: f64 = 0.25;
/// The functional is clearly smaller where it falls by more than this share of the elastic energy.
const CLEARLY_LESS: f64 = 0.5;

/// A shape that overlaps much better with the first one, or with the average that it was deformed onto, after a rotation,
/// from which the functional is clearly smaller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turned {
    /// The shape.
    pub shape: usize,
    /// The angle of the rotation, in degrees.
    pub degrees: f64,
    /// The volume in which both differ, relative to that of their union: with the centroids in one place, and after the
    /// rotation.
    pub mismatches: [f64; 2],
}

impl Turned {
    /// The doubt about the deformation that does not turn the shape.
    pub fn doubt(&self) -> Option<Doubt> {
        let [as_it_lies, turned] = self.mismatches;
        let doubt = Doubt::check(Cause::Turned, turned / as_it_lies);
        doubt.map(|doubt| doubt.about(self.shape))
    }
}

/// Shapes that may be turned, and what they are deformed onto.
pub(crate) struct Turnable<'a, const D: usize> {
    /// The signed distances of the shapes of this process.
    pub shapes: &'a [ScalarField<f64, D>],
    /// The signed distance of the shape that tells whether they are turned: the first of all, or a fixed average.
    pub reference: &'a ScalarField<f64, D>,
    pub levels: &'a [LevelShapes<D>],
    /// The fixed average on every level; empty where it is minimised, too.
    pub targets: &'a [Vec<f64>],
    pub params: &'a AverageParams,
}

impl<const D: usize> Turnable<'_, D> {
    /// The shapes of all processes that lie turned. Collective.
    ///
    /// # Errors
    /// Those of the minimisation.
    pub fn turned(&self, observer: &mut dyn Observer) -> Result<Vec<Turned>, AverageError> {
        let first = &self.levels[0];
        // Fixed faces do not turn, and hidden parts are not compared.
        if self.params.boundary != BoundaryCondition::Natural || !first.seen().is_empty() {
            return Ok(Vec::new());
        }
        let turns = parallel::map(self.shapes, &|shape| {
            Turn::between(shape, self.reference).filter(|turn| turn.mismatches()[0] >= APART)
        });
        let numbers = |turn: &Option<Turn<D>>| match turn {
            Some(turn) => {
                let [as_it_lies, turned] = turn.mismatches();
                [turn.motion().angle().to_degrees(), as_it_lies, turned]
            }
            None => [0.0; 3],
        };
        let own: Vec<_> = turns.iter().map(numbers).collect();
        let all = first.distribution().share(&own).into_iter().enumerate();
        let found = all.filter(|(_, [degrees, ..])| *degrees > 0.0);
        let found = found.map(|(shape, [degrees, as_it_lies, turned])| Turned {
            shape,
            degrees,
            mismatches: [as_it_lies, turned],
        });
        let found: Vec<_> = found.collect();
        if found.is_empty() {
            return Ok(found);
        }
        let displacement = |turn: &Option<Turn<D>>| match turn {
            Some(turn) => turn.motion().displacement(*first.grid()),
            None => Field::zeros(*first.grid()),
        };
        let start: Vec<_> = turns.iter().map(displacement).collect();
        let (Some(identity), Some(turned)) = (
            self.reached(&[], observer)?,
            self.reached(&start, observer)?,
        ) else {
            return Ok(Vec::new());
        };
        let clearly = identity.total - turned.total > CLEARLY_LESS * identity.parts[0];
        Ok(if clearly { found } else { Vec::new() })
    }

    /// The energy that is reached from these displacements, or the identity, on the first grid that resolves shapes;
    /// none if that was cancelled.
    fn reached(
        &self,
        start: &[Field<f64, D, D>],
        observer: &mut dyn Observer,
    ) -> Result<Option<Energy>, AverageError> {
        let resolved = |level: &LevelShapes<D>| {
            let nodes = level.grid().nodes_per_axis().into_iter();
            nodes.max() >= Some(COMPARED_NODES)
        };
        let last = self.levels.len() - 1;
        let last = self.levels.iter().position(resolved).unwrap_or(last);
        let start = start.iter().map(Field::as_slice).collect();
        let mut problem = Levels::new(self.levels[..=last].to_vec(), self.params).from(start);
        if !self.targets.is_empty() {
            problem = problem.onto(self.targets[..=last].to_vec());
        }
        let reached = solve_levels(problem, &mut Quiet(observer))?;
        let cancelled = reached.cancelled() || observer.between() == Control::Cancel;
        Ok((!cancelled).then(|| reached.energy()))
    }
}
