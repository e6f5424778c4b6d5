//! The measured kernels, on grids of any size: one catalogue for times and for counts of
//! instructions.

use std::f64::consts::TAU;
use std::fmt;
use std::hint::black_box;

use fe_grid::composition::{Interpolant, Matching};
use fe_grid::minimise::Objective;
use fe_grid::operators::MassStiffness;
use fe_grid::scatter::{Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::{
    Assembly, Boundary, CellLaw, Data, Element, Field, Grid, ScalarField, SpectralSolver,
    UniformOperator, certify,
};
use hyperelastic::{CompiledLaw, LameModuli, LogDet, WeightedElasticity};
use phasefield::{Mismatch, Profile};
use shape_average::{AverageObjective, AverageParams, LevelShapes};

use super::anchor::AnchorLaw;
use super::flops::{Inlined, Verb, per_point};
use crate::outcome::Outcome;

/// What is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// The weighted `logdet` energy.
    Elastic(Verb),
    /// The anchor's energy.
    Anchor(Verb),
    /// Mismatch of a composition, with its gradient.
    Matching,
    /// The normal equations for the average, from one shape.
    NormalEquations,
    /// Scalar mass and stiffness applied.
    MassStiffness,
    /// Exact inverse of mass and stiffness by cosine transforms.
    Cosine,
    /// The same by sine transforms.
    Sine,
    /// The metric of one shape: its coefficients on all cells, and the multigrid hierarchy.
    MetricBuild,
    /// One multigrid cycle for one shape.
    MetricCycle,
    /// The certificate that one shape does not fold.
    Certificate,
    /// The functional of the average of two shapes, with its gradient.
    Functional,
}

const NAMES: [(&str, Work); 15] = [
    ("elastic_value", Work::Elastic(Verb::Value)),
    ("elastic_gradient", Work::Elastic(Verb::Gradient)),
    ("elastic_hessian", Work::Elastic(Verb::Hessian)),
    ("anchor_value", Work::Anchor(Verb::Value)),
    ("anchor_gradient", Work::Anchor(Verb::Gradient)),
    ("anchor_hessian", Work::Anchor(Verb::Hessian)),
    ("matching_gradient", Work::Matching),
    ("normal_equations", Work::NormalEquations),
    ("mass_stiffness", Work::MassStiffness),
    ("cosine_solve", Work::Cosine),
    ("sine_solve", Work::Sine),
    ("metric_build", Work::MetricBuild),
    ("metric_cycle", Work::MetricCycle),
    ("certificate", Work::Certificate),
    ("functional", Work::Functional),
];

impl Work {
    /// Kernels that are measured in double precision alone.
    pub const IN_DOUBLE: [Self; 7] = [
        Self::Matching,
        Self::NormalEquations,
        Self::Cosine,
        Self::Sine,
        Self::MetricBuild,
        Self::MetricCycle,
        Self::Certificate,
    ];

    fn name(self) -> &'static str {
        NAMES
            .iter()
            .find(|(_, work)| *work == self)
            .map_or("", |n| n.0)
    }
}

/// Storage type of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Real {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
}

impl Real {
    /// `f64` or `f32`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }

    fn bytes(self) -> f64 {
        match self {
            Self::F64 => 8.0,
            Self::F32 => 4.0,
        }
    }
}

/// A kernel on a grid; written `WORK/DIMENSION/REAL/NODES`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// What is computed.
    pub work: Work,
    /// 2 or 3.
    pub dimension: usize,
    /// Storage type.
    pub real: Real,
    /// Nodes along every axis.
    pub nodes: usize,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (work, real) = (self.work.name(), self.real.name());
        write!(f, "{work}/{}d/{real}/{}", self.dimension, self.nodes)
    }
}

impl std::str::FromStr for Case {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || format!("there is no kernel {text}");
        let parts: Vec<&str> = text.split('/').collect();
        let [work, dimension, real, nodes] = parts[..] else {
            return Err(unknown());
        };
        let named = NAMES.iter().find(|(name, _)| *name == work);
        Ok(Self {
            work: named.ok_or_else(unknown)?.1,
            dimension: match dimension {
                "2d" => 2,
                "3d" => 3,
                _ => return Err(unknown()),
            },
            real: match real {
                "f64" => Real::F64,
                "f32" => Real::F32,
                _ => return Err(unknown()),
            },
            nodes: nodes.parse().map_err(|_| unknown())?,
        })
    }
}

/// A kernel that is ready to run.
pub struct Kernel {
    /// Runs it once.
    pub run: Box<dyn FnMut() + Send>,
    /// Unit of the rates: `points` (of the quadrature) or `DoF` (degrees of freedom).
    pub unit: &'static str,
    /// Number of units.
    pub units: f64,
    /// Total number of floating-point operations, if they are counted.
    pub flops: Option<f64>,
    /// Bytes of all fields that are read or written, each counted once.
    pub bytes: f64,
}

impl Case {
    /// Creates the data of the kernel.
    pub fn prepare(self) -> Outcome<Kernel> {
        match (self.dimension, self.real) {
            (2, Real::F64) => self.in_dimension::<2>(),
            (3, Real::F64) => self.in_dimension::<3>(),
            (2, Real::F32) => self.in_scalar::<f32, 2>(),
            (_, _) => self.in_scalar::<f32, 3>(),
        }
    }

    /// Kernels that exist for both scalars.
    fn in_scalar<T: Element, const D: usize>(self) -> Outcome<Kernel> {
        let grid = Grid::<D>::cube(self.nodes);
        match self.work {
            Work::Elastic(verb) => {
                let law = LogDet::<D>::new(LameModuli::default())?;
                let operations = per_point::<_, D, D>(&Inlined(law), verb);
                // It must outlive the kernel, which may run until the program ends.
                let weighted = WeightedElasticity {
                    law: Box::leak(Box::new(CompiledLaw::in_both_precisions(law))),
                    void_stiffness: 1e-4,
                };
                Ok(elastic::<T, _, D>(self, grid, weighted, verb, operations))
            }
            Work::Anchor(verb) => {
                let operations = per_point::<_, D, D>(&AnchorLaw, verb);
                Ok(elastic::<T, _, D>(self, grid, AnchorLaw, verb, operations))
            }
            Work::MassStiffness => Ok(mass_stiffness::<T, D>(self, grid)),
            Work::Certificate => {
                let u = displacement::<T, D>(&grid);
                Ok(Kernel {
                    run: Box::new(move || {
                        black_box(certify(&grid, black_box(&u), 0.0));
                    }),
                    ..self.kernel(grid, "DoF", D as f64, None)
                })
            }
            _ => Err(format!("{self}: this kernel exists in f64 only").into()),
        }
    }

    fn in_dimension<const D: usize>(self) -> Outcome<Kernel> {
        let grid = Grid::<D>::cube(self.nodes);
        match self.work {
            Work::Matching => matching(self, grid),
            Work::NormalEquations => normal(self, grid),
            Work::Cosine => spectral(self, grid, Boundary::Natural),
            Work::Sine => spectral(self, grid, Boundary::Dirichlet),
            Work::MetricBuild | Work::MetricCycle | Work::Functional => functional(self, grid),
            _ => self.in_scalar::<f64, D>(),
        }
    }

    /// A kernel without work; `numbers` values are read or written per node.
    fn kernel<const D: usize>(
        self,
        grid: Grid<D>,
        unit: &'static str,
        numbers: f64,
        flops: Option<f64>,
    ) -> Kernel {
        let nodes = grid.n_nodes() as f64;
        let points = (grid.n_cells() << D) as f64;
        Kernel {
            run: Box::new(|| ()),
            unit,
            units: if unit == "points" { points } else { nodes },
            flops: flops.map(|f| f * points),
            bytes: numbers * nodes * self.real.bytes(),
        }
    }
}

fn elastic<T, F, const D: usize>(
    case: Case,
    grid: Grid<D>,
    law: F,
    verb: Verb,
    operations: f64,
) -> Kernel
where
    T: Element,
    F: CellLaw<D, D> + Send + 'static,
{
    let kappa: Vec<T> = disk(grid, 0.0, |x| if x > 0.0 { 1.0 } else { 0.0 });
    let state = displacement::<T, D>(&grid);
    let mut out = match verb {
        Verb::Value => Vec::new(),
        _ => vec![T::default(); state.len()],
    };
    let fields = match verb {
        Verb::Value => 1,
        Verb::Gradient => 2,
        Verb::Hessian => 3,
    };
    let numbers = (fields * D + F::COEFFICIENTS) as f64;
    let kernel = case.kernel(grid, "points", numbers, Some(operations));
    let run = move || {
        let coefficients = [kappa.as_slice()];
        let data = Data {
            coefficients: &coefficients[..F::COEFFICIENTS],
            cells: &[],
        };
        let assembly = Assembly::<_, T, D, D>::new(grid, &law, data);
        let state = black_box(state.as_slice());
        match verb {
            Verb::Value => drop(black_box(assembly.value(state))),
            Verb::Gradient => drop(black_box(assembly.value_and_gradient_into(state, &mut out))),
            Verb::Hessian => assembly.hessian_action_into(state, state, &mut out),
        }
    };
    Kernel {
        run: Box::new(run),
        ..kernel
    }
}

fn mass_stiffness<T: Element, const D: usize>(case: Case, grid: Grid<D>) -> Kernel {
    let law = MassStiffness {
        mass: 1.0,
        stiffness: 0.1,
    };
    let x: Vec<T> = displacement::<T, D>(&grid)[..grid.n_nodes()].to_vec();
    let mut y = x.clone();
    // It is limited by memory bandwidth; operations are not counted.
    let kernel = case.kernel(grid, "DoF", 2.0, None);
    let operator = UniformOperator::new(grid, law);
    let run = move || operator.product_into(black_box(&x), &mut y);
    Kernel {
        run: Box::new(run),
        ..kernel
    }
}

/// The mismatch of a shape and of a deformed one.
fn mismatch<const D: usize>(grid: Grid<D>) -> Mismatch {
    Mismatch {
        interface_width: 2.0 * grid.spacing(),
        scale: 1.0,
    }
}

fn matching<const D: usize>(case: Case, grid: Grid<D>) -> Outcome<Kernel> {
    let (field, shape) = phase_fields(grid)?;
    let state = displacement::<f64, D>(&grid);
    let mut out = vec![0.0; state.len()];
    let density = mismatch(grid);
    let law = Matching::new(density, Interpolant::new(grid, &field));
    let flops = per_point(&law, Verb::Gradient);
    let kernel = case.kernel(grid, "points", (2 * D + 2) as f64, Some(flops));
    let run = move || {
        let coefficients = [shape.as_slice()];
        let law = Matching::new(density, Interpolant::new(grid, &field));
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let assembly = Assembly::new(grid, &law, data);
        drop(black_box(
            assembly.value_and_gradient_into(black_box(&state), &mut out),
        ));
    };
    Ok(Kernel {
        run: Box::new(run),
        ..kernel
    })
}

fn normal<const D: usize>(case: Case, grid: Grid<D>) -> Outcome<Kernel> {
    let (_, shape) = phase_fields(grid)?;
    let state = displacement::<f64, D>(&grid);
    let rule = mismatch(grid);
    let background = Background {
        mass: 1e-4,
        stiffness: 1e-4,
        load: 1e-4,
    };
    // Displacement and phase field in; half of the 3^D couplings and the right-hand side out.
    let couplings = 3usize.pow(D as u32).div_ceil(2);
    let kernel = case.kernel(grid, "points", (D + 2 + couplings) as f64, None);
    let run = move || {
        let coefficients = [shape.as_slice()];
        let source = Source {
            displacement: &state,
            coefficients: &coefficients,
            weight: 1.0,
        };
        black_box(normal_equations(
            &grid,
            &rule,
            black_box(&[source]),
            background,
        ));
    };
    Ok(Kernel {
        run: Box::new(run),
        ..kernel
    })
}

fn spectral<const D: usize>(case: Case, grid: Grid<D>, boundary: Boundary) -> Outcome<Kernel> {
    let solver = SpectralSolver::new(grid, 1.0, 0.1, boundary)?;
    let rhs = displacement::<f64, D>(&grid)[..grid.n_nodes()].to_vec();
    let mut out = rhs.clone();
    Ok(Kernel {
        run: Box::new(move || solver.solve_into(black_box(&rhs), &mut out)),
        ..case.kernel(grid, "DoF", 2.0, None)
    })
}

/// The functional of an average; of one shape if only its metric is measured.
fn functional<const D: usize>(case: Case, grid: Grid<D>) -> Outcome<Kernel> {
    let n_shapes = if case.work == Work::Functional { 2 } else { 1 };
    let params = AverageParams::default();
    let distances: Vec<ScalarField<f64, D>> = (0..n_shapes)
        .map(|i| ScalarField::from_fn(grid, |x| [0.25 + 0.05 * i as f64 - away(x)]))
        .collect();
    let shapes = LevelShapes::new(grid, &distances, &params)?;
    let average = shapes.phase_fields[0].as_slice().to_vec();
    let mut objective = AverageObjective::new(shapes, &params, average)?;
    let state = displacement::<f64, D>(&grid).repeat(n_shapes);
    let mut out = vec![0.0; state.len()];
    let kernel = case.kernel(grid, "DoF", (2 * D) as f64, None);
    objective.update_metric(&state)?;
    objective.value_and_gradient(&state, &mut out)?;
    let gradient = out.clone();
    let work = case.work;
    let run = move || match work {
        Work::MetricBuild => drop(black_box(objective.update_metric(black_box(&state)))),
        Work::MetricCycle => {
            drop(black_box(
                objective.apply_inverse_metric(black_box(&gradient), &mut out),
            ));
        }
        _ => drop(black_box(
            objective.value_and_gradient(black_box(&state), &mut out),
        )),
    };
    Ok(Kernel {
        units: kernel.units * n_shapes as f64 * D as f64,
        bytes: kernel.bytes * n_shapes as f64,
        run: Box::new(run),
        ..kernel
    })
}

/// The anchor's state, `.05 sin(2 pi x + c) cos(2 pi y + 2 c) sin(3.1 z + .3)` in component `c`;
/// the last factor in 3D only. It does not fold.
fn displacement<T: Element, const D: usize>(grid: &Grid<D>) -> Vec<T> {
    let n = grid.n_nodes();
    let wave = |i: usize| {
        let (x, c) = (grid.position(grid.node(i % n)), (i / n) as f64);
        let flat = 0.05 * (TAU * x[0] + c).sin() * (TAU * x[1] + 2.0 * c).cos();
        let depth = x.get(2).map_or(1.0, |z| (3.1 * z + 0.3).sin());
        T::from_f64(flat * depth)
    };
    (0..D * n).map(wave).collect()
}

/// Distance from the middle of the box.
fn away<const D: usize>(x: [f64; D]) -> f64 {
    x.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt()
}

/// A function of the signed distance to a disk or ball of radius .3, moved along the first axis.
fn disk<T: Element, const D: usize>(grid: Grid<D>, moved: f64, f: impl Fn(f64) -> f64) -> Vec<T> {
    let value = |mut x: [f64; D]| {
        x[0] -= moved;
        [f(0.3 - away(x))]
    };
    Field::<T, D, 1>::from_fn(grid, value).into_vec()
}

/// Phase fields of a disk or ball and of a moved one.
fn phase_fields<const D: usize>(grid: Grid<D>) -> Outcome<(Vec<f64>, Vec<f64>)> {
    let profile = Profile::new(2.0 * grid.spacing())?;
    let field = |moved| disk(grid, moved, |distance| profile.value(distance));
    Ok((field(0.0), field(0.02)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_is_read_as_it_is_written() {
        for (name, work) in NAMES {
            let case = Case {
                work,
                dimension: 3,
                real: Real::F32,
                nodes: 17,
            };
            let text = format!("{name}/3d/f32/17");
            assert_eq!(case.to_string(), text);
            assert_eq!(text.parse(), Ok(case));
        }
        for bad in [
            "",
            "elastic_value/3d/f64",
            "nothing/2d/f64/9",
            "matching/4d/f64/9",
        ] {
            assert!(bad.parse::<Case>().is_err(), "{bad}");
        }
    }

    #[test]
    fn every_kernel_runs_on_a_small_grid() {
        for (_, work) in NAMES {
            for dimension in [2, 3] {
                let case = Case {
                    work,
                    dimension,
                    real: Real::F64,
                    nodes: 9,
                };
                let mut kernel = case.prepare().unwrap();
                (kernel.run)();
                assert!(kernel.units > 0.0 && kernel.bytes > 0.0);
            }
        }
    }

    #[test]
    fn the_state_of_the_kernels_does_not_fold() {
        let grid = Grid::<3>::cube(33);
        assert!(certify(&grid, &displacement::<f64, 3>(&grid), 0.0).certified);
        let grid = Grid::<2>::cube(129);
        assert!(certify(&grid, &displacement::<f64, 2>(&grid), 0.0).certified);
    }
}
