//! Shapes that lie turned among the others.
//!
//! A rotation of a whole shape costs nothing. But a minimiser that begins with the identity follows rotations up to some 45
//! degrees only, and shapes that lie upside down are bent the short way. Whether they should be turned is not known: tall
//! and wide ellipses may be one ellipse in two positions, or two that lie as they should, as organs do in a scanner. So
//! nothing is turned here, and shapes are named that overlap much better after a rotation, see [`Turn`], if on a coarse grid
//! the functional is smaller from there, and the elastic energy clearly smaller than from the identity and in the result.

use crate::doubts::RESOLVED_SHARE;
use crate::energy::Energy;
use crate::error::AverageError;
use crate::hierarchy::{Levels, solve_levels};
use crate::level::LevelShapes;
use crate::params::{AverageParams, BoundaryCondition};
use crate::quiet::Quiet;
use crate::result::Turned;
use fe_grid::minimise::{Control, Observer};
use fe_grid::{Field, ScalarField, parallel};
use levelset::Turn;

/// Number of nodes along the longest side (2D, 3D) of the first grid that tells from where the functional is smaller. On 17
/// nodes a side, energies of plane stars varied with the order of the shapes by more than what was to be seen.
const COMPARED_NODES: [usize; 2] = [33, 17];
/// Shapes of less mismatch as they lie are near each other. Nearly round ones that swell to one side and to the other
/// have .1 to .2, ellipses whose axes differ by a half, across each other, .4.
const APART: f64 = 0.25;
/// An elastic energy is clearly more than another one from this multiple on.
const CLEARLY_MORE: f64 = 1.5;

/// Shapes that fit much better after their turns, and the energy that is reached from there on a coarse grid.
pub(crate) struct Found {
    list: Vec<Turned>,
    energy: Energy,
}

impl Found {
    /// The shapes that lie turned: all, if the elastic energy of the result is clearly more than that after their turns;
    /// none where the minimiser has found these itself.
    pub fn beside(self, result: &Energy) -> Vec<Turned> {
        if clearly_more(result, &self.energy) {
            self.list
        } else {
            Vec::new()
        }
    }
}

/// Whether the elastic energy is clearly more than another one, and more than what is resolved of the functional.
fn clearly_more(energy: &Energy, other: &Energy) -> bool {
    let resolved = RESOLVED_SHARE * other.total;
    energy.parts[0] > CLEARLY_MORE * other.parts[0].max(resolved)
}

/// Shapes that may be turned, and what they are deformed onto.
pub(crate) struct Turnable<'a, const D: usize> {
    /// The signed distances of all shapes.
    pub shapes: &'a [ScalarField<f64, D>],
    /// The signed distance of the fixed average that they are deformed onto, and its phase fields on every level.
    pub onto: Option<(&'a ScalarField<f64, D>, &'a [Vec<f64>])>,
    /// The shapes of this process.
    pub levels: &'a [LevelShapes<D>],
    pub params: &'a AverageParams,
}

impl<const D: usize> Turnable<'_, D> {
    /// The shapes of all processes that may lie turned, if there are any. Collective.
    ///
    /// # Errors
    /// Those of the minimisation.
    pub fn turned(&self, observer: &mut dyn Observer) -> Result<Option<Found>, AverageError> {
        // Fixed faces do not turn, and hidden parts are not compared.
        if self.params.boundary != BoundaryCondition::Natural || self.hidden() {
            return Ok(None);
        }
        let (first, fixed) = match self.onto {
            Some((average, _)) => (average, true),
            None => (&self.shapes[0], false),
        };
        let onto_first = self.onto(first);
        let as_they_lie = self.share(&onto_first, |turn| turn.mismatches()[0]);
        let identity = &mut None;
        let found = self.named(&onto_first, identity, observer)?;
        if fixed || found.is_some() {
            return Ok(found);
        }
        // A round shape has no angle: the one that fits the first one least tells, too.
        let farthest = as_they_lie.iter().enumerate();
        let farthest = farthest.max_by(|a, b| a.1.total_cmp(b.1));
        match farthest {
            Some((other, _)) if other > 0 => {
                self.named(&self.onto(&self.shapes[other]), identity, observer)
            }
            _ => Ok(found),
        }
    }

    /// The shapes that fit much better after their turns, if the functional is clearly smaller after all of them than that
    /// from the identity, which is computed once. Collective.
    fn named(
        &self,
        turns: &[Option<Turn<D>>],
        identity: &mut Option<Energy>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Found>, AverageError> {
        let list = self.list(turns);
        if list.is_empty() {
            return Ok(None);
        }
        if identity.is_none() {
            *identity = self.reached(&[], observer)?;
        }
        let grid = *self.levels[0].grid();
        let displacement = |turn: &Option<Turn<D>>| match turn.filter(lies_turned) {
            Some(turn) => turn.motion().displacement(grid),
            None => Field::zeros(grid),
        };
        let start: Vec<_> = turns.iter().map(displacement).collect();
        let turned = self.reached(&start, observer)?;
        Ok(identity
            .as_ref()
            .zip(turned)
            .and_then(|(identity, energy)| {
                let better = energy.total < identity.total && clearly_more(identity, &energy);
                better.then_some(Found { list, energy })
            }))
    }

    /// Whether parts of shapes are hidden. Collective.
    fn hidden(&self) -> bool {
        let level = &self.levels[0];
        let hides = |seen: &ScalarField<f64, D>| seen.as_slice().iter().any(|w| *w < 1.0);
        let own = (0..level.n_own()).map(|i| level.seen().get(i).is_some_and(hides));
        let own: Vec<_> = own.map(|hidden| [f64::from(u8::from(hidden))]).collect();
        level
            .distribution()
            .share(&own)
            .iter()
            .any(|[one]| *one > 0.0)
    }

    /// The best turns of the shapes of this process onto another one.
    fn onto(&self, reference: &ScalarField<f64, D>) -> Vec<Option<Turn<D>>> {
        let own = &self.shapes[self.levels[0].distribution().own()];
        parallel::map(own, &|shape| Turn::best(shape, reference))
    }

    /// A number of the turns of all shapes; zero of none. Collective.
    fn share(&self, turns: &[Option<Turn<D>>], number: fn(&Turn<D>) -> f64) -> Vec<f64> {
        let own = turns.iter().map(|turn| [turn.as_ref().map_or(0.0, number)]);
        let all = self.levels[0]
            .distribution()
            .share(&own.collect::<Vec<_>>());
        all.into_iter().map(|[number]| number).collect()
    }

    /// The shapes of all processes that fit much better after their turns. Collective.
    fn list(&self, turns: &[Option<Turn<D>>]) -> Vec<Turned> {
        let angles = self.share(turns, |turn| {
            let degrees = turn.motion().angle().to_degrees();
            if lies_turned(turn) { degrees } else { 0.0 }
        });
        let as_they_lie = self.share(turns, |turn| turn.mismatches()[0]);
        let after = self.share(turns, |turn| turn.mismatches()[1]);
        let mismatches = as_they_lie.into_iter().zip(after);
        let all = angles.into_iter().zip(mismatches).enumerate();
        let all = all.filter(|(_, (degrees, _))| *degrees > 0.0);
        let turned = all.map(|(shape, (degrees, (as_it_lies, after)))| Turned {
            shape,
            degrees,
            mismatches: [as_it_lies, after],
        });
        turned.collect()
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
            nodes.max() >= Some(COMPARED_NODES[usize::from(D == 3)])
        };
        let last = self.levels.len() - 1;
        let last = self.levels.iter().position(resolved).unwrap_or(last);
        let start = start.iter().map(Field::as_slice).collect();
        let mut problem = Levels::new(self.levels[..=last].to_vec(), self.params).from(start);
        if let Some((_, targets)) = self.onto {
            problem = problem.onto(targets[..=last].to_vec());
        }
        let reached = solve_levels(problem, &mut Quiet(observer))?;
        let cancelled = reached.cancelled() || observer.between() == Control::Cancel;
        Ok((!cancelled).then(|| reached.energy()))
    }
}

fn lies_turned<const D: usize>(turn: &Turn<D>) -> bool {
    turn.mismatches()[0] >= APART && turn.clearly_better()
}
