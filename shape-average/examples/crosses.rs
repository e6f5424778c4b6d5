//! The average of three crosses with arms of different lengths, as a drawing.
//!
//! ```sh
//! cargo run --release -p shape-average --example crosses
//! ```

use std::fmt::Write;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, LevelsetError, contour, signed_distance};
use shape_average::{AverageParams, average};

/// A cross of two bars, whose four arms have these lengths: right, up, left, down.
fn cross(
    grid: Grid<2>,
    [right, up, left, down]: [f64; 4],
) -> Result<ScalarField<f64, 2>, LevelsetError> {
    let inside = |[x, y]: [f64; 2]| {
        let [x, y] = [x - 0.5, y - 0.5];
        let across = (x - right).max(-left - x).max(y.abs() - 0.06);
        let along = (y - up).max(-down - y).max(x.abs() - 0.06);
        -across.min(along)
    };
    signed_distance(&ScalarField::from_fn(grid, |x| [inside(x)]), 0.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::<2>::dyadic(7);
    let arms = [
        [0.35, 0.2, 0.2, 0.3],
        [0.2, 0.35, 0.3, 0.2],
        [0.25, 0.25, 0.35, 0.35],
    ];
    let shapes = arms
        .into_iter()
        .map(|arms| cross(grid, arms))
        .collect::<Result<Vec<_>, _>>()?;
    let result = average(&shapes, &AverageParams::default(), &mut Silent)?;

    let mut drawing = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 -1 1 1\">\n\
         <g transform=\"scale(1,-1)\" fill=\"none\" stroke-width=\".004\">\n",
    );
    let mut draw = |field: &ScalarField<f64, 2>,
                    level,
                    style: &str|
     -> Result<(), Box<dyn std::error::Error>> {
        let path = contour(field, level, BoxEdge::Closed)?.svg_path(4);
        writeln!(drawing, "<path d=\"{path}\" {style}/>")?;
        Ok(())
    };
    draw(
        &result.average_indicator,
        0.5,
        "fill=\"#c8ddf0\" stroke=\"#20507f\"",
    )?;
    for shape in &shapes {
        draw(shape, 0.0, "stroke=\"#a0a0a0\" stroke-dasharray=\".01\"")?;
    }
    drawing += "</g>\n</svg>\n";
    std::fs::write("crosses.svg", drawing)?;

    println!("status            {:?}", result.status);
    println!("elastic energies  {:.5?}", result.energy.elastic);
    for (i, dice) in result.dice.iter().enumerate() {
        println!("overlap of shape {i} with the average {dice:.4}");
    }
    println!("least det Dphi    {:.3}", result.certificate.min_det);
    println!("the average and its inputs are in crosses.svg");
    Ok(())
}
