//! Averages `.npy` arrays of exactly the grid's size and prints the energies of every level.
use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use shape_average::{AverageParams, Solver, average};

fn run<const D: usize>(arrays: Vec<Vec<f64>>, n: usize, params: &AverageParams) {
    let grid = Grid::<D>::cube(n);
    let t = std::time::Instant::now();
    let shapes: Vec<_> = arrays
        .into_iter()
        .map(|a| levelset::signed_distance(&ScalarField::from_vec(grid, a).unwrap(), 0.5).unwrap())
        .collect();
    println!("distances {:.2}s", t.elapsed().as_secs_f64());
    let result = average(&shapes, params, &mut Silent).unwrap();
    for l in &result.levels {
        println!(
            "n {:4} it {:3} shape evals {:5} (values {} gradients {} metric {} builds {}) cg {:5} {:.2}s {:?} E {:.7} W {:.3e} F {:.6} L {:.4} det {:.3}",
            l.nodes[0],
            l.iterations,
            l.shape_evaluations,
            l.evaluations.values,
            l.evaluations.gradients,
            l.evaluations.metric_applications,
            l.evaluations.metric_builds,
            l.average_iterations,
            l.seconds,
            l.status,
            l.energy.total,
            l.energy.elastic.iter().sum::<f64>(),
            l.energy.mismatch.iter().sum::<f64>(),
            l.energy.length,
            l.certificate.min_det
        );
    }
    if let Ok(dir) = std::env::var("DUMP") {
        let write = |name: String, data: &[f64]| {
            let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
            std::fs::write(format!("{dir}/{name}"), bytes).unwrap();
        };
        write("average".into(), result.average.as_slice());
        write("indicator".into(), result.average_indicator.as_slice());
        for (i, u) in result.displacements.iter().enumerate() {
            write(format!("u{i}"), u.as_slice());
            write(format!("p{i}"), result.pushed[i].as_slice());
            write(format!("v{i}"), result.shapes.phase_fields[i].as_slice());
            println!(
                "shape {i}: {:?} dice {}",
                fe_grid::certify(&grid, u.as_slice(), 0.0),
                result.dice[i]
            );
        }
    }
    println!(
        "total {:.2}s dice {:.4} min {:.4} {:?}",
        result.seconds,
        result.mean_dice(),
        result.dice.iter().fold(1.0f64, |a, &b| a.min(b)),
        result.certificate
    );
}

fn main() {
    let mut params = AverageParams::default();
    let mut arrays = Vec::new();
    let mut shape = Vec::new();
    for arg in std::env::args().skip(1) {
        if let Some((key, value)) = arg.split_once('=') {
            match key {
                "tol" => params.tolerance = value.parse().unwrap(),
                "it" => params.max_iterations = value.parse().unwrap(),
                "gamma" => params.mismatch_weight = value.parse().unwrap(),
                "delta" => params.void_stiffness = value.parse().unwrap(),
                "solver" => {
                    params.solver = if value == "descent" {
                        Solver::Descent
                    } else {
                        Solver::Lbfgs
                    }
                }
                _ => panic!("{key}"),
            }
            continue;
        }
        let npy = npyz::NpyFile::new(std::io::BufReader::new(std::fs::File::open(&arg).unwrap()))
            .unwrap();
        shape = npy.shape().to_vec();
        let data: Vec<f64> = match npy.try_data::<f64>() {
            Ok(d) => d.map(|x| x.unwrap()).collect(),
            Err(npy) => match npy.try_data::<f32>() {
                Ok(d) => d.map(|x| f64::from(x.unwrap())).collect(),
                Err(npy) => npy
                    .data::<u8>()
                    .unwrap()
                    .map(|x| f64::from(x.unwrap()))
                    .collect(),
            },
        };
        arrays.push(data);
    }
    if shape.len() == 2 {
        run::<2>(arrays, shape[0] as usize, &params);
    } else {
        run::<3>(arrays, shape[0] as usize, &params);
    }
}
