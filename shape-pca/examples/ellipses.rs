//! Modes of variation of eight ellipses of two independent half axes, as a drawing.
//!
//! ```sh
//! cargo run --release -p shape-pca --example ellipses
//! ```

use std::fmt::Write;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, LevelsetError, contour, signed_distance};
use shape_average::{AverageParams, average};
use shape_pca::{Average, Compound, Pca, PcaParams};

fn ellipse(grid: Grid<2>, [a, b]: [f64; 2]) -> Result<ScalarField<f64, 2>, LevelsetError> {
    let inside = |[x, y]: [f64; 2]| 1.0 - ((x - 0.5) / a).hypot((y - 0.5) / b);
    signed_distance(&ScalarField::from_fn(grid, |x| [inside(x)]), 0.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::<2>::dyadic(6);
    // The first half axis varies by 20 %, the second by 10 %.
    let half_axes = [0.24, 0.26, 0.28, 0.30]
        .into_iter()
        .flat_map(|a| [0.19, 0.21].map(|b| [a, b]));
    let shapes = half_axes
        .map(|axes| ellipse(grid, axes))
        .collect::<Result<Vec<_>, _>>()?;
    let params = AverageParams::default();
    let mean = average(&shapes, &params, &mut Silent)?;

    let object = Average::of_result(&mean, &params)?;
    let compound = Compound::new(&object, &PcaParams::default())?;
    let pca = Pca::new(&object, &compound, 2, &mut Silent)?;
    for (j, share) in pca.modes.compactness().into_iter().enumerate().take(2) {
        println!(
            "variance in the first {} modes: {:.1} %",
            j + 1,
            100.0 * share
        );
    }

    let mut drawing = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 -1 2 1\">\n\
         <g transform=\"scale(1,-1)\" fill=\"none\" stroke-width=\".004\">\n",
    );
    let boundary = contour(&mean.average_indicator, 0.5, BoxEdge::Closed)?;
    for mode in 0..2 {
        for (deviations, colour) in [(-2.0, "#b2182b"), (0.0, "#404040"), (2.0, "#2166ac")] {
            let mut scores = vec![0.0; pca.modes.rank()];
            scores[mode] = deviations;
            // Scores point away from the shapes: x - u(x) lies on the shape that has them.
            let u = pca.space.synthesise(&scores)?;
            let moved = boundary.map(|x| {
                let at = u.sample(x);
                [x[0] - at[0] + mode as f64, x[1] - at[1]]
            });
            writeln!(
                drawing,
                "<path d=\"{}\" stroke=\"{colour}\"/>",
                moved.svg_path(4)
            )?;
        }
    }
    drawing += "</g>\n</svg>\n";
    std::fs::write("ellipses.svg", drawing)?;
    println!("the average and two standard deviations on either side are in ellipses.svg");
    Ok(())
}
