//! Simultaneous segmentation and averaging of photographs, radiographs and slices of brains.

use std::path::{Path, PathBuf};

use fe_grid::minimise::Silent;
use fe_grid::{InverseDeformation, ScalarField};
use levelset::{dice, signed_distance};
use phasefield::segmentation::{SegmentationParams, Weights};
use shape_average::joint::{JointParams, JointResult, joint_average, spread};
use shapespace_input::place::{nodal_values, whole_frames};
use shapespace_input::{AnyImages, Image, LEVEL, ReadOptions, read_grey_images, read_images};

use super::Section;
use super::real::files;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Weight of the edges of an image, beside a mismatch of weight one.
const EDGES: f64 = 2.0;

/// Images of about one size.
struct Set {
    name: &'static str,
    /// The command as typed by a user.
    typed: &'static str,
    images: Vec<PathBuf>,
    /// Masks of the true objects, if they are known.
    truth: Vec<PathBuf>,
    nodes: usize,
    smooth: f64,
    contrast: f64,
}

/// The real images.
pub fn section(data: &Path) -> Outcome<Section> {
    let hands = |person: &str, folder: &str| -> Outcome<Vec<PathBuf>> {
        let mut all = files(&data.join("hands").join(folder), ".png")?;
        let own = |path: &PathBuf| path.to_string_lossy().contains(person);
        // The seventh posture of the first person is turned by a quarter.
        all.retain(|path| own(path) && !path.to_string_lossy().contains("p1-07"));
        Ok(all)
    };
    let sets = [
        Set {
            name: "hands of the first person",
            typed: "data/hands/grey/hand-p1-0[1-4].png --grid 257 --contrast .12 --smooth .02",
            images: hands("p1", "grey")?,
            truth: hands("p1", "grey-truth")?,
            nodes: 257,
            smooth: 0.02,
            contrast: 0.12,
        },
        Set {
            name: "hands of the second person",
            typed: "data/hands/grey/hand-p2-0*.png --grid 257 --contrast .12 --smooth .02",
            images: hands("p2", "grey")?,
            truth: hands("p2", "grey-truth")?,
            nodes: 257,
            smooth: 0.02,
            contrast: 0.12,
        },
        Set {
            name: "slices of brains",
            typed: "data/brain-slices/*.png --grid 257 --contrast .35",
            images: files(&data.join("brain-slices"), ".png")?,
            truth: Vec::new(),
            nodes: 257,
            smooth: 0.02,
            contrast: 0.35,
        },
        Set {
            name: "radiographs of the thorax",
            typed: "data/thorax-drr/*.png --grid 129 --smooth .02",
            images: files(&data.join("thorax-drr"), ".png")?,
            truth: Vec::new(),
            nodes: 129,
            smooth: 0.02,
            contrast: 0.2,
        },
    ];
    let mut table = Table::new([
        "images",
        "`average --joint`",
        "differ by",
        "onto each other",
        "overlap of truths",
        "onto each other",
        "least determinant",
        "seconds",
    ]);
    for set in &sets {
        table.row(match read_grey_images(&set.images)?.0 {
            AnyImages::D2(images) => row(set, &images, |images| match images {
                AnyImages::D2(images) => Some(images),
                AnyImages::D3(_) => None,
            })?,
            AnyImages::D3(images) => row(set, &images, |images| match images {
                AnyImages::D2(_) => None,
                AnyImages::D3(images) => Some(images),
            })?,
        });
    }
    Ok(Section {
        title: "Photographs, radiographs and slices of brains",
        text: "Real images of one size, segmented and averaged jointly over the whole box. The \
               difference of images is the root of their variance about the mean, for the smoothed \
               images and for the same images under the deformations. For hands masks are known, \
               which are not used in the computation: they are deformed by the same deformations, \
               and their overlap is the mean Dice of all pairs. Values that are worse than without \
               deformations, and deformations that fold, are marked.",
        table,
        chart: None,
    })
}

/// Measurements of a set.
fn row<const D: usize>(
    set: &Set,
    images: &[Image<D>],
    of_dimension: impl Fn(AnyImages) -> Option<Vec<Image<D>>>,
) -> Outcome<[String; 8]> {
    let (frames, grid) = whole_frames(images, set.nodes)?;
    let on_grid = |images: &[Image<D>]| -> Outcome<Vec<ScalarField<f64, D>>> {
        let both = images.iter().zip(&frames);
        let nodal: Result<Vec<_>, _> = both
            .map(|(i, frame)| nodal_values(i, frame, grid))
            .collect();
        Ok(nodal?)
    };
    let result = averaged(set, &on_grid(images)?)?;
    let (before, after) = (spread(&result.images), spread(&result.pushed));
    let [overlap_before, overlap_after] = if set.truth.is_empty() {
        [String::from("–"), String::from("–")]
    } else {
        let masks = of_dimension(read_images(&set.truth, &ReadOptions::default())?);
        let masks = on_grid(&masks.ok_or("masks of another dimension")?)?;
        let truths: Result<Vec<_>, _> = masks.iter().map(|m| signed_distance(m, LEVEL)).collect();
        let truths = truths?;
        let (before, after) = (
            mean_overlap(&truths)?,
            mean_overlap(&moved(&result, &truths))?,
        );
        [
            format!("{before:.4}"),
            checked(format!("{after:.4}"), after > before),
        ]
    };
    Ok([
        format!("{} {}", images.len(), set.name),
        format!("`{}`", set.typed),
        format!("{before:.4}"),
        checked(format!("{after:.4}"), after < before),
        overlap_before,
        overlap_after,
        checked(
            format!("{:.3}", result.certificate.min_det),
            result.certificate.certified,
        ),
        format!("{:.0}", result.seconds),
    ])
}

fn averaged<const D: usize>(set: &Set, images: &[ScalarField<f64, D>]) -> Outcome<JointResult<D>> {
    let usual = JointParams::default();
    let params = JointParams {
        segmentation: SegmentationParams {
            weights: Weights::for_scales(EDGES, set.smooth, set.contrast)?,
            ..usual.segmentation
        },
        ..usual
    };
    Ok(joint_average(images, &params, &mut Silent)?)
}

/// Masks under the deformations of their images.
fn moved<const D: usize>(
    result: &JointResult<D>,
    truths: &[ScalarField<f64, D>],
) -> Vec<ScalarField<f64, D>> {
    let both = truths.iter().zip(&result.displacements);
    let outside = -1.0;
    both.map(|(truth, u)| InverseDeformation::new(u).push_forward(truth, outside))
        .collect()
}

/// The mean Dice overlap of all pairs.
fn mean_overlap<const D: usize>(shapes: &[ScalarField<f64, D>]) -> Outcome<f64> {
    let mut overlaps = Vec::new();
    for (i, a) in shapes.iter().enumerate() {
        for b in &shapes[i + 1..] {
            overlaps.push(dice(a, 0.0, b, 0.0)?);
        }
    }
    Ok(overlaps.iter().sum::<f64>() / overlaps.len() as f64)
}
