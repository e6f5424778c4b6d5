//! Shapes that lie turned among the others.
//!
//! A rotation of a whole shape costs nothing. But a minimiser that begins with the identity follows rotations up to some 45
//! degrees only, and shapes that lie upside down are bent the short way. Whether they should be turned is not known: tall
//! and wide ellipses may be one ellipse in two positions, or two that lie as they should, as organs do in a scanner. So
//! nothing is turned here, and shapes are named that overlap much better after a rotation, see [`Turn`], if on a coarse grid
//! the functional is smaller from there, and the elastic energy clearly smaller than from the identity and in the result.

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
/// Beside letters that lie upside down, those that the minimiser turned by 45 degrees had a quarter to two fifths of the
/// elastic energy of these.
const BENT_SHARE: f64 = 0.5;

/// Shapes that fit much better after their turns, and the energy that is reached from there on a coarse grid.
pub(crate) struct Found {
    list: Vec<Turned>,
    /// The shape that they are turned onto, unless that is a fixed average.
    reference: usize,
    energy: Energy,
}

impl Found {
    /// The shapes that lie turned in a result, if its elastic energy is clearly more than that after the turns. Each, or the
    /// one that it is turned onto, is bent by a large share of what any shape is, if such shapes make the result doubtful:
    /// others have been turned by the minimiser.
    pub fn beside(self, result: &Energy, params: &AverageParams) -> Vec<Turned> {
        // Without the shares that a median gives to the shapes.
        let weights = params.resolved_weights(result.elastic.len());
        let weighted = weights.iter().zip(&result.elastic);
        let elastic = weighted.map(|(weight, elastic)| weight * elastic).sum();
        if !clearly_more(elastic, &self.energy) {
            return Vec::new();
        }
        let both = result.elastic.iter().zip(&self.energy.elastic);
        let saved: Vec<f64> = both.map(|(here, there)| here - there).collect();
        let most = saved.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let bent = |shape: usize| saved[shape] >= BENT_SHARE * most;
        let turned = |one: &&Turned| bent(one.shape) || bent(self.reference);
        let left: Vec<_> = self.list.iter().filter(turned).copied().collect();
        // A name too many is better than a doubt that is lost.
        let doubtful = |list: &[Turned]| list.iter().any(|one| one.doubt().is_some());
        if doubtful(&self.list) && !doubtful(&left) {
            self.list
        } else {
            left
        }
    }
}

/// Whether the elastic energy is clearly more than another one, and more than what is resolved of the functional.
fn clearly_more(elastic: f64, other: &Energy) -> bool {
    elastic > CLEARLY_MORE * other.elastic_scale()
}

/// The best turns of shapes onto one other shape.
struct Turns<const D: usize> {
    /// The other one.
    reference: usize,
    /// Those of the shapes of this process.
    own: Vec<Option<Turn<D>>>,
    /// Of the shapes of all processes the angles, in degrees, zero of those that do not lie turned, and the two mismatches.
    all: Vec<[f64; 3]>,
}

impl<const D: usize> Turns<D> {
    /// The shapes of all processes that fit much better after their turns.
    fn list(&self) -> Vec<Turned> {
        let all = self.all.iter().enumerate();
        let turned = all.filter(|(_, [degrees, ..])| *degrees > 0.0);
        let turned = turned.map(|(shape, [degrees, mismatches @ ..])| Turned {
            shape,
            degrees: *degrees,
            mismatches: *mismatches,
        });
        turned.collect()
    }
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
        let onto_first = self.onto(first, 0);
        let identity = &mut None;
        let found = self.named(&onto_first, identity, observer)?;
        let cancelled = observer.between() == Control::Cancel;
        if fixed || found.is_some() || self.shapes.len() < 3 || cancelled {
            return Ok(found);
        }
        // A round shape has no angle: the one that fits the first one least tells, too. If that is near, so are all to
        // each other.
        let farthest = onto_first.all.iter().map(|[_, as_it_lies, _]| *as_it_lies);
        let farthest = farthest.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        match farthest {
            Some((other, apart)) if apart >= 0.5 * APART => {
                let turns = self.onto(&self.shapes[other], other);
                self.named(&turns, identity, observer)
            }
            _ => Ok(None),
        }
    }

    /// The shapes that fit much better after their turns, if the functional is smaller after all of them than from the
    /// identity, and the elastic energy clearly so. The energy from the identity is computed once. Collective.
    fn named(
        &self,
        turns: &Turns<D>,
        identity: &mut Option<Energy>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Found>, AverageError> {
        let list = turns.list();
        if list.is_empty() {
            return Ok(None);
        }
        if identity.is_none() {
            *identity = self.reached(&[], observer)?;
        }
        let Some(identity) = identity else {
            return Ok(None);
        };
        let grid = *self.levels[0].grid();
        let displacement = |turn: &Option<Turn<D>>| match turn.filter(lies_turned) {
            Some(turn) => turn.motion().displacement(grid),
            None => Field::zeros(grid),
        };
        let start: Vec<_> = turns.own.iter().map(displacement).collect();
        let turned = self.reached(&start, observer)?;
        let better = |turned: &Energy| {
            turned.total < identity.total && clearly_more(identity.parts[0], turned)
        };
        let turned = turned.filter(better);
        Ok(turned.map(|energy| Found {
            list,
            reference: turns.reference,
            energy,
        }))
    }

    /// Whether parts of shapes are hidden. Collective.
    fn hidden(&self) -> bool {
        let level = &self.levels[self.levels.len() - 1];
        let hides = |seen: &ScalarField<f64, D>| seen.as_slice().iter().any(|w| *w < 1.0);
        let own = (0..level.n_own()).map(|i| level.seen().get(i).is_some_and(hides));
        let own: Vec<_> = own.map(|hidden| [f64::from(u8::from(hidden))]).collect();
        level
            .distribution()
            .share(&own)
            .iter()
            .any(|[one]| *one > 0.0)
    }

    /// The best turns of all shapes onto another one. Collective.
    fn onto(&self, onto: &ScalarField<f64, D>, reference: usize) -> Turns<D> {
        let distribution = self.levels[0].distribution();
        let shapes = &self.shapes[distribution.own()];
        let own = parallel::map(shapes, &|shape| Turn::best(shape, onto));
        let numbers = own.iter().map(|turn| {
            // What vanishes on the coarse grid overlaps with nothing.
            let Some(turn) = turn else {
                return [0.0, 1.0, 1.0];
            };
            let degrees = turn.motion().angle().to_degrees();
            let [as_it_lies, turned] = turn.mismatches();
            [
                if lies_turned(turn) { degrees } else { 0.0 },
                as_it_lies,
                turned,
            ]
        });
        let all = distribution.share(&numbers.collect::<Vec<_>>());
        Turns {
            reference,
            own,
            all,
        }
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
        let found = reached.energy();
        // Without terms where no start was admissible.
        let known = !cancelled && !found.elastic.is_empty();
        Ok(known.then_some(found))
    }
}

fn lies_turned<const D: usize>(turn: &Turn<D>) -> bool {
    turn.mismatches()[0] >= APART && turn.clearly_better()
}
