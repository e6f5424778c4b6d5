//! The result of a joint average.

use crate::energy::Energy;
use fe_grid::minimise::Status;
use fe_grid::{Certificate, Field, ScalarField};
use levelset::{LevelsetError, signed_distance};
use phasefield::segmentation::SegmentationEnergy;
use serde::Serialize;

/// The terms of the energy.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct JointEnergy {
    /// The energy, without the barrier against folding.
    pub total: f64,
    /// Terms of the shapes; the total of these is their weighted sum alone.
    pub shapes: Energy,
    /// Terms of the images, including their weights.
    pub images: Vec<SegmentationEnergy>,
    /// Estimate of the energy above the minimum, from the last two rounds of the level: as if the decreases
    /// of all later ones formed a geometric series with theirs. `None` before the third round, as the first one also
    /// mends what the coarser grid left. On fourteen averages of disks, blobs, letters and bars it was .6 to 1.2 times
    /// what a longer run won.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining: Option<f64>,
}

impl JointEnergy {
    /// Returns the quantity that is minimised: the energy plus the barrier.
    pub fn objective(&self) -> f64 {
        self.total + self.shapes.barrier
    }

    /// Returns the energy above the minimum relative to the elastic energy, or to a thousandth of the whole where that
    /// is more: less is the strain by the noise of equal images. `None` if it was not estimated.
    pub fn remaining_share(&self) -> Option<f64> {
        let [elastic, ..] = self.shapes.parts;
        Some(self.remaining? / elastic.max(LEAST_SHARE * self.total))
    }
}

/// Least share of the energy that counts as elastic energy.
const LEAST_SHARE: f64 = 1e-3;

/// Largest ratio of the decreases of two rounds from which their series is summed up.
const SLOWEST: f64 = 0.99;

/// What rounds would still gain after these energies, of every half of a round: `d r / (1 - r)` after a round that
/// gained `d`, for `r` times what the one before it gained.
pub(super) fn remaining(energies: &[f64]) -> Option<f64> {
    let [_, _, .., first, _, second, _, last] = *energies else {
        return None;
    };
    let [before, decrease] = [first - second, second - last];
    if decrease <= 0.0 {
        return Some(0.0);
    }
    let ratio = if decrease < SLOWEST * before {
        decrease / before
    } else {
        SLOWEST
    };
    Some(decrease * ratio / (1.0 - ratio))
}

/// Convergence history of one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointLevel {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Interface width `epsilon`.
    pub interface_width: f64,
    /// Status at the end.
    pub status: Status,
    /// Number of rounds, of two halves each.
    pub rounds: usize,
    /// Number of accepted steps of the minimiser of averages.
    pub steps: usize,
    /// Conjugate-gradient iterations, summed over all systems for images, and for phase fields.
    pub system_iterations: [usize; 2],
    /// Objective after the first deformation, then after every half of a round.
    pub energies: Vec<f64>,
    /// Terms of the energy at the end.
    pub energy: JointEnergy,
    /// The worst deformation at the end.
    pub certificate: Certificate,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// The joint average of a number of images, on the finest level.
#[derive(Clone, Debug, Serialize)]
pub struct JointResult<const D: usize> {
    /// The average phase field `v`: 0 on the edges of the average.
    #[serde(skip)]
    pub average: ScalarField<f64, D>,
    /// The average image, the mean of `u_i o phi_i^-1` over all images defined at a point.
    #[serde(skip)]
    pub average_image: ScalarField<f64, D>,
    /// The smoothed images `u_i`.
    #[serde(skip)]
    pub images: Vec<ScalarField<f64, D>>,
    /// Their phase fields `v_i`.
    #[serde(skip)]
    pub phase_fields: Vec<ScalarField<f64, D>>,
    /// Displacements; `phi_i(x) = x + u_i(x)` maps image `i` to the average.
    #[serde(skip)]
    pub displacements: Vec<Field<f64, D, D>>,
    /// The smoothed images pushed forward, `u_i o phi_i^-1`.
    #[serde(skip)]
    pub pushed: Vec<ScalarField<f64, D>>,
    /// For every image the Dice overlap of its edges with those of the average that its deformation carries to it:
    /// of the nodes where `v_i` and `v o phi_i` are below one half.
    pub edge_overlaps: Vec<f64>,
    /// For every image the share of the average's edges that it lacks: of the nodes with `v < 1/2` that its deformation
    /// reaches, those that are farther than a spacing from where `v_i o phi_i^-1` is below one half.
    pub unmatched_shares: Vec<f64>,
    /// For every image the share of its edges that is thicker than two lines beside each other: nodes with `v_i < 1/2`
    /// that are farther than `4 eps ln 2` from the others.
    pub solid_shares: Vec<f64>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<JointLevel>,
    /// A converged status, or else the status of the first level that did not converge.
    #[serde(skip)]
    pub status: Status,
    /// Certificate of the worst deformation: certified if the determinant is positive on all cells
    /// of all deformations.
    pub certificate: Certificate,
    /// Wall time, in seconds.
    #[serde(rename = "solver_seconds")]
    pub seconds: f64,
}

impl<const D: usize> JointResult<D> {
    /// Returns how much the deformed images differ, relative to the images as they are; zero for equal images.
    pub fn spread_share(&self) -> f64 {
        let [before, after] = [&self.images, &self.pushed].map(|images| spread(images));
        if before > 0.0 { after / before } else { 0.0 }
    }
}

/// Computes the square root of the variance of some fields about their mean, averaged over the
/// nodes; a measure of how much images differ. Returns zero for an empty slice.
pub fn spread<const D: usize>(fields: &[ScalarField<f64, D>]) -> f64 {
    let n = fields.len() as f64;
    let nodes = fields.first().map_or(0, |field| field.as_slice().len());
    let variance: f64 = (0..nodes)
        .map(|node| {
            let values = || fields.iter().map(|f| f.as_slice()[node]);
            let mean = values().sum::<f64>() / n;
            values().map(|v| (v - mean).powi(2)).sum::<f64>() / n
        })
        .sum();
    (variance / nodes.max(1) as f64).sqrt()
}

/// The share of the nodes with `v < 1/2` from which it is farther to those with `v > 1/2` than two lines beside each
/// other are wide: the phase field of one line is `1 - exp(-|x|/(2 eps))`, below one half up to
/// `2 eps ln 2`. Thicker edges are no lines: the texture of the image, or lines that the grid does not resolve.
pub(super) fn solid_share<const D: usize>(
    phase_field: &ScalarField<f64, D>,
    interface_width: f64,
) -> f64 {
    let depth = match depth_in_edges(phase_field.clone()) {
        Ok(depth) => depth,
        Err(LevelsetError::FullObject { .. }) => return 1.0,
        // No edges.
        Err(_) => return 0.0,
    };
    let deep = 2.0 * 2.0 * interface_width * std::f64::consts::LN_2;
    let count = |least: f64| depth.as_slice().iter().filter(|d| **d > least).count();
    count(deep) as f64 / count(0.0).max(1) as f64
}

/// The signed distance to where a phase field is one half, positive on its edges.
fn depth_in_edges<const D: usize>(
    mut phase_field: ScalarField<f64, D>,
) -> Result<ScalarField<f64, D>, LevelsetError> {
    for v in phase_field.as_mut_slice() {
        *v = 0.5 - *v;
    }
    signed_distance(&phase_field, 0.0)
}

/// The share of the nodes with `v < 1/2`, of those that are reached, from which it is farther than a spacing to where a
/// phase field that was pushed forward is below one half; 0 where there are none.
pub(super) fn unmatched_share<const D: usize>(
    average: &ScalarField<f64, D>,
    pushed: ScalarField<f64, D>,
    reached: impl Fn(usize) -> bool,
) -> f64 {
    let spacing = average.grid().spacing();
    let depth = match depth_in_edges(pushed) {
        Ok(depth) => Some(depth),
        Err(LevelsetError::FullObject { .. }) => return 0.0,
        // No edges.
        Err(_) => None,
    };
    let edges = average.as_slice().iter().enumerate();
    let edges = edges.filter(|(node, v)| **v < 0.5 && reached(*node));
    let (mut all, mut unmatched) = (0.0f64, 0.0);
    for (node, _) in edges {
        let far = depth
            .as_ref()
            .is_none_or(|depth| depth.as_slice()[node] < -spacing);
        all += 1.0;
        unmatched += f64::from(u8::from(far));
    }
    unmatched / all.max(1.0)
}

/// The Dice overlap of the nodes where two phase fields are below one half; 0 for fields without edges, of which
/// nothing corresponds.
pub(super) fn edge_overlap<const D: usize>(
    first: &ScalarField<f64, D>,
    second: &ScalarField<f64, D>,
) -> f64 {
    let (mut either, mut both) = (0.0f64, 0.0);
    for (v, w) in first.as_slice().iter().zip(second.as_slice()) {
        let edges = [*v < 0.5, *w < 0.5];
        either += f64::from(u8::from(edges[0]) + u8::from(edges[1]));
        both += f64::from(u8::from(edges[0] && edges[1]));
    }
    if either > 0.0 {
        2.0 * both / either
    } else {
        0.0
    }
}

impl<const D: usize> JointResult<D> {
    /// Returns the terms of the energy on the finest level.
    pub fn energy(&self) -> JointEnergy {
        self.levels
            .last()
            .map(|l| l.energy.clone())
            .unwrap_or_default()
    }

    /// Computes the prediction of an image by the average: the average image composed with the
    /// deformation, `u o phi_i`. Noise that the images do not share is averaged out.
    ///
    /// # Panics
    /// If there is no such image.
    pub fn predicted(&self, i: usize) -> ScalarField<f64, D> {
        self.average_image.compose(self.displacements[i].as_slice())
    }
}
