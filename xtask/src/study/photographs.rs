//! Segmentation and averaging at the same time on photographs and radiographs, and slices of brains.

use std::path::{Path, PathBuf};

use fe_grid::minimise::Silent;
use fe_grid::{InverseDeformation, ScalarField};
use levelset::{dice, signed_distance};
use phasefield::segmentation::{SegmentationParams, Weights};
use shape_average::joint::{JointParams, JointResult, joint_average, spread};
use shapespace::input::fit::{nodal_values, whole_frame};
use shapespace::input::{AnyImages, Image, LEVEL, ReadOptions, read_grey_images, read_images};

use super::real::files;
use super::{Outcome, Section};
use crate::table::{Table, checked};

/// Weight of the edges of an image, beside a mismatch of weight one.
const EDGES: f64 = 2.0;

/// Images of one size.
struct Set {
    name: &'static str,
    /// The command as a person would type it.
    typed: &'static str,
    images: Vec<PathBuf>,
    /// Masks of what is to be found in them, where they are known.
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
        let (images, truths) = read(set)?;
        let result = averaged(set, &images)?;
        let before = spread(&result.images);
        let after = spread(&result.pushed);
        let overlaps = if truths.is_empty() {
            [String::from("–"), String::from("–")]
        } else {
            let (before, after) = (
                mean_overlap(&truths)?,
                mean_overlap(&moved(&result, &truths))?,
            );
            [
                format!("{before:.4}"),
                checked(format!("{after:.4}"), after > before),
            ]
        };
        let [overlap_before, overlap_after] = overlaps;
        table.row([
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
        ]);
    }
    Ok(Section {
        title: "Photographs, radiographs and slices of brains",
        text: "Real images of one size, segmented and averaged jointly over the whole box. Images differ \
               by the root of their variance about the mean, of smoothed images as they are and brought \
               onto each other by the deformations. Of hands it is known which pixels they cover: \
               masks that no computation has seen are moved by the same deformations, and their \
               overlap is the mean Dice of all pairs. Figures that are worse than without a \
               deformation, and deformations that fold, are marked.",
        table,
    })
}

/// Images and signed distances of their truths on the grid.
type Read = (Vec<ScalarField<f64, 2>>, Vec<ScalarField<f64, 2>>);

fn flat(images: AnyImages) -> Outcome<Vec<Image<2>>> {
    match images {
        AnyImages::D2(images) => Ok(images),
        AnyImages::D3(_) => Err("a picture is a volume".into()),
    }
}

fn read(set: &Set) -> Outcome<Read> {
    let images = flat(read_grey_images(&set.images)?.0)?;
    let (frame, grid) = whole_frame(&images[0], set.nodes)?;
    let nodal: Result<Vec<_>, _> = images
        .iter()
        .map(|image| nodal_values(image, &frame, grid))
        .collect();
    let mut truths = Vec::new();
    if !set.truth.is_empty() {
        for mask in flat(read_images(&set.truth, &ReadOptions::default())?)? {
            let mask = nodal_values(&mask, &frame, grid)?;
            truths.push(signed_distance(&mask, LEVEL)?);
        }
    }
    Ok((nodal?, truths))
}

fn averaged(set: &Set, images: &[ScalarField<f64, 2>]) -> Outcome<JointResult<2>> {
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

/// Masks where the deformations of their images bring them.
fn moved(result: &JointResult<2>, truths: &[ScalarField<f64, 2>]) -> Vec<ScalarField<f64, 2>> {
    let both = truths.iter().zip(&result.displacements);
    let outside = -1.0;
    both.map(|(truth, u)| InverseDeformation::new(u).push_forward(truth, outside))
        .collect()
}

/// The mean Dice overlap of all pairs.
fn mean_overlap(shapes: &[ScalarField<f64, 2>]) -> Outcome<f64> {
    let mut overlaps = Vec::new();
    for (i, a) in shapes.iter().enumerate() {
        for b in &shapes[i + 1..] {
            overlaps.push(dice(a, 0.0, b, 0.0)?);
        }
    }
    Ok(overlaps.iter().sum::<f64>() / overlaps.len() as f64)
}
