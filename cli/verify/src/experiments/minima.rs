//! Minima of averages and of paths: what they look like for bars, and that there may be several.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField, VectorField};
use geodesic::{GeodesicParams, Shape, geodesic_between, geodesic_from, stable_path};
use hyperelastic::LawSpec;
use levelset::signed_distance;
use shape_average::{
    AverageParams, Minima, StrainMaps, average, average_from, cells_inside, starts,
};

use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::shapes::{ellipse, segments};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "average-bars",
        reference: "section 4, bars",
        claim: "The average of a straight bar and one bent by 62° is bent by about half of that, and \
                the deformations hardly stretch either but at the joint",
        broken: "the bent bar is half as long",
        run: bars,
    },
    Statement {
        name: "average-not-unique",
        reference: "section 4, non-uniqueness",
        claim: "Two crossed ellipses have two averages of the same energy and shape: one is turned onto the \
                other to the left or to the right",
        broken: "both are thicker at one end",
        run: average_twice,
    },
    Statement {
        name: "path-not-unique",
        reference: "section 6, non-uniqueness",
        claim: "Between crossed ellipses the symmetric path is a saddle point: paths that turn to the left or to \
                the right are shorter",
        broken: "the second ellipse lies as the first, and is longer",
        run: path_twice,
    },
    Statement {
        name: "path-raised-arm",
        reference: "section 6, correspondences",
        claim: "An arm that is raised by 150° at the elbow moves with its points; it is not drawn in to grow again \
                where it is needed",
        broken: "the raised forearm is half as long",
        run: raised_arm,
    },
    Statement {
        name: "average-cascade",
        reference: "section 4, multiscale",
        claim: "From coarse grids to fine, the finest one takes a part of the iterations that it takes alone, to \
                no more energy",
        broken: "what is found on coarse grids is left there",
        run: cascade,
    },
];

/// Length of an arm.
const ARM: f64 = 0.3;

/// A bar whose arms of a length meet in the middle of the box, each turned down by an angle.
fn bar(grid: Grid<2>, down: f64, arm: f64) -> Result<ScalarField<f64, 2>, VerifyError> {
    let (sin, cos) = down.sin_cos();
    let implicit = ScalarField::from_fn(grid, |[x, y]| {
        // The arm to the right and its mirror image.
        let (x, y) = ((x - 0.5).abs(), y - 0.55);
        let along = (cos * x - sin * y).clamp(0.0, arm);
        [0.07 - (x - along * cos).hypot(y + along * sin)]
    });
    Ok(signed_distance(&implicit, 0.0)?)
}

/// By how much the arms of a bar turn down, from the places of the middles of both parts and of the part between
/// them: radians.
fn bend(indicator: &ScalarField<f64, 2>) -> f64 {
    let grid = indicator.grid();
    // Moments of the arm to the right of the joint, which is symmetric to the other.
    let (mut mass, mut first) = (0.0, [0.0; 2]);
    let chosen = |x: f64| (0.1..0.25).contains(&(x - 0.5).abs());
    let nodes = || (0..grid.n_nodes()).map(|i| (grid.position(grid.node(i)), indicator.at(i)[0]));
    for ([x, y], chi) in nodes().filter(|(p, _)| chosen(p[0])) {
        mass += chi;
        first[0] += chi * (x - 0.5).abs();
        first[1] += chi * y;
    }
    let centre = first.map(|m| m / mass);
    let (mut above, mut below) = (0.0, 0.0);
    for ([x, y], chi) in nodes().filter(|(p, _)| chosen(p[0])) {
        let apart = (x - 0.5).abs() - centre[0];
        above += chi * apart * (y - centre[1]);
        below += chi * apart * apart;
    }
    -(above / below).atan()
}

fn bars(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let half = 31f64.to_radians();
    let bent = bar(grid, half, setting.ingredient(ARM, 0.5 * ARM))?;
    let shapes = [bar(grid, 0.0, ARM)?, bent];
    let found = average(&shapes, &AverageParams::default(), &mut Silent)?;
    outcome.value(
        "bend of an arm of the average, over that of the bent bar",
        bend(&found.average_indicator) / half,
        0.5,
        0.04,
        "the bent bar resists a little more: what is folded at the joint is compressed. The minimiser ends \
         two degrees of 62 early",
    );
    let (mut within, mut whole) = (0usize, 0usize);
    for (shape, displacement) in shapes.iter().zip(&found.displacements) {
        let indicator = ScalarField::from_fn(grid, |x| [f64::from(shape.sample(x)[0] > 0.0)]);
        let maps = StrainMaps::new(displacement);
        for cell in cells_inside(&indicator) {
            let norm = maps.norm[cell] / 2f64.sqrt();
            whole += 1;
            within += usize::from(
                (norm - 1.0).abs() <= 0.03 && (maps.determinant[cell] - 1.0).abs() <= 0.03,
            );
        }
    }
    outcome.at_least(
        "share of both bars where |Dφ|/√2 and det Dφ are within .97 and 1.03",
        within as f64 / whole as f64,
        setting.effort(0.67, 0.7),
        "the range that the notes show; more around the joint, and on the cells of the boundary, of which \
         coarse grids have a larger share",
    );
    Ok(outcome)
}

/// Crossed ellipses, each thicker at one end by a share.
fn crossed(grid: Grid<2>, thicker: f64) -> Result<[ScalarField<f64, 2>; 2], VerifyError> {
    let of = |turned: bool| {
        let implicit = ScalarField::from_fn(grid, |x: [f64; 2]| {
            let [x, y] = x.map(|x| x - 0.5);
            let (along, across) = if turned { (y, -x) } else { (x, y) };
            let across = across / (1.0 + thicker * along / 0.3);
            [0.17 * (1.0 - (along / 0.3).hypot(across / 0.17))]
        });
        signed_distance(&implicit, 0.0)
    };
    Ok([of(false)?, of(true)?])
}

fn average_twice(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let shapes = crossed(grid, setting.ingredient(0.0, 0.3))?;
    let params = AverageParams::default();
    let mut minima = Minima::new(&params);
    for start in starts(&shapes, &params, 4)? {
        let result = average_from(&shapes, &[], &start.displacements, &params, &mut Silent)?;
        minima.add(result)?;
    }
    let (_, list) = minima
        .finish()?
        .ok_or(shape_average::AverageError::NoShapes)?;
    // Other positions of the points, the same shape.
    let other = list[1..].iter().filter(|m| !m.other_shape);
    let nearest = other.min_by(|a, b| a.excess.abs().total_cmp(&b.excess.abs()));
    let excess = nearest.map_or(f64::INFINITY, |m| m.excess.abs());
    outcome.at_most(
        "energy of the second average over that of the first, difference relative to the elastic energy",
        excess,
        0.05,
        "the grid is as symmetric as the shapes; the minimiser leaves a hundredth of each",
    );
    outcome.value(
        "distance of the points of the two, over the size of the average",
        nearest.filter(|_| excess <= 0.05).map_or(f64::NAN, |m| m.state_distance),
        2f64.sqrt(),
        0.1,
        "the second ellipse is turned by 90° or by −90°, by 180° against each other: half of the points are moved          by twice their distance from the middle, and the best rigid motion of all takes half of the square",
    );
    Ok(outcome)
}

fn path_twice(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let end = setting.ingredient([0.17, 0.24], [0.3, 0.15]);
    let ends = [ellipse(grid, [0.26, 0.16])?, ellipse(grid, end)?].map(Shape::new);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    let [from, to] = &ends;
    // By symmetry, paths from the identity do not turn.
    let coarsest = grid.hierarchy(params.coarsest_nodes)[0];
    let identity = vec![VectorField::zeros(coarsest); params.steps];
    let symmetric = geodesic_from(from, to, &identity, &params, &mut Silent)?;
    let length = symmetric.length();
    let found = stable_path(from, to, symmetric, &params, &mut Silent)?;
    outcome.at_least(
        "saddle points on the way from the symmetric path to a minimum",
        found.saddles as f64,
        1.0,
        "the energy of affine deformations that take the points by an angle ψ around is c s², \
         cosh 2s = cos²ψ cosh 2s₀ + sin²ψ, with its maximum at ψ = 0",
    );
    outcome.at_most(
        "length of the path that is reached over that of the symmetric one",
        found.path.length() / length,
        0.8,
        "a turn has no length; the minimiser may end on its way there",
    );
    Ok(outcome)
}

/// Radius of the arm of a figure.
const ARM_RADIUS: f64 = 0.028;

fn raised_arm(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let grid = Grid::<2>::dyadic(6);
    let (hip, elbow, right) = ([0.55, 0.35], [0.3, 0.62], [0.65, 0.05]);
    let figure = |hand: [f64; 2], foot: [f64; 2]| {
        segments(
            grid,
            &[
                (hip, [0.55, 0.8], 0.07),
                ([0.55, 0.68], elbow, ARM_RADIUS),
                (elbow, hand, ARM_RADIUS),
                (hip, foot, 0.035),
                (hip, right, 0.035),
            ],
        )
    };
    let (hanging, raised) = ([0.28, 0.38], [0.26, 0.86]);
    let share = setting.ingredient(1.0, 0.5);
    let reached = std::array::from_fn(|k| elbow[k] + share * (raised[k] - elbow[k]));
    let ends = [
        figure(hanging, [0.47, 0.05])?,
        figure(reached, [0.27, 0.22])?,
    ]
    .map(Shape::new);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    let path = geodesic_between(&ends[0], &ends[1], &params, &mut Silent)?;
    let moved = path
        .motions
        .last()
        .map_or([f64::NAN; 2], |last| last.sample(hanging));
    let missed =
        (hanging[0] + moved[0] - raised[0]).hypot(hanging[1] + moved[1] - raised[1]) / ARM_RADIUS;
    outcome.at_most(
        "distance of the hand from the raised hand, over the radius of the arm",
        missed,
        1.0,
        "the end of the arm is a half disk, which may be stretched or compressed a little",
    );
    Ok(outcome)
}

fn cascade(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[Requirement::StressFree])?;
    let levels = setting.effort(6, 7);
    let grid = Grid::<2>::dyadic(levels);
    let finest = grid.nodes_per_axis()[0];
    let shapes = [bar(grid, 0.0, ARM)?, bar(grid, 0.5, ARM)?];
    let run = |coarsest_nodes: usize| {
        let params = AverageParams {
            coarsest_nodes,
            ..AverageParams::default()
        };
        average(&shapes, &params, &mut Silent)
    };
    let coarsest = AverageParams::default().coarsest_nodes;
    let cascade = run(setting.ingredient(coarsest, finest))?;
    let alone = run(finest)?;
    let iterations = |levels: &[shape_average::LevelReport]| -> f64 {
        levels
            .last()
            .map_or(f64::NAN, |level| level.iterations as f64)
    };
    outcome.at_most(
        "iterations on the finest grid over those without coarse ones",
        iterations(&cascade.levels) / iterations(&alone.levels),
        0.5,
        "large deformations are found on coarse grids, and the finest one corrects them by a spacing",
    );
    outcome.at_most(
        "energy above that without coarse grids, relative to the elastic energy",
        (cascade.energy.total - alone.energy.total) / alone.energy.parts[0],
        0.02,
        "each may leave a hundredth",
    );
    Ok(outcome)
}
