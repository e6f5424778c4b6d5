//! Geodesics whose length is known.

use approx::assert_relative_eq;
use fe_grid::minimise::{Evaluation, Objective, Silent};
use fe_grid::vector::max_abs_difference;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::finite::{Balls, finite_geodesic};
use geodesic::lagrangian::PathObjective;
use geodesic::{Domain, DomainChoice, Form, Geodesic, GeodesicError, GeodesicParams, geodesic};
use levelset::{BoxEdge, Contour, Moments, contour, signed_distance};
use nalgebra::{Rotation2, Vector2};
use proptest::prelude::*;
use test_support::on_threads;

/// The signed distance of an ellipse with the given half-axes, turned by an angle about a centre.
fn ellipse(level: u32, axes: [f64; 2], angle: f64, centre: [f64; 2]) -> ScalarField<f64, 2> {
    let back = Rotation2::new(-angle);
    let implicit = ScalarField::from_fn(Grid::dyadic(level), |[x, y]| {
        let p = back * Vector2::new(x - centre[0], y - centre[1]);
        [axes[0].min(axes[1]) * (1.0 - (p[0] / axes[0]).hypot(p[1] / axes[1]))]
    });
    signed_distance(&implicit, 0.0).unwrap()
}

fn ball<const D: usize>(level: u32, radius: f64) -> ScalarField<f64, D> {
    ScalarField::from_fn(Grid::dyadic(level), |x| {
        let squares = x.iter().map(|x| (x - 0.5).powi(2));
        [radius - squares.sum::<f64>().sqrt()]
    })
}

fn params(form: Form, steps: usize) -> GeodesicParams {
    GeodesicParams {
        form,
        steps,
        ..GeodesicParams::default()
    }
}

/// A geodesic, checked for what holds for every one.
#[track_caller]
fn run<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
) -> Geodesic<D> {
    let found = geodesic(start, end, params, &mut Silent).unwrap();
    assert!(found.certificate.certified, "{:?}", found.certificate);
    assert!(found.length().powi(2) <= found.dissipation() * (1.0 + 1e-12));
    assert_eq!(found.energy.step_energies.len(), params.steps);
    assert_eq!(found.level_sets.len(), params.steps + 1);
    assert_eq!(found.displacements.len(), params.steps);
    for level in &found.levels {
        let energies = &level.info.energies;
        assert!(
            energies.windows(2).all(|pair| pair[1] < pair[0]),
            "energies fall"
        );
    }
    found
}

#[test]
fn a_disk_grows_as_a_ball_of_viscous_matter_does() {
    let (start, end) = (ball::<2>(6, 0.2), ball::<2>(6, 0.3));
    let closed = Balls::<2>::new(GeodesicParams::default().law).unwrap();
    // The boundary is less than a tenth of a cell of .0156 off, and an eighth on the end domain: the
    // tails of the mismatch's step act on larger distances in the larger disk. A length is sqrt(4 pi)
    // times the change of the radius, its square the dissipation.
    let cases = [
        (DomainChoice::Start, 0.004, 0.02),
        (DomainChoice::End, 0.0069, 0.04),
    ];
    for (domain, of_length, of_dissipation) in cases {
        let mut dissipations = Vec::new();
        for steps in [1, 2, 4] {
            let params = GeodesicParams {
                domain,
                ..params(Form::Lagrangian, steps)
            };
            let found = run(&start, &end, &params);
            let exact = finite_geodesic(&closed, [0.2], [0.3], steps).unwrap();
            assert!((found.length() - exact.length()).abs() < of_length);
            assert_relative_eq!(
                found.dissipation(),
                exact.dissipation(),
                max_relative = of_dissipation
            );
            assert!(found.dice_end > 0.985, "{}", found.dice_end);
            dissipations.push(found.dissipation());
        }
        // Second order in the number of steps, as for the balls themselves; what the grid adds is
        // the same for all, and cancels.
        let changes: Vec<f64> = dissipations.windows(2).map(|d| d[0] - d[1]).collect();
        let order = (changes[0] / changes[1]).log2();
        assert!((1.7..2.5).contains(&order), "{domain:?} {order}");
    }
}

#[test]
fn a_path_of_the_end_domain_is_given_from_its_start() {
    let (start, end) = (ball::<2>(6, 0.2), ball::<2>(6, 0.3));
    let params = GeodesicParams {
        domain: DomainChoice::End,
        ..params(Form::Lagrangian, 3)
    };
    let found = run(&start, &end, &params);
    assert_eq!(found.domain, Some(Domain::End));
    let outline = |u: &ScalarField<f64, 2>| contour(u, 0.0, BoxEdge::Open).unwrap();
    let radius = |outline: &Contour<2>| {
        let area = Moments::of_contour(outline).unwrap().volume;
        (area / std::f64::consts::PI).sqrt()
    };
    let moved = |outline: &Contour<2>, phi: &Field<f64, 2, 2>| {
        outline.map(|p| {
            let u = phi.sample(p);
            [p[0] + u[0], p[1] + u[1]]
        })
    };
    let first = outline(&found.level_sets[0]);
    for k in 0..3 {
        let before = outline(&found.level_sets[k]);
        let after = radius(&outline(&found.level_sets[k + 1]));
        assert!(after > radius(&before) + 0.02, "the disk grows");
        // The deformations are inverted at nodes: an error of second order in cells of .016.
        let step = radius(&moved(&before, &found.displacements[k]));
        let whole = radius(&moved(&first, &found.motions[k]));
        assert!((step - after).abs() < 1e-3 && (whole - after).abs() < 1e-3);
    }
    // Constant speed, up to O(1/K^2).
    let energies = &found.energy.step_energies;
    let exact = finite_geodesic(
        &Balls::<2>::new(params.law).unwrap(),
        [0.2],
        [0.3],
        params.steps,
    );
    let exact = exact.unwrap().dissipation() / params.steps as f64;
    for energy in energies {
        assert!((energy * params.steps as f64 / exact - 1.0).abs() < 0.1);
    }
}

#[test]
fn a_ball_grows_in_space_too() {
    let closed = Balls::<3>::new(GeodesicParams::default().law).unwrap();
    let exact = finite_geodesic(&closed, [0.2], [0.3], 2).unwrap();
    let error = |level| {
        let (start, end) = (ball::<3>(level, 0.2), ball::<3>(level, 0.3));
        let params = GeodesicParams {
            coarsest_nodes: 9,
            ..params(Form::Lagrangian, 2)
        };
        (run(&start, &end, &params).length() / exact.length() - 1.0).abs()
    };
    // Three and six cells a radius: the widths of interface and match, in cells, are an error of
    // first order.
    let (coarse, fine) = (error(4), error(5));
    assert!(fine < 0.05 && fine < 0.6 * coarse, "{coarse}, {fine}");
}

#[test]
fn level_sets_give_the_length_that_deformations_give() {
    let (start, end) = (ball::<2>(5, 0.2), ball::<2>(5, 0.26));
    let lagrangian = run(&start, &end, &params(Form::Lagrangian, 2));
    let level_sets = run(&start, &end, &params(Form::LevelSets, 2));
    // The one matches once and the other at every step, each within a share of a cell.
    assert_relative_eq!(
        level_sets.length(),
        lagrangian.length(),
        max_relative = 0.05
    );
}

#[test]
fn rigid_motions_cost_nothing() {
    let axes = [0.25, 0.15];
    let start = ellipse(6, axes, 0.0, [0.5, 0.5]);
    let turned = ellipse(6, axes, 0.35, [0.5, 0.5]);
    let moved = ellipse(6, axes, 0.0, [0.56, 0.47]);
    for end in [turned, moved] {
        let found = run(&start, &end, &params(Form::Lagrangian, 2));
        assert!(found.length() < 2e-3, "{}", found.length());
        assert!(found.dice_end > 0.99);
    }
}

#[test]
fn an_ellipse_is_as_far_from_a_disk_as_the_disk_from_it() {
    let disk = ball::<2>(6, 0.25);
    let long = ellipse(6, [0.25 * 1.3, 0.25 / 1.3], 0.0, [0.5, 0.5]);
    let there = run(&disk, &long, &params(Form::Lagrangian, 4)).length();
    let back = run(&long, &disk, &params(Form::Lagrangian, 4)).length();
    // The affine stretch has the strain rate ln 1.3 and the length sqrt(2 pi) 0.25 ln 1.3 = .164;
    // matter that is free to slide along the boundary gets there with less.
    assert!((there - 0.131).abs() < 0.002, "{there}");
    assert_relative_eq!(there, back, max_relative = 0.02);
}

#[test]
fn two_disks_merge() {
    let grid = Grid::dyadic(5);
    let pair = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
        let disk = |centre: f64| 0.14 - (x - centre).hypot(y - 0.5);
        [disk(0.33).max(disk(0.67))]
    });
    let one = ellipse(5, [0.27, 0.15], 0.0, [0.5, 0.5]);
    let found = run(&pair, &one, &params(Form::LevelSets, 4));
    let components =
        |k: usize| levelset::contour(&found.level_sets[k], 0.0, levelset::BoxEdge::Open);
    assert_eq!(components(0).unwrap().n_components(), 2);
    assert_eq!(components(4).unwrap().n_components(), 1);
    assert!(found.dice_end > 0.95, "{}", found.dice_end);
}

#[test]
fn a_hole_closes() {
    let grid = Grid::dyadic(5);
    let ring = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
        [0.09 - ((x - 0.5).hypot(y - 0.5) - 0.21).abs()]
    });
    let found = run(&ring, &ball(5, 0.3), &params(Form::LevelSets, 4));
    let boundaries = |k: usize| {
        let curve = levelset::contour(&found.level_sets[k], 0.0, levelset::BoxEdge::Open);
        curve.unwrap().n_components()
    };
    assert_eq!((boundaries(0), boundaries(4)), (2, 1));
    // What is left of a hole as small as a cell is taken away by the match, not by a deformation.
    // The hole is a sixth of the disk: of that, and of nothing else, a part is missing.
    assert!(found.dice_pulled > 0.9, "{}", found.dice_pulled);
    // The hole shrinks before it is gone.
    let hole = |k: usize| {
        let near = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [(x - 0.5).hypot(y - 0.5)]);
        let nodes = near.as_slice().iter().zip(found.level_sets[k].as_slice());
        nodes.filter(|(r, u)| **r < 0.2 && **u <= 0.0).count()
    };
    assert!((1..=4).all(|k| hole(k) < hole(k - 1)));
}

#[test]
fn equal_shapes_are_connected_by_nothing() {
    let shape = ellipse(5, [0.3, 0.2], 0.3, [0.5, 0.5]);
    for form in [Form::Lagrangian, Form::LevelSets] {
        let found = run(&shape, &shape, &params(form, 2));
        assert!(found.status.converged(), "{form:?}: {:?}", found.status);
        // Level sets pay for their boundaries: what is left of the length is less than a hundredth
        // of a step of one cell.
        assert!(found.length() < 1e-3, "{form:?}: {}", found.length());
        assert!(found.end_reached());
    }
}

#[test]
fn threads_do_not_matter() {
    let start = ball::<2>(5, 0.2);
    let end = ellipse(5, [0.26, 0.2], 0.2, [0.5, 0.5]);
    for form in [Form::Lagrangian, Form::LevelSets] {
        let once = |n| {
            on_threads(n, || {
                geodesic(&start, &end, &params(form, 2), &mut Silent).unwrap()
            })
        };
        let (one, three) = (once(1), once(3));
        assert_eq!(one.energy.step_energies, three.energy.step_energies);
        for (a, b) in one.displacements.iter().zip(&three.displacements) {
            assert_eq!(max_abs_difference(a.as_slice(), b.as_slice()), 0.0);
        }
    }
}

#[test]
fn unfit_input_is_refused() {
    let disk = ball::<2>(4, 0.2);
    let other = ball::<2>(5, 0.2);
    let empty = ScalarField::from_fn(*disk.grid(), |_| [-1.0]);
    let mut broken = disk.clone();
    broken.as_mut_slice()[7] = f64::NAN;
    let run = |a: &ScalarField<f64, 2>, b: &ScalarField<f64, 2>, steps: usize| {
        geodesic(a, b, &params(Form::Lagrangian, steps), &mut Silent).unwrap_err()
    };
    assert_eq!(run(&disk, &other, 2), GeodesicError::GridsDiffer);
    assert!(matches!(
        run(&disk, &empty, 2),
        GeodesicError::Degenerate { .. }
    ));
    assert!(matches!(
        run(&broken, &disk, 2),
        GeodesicError::NotFinite { node: 7, .. }
    ));
    assert!(matches!(
        run(&disk, &disk, 0),
        GeodesicError::Parameter { .. }
    ));
    let mut mask = disk.clone();
    for u in mask.as_mut_slice() {
        *u = u.signum();
    }
    let which = "end";
    assert_eq!(run(&disk, &mask, 2), GeodesicError::Mask { which });
    let refused = |change: fn(&mut GeodesicParams)| {
        let mut params = GeodesicParams::default();
        change(&mut params);
        matches!(params.check(), Err(GeodesicError::Parameter { .. }))
    };
    assert!(refused(|p| p.tolerance = 1.0));
    assert!(refused(|p| p.mismatch_cells = 1e4));
    assert!(refused(|p| p.mismatch_weight = 1e300));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Rigid motions after every deformation change no step of the path.
    #[test]
    fn steps_are_frame_indifferent(
        waves in [-0.02..0.02f64, -0.02..0.02f64, -0.02..0.02f64, -0.02..0.02f64],
        angles in [-3.0..3.0f64, -3.0..3.0f64],
        shift in -0.2..0.2f64,
    ) {
        let disk = ball::<2>(4, 0.3);
        let grid = *disk.grid();
        let params = params(Form::Lagrangian, 2);
        let mut objective = PathObjective::new(disk.clone(), disk, 2, &params).unwrap();
        let psi = |k: usize, [x, y]: [f64; 2]| {
            let (a, b) = (waves[2 * k], waves[2 * k + 1]);
            [x + a * (6.0 * y).sin(), y + b * (5.0 * x).cos()]
        };
        let state = |turn: bool| -> Vec<f64> {
            (0..2)
                .flat_map(|k| {
                    let rotation = Rotation2::new(if turn { angles[k] } else { 0.0 });
                    let field = Field::<f64, 2, 2>::from_fn(grid, |x| {
                        let moved = rotation * Vector2::from(psi(k, x));
                        let shift = if turn { shift } else { 0.0 };
                        [moved[0] - x[0] + shift, moved[1] - x[1]]
                    });
                    field.into_vec()
                })
                .collect()
        };
        let mut energies = Vec::new();
        for turn in [false, true] {
            let value = objective.value(&state(turn)).unwrap();
            prop_assert!(matches!(value, Evaluation::Value(_)));
            energies.push(objective.energy().clone());
        }
        for (a, b) in energies[0].step_energies.iter().zip(&energies[1].step_energies) {
            // Rounding of positions of order one, over strains of order a tenth, squared.
            assert_relative_eq!(a, b, max_relative = 1e-10, epsilon = 1e-14);
        }
        prop_assert!(energies[0].length().powi(2) <= energies[0].dissipation() * (1.0 + 1e-12));
    }
}

/// Paths on coarse grids are starts only: a closer minimum is asked for on the finest grid, or of the last of all paths
/// where there is one grid only.
#[test]
fn tolerances_below_the_default_are_for_the_finest_grid() {
    for level in [4, 5] {
        let start = ellipse(level, [0.25, 0.18], 0.0, [0.5, 0.5]);
        let end = ellipse(level, [0.3, 0.16], 0.5, [0.5, 0.5]);
        let found = [1e-4, 1e-9].map(|tolerance| {
            let params = GeodesicParams {
                tolerance,
                ..params(Form::Lagrangian, 2)
            };
            run(&start, &end, &params)
        });
        let [(usual, before), (close, same)] = found.each_ref().map(|path| {
            let energies = path.levels.iter().map(|level| level.energy.total);
            let mut energies: Vec<_> = energies.collect();
            (energies.pop().unwrap(), energies)
        });
        assert_eq!(before, same);
        // By more than the tolerance of the usual one, as it is relative to five iterations.
        assert!(close < usual && usual < 1.01 * close, "{usual} {close}");
    }
}
