//! The average as a problem with constraints: minimising sequences, the cost of a shape whose deformations
//! are minimisers themselves, and deformations that have an inverse.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, InverseDeformation, Lattice, Tensor, preimages, tensor};
use hyperelastic::LawSpec;
use shape_average::{AverageParams, BoundaryCondition, average};

use crate::error::VerifyError;
use crate::order::differences;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::averages::close;
use crate::tools::matrices::{Sequence, inverse, minus_identity, plane_rotation};
use crate::tools::pointwise::{density, law};
use crate::tools::shapes::ellipse;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "existence-sequence",
        reference: "Theorem 4.2",
        claim: "Minimising sequences of averages of ellipses under affine deformations, from any start, end \
                in the same ellipse with the same energy",
        broken: "the law is that of linear elasticity, without growth",
        run: sequence,
    },
    Statement {
        name: "existence-homeomorphism",
        reference: "Theorems 4.7 and 4.8, homeomorphisms",
        claim: "Deformations of an average have an inverse: every point of the box is the image of \
                one point",
        broken: "displacements are four times as large",
        run: homeomorphism,
    },
    Statement {
        name: "average-constrained",
        reference: "Remark 4.3",
        claim: "The average is the shape of least Σ𝒲[O_i, φ_i*], where φ_i* are the minimisers for a \
                fixed shape: from it to averages of the weights ½ ± t the cost grows as t²",
        broken: "the cost has other weights",
        run: constrained,
    },
];

/// Images of the unit disk that are averaged.
const ELLIPSES: [([f64; 2], f64); 3] = [([1.3, 0.8], 0.2), ([0.9, 1.0], 0.0), ([1.1, 0.9], 1.1)];

/// The energy of the ellipse `M` of the unit disk, with the deformations `M Q_i B_i⁻¹` of the ellipses `B_i`
/// onto it: entries of `M`, and an angle for each rotation `Q_i`.
fn energy(spec: &LawSpec, x: &[f64; 7]) -> Result<f64, VerifyError> {
    let m = [[x[0], x[1]], [x[2], x[3]]];
    let mut sum = 0.0;
    for (i, (axes, angle)) in ELLIPSES.into_iter().enumerate() {
        let stretch: Tensor<f64, 2> = [[axes[0], 0.0], [0.0, axes[1]]];
        let b = tensor::product(&plane_rotation::<2>(0, 1, angle), &stretch);
        let turned = tensor::product(&m, &plane_rotation::<2>(0, 1, x[4 + i]));
        let phi = tensor::product(&turned, &inverse(&b));
        sum += axes[0] * axes[1] * density(spec, &minus_identity(&phi))?;
    }
    Ok(sum)
}

/// Descent from a start: the state at its end.
fn descend(spec: &LawSpec, mut x: [f64; 7]) -> Result<[f64; 7], VerifyError> {
    let (mut value, mut step) = (energy(spec, &x)?, 0.1);
    for _ in 0..2000 {
        let mut slope = [0.0; 7];
        for (k, slope) in slope.iter_mut().enumerate() {
            let at = |t: f64| {
                let mut y = x;
                y[k] += t;
                energy(spec, &y)
            };
            *slope = (at(1e-5)? - at(-1e-5)?) / 2e-5;
        }
        // As far as the energy falls.
        while step > 1e-9 {
            let mut y = x;
            y.iter_mut().zip(slope).for_each(|(y, s)| *y -= step * s);
            let found = energy(spec, &y)?;
            if found < value {
                (x, value, step) = (y, found, 1.5 * step);
                break;
            }
            step *= 0.5;
        }
    }
    Ok(x)
}

fn sequence(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law(setting.ingredient("power", "linear"), 1.0, 1.0)?;
    let mut outcome =
        Outcome::with_law::<2>(spec, &[Requirement::Polyconvexity, Requirement::NormGrowth])?;
    let mut numbers = Sequence::new(23);
    let mut ends = Vec::new();
    for _ in 0..setting.effort(8, 24) {
        let m = numbers.stretch::<2>(0.6, 1.6);
        let mut x = [m[0][0], m[0][1], m[1][0], m[1][1], 0.0, 0.0, 0.0];
        for angle in &mut x[4..] {
            *angle = numbers.between(-3.0, 3.0);
        }
        let x = descend(&spec, x)?;
        let size: f64 = x[..4].iter().map(|m| m * m).sum();
        ends.push([energy(&spec, &x)?, size.sqrt(), x[0] * x[3] - x[1] * x[2]]);
    }
    let spread = |k: usize| {
        let of = ends.iter().map(|end| end[k]);
        let least = of.clone().fold(f64::INFINITY, f64::min);
        of.fold(f64::NEG_INFINITY, f64::max) / least - 1.0
    };
    outcome.at_most(
        "largest energy at the ends of the sequences over the least, less one",
        spread(0),
        1e-6,
        "one minimum, up to rotations of the average and of the disk; descent ends at a step of 1e-9",
    );
    outcome.at_most(
        "the same of the area of the average",
        spread(2),
        1e-3,
        "the root of what is left of the energy",
    );
    outcome.at_most(
        "the same of the root of the half-axes squared of the average",
        spread(1),
        1e-3,
        "the root of what is left of the energy",
    );
    Ok(outcome)
}

fn homeomorphism(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("power", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(
        spec,
        &[Requirement::Polyconvexity, Requirement::HomeomorphismGrowth],
    )?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let shapes = [ellipse(grid, [0.3, 0.17])?, ellipse(grid, [0.17, 0.3])?];
    let params = AverageParams {
        law: spec,
        boundary: BoundaryCondition::Identity,
        ..close()
    };
    let mut result = average(&shapes, &params, &mut Silent)?;
    let rows: Vec<Vec<usize>> = (0..grid.n_cells())
        .collect::<Vec<_>>()
        .chunks(grid.cells_per_axis()[0])
        .map(<[usize]>::to_vec)
        .collect();
    // Points that no cell of a deformed grid has on an edge.
    let lattice = Lattice::midpoints(&grid, 3);
    let (mut fewest, mut most, mut off) = (usize::MAX, 0, 0.0f64);
    for u in &mut result.displacements {
        fe_grid::vector::scale(setting.ingredient(1.0, 4.0), u.as_mut_slice());
        let mut counts = vec![0usize; lattice.n_points()];
        for found in preimages(&grid, u.as_slice(), &rows, &lattice)
            .into_iter()
            .flatten()
        {
            counts[found.point] += 1;
        }
        fewest = counts.iter().fold(fewest, |a, b| a.min(*b));
        most = counts.iter().fold(most, |a, b| a.max(*b));
        let inverse = InverseDeformation::new(u);
        for node in 0..grid.n_nodes() {
            let y = grid.position(grid.node(node));
            // On the faces rounding decides whether a node is in the image.
            if y.iter().any(|y| *y == 0.0 || *y == 1.0) {
                continue;
            }
            let x = inverse.position(node).unwrap_or([f64::NAN; 2]);
            let u = u.sample(x);
            let error = (x[0] + u[0] - y[0]).hypot(x[1] + u[1] - y[1]);
            off = if error <= off { off } else { error };
        }
    }
    outcome.value(
        "most points that are mapped to a point of a fine lattice",
        most as f64,
        1.0,
        0.0,
        "no two: it is injective",
    );
    outcome.value(
        "fewest points that are mapped to a point of a fine lattice",
        fewest as f64,
        1.0,
        0.0,
        "one at least: it is onto",
    );
    outcome.at_most(
        "largest |φ(φ⁻¹(y)) − y| at the nodes of the box",
        off,
        1e-9,
        "Newton's method on a cell, to rounding",
    );
    Ok(outcome)
}

fn constrained(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[])?;
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let shapes = [ellipse(grid, [0.3, 0.2])?, ellipse(grid, [0.22, 0.28])?];
    let params = AverageParams {
        tolerance: 2e-6,
        max_iterations: 600,
        ..close()
    };
    let gamma = 0.5 * params.mismatch_weight;
    // The cost of averages of other weights, whose deformations are minimisers for their own shape.
    let share = setting.ingredient(0.5, 0.6);
    let cost = |t: f64| -> Result<f64, VerifyError> {
        let params = AverageParams {
            weights: Some(vec![0.5 + t, 0.5 - t]),
            ..params.clone()
        };
        let energy = average(&shapes, &params, &mut Silent)?.energy;
        let [w, f] = [energy.elastic, energy.mismatch];
        Ok(share * w[0]
            + (1.0 - share) * w[1]
            + gamma * (f[0] + f[1])
            + params.resolved_length_weight() * energy.length)
    };
    let steps = [0.2, 0.1, 0.05, 0.025];
    let costs = steps.map(cost).into_iter().collect::<Result<Vec<_>, _>>()?;
    let grows = costs.windows(2).map(|pair| pair[0] - pair[1]);
    outcome.order(
        "growth of the cost from the average of the weights ½ ± t to that of ½ ± 2t",
        "t",
        differences(&steps[1..], &costs),
        2.0,
        0.25,
        "a minimum over shapes at t = 0; fourth powers add a tenth",
    );
    outcome.at_least(
        "least of them over the largest",
        grows.clone().fold(f64::INFINITY, f64::min) / grows.fold(0.0, f64::max),
        0.02,
        "no other shape costs less: a sixteenth for the quarter of t",
    );
    Ok(outcome)
}
