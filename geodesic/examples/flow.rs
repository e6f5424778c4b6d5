//! Scratch.
use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid};
use geodesic::{
    GeodesicParams,
    lagrangian::lagrangian_path,
    level_sets::{PathState, flow, level_set_path},
};
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
    let (a, b) = (read(&args[1]), read(&args[2]));
    let k = number("K", 4.0) as usize;
    let params = GeodesicParams {
        steps: k,
        void_viscosity: number("nu", 1e-3),
        void_stiffness: number("delta", 0.0),
        match_weight: number("eta", 100.0) * k as f64,
        max_iterations: number("it", 100.0) as usize,
        tolerance: number("tol", 1e-4),
        match_cells: number("eps", 1.0),
        indicator_cells: number("ind", 2.0),
        min_determinant: number("det", 1e-3),
        area_weight: number("mu", 1e-3),
        ..Default::default()
    };
    let t = std::time::Instant::now();
    let mut state = if number("lag", 0.0) > 0.0 {
        let path = lagrangian_path(
            &a,
            &b,
            &GeodesicParams {
                match_weight: number("eta", 100.0),
                void_stiffness: 1e-4,
                void_viscosity: 0.0,
                ..params.clone()
            },
            |_, _| [0.0; 2],
            &mut Silent,
        )
        .unwrap();
        println!(
            "lagrangian {:.2?} L {}",
            t.elapsed(),
            path.levels.last().unwrap().energy.length()
        );
        let c = levelset::contour(&a, 0.0, levelset::BoxEdge::Open).unwrap();
        let mut s = vec![a.clone()];
        for u in &path.displacements {
            let m = c.map(|p| {
                let d = u.sample(p);
                [p[0] + d[0], p[1] + d[1]]
            });
            s.push(
                levelset::ContourDistance::new(&m)
                    .unwrap()
                    .sample(*a.grid()),
            );
        }
        PathState {
            level_sets: s,
            displacements: vec![],
        }
    } else {
        let f = flow(&a, &b, &params).unwrap();
        println!(
            "flow {} steps length {:.4} dice {:.4} {:.2?}",
            f.lengths.len(),
            f.lengths.iter().sum::<f64>(),
            f.dice,
            t.elapsed()
        );
        dump(
            "/tmp/geo/flow.raw",
            &f.shapes
                .iter()
                .step_by((f.shapes.len() / 15).max(1))
                .cloned()
                .collect::<Vec<_>>(),
        );
        f.cut(k)
    };
    state.level_sets[k] = b.clone();
    let p1 = GeodesicParams {
        steps: 1,
        match_weight: number("eta", 100.0),
        void_stiffness: number("delta", 0.0),
        ..params.clone()
    };
    for i in state.displacements.len()..k {
        let path = lagrangian_path(
            &state.level_sets[i],
            &state.level_sets[i + 1],
            &p1,
            |_, _| [0.0; 2],
            &mut Silent,
        )
        .unwrap();
        let e = path.levels.last().unwrap();
        println!(
            "  step {i}: W {:.5} match {:.2e} it {:?}",
            e.energy.step_energies[0],
            e.energy.mismatch,
            path.levels
                .iter()
                .map(|l| l.info.iterations)
                .collect::<Vec<_>>()
        );
        state.displacements.push(path.displacements[0].clone());
    }
    println!("init {:.2?}", t.elapsed());
    dump("/tmp/geo/first.raw", &state.level_sets);
    if number("debug", 0.0) > 0.0 {
        use fe_grid::minimise::{Evaluation, Objective};
        let mut o = geodesic::level_sets::LevelSetObjective::new(*a.grid(), k, &params).unwrap();
        let n = a.as_slice().len();
        let mut x = state.level_sets[0].as_slice().to_vec();
        for (u, p) in state.level_sets[1..].iter().zip(&state.displacements) {
            x.extend_from_slice(p.as_slice());
            x.extend_from_slice(u.as_slice());
        }
        let mut g = vec![0.0; x.len()];
        println!("{:?}", o.value_and_gradient(&x, &mut g));
        o.update_metric(&x).unwrap();
        let mut d = vec![0.0; x.len()];
        for mode in 0..3 {
            let mut gm = g.clone();
            for i in 0..gm.len() {
                let isu = i < n || ((i - n) % (3 * n)) >= 2 * n;
                if (mode == 1 && isu) || (mode == 2 && !isu) {
                    gm[i] = 0.0;
                }
            }
            o.apply_inverse_metric(&gm, &mut d).unwrap();
            for v in &mut d {
                *v = -*v;
            }
            if mode > 0 {
                for i in 0..gm.len() {
                    let isu = i < n || ((i - n) % (3 * n)) >= 2 * n;
                    if (mode == 1 && isu) || (mode == 2 && !isu) {
                        d[i] = 0.0;
                    }
                }
            }
            let slope: f64 = g.iter().zip(&d).map(|(a, b)| a * b).sum();
            let du = (0..x.len())
                .filter(|&i| i < n || ((i - n) % (3 * n)) >= 2 * n)
                .map(|i| d[i].abs())
                .fold(0.0, f64::max);
            let dp = (0..x.len())
                .filter(|&i| !(i < n || ((i - n) % (3 * n)) >= 2 * n))
                .map(|i| d[i].abs())
                .fold(0.0, f64::max);
            println!("mode {mode} slope {slope:.3e} max du {du:.3e} dphi {dp:.3e}");
            for s in [1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0] {
                let y: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + s * d).collect();
                let Evaluation::Value(e) = o.value(&y).unwrap() else {
                    println!("  {s} inadmissible");
                    continue;
                };
                let Evaluation::Value(e0) = o.value(&x).unwrap() else {
                    continue;
                };
                println!(
                    "  s {s}: dE {:.4e} (dE/s {:.4e}) {:?}",
                    e - e0,
                    (e - e0) / s,
                    o.energy()
                );
            }
        }
    }
    let path = level_set_path(&state, &params, number("co", 0.0) as usize, &mut Silent).unwrap();
    for l in &path.levels {
        let e = &l.energy;
        println!(
            "{} it {} ev {} {:?} E0 {:.6} E {:.6} L {:.5} diss {:.5} W {:.5?} match {:.7?} area {:.3?}",
            l.nodes[0],
            l.info.iterations,
            l.info.evaluations.energies(),
            l.info.status,
            l.info.energies[0],
            e.total,
            e.length(),
            e.dissipation(),
            e.step_energies,
            e.mismatches,
            e.areas
        );
    }
    println!("total {:.2?}", t.elapsed());
    dump("/tmp/geo/path_u.raw", &path.state.level_sets);
}
