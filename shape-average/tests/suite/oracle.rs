//! Energies, gradients and the equation for the average against reference values that were made
//! by automatic differentiation.
//!
//! The reference stores deformed positions `Phi`; here unknowns are displacements
//! `u = Phi - id`, by which the derivatives are the same.

use fe_grid::composition::{Interpolant, Matching};
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::scatter::{Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::stencil::SymmetricStencil;
use fe_grid::vector::{max_abs, max_abs_difference};
use fe_grid::{
    Assembly, CgParams, CgScratch, CgStatus, Data, Diagonal, Field, Grid, LinearOperator,
    conjugate_gradient,
};
use hyperelastic::{
    LameModuli, LawSpec, PowerCoefficients, PowerExponents, PowerOptions, WeightedElasticity,
};
use phasefield::{InterfaceLength, Mismatch};
use serde_json::{Value, json};
use shape_average::{AverageObjective, AverageParams, LevelShapes};
use test_support::{flat, number, oracle};

/// What the reference files grant, in the maximum norm of each array.
const RELATIVE: f64 = 1e-10;
/// The same for a solved system, whose condition number multiplies the rounding.
const RELATIVE_SOLUTION: f64 = 1e-9;

#[track_caller]
fn close(what: &str, found: f64, expected: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= RELATIVE, "{what}: {found}, not {expected}");
}

#[track_caller]
fn close_to(what: &str, found: &[f64], expected: &Value, relative: f64) {
    let expected = flat(expected);
    let error = max_abs_difference(found, &expected) / max_abs(&expected);
    assert!(error <= relative, "{what}: relative error {error:e}");
}

/// One case of a file, on its grid.
struct Case<'a, const D: usize> {
    grid: Grid<D>,
    case: &'a Value,
}

impl<const D: usize> Case<'_, D> {
    fn input(&self, key: &str) -> Vec<f64> {
        flat(&self.case["inputs"][key])
    }

    fn parameter(&self, key: &str) -> f64 {
        number(&self.case["inputs"], key)
    }

    /// Displacements of all deformations, one after the other.
    fn displacements(&self) -> Vec<f64> {
        let identity = Field::<f64, D, D>::identity(self.grid);
        let mut displacements = self.input("phi");
        for displacement in displacements.chunks_exact_mut(identity.as_slice().len()) {
            for (u, x) in displacement.iter_mut().zip(identity.as_slice()) {
                *u -= x;
            }
        }
        displacements
    }

    fn elastic(&self) {
        assert!(self.case["model"]["name"].is_string(), "no law");
        let law = self.law().compile::<D>().unwrap();
        let weighted = WeightedElasticity {
            law: &law,
            void_stiffness: self.parameter("delta"),
        };
        let indicator = self.input("chi");
        let coefficients = [indicator.as_slice()];
        let assembly = Assembly::new(self.grid, &weighted, data(&coefficients));
        let displacement = self.displacements();
        let mut out = vec![0.0; displacement.len()];
        let value = assembly.value_and_gradient_into(&displacement, &mut out);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_phi", &out, &self.case["grad_phi"], RELATIVE);
        assembly.hessian_action_into(&displacement, &self.input("psi"), &mut out);
        close_to("hess_psi", &out, &self.case["hess_psi"], RELATIVE);
    }

    fn mismatch(&self) {
        let density = Mismatch {
            interface_width: self.parameter("eps"),
            scale: 1.0,
        };
        let (average, phase_field) = (self.input("V"), self.input("vi"));
        let law = Matching::new(density, Interpolant::new(self.grid, &average));
        let coefficients = [phase_field.as_slice()];
        let displacement = self.displacements();
        let mut gradient = vec![0.0; displacement.len()];
        let value = Assembly::new(self.grid, &law, data(&coefficients))
            .value_and_gradient_into(&displacement, &mut gradient);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_phi", &gradient, &self.case["grad_phi"], RELATIVE);
        let source = Source {
            displacement: &displacement,
            coefficients: &coefficients,
            weight: 1.0,
        };
        let equations = normal_equations(&self.grid, &density, &[source], Background::default());
        let slope = quadratic_slope(&equations, &average);
        close_to("grad_V", &slope, &self.case["grad_V"], RELATIVE);
    }

    fn length(&self) {
        let law = InterfaceLength {
            interface_width: self.parameter("eps"),
        };
        let mut gradient = vec![0.0; self.grid.n_nodes()];
        let assembly = Assembly::<_, f64, D, 1>::new(self.grid, &law, Data::default());
        let value = assembly.value_and_gradient_into(&self.input("V"), &mut gradient);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_V", &gradient, &self.case["grad_V"], RELATIVE);
    }

    /// A field of every shape.
    fn per_shape(&self, key: &str) -> Vec<Field<f64, D, 1>> {
        self.input(key)
            .chunks_exact(self.grid.n_nodes())
            .map(|values| Field::from_vec(self.grid, values.to_vec()).unwrap())
            .collect()
    }

    /// The equation for the average, with the factors of the functional.
    fn equations(&self, displacements: &[f64]) -> (SymmetricStencil<D>, Vec<f64>) {
        let phase_fields = self.per_shape("vi");
        let width = self.parameter("eps");
        let rule = Mismatch {
            interface_width: width,
            scale: self.parameter("gamma") / phase_fields.len() as f64,
        };
        let potential = self.parameter("mu") / (4.0 * width);
        let background = Background {
            mass: potential,
            stiffness: self.parameter("mu") * width,
            load: potential,
        };
        let coefficients: Vec<_> = phase_fields.iter().map(|v| [v.as_slice()]).collect();
        let sources: Vec<_> = displacements
            .chunks_exact(D * self.grid.n_nodes())
            .zip(&coefficients)
            .map(|(displacement, coefficients)| Source {
                displacement,
                coefficients,
                weight: 1.0,
            })
            .collect();
        normal_equations(&self.grid, &rule, &sources, background)
    }

    /// The material of the case; one that states none has no elastic energy to compare.
    fn law(&self) -> LawSpec {
        let model = &self.case["model"];
        match model["name"].as_str() {
            None => LawSpec::default(),
            Some("logdet") => LawSpec::new("logdet", moduli(&model["params"])).unwrap(),
            Some("inverse") => {
                let base = &model["params"]["base"];
                assert_eq!(base["name"], "logdet");
                LawSpec::new("inverse:logdet", moduli(&base["params"])).unwrap()
            }
            Some("power") => power::<D>(&model["params"]),
            Some(other) => panic!("no law {other:?}"),
        }
    }

    /// The functional itself, of the reference's parameters.
    fn objective(
        &self,
        indicators: Vec<Field<f64, D, 1>>,
        void_stiffness: f64,
        average: Vec<f64>,
    ) -> AverageObjective<D> {
        let params = AverageParams {
            law: self.law(),
            mismatch_weight: self.parameter("gamma"),
            length_weight: Some(self.parameter("mu")),
            void_stiffness,
            ..AverageParams::default()
        };
        let phase_fields = self.per_shape("vi");
        let width = self.parameter("eps");
        let shapes = LevelShapes::from_fields(self.grid, width, phase_fields, indicators);
        AverageObjective::new(shapes, &params, average).unwrap()
    }

    fn average_total(&self) {
        let displacements = self.displacements();
        let average = self.input("V");
        let objective = self.objective(
            self.per_shape("chi"),
            self.parameter("delta"),
            average.clone(),
        );
        let mut gradient = vec![0.0; displacements.len()];
        let energy = objective.at_present_average(&displacements, &mut gradient);
        let energy = energy.unwrap().expect("an admissible state");
        close("value", energy.total, number(self.case, "value"));
        close_to("grad_phi", &gradient, &self.case["grad_phi"], RELATIVE);
        let slope = quadratic_slope(&self.equations(&displacements), &average);
        close_to("grad_V", &slope, &self.case["grad_V"], RELATIVE);
    }

    fn average_equation(&self) {
        let displacements = self.displacements();
        let (matrix, rhs) = self.equations(&displacements);
        let case = self.case;
        close_to(
            "sums",
            &matrix.row_sums(),
            &case["matrix_row_sums"],
            RELATIVE,
        );
        close_to("rhs", &rhs, &case["rhs"], RELATIVE);
        // Solved down to rounding here ...
        let jacobi = Diagonal::jacobi(&matrix.diagonal()).unwrap();
        let params = CgParams {
            relative_tolerance: 1e-14,
            ..CgParams::default()
        };
        let mut solution = vec![0.0; rhs.len()];
        let mut scratch = CgScratch::default();
        let info = conjugate_gradient(&matrix, &jacobi, &rhs, &mut solution, &params, &mut scratch);
        assert_eq!(info.unwrap().status, CgStatus::Converged);
        close_to("V", &solution, &case["V_solution"], RELATIVE_SOLUTION);
        // ... and in the functional to the accuracy that it needs: an error of the average
        // enters the energy squared.
        let n = self.per_shape("vi").len();
        let ones = vec![Field::from_fn(self.grid, |_| [1.0]); n];
        let start = vec![1.0; rhs.len()];
        let mut objective = self.objective(ones, 1.0, start);
        let evaluation = objective.value(&displacements).unwrap();
        assert!(matches!(evaluation, Evaluation::Value(_)));
        let energy = objective.energy();
        let mismatch: f64 = energy.mismatch.iter().sum();
        let value =
            self.parameter("gamma") / n as f64 * mismatch + self.parameter("mu") * energy.length;
        close("value", value, number(case, "value_at_solution"));
        close_to("V", objective.average(), &case["V_solution"], 1e-6);
    }

    /// Whether this is a case that belongs here.
    fn check(&self) -> bool {
        match self.case["kind"].as_str() {
            Some("hyperelastic") => self.elastic(),
            Some("mismatch_F") => self.mismatch(),
            Some("length_L") => self.length(),
            Some("average_total") => self.average_total(),
            Some("V_system") => self.average_equation(),
            _ => return false,
        }
        true
    }
}

fn data<'a>(coefficients: &'a [&'a [f64]]) -> Data<'a, f64> {
    Data {
        coefficients,
        cells: &[],
    }
}

/// `2 (A v - b)`, the derivative of `v . A v - 2 b . v`.
fn quadratic_slope<const D: usize>(
    (matrix, rhs): &(SymmetricStencil<D>, Vec<f64>),
    v: &[f64],
) -> Vec<f64> {
    let mut slope = vec![0.0; v.len()];
    matrix.apply_into(v, &mut slope);
    for (s, b) in slope.iter_mut().zip(rhs) {
        *s = 2.0 * (*s - b);
    }
    slope
}

fn moduli(params: &Value) -> LameModuli {
    LameModuli::new(number(params, "lambda"), number(params, "mu")).unwrap()
}

fn power<const D: usize>(params: &Value) -> LawSpec {
    let coefficients = PowerCoefficients {
        norm: number(params, "a1"),
        cofactor: number(params, "a2"),
        compression: number(params, "a3"),
    };
    let exponents = PowerExponents {
        norm: number(params, "p"),
        cofactor: number(params, "q"),
        expansion: number(params, "r"),
        compression: number(params, "s"),
    };
    let options = PowerOptions {
        exponents: Some(exponents),
        coefficients: Some(coefficients),
        ..PowerOptions::default()
    };
    let spec = LawSpec {
        law: "power_two_term".parse().unwrap(),
        power: options,
        ..LawSpec::default()
    };
    spec.resolved::<D>().unwrap()
}

fn check_file<const D: usize>(name: &str) {
    let Some(file) = oracle(name) else { return };
    let grid = Grid::<D>::cube(file["n"].as_u64().unwrap() as usize);
    let cases = file["cases"].as_array().unwrap();
    let checked: Vec<&Value> = cases
        .iter()
        .filter(|case| Case { grid, case }.check())
        .collect();
    for kind in [
        "hyperelastic",
        "mismatch_F",
        "length_L",
        "average_total",
        "V_system",
    ] {
        assert!(checked.iter().any(|case| case["kind"] == kind), "{kind}");
    }
}

#[test]
fn oracle_energies_in_2d() {
    check_file::<2>("grid2d_n5.json");
}

#[test]
fn oracle_energies_in_3d() {
    check_file::<3>("grid3d_n5.json");
}

/// Affine deformations, constant fields, three shapes, and moduli other than one, in the format of the
/// reference files: everything is the volume of the box times a density.
fn check_homogeneous<const D: usize>(name: &str, stored_energy: fn([f64; 2], f64, f64) -> f64) {
    let grid = Grid::<D>::cube(5);
    let (lambda, mu) = (2.3, 0.7);
    let (eps, gamma, weight, delta) = (0.2, 0.6, 0.03, 1e-4);
    let (chi, average) = (0.4, 0.7);
    let stretches = [0.9, 1.05, 1.2];
    let fields = [0.2, 0.6, 0.8];
    let n = grid.n_nodes();
    // Stretched about the middle: some points leave the box, where a constant goes on constantly.
    let phi =
        stretches.map(|s| Field::<f64, D, D>::from_fn(grid, |x| x.map(|x| 0.5 + s * (x - 0.5))));
    let model = if name == "logdet" {
        json!({"name": name, "params": {"lambda": lambda, "mu": mu}})
    } else {
        let base = json!({"name": "logdet", "params": {"lambda": lambda, "mu": mu}});
        json!({"name": name, "params": {"base": base}})
    };
    let case = json!({
        "model": model,
        "inputs": {
            "phi": phi.map(Field::into_vec),
            "vi": fields.map(|v| vec![v; n]),
            "eps": eps, "gamma": gamma, "mu": weight,
        },
    });
    let case = Case::<D> { grid, case: &case };
    let indicators = vec![Field::from_fn(grid, |_| [chi]); 3];
    let objective = case.objective(indicators, delta, vec![average; n]);
    let energy = objective.at_present_average(&case.displacements(), &mut []);
    let found = energy.unwrap().expect("an admissible state").total;
    let d = D as f64;
    let kappa = (1.0 - delta) * chi + delta;
    let mut expected = weight * (average - 1.0) * (average - 1.0) / (4.0 * eps);
    for (s, v) in stretches.into_iter().zip(fields) {
        let missing = average * (1.0 - v);
        let surplus = v * (1.0 - average);
        let mismatch = (missing * missing + surplus * surplus) / eps;
        expected += (kappa * stored_energy([lambda, mu], s, d) + gamma * mismatch) / 3.0;
    }
    close("value", found, expected);
}

/// `mu/2 |A|^2 + lambda/4 D^2 - (mu + lambda/2) log D - d mu/2 - lambda/4` at `A = s 1`.
fn logdet([lambda, mu]: [f64; 2], s: f64, d: f64) -> f64 {
    let det = s.powf(d);
    0.5 * mu * d * (s * s - 1.0) + 0.25 * lambda * (det * det - 1.0)
        - (mu + 0.5 * lambda) * det.ln()
}

#[test]
fn cases_of_other_moduli_and_numbers_of_shapes_are_read() {
    check_homogeneous::<2>("logdet", logdet);
    check_homogeneous::<3>("logdet", logdet);
    // `det A W(A^-1)`.
    let inverse = |moduli, s: f64, d: f64| s.powf(d) * logdet(moduli, 1.0 / s, d);
    check_homogeneous::<2>("inverse", inverse);
}
