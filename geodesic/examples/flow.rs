//! Scratch.
use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid};
use geodesic::{Form, GeodesicParams, geodesic};
fn read(name: &str) -> Field<f64, 2, 1> {
    let bytes = std::fs::read(format!("/tmp/geo/{name}.raw")).unwrap();
    let v: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let n = (v.len() as f64).sqrt() as usize;
    levelset::signed_distance(&Field::from_vec(Grid::cube(n), v).unwrap(), 0.5).unwrap()
}
fn dump(name: &str, fields: &[Field<f64, 2, 1>]) {
    let bytes: Vec<u8> = fields
        .iter()
        .flat_map(|u| u.as_slice().iter().flat_map(|x| x.to_le_bytes()))
        .collect();
    std::fs::write(name, bytes).unwrap();
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |key: &str, default: f64| {
        args.iter()
            .find_map(|a| a.strip_prefix(&format!("{key}="))?.parse().ok())
            .unwrap_or(default)
    };
    let d = GeodesicParams::default();
    let params = GeodesicParams {
        form: if number("A", 1.0) > 0.0 {
            Form::LevelSets
        } else {
            Form::Lagrangian
        },
        steps: number("K", 4.0) as usize,
        void_viscosity: number("nu", d.void_viscosity),
        void_stiffness: number("delta", d.void_stiffness),
        match_weight: number("eta", 100.0),
        max_iterations: number("it", 300.0) as usize,
        tolerance: number("tol", 1e-4),
        match_cells: number("eps", 1.0),
        flow_nodes: number("fn", 33.0) as usize,
        indicator_cells: number("ind", d.indicator_cells),
        min_determinant: number("det", 1e-3),
        area_weight: number("mu", 1e-3),
        ..d
    };
    let (a, b) = if args[1] == "disk" {
        let grid = Grid::<2>::dyadic(number("level", 6.0) as u32);
        let disk = |r: f64| {
            Field::<f64, 2, 1>::from_fn(grid, |[x, y]| {
                [r - ((x - 0.5).powi(2) + (y - 0.5).powi(2)).sqrt()]
            })
        };
        (disk(0.2), disk(0.3))
    } else {
        (read(&args[1]), read(&args[2]))
    };
    let t = std::time::Instant::now();
    let g = geodesic(&a, &b, &params, &mut Silent).unwrap();
    for l in &g.levels {
        println!(
            "{} K {} it {} ev {} {:?} E0 {:.6} E {:.6}",
            l.nodes[0],
            l.steps,
            l.info.iterations,
            l.info.evaluations.energies(),
            l.info.status,
            l.info.energies[0],
            l.total
        );
    }
    println!(
        "L {:.5} diss {:.5} dice {:.4} {:.4} det {:.4} W {:.5?} match {:.7?} {:.2?}",
        g.length(),
        g.dissipation(),
        g.dice_end,
        g.dice_pulled,
        g.certificate.min_det,
        g.step_energies,
        g.matches,
        t.elapsed()
    );
    if let Some(l) = g.levels.last().filter(|l| !l.areas.is_empty()) {
        let (w, f): (f64, f64) = (l.step_energies.iter().sum(), l.matches.iter().sum());
        let a: f64 = l.areas[..l.areas.len() - 1].iter().sum();
        println!(
            "theirs: {:.6} = W {w:.3e} + 10 F {:.3e} + mu A {:.4e}",
            w + 10.0 * f + 1e-3 * a,
            10.0 * f,
            1e-3 * a
        );
    }
    dump("/tmp/geo/path_u.raw", &g.level_sets);
}
