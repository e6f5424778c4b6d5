//! Uniaxial tension: stress against stretch for the laws of this crate.
//!
//! A bar is stretched along its axis and free to contract across it, until the stress across is zero.
//! Under every law the slope at the undeformed state is Young's modulus `mu (3 lambda + 2 mu) / (lambda + mu)`;
//! the laws differ at large strains.
//!
//! ```sh
//! cargo run --release -p hyperelastic --example stress_strain
//! ```

use hyperelastic::{CompiledLaw, LameModuli, LawError, LawSpec};

const LAWS: [&str; 4] = ["logdet", "power", "inverse:logdet", "linear"];

/// The first Piola–Kirchhoff stress of `diag(stretch, across, across)`: along the axis and across.
fn stresses(law: &CompiledLaw<3>, stretch: f64, across: f64) -> [f64; 2] {
    let mut h = [[0.0; 3]; 3];
    for (k, value) in [stretch, across, across].into_iter().enumerate() {
        h[k][k] = value - 1.0;
    }
    let (_, stress) = law.gradient::<f64>(&h);
    [stress[0][0], stress[1][1]]
}

/// The stress along the axis where that across it vanishes, and the stretch across, by bisection.
fn tension(law: &CompiledLaw<3>, stretch: f64) -> [f64; 2] {
    let [mut low, mut high] = [0.2, 3.0];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        // The stress across increases with the stretch across.
        if stresses(law, stretch, middle)[1] > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    [stresses(law, stretch, low)[0], low]
}

fn main() -> Result<(), LawError> {
    let moduli = LameModuli::new(1.0, 1.0)?;
    let laws: Vec<CompiledLaw<3>> = LAWS
        .iter()
        .map(|name| LawSpec::new(name, moduli)?.compile::<3>())
        .collect::<Result<_, _>>()?;
    println!("lambda = mu = 1; stress along the axis / stretch across it");
    println!(
        "stretch  {}",
        LAWS.map(|name| format!("{name:>18}")).join("")
    );
    for stretch in [0.5, 0.7, 0.9, 0.99, 1.0, 1.01, 1.1, 1.3, 1.6, 2.0] {
        let cells = laws.iter().map(|law| {
            let [stress, across] = tension(law, stretch);
            format!("{stress:>10.4} / {across:.3}")
        });
        println!("{stretch:>7.2}  {}", cells.collect::<String>());
    }
    let t = 1e-5;
    for (name, law) in LAWS.iter().zip(&laws) {
        let slope = (tension(law, 1.0 + t)[0] - tension(law, 1.0 - t)[0]) / (2.0 * t);
        println!("{name:<15} slope at 1: {slope:.5} (Young's modulus 2.5)");
    }
    Ok(())
}
