//! Masks with exact boundaries, from closed outlines and surfaces.
//!
//! The samples of such a mask serve where something is asked of samples: whether the object touches
//! the border, how many pieces it has, and where volumes are written. Distances are those to the
//! exact boundary, whatever the grid. Where a surface crosses itself, so that parts of it
//! lie inside the object, the boundary is that of the samples instead; their values then rise linearly with the
//! distance, so that it is accurate to second order in the spacing. Outlines are [resolved](super::resolve) before.

use std::path::Path;

use levelset::{Contour, ContourDistance, bounds};

use super::decode::{VALUE, check_count};
use super::filled::{Covered, Filled};
use super::winding::{Samples, winding_numbers};
use super::{Image, InputError, LEVEL, reserve};

/// Samples along the longest side of the object, in 2D and 3D.
const SAMPLES: [usize; 2] = [512, 128];
/// The shortest and the longest extent, from a tenth of a micrometre to a hundred kilometres in millimetres.
const EXTENTS: [f64; 2] = [1e-4, 1e8];
/// Samples beyond the object, to each side.
const AROUND: usize = 3;
/// Segments of which each is asked what lies to its sides.
const MOST_SEGMENTS: usize = 20_000;

/// Segments shorter than this share of the diagonal are what rounding leaves between the ends of a curve.
const SHORTEST: f64 = 4e-10;

/// Where the boundary of an object is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// From the contours, if they are the boundary as far as the samples tell.
    Contours,
    /// From the samples: parts of the contours lie inside.
    Samples,
}

/// What closed contours enclose, as a mask.
pub(crate) fn into_image<const D: usize>(
    filled: &Filled<D>,
    source: Source,
    path: &Path,
) -> Result<Image<D>, InputError> {
    let whole = filled.whole();
    let samples = samples_around(&whole, path)?;
    let count = check_count(&samples.size.map(|n| n as u64), path)? as u64;
    reserve(path, (VALUE + 4) * count, VALUE * count)?;
    let unfit = |reason: &str| InputError::Malformed {
        path: path.into(),
        format: "outline",
        reason: reason.into(),
    };
    let covered = filled.covered(&whole, &samples).map_err(unfit)?;
    if D == 2 && !covered.inside.contains(&true) {
        return Err(unfit(
            "it encloses no area, or is thinner than a 512th of its length",
        ));
    }
    let mut image = Image {
        values: Vec::<u8>::new().into(),
        size: samples.size,
        spacing: [samples.spacing; D],
        origin: samples.origin,
        path: path.into(),
        affine: None,
        direction: None,
        plain_array: false,
        outline: None,
        remark: None,
    };
    let exact = match source {
        Source::Contours => exact(&whole, filled, &covered, &samples),
        Source::Samples => None,
    };
    if let Some(exact) = exact {
        let inside = covered.inside.iter().map(|&is_inside| u8::from(is_inside));
        image.values = inside.collect::<Vec<u8>>().into();
        let h = samples.spacing;
        let sample = |p: [f64; D]| std::array::from_fn(|k| (p[k] - samples.origin[k]) / h);
        image.outline = Some(exact.map(sample));
    } else {
        image.values = ramp(&whole, &covered.inside, &image)?.into();
    }
    Ok(image)
}

fn samples_around<const D: usize>(
    contour: &Contour<D>,
    path: &Path,
) -> Result<Samples<D>, InputError> {
    // Not of points without a segment or triangle.
    let [low, high] = bounds(contour.all_corners().flatten());
    let sides: [f64; D] = std::array::from_fn(|k| high[k] - low[k]);
    let longest = sides.iter().fold(0.0f64, |a, b| a.max(*b));
    if !(EXTENTS[0]..=EXTENTS[1]).contains(&longest) {
        return Err(InputError::Extent {
            path: path.into(),
            extent: longest,
        });
    }
    let spacing = longest / SAMPLES[D - 2] as f64;
    let steps = sides.map(|side| (side / spacing).ceil() as usize);
    // The object lies in the middle of its samples.
    let origin = std::array::from_fn(|k| {
        let slack = 0.5 * (steps[k] as f64 * spacing - sides[k]);
        low[k] - slack - AROUND as f64 * spacing
    });
    Ok(Samples {
        size: steps.map(|n| n + 1 + 2 * AROUND),
        spacing,
        origin,
    })
}

/// The contour as the boundary of what lies inside, if it is: oriented, and without parts inside.
fn exact<const D: usize>(
    contour: &Contour<D>,
    filled: &Filled<D>,
    covered: &Covered,
    samples: &Samples<D>,
) -> Option<Contour<D>> {
    let all = |expected: i32| {
        let mut both = covered.numbers.iter().zip(&covered.inside);
        both.all(|(&n, &is_inside)| n == expected * i32::from(is_inside))
    };
    if all(1) {
        return Some(contour.clone());
    }
    if all(-1) {
        return Some(contour.clone().flipped());
    }
    if D == 3 || contour.simplices().len() > MOST_SEGMENTS {
        return None;
    }
    // Each segment of an outline is turned such that the object lies to its left.
    let inside = |p: [f64; D]| {
        let mut parts = filled.parts().iter();
        parts.any(|(contour, fill)| fill.holds(winding_number(contour, p)))
    };
    let [low, high] = contour.bounds();
    let squares = (0..D).map(|k| (high[k] - low[k]).powi(2));
    let shortest = SHORTEST * squares.sum::<f64>().sqrt();
    let sides = |number: usize| {
        let [p, q] = [contour.corners(number)[0], contour.corners(number)[D - 1]];
        let normal = [p[1] - q[1], q[0] - p[0]];
        let step = 1e-6;
        (contour.size(number) > shortest).then(|| {
            [step, -step].map(|step| {
                inside(std::array::from_fn(|k| {
                    0.5 * (p[k] + q[k]) + step * normal[k]
                }))
            })
        })
    };
    let mut turned = Vec::new();
    let sides = (0..contour.simplices().len()).map(sides).collect();
    let sides = with_short_ones(sides, contour.simplices());
    for (simplex, sides) in contour.simplices().iter().zip(sides) {
        let mut simplex = *simplex;
        match sides {
            [true, false] => turned.push(simplex),
            [false, true] => {
                simplex.swap(0, 1);
                turned.push(simplex);
            }
            _ => {}
        }
    }
    let turned = Contour::new(contour.points().to_vec(), turned).ok()?;
    // Where segments cross, they would have to be turned at the crossing.
    let found = winding_numbers(&turned, samples).ok()?;
    let inside = covered.inside.iter().copied().map(i32::from);
    found.into_iter().eq(inside).then_some(turned)
}

/// What lies to the sides of segments, where it is known of all that are not short: these have the sides of
/// their neighbours, without which a curve would have a gap.
fn with_short_ones<const D: usize>(
    mut sides: Vec<Option<[bool; 2]>>,
    segments: &[[u32; D]],
) -> Vec<[bool; 2]> {
    let follows = |i: usize| segments[i - 1][D - 1] == segments[i][0];
    for i in (1..segments.len()).filter(|&i| follows(i)) {
        sides[i] = sides[i].or(sides[i - 1]);
    }
    for i in (1..segments.len()).rev().filter(|&i| follows(i)) {
        sides[i - 1] = sides[i - 1].or(sides[i]);
    }
    // A curve of short segments only is a point.
    let known = |sides: Option<[bool; 2]>| sides.unwrap_or_default();
    sides.into_iter().map(known).collect()
}

/// The winding number of an outline about one point.
fn winding_number<const D: usize>(contour: &Contour<D>, place: [f64; D]) -> i32 {
    let crossing = |[p, q]: [[f64; D]; 2]| {
        let above = [p[1] > place[1], q[1] > place[1]];
        if above[0] == above[1] {
            return 0;
        }
        let x = p[0] + (place[1] - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
        if x >= place[0] {
            0
        } else if above[0] {
            1
        } else {
            -1
        }
    };
    let corners = contour.all_corners();
    corners.map(|c| crossing([c[0], c[D - 1]])).sum()
}

/// Values that cross the level at the boundary, between a sample inside and one outside.
fn ramp<const D: usize>(
    contour: &Contour<D>,
    inside: &[bool],
    image: &Image<D>,
) -> Result<Vec<f64>, InputError> {
    let distance = ContourDistance::new(contour).map_err(|error| InputError::Malformed {
        path: image.path.clone(),
        format: "surface",
        reason: error.to_string(),
    })?;
    let strides: [usize; D] = std::array::from_fn(|k| image.size[..k].iter().product());
    let at_the_boundary = |index: usize| {
        let sample = image.sample(index);
        (0..D).any(|k| {
            let before = sample[k] > 0 && inside[index - strides[k]] != inside[index];
            let after = sample[k] + 1 < image.size[k];
            before || after && inside[index + strides[k]] != inside[index]
        })
    };
    let indices: Vec<usize> = (0..inside.len()).collect();
    let value = |&index: &usize| {
        let side = if inside[index] { 1.0 } else { -1.0 };
        if !at_the_boundary(index) {
            return LEVEL + 0.5 * side;
        }
        let sample = image.sample(index);
        let place = std::array::from_fn(|k| image.origin[k] + sample[k] as f64 * image.spacing[k]);
        let far = distance.nearest(place).distance / image.spacing[0];
        // A sample on the boundary belongs to the side that it counts to.
        LEVEL + 0.25 * side * far.clamp(1e-6, 1.9)
    };
    Ok(fe_grid::parallel::map(&indices, &value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::winding::Fill;

    /// A ring of two curves in one direction, so that one of them is turned, with ends that differ by rounding.
    #[test]
    fn segments_of_rounding_are_no_gaps() {
        let circle = |radius: f64, first: u32| {
            let mut points: Vec<[f64; 2]> = (0..40)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / 40.0;
                    [radius * angle.cos(), radius * angle.sin()]
                })
                .collect();
            let end = points[0];
            points.push([end[0] * (1.0 + f64::EPSILON), end[1]]);
            points.rotate_left(first as usize);
            let segments = (0..41).map(|i| [i, (i + 1) % 41]).collect();
            Contour::new(points, segments).unwrap()
        };
        // The short segment is the first one, one between, or the last one of a curve.
        for first in [40, 17, 0] {
            let ring = circle(15.0, first).joined(&circle(5.0, first));
            let filled = Filled::of_one(ring, Fill::EvenOdd);
            let image = into_image(&filled, Source::Contours, Path::new("ring")).unwrap();
            let outline = image.outline.unwrap();
            assert!(outline.is_closed(), "{first}");
            assert_eq!(outline.simplices().len(), 82);
        }
    }
}
