//! Theorems 4.2, 4.7 and 4.8: growth, minimising sequences, and the minimisers themselves.

use std::ops::RangeInclusive;

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField, tensor};
use geodesic::{GeodesicParams, geodesic};
use phasefield::segmentation::{AmbrosioTortorelli, Weights};
use shape_average::joint::{JointParams, joint_average};
use shape_average::{AverageParams, BoundaryCondition, average};

use crate::error::VerifyError;
use crate::order::differences;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::matrices::{Sequence, norm, stretches};
use crate::tools::pointwise::{density, law};
use crate::tools::shapes::{ball, ellipse, spheroid};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "existence-growth",
        reference: "Theorem 4.7, growth",
        claim: "There is a law of any moduli with \
                W ≥ κ(|A|^p + |cof A|^q + D^r + D^−s), p, q > 3 and s > 2q/(q−3)",
        broken: "the law is logdet",
        run: growth,
    },
    Statement {
        name: "existence-bounded",
        reference: "Theorem 4.2",
        claim: "Deformations of bounded energy have bounded gradients",
        broken: "the law is that of linear elasticity, as if it had the growth",
        run: |setting| bounded(setting, setting.ingredient("power", "linear")),
    },
    Statement {
        name: "existence-bounded-linear",
        reference: "Theorem 4.2",
        claim: "The same with linear elasticity, whose growth is none",
        broken: "the hypothesis is taken as met",
        run: |setting| bounded(setting, "linear"),
    },
    Statement {
        name: "existence-average",
        reference: "Theorem 4.7",
        claim: "The energy of the phase-field average has a minimiser with 0 ≤ v ≤ 1 and \
                homeomorphic deformations; energies of minimisers converge in h",
        broken: "γ grows with the grid, so that every grid has another energy",
        run: |setting| minimisers::<2>(setting, "power", setting.effort(4..=6, 4..=7)),
    },
    Statement {
        name: "existence-average-logdet",
        reference: "Theorem 4.7",
        claim: "The same with the default law, whose growth is below what the theorem asks for",
        broken: "γ grows with the grid; the hypothesis is taken as met",
        run: |setting| minimisers::<2>(setting, "logdet", setting.effort(4..=6, 4..=7)),
    },
    Statement {
        name: "existence-average-3d",
        reference: "Theorem 4.7",
        claim: "The same in space, for which the theorem is stated",
        broken: "γ grows with the grid, so that every grid has another energy",
        run: |setting| minimisers::<3>(setting, "power", setting.effort(3..=4, 3..=5)),
    },
    Statement {
        name: "existence-joint",
        reference: "Theorem 4.8",
        claim: "The energy of joint segmentation and averaging has a minimiser with phase fields in \
                [0, 1] and homeomorphic deformations, where v² + k_ε stands in place of v²",
        broken: "k_ε is left out, as printed",
        run: joint,
    },
    Statement {
        name: "existence-geodesic",
        reference: "Theorem 6.3",
        claim: "Between diffeomorphic shapes there is a discrete geodesic whose deformations do not \
                fold, and its dissipation is a continuous function of the shapes",
        broken: "the end shape jumps by 0.02",
        run: discrete_geodesic,
    },
];

fn growth(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law(setting.ingredient("power", "logdet"), 0.01, 1.0)?;
    let mut outcome = Outcome::with_law::<3>(spec, &[Requirement::HomeomorphismGrowth])?;
    let path = |f: fn(f64) -> [f64; 3]| -> Result<Vec<(f64, f64)>, VerifyError> {
        [1e2, 1e3, 1e4]
            .into_iter()
            .map(|t| Ok((t, density(&spec, &stretches(f(t)))?)))
            .collect()
    };
    let reason = "the powers have left constants behind at 1e2 and beyond";
    outcome.order(
        "W along diag(t, t^−½, t^−½), where |A| = t",
        "t",
        path(|t| [t, t.powf(-0.5), t.powf(-0.5)])?,
        4.0,
        0.05,
        reason,
    );
    outcome.order(
        "W along diag(t^½, t^½, 1/t), where |cof A| = t",
        "t",
        path(|t| [t.sqrt(), t.sqrt(), 1.0 / t])?,
        4.0,
        0.05,
        reason,
    );
    outcome.order(
        "W along t^−⅓ 1, where det A = 1/t",
        "t",
        path(|t| [t.powf(-1.0 / 3.0); 3])?,
        9.0,
        0.05,
        "s = 9 > 2q/(q − 3) = 8",
    );
    outcome.order(
        "W along t^⅓ 1, where det A = t",
        "t",
        path(|t| [t.powf(1.0 / 3.0); 3])?,
        8.0 / 3.0,
        0.1,
        "|cof A|⁴ = 9 t^(8/3), more than D²",
    );
    Ok(outcome)
}

fn bounded(_setting: Setting, name: &str) -> Result<Outcome, VerifyError> {
    let spec = law(name, 1.0, 1.0)?;
    let mut outcome =
        Outcome::with_law::<3>(spec, &[Requirement::Polyconvexity, Requirement::NormGrowth])?;
    // Gradients of energy at most one along lines from the identity, in many directions, some of
    // them skew.
    let mut numbers = Sequence::new(14);
    let mut largest = 0.0f64;
    for sample in 0..200 {
        let b = numbers.matrix::<3>();
        let b = if sample % 2 == 0 {
            tensor::sub(&b, &tensor::transpose(&b))
        } else {
            b
        };
        let mut s = 0.0f64;
        let mut step = 0.1;
        while s < 1e6 {
            let value = density(&spec, &tensor::scale(&b, s + step))?;
            if value > 1.0 {
                break;
            }
            s += step;
            step *= 1.1;
        }
        largest = largest.max(norm(&tensor::scale(&b, s)));
    }
    outcome.at_most(
        "largest |Dφ − 1| with W ≤ 1, along 200 lines from the identity",
        largest,
        10.0,
        "W ≥ c|A|^p − C; lines end at 1e6",
    );
    Ok(outcome)
}

fn minimisers<const D: usize>(
    setting: Setting,
    name: &str,
    levels: RangeInclusive<u32>,
) -> Result<Outcome, VerifyError> {
    let spec = law(name, 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<D>(
        spec,
        &[Requirement::Polyconvexity, Requirement::HomeomorphismGrowth],
    )?;
    let (coarsest, mut in_range) = (*levels.start(), true);
    let (mut steps, mut energies, mut strains) = (Vec::new(), Vec::new(), Vec::new());
    let (mut lows, mut least_det) = (Vec::new(), f64::INFINITY);
    for level in levels {
        let grid = Grid::<D>::dyadic(level);
        let shapes = [ball(grid, 0.24), spheroid(grid, 0.3, 0.2)?];
        let params = AverageParams {
            law: spec,
            boundary: BoundaryCondition::Identity,
            // The same width on every finest grid.
            interface_cells: f64::from(1u32 << (level - coarsest)),
            mismatch_weight: setting.ingredient(1.0, f64::from(1u32 << (level - coarsest))),
            tolerance: 2e-5,
            max_iterations: 400,
            ..AverageParams::default()
        };
        let result = average(&shapes, &params, &mut Silent)?;
        let given = result.shapes.phase_fields.iter();
        in_range &= given
            .flat_map(Field::as_slice)
            .all(|v| (0.0..=1.0).contains(v));
        energies.push(result.energy.total);
        steps.push(grid.spacing());
        let mut low = f64::INFINITY;
        for v in result.average.as_slice() {
            low = low.min(*v);
        }
        lows.push(low);
        least_det = least_det.min(result.certificate.min_det);
        let elastic: f64 = result.energy.elastic.iter().sum();
        strains.push(elastic);
    }
    outcome.condition("0 ≤ v_i ≤ 1", in_range);
    let changes = differences(&steps, &energies);
    // Two grids tell a change and no order of it.
    if changes.len() > 1 {
        outcome.order_at_least(
            "|E_h − E_{h/2}|",
            "h",
            changes,
            1.5,
            "bilinear elements have the second order where fields are smooth; here the coarsest grid \
             has one cell for the width of the interface, and gains more",
        );
    } else {
        outcome.at_most(
            "|E_h/E_{h/2} − 1| of the two grids",
            (energies[0] / energies[energies.len() - 1] - 1.0).abs(),
            0.1,
            "the coarsest grid has one cell for the width of the interface",
        );
    }
    outcome.note(format!("least det Dφ on whole cells: {least_det:.3}"));
    outcome.at_least(
        "least v of all grids",
        lows.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
        -5e-2,
        "0 ≤ v by the maximum principle, which elements keep up to what a kink in a cell makes",
    );
    outcome.at_most(
        "largest elastic energy of any grid over the least",
        strains.iter().fold(0.0f64, |a, b| a.max(*b))
            / strains.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
        2.0,
        "minimisers stay bounded in h",
    );
    Ok(outcome)
}

/// Disks, bright on dark.
fn image(grid: Grid<2>, radius: f64) -> ScalarField<f64, 2> {
    let h = grid.spacing();
    let mut numbers = Sequence::new(15);
    let mut image = Field::from_fn(grid, |[x, y]| {
        let inside = radius - (x - 0.5).hypot(y - 0.5);
        [0.5 + (inside / h).clamp(-0.5, 0.5)]
    });
    for v in image.as_mut_slice() {
        *v += numbers.between(-0.05, 0.05);
    }
    image
}

fn joint(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("power", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(
        spec,
        &[Requirement::Polyconvexity, Requirement::HomeomorphismGrowth],
    )?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    // Coercivity: the energy of a steep image where the phase field is zero.
    let width = 2.0 * grid.spacing();
    let conductance = setting.ingredient(width * width, 0.0);
    outcome.condition("k_ε > 0", conductance > 0.0);
    let energy = AmbrosioTortorelli {
        weights: Weights {
            fidelity: 0.0,
            smoothness: 1.0,
            edges: 1.0,
        },
        interface_width: width,
        edge_conductance: conductance,
    };
    let zero = vec![0.0; grid.n_nodes()];
    let slope = 1.0 / width;
    let mut state = Field::<f64, 2, 1>::from_fn(grid, |[x, _]| [slope * x]).into_vec();
    state.extend(&zero);
    let smoothness = energy.terms(&grid, &zero, &state)?.smoothness;
    outcome.value(
        "β∫(v² + k_ε)|∇u|² where v = 0 and |∇u| = 1/ε, k_ε = ε²",
        smoothness,
        1.0,
        1e-10,
        "gradients of bounded energy are bounded; without k_ε they cost nothing on edges",
    );
    let params = JointParams {
        average: AverageParams {
            law: spec,
            boundary: BoundaryCondition::Identity,
            ..AverageParams::default()
        },
        segmentation: phasefield::segmentation::SegmentationParams {
            weights: Weights::for_scales(1.0, 0.06, 0.4)?,
            ..Default::default()
        },
        ..JointParams::default()
    };
    let result = joint_average(
        &[image(grid, 0.22), image(grid, 0.28)],
        &params,
        &mut Silent,
    )?;
    let mut rises = f64::NEG_INFINITY;
    for level in &result.levels {
        for pair in level.energies.windows(2) {
            rises = rises.max(pair[1] / pair[0] - 1.0);
        }
    }
    outcome.at_most(
        "largest rise of the energy in half a round, relative",
        rises,
        1e-10,
        "both halves lower it, up to how well the average is solved for",
    );
    let least_det = result.certificate.min_det;
    outcome.note(format!("least det Dφ on whole cells: {least_det:.3}"));
    Ok(outcome)
}

fn discrete_geodesic(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("power", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(
        spec,
        &[Requirement::Polyconvexity, Requirement::HomeomorphismGrowth],
    )?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let mut least_det = f64::INFINITY;
    let mut dissipation = |more: f64| -> Result<f64, VerifyError> {
        let params = GeodesicParams {
            steps: 4,
            law: spec,
            tolerance: 1e-7,
            max_iterations: Some(400),
            ..GeodesicParams::default()
        };
        let end = ellipse(grid, [0.3 + more, 0.2])?;
        let path = geodesic(&ball(grid, 0.24), &end, &params, &mut Silent)?;
        least_det = least_det.min(path.certificate.min_det);
        Ok(path.dissipation())
    };
    let at_rest = dissipation(0.0)?;
    let mut points = Vec::new();
    for more in [0.02, 0.01, 0.005] {
        let jump = setting.ingredient(0.0, 0.02);
        points.push((more, dissipation(more + jump)? / at_rest - 1.0));
    }
    outcome.order(
        "|Diss(S + δ)/Diss(S) − 1|, δ added to a half-axis",
        "δ",
        points,
        1.0,
        0.3,
        "a smooth function of the half-axis, whose second derivative is positive",
    );
    outcome.note(format!(
        "least det Dφ_k on the cells of the shapes: {least_det:.3}"
    ));
    Ok(outcome)
}
