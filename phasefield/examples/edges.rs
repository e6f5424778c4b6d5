//! The edges of a noisy image, as a phase field.
//!
//! ```sh
//! cargo run --release -p phasefield --example edges
//! ```

use std::fmt::Write;

use fe_grid::minimise::Silent;
use fe_grid::random::noise;
use fe_grid::{Grid, ScalarField};
use phasefield::segmentation::{SegmentationParams, segment};

/// A disk and a square of different grey values.
fn scene([x, y]: [f64; 2]) -> f64 {
    let disk = (x - 0.35).hypot(y - 0.6) < 0.2;
    let square = (x - 0.7).abs().max((y - 0.3).abs()) < 0.15;
    if disk {
        1.0
    } else if square {
        0.6
    } else {
        0.2
    }
}

/// Writes values between 0 and 1 as a grey picture that image viewers open.
fn write_picture(name: &str, field: &ScalarField<f64, 2>) -> std::io::Result<()> {
    let [width, height] = field.grid().nodes_per_axis();
    let mut text = format!("P2\n{width} {height}\n255\n");
    // The first row of a picture is its upper one.
    for row in field.as_slice().chunks(width).rev() {
        for value in row {
            let _ = write!(text, "{} ", (255.0 * value.clamp(0.0, 1.0)).round());
        }
        text.push('\n');
    }
    std::fs::write(name, text)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::<2>::dyadic(7);
    let mut image = ScalarField::<f64, 2>::from_fn(grid, |x| [scene(x)]);
    for (value, noise) in image
        .as_mut_slice()
        .iter_mut()
        .zip(noise(grid.n_nodes(), 1))
    {
        *value += 0.15 * noise;
    }
    let params = SegmentationParams::default();
    let found = segment(&image, &params, &mut Silent)?;
    let clean = ScalarField::<f64, 2>::from_fn(grid, |x| [scene(x)]);
    let error = |u: &ScalarField<f64, 2>| -> f64 {
        let squares = u.as_slice().iter().zip(clean.as_slice());
        (squares.map(|(u, v)| (u - v).powi(2)).sum::<f64>() / grid.n_nodes() as f64).sqrt()
    };
    println!(
        "root mean square error of the noisy image    {:.4}",
        error(&image)
    );
    println!(
        "root mean square error of the smoothed image {:.4}",
        error(&found.image)
    );
    // The length of the edges by the phase field, beside that of a circle and a square.
    let length = std::f64::consts::TAU * 0.2 + 8.0 * 0.15;
    let computed = found.energy().edges / params.weights.edges;
    println!("length of the edges {computed:.3} by the phase field, {length:.3} drawn");
    for (name, field) in [
        ("noisy.pgm", &image),
        ("smooth.pgm", &found.image),
        ("edges.pgm", &found.phase_field),
    ] {
        write_picture(name, field)?;
    }
    println!("the pictures are in noisy.pgm, smooth.pgm and edges.pgm");
    Ok(())
}
