//! Level sets: smooth steps, signed distances, and measures of contours.

use std::f64::consts::PI;

use fe_grid::{Grid, ScalarField};
use levelset::{
    Arctan, BoxEdge, Compact, Moments, connected_components, contour, dice, hausdorff,
    signed_distance,
};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::curves::{disk_at, lens, rectangle};
use crate::tools::quadrature::Rule;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "level-steps",
        reference: "section 6, H_ε",
        claim: "The smooth steps rise from 0 to 1 over their width: their derivatives are those of \
                their values, and ∫(H_ε − H)² = (33/280)ε for the compact one",
        broken: "the steps are twice as wide",
        run: steps,
    },
    Statement {
        name: "level-distance",
        reference: "section 6, level sets",
        claim: "Signed distances of the contour of any function tend to those of its shape with the \
                second order of h",
        broken: "the contour is that of the level h",
        run: distances,
    },
    Statement {
        name: "level-moments",
        reference: "section 5, centre of mass and moments",
        claim: "Volume, centroid and second moments of contours tend to those of the shape with \
                the second order of h",
        broken: "the contour is that of the level h",
        run: moments,
    },
    Statement {
        name: "level-overlap",
        reference: "section 6, vol(O △ O')",
        claim: "The overlap of two disks is that of the lens they have in common",
        broken: "one of the disks is larger by a tenth",
        run: overlap,
    },
    Statement {
        name: "level-hausdorff",
        reference: "section 3, Hausdorff distance",
        claim: "The Hausdorff distance of two boundaries is that of the farthest part of either",
        broken: "the far part is left out",
        run: farthest,
    },
    Statement {
        name: "level-components",
        reference: "section 6, multi-component objects",
        claim: "Parts of an object are connected along edges of the grid, and not at corners",
        broken: "the parts overlap by a node",
        run: |setting| Ok(components(setting)),
    },
];

fn steps(setting: Setting) -> Result<Outcome, VerifyError> {
    let width = 0.3;
    let wide = setting.ingredient(1.0, 2.0);
    let (compact, arctan) = (Compact::new(wide * width)?, Arctan::new(wide * width)?);
    let mut outcome = Outcome::default();
    let rule = Rule::composite(40, 8, -width, width);
    let off = rule.integral(|x| (compact.value(x) - f64::from(u8::from(x > 0.0))).powi(2));
    outcome.value(
        "∫(H_ε − H)²/ε from −ε to ε, compact step",
        off / width,
        33.0 / 280.0,
        1e-10,
        "3s² − 2s³ in closed form; the kink stands on a face of the rule",
    );
    outcome.value(
        "H_ε(ε), compact step",
        compact.value(width),
        1.0,
        0.0,
        "the transition ends there",
    );
    let reach = 5.0 * width;
    let slope = Rule::composite(40, 8, -reach, reach).integral(|x| arctan.derivative(x));
    outcome.value(
        "∫H_ε' from −5ε to 5ε, arctangent",
        slope,
        2.0 / PI * 5f64.atan(),
        1e-10,
        "the closed form of H_ε; the rule is exact to 1e-12",
    );
    let t = 1e-4;
    let (mut first, mut second) = (0.0f64, 0.0f64);
    for k in -20..=20 {
        let x = 0.0137 + 0.07 * f64::from(k);
        let of = |f: &dyn Fn(f64) -> f64| (f(x + t) - f(x - t)) / (2.0 * t);
        first = first.max((of(&|x| compact.value(x)) - compact.derivative(x)).abs());
        first = first.max((of(&|x| arctan.value(x)) - arctan.derivative(x)).abs());
        second = second.max((of(&|x| arctan.derivative(x)) - arctan.second_derivative(x)).abs());
    }
    outcome.at_most(
        "largest difference of H_ε' to differences of H_ε",
        first,
        1e-5,
        "central differences over 1e-4 of functions with third derivatives of some hundreds",
    );
    outcome.at_most(
        "the same of H_ε'' of the arctangent",
        second,
        1e-5,
        "as above",
    );
    Ok(outcome)
}

/// The largest error of the signed distance to a ball that is given by a function that is none.
fn off_ball<const D: usize>(grid: Grid<D>, setting: Setting) -> Result<f64, VerifyError> {
    let radius = 0.31;
    let from_centre = |x: [f64; D]| x.map(|x| (x - 0.5).powi(2)).iter().sum::<f64>();
    let given = ScalarField::from_fn(grid, |x| [1.5 * (radius * radius - from_centre(x))]);
    let level = setting.ingredient(0.0, grid.spacing());
    let found = signed_distance(&given, level)?;
    let pairs = found.as_slice().iter().enumerate().map(|(node, u)| {
        let exact = radius - from_centre(grid.position(grid.node(node))).sqrt();
        (u - exact).abs()
    });
    Ok(pairs.fold(0.0, f64::max))
}

fn distances(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let of = |d: usize, level: u32| {
        if d == 2 {
            let grid = Grid::<2>::dyadic(level);
            off_ball(grid, setting).map(|off| (grid.spacing(), off))
        } else {
            let grid = Grid::<3>::dyadic(level);
            off_ball(grid, setting).map(|off| (grid.spacing(), off))
        }
    };
    for (d, levels) in [(2, 4..=setting.effort(7, 9)), (3, 3..=setting.effort(5, 6))] {
        let points = levels
            .map(|level| of(d, level))
            .collect::<Result<Vec<_>, _>>()?;
        outcome.order(
            format!("largest |u_h − u| of a ball at all nodes, {d}D"),
            "h",
            points,
            2.0,
            0.3,
            "crossings by linear interpolation, and the sagitta of chords; where the ball lies in \
             its cells is another matter on every grid",
        );
    }
    Ok(outcome)
}

fn moments(setting: Setting) -> Result<Outcome, VerifyError> {
    let axes: [f64; 2] = [0.3, 0.18];
    let centre = [0.47, 0.53];
    let (mut areas, mut centroids, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
    for level in 4..=setting.effort(7, 9) {
        let grid = Grid::<2>::dyadic(level);
        let h = grid.spacing();
        let ellipse = ScalarField::<f64, 2>::from_fn(grid, |x| {
            let scaled = [0, 1].map(|k| ((x[k] - centre[k]) / axes[k]).powi(2));
            [1.0 - scaled[0] - scaled[1]]
        });
        let shift = setting.ingredient(0.0, h);
        let found = Moments::of_contour(&contour(&ellipse, shift, BoxEdge::Closed)?)?;
        areas.push((h, found.volume / (PI * axes[0] * axes[1]) - 1.0));
        let off = (0..2).map(|k| (found.centroid[k] - centre[k]).abs());
        centroids.push(off.fold(0.0, f64::max));
        let off = (0..2).map(|k| (4.0 * found.covariance[(k, k)] / axes[k].powi(2) - 1.0).abs());
        seconds.push((h, off.fold(0.0, f64::max)));
    }
    let mut outcome = Outcome::default();
    let reason = "chords lie inside the curve by h²/(8R)";
    for (name, points) in [
        ("|area/(πab) − 1| of an ellipse", areas),
        ("largest |4 second moment/a² − 1|", seconds),
    ] {
        outcome.order(name, "h", points, 2.0, 0.3, reason);
    }
    outcome.at_most(
        "error of the centroid on the coarsest grid",
        centroids[0],
        2e-3,
        "a hundredth of a half-axis; symmetric errors cancel but for where cells lie",
    );
    Ok(outcome)
}

fn overlap(setting: Setting) -> Result<Outcome, VerifyError> {
    let radii = [0.22, 0.17];
    let (a, b): ([f64; 2], [f64; 2]) = ([0.42, 0.5], [0.6, 0.55]);
    let grid = Grid::<2>::dyadic(setting.effort(8, 9));
    let one = disk_at(grid, a, setting.ingredient(radii[0], 1.1 * radii[0]));
    let other = disk_at(grid, b, radii[1]);
    let common = lens(radii, (b[0] - a[0]).hypot(b[1] - a[1]));
    let sizes = radii.map(|r| PI * r * r);
    let mut outcome = Outcome::default();
    outcome.value(
        "2|A ∩ B|/(|A| + |B|) of two disks, by counting nodes",
        dice(&one, 0.0, &other, 0.0)?,
        2.0 * common / (sizes[0] + sizes[1]),
        2e-3,
        "nodes within a third of a spacing of a boundary of 300 spacings, with random signs",
    );
    Ok(outcome)
}

fn farthest(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(7, 8));
    let small = disk_at(grid, [0.3, 0.5], 0.2);
    let far = disk_at(grid, [0.8, 0.5], 0.08);
    let mut both = small.clone();
    if !setting.is_broken() {
        for (u, v) in both.as_mut_slice().iter_mut().zip(far.as_slice()) {
            *u = u.max(*v);
        }
    }
    let one = contour(&small, 0.0, BoxEdge::Closed)?;
    let two = contour(&both, 0.0, BoxEdge::Closed)?;
    let mut outcome = Outcome::default();
    for (order, found) in [
        ("of the disk and of both", hausdorff(&one, &two)?),
        ("of both and of the disk", hausdorff(&two, &one)?),
    ] {
        outcome.value(
            format!("Hausdorff distance {order}"),
            found.maximum,
            0.88 - 0.5,
            1e-3,
            "from (0.5, 0.5) to (0.88, 0.5); contours are off by h²",
        );
    }
    Ok(outcome)
}

fn components(setting: Setting) -> Outcome {
    let grid = Grid::<2>::dyadic(5);
    let h = grid.spacing();
    let more = setting.ingredient(0.0, h);
    // Squares of nodes, the corner nodes of which are diagonal neighbours.
    let middle = 0.5 + 0.5 * h;
    let low = rectangle(grid, [0.2; 2], [middle + more; 2]);
    let high = rectangle(grid, [middle; 2], [0.8; 2]);
    let mut both = low;
    for (u, v) in both.as_mut_slice().iter_mut().zip(high.as_slice()) {
        *u = u.max(*v);
    }
    let found = connected_components(&both, 0.0);
    let mut outcome = Outcome::default();
    outcome.value(
        "parts of two squares that touch at a corner",
        found.sizes.len() as f64,
        2.0,
        0.0,
        "no edge of the grid joins them",
    );
    outcome
}
