//! Simultaneous segmentation and averaging against segmentation first, on noisy images of letters
//! with known edges.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{dice, signed_distance};
use phasefield::segmentation::{SegmentationParams, Weights, segment, split_classes};
use shape_average::joint::{JointParams, joint_average};
use shapespace_generate::{Family, Placed, area_share, family, letters, make_grey};
use shapespace_input::LEVEL;

use super::Section;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

const NODES: usize = 129;
/// Kinds of shapes, contrasts of the images, and standard deviations of their noise.
const CASES: [(&str, f64, f64); 6] = [
    ("blobs", 0.5, 0.1),
    ("blobs", 0.5, 0.2),
    ("blobs", 0.5, 0.3),
    ("blobs", 0.5, 0.4),
    ("blobs", 0.25, 0.15),
    ("letters", 0.5, 0.05),
];
/// Weight of the edges of an image, beside a mismatch of weight one.
const EDGES: f64 = 2.0;
/// Length over which images are smoothed, and its part per squared ratio of noise to contrast. A
/// phase field that is zero everywhere must cost more than the noise, `8 eps noise^2 / length` less
/// than the square of the least jump; strokes must not be smoothed away.
const SMOOTH: f64 = 0.02;
const SMOOTH_NOISE: f64 = 0.2;
/// Smallest jump of an edge, as a fraction of the contrast.
const SHARE: f64 = 0.8;

/// An image and its true object.
struct Known {
    image: ScalarField<f64, 2>,
    distance: ScalarField<f64, 2>,
}

/// Means over all images.
#[derive(Default)]
struct Quality {
    /// Dice overlap of the brighter of two classes of an image with the true object.
    dice: f64,
    /// Share of the edges, `v < 1/2`, that the phase field of the true boundary has as well.
    precision: f64,
    /// Share of the nodes next to the true boundary that lie on an edge.
    recall: f64,
}

impl Quality {
    fn of(
        known: &[Known],
        images: &[ScalarField<f64, 2>],
        edges: &[ScalarField<f64, 2>],
        width: f64,
    ) -> Outcome<Self> {
        let n = known.len() as f64;
        // The phase field of a boundary is 1 - exp(-|d| / (2 width)).
        let reach = 2.0 * width * std::f64::consts::LN_2;
        let mut mean = Self::default();
        for ((known, image), edges) in known.iter().zip(images).zip(edges) {
            let classes = split_classes(image.as_slice(), 2).ok_or("an image without contrast")?;
            mean.dice += dice(image, classes.thresholds[0], &known.distance, 0.0)? / n;
            let half_spacing = 0.5 * edges.grid().spacing();
            let (mut found, mut right, mut all, mut met) = (0u32, 0u32, 0u32, 0u32);
            for (v, d) in edges.as_slice().iter().zip(known.distance.as_slice()) {
                let on_edge = *v < 0.5;
                found += u32::from(on_edge);
                right += u32::from(on_edge && d.abs() <= reach);
                all += u32::from(d.abs() <= half_spacing);
                met += u32::from(on_edge && d.abs() <= half_spacing);
            }
            mean.precision += f64::from(right) / f64::from(found.max(1)) / n;
            mean.recall += f64::from(met) / f64::from(all.max(1)) / n;
        }
        Ok(mean)
    }

    /// The harmonic mean of precision and recall.
    fn edges(&self) -> f64 {
        2.0 * self.precision * self.recall / (self.precision + self.recall).max(f64::MIN_POSITIVE)
    }
}

fn images(kind: &str, contrast: f64, noise: f64) -> Outcome<Vec<Known>> {
    let grid = Grid::<2>::cube(NODES);
    let drawn = match kind {
        "letters" => letters(),
        _ => family::<2>(Family::Blobs, 1).unwrap_or_default(),
    };
    let drawn = drawn.into_iter().enumerate();
    drawn
        .map(|(seed, member)| {
            let mut image = area_share(&Placed::centred(member.shape.as_ref()), grid);
            let distance = signed_distance(&image, LEVEL)?;
            make_grey(image.as_mut_slice(), contrast, noise, seed as u64);
            Ok(Known { image, distance })
        })
        .collect()
}

/// The sweep over contrast and noise.
pub fn section() -> Outcome<Section> {
    let mut table = Table::new([
        "images",
        "contrast",
        "noise",
        "Dice, alone",
        "jointly",
        "by the average",
        "edges, alone",
        "jointly",
        "precision, alone",
        "jointly",
        "seconds",
    ]);
    let usual = JointParams::default();
    let width = usual.average.interface_cells * Grid::<2>::cube(NODES).spacing();
    for (kind, contrast, noise) in CASES {
        let length = SMOOTH.max(SMOOTH_NOISE * (noise / contrast).powi(2));
        let known = images(kind, contrast, noise)?;
        let greys: Vec<_> = known.iter().map(|k| k.image.clone()).collect();
        let segmentation = SegmentationParams {
            weights: Weights::for_scales(EDGES, length, SHARE * contrast)?,
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
        let predicted: Vec<_> = (0..greys.len()).map(|i| joint.predicted(i)).collect();
        let first = Quality::of(&known, &alone.0, &alone.1, width)?;
        let both = Quality::of(&known, &joint.images, &joint.phase_fields, width)?;
        let seen = Quality::of(&known, &predicted, &joint.phase_fields, width)?;
        table.row([
            kind.to_string(),
            format!("{contrast}"),
            format!("{noise}"),
            format!("{:.4}", first.dice),
            format!("{:.4}", both.dice),
            checked(format!("{:.4}", seen.dice), seen.dice >= first.dice),
            format!("{:.3}", first.edges()),
            checked(
                format!("{:.3}", both.edges()),
                both.edges() >= first.edges(),
            ),
            format!("{:.3}", first.precision),
            format!("{:.3}", both.precision),
            format!("{:.1}", joint.seconds),
        ]);
    }
    Ok(Section {
        title: "Segmentation and averaging at the same time",
        text: "Five blobs, and three drawings of the letter B, on 129 x 129 nodes, as grey images \
               of the given contrast with normal noise of the given standard deviation. Each image \
               is segmented by itself, and all are segmented and averaged jointly, with the same \
               weights of the energies and with stronger smoothing for stronger noise. Dice is the \
               overlap of the brighter of two classes with the true object, for the smoothed \
               images and for their predictions, the average image composed with the deformations. \
               Edges are the nodes where the phase field is below 1/2. Precision is the fraction \
               of them where the phase field of the true boundary is also below 1/2; the column of \
               the edges is the harmonic mean of precision and recall. Joint values that are worse \
               are marked.",
        table,
        chart: None,
    })
}
