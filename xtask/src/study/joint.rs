//! Segmentation and averaging at the same time against segmentation first, on noisy images of
//! letters whose edges are known.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{dice, signed_distance};
use phasefield::Profile;
use phasefield::segmentation::{SegmentationParams, Weights, segment, split_classes};
use shape_average::joint::{JointParams, joint_average};
use shapespace::generate::{Placed, area_share, letters, make_grey};
use shapespace::input::LEVEL;

use super::{Outcome, Section};
use crate::table::{Table, checked};

const NODES: usize = 129;
/// Contrast of the images, and the standard deviation of their noise.
const CASES: [(f64, f64); 6] = [
    (0.5, 0.05),
    (0.5, 0.1),
    (0.5, 0.15),
    (0.25, 0.05),
    (0.25, 0.08),
    (0.25, 0.1),
];
/// Weight of the edges of an image, beside a mismatch of weight one.
const EDGES: f64 = 1.0;
/// Length over which images are smoothed, in spacings.
const SMOOTH_CELLS: f64 = 4.0;
/// Least jump of an edge, as a share of the contrast.
const SHARE: f64 = 0.5;

/// An image and what is known of it.
struct Known {
    image: ScalarField<f64, 2>,
    distance: ScalarField<f64, 2>,
    /// The phase field of its boundary.
    edges: ScalarField<f64, 2>,
}

/// How near images and phase fields are to the truth: Dice overlap of the brighter of two classes,
/// and the difference of the phase fields as a share of the true one's from 1, means of all images.
fn quality(
    known: &[Known],
    images: &[ScalarField<f64, 2>],
    edges: &[ScalarField<f64, 2>],
) -> Outcome<[f64; 2]> {
    let n = known.len() as f64;
    let mut means = [0.0; 2];
    for ((known, image), edges) in known.iter().zip(images).zip(edges) {
        let classes = split_classes(image.as_slice(), 2).ok_or("an image without contrast")?;
        means[0] += dice(image, classes.thresholds[0], &known.distance, 0.0)? / n;
        let pairs = edges.as_slice().iter().zip(known.edges.as_slice());
        let off: f64 = pairs.map(|(v, t)| (v - t).powi(2)).sum();
        let all: f64 = known
            .edges
            .as_slice()
            .iter()
            .map(|t| (t - 1.0).powi(2))
            .sum();
        means[1] += (off / all).sqrt() / n;
    }
    Ok(means)
}

fn images(contrast: f64, noise: f64, profile: Profile) -> Outcome<Vec<Known>> {
    let grid = Grid::<2>::cube(NODES);
    let drawn = letters().into_iter().enumerate();
    drawn
        .map(|(seed, member)| {
            let mut image = area_share(&Placed::centred(member.shape.as_ref()), grid);
            let distance = signed_distance(&image, LEVEL)?;
            make_grey(image.as_mut_slice(), contrast, noise, seed as u64);
            Ok(Known {
                edges: profile.phase_field(&distance),
                image,
                distance,
            })
        })
        .collect()
}

/// The sweep over contrast and noise.
pub fn section() -> Outcome<Section> {
    let mut table = Table::new([
        "contrast",
        "noise",
        "Dice, alone",
        "Dice, jointly",
        "error of the edges, alone",
        "error of the edges, jointly",
        "seconds",
    ]);
    let spacing = Grid::<2>::cube(NODES).spacing();
    let usual = JointParams::default();
    let profile = Profile::new(usual.average.interface_cells * spacing)?;
    for (contrast, noise) in CASES {
        let known = images(contrast, noise, profile)?;
        let greys: Vec<_> = known.iter().map(|k| k.image.clone()).collect();
        let segmentation = SegmentationParams {
            weights: Weights::for_scales(EDGES, SMOOTH_CELLS * spacing, SHARE * contrast)?,
            ..SegmentationParams::default()
        };
        let mut alone = (Vec::new(), Vec::new());
        for image in &greys {
            let found = segment(image, &segmentation, &mut Silent)?;
            alone.0.push(found.image);
            alone.1.push(found.phase_field);
        }
        let params = JointParams {
            segmentation,
            ..usual.clone()
        };
        let joint = joint_average(&greys, &params, &mut Silent)?;
        let first = quality(&known, &alone.0, &alone.1)?;
        let both = quality(&known, &joint.images, &joint.phase_fields)?;
        table.row([
            format!("{contrast}"),
            format!("{noise}"),
            format!("{:.4}", first[0]),
            checked(format!("{:.4}", both[0]), both[0] >= first[0]),
            format!("{:.4}", first[1]),
            checked(format!("{:.4}", both[1]), both[1] <= first[1]),
            format!("{:.1}", joint.seconds),
        ]);
    }
    Ok(Section {
        title: "Segmentation and averaging at the same time",
        text: "Three drawings of the letter B at 129 nodes a side, as grey images of the given \
               contrast with normal noise of the given standard deviation. Each is segmented alone, \
               and all are segmented and averaged jointly, with the same weights of their energies. \
               Dice is that of the brighter of two classes of the smoothed images with the true \
               letters; the error of the edges is the root mean square difference of the phase \
               fields from those of the true boundaries, as a share of their difference from 1. \
               Joint figures that are worse are marked.",
        table,
    })
}
