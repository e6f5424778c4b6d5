//! The result of a geodesic, common to both forms.

use crate::arrival::{Arrival, pressed};
use crate::cells::object_cells;
use crate::contact::{Contact, contacts};
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::lagrangian::{
    Domain, Eulerian, LagrangianPath, eulerian, lagrangian_path, lagrangian_path_back,
    lagrangian_path_from,
};
use crate::level_sets::{PathState, first_paths, level_set_path};
use crate::levels::LevelReport;
use crate::overlap::{
    End, Overlaps, WholeOverlap, carried_overlaps, largest_share_outside, overlaps, worst,
};
use crate::params::{DomainChoice, Form, GeodesicParams};
use crate::shape::{Shape, check_known, union_of};
use fe_grid::compiled_once;
use fe_grid::minimise::{Observer, Status};
use fe_grid::{Certificate, Field, ScalarField, certify_within};
use levelset::topology::Topology;
use levelset::{BoxEdge, RigidMotion, contour, signed_distance};
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
    /// Displacements of the deformations of the end shape into every other, from there to the start: what a path
    /// of the end domain was computed as.
    #[serde(skip)]
    pub backward_motions: Vec<Field<f64, D, D>>,
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
    /// How all of the deformed shape, with what is hidden, agrees with the visible part of the one at the
    /// other end; paths of the domain of a shape that is hidden in part only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole_end: Option<WholeOverlap>,
    /// How closely these boundaries agree, and where they are pressed together; fully visible shapes
    /// only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival: Option<Arrival>,
    /// Where parts of the boundary are pressed together to reach the end: changes of topology, the
    /// largest first; paths of one domain and fully visible shapes only.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<Contact>,
    /// Parts, holes and tunnels that the carried shape or the end shape has and the other one has not, beyond those of
    /// the contacts; of the same paths.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_topology: usize,
    /// Number of contacts beyond the parts, holes and tunnels in which the shapes differ.
    #[serde(skip_serializing_if = "is_zero")]
    pub needless_contacts: usize,
    /// The largest share of a shape of the path that lies outside of the box of the grid, where the level sets are cut
    /// off; of paths of one domain.
    #[serde(skip_serializing_if = "is_zero")]
    pub outside: f64,
    /// The angle of the rotation that is nearest to the last deformation of the domain's shape, in degrees: by how much the
    /// path turns the shape as a whole. `None` for paths of level sets, and where the nodes inside do not
    /// determine a rotation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_degrees: Option<f64>,
    /// Dice overlap of the start shape with the end shape pulled back through all steps, which
    /// decreases with compressed void; the smallest of all components.
    pub dice_pulled: f64,
    /// Dice overlap with the end shape of every component.
    pub dice_components: Vec<f64>,
    /// Convergence history of each level, in order.
    pub levels: Vec<LevelReport>,
    /// Number of the last of these that are not of this path, but of a longer one on the other domain.
    #[serde(skip)]
    pub discarded_levels: usize,
    /// A converged status, or else the last level's status.
    #[serde(skip)]
    pub status: Status,
}

impl<const D: usize> Geodesic<D> {
    /// Returns whether the path arrives at the end shape: at a Dice overlap of 0.98 or a mean distance
    /// of the boundaries of a quarter of a spacing, and with 95 % of them within half a spacing, slits
    /// and films left out ([`Arrival`]). A minimiser may have converged to a path that does not.
    pub fn end_reached(&self) -> bool {
        self.end().reached()
    }

    /// Returns whether the path ends so close to the end shape that its length is of use: at a Dice
    /// overlap of 0.95 or a mean distance of a quarter of a spacing, and with 95 % of the boundaries
    /// within three spacings.
    pub fn end_near(&self) -> bool {
        self.end().near()
    }

    /// Returns the displacements of the deformations of the domain's shape into every other, from there to the
    /// other end.
    pub(crate) fn own_motions(&self) -> &[Field<f64, D, D>] {
        match self.domain {
            Some(Domain::End) => &self.backward_motions,
            _ => &self.motions,
        }
    }

    /// Returns the report of the level on which the path was minimised last.
    pub fn last_level(&self) -> Option<&LevelReport> {
        let own = self.levels.len().saturating_sub(self.discarded_levels);
        self.levels[..own].last()
    }

    fn end(&self) -> End {
        End {
            dice: self.dice_end,
            gap: self.gap_end,
            arrival: self.arrival,
        }
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
    /// the shape after it is complete. A path of deformations of the other shape restores it, too; one
    /// of the shape that is hidden in part lacks that part at all times ([`Geodesic::whole_end`]).
    ///
    /// # Errors
    /// As for [`geodesic`], for shapes with different numbers of components, and
    /// [`GeodesicError::BothHidden`] where no difference of the shapes counts.
    pub fn geodesic_between<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Geodesic<D>, GeodesicError> = geodesic_between_in;
}

compiled_once! {
    /// Computes a geodesic of one domain, the start shape's, from given deformations of it, such as a rotation
    /// in `K` steps: displacements of `psi_1, ..., psi_K` on one of the grids of the hierarchy. It is the
    /// minimal path in whose valley these lie, which may be another one than that of
    /// [`geodesic_between()`].
    ///
    /// # Errors
    /// As for [`geodesic_between()`]; [`GeodesicError::Given`] for deformations that do not fit.
    pub fn geodesic_from<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        first: &'a [Field<f64, D, D>],
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Geodesic<D>, GeodesicError> = geodesic_from_in;
}

fn geodesic_from_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    first: &[Field<f64, D, D>],
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    check_both(start, end, params)?;
    let path = lagrangian_path_from(start, end, first, params, observer)?;
    Ok(with_deformations(of_domain(start, end, &path)?, path))
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
    // In an order of their own, so that the lengths do not depend on which shape is the start.
    if precedes(end, start) {
        let [back, forth] = geodesics_in_order(end, start, params, observer)?;
        return Ok([forth, back]);
    }
    geodesics_in_order(start, end, params, observer)
}

/// Whether a shape comes before another one: the first value of their signed distances that differs is smaller.
fn precedes<const D: usize>(a: &Shape<D>, b: &Shape<D>) -> bool {
    let values = |shape: &Shape<D>| {
        let components = shape.components().iter();
        components
            .flat_map(|u| u.as_slice().to_vec())
            .collect::<Vec<_>>()
    };
    values(a) < values(b)
}

fn geodesics_in_order<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<[Geodesic<D>; 2], GeodesicError> {
    if params.form != Form::Lagrangian || params.domain != DomainChoice::Better {
        return Ok([
            geodesic_between(start, end, params, observer)?,
            geodesic_between(end, start, params, observer)?,
        ]);
    }
    let (path, mut forth) = shortest_path(start, end, params, observer)?;
    if forth.end_near()
        && let Some(path) = lagrangian_path_back(start, end, &path, params, observer)?
    {
        let back = of_domain(end, start, &path)?;
        if back.end_near() {
            return Ok([forth, back]);
        }
    }
    let (path, back) = shortest_path(end, start, params, observer)?;
    if back.end_near()
        && !forth.end_near()
        && let Some(path) = lagrangian_path_back(end, start, &path, params, observer)?
    {
        let again = of_domain(start, end, &path)?;
        if again.end_near() {
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
            let (path, found) = shortest_path(start, end, params, observer)?;
            Ok(with_deformations(found, path))
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
            let certificate = Certificate::worst(pairs.map(|(u, phi)| certificate_inside(u, phi)));
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

/// Computes a path of deformations on the better of both domains.
///
/// Which is better is seen on coarse grids, where thin parts that lie side by side are one. A path that does not
/// arrive is therefore computed on the other domain, too, on all grids.
///
/// # Errors
/// As for [`lagrangian_path`].
fn shortest_path<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<(LagrangianPath<D>, Geodesic<D>), GeodesicError> {
    let mut path = lagrangian_path(start, end, params, observer)?;
    let mut found = of_domain(start, end, &path)?;
    let is_free = params.domain == DomainChoice::Better
        && params.law.law.inverted().is_some()
        && !start.hidden()
        && !end.hidden();
    if !is_free || found.status == Status::Cancelled || found.end_reached() {
        return Ok((path, found));
    }
    let on_other = GeodesicParams {
        domain: match path.domain {
            Domain::Start => DomainChoice::End,
            Domain::End => DomainChoice::Start,
        },
        ..params.clone()
    };
    let other = lagrangian_path(start, end, &on_other, observer)?;
    let second = of_domain(start, end, &other)?;
    // In the order in which they were computed.
    let levels = [&*found.levels, &second.levels].concat();
    if second.status != Status::Cancelled && rank(&second) > rank(&found) {
        path = other;
        found = second;
    } else {
        found.discarded_levels = second.levels.len();
    }
    found.levels = levels;
    Ok((path, found))
}

/// What paths are chosen by: whether they arrive, and then their length.
fn rank<const D: usize>(found: &Geodesic<D>) -> (bool, bool, f64) {
    (found.end_reached(), found.end_near(), -found.length())
}

/// The result of a path of one domain.
pub(crate) fn of_domain<const D: usize>(
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
    let across = &path.displacements[path.displacements.len() - 1];
    let overlaps = carried_overlaps(from, to, across)?;
    let own = from.union().on_grid(across.grid());
    let certificate = Certificate::worst(
        path.displacements
            .iter()
            .map(|psi| certificate_inside(&own, psi)),
    );
    let found = Found {
        shapes,
        displacements,
        certificate,
        overlaps,
        levels: path.levels.clone(),
    };
    let mut found = found.finish();
    found.outside = largest_share_outside(&own, &path.displacements)?;
    let motion = RigidMotion::nearest_to_deformation(&own, across);
    found.rotation_degrees = motion.map(|motion| motion.angle().to_degrees());
    if path.domain == Domain::End {
        found.energy.step_energies.reverse();
    }
    if found.arrival.is_some() {
        let (own, other) = (from.union(), to.union());
        found.contacts = contacts_of(&own, &other, path)?;
        let carried = match path.domain {
            Domain::Start => found.level_sets.last(),
            Domain::End => found.level_sets.first(),
        };
        let changes = carried.map_or(0, |carried| {
            topology_changes(carried, &other.on_grid(carried.grid()))
        });
        found.other_topology = changes.saturating_sub(found.contacts.len());
        if !found.contacts.is_empty() {
            let grid = across.grid();
            let needed = topology_changes(&own.on_grid(grid), &other.on_grid(grid));
            found.needless_contacts = found.contacts.len().saturating_sub(needed);
        }
    }
    found.motions = motions;
    found.domain = Some(path.domain);
    Ok(found)
}

/// The result of a path, with its deformations if they are those of the end domain.
pub(crate) fn with_deformations<const D: usize>(
    found: Geodesic<D>,
    path: LagrangianPath<D>,
) -> Geodesic<D> {
    let backward_motions = match path.domain {
        Domain::Start => Vec::new(),
        Domain::End => path.displacements,
    };
    Geodesic {
        backward_motions,
        ..found
    }
}

fn is_zero<T: Default + PartialEq>(number: &T) -> bool {
    *number == T::default()
}

/// The number of parts, holes and tunnels that one of two objects has and the other one has not. One without a
/// boundary is doubted for its overlap.
fn topology_changes<const D: usize>(a: &ScalarField<f64, D>, b: &ScalarField<f64, D>) -> usize {
    let of = |u: &ScalarField<f64, D>| signed_distance(u, 0.0).map(|u| Topology::of(&u));
    match (of(a), of(b)) {
        (Ok(a), Ok(b)) => a.differences(&b),
        _ => 0,
    }
}

/// The changes of topology of a path between the unions of two shapes, first that of its domain.
fn contacts_of<const D: usize>(
    from: &ScalarField<f64, D>,
    to: &ScalarField<f64, D>,
    path: &LagrangianPath<D>,
) -> Result<Vec<Contact>, GeodesicError> {
    let grid = *path.displacements[0].grid();
    let outline = |u: &ScalarField<f64, D>| contour(&u.on_grid(&grid), 0.0, BoxEdge::Open);
    let (own, end) = (outline(from)?, outline(to)?);
    if own.is_empty() || end.is_empty() {
        return Ok(Vec::new());
    }
    let moved = path.displacements.iter().map(|psi| own.displaced(psi, 1.0));
    let carried: Vec<_> = std::iter::once(own.clone()).chain(moved).collect();
    let pressed = pressed(&carried[carried.len() - 1], &end, grid.spacing())?;
    Ok(contacts(&pressed, &carried, path.domain, grid.spacing())?)
}

/// Returns the certificate of a deformation inside a shape that is given by a level set, on all cells with a corner in
/// it: that of [`Geodesic::certificate`] is the worst one of a path.
pub fn certificate_inside<const D: usize>(
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
    start.check("start")?;
    end.check("end")?;
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
    let mismatches = match params.form {
        Form::Lagrangian => 1,
        Form::LevelSets => params.steps,
    };
    check_known(start, end, mismatches)
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
            arrival,
            whole,
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
            backward_motions: Vec::new(),
            certificate: self.certificate,
            dice_end: worst(&forwards),
            gap_end: gap,
            whole_end: whole,
            arrival,
            contacts: Vec::new(),
            other_topology: 0,
            needless_contacts: 0,
            outside: 0.0,
            rotation_degrees: None,
            dice_pulled: worst(&backwards),
            dice_components: forwards,
            levels: self.levels,
            discarded_levels: 0,
        }
    }
}
