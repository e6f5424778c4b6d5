//! The result of a geodesic, common to both forms.

use crate::cells::object_cells;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::lagrangian::{
    Domain, Eulerian, LagrangianPath, eulerian, lagrangian_path, lagrangian_path_back,
};
use crate::level_sets::{PathState, first_paths, level_set_path};
use crate::levels::LevelReport;
use crate::overlap::{Overlaps, carried_overlaps, is_reached, overlaps, worst};
use crate::params::{DomainChoice, Form, GeodesicParams};
use crate::shape::{Known, Shape, on_grid, union_of};
use fe_grid::compiled_once;
use fe_grid::minimise::{Observer, Status};
use fe_grid::{Certificate, Field, ScalarField, certify_within};
use serde::Serialize;

/// A discrete geodesic: shapes and the deformations between them.
#[derive(Clone, Debug, Serialize)]
pub struct Geodesic<const D: usize> {
    /// Level sets `u_0, ..., u_K`, positive inside; those of the union if there are several
    /// components.
    #[serde(skip)]
    pub level_sets: Vec<ScalarField<f64, D>>,
    /// The level sets of the components of the shapes `0, ..., K`; empty if there is one component.
    #[serde(skip)]
    pub components: Vec<Vec<ScalarField<f64, D>>>,
    /// Displacements of `phi_1, ..., phi_K`: `phi_k(x) = x + displacement(x)` deforms the shape
    /// `k - 1` into the shape `k`.
    #[serde(skip)]
    pub displacements: Vec<Field<f64, D, D>>,
    /// Displacements of `psi_1, ..., psi_K`, the deformations of the start shape into every other;
    /// paths of one start domain only.
    #[serde(skip)]
    pub motions: Vec<Field<f64, D, D>>,
    /// The domain on which the path was computed; paths of one domain only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domain: Option<Domain>,
    /// Displacement that carries the shape of that domain to the other end.
    #[serde(skip)]
    pub across: Option<Field<f64, D, D>>,
    /// Terms of the energy.
    #[serde(flatten)]
    pub energy: PathEnergy,
    /// Certificate of the worst deformation inside its shape: certified if the determinant is
    /// positive on all cells that meet the shape. For paths of one domain it is that of the
    /// deformations of that domain, from the shape there into every other.
    pub certificate: Certificate,
    /// Dice overlap of the end shape with the deformed start shape, where both are known; the
    /// smallest of all components. For a path of the end domain it is that of the start shape with
    /// the end shape that is carried back to it.
    pub dice_end: f64,
    /// Mean distance between the boundaries of the end shape and of the deformed start shape, in
    /// spacings of the grid; of the component where it is largest.
    pub gap_end: f64,
    /// Distance between these boundaries that is not exceeded on 95 % of each, in spacings of the
    /// grid; paths of one domain and fully visible shapes only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub boundary_end: Option<f64>,
    /// Dice overlap of the start shape with the end shape pulled back through all steps, which
    /// decreases with compressed void; the smallest of all components.
    pub dice_pulled: f64,
    /// Dice overlap with the end shape of every component.
    pub dice_components: Vec<f64>,
    /// Convergence history of each level, in order.
    pub levels: Vec<LevelReport>,
    /// A converged status, or else the last level's status.
    #[serde(skip)]
    pub status: Status,
}

impl<const D: usize> Geodesic<D> {
    /// Returns whether the deformations map the start shape approximately to the end shape: to a
    /// Dice overlap of 0.95, or to a mean distance of a quarter of a spacing, and 95 % of the
    /// boundaries to a distance of three spacings. A minimiser may have
    /// converged to a path that does not reach the end shape.
    pub fn end_reached(&self) -> bool {
        is_reached(self.dice_end, self.gap_end, self.boundary_end)
    }

    /// Returns the length `sum sqrt W_k`.
    pub fn length(&self) -> f64 {
        self.energy.length()
    }

    /// Returns the dissipation `K sum W_k`, never less than the square of the length.
    pub fn dissipation(&self) -> f64 {
        self.energy.dissipation()
    }
}

/// Computes the geodesic between two shapes given by their signed distances (positive inside) on
/// one grid.
///
/// The observer is notified of every level and iteration and may cancel; the result is then the
/// state reached so far.
///
/// # Errors
/// [`GeodesicError`] for parameters out of range, shapes on different grids or without inside or
/// outside. Failure to converge is not an error; it is reported in the status.
pub fn geodesic<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    geodesic_between(
        &Shape::new(start.clone()),
        &Shape::new(end.clone()),
        params,
        observer,
    )
}

compiled_once! {
    /// Computes the geodesic between two shapes of one or several components, which may be
    /// partially hidden.
    ///
    /// Components are matched in their order. With the notes' model of a hidden part, a path of
    /// level sets restores it: the first step is matched with the visible part of the shape, and
    /// the shape after it is complete.
    ///
    /// # Errors
    /// As for [`geodesic`], and for shapes with different numbers of components.
    pub fn geodesic_between<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Geodesic<D>, GeodesicError> = geodesic_between_in;
}

compiled_once! {
    /// Computes the geodesics between two shapes in both directions: from the start to the end, and
    /// from there to the start.
    ///
    /// Both are the same in the limit of small steps. The second one is minimised from the first if
    /// that reaches its end, and otherwise by itself; if only the second one does, the first is
    /// minimised from that. The lengths then differ by the discretisation in time, and not because
    /// of different local minima. Paths of level sets, and those of a prescribed domain, are
    /// computed independently.
    ///
    /// # Errors
    /// As for [`geodesic_between`].
    pub fn geodesics_both_ways<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<[Geodesic<D>; 2], GeodesicError> = geodesics_both_ways_in;
}

fn geodesics_both_ways_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<[Geodesic<D>; 2], GeodesicError> {
    check_both(start, end, params)?;
    if params.form != Form::Lagrangian || params.domain != DomainChoice::Better {
        return Ok([
            geodesic_between(start, end, params, observer)?,
            geodesic_between(end, start, params, observer)?,
        ]);
    }
    let path = lagrangian_path(start, end, params, observer)?;
    let mut forth = of_domain(start, end, &path)?;
    if forth.end_reached()
        && let Some(path) = lagrangian_path_back(start, end, &path, params, observer)?
    {
        let back = of_domain(end, start, &path)?;
        if back.end_reached() {
            return Ok([forth, back]);
        }
    }
    let path = lagrangian_path(end, start, params, observer)?;
    let back = of_domain(end, start, &path)?;
    if back.end_reached()
        && !forth.end_reached()
        && let Some(path) = lagrangian_path_back(end, start, &path, params, observer)?
    {
        let again = of_domain(start, end, &path)?;
        if again.end_reached() {
            forth = again;
        }
    }
    Ok([forth, back])
}

fn geodesic_between_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    check_both(start, end, params)?;
    match params.form {
        Form::Lagrangian => {
            let path = lagrangian_path(start, end, params, observer)?;
            of_domain(start, end, &path)
        }
        Form::LevelSets => {
            let paths = first_paths(start, end, params, observer)?;
            let path = level_set_path(&paths, start, end, params, observer)?;
            let PathState {
                shapes,
                displacements,
            } = path.state;
            let level_sets: Vec<_> = shapes.iter().map(|shape| union_of(shape)).collect();
            let pairs = level_sets.iter().zip(&displacements);
            let certificate = Certificate::worst(pairs.map(|(u, phi)| inside(u, phi)));
            let overlaps = overlaps(start, end, &displacements, *level_sets[0].grid())?;
            let found = Found {
                shapes,
                displacements,
                certificate,
                overlaps,
                levels: path.levels,
            };
            Ok(found.finish())
        }
    }
}

/// The result of a path of one domain.
fn of_domain<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &LagrangianPath<D>,
) -> Result<Geodesic<D>, GeodesicError> {
    let Eulerian {
        shapes,
        displacements,
        motions,
    } = eulerian(start.components(), end.components(), path)?;
    let [from, to] = path.domain.order(start, end);
    let across = path.displacements[path.displacements.len() - 1].clone();
    let overlaps = carried_overlaps(from, to, &across)?;
    let own = on_grid(across.grid(), &from.union());
    let certificate = Certificate::worst(path.displacements.iter().map(|psi| inside(&own, psi)));
    let found = Found {
        shapes,
        displacements,
        certificate,
        overlaps,
        levels: path.levels.clone(),
    };
    let mut found = found.finish();
    if path.domain == Domain::End {
        found.energy.step_energies.reverse();
    }
    found.motions = motions;
    found.domain = Some(path.domain);
    found.across = Some(across);
    Ok(found)
}

/// Returns the certificate of a deformation inside a shape.
fn inside<const D: usize>(
    level_set: &ScalarField<f64, D>,
    deformation: &Field<f64, D, D>,
) -> Certificate {
    let object = object_cells(level_set);
    let grid = level_set.grid();
    certify_within(
        grid,
        deformation.as_slice(),
        0.0,
        f64::INFINITY,
        Some(&object),
    )
}

/// Checks the parameters and the shapes of a path.
fn check_both<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
) -> Result<(), GeodesicError> {
    params.check()?;
    check(start, "start")?;
    check(end, "end")?;
    if start.grid() != end.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    let counts = [start.components().len(), end.components().len()];
    if counts[0] != counts[1] {
        return Err(GeodesicError::Components {
            start: counts[0],
            end: counts[1],
        });
    }
    Ok(())
}

fn check<const D: usize>(shape: &Shape<D>, which: &'static str) -> Result<(), GeodesicError> {
    for component in shape.components() {
        let values = component.as_slice();
        if let Some(node) = values.iter().position(|u| !u.is_finite()) {
            return Err(GeodesicError::NotFinite { which, node });
        }
        let inside = values.iter().filter(|&&u| u > 0.0).count();
        if inside == 0 || inside == values.len() {
            let what = if inside == 0 { "empty" } else { "full" };
            return Err(GeodesicError::Degenerate { which, what });
        }
    }
    if let Known::Within(weight) = shape.known() {
        let values = weight.as_slice();
        if let Some(node) = values.iter().position(|w| !(0.0..=1.0).contains(w)) {
            return Err(GeodesicError::Weight { which, node });
        }
        if weight.grid() != shape.grid() {
            return Err(GeodesicError::GridsDiffer);
        }
    }
    Ok(())
}

/// A path in either form, with its figures.
struct Found<const D: usize> {
    shapes: Vec<Vec<ScalarField<f64, D>>>,
    displacements: Vec<Field<f64, D, D>>,
    certificate: Certificate,
    overlaps: Overlaps,
    levels: Vec<LevelReport>,
}

impl<const D: usize> Found<D> {
    fn finish(self) -> Geodesic<D> {
        let Overlaps {
            forwards,
            backwards,
            gap,
            boundary,
        } = self.overlaps;
        let last = self.levels.last();
        let level_sets = self.shapes.iter().map(|shape| union_of(shape)).collect();
        let several = self.shapes.iter().any(|shape| shape.len() > 1);
        Geodesic {
            energy: last.map(|level| level.energy.clone()).unwrap_or_default(),
            status: last.map_or(Status::InadmissibleStart, |l| l.info.status),
            level_sets,
            components: if several { self.shapes } else { Vec::new() },
            displacements: self.displacements,
            motions: Vec::new(),
            domain: None,
            across: None,
            certificate: self.certificate,
            dice_end: worst(&forwards),
            gap_end: gap,
            boundary_end: boundary,
            dice_pulled: worst(&backwards),
            dice_components: forwards,
            levels: self.levels,
        }
    }
}
