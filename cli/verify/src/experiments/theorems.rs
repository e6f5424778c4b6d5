//! Consequences of the theorems that a computed result can show: change of variables, gauges, Piola's
//! identity, changes of topology, and shots.

use std::f64::consts::PI;

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField, VectorField, tensor};
use geodesic::calculus::{CalculusParams, shoot};
use geodesic::{Form, Geodesic, GeodesicParams, geodesic};
use levelset::{BoxEdge, Moments, connected_components, contour};
use shape_average::{AverageParams, BoundaryCondition, Solver, average};
use shape_pca::{Average, Compound, Pca, PcaParams};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::averages::close;
use crate::tools::curves::disk_at;
use crate::tools::matrices::{Sequence, minus_identity};
use crate::tools::pointwise::{law, response};
use crate::tools::quadrature::{Rule, around};
use crate::tools::shapes::ellipse_at;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "existence-change-of-variables",
        reference: "Theorem 4.7, transformation rule",
        claim: "For homeomorphisms that are the identity on the faces ∫f∘φ det Dφ = ∫f, on grids with \
                the second order of h, and ∫det Dφ = |Ω| exactly",
        broken: "the faces move",
        run: |setting| Ok(change_of_variables(setting)),
    },
    Statement {
        name: "existence-gauge",
        reference: "Theorem 4.2, translations",
        claim: "An average does not depend on where each of its shapes is: minimisers are \
                determined up to rigid motions only",
        broken: "the faces of the box are held",
        run: gauge,
    },
    Statement {
        name: "average-solvers",
        reference: "section 4, EnergyRelaxation",
        claim: "Alternating descent and the minimiser of the reduced functional come to the same \
                energy and the same average",
        broken: "descent is that of another γ",
        run: solvers,
    },
    Statement {
        name: "linear-piola",
        reference: "Lemma 5.1, the relation after it",
        claim: "Stresses of a further deformation of a deformed object are \
                σ = det A⁻¹W_,A(BA)Aᵀ as first Piola–Kirchhoff stress on it, and their loads those of \
                W_,A(BA) on the object before",
        broken: "the factor det A⁻¹ is left out",
        run: piola,
    },
    Statement {
        name: "modes-sampled",
        reference: "section 5, synthesis and scores",
        claim: "A shape that is synthesised from scores has these scores, and the distance \
                d_M = √(Σscore²/n)",
        broken: "its displacement is 1.1 times as large",
        run: sampled,
    },
    Statement {
        name: "path-topology",
        reference: "section 6, topology",
        claim: "Paths of level sets connect two disks with one: parts merge on the way",
        broken: "the end shape is in two parts",
        run: topology,
    },
    Statement {
        name: "path-topology-split",
        reference: "section 6, topology",
        claim: "Paths of level sets connect one shape with two disks: it splits on the way",
        broken: "the end shape is in one part",
        run: split,
    },
    Statement {
        name: "path-topology-hole",
        reference: "section 6, topology",
        claim: "Paths of level sets connect a ring with a disk: the hole shrinks on the way, and is gone \
                at the end",
        broken: "the end shape has the hole",
        run: hole,
    },
    Statement {
        name: "calculus-shot-disk",
        reference: "section 2, exp, of shapes",
        claim: "A disk that is shot with an even growth grows with constant speed, on a grid with the \
                closed form R₀ + tv, and stays a disk",
        broken: "the velocity has a shear",
        run: shot_disk,
    },
];

/// A deformation of the box that is the identity on its faces, and a further expansion.
fn inner(grid: Grid<2>, expansion: f64) -> VectorField<f64, 2> {
    VectorField::from_fn(grid, |[x, y]| {
        let bump = (PI * x).sin() * (PI * y).sin();
        let [u, v] = [0.11 * bump * (1.0 + y), 0.09 * bump * (3.0 * x).cos()];
        [u + expansion * x, v + expansion * y]
    })
}

fn change_of_variables(setting: Setting) -> Outcome {
    let f = |[x, y]: [f64; 2]| 1.0 + (4.0 * x).sin() * (3.0 * y + x).cos();
    let rule = Rule::composite(4, 12, 0.0, 1.0);
    let mut exact = 0.0;
    for &(x, a) in rule.points() {
        for &(y, b) in rule.points() {
            exact += a * b * f([x, y]);
        }
    }
    let (mut points, mut volume) = (Vec::new(), 0.0f64);
    for level in 3..=setting.effort(6, 8) {
        let grid = Grid::<2>::dyadic(level);
        let (h, strides, n) = (grid.spacing(), grid.strides(), grid.n_nodes());
        let displacement = inner(grid, setting.ingredient(0.0, 0.02));
        let u = displacement.as_slice();
        let field = ScalarField::<f64, 2>::from_fn(grid, |x| [f(x)]);
        let gauss = Rule::gauss(3, 0.0, 1.0);
        let (mut sum, mut det_sum) = (0.0, 0.0);
        for cell in 0..grid.n_cells() {
            let place = grid.cell(cell);
            let base = grid.node_index(place);
            for &(s, a) in gauss.points() {
                for &(t, b) in gauss.points() {
                    let mut gradient = [[0.0; 2]; 2];
                    let mut at = [0, 1].map(|k| place[k] as f64 * h + [s, t][k] * h);
                    for corner in 0..4usize {
                        let upper = [corner & 1, corner >> 1];
                        let node = base + upper[0] * strides[0] + upper[1] * strides[1];
                        let shape = [s, t].map(|x| [1.0 - x, x]);
                        let slope = [-1.0 / h, 1.0 / h];
                        for i in 0..2 {
                            let value = u[i * n + node];
                            gradient[i][0] += value * slope[upper[0]] * shape[1][upper[1]];
                            gradient[i][1] += value * shape[0][upper[0]] * slope[upper[1]];
                            at[i] += value * shape[0][upper[0]] * shape[1][upper[1]];
                        }
                    }
                    let det = tensor::determinant(&tensor::add_identity(&gradient));
                    let weight = a * b * h * h * det;
                    sum += weight * field.sample(at)[0];
                    det_sum += weight;
                }
            }
        }
        points.push((h, sum / exact - 1.0));
        volume = volume.max((det_sum - 1.0).abs());
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "|∫f∘φ det Dφ/∫f − 1|",
        "h",
        points,
        2.0,
        0.2,
        "interpolation of f; the kinks of f_h∘φ_h in cells",
    );
    outcome.at_most(
        "largest |∫det Dφ − |Ω||",
        volume,
        1e-12,
        "a null Lagrangian, which the rule integrates exactly",
    );
    outcome
}

fn gauge(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let h = grid.spacing();
    let params = AverageParams {
        boundary: setting.ingredient(BoundaryCondition::Natural, BoundaryCondition::Identity),
        ..close()
    };
    let run = |moved: [f64; 2]| {
        let shapes = [
            ellipse_at(grid, [0.26, 0.17], [0.5; 2], 0.3)?,
            ellipse_at(grid, [0.18, 0.22], [0.5 + moved[0], 0.5 + moved[1]], 0.0)?,
        ];
        let result = average(&shapes, &params, &mut Silent)?;
        let boundary = contour(&result.average_indicator, 0.5, BoxEdge::Open)?;
        let moments = Moments::of_contour(&boundary)?;
        let spread = moments.covariance.symmetric_eigenvalues();
        let elastic: f64 = result.energy.elastic.iter().sum();
        Ok::<_, VerifyError>((elastic, [spread.min(), spread.max()]))
    };
    let (here, there) = (run([0.0; 2])?, run([3.0 * h, -2.0 * h])?);
    let mut outcome = Outcome::default();
    outcome.value(
        "elastic energies with one shape moved by (3h, −2h), over those without",
        there.0 / here.0,
        1.0,
        0.02,
        "the void resists a thousandth; coarse levels see other cells",
    );
    let off = (0..2).map(|i| (there.1[i] / here.1[i] - 1.0).abs());
    outcome.at_most(
        "largest relative difference of the principal moments of the averages",
        off.fold(0.0, f64::max),
        0.01,
        "the same average elsewhere, to a twentieth of a spacing",
    );
    Ok(outcome)
}

fn solvers(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(4);
    let shapes = [
        ellipse_at(grid, [0.3, 0.2], [0.5; 2], 0.0)?,
        ellipse_at(grid, [0.22, 0.28], [0.5; 2], 0.0)?,
    ];
    let reduced = average(&shapes, &close(), &mut Silent)?;
    let params = AverageParams {
        solver: Solver::Descent,
        mismatch_weight: setting.ingredient(1.0, 1.1),
        tolerance: 2e-5,
        max_iterations: 400,
        ..AverageParams::default()
    };
    let descent = average(&shapes, &params, &mut Silent)?;
    let mut outcome = Outcome::default();
    outcome.value(
        "energy by alternating descent, over that of the reduced functional",
        descent.energy.total / reduced.energy.total,
        1.0,
        2e-3,
        "descent is slow near its end",
    );
    Ok(outcome)
}

fn piola(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut worst = 0.0f64;
    for name in ["logdet", "power"] {
        let spec = law(name, 1.3, 0.8)?;
        let mut numbers = Sequence::new(31);
        for _ in 0..20 {
            // A homogeneous object that was deformed by A, and a deformation B of what it became.
            let a = numbers.stretch::<2>(0.8, 1.3);
            let b = numbers.stretch::<2>(0.9, 1.1);
            let both = minus_identity(&tensor::product(&b, &a));
            let before = response(&spec, &both, &both)?.stress;
            let det = tensor::determinant(&a);
            let factor = setting.ingredient(1.0 / det, 1.0);
            let after = tensor::scale(&tensor::product_transposed(&before, &a), factor);
            // Forces on the boundary of a disk and of its image, tested with a linear field.
            let test = numbers.matrix::<2>();
            let work_before = around(64, |angle| {
                let (s, c) = angle.sin_cos();
                let (x, n) = ([c, s], [c, s]);
                let y = [0, 1].map(|i| a[i][0] * x[0] + a[i][1] * x[1]);
                (0..2)
                    .map(|i| {
                        let force = before[i][0] * n[0] + before[i][1] * n[1];
                        force * (test[i][0] * y[0] + test[i][1] * y[1])
                    })
                    .sum()
            });
            let work_after = around(64, |angle| {
                let (s, c) = angle.sin_cos();
                let y = [0, 1].map(|i| a[i][0] * c + a[i][1] * s);
                // The tangent of the image, turned.
                let t = [0, 1].map(|i| -a[i][0] * s + a[i][1] * c);
                let n = [t[1], -t[0]];
                (0..2)
                    .map(|i| {
                        let force = after[i][0] * n[0] + after[i][1] * n[1];
                        force * (test[i][0] * y[0] + test[i][1] * y[1])
                    })
                    .sum()
            });
            worst = worst.max((work_after / work_before - 1.0).abs());
        }
    }
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest relative difference of the work of the loads on both boundaries",
        worst,
        1e-9,
        "Nanson's formula, in closed form on an ellipse; products of some hundredths",
    );
    Ok(outcome)
}

fn sampled(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let displacements = [0.0, 1.3, 2.9, 4.1].map(|phase| {
        Field::<f64, 2, 2>::from_fn(grid, |x| {
            let inside: f64 = x.iter().map(|x| 4.0 * x * (1.0 - x)).product();
            [0, 1].map(|k| {
                inside * 0.03 * (4.0 * (x[1 - k] + 0.5 * x[k]) + phase * (k + 1) as f64).sin()
            })
        })
    });
    let indicator = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
        [(0.5 + 8.0 * (0.28 - (x - 0.5).hypot(y - 0.5))).clamp(0.0, 1.0)]
    });
    let objects = Average::new(displacements.into(), vec![indicator; 4], vec![0.25; 4])?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let pca = Pca::new(&objects, &compound, usize::MAX, &mut Silent)?;
    let scores = [1.2, -0.7, 0.4];
    let mut u = pca.space.synthesise(&scores)?;
    fe_grid::vector::scale(setting.ingredient(1.0, 1.1), u.as_mut_slice());
    let found = pca.space.scores(&compound, &u);
    let off = found.scores.iter().zip(scores).map(|(s, t)| (s - t).abs());
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest error of a score",
        off.fold(0.0, f64::max),
        1e-6,
        "orthonormal modes, up to rounding over the ratio of their variances",
    );
    outcome.value(
        "d_M of the sample",
        found.mahalanobis.over_n,
        (scores.iter().map(|s| s * s).sum::<f64>() / 4.0).sqrt(),
        1e-6,
        "its definition",
    );
    Ok(outcome)
}

/// Two disks whose centres are at the same distance from the middle.
fn two_disks(grid: Grid<2>, left: f64, radius: f64) -> ScalarField<f64, 2> {
    let mut two = disk_at(grid, [left, 0.5], radius);
    let other = disk_at(grid, [1.0 - left, 0.5], radius);
    for (u, v) in two.as_mut_slice().iter_mut().zip(other.as_slice()) {
        *u = u.max(*v);
    }
    two
}

/// Number of parts of the shapes of a path of level sets.
fn parts(from: &ScalarField<f64, 2>, to: &ScalarField<f64, 2>) -> Result<Vec<f64>, VerifyError> {
    let path = by_level_sets(from, to, 4)?;
    let count = |u| connected_components(u, 0.0).sizes.len() as f64;
    Ok(path.level_sets.iter().map(count).collect())
}

fn by_level_sets(
    from: &ScalarField<f64, 2>,
    to: &ScalarField<f64, 2>,
    steps: usize,
) -> Result<Geodesic<2>, VerifyError> {
    let params = GeodesicParams {
        form: Form::LevelSets,
        steps,
        ..GeodesicParams::default()
    };
    Ok(geodesic(from, to, &params, &mut Silent)?)
}

fn topology(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    // The end shape is in one part.
    let one = setting.ingredient(
        ellipse_at(grid, [0.3, 0.16], [0.5; 2], 0.0)?,
        two_disks(grid, 0.3, 0.14),
    );
    let parts = parts(&two_disks(grid, 0.32, 0.15), &one)?;
    let mut outcome = Outcome::default();
    outcome.value(
        "parts of the last shape but one",
        parts[parts.len() - 2],
        1.0,
        0.0,
        "the disks have merged before the end",
    );
    Ok(outcome)
}

fn split(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let one = ellipse_at(grid, [0.3, 0.16], [0.5; 2], 0.0)?;
    let end = setting.ingredient(
        two_disks(grid, 0.32, 0.15),
        ellipse_at(grid, [0.31, 0.14], [0.5; 2], 0.0)?,
    );
    let parts = parts(&one, &end)?;
    let mut outcome = Outcome::default();
    outcome.value(
        "parts of the last shape but one",
        parts[parts.len() - 2],
        2.0,
        0.0,
        "the shape has split before the end",
    );
    Ok(outcome)
}

fn hole(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let with_hole = |radius: f64| {
        ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
            let d = (x - 0.5).hypot(y - 0.5);
            [(0.3 - d).min(d - radius)]
        })
    };
    let radius = 0.09;
    let path = by_level_sets(
        &with_hole(radius),
        &with_hole(setting.ingredient(-1.0, radius)),
        3,
    )?;
    let sizes: Vec<f64> = path
        .level_sets
        .iter()
        .map(|u| {
            let inside = (0..grid.n_nodes()).filter(|node| {
                let [x, y] = grid.position(grid.node(*node));
                (x - 0.5).hypot(y - 0.5) < 0.2 && u.as_slice()[*node] <= 0.0
            });
            inside.count() as f64
        })
        .collect();
    let mut outcome = Outcome::default();
    let last = sizes.len() - 1;
    outcome.at_most(
        "size of the hole in the last shape but one, over that of the first",
        sizes[last - 1] / sizes[0],
        0.25,
        "deformations make it as small as some cells, which only the match takes away",
    );
    outcome.value(
        "size of the hole in the last shape, in nodes",
        sizes[last],
        0.0,
        0.0,
        "the path ends in the disk",
    );
    Ok(outcome)
}

fn shot_disk(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let radius = 0.25;
    let speed = 0.3;
    let disk = disk_at(grid, [0.5; 2], radius);
    let shear = setting.ingredient(0.0, 0.3);
    let velocity = Field::<f64, 2, 2>::from_fn(grid, |x| {
        [
            speed * (x[0] - 0.5) + shear * (x[1] - 0.5),
            speed * (x[1] - 0.5),
        ]
    });
    let params = CalculusParams {
        law: law("logdet", 1.0, 1.0)?,
        ..CalculusParams::default()
    };
    let shot = shoot(&disk, &velocity, 4, &params, &mut Silent)?;
    let last = &shot.pieces[0].displacements[3];
    let mut worst = 0.0f64;
    for k in 0..16 {
        let (s, c) = (0.39 * f64::from(k)).sin_cos();
        let x = [0.5 + radius * c, 0.5 + radius * s];
        let u = last.sample(x);
        let grown = (x[0] + u[0] - 0.5).hypot(x[1] + u[1] - 0.5);
        worst = worst.max((grown / (radius * (1.0 + speed)) - 1.0).abs());
    }
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest |radius/(R₀(1 + v)) − 1| around the disk after unit time",
        worst,
        3e-3,
        "with λ = μ the first order of τ vanishes on disks; the void holds a thousandth",
    );
    Ok(outcome)
}
