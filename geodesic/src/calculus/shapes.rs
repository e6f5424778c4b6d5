//! The calculus on shapes: entry points.

use super::anderson::SolveStatus;
use super::deformations::{DeformationSpace, SolveReport};
use super::params::CalculusParams;
use super::regrid::{carried, outline, regridded};
use super::space::{Ladder, PathSpace};
use crate::cells::object_cells;
use crate::error::GeodesicError;
use crate::lagrangian::{LagrangianPath, lagrangian_path, step_between};
use crate::overlap::largest_share_outside;
use crate::params::{DomainChoice, GeodesicParams};
use crate::shape::Shape;
use fe_grid::compiled_once;
use fe_grid::minimise::Observer;
use fe_grid::vector::{axpy, scale};
use fe_grid::{Certificate, Field, ScalarField, certify_within};

/// Deformations of one start shape, a part of a path.
#[derive(Clone, Debug)]
pub struct Piece<const D: usize> {
    /// The level set of the start shape.
    pub start: ScalarField<f64, D>,
    /// The displacement of the deformation from which the piece continues.
    pub from: Field<f64, D, D>,
    /// Displacements of the subsequent deformations.
    pub displacements: Vec<Field<f64, D, D>>,
}

/// The extension of a geodesic.
#[derive(Clone, Debug)]
pub struct Extension<const D: usize> {
    /// The extension as deformations of the start shape and, after the void is too compressed, of
    /// later shapes of the path. Contains fewer deformations than requested if the path ends early.
    pub pieces: Vec<Piece<D>>,
    /// Energies `W_k` of the steps.
    pub step_energies: Vec<f64>,
    /// Certificate of the worst deformation inside its start shape: certified if its determinant is
    /// positive on all cells that meet the shape.
    pub certificate: Certificate,
    /// The largest share of a shape that lies outside of the box of the grid, where it is cut off.
    pub outside: f64,
    /// Reports of all equations, in order.
    pub reports: Vec<SolveReport>,
}

impl<const D: usize> Extension<D> {
    /// Returns the status of the last equation.
    pub fn status(&self) -> SolveStatus {
        status(&self.reports)
    }

    /// Measures what has left the box.
    fn measured(mut self) -> Result<Self, GeodesicError> {
        for piece in &self.pieces {
            let found = largest_share_outside(&piece.start, &piece.displacements)?;
            self.outside = self.outside.max(found);
        }
        Ok(self)
    }

    /// Computes the shapes of the extension, and the displacement of the deformation of each from
    /// the preceding one, on the domain of the latter.
    ///
    /// # Errors
    /// [`GeodesicError::Shape`] for a shape without a boundary.
    pub fn shapes(
        &self,
    ) -> Result<(Vec<ScalarField<f64, D>>, Vec<Field<f64, D, D>>), GeodesicError> {
        let (mut level_sets, mut steps) = (Vec::new(), Vec::new());
        for piece in &self.pieces {
            let outline = outline(&piece.start)?;
            let mut last = &piece.from;
            for next in &piece.displacements {
                level_sets.push(carried(&outline, next)?);
                steps.push(step_between(last, next));
                last = next;
            }
        }
        Ok((level_sets, steps))
    }
}

/// The transport of a variation along a path.
#[derive(Clone, Debug)]
pub struct Transport<const D: usize> {
    /// The variation at the end of the path, as a displacement on the start domain; `None` if the
    /// ladder could not be completed.
    pub variation: Option<Field<f64, D, D>>,
    /// Reports of all equations, in order.
    pub reports: Vec<SolveReport>,
}

impl<const D: usize> Transport<D> {
    /// Returns the status of the last equation.
    pub fn status(&self) -> SolveStatus {
        status(&self.reports)
    }
}

/// A logarithm and the geodesic from which it was computed.
#[derive(Clone, Debug)]
pub struct Logarithm<const D: usize> {
    /// `K (psi_1 - id)`: the displacement in unit time at the speed of the first step.
    pub velocity: Field<f64, D, D>,
    /// The geodesic.
    pub path: LagrangianPath<D>,
}

fn status(reports: &[SolveReport]) -> SolveStatus {
    reports
        .last()
        .map_or(SolveStatus::Converged, |report| report.status)
}

fn cancelled(reports: &[SolveReport]) -> bool {
    status(reports) == SolveStatus::Cancelled
}

compiled_once! {
    /// Extends a geodesic of deformations of a start shape, given by the displacements of
    /// `psi_1, ..., psi_k`, by further steps of the same length (`psi_0` is the identity).
    ///
    /// The steps are those of [`PathSpace::exponential`]: extending the first step of a geodesic of
    /// `K` steps reproduces the rest of it. Where an equation has no solution without folding the
    /// void, the last shape becomes the start shape of the rest.
    ///
    /// # Errors
    /// [`GeodesicError`] for parameters out of range, an unsuitable shape, an empty list of
    /// deformations, and deformations on other grids. A path that ends early is not an error: fewer
    /// deformations are returned, and the reports give the reason.
    pub fn exponential<'a, D>(
        start: &'a ScalarField<f64, D>,
        path: &'a [Field<f64, D, D>],
        steps: usize,
        params: &'a CalculusParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Extension<D>, GeodesicError> = exponential_in;
}

fn exponential_in<const D: usize>(
    start: &ScalarField<f64, D>,
    path: &[Field<f64, D, D>],
    steps: usize,
    params: &CalculusParams,
    observer: &mut dyn Observer,
) -> Result<Extension<D>, GeodesicError> {
    let identity = Field::zeros(*start.grid());
    let [before, last] = match path {
        [] => {
            return Err(GeodesicError::Parameter {
                name: "deformations of the path",
                expected: "at least 1",
                value: 0.0,
            });
        }
        [only] => [&identity, only],
        [.., before, last] => [before, last],
    };
    continued(start, [before, last], steps, params, observer)
}

compiled_once! {
    /// Continues a geodesic after two successive deformations of a start shape, given by their
    /// displacements, by further steps, as [`exponential()`].
    ///
    /// A path that was computed on the domain of its end shape ([`Domain::End`](crate::lagrangian::Domain))
    /// is continued on that domain: the last deformation is the identity, the one before is the first
    /// of the path's own, and nothing is interpolated.
    ///
    /// # Errors
    /// As [`exponential()`].
    pub fn continued<'a, D>(
        start: &'a ScalarField<f64, D>,
        last_two: [&'a Field<f64, D, D>; 2],
        steps: usize,
        params: &'a CalculusParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Extension<D>, GeodesicError> = continued_in;
}

fn continued_in<const D: usize>(
    start: &ScalarField<f64, D>,
    last_two: [&Field<f64, D, D>; 2],
    steps: usize,
    params: &CalculusParams,
    observer: &mut dyn Observer,
) -> Result<Extension<D>, GeodesicError> {
    let identity = Field::zeros(*start.grid());
    let [mut before, from] = last_two.map(Clone::clone);
    let mut extension = Extension {
        pieces: Vec::new(),
        step_energies: Vec::with_capacity(steps),
        certificate: Certificate::IDENTITY,
        outside: 0.0,
        reports: Vec::new(),
    };
    let mut piece = Piece {
        start: start.clone(),
        from,
        displacements: Vec::new(),
    };
    loop {
        let left = steps - extension.step_energies.len();
        let reports = std::mem::take(&mut extension.reports);
        let mut space =
            DeformationSpace::new(&piece.start, params, steps, observer)?.after(reports);
        piece.displacements = space.exponential(&before, &piece.from, left)?;
        let mut last = &piece.from;
        for next in &piece.displacements {
            // The equation has been solved, so the energy is finite.
            let energy = space.energy(last, next)?.unwrap_or(f64::INFINITY);
            extension.step_energies.push(energy);
            last = next;
        }
        extension.reports = space.into_reports();
        let found = certificate(&piece.start, &piece.displacements);
        extension.certificate = Certificate::worst([extension.certificate, found]);
        let on = piece.displacements.len();
        let finished = on == left || cancelled(&extension.reports);
        let stuck = on == 0 && !extension.pieces.is_empty();
        if finished || stuck {
            extension.pieces.push(piece);
            return extension.measured();
        }
        let (second_last, last) = match piece.displacements.as_slice() {
            [] => (&before, &piece.from),
            [only] => (&piece.from, only),
            [.., before, last] => (before, last),
        };
        let renewed = match regridded(&piece.start, last, &[second_last], params) {
            // The shape has left the box.
            Err(GeodesicError::Degenerate { .. } | GeodesicError::Shape(_)) => None,
            renewed => Some(renewed?),
        };
        extension.pieces.push(piece);
        let Some((shape, mut moved)) = renewed else {
            return extension.measured();
        };
        piece = Piece {
            start: shape,
            from: identity.clone(),
            displacements: Vec::new(),
        };
        before = moved.swap_remove(0);
    }
}

compiled_once! {
    /// Shoots from a start shape with an initial velocity, a displacement per unit time: computes the
    /// deformations `psi_1 = id + v / K, psi_2, ..., psi_K` of the discrete geodesic of `K` steps. The
    /// last of them is `exp(v) + O(1/K)`.
    ///
    /// # Errors
    /// As [`exponential()`], and [`GeodesicError::Parameter`] for no steps.
    pub fn shoot<'a, D>(
        start: &'a ScalarField<f64, D>,
        velocity: &'a Field<f64, D, D>,
        steps: usize,
        params: &'a CalculusParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Extension<D>, GeodesicError> = shoot_in;
}

fn shoot_in<const D: usize>(
    start: &ScalarField<f64, D>,
    velocity: &Field<f64, D, D>,
    steps: usize,
    params: &CalculusParams,
    observer: &mut dyn Observer,
) -> Result<Extension<D>, GeodesicError> {
    if steps == 0 {
        return Err(GeodesicError::Parameter {
            name: "steps",
            expected: "at least 1",
            value: 0.0,
        });
    }
    let identity = Field::zeros(*start.grid());
    let mut first = velocity.clone();
    scale(1.0 / steps as f64, first.as_mut_slice());
    let given = std::slice::from_ref(&first);
    let mut shot = exponential(start, given, steps - 1, params, observer)?;
    let space = DeformationSpace::new(start, params, 0, observer)?;
    let energy = space.energy(&identity, &first)?.unwrap_or(f64::INFINITY);
    shot.step_energies.insert(0, energy);
    shot.certificate = Certificate::worst([shot.certificate, certificate(start, given)]);
    shot.outside = shot.outside.max(largest_share_outside(start, given)?);
    // There is at least one piece, which continues from the first deformation.
    let piece = &mut shot.pieces[0];
    piece.from = identity;
    piece.displacements.insert(0, first);
    Ok(shot)
}

/// Computes the discrete logarithm of a shape with respect to another: the initial velocity of the
/// geodesic of `params.steps` steps between them. It is determined up to a rigid motion of the
/// first step, under which the energy is invariant: that is chosen which moves the matter to its place at
/// the end when it is repeated in every step, as [`shoot`] does. The path is computed on the domain of the start
/// shape, where the velocity is given.
///
/// # Errors
/// Those of [`lagrangian_path`].
pub fn logarithm<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Logarithm<D>, GeodesicError> {
    let params = GeodesicParams {
        domain: DomainChoice::Start,
        ..params.clone()
    };
    let path = lagrangian_path(
        &Shape::new(start.clone()),
        &Shape::new(end.clone()),
        &params,
        observer,
    )?;
    // The parameters were checked, so the path has at least one step.
    let steps = path.displacements.len();
    let (first, last) = (&path.displacements[0], &path.displacements[steps - 1]);
    let own = if first.grid() == start.grid() {
        let space = DeformationSpace::new(start, &CalculusParams::from(&params), 0, observer)?;
        space.on_the_way(first, last, steps)
    } else {
        // A cancelled path, on a coarser grid.
        first.clone()
    };
    let mut velocity = own;
    scale(steps as f64, velocity.as_mut_slice());
    Ok(Logarithm { velocity, path })
}

compiled_once! {
    /// Transports a variation of a start shape, a displacement on its domain, along a path of
    /// deformations given by the displacements of `psi_1, ..., psi_K`, to the last of them: see
    /// [`PathSpace::transport`]. If an equation has no solution without folding the void, this rung
    /// and the later ones are computed on the domains of the shapes at which they begin.
    ///
    /// # Errors
    /// As [`exponential()`]. A ladder that cannot be completed is not an error: no variation is
    /// returned.
    pub fn transport<'a, D>(
        start: &'a ScalarField<f64, D>,
        path: &'a [Field<f64, D, D>],
        variation: &'a Field<f64, D, D>,
        ladder: Ladder,
        params: &'a CalculusParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Transport<D>, GeodesicError> = transport_in;
}

fn transport_in<const D: usize>(
    start: &ScalarField<f64, D>,
    path: &[Field<f64, D, D>],
    variation: &Field<f64, D, D>,
    ladder: Ladder,
    params: &CalculusParams,
    observer: &mut dyn Observer,
) -> Result<Transport<D>, GeodesicError> {
    let identity = Field::zeros(*start.grid());
    let steps = path.len();
    let equations = 2 * steps * if ladder.symmetric { 2 } else { 1 };
    let share = ladder.share_of(steps);
    let mut space = DeformationSpace::new(start, params, equations, observer)?;
    let mut variation = variation.clone();
    let (mut a, mut jammed) = (&identity, false);
    for b in path {
        let mut found = None;
        if !jammed {
            found = space.carried(a, b, &variation, share, ladder.symmetric)?;
        }
        if found.is_none() && !cancelled(space.reports()) {
            jammed = true;
            let side = space.combination(1.0, a, share, &variation);
            let (shape, moved) = regridded(start, a, &[b, &side], params)?;
            let mut near = space.elsewhere(&shape)?;
            let (next, side) = (&moved[0], &moved[1]);
            let own = near.combination(1.0 / share, side, 0.0, side);
            let carried = near.carried(&identity, next, &own, share, ladder.symmetric)?;
            // The same displacement of the same matter, on the domain of the path.
            found = carried.map(|carried| carried.compose(a.as_slice()));
            let reports = near.into_reports();
            space = space.after(reports);
        }
        let Some(next) = found else {
            return Ok(Transport {
                variation: None,
                reports: space.into_reports(),
            });
        };
        variation = next;
        a = b;
    }
    Ok(Transport {
        variation: Some(variation),
        reports: space.into_reports(),
    })
}

compiled_once! {
    /// Computes the shape at the end of a path of deformations of a start shape, given by the
    /// displacement of the last of them, and a variation there as a displacement on the domain of
    /// that shape.
    ///
    /// # Errors
    /// [`GeodesicError`] for fields on other grids and shapes without a boundary.
    pub fn at_end<'a, D>(
        start: &'a ScalarField<f64, D>,
        last: &'a Field<f64, D, D>,
        variation: &'a Field<f64, D, D>,
        params: &'a CalculusParams,
    ) -> Result<(ScalarField<f64, D>, Field<f64, D, D>), GeodesicError> = at_end_in;
}

fn at_end_in<const D: usize>(
    start: &ScalarField<f64, D>,
    last: &Field<f64, D, D>,
    variation: &Field<f64, D, D>,
    params: &CalculusParams,
) -> Result<(ScalarField<f64, D>, Field<f64, D, D>), GeodesicError> {
    if *last.grid() != *start.grid() || *variation.grid() != *start.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    let mut moved = last.clone();
    axpy(1.0, variation.as_slice(), moved.as_mut_slice());
    let (shape, mut fields) = regridded(start, last, &[&moved], params)?;
    Ok((shape, fields.swap_remove(0)))
}

/// Returns the certificate of the worst of some deformations inside a start shape.
fn certificate<const D: usize>(
    start: &ScalarField<f64, D>,
    displacements: &[Field<f64, D, D>],
) -> Certificate {
    let object = object_cells(start);
    let found = displacements.iter().map(|displacement| {
        let values = displacement.as_slice();
        certify_within(start.grid(), values, 0.0, f64::INFINITY, Some(&object))
    });
    Certificate::worst(std::iter::once(Certificate::IDENTITY).chain(found))
}
