//! Scratch.
use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, certify_within};
use geodesic::{GeodesicParams, lagrangian::lagrangian_path};
fn read(name: &str) -> Field<f64, 2, 1> {
    let bytes = std::fs::read(format!("/tmp/geo/{name}.raw")).unwrap();
    let v: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let n = (v.len() as f64).sqrt() as usize;
    levelset::signed_distance(&Field::from_vec(Grid::cube(n), v).unwrap(), 0.5).unwrap()
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |key: &str, default: f64| {
        args.iter()
            .find_map(|a| a.strip_prefix(&format!("{key}="))?.parse().ok())
            .unwrap_or(default)
    };
    let (a, b) = (read(&args[1]), read(&args[2]));
    let grid = *a.grid();
    let params = GeodesicParams {
        steps: number("K", 4.0) as usize,
        void_viscosity: number("nu", 1e-3),
        void_stiffness: number("delta", 0.0),
        match_weight: number("eta", 100.0),
        max_iterations: number("it", 100.0) as usize,
        coarsest_nodes: number("n0", 17.0) as usize,
        tolerance: number("tol", 1e-4),
        match_cells: number("eps", 1.0),
        indicator_cells: number("ind", 2.0),
        min_determinant: number("det", 1e-3),
        deformed_share: number("theta", 1.0),
        ..Default::default()
    };
    let t = std::time::Instant::now();
    let k = params.steps;
    let mut guess: Vec<Field<f64, 2, 2>> = vec![Field::zeros(grid); k + 1];
    if number("flow", 0.0) > 0.0 {
        let f = geodesic::level_sets::flow(&a, &b, &params).unwrap();
        let cut = f.cut(k);
        for j in 1..=k {
            guess[j] = geodesic::level_sets::compose(
                &grid,
                &[guess[j - 1].clone(), cut.displacements[j - 1].clone()],
            );
        }
        println!(
            "flow {} dice {:.4} {:.2?}",
            f.lengths.len(),
            f.dice,
            t.elapsed()
        );
        let solid =
            geodesic::lagrangian::PathObjective::new(a.clone(), b.clone(), k, &params).unwrap();
        for j in 1..=k {
            println!(
                "  det {:.4}",
                certify_within(
                    &grid,
                    guess[j].as_slice(),
                    0.0,
                    f64::INFINITY,
                    solid.solid_cells()
                )
                .min_det
            );
        }
    }
    let path = lagrangian_path(
        &a,
        &b,
        &params,
        |t, y| guess[(t * k as f64).round() as usize].sample(y),
        &mut Silent,
    )
    .unwrap();
    let t = t.elapsed();
    for l in &path.levels {
        println!(
            "{} K {} it {} ev {} {:?} E {:.6} L {:.5} diss {:.5} match {:.3e}",
            l.nodes[0],
            l.steps,
            l.info.iterations,
            l.info.evaluations.energies(),
            l.info.status,
            l.energy.total,
            l.energy.length(),
            l.energy.dissipation(),
            l.energy.mismatch
        );
    }
    let last = path.displacements.last().unwrap();
    let moved = levelset::contour(&a, 0.0, levelset::BoxEdge::Open)
        .unwrap()
        .map(|p| {
            let u = last.sample(p);
            [p[0] + u[0], p[1] + u[1]]
        });
    let distance = levelset::ContourDistance::new(&moved).unwrap().sample(grid);
    let dice = levelset::dice(&distance, 0.0, &b, 0.0).unwrap();
    println!(
        "dice {dice:.4} min det {:.4} t {t:.2?}",
        path.displacements
            .iter()
            .map(|u| certify_within(
                &grid,
                u.as_slice(),
                0.0,
                f64::INFINITY,
                path.solid.as_deref()
            )
            .min_det)
            .fold(9.0, f64::min)
    );
    let bytes: Vec<u8> = path
        .displacements
        .iter()
        .flat_map(|u| u.as_slice().iter().flat_map(|x| x.to_le_bytes()))
        .collect();
    std::fs::write("/tmp/geo/path.raw", bytes).unwrap();
}
