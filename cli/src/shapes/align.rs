//! Rigid alignment of the inputs.
//!
//! All shapes are aligned with one of them, the reference, which keeps its orientation: the shape
//! whose size and spread are nearest to those of all others (minimal sum of distances of `(V^(1/d),
//! sqrt(tr C), (tr C^2)^(1/4))`, with volume `V` and covariance `C`; these do not depend on
//! position and orientation); if some shapes are only partially visible, a completely visible one,
//! if there is one. Motions are computed from signed distances on a grid of moderate size and
//! applied to the boundaries themselves.
//!
//! If aligned shapes then extend beyond [`ROOM`], all are moved together to the middle, and, if
//! that is not enough, scaled down by one factor, which is recorded in the frames.

use fe_grid::{Distribution, Grid, ScalarField, parallel};
use levelset::{Contour, ContourDistance, Moments, bounds};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use shape_average::align::{RigidMotion, align_group_of_components, align_group_of_visible};

use super::inspect::inspect_reflections;
use super::pose::pose;
use super::world::WorldFrame;
use super::{Components, Input, VisibilityMask, placed, records_of, view_of};
use crate::error::CliError;

/// Nodes per side of the grids for the rigid alignment, in 2D and 3D.
const NODES: [usize; 2] = [65, 33];
/// Aligned shapes stay between these coordinates, which leaves space for the void around them.
pub(super) const ROOM: [f64; 2] = [0.08, 0.92];

/// How a shape was aligned.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(into = "AlignmentRecord", try_from = "AlignmentRecord")]
pub(crate) struct Alignment<const D: usize> {
    /// From the frame's unit box to aligned coordinates, also in the unit box.
    pub motion: RigidMotion<D>,
    /// Remaining squared difference of the indicators, relative to the sum of their squares.
    pub mismatch: f64,
    /// Whether the others were aligned to this shape.
    pub reference: bool,
    /// The way of its centre of mass, in millimetres, for shapes that lie in the world.
    pub moved: Option<f64>,
}

/// The form in which an alignment is written: `aligned = rotation unit + translation`.
#[derive(Clone, Serialize, Deserialize)]
struct AlignmentRecord {
    /// Row by row.
    rotation: Vec<Vec<f64>>,
    translation: Vec<f64>,
    /// That of the rotation.
    angle_degrees: f64,
    mismatch: f64,
    reference: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    moved_mm: Option<f64>,
}

/// A written alignment that cannot be one of this dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an alignment needs a matrix that rotates, and a translation, one number for each axis")]
pub(crate) struct AlignmentRecordError;

impl<const D: usize> From<Alignment<D>> for AlignmentRecord {
    fn from(alignment: Alignment<D>) -> Self {
        let rows = alignment.motion.rotation().row_iter();
        Self {
            rotation: rows.map(|row| row.iter().copied().collect()).collect(),
            translation: alignment.motion.translation().iter().copied().collect(),
            angle_degrees: alignment.motion.angle().to_degrees(),
            mismatch: alignment.mismatch,
            reference: alignment.reference,
            moved_mm: alignment.moved,
        }
    }
}

impl<const D: usize> TryFrom<AlignmentRecord> for Alignment<D> {
    type Error = AlignmentRecordError;

    fn try_from(record: AlignmentRecord) -> Result<Self, AlignmentRecordError> {
        let axes = |numbers: &[f64]| <[f64; D]>::try_from(numbers).ok();
        let motion = || {
            let rows: Option<Vec<[f64; D]>> = record.rotation.iter().map(|row| axes(row)).collect();
            let rows = <[[f64; D]; D]>::try_from(rows?).ok()?;
            let translation = SVector::from(axes(&record.translation)?);
            // The matrix whose columns are the rows, transposed.
            RigidMotion::new(SMatrix::<f64, D, D>::from(rows).transpose(), translation)
        };
        Ok(Self {
            motion: motion().ok_or(AlignmentRecordError)?,
            mismatch: record.mismatch,
            reference: record.reference,
            moved: record.moved_mm,
        })
    }
}

/// Aligns the boundaries of all inputs by their visible parts: no visibility masks, or one per
/// shape; or by all components, if all are visible. Each process aligns its own. Collective.
///
/// # Errors
/// [`CliError::Computation`] if a shape is too small to be aligned, and those of [`view_of`].
pub(crate) fn align<const D: usize>(
    inputs: &mut [Input<D>],
    views: &[Option<VisibilityMask<D>>],
    components: Option<&Components<D>>,
    distribution: &Distribution,
) -> Result<(), CliError> {
    let before = centres(inputs)?;
    let contours: Vec<&Contour<D>> = inputs.iter().map(|input| &input.contour).collect();
    let view = |i: usize| views.get(i).and_then(Option::as_ref);
    let reference = reference(&contours, |i| view(i).is_none())?;
    let mut order: Vec<usize> = (0..inputs.len()).collect();
    order.swap(0, reference);
    let ordered: Vec<&Contour<D>> = order.iter().map(|&i| contours[i]).collect();
    let mut distances = coarse_distances(&ordered, distribution)?;
    let mut visibility = Vec::new();
    if order.iter().any(|&i| view(i).is_some()) {
        for (distance, &i) in distances.iter_mut().zip(&order) {
            let grid = *distance.grid();
            visibility.push(match view(i) {
                Some(mask) => {
                    let view = view_of(mask, &inputs[i], grid)?;
                    *distance = view.distance;
                    view.weight
                }
                None => ScalarField::from_fn(grid, |_| [1.0]),
            });
        }
    }
    let components = components.filter(|_| visibility.is_empty());
    let found = if let Some(components) = components {
        by_components(inputs, &distances, components, &order, distribution)?
    } else if let ([first, second], true) = (&distances[..], visibility.is_empty()) {
        let fixed = shape_average::align::Alignment {
            motion: RigidMotion::identity(),
            mismatch: 0.0,
        };
        vec![fixed, pose(first, second)?]
    } else {
        let both = [&distances, &visibility];
        let [shapes, seen] = both.map(|fields| fields.iter().collect::<Vec<_>>());
        align_group_of_visible(&shapes, &seen, distribution).map_err(failed)?
    };
    for (position, &i) in order.iter().enumerate() {
        let input = &mut inputs[i];
        input.contour = found[position].motion.apply_to_contour(&input.contour);
        input.alignment = Some(Alignment {
            motion: found[position].motion,
            mismatch: found[position].mismatch,
            reference: position == 0,
            moved: None,
        });
    }
    if visibility.is_empty() {
        inspect_reflections(inputs, &distances, &order, distribution)?;
    }
    keep_inside(inputs, [ROOM; D]);
    measure_ways(inputs, &before, reference)
}

/// Aligns shapes by their outlines and all their components, in this order.
fn by_components<const D: usize>(
    inputs: &[Input<D>],
    outlines: &[ScalarField<f64, D>],
    components: &Components<D>,
    order: &[usize],
    distribution: &Distribution,
) -> Result<Vec<shape_average::align::Alignment<D>>, CliError> {
    let mut parts = Vec::new();
    for &i in order {
        let masks = components.of(i).iter();
        let contours: Result<Vec<_>, _> = masks.map(|mask| placed(mask, &inputs[i])).collect();
        parts.push(contours?);
    }
    let n = parts.first().map_or(0, Vec::len);
    let parts: Vec<&Contour<D>> = parts.iter().flatten().collect();
    let parts = coarse_distances(&parts, &distribution.of(parts.len()))?;
    let mut parts = parts.into_iter();
    let of_shape = |outline: &ScalarField<f64, D>| -> Vec<ScalarField<f64, D>> {
        std::iter::once(outline.clone())
            .chain(parts.by_ref().take(n))
            .collect()
    };
    let shapes: Vec<_> = outlines.iter().map(of_shape).collect();
    let shapes: Vec<&[_]> = shapes.iter().map(Vec::as_slice).collect();
    align_group_of_components(&shapes, distribution).map_err(failed)
}

/// Adds the doubts about shapes in the world that are not aligned, and that would fit another one
/// better if they were reflected.
///
/// # Errors
/// [`CliError::Computation`].
pub(super) fn inspect_unaligned<const D: usize>(
    inputs: &mut [Input<D>],
    distribution: &Distribution,
) -> Result<(), CliError> {
    if inputs.len() < 2 || !inputs.iter().all(|input| input.frame.in_world()) {
        return Ok(());
    }
    let contours: Vec<&Contour<D>> = inputs.iter().map(|input| &input.contour).collect();
    let reference = reference(&contours, |_| true)?;
    let mut order: Vec<usize> = (0..inputs.len()).collect();
    order.swap(0, reference);
    let ordered: Vec<&Contour<D>> = order.iter().map(|&i| contours[i]).collect();
    let distances = coarse_distances(&ordered, distribution)?;
    let resolved = |distance: &ScalarField<f64, D>| distance.as_slice().iter().any(|&u| u > 0.0);
    if !distances.iter().all(resolved) {
        // Shapes that lie far from each other have few nodes.
        return Ok(());
    }
    inspect_reflections(inputs, &distances, &order, distribution)
}

/// The centres of mass of shapes, in their physical space.
fn centres<const D: usize>(inputs: &[Input<D>]) -> Result<Vec<[f64; D]>, CliError> {
    let centre = |input: &Input<D>| {
        let moments = Moments::of_contour(&input.contour).map_err(failed)?;
        Ok(input.frame.to_physical(moments.centroid.into()))
    };
    inputs.iter().map(centre).collect()
}

/// Records how far shapes were moved in the world, where all lie there: the reference stays.
fn measure_ways<const D: usize>(
    inputs: &mut [Input<D>],
    before: &[[f64; D]],
    reference: usize,
) -> Result<(), CliError> {
    let records = records_of(inputs);
    let world = WorldFrame::of_inputs(&records).and(WorldFrame::of_one(&records, reference));
    let Some(world) = world else {
        return Ok(());
    };
    for (input, before) in inputs.iter_mut().zip(before) {
        let moments = Moments::of_contour(&input.contour).map_err(failed)?;
        let after = world.position(moments.centroid.into());
        let way: f64 = (0..D).map(|k| (after[k] - before[k]).powi(2)).sum();
        if let Some(alignment) = &mut input.alignment {
            alignment.moved = Some(way.sqrt());
        }
    }
    Ok(())
}

/// The signed distances from which motions are computed, of all shapes on all processes. Collective.
///
/// # Errors
/// [`CliError::Computation`].
pub(super) fn coarse_distances<const D: usize>(
    contours: &[&Contour<D>],
    distribution: &Distribution,
) -> Result<Vec<ScalarField<f64, D>>, CliError> {
    let grid = Grid::<D>::cube(NODES[usize::from(D == 3)]);
    let own = contours[distribution.own()].iter().map(|contour| {
        let distance = ContourDistance::new(contour).map_err(failed)?;
        Ok(distance.sample(grid).into_vec())
    });
    let own: Result<Vec<_>, CliError> = own.collect();
    let all = distribution.share_vectors(own?, grid.n_nodes()).into_iter();
    all.map(|values| Ok(ScalarField::from_vec(grid, values)?))
        .collect()
}

pub(super) fn failed(error: impl std::fmt::Display) -> CliError {
    CliError::Computation {
        message: format!("the shapes cannot be aligned: {error}"),
        remedy: "leave out --align, or leave out shapes that are much smaller than the rest".into(),
    }
}

/// Position of the shape nearest to all others in size and spread, among the completely visible
/// ones if there are any.
fn reference<const D: usize>(
    contours: &[&Contour<D>],
    whole: impl Fn(usize) -> bool,
) -> Result<usize, CliError> {
    let lengths: Result<Vec<[f64; 3]>, CliError> = parallel::try_map(contours, &|contour| {
        let moments = Moments::of_contour(contour).map_err(failed)?;
        let c: SMatrix<f64, D, D> = moments.covariance;
        let square = (c * c).trace();
        Ok([
            moments.volume.powf(1.0 / D as f64),
            c.trace().max(0.0).sqrt(),
            square.sqrt().sqrt(),
        ])
    });
    let lengths = lengths?;
    let difference = |a: &[f64; 3], b: &[f64; 3]| -> f64 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    };
    let sums = lengths
        .iter()
        .map(|a| lengths.iter().map(|b| difference(a, b)).sum::<f64>());
    let best = sums.enumerate().min_by(|a, b| {
        let cut = whole(b.0).cmp(&whole(a.0));
        cut.then(a.1.total_cmp(&b.1)).then(a.0.cmp(&b.0))
    });
    Ok(best.map_or(0, |(index, _)| index))
}

/// Moves all shapes together, and shrinks them if need be, so that none leaves the room, which lies in
/// the middle of the unit box.
pub(super) fn keep_inside<const D: usize>(inputs: &mut [Input<D>], room: [[f64; 2]; D]) {
    let [low, high] = around(inputs);
    if (0..D).all(|k| low[k] >= room[k][0] && high[k] <= room[k][1]) {
        return;
    }
    let share = |k: usize| (room[k][1] - room[k][0]) / (high[k] - low[k]);
    let factor = (0..D).map(share).fold(1.0, f64::min);
    let middle = SVector::<f64, D>::repeat(0.5);
    let centre = SVector::<f64, D>::from_fn(|k, _| 0.5 * (low[k] + high[k]));
    for input in inputs {
        let into = |p: [f64; D]| (middle + (SVector::from(p) - centre) * factor).into();
        input.contour = input.contour.map(into);
        input.volume *= factor.powi(D as i32);
        input.frame = input.frame.shrunk(factor);
        if input.alignment.is_none() {
            // m + f (x - c) is the shrunk m + f (x - m), moved.
            let by = (middle - centre) * factor;
            input.frame = input.frame.moved(by.into());
        }
        if let Some(alignment) = &mut input.alignment {
            // y = m + f (R x + t - c) in the shrunk coordinates x' = m + f (x - m).
            let rotation = *alignment.motion.rotation();
            let shift = alignment.motion.translation() - centre;
            let translation = middle + shift * factor + rotation * middle * (factor - 1.0);
            if let Some(motion) = RigidMotion::new(rotation, translation) {
                alignment.motion = motion;
            }
        }
    }
}

/// The box around the boundaries of inputs.
fn around<const D: usize>(inputs: &[Input<D>]) -> [[f64; D]; 2] {
    let points = inputs.iter().flat_map(|input| input.contour.points());
    bounds(points.copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use levelset::rigid_motion::plane_rotation;
    use shapespace_input::block;
    use shapespace_input::place::fit_frames;
    use shapespace_input::{Image, boundary};

    fn input<const D: usize>(image: &Image<D>) -> Input<D> {
        let frame = fit_frames(std::slice::from_ref(image), None)[0];
        super::super::input(image, frame, String::new()).unwrap()
    }

    /// The record states the position of every sample: frame, then motion.
    fn check_record<const D: usize>(image: &Image<D>, input: &Input<D>) {
        let motion = input.alignment.unwrap().motion;
        let drawn = boundary(image, &input.frame).unwrap();
        let moved = motion.apply_to_contour(&drawn);
        for (a, b) in moved.points().iter().zip(input.contour.points()) {
            for k in 0..D {
                // Rounding of a few sums of numbers up to one.
                assert!((a[k] - b[k]).abs() < 1e-13, "{a:?} {b:?}");
            }
        }
        let volume = Moments::of_contour(&moved).unwrap().volume;
        assert!((volume / input.volume - 1.0).abs() < 1e-12);
    }

    #[test]
    fn long_shapes_that_are_turned_stay_inside_and_are_recorded() {
        // A diagonal bar becomes longer than the box when its frame is turned upright.
        let upright = block([40, 40], [1.0; 2], [18, 2], [21, 37]);
        let mut diagonal = block([40, 40], [1.0; 2], [0, 0], [0, 0]);
        let value = |index| {
            let [x, y] = diagonal.sample(index).map(|i| i as f64 - 19.5);
            let inside = (x - y).abs() < 3.0 && (x + y).abs() < 34.0;
            u8::from(inside)
        };
        let values: Vec<u8> = (0..diagonal.values.len()).map(value).collect();
        diagonal.values = values.into();
        let mut inputs = vec![input(&upright), input(&diagonal)];
        let before = inputs[1].frame.scale();
        align(&mut inputs, &[], None, &Distribution::alone(2)).unwrap();
        check_record(&upright, &inputs[0]);
        check_record(&diagonal, &inputs[1]);
        let shrunk = inputs[1].frame.scale() / before;
        assert!(shrunk < 0.99, "{shrunk}");
        assert_eq!(shrunk, inputs[0].frame.scale() / before);
        let [low, high] = around(&inputs);
        for k in 0..2 {
            assert!(low[k] >= ROOM[0] - 1e-12 && high[k] <= ROOM[1] + 1e-12);
        }
        assert_eq!(
            inputs
                .iter()
                .filter(|i| i.alignment.unwrap().reference)
                .count(),
            1
        );
    }

    #[test]
    fn alignments_are_read_as_they_are_written_and_damaged_ones_are_refused() {
        let rotation = plane_rotation::<3>(0, 2, 0.7) * plane_rotation::<3>(0, 1, 0.3);
        let written = Alignment {
            motion: RigidMotion::new(rotation, SVector::from([0.1, 0.2, 0.3])).unwrap(),
            mismatch: 0.125,
            reference: false,
            moved: Some(2.0),
        };
        let text = serde_json::to_value(written).unwrap();
        assert_eq!(text["rotation"][0][2], rotation[(0, 2)]);
        let read: Alignment<3> = serde_json::from_value(text.clone()).unwrap();
        assert_eq!((read.motion, read.moved), (written.motion, written.moved));
        assert!(serde_json::from_value::<Alignment<2>>(text.clone()).is_err());
        for damage in ["/rotation/1/1", "/translation/2"] {
            let mut damaged = text.clone();
            *damaged.pointer_mut(damage).unwrap() = serde_json::Value::Null;
            assert!(serde_json::from_value::<Alignment<3>>(damaged).is_err());
        }
        let mut reflected = text;
        let rows = reflected["rotation"].as_array_mut().unwrap();
        rows.swap(0, 1);
        assert!(serde_json::from_value::<Alignment<3>>(reflected).is_err());
    }

    #[test]
    fn the_reference_is_of_middling_size() {
        let images = [[8, 31], [12, 27], [10, 29], [4, 35], [11, 28]]
            .map(|[a, b]| block([40, 40, 40], [1.0; 3], [a; 3], [b; 3]));
        let frame = fit_frames(&images, None)[0];
        let contours = images.map(|image| boundary(&image, &frame).unwrap());
        let contours = contours.each_ref();
        assert_eq!(reference(&contours, |_| true).unwrap(), 2);
        assert_eq!(reference(&contours, |i| i == 4).unwrap(), 4);
    }
}
