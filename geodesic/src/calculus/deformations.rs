//! The space of deformations of one start shape.

use super::anderson::{Anderson, Correction, SolveStatus, Solved};
use super::geometry::Geometry;
use super::params::CalculusParams;
use super::space::PathSpace;
use crate::error::GeodesicError;
use fe_grid::minimise::Observer;
use fe_grid::vector::{add_scaled_into, axpy, copy_into, norm, scale};
use fe_grid::{Field, LinearOperator, ScalarField, compiled_once};
use hyperelastic::CorotationalMultigrid;
use serde::Serialize;

/// A solution is accepted if the remaining correction is at most this fraction of the step, even if
/// the requested tolerance was not reached.
const ACCEPTED: f64 = 1e-3;

/// Report on the solution for one point of a geodesic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolveReport {
    /// Status at the end.
    pub status: SolveStatus,
    /// Number of iterations.
    pub iterations: usize,
    /// Number of evaluations of the forces.
    pub evaluations: usize,
    /// Remaining correction, relative to the distance between the two given points; infinite if the
    /// initial state was folded.
    #[serde(skip_serializing_if = "is_infinite")]
    pub correction: f64,
    /// Whether the point was accepted.
    pub accepted: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_infinite(correction: &f64) -> bool {
    !correction.is_finite()
}

/// Deformations `psi` of a start shape, given by their displacements, with the energy of a step
///
/// ```text
/// W(a, b) = int ((1 - delta) chi + delta) det Da W(Db (Da)^{-1}) + nu (1 - chi) |D(b - a)|^2 / 2,
/// ```
///
/// see [`PathDissipation`](crate::PathDissipation). The extension and the midpoint equation are
/// solved at all nodes by Anderson acceleration of `x + P r(x)`, with the residual
/// `r = d_2 W + d_1 W` and the inverse metric `P` at a known deformation; the rigid motion left
/// undetermined is chosen as described in [`calculus`](super).
pub struct DeformationSpace<'a, const D: usize> {
    geometry: Geometry<D>,
    observer: &'a mut dyn Observer,
    /// Expected number of equations, for the observer.
    expected: usize,
    reports: Vec<SolveReport>,
}

impl<'a, const D: usize> DeformationSpace<'a, D> {
    /// Creates the space of deformations of the shape `{level_set > 0}`. The observer is notified
    /// of every equation, out of the expected number, as of a level, with the remaining correction
    /// in place of an energy.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] for parameters out of range,
    /// [`GeodesicError::FrameDependent`] for linear elasticity, [`GeodesicError::Degenerate`] and
    /// [`GeodesicError::NotFinite`] for a level set without an interior.
    pub fn new(
        level_set: &ScalarField<f64, D>,
        params: &CalculusParams,
        expected: usize,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, GeodesicError> {
        Ok(Self {
            geometry: Geometry::new(level_set, params)?,
            observer,
            expected,
            reports: Vec::new(),
        })
    }

    /// Returns the reports of all equations solved.
    pub fn reports(&self) -> &[SolveReport] {
        &self.reports
    }

    /// Prepends reports of equations that were solved before in another space.
    pub(super) fn after(mut self, reports: Vec<SolveReport>) -> Self {
        self.reports = reports;
        self
    }

    /// Returns the space of another start shape, with the same parameters.
    pub(super) fn elsewhere(
        &mut self,
        level_set: &ScalarField<f64, D>,
    ) -> Result<DeformationSpace<'_, D>, GeodesicError> {
        let params = &self.geometry.params;
        let reports = std::mem::take(&mut self.reports);
        let space = DeformationSpace::new(level_set, params, self.expected, &mut *self.observer)?;
        Ok(space.after(reports))
    }

    pub(super) fn into_reports(self) -> Vec<SolveReport> {
        self.reports
    }

    /// Returns the root mean square of a displacement over the matter of the start shape.
    pub fn norm(&self, displacement: &Field<f64, D, D>) -> f64 {
        self.geometry.matter.norm(displacement.as_slice())
    }

    /// Applies to a deformation the rigid motion that brings it nearest to another, over the
    /// matter.
    pub fn nearest(&self, moved: &Field<f64, D, D>, target: &Field<f64, D, D>) -> Field<f64, D, D> {
        let matter = &self.geometry.matter;
        let motion = matter.fit(moved.as_slice(), target.as_slice());
        let mut moved = moved.clone();
        matter.apply(&motion, moved.as_mut_slice());
        moved
    }

    /// Applies to the first deformation of a path the rigid motion with which, repeated in every step, the matter
    /// arrives where the last one moves it.
    pub fn on_the_way(
        &self,
        first: &Field<f64, D, D>,
        last: &Field<f64, D, D>,
        steps: usize,
    ) -> Field<f64, D, D> {
        let matter = &self.geometry.matter;
        let identity = vec![0.0; first.as_slice().len()];
        let whole = matter.fit(&identity, last.as_slice());
        let own = matter.fit(&identity, first.as_slice());
        let mut moved = first.clone();
        matter.apply(
            &whole.root(steps).after(&own.inverse()),
            moved.as_mut_slice(),
        );
        moved
    }

    /// Computes the energy `W(a, b)`; `None` if it is not finite.
    ///
    /// # Errors
    /// [`GeodesicError::GridsDiffer`], and [`GeodesicError::Law`] if the law cannot be constructed.
    pub fn energy(
        &self,
        a: &Field<f64, D, D>,
        b: &Field<f64, D, D>,
    ) -> Result<Option<f64>, GeodesicError> {
        self.check_grids(a, b)?;
        let pair = [a.as_slice(), b.as_slice()].concat();
        self.geometry.energy(&pair, &mut [])
    }

    fn check_grids(&self, a: &Field<f64, D, D>, b: &Field<f64, D, D>) -> Result<(), GeodesicError> {
        if *a.grid() == self.geometry.grid && *b.grid() == self.geometry.grid {
            Ok(())
        } else {
            Err(GeodesicError::GridsDiffer)
        }
    }

    /// Solves for the unknown point from an initial guess, with the metric at a deformation.
    /// `separation` is the distance between the known points.
    fn solve(
        &mut self,
        unknown: Unknown<'_>,
        metric_at: &[f64],
        guess: Vec<f64>,
        separation: f64,
    ) -> Result<Option<Vec<f64>>, GeodesicError> {
        let level = self.reports.len();
        self.observer
            .level(level, self.expected.max(level + 1), guess.len());
        let known = Known {
            geometry: &self.geometry,
            unknown,
            metric_at,
            separation,
        };
        let mut x = guess;
        let solved = solve_equation(&known, &mut x, &mut *self.observer)?;
        let correction = solved.correction / separation;
        let accepted = solved.status == SolveStatus::Converged
            || solved.status != SolveStatus::Cancelled && correction <= ACCEPTED;
        self.reports.push(SolveReport {
            status: solved.status,
            iterations: solved.iterations,
            evaluations: solved.evaluations,
            correction,
            accepted,
        });
        Ok(accepted.then_some(x))
    }

    fn field(&self, values: Vec<f64>) -> Result<Field<f64, D, D>, GeodesicError> {
        Ok(Field::from_vec(self.geometry.grid, values)?)
    }
}

/// Returns `from` plus the step, shortened such that nothing folds.
fn ahead<const D: usize>(geometry: &Geometry<D>, from: &[f64], mut step: Vec<f64>) -> Vec<f64> {
    geometry.restrain(from, &mut step);
    axpy(1.0, from, &mut step);
    step
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len()];
    add_scaled_into(a, -1.0, b, &mut out);
    out
}

impl<const D: usize> PathSpace for DeformationSpace<'_, D> {
    type Point = Field<f64, D, D>;
    type Error = GeodesicError;

    fn extended(
        &mut self,
        a: &Field<f64, D, D>,
        b: &Field<f64, D, D>,
    ) -> Result<Option<Field<f64, D, D>>, GeodesicError> {
        self.check_grids(a, b)?;
        let (a, b) = (a.as_slice(), b.as_slice());
        let step = difference(b, a);
        let separation = norm(&step);
        if separation == 0.0 {
            return self.field(b.to_vec()).map(Some);
        }
        let mut forces = vec![0.0; 2 * b.len()];
        if self
            .geometry
            .energy(&[a, b].concat(), &mut forces)?
            .is_none()
        {
            return Ok(None);
        }
        let unknown = Unknown::Third {
            second: b,
            arriving: &forces[b.len()..],
        };
        let guess = ahead(&self.geometry, b, step);
        let Some(mut found) = self.solve(unknown, b, guess, separation)? else {
            return Ok(None);
        };
        let matter = &self.geometry.matter;
        let motion = matter.fit(a, b).after(&matter.fit(b, &found).inverse());
        matter.apply(&motion, &mut found);
        self.field(found).map(Some)
    }

    fn midpoint(
        &mut self,
        a: &Field<f64, D, D>,
        c: &Field<f64, D, D>,
    ) -> Result<Option<Field<f64, D, D>>, GeodesicError> {
        self.check_grids(a, c)?;
        let mean = self.combination(0.5, a, 0.5, c);
        let (a, c) = (a.as_slice(), c.as_slice());
        let mut step = difference(c, a);
        let separation = norm(&step);
        if separation == 0.0 {
            return Ok(Some(mean));
        }
        scale(0.5, &mut step);
        let guess = ahead(&self.geometry, a, step);
        let unknown = Unknown::Second { first: a, third: c };
        let metric_at = guess.clone();
        let Some(mut found) = self.solve(unknown, &metric_at, guess, separation)? else {
            return Ok(None);
        };
        let matter = &self.geometry.matter;
        let motion = matter.fit(&found, mean.as_slice());
        matter.apply(&motion, &mut found);
        self.field(found).map(Some)
    }

    fn combination(
        &self,
        s: f64,
        x: &Field<f64, D, D>,
        t: f64,
        y: &Field<f64, D, D>,
    ) -> Field<f64, D, D> {
        let mut sum = x.clone();
        scale(s, sum.as_mut_slice());
        axpy(t, y.as_slice(), sum.as_mut_slice());
        sum
    }
}

/// The unknown among the three points of a geodesic.
#[derive(Clone, Copy)]
enum Unknown<'a> {
    /// The second point, between the given ones.
    Second { first: &'a [f64], third: &'a [f64] },
    /// The third point, after `second`; the force `d_2 W` of the preceding step at `second` is
    /// given.
    Third {
        second: &'a [f64],
        arriving: &'a [f64],
    },
}

/// What is known of an equation before it is solved.
struct Known<'a, const D: usize> {
    geometry: &'a Geometry<D>,
    unknown: Unknown<'a>,
    /// The deformation at which the metric is computed.
    metric_at: &'a [f64],
    /// The distance between the known points.
    separation: f64,
}

compiled_once! {
    /// Solves an equation from the initial guess `x`.
    fn solve_equation<'a, D>(
        known: &'a Known<'a, D>,
        x: &'a mut [f64],
        observer: &'a mut dyn Observer,
    ) -> Result<Solved, GeodesicError> = solve_equation_in;
}

fn solve_equation_in<const D: usize>(
    known: &Known<'_, D>,
    x: &mut [f64],
    observer: &mut dyn Observer,
) -> Result<Solved, GeodesicError> {
    let geometry = known.geometry;
    let mut equation = Equation {
        geometry,
        unknown: known.unknown,
        cycle: geometry.cycle(known.metric_at)?,
        modes: geometry.matter.modes(known.metric_at),
        pair: vec![0.0; 2 * x.len()],
        forces: vec![0.0; 2 * x.len()],
        residual: vec![0.0; x.len()],
    };
    let solver = Anderson {
        history: geometry.params.history,
        max_iterations: geometry.params.max_iterations,
        tolerance: geometry.params.tolerance * known.separation,
    };
    solver.solve(&mut equation, x, observer)
}

/// The equation `d_2 W(a, b) + d_1 W(b, c) = 0` for one of the points.
struct Equation<'a, const D: usize> {
    geometry: &'a Geometry<D>,
    unknown: Unknown<'a>,
    cycle: CorotationalMultigrid<D>,
    modes: Vec<Vec<f64>>,
    /// Two displacements, and the forces on both.
    pair: Vec<f64>,
    forces: Vec<f64>,
    residual: Vec<f64>,
}

impl<const D: usize> Equation<'_, D> {
    /// Computes the forces of a step; returns false if its energy is not finite.
    fn evaluate(&mut self, a: &[f64], b: &[f64]) -> Result<bool, GeodesicError> {
        let dim = a.len();
        copy_into(a, &mut self.pair[..dim]);
        copy_into(b, &mut self.pair[dim..]);
        self.forces.fill(0.0);
        let energy = self.geometry.energy(&self.pair, &mut self.forces)?;
        Ok(energy.is_some())
    }
}

impl<const D: usize> Correction for Equation<'_, D> {
    fn correction_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<bool, GeodesicError> {
        let dim = x.len();
        if !self.geometry.admits(x) {
            return Ok(false);
        }
        // The derivative of the residual is close to -A for the third point and to 2 A for the
        // second.
        let factor = match self.unknown {
            Unknown::Third { second, arriving } => {
                if !self.evaluate(second, x)? {
                    return Ok(false);
                }
                add_scaled_into(arriving, 1.0, &self.forces[..dim], &mut self.residual);
                1.0
            }
            Unknown::Second { first, third } => {
                if !self.evaluate(first, x)? {
                    return Ok(false);
                }
                copy_into(&self.forces[dim..], &mut self.residual);
                if !self.evaluate(x, third)? {
                    return Ok(false);
                }
                axpy(1.0, &self.forces[..dim], &mut self.residual);
                -0.5
            }
        };
        self.cycle.apply_into(&self.residual, out);
        scale(factor, out);
        for mode in &self.modes {
            self.geometry.matter.remove(mode, out);
        }
        Ok(true)
    }

    fn restrain(&self, x: &[f64], step: &mut [f64]) {
        self.geometry.restrain(x, step);
    }
}
