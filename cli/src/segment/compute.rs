//! Computes edges and objects of images.

use fe_grid::{Grid, ScalarField};
use levelset::inspect::{border_share, border_share_of};
use levelset::{
    BoxEdge, Cause, Contour, Doubt, contour, hausdorff, largest_component, signed_distance,
};
use phasefield::segmentation::{
    Classes, Segmentation, SegmentationParams, memory_estimate, segment, split_classes,
};

use super::args::{Object, SegmentConfig};
use super::plan::{Placed, SegmentPlan};
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::memory::announce;
use crate::numbers::shown;
use crate::session::Session;
use shapespace_input::{Image, LEVEL, boundary};

/// A class with a smaller share of the grey values than this may be one of outliers: as many lie below the grey value 0
/// or above 1, each ([`shapespace_input`]).
const FEW: f64 = 0.005;
/// Two classes are clearly apart where this share of the variance is between them. It is .64 for normally distributed
/// and .75 for uniformly distributed values, which are one class.
const APART: f64 = 0.85;

/// An image and its segmentation.
pub(crate) struct Found<const D: usize> {
    pub placed: Placed<D>,
    pub params: SegmentationParams,
    pub result: Segmentation<D>,
    pub history: Vec<HistoryPoint>,
    /// `None` if there is none, or none was requested.
    pub object: Option<FoundObject<D>>,
}

impl<const D: usize> Found<D> {
    /// The doubts about the edges and the object.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = self.result.doubts();
        if let Some(object) = &self.object {
            doubts.extend(Doubt::check(Cause::OffEdges, object.off_edges));
            let share = border_share(&object.level_set, 0.0);
            let background = Doubt::check(Cause::Background, share);
            doubts.extend(background.or_else(|| self.doubt_of_border(object)));
            let dice = object.truth.as_ref().map(|truth| truth.dice);
            doubts.extend(dice.and_then(|dice| Doubt::check(Cause::Truth, dice)));
        }
        doubts
    }

    /// The doubt about an object that is cut off, as other commands have it of its mask.
    fn doubt_of_border(&self, object: &FoundObject<D>) -> Option<Doubt> {
        let samples = Grid::with_nodes(self.placed.image.size, 1.0)
            // Images that were read have at least two samples along every axis.
            .expect("a grid of the samples");
        let share = border_share_of(&samples, &|index| object.mask[index]);
        Doubt::check(Cause::Border, share)
    }
}

/// The object of an image.
pub(crate) struct FoundObject<const D: usize> {
    /// Its threshold, on the scale of the image, if it has one.
    pub threshold: Option<f64>,
    /// Quality of the separation of the classes of grey values; none for a configured threshold.
    pub separation: Option<f64>,
    /// Positive inside, on the grid.
    pub level_set: ScalarField<f64, D>,
    /// Inside or not, at the samples of the image.
    pub mask: Vec<bool>,
    /// Its boundary, in coordinates of the grid; the faces of the box close it.
    pub outline: Contour<D>,
    /// Share of the boundary that does not lie on an edge of the image.
    pub off_edges: f64,
    pub truth: Option<Comparison<D>>,
}

/// Comparison of an object with the true one.
pub(crate) struct Comparison<const D: usize> {
    pub outline: Contour<D>,
    pub dice: f64,
    /// Mean and 95th percentile of the distance of the two boundaries, in coordinates of the grid.
    pub distance: [f64; 2],
}

/// Segments all images, one after the other.
///
/// # Errors
/// [`CliError`] if a linear solver breaks down.
pub(super) fn compute<const D: usize>(
    plan: SegmentPlan<D>,
    session: &Session<'_>,
) -> Result<(SegmentConfig, Vec<Found<D>>), CliError> {
    let SegmentPlan {
        images,
        config,
        fingerprint,
    } = plan;
    let mut checkpointer = session.checkpointer(fingerprint)?;
    let several = images.len() > 1;
    let found = images.into_iter().map(|placed| {
        check_threshold(&placed, &config)?;
        let params = config.params(placed.nodal.grid())?;
        if several {
            session.progress.note(format!("{}:", placed.input.name));
        }
        let grid = placed.nodal.grid();
        announce(memory_estimate(grid), grid, &session.progress)?;
        let levels = grid.hierarchy(params.coarsest_nodes);
        let mut watch = checkpointer.observe(session.observer(&levels));
        let result = segment(&placed.nodal, &params, &mut watch)?;
        let object = object(&placed, &result, &config);
        Ok(Found {
            history: watch.finish(),
            placed,
            params,
            result,
            object,
        })
    });
    let found = found.collect::<Result<_, CliError>>()?;
    session.ended(checkpointer);
    Ok((config, found))
}

/// Checks that a configured threshold separates grey values of the image; smoothed values lie
/// between its smallest and its largest.
fn check_threshold<const D: usize>(
    placed: &Placed<D>,
    config: &SegmentConfig,
) -> Result<(), CliError> {
    let values = || placed.nodal.as_slice().iter().copied();
    let bounds = [
        values().fold(f64::INFINITY, f64::min),
        values().fold(f64::NEG_INFINITY, f64::max),
    ];
    let [low, high] = bounds.map(|value| placed.range.number(value));
    match config.threshold {
        Some(number) if !(low..high).contains(&number) => Err(CliError::Option {
            option: "--threshold",
            value: shown(number),
            remedy: format!(
                "the grey values of '{}' are from {low} to {high}",
                placed.image.path.display()
            ),
        }),
        _ => Ok(()),
    }
}

/// A function that is positive in an object, with its threshold and quality.
struct Inside<const D: usize> {
    level_set: ScalarField<f64, D>,
    threshold: Option<f64>,
    separation: Option<f64>,
}

/// The object on one side of a threshold; `None` if there are fewer grey values than classes.
fn beside_threshold<const D: usize>(
    placed: &Placed<D>,
    result: &Segmentation<D>,
    config: &SegmentConfig,
    sign: f64,
) -> Option<Inside<D>> {
    let values = result.image.as_slice();
    let (threshold, separation) = if let Some(number) = config.threshold {
        (placed.range.scaled(number), None)
    } else {
        let classes = split(values, config.classes)?;
        let last = classes.thresholds.len() - 1;
        let number = if sign > 0.0 { last } else { 0 };
        (classes.thresholds[number], Some(classes.separation))
    };
    let mut level_set = result.image.clone();
    for u in level_set.as_mut_slice() {
        *u = sign * (*u - threshold);
    }
    Some(Inside {
        level_set,
        threshold: Some(threshold),
        separation,
    })
}

/// The classes of grey values, nearly all of which lie between 0 and 1. A few that lie far beyond, such as hot pixels or
/// metal in computed tomography, are a class of their own by their variance; they do not count as one where the
/// others fall into two that are clearly apart.
fn split(values: &[f64], n_classes: usize) -> Option<Classes> {
    let classes = split_classes(values, n_classes)?;
    let ends = [classes.thresholds.first()?, classes.thresholds.last()?];
    let beyond = [
        values.iter().filter(|v| *v < ends[0]).count(),
        values.iter().filter(|v| *v > ends[1]).count(),
    ];
    if beyond.into_iter().min()? as f64 > FEW * values.len() as f64 {
        return Some(classes);
    }
    let near: Vec<f64> = values.iter().map(|v| v.clamp(0.0, 1.0)).collect();
    let others = split_classes(&near, n_classes).filter(|found| found.separation >= APART);
    Some(others.unwrap_or(classes))
}

/// The region that edges separate from the largest region. Regions end where the phase field is
/// 1/2, at a distance of `2 eps ln 2` from the edge: the object is reduced by as much as the rest
/// of the box.
fn enclosed<const D: usize>(result: &Segmentation<D>) -> Option<Inside<D>> {
    let around = largest_component(&result.phase_field, 0.5).ok()?;
    let mut rest = around;
    for inside in rest.as_mut_slice() {
        *inside = 1.0 - *inside;
    }
    let mut level_set = signed_distance(&rest, 0.5).ok()?;
    let width = result.levels.last()?.interface_width;
    for d in level_set.as_mut_slice() {
        *d -= 2.0 * std::f64::consts::LN_2 * width;
    }
    Some(Inside {
        level_set,
        threshold: None,
        separation: None,
    })
}

fn object<const D: usize>(
    placed: &Placed<D>,
    result: &Segmentation<D>,
    config: &SegmentConfig,
) -> Option<FoundObject<D>> {
    let Inside {
        mut level_set,
        threshold,
        separation,
    } = match config.object {
        Object::Bright => beside_threshold(placed, result, config, 1.0)?,
        Object::Dark => beside_threshold(placed, result, config, -1.0)?,
        Object::Enclosed => enclosed(result)?,
        Object::None => return None,
    };
    if config.largest {
        let largest = largest_component(&level_set, 0.0).ok()?;
        for (u, keep) in level_set.as_mut_slice().iter_mut().zip(largest.as_slice()) {
            if *keep == 0.0 {
                *u = -u.abs();
            }
        }
    }
    // Neither an empty object nor one that fills the image has a boundary.
    let outline = contour(&level_set, 0.0, BoxEdge::Closed).ok()?;
    let image = &placed.image;
    let at = |i: usize| {
        let sample = image.sample(i).map(|k| k as f64);
        level_set.sample(placed.input.frame.to_unit(sample))[0] > 0.0
    };
    let mask: Vec<bool> = (0..image.values.len()).map(at).collect();
    let truth = placed.truth.as_ref();
    let truth = truth.and_then(|truth| compare(truth, placed, &mask, &outline));
    Some(FoundObject {
        threshold,
        separation,
        level_set,
        mask,
        off_edges: result.off_edges(&outline),
        outline,
        truth,
    })
}

/// `None` for a true mask without a boundary, which masks read from files always have.
fn compare<const D: usize>(
    truth: &Image<D>,
    placed: &Placed<D>,
    mask: &[bool],
    outline: &Contour<D>,
) -> Option<Comparison<D>> {
    let inside = |v: &f64| *v > LEVEL;
    let pairs = mask.iter().zip(truth.values.iter());
    let both = pairs.filter(|(m, t)| **m && inside(t)).count();
    let own = mask.iter().filter(|m| **m).count();
    let other = truth.values.iter().filter(|t| inside(t)).count();
    let true_outline = boundary(truth, &placed.input.frame).ok()?;
    let distance = hausdorff(outline, &true_outline).ok()?;
    Some(Comparison {
        outline: true_outline,
        dice: 2.0 * both as f64 / (own + other).max(1) as f64,
        distance: [distance.mean, distance.percentile_95],
    })
}
