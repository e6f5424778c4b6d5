//! The result of a geodesic, common to both forms.

use crate::arrival::{Arrival, pressed};
use crate::cells::object_cells;
use crate::contact::{Contact, contacts};
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::lagrangian::{Domain, Eulerian, LagrangianPath, eulerian};
use crate::level_sets::{LevelSetPath, PathState};
use crate::levels::LevelReport;
use crate::overlap::{
    End, Overlaps, WholeOverlap, carried_overlaps, largest_share_outside, overlaps, worst,
};
use crate::shape::{Shape, union_of};
use fe_grid::minimise::Status;
use fe_grid::{Certificate, Field, ScalarField, certify_within};
use levelset::topology::Topology;
use levelset::{BoxEdge, Contour, RigidMotion, contour, signed_distance};
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
    /// What a path of the domain of a shape between both was computed as.
    #[serde(skip)]
    pub middle: Option<Middle<D>>,
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
    #[serde(skip_serializing_if = "is_infinite")]
    pub gap_end: f64,
    /// How all of the deformed shape, with what is hidden, agrees with the visible part of the one at the
    /// other end; paths of the domain of a shape that is hidden in part only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole_end: Option<WholeOverlap>,
    /// How closely these boundaries agree, and where they are pressed together; fully visible shapes
    /// only.
    #[serde(skip_serializing_if = "Arrival::is_nothing")]
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

/// A path as deformations of a shape between both of its ends.
#[derive(Clone, Debug)]
pub struct Middle<const D: usize> {
    /// The shape.
    pub shape: Shape<D>,
    /// Displacements of its deformations into all shapes of the path, from the start on.
    pub motions: Vec<Field<f64, D, D>>,
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
    /// other end; of a shape between both into all.
    pub(crate) fn own_motions(&self) -> &[Field<f64, D, D>] {
        match (self.domain, &self.middle) {
            (Some(Domain::End), _) => &self.backward_motions,
            (Some(Domain::Middle), Some(middle)) => &middle.motions,
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

/// The result of a path of level sets.
pub(crate) fn of_level_sets<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: LevelSetPath<D>,
) -> Result<Geodesic<D>, GeodesicError> {
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
    let (overlaps, own) = match &path.middle {
        Some(middle) => {
            let at_start = carried_overlaps(middle, start, &path.displacements[0])?;
            (
                carried_overlaps(middle, end, across)?.and(&at_start),
                middle,
            )
        }
        None => (carried_overlaps(from, to, across)?, from),
    };
    let own = own.union().on_grid(across.grid());
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
    let motion = match path.middle {
        Some(_) => {
            RigidMotion::nearest_to_deformation(&found.level_sets[0], &motions[motions.len() - 1])
        }
        None => RigidMotion::nearest_to_deformation(&own, across),
    };
    found.rotation_degrees = motion.map(|motion| motion.angle().to_degrees());
    if path.domain == Domain::End {
        found.energy.step_energies.reverse();
    }
    if found.arrival.is_some() {
        let ends = [start.union(), end.union()].map(|u| u.on_grid(across.grid()));
        found.contacts = contacts_of(&own, &ends, path)?;
        // Shapes are carried to the ends that are not their domain.
        let (first, last) = (found.level_sets.first(), found.level_sets.last());
        let carried = match path.domain {
            Domain::Start => [None, last],
            Domain::End => [first, None],
            Domain::Middle => [first, last],
        };
        let pairs = carried.into_iter().zip(&ends);
        let changes = pairs.map(|(carried, end)| carried.map_or(0, |u| topology_changes(u, end)));
        found.other_topology = changes.sum::<usize>().saturating_sub(found.contacts.len());
        if !found.contacts.is_empty() {
            let needed = topology_changes(&ends[0], &ends[1]);
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
    let (mut backward_motions, mut middle) = (Vec::new(), None);
    match (path.domain, path.middle) {
        (Domain::Middle, Some(shape)) => {
            let motions = path.displacements;
            middle = Some(Middle { shape, motions });
        }
        (Domain::End, _) => backward_motions = path.displacements,
        _ => {}
    }
    Geodesic {
        backward_motions,
        middle,
        ..found
    }
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
fn is_infinite(number: &f64) -> bool {
    !number.is_finite()
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

/// The changes of topology of a path of the domain of a shape, at the ends that are not that shape; the largest first.
fn contacts_of<const D: usize>(
    own: &ScalarField<f64, D>,
    [start, end]: &[ScalarField<f64, D>; 2],
    path: &LagrangianPath<D>,
) -> Result<Vec<Contact>, GeodesicError> {
    let spacing = own.grid().spacing();
    let outline = |u: &ScalarField<f64, D>| contour(u, 0.0, BoxEdge::Open);
    let own = outline(own)?;
    let moved = path.displacements.iter().map(|psi| own.displaced(psi, 1.0));
    let mut carried: Vec<_> = match path.domain {
        Domain::Middle => moved.collect(),
        Domain::Start | Domain::End => std::iter::once(own.clone()).chain(moved).collect(),
    };
    let at = |carried: &[Contour<D>], other: &ScalarField<f64, D>, at_end: bool| {
        let other = outline(other)?;
        if own.is_empty() || other.is_empty() {
            return Ok(Vec::new());
        }
        let pressed = pressed(&carried[carried.len() - 1], &other, spacing)?;
        Ok::<_, GeodesicError>(contacts(&pressed, carried, at_end, spacing)?)
    };
    match path.domain {
        Domain::Start => at(&carried, end, true),
        Domain::End => at(&carried, start, false),
        Domain::Middle => {
            let mut found = at(&carried, end, true)?;
            carried.reverse();
            found.extend(at(&carried, start, false)?);
            found.sort_by(|a, b| b.size.total_cmp(&a.size));
            Ok(found)
        }
    }
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
            middle: None,
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
