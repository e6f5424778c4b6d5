//! The average, onto which new shapes are deformed and in whose modes they are measured.

use std::slice;

use fe_grid::minimise::{Memory, Observer, Status};
use fe_grid::{Grid, ScalarField, VectorField};
use levelset::{
    BoxEdge, Cause, Contour, ContourDistance, Doubt, Moments, RigidMotion, contour, hausdorff,
    share_outside, signed_distance,
};
use nalgebra::SVector;
use shape_average::align::align_components_to;
use shape_average::{AverageParams, AverageResult, Shapes, match_components_to};
use shape_pca::{Compound, Source};

use super::measured::{Measured, shown_modes};
use crate::error::CliError;
use crate::options::{Align, Frame, Size};
use crate::pca::procrustes::Procrustes;
use crate::pca::read::StoredPca;
use crate::session::Session;
use crate::shapes::{Likeness, inspect_mask, inspect_resolution, moved, place_like, volume_of};
use shapespace_input::Image;
use shapespace_input::frame::{FrameTransform, corner_in_unit_box};
use shapespace_input::place::frame_like;

/// Iterations for those of the average. Onto an average that cannot follow it a shape takes more of them: an L onto the
/// average of eight others took 138 at 33 nodes a side, and shapes of seven lobes onto that of fourteen 600 to 800 at 65.
const MORE_ITERATIONS: usize = 20;
/// Tolerance at most, in 2D and 3D. With that of averages by default (5e-3) four joined balls at 17^3 nodes have scores 6 %
/// from those of 1e-4, with 1e-3 they have .2 %. Hands at 129^2 nodes have some scores .4 standard deviations apart with 1e-3;
/// minimisations in the plane take seconds. Hippocampi at 65^3, whose discrete mismatch has many minima, have the same
/// scores with 1e-3 to .01 standard deviations.
const TOLERANCE: [f64; 2] = [1e-4, 1e-3];

/// A deformation whose energy is estimated to be less than this above the minimum, relative to the elastic energy, is as
/// good as those of the average, whether its tolerance was reached or not: nearly round shapes turn in themselves for
/// next to nothing, and their minimisations take long. Their scores are those of `pca` to .01.
const CLOSE: f64 = 5e-3;

/// Nodes per side of the grids for the rigid alignment, in 2D and 3D.
const ALIGNMENT_NODES: [usize; 2] = [65, 33];

/// Where a new shape lies.
struct Place<const D: usize> {
    frame: FrameTransform<D>,
    motion: Option<RigidMotion<D>>,
    /// The doubt that it is reflected.
    reflection: Option<Doubt>,
}

/// The average as the target of new shapes.
pub(super) struct Target<'a, const D: usize> {
    pub stored: &'a StoredPca<D>,
    compound: Compound<D>,
    outline: Contour<D>,
    size: f64,
    distance: ScalarField<f64, D>,
    /// Signed distances of its components; that of the whole where there is one.
    parts: Vec<ScalarField<f64, D>>,
    /// Their phase fields.
    phase_fields: Vec<ScalarField<f64, D>>,
    /// On the grid of the rigid alignment, which is that of the unit box: the whole, then its components, if there
    /// are several.
    coarse: Vec<ScalarField<f64, D>>,
    align: Align,
    scale: Size,
}

/// Shapes that are this many times as large or as small as the average have another unit of length.
const MOST_TIMES: f64 = 10.0;

impl<'a, const D: usize> Target<'a, D> {
    pub fn new(stored: &'a StoredPca<D>, align: Align, scale: Size) -> Result<Self, CliError> {
        let object = &stored.space.object;
        let outline = contour(object, 0.5, BoxEdge::Closed)?;
        let grid = Grid::cube(ALIGNMENT_NODES[usize::from(D == 3)]);
        let corner = corner_in_unit_box(object.grid());
        let sampled = |outline: &Contour<D>| -> Result<ScalarField<f64, D>, CliError> {
            let distance = ContourDistance::new(&moved(outline, corner))?;
            Ok(distance.sample(grid))
        };
        let mut coarse = vec![sampled(&outline)?];
        let distance = signed_distance(object, 0.5)?;
        let components = &stored.average.components;
        let (mut parts, mut phase_fields) = (Vec::new(), Vec::new());
        for component in components {
            parts.push(signed_distance(&component.indicator, 0.5)?);
            let own = contour(&component.indicator, 0.5, BoxEdge::Closed)?;
            coarse.push(sampled(&own)?);
            phase_fields.push(component.phase_field.clone());
        }
        if components.is_empty() {
            parts.push(distance.clone());
            phase_fields.push(stored.average.phase_field.clone());
        }
        Ok(Self {
            stored,
            compound: Compound::new(&stored.average.average, &stored.space.params)?,
            size: Moments::of_contour(&outline)?.volume,
            distance,
            parts,
            phase_fields,
            coarse,
            outline,
            align,
            scale,
        })
    }

    /// The grids of a deformation, coarsest first.
    pub fn grids(&self) -> Vec<Grid<D>> {
        let params = &self.stored.average.params;
        self.distance.grid().hierarchy(params.coarsest_nodes)
    }

    /// Deforms a shape, of these components if there are several, onto the average, and measures it; with
    /// outlines of a shape that `is_shown` in the picture.
    ///
    /// # Errors
    /// Those of the deformation, and [`CliError::Stopped`] where it was interrupted.
    pub fn measure(
        &self,
        image: &Image<D>,
        components: &[Image<D>],
        is_shown: bool,
        session: &Session<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Measured<D>, CliError> {
        let grid = *self.distance.grid();
        let place = self.place(image, components)?;
        let (outline, distance) = place.of(image, grid)?;
        let mut parts = Vec::new();
        for component in components {
            parts.push(place.of(component, grid)?.1);
        }
        if parts.is_empty() {
            parts.push(distance.clone());
        }
        let stored = &self.stored.average.params;
        let params = &AverageParams {
            max_iterations: MORE_ITERATIONS * stored.max_iterations,
            tolerance: stored.tolerance.min(TOLERANCE[usize::from(D == 3)]),
            ..stored.clone()
        };
        let [own, goal] =
            [(&distance, &parts), (&self.distance, &self.parts)].map(|(whole, parts)| {
                Shapes::of_components(slice::from_ref(whole), parts, parts.len())
            });
        let fit = match_components_to(own?, goal?, &self.phase_fields, params, observer);
        if session.interrupt.asked() {
            return Err(CliError::Stopped);
        }
        let fit = fit?;
        let source = Source {
            weight: 1.0,
            displacement: fit.displacements[0].as_slice(),
            indicator: fit.shapes.indicators[0].as_slice(),
        };
        let space = &self.stored.space;
        let displacement = self.represented(source, observer)?;
        let products = space.products(&self.compound, &displacement);
        let scores = space.scores_of(&products);
        let (overlap, doubts) = agreement(&fit.pushed[0], &self.distance, &self.outline)?;
        let mut doubts = [doubts, self.doubts(image, &distance, &outline, &fit)].concat();
        doubts.extend(place.reflection);
        let outside = share_outside(&outline, distance.grid())?;
        doubts.extend(Doubt::check(Cause::OutsideBox, outside));
        let stored = &self.stored.average.components;
        let components = fit.components.iter().zip(&self.parts).zip(stored);
        for (c, ((component, part), stored)) in components.enumerate() {
            let (_, found) = agreement(&component.pushed[0], part, &stored.outline()?)?;
            doubts.extend(found.into_iter().map(|doubt| doubt.within(c)));
        }
        let shown_modes = shown_modes(scores.scores.len());
        let mut found = Measured {
            overlap,
            elastic: fit.energy.elastic[0],
            doubts,
            products,
            scores,
            dice: Vec::new(),
            distance: Vec::new(),
            outlines: Vec::new(),
            displacement,
        };
        let mut reconstructions = Vec::new();
        for m in 0..=found.scores.scores.len() {
            let u = space.synthesise(&found.scores.scores[..m])?;
            let back = outline
                .displaced(&fit.displacements[0], 1.0)
                .displaced(&u, -1.0);
            let aligned = Procrustes::new(back.points(), outline.points());
            let shape = aligned
                .motion
                .apply_to_contour(&self.outline.displaced(&u, -1.0));
            let field = ContourDistance::new(&shape)?.sample(grid);
            let dice = levelset::dice(&field, 0.0, &distance, 0.0)?;
            found.dice.push(dice);
            found.distance.push(aligned.distance);
            // Of few modes, some of them are the same.
            let times = shown_modes.iter().filter(|shown| **shown == m).count();
            reconstructions.extend(std::iter::repeat_n(shape, times));
        }
        if is_shown {
            found.outlines.push(outline);
            found.outlines.extend(reconstructions);
        }
        Ok(found)
    }

    /// The displacement of a new shape, from an earlier run if the observer has it.
    fn represented(
        &self,
        source: Source<'_>,
        observer: &mut dyn Observer,
    ) -> Result<VectorField<f64, D>, CliError> {
        let grid = *self.distance.grid();
        let memory = observer.resume();
        let known = memory
            .as_ref()
            .and_then(|memory| memory.result(D * grid.n_nodes()));
        if let Some((u, [])) = known {
            return Ok(VectorField::from_vec(grid, u.to_vec())?);
        }
        let u = self.stored.space.represent(&self.compound, source)?;
        observer.memory(&Memory::of_result(u.as_slice(), Vec::new()));
        Ok(u)
    }

    /// The doubts about the mask of a new shape, and about its deformation onto the average.
    fn doubts(
        &self,
        image: &Image<D>,
        distance: &ScalarField<f64, D>,
        outline: &Contour<D>,
        fit: &AverageResult<D>,
    ) -> Vec<Doubt> {
        let left = fit.remaining_share().unwrap_or(f64::INFINITY);
        let close = left <= CLOSE && fit.status != Status::Cancelled;
        let own = fit.doubts(&self.stored.average.params).into_iter();
        let own = own.filter(|doubt| match doubt.cause {
            // The result of a single shape compares it with itself.
            Cause::Overlap | Cause::BoundaryDistance => false,
            Cause::NotConverged => !close,
            _ => true,
        });
        let doubts = inspect_resolution(distance, outline).chain(own);
        doubts.chain(inspect_mask(image, false)).collect()
    }

    /// Where a new shape lies in the box of the average.
    fn place(&self, image: &Image<D>, components: &[Image<D>]) -> Result<Place<D>, CliError> {
        let grid = *self.distance.grid();
        // New shapes are placed and aligned in the unit box, which has room for any orientation.
        let corner = corner_in_unit_box(&grid);
        let back = corner.map(|x| -x);
        let (size, frame) = &self.stored.average.frame;
        let in_world = match self.stored.average.placing {
            None | Some(Frame::None) => None,
            Some(Frame::Physical | Frame::Centred) => image.in_world(),
        };
        let image = in_world.as_ref().unwrap_or(image);
        let turned = self.align == Align::Rigid || self.scale == Size::Equal;
        let mut frame_of = frame_like(image, (size, &frame.moved(corner)), &grid, 1.0, turned);
        let times = (volume_of(image, &frame_of)? / self.size).powf(1.0 / D as f64);
        if self.scale == Size::Equal {
            frame_of = frame_of.shrunk(times.recip());
        } else {
            check_size(image, times)?;
        }
        let coarse = place_like(image, frame_of, None, self.coarse_grid());
        if self.align == Align::None {
            // Where nothing is aligned, only sides in the world are those of the average.
            let reflection = match coarse {
                Ok((_, coarse)) if in_world.is_some() => self.reflection(&coarse)?,
                _ => None,
            };
            return Ok(Place {
                frame: frame_of.moved(back),
                motion: None,
                reflection,
            });
        }
        let (_, coarse) = coarse?;
        let mut parts = vec![coarse];
        for component in components {
            let in_world = in_world.as_ref().and_then(|_| component.in_world());
            let component = in_world.as_ref().unwrap_or(component);
            let part = place_like(component, frame_of, None, self.coarse_grid());
            parts.extend(part.ok().map(|(_, part)| part));
        }
        // Where a component is lost on the coarse grid, the whole is aligned.
        let n = if parts.len() == self.coarse.len() {
            parts.len()
        } else {
            1
        };
        let found = align_components_to(&self.coarse[..n], &parts[..n]);
        let found = found.map_err(|error| CliError::Computation {
            message: format!("'{}' cannot be aligned: {error}", image.path.display()),
            remedy: "use --align none if it has the position of the average".into(),
        })?;
        let translation = found.motion.translation() + SVector::from(back);
        Ok(Place {
            frame: frame_of,
            motion: Some(RigidMotion::from_parts(
                *found.motion.rotation(),
                translation,
            )),
            reflection: self.reflection(&parts[0])?,
        })
    }

    /// The doubt that a shape is reflected against the average.
    fn reflection(&self, coarse: &ScalarField<f64, D>) -> Result<Option<Doubt>, CliError> {
        Likeness::doubt_of_average(&self.coarse[0], coarse, self.stored.average.mismatch)
    }

    fn coarse_grid(&self) -> Grid<D> {
        *self.coarse[0].grid()
    }
}

impl<const D: usize> Place<D> {
    /// The boundary of a mask in this place, and its signed distance.
    fn of(
        &self,
        mask: &Image<D>,
        grid: Grid<D>,
    ) -> Result<(Contour<D>, ScalarField<f64, D>), CliError> {
        place_like(mask, self.frame, self.motion, grid)
    }
}

/// The overlap of a deformed shape, given by its signed distance, with what it is deformed onto, and the doubts
/// about it and about the distance of the boundaries.
fn agreement<const D: usize>(
    pushed: &ScalarField<f64, D>,
    target: &ScalarField<f64, D>,
    outline: &Contour<D>,
) -> Result<(f64, Vec<Doubt>), CliError> {
    let overlap = levelset::dice(pushed, 0.0, target, 0.0)?;
    let pushed = contour(pushed, 0.0, BoxEdge::Closed)?;
    let apart = hausdorff(&pushed, outline)?;
    let [mean, largest] = [apart.mean, apart.maximum].map(|d| d / target.grid().spacing());
    let doubts = [
        Doubt::overlap(Cause::Overlap, overlap, mean),
        Doubt::check(Cause::BoundaryDistance, largest),
    ];
    Ok((overlap, doubts.into_iter().flatten().collect()))
}

/// Refuses a shape whose lengths, so many times those of the average, have another unit.
fn check_size<const D: usize>(image: &Image<D>, times: f64) -> Result<(), CliError> {
    if (MOST_TIMES.recip()..MOST_TIMES).contains(&times) {
        return Ok(());
    }
    let (times, which) = if times > 1.0 {
        (times, "large")
    } else {
        (times.recip(), "small")
    };
    Err(CliError::Option {
        option: "INPUT",
        value: format!(
            "'{}', {times:.0} times as {which} as the average,",
            image.path.display()
        ),
        remedy: "give it in the unit of the shapes of the average, or use --size equal".into(),
    })
}
