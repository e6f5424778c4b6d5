//! The geodesic from a disk to a star, as a drawing.
//!
//! ```sh
//! cargo run --release -p viscous-geodesic --example morph
//! ```

use std::fmt::Write;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{GeodesicParams, geodesic};
use levelset::{BoxEdge, contour, signed_distance};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::<2>::dyadic(6);
    let star = |depth: f64| {
        signed_distance(
            &ScalarField::from_fn(grid, |[x, y]| {
                let (x, y) = (x - 0.5, y - 0.5);
                [0.25 + depth * (5.0 * y.atan2(x)).cos() - x.hypot(y)]
            }),
            0.0,
        )
    };
    let params = GeodesicParams {
        steps: 6,
        ..GeodesicParams::default()
    };
    let path = geodesic(&star(0.0)?, &star(0.08)?, &params, &mut Silent)?;
    println!("status      {:?}", path.status);
    println!("length      {:.4}", path.length());
    println!("dissipation {:.4}", path.dissipation());
    println!(
        "overlap of the last shape with the end {:.4}",
        path.dice_end
    );

    let shapes = path.level_sets.len();
    let mut drawing = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 -.6 {} .6\">\n\
         <g transform=\"scale(1,-1)\" fill=\"#c8ddf0\" stroke=\"#20507f\" stroke-width=\".004\">\n",
        0.65 * shapes as f64
    );
    for (k, level_set) in path.level_sets.iter().enumerate() {
        let boundary = contour(level_set, 0.0, BoxEdge::Closed)?;
        let moved = boundary.map(|[x, y]| [x - 0.175 + 0.65 * k as f64, y - 0.2]);
        writeln!(drawing, "<path d=\"{}\"/>", moved.svg_path(4))?;
    }
    drawing += "</g>\n</svg>\n";
    std::fs::write("morph.svg", drawing)?;
    println!("the {shapes} shapes are in morph.svg");
    Ok(())
}
