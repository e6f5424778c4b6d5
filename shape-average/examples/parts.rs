//! Times the parts of an evaluation.
use fe_grid::composition::{Interpolant, Matching};
use fe_grid::linear::LinearOperator;
use fe_grid::scatter::{Background, Source, normal_equations};
use fe_grid::*;
use hyperelastic::*;
use phasefield::*;
fn time(name: &str, mut f: impl FnMut()) {
    let mut best = f64::MAX;
    for _ in 0..5 {
        let t = std::time::Instant::now();
        f();
        best = best.min(t.elapsed().as_secs_f64());
    }
    println!("{name:28} {:8.2} ms", 1e3 * best);
}
fn main() {
    let n: usize = std::env::args().nth(1).map_or(65, |x| x.parse().unwrap());
    let threads: usize = std::env::args().nth(2).map_or(2, |x| x.parse().unwrap());
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .unwrap();
    run::<3>(n);
}
fn run<const D: usize>(n: usize) {
    let grid = Grid::<D>::cube(n);
    let nn = grid.n_nodes();
    let u = Field::<f64, D, D>::from_fn(grid, |x| {
        std::array::from_fn(|k| 0.02 * (6.0 * x[k] + 3.0 * x[(k + 1) % D]).sin())
    })
    .into_vec();
    let v = Field::<f64, D, 1>::from_fn(grid, |x| {
        let r: f64 = x.iter().map(|x| (x - 0.5) * (x - 0.5)).sum();
        [1.0 - (-(r.sqrt() - 0.3).abs() * 30.0).exp()]
    })
    .into_vec();
    let mut g = vec![0.0; D * nn];
    let c = [v.as_slice()];
    let data = Data {
        coefficients: &c,
        cells: &[],
    };
    let law = WeightedElasticity {
        law: LogDet::<D>::new(LameModuli::new(1.0, 1.0).unwrap()).unwrap(),
        void_stiffness: 1e-4,
    };
    let a = Assembly::new(grid, &law, data);
    time("elastic value", || {
        a.value(&u).unwrap();
    });
    time("elastic gradient", || {
        a.value_and_gradient_into(&u, &mut g).unwrap();
    });
    let u2 = u.clone();
    time("elastic hessian", || {
        a.hessian_action_into(&u, &u2, &mut g);
    });
    let b = FoldBarrier {
        weight: 1.0,
        onset: 0.2,
    };
    let b = Assembly::new(grid, &b, Data::<f64>::default());
    time("barrier gradient", || {
        b.value_and_gradient_into(&u, &mut g).unwrap();
    });
    let m = Mismatch {
        interface_width: 0.03,
        scale: 1.0,
    };
    let m2 = Matching::new(m, Interpolant::new(grid, &v));
    let ma = Assembly::new(grid, &m2, data);
    time("matching gradient", || {
        ma.value_and_gradient_into(&u, &mut g).unwrap();
    });
    time("certify", || {
        certify(&grid, &u, 1e-3);
    });
    let s = Source {
        displacement: &u,
        coefficients: &c,
    };
    time("normal equations, 1 shape", || {
        normal_equations(&grid, &m, &[s], Background::default());
    });
    time("normal equations, 4 shapes", || {
        normal_equations(&grid, &m, &[s, s, s, s], Background::default());
    });
    let (mat, rhs) = normal_equations(
        &grid,
        &m,
        &[s],
        Background {
            mass: 1e-3,
            stiffness: 1e-5,
            load: 1e-3,
        },
    );
    let mut y = vec![0.0; nn];
    time("stencil apply", || mat.apply_into(&v, &mut y));
    time("cg", || {
        let mut x = vec![1.0; nn];
        let i = conjugate_gradient(
            &mat,
            &Diagonal::jacobi(mat.diagonal()).unwrap(),
            &rhs,
            &mut x,
            &CgParams {
                relative_tolerance: 1e-9,
                ..Default::default()
            },
            &mut CgScratch::default(),
        )
        .unwrap();
        assert!(i.iterations < 100);
    });
    let law = Corotational::<D> {
        moduli: LameModuli::new(1.0, 1.0).unwrap(),
        regularisation: 1e-4,
    };
    let cells: Vec<Vec<f32>> = (0..Corotational::<D>::CELL_DATA)
        .map(|i| {
            vec![
                if i == 0 || (i <= D * D && (i - 1) % (D + 1) == 0) {
                    1.0
                } else if i > D * D {
                    0.1
                } else {
                    0.0
                };
                grid.n_cells()
            ]
        })
        .collect();
    let cells2 = cells.clone();
    time("multigrid build", || {
        multigrid::Multigrid::<f32, _, D, D>::new(grid, &law, cells2.clone(), Default::default())
            .unwrap();
    });
    let mg =
        multigrid::Multigrid::<f32, _, D, D>::new(grid, &law, cells, Default::default()).unwrap();
    let uf: Vec<f32> = u.iter().map(|x| *x as f32).collect();
    let mut gf = uf.clone();
    time("metric apply f32", || mg.operator_into(&uf, &mut gf));
    time("v-cycle", || mg.apply_into(&u, &mut g));
}
