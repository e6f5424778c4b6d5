//! From a mask to a signed distance, a surface and its measures: a torus.
//!
//! ```sh
//! cargo run --release -p levelset --example mask_to_surface
//! ```

use std::f64::consts::PI;
use std::fmt::Write;

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Moments, contour, hausdorff, signed_distance};

/// Radii of the centre line and of the tube.
const RADII: [f64; 2] = [0.25, 0.12];

fn distance_to_torus([x, y, z]: [f64; 3]) -> f64 {
    let [x, y, z] = [x - 0.5, y - 0.5, z - 0.5];
    RADII[1] - (x.hypot(y) - RADII[0]).hypot(z)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [large, small] = RADII;
    let (volume, area) = (
        2.0 * PI.powi(2) * large * small * small,
        4.0 * PI.powi(2) * large * small,
    );
    println!("nodes   volume   area     Euler number   distance from the exact surface");
    println!("exact   {volume:.5}  {area:.5}  {:>12}", 0);
    for level in 4..7 {
        let grid = Grid::<3>::dyadic(level);
        // What a file might hold: the share of every sample that lies in the object.
        let h = grid.spacing();
        let mask =
            ScalarField::from_fn(grid, |x| [(0.5 + distance_to_torus(x) / h).clamp(0.0, 1.0)]);
        let distance = signed_distance(&mask, 0.5)?;
        let surface = contour(&distance, 0.0, BoxEdge::Closed)?;
        let exact = contour(
            &ScalarField::from_fn(grid, |x| [distance_to_torus(x)]),
            0.0,
            BoxEdge::Closed,
        )?;
        println!(
            "{:>3}^3   {:.5}  {:.5}  {:>12}   {:.1e}",
            grid.nodes_per_axis()[0],
            Moments::of_contour(&surface)?.volume,
            surface.perimeter(),
            surface.euler_number(),
            hausdorff(&surface, &exact)?.maximum,
        );
        if level == 5 {
            let mut text = format!(
                "OFF\n{} {} 0\n",
                surface.points().len(),
                surface.simplices().len()
            );
            for [x, y, z] in surface.points() {
                writeln!(text, "{x:.6} {y:.6} {z:.6}")?;
            }
            for [a, b, c] in surface.simplices() {
                writeln!(text, "3 {a} {b} {c}")?;
            }
            std::fs::write("torus.off", text)?;
        }
    }
    println!("the surface on 33^3 nodes is in torus.off");
    Ok(())
}
