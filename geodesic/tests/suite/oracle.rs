//! Energies of both forms and their gradients against reference values that were made by
//! automatic differentiation.
//!
//! The reference stores deformed positions; here unknowns are displacements, by which the
//! derivatives are the same.

use fe_grid::composition::Interpolant;
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::scatter::{Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::vector::{max_abs, max_abs_difference};
use fe_grid::{Assembly, Data, Field, Grid};
use geodesic::lagrangian::PathObjective;
use geodesic::level_sets::LevelSetObjective;
use geodesic::{
    BoundaryArea, Form, GeodesicParams, HeavisideMismatch, MismatchWeights, ObjectWeights,
    StepDeformation, StepMismatch, Visibility,
};
use hyperelastic::{LameModuli, LawSpec, StrainEnergy};
use levelset::{Arctan, Step};
use serde_json::Value;
use test_support::oracle;

/// What the reference files grant, in the maximum norm of each array.
const RELATIVE: f64 = 1e-10;

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}"))
}

/// All numbers of nested lists, in order.
fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}

#[track_caller]
fn close(what: &str, found: f64, expected: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= RELATIVE, "{what}: {found}, not {expected}");
}

#[track_caller]
fn close_to(what: &str, found: &[f64], expected: &Value) {
    let expected = flat(expected);
    let error = max_abs_difference(found, &expected) / max_abs(&expected);
    assert!(error <= RELATIVE, "{what}: relative error {error:e}");
}

/// One case of a file on its grid, where `S = D + 1`.
struct Case<'a, const D: usize, const S: usize> {
    grid: Grid<D>,
    case: &'a Value,
}

impl<const D: usize, const S: usize> Case<'_, D, S> {
    fn input(&self, key: &str) -> Vec<f64> {
        flat(&self.case["inputs"][key])
    }

    fn parameter(&self, key: &str) -> f64 {
        number(&self.case["inputs"], key)
    }

    fn step(&self) -> Arctan {
        Arctan::new(self.parameter("eps")).unwrap()
    }

    fn moduli(&self) -> LameModuli {
        assert_eq!(self.case["model"]["name"], "logdet");
        let params = &self.case["model"]["params"];
        LameModuli::new(number(params, "lambda"), number(params, "mu")).unwrap()
    }

    /// Displacements of all deformations, one after the other.
    fn displacements(&self, key: &str) -> Vec<f64> {
        let identity = Field::<f64, D, D>::identity(self.grid);
        let mut displacements = self.input(key);
        for displacement in displacements.chunks_exact_mut(identity.as_slice().len()) {
            for (u, x) in displacement.iter_mut().zip(identity.as_slice()) {
                *u -= x;
            }
        }
        displacements
    }

    /// A level set and a displacement as one unknown.
    fn pair(&self, level_set: &str) -> Vec<f64> {
        [self.input(level_set), self.displacements("phi")].concat()
    }

    fn matching(&self) {
        let (n, target) = (self.grid.n_nodes(), self.input("u1"));
        let (step, other) = (self.step(), Interpolant::new(self.grid, &target));
        let law = StepMismatch {
            step,
            other,
            visibility: Visibility::default(),
        };
        let state = self.pair("u0");
        let mut gradient = vec![0.0; state.len()];
        let value = Assembly::<_, f64, D, S>::new(self.grid, &law, Data::default())
            .value_and_gradient_into(&state, &mut gradient);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_u0", &gradient[..n], &self.case["grad_u0"]);
        close_to("grad_phi", &gradient[n..], &self.case["grad_phi"]);
        let source = Source {
            displacement: &state[n..],
            coefficients: &[&state[..n]],
            weight: 1.0,
        };
        let rule = MismatchWeights {
            step,
            other,
            visibility: Visibility::default(),
        };
        let (_, load) = normal_equations(&self.grid, &rule, &[source], Background::default());
        close_to("grad_u1", &load, &self.case["grad_u1"]);
    }

    fn area(&self) {
        let law = BoundaryArea {
            step: self.step(),
            regularisation: self.parameter("rho"),
        };
        let mut gradient = vec![0.0; self.grid.n_nodes()];
        let value = Assembly::<_, f64, D, 1>::new(self.grid, &law, Data::default())
            .value_and_gradient_into(&self.input("u"), &mut gradient);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_u", &gradient, &self.case["grad_u"]);
    }

    fn deformation(&self) {
        let law = self.law().compile::<D>().unwrap();
        let law = StepDeformation {
            law: &law,
            weights: ObjectWeights {
                indicator: Step::Arctan(self.step()),
                void_stiffness: self.parameter("delta"),
                void_viscosity: 0.0,
            },
        };
        let law = StrainEnergy(law);
        let (n, state) = (self.grid.n_nodes(), self.pair("u0"));
        let mut gradient = vec![0.0; state.len()];
        let value = Assembly::<_, f64, D, S>::new(self.grid, &law, Data::default())
            .value_and_gradient_into(&state, &mut gradient);
        close("value", value.unwrap(), number(self.case, "value"));
        close_to("grad_u0", &gradient[..n], &self.case["grad_u0"]);
        close_to("grad_phi", &gradient[n..], &self.case["grad_phi"]);
    }

    fn law(&self) -> LawSpec {
        LawSpec::new("logdet", self.moduli()).unwrap()
    }

    /// Parameters for matches of a given number, whose weight the reference states for each.
    fn params(&self, form: Form) -> GeodesicParams {
        let steps = self.parameter("K") as usize;
        let matches = if form == Form::LevelSets { steps } else { 1 };
        GeodesicParams {
            form,
            steps,
            law: self.law(),
            mismatch_weight: self.parameter("eta") / matches as f64,
            void_stiffness: self.parameter("delta"),
            deformed_share: 0.0,
            void_viscosity: 0.0,
            ..GeodesicParams::default()
        }
    }

    fn level_sets(&self) {
        let n = self.grid.n_nodes();
        let params = GeodesicParams {
            area_weight: self.parameter("mu"),
            area_regularisation: self.parameter("rho"),
            ..self.params(Form::LevelSets)
        };
        let (level_sets, displacements) = (self.input("u"), self.displacements("phi"));
        let mut state = level_sets[..n].to_vec();
        let after = level_sets[n..].chunks_exact(n);
        for (displacement, level_set) in displacements.chunks_exact(D * n).zip(after) {
            state.extend_from_slice(displacement);
            state.extend_from_slice(level_set);
        }
        let (step, steps) = (self.step(), params.steps);
        let objective =
            LevelSetObjective::with_steps(self.grid, steps, &params, Step::Arctan(step), step);
        let mut objective = objective.unwrap().with_free_ends();
        let mut gradient = vec![0.0; state.len()];
        let found = objective.value_and_gradient(&state, &mut gradient).unwrap();
        let Evaluation::Value(value) = found else {
            panic!("an admissible state")
        };
        close("value", value, number(self.case, "value"));
        let energy = objective.energy();
        let parts = &self.case["parts"];
        close_to("deform", &energy.step_energies, &parts["deform"]);
        close_to("match", &energy.mismatches, &parts["match"]);
        close_to("area", &energy.areas, &parts["area"]);
        close("length", energy.length(), number(self.case, "length"));
        close(
            "dissipation",
            energy.dissipation(),
            number(self.case, "diss"),
        );
        let (mut by_level_sets, mut by_displacements) = (gradient[..n].to_vec(), Vec::new());
        for step in gradient[n..].chunks_exact(S * n) {
            by_displacements.extend_from_slice(&step[..D * n]);
            by_level_sets.extend_from_slice(&step[D * n..]);
        }
        close_to("grad_u", &by_level_sets, &self.case["grad_u"]);
        close_to("grad_phi", &by_displacements, &self.case["grad_phi"]);
    }

    fn start_domain(&self) {
        let params = self.params(Form::Lagrangian);
        let field = |key: &str| Field::from_vec(self.grid, self.input(key)).unwrap();
        let step = self.step();
        let mut objective = PathObjective::with_steps(
            field("uA"),
            field("uB"),
            params.steps,
            &params,
            Step::Arctan(step),
            HeavisideMismatch { step },
        )
        .unwrap();
        let state = self.displacements("psi");
        let mut gradient = vec![0.0; state.len()];
        let found = objective.value_and_gradient(&state, &mut gradient).unwrap();
        let Evaluation::Value(value) = found else {
            panic!("an admissible state")
        };
        close("value", value, number(self.case, "value"));
        let energy = objective.energy();
        close_to("W_k", &energy.step_energies, &self.case["W_k"]);
        close("match", energy.mismatches[0], number(self.case, "match"));
        close_to("grad_psi", &gradient, &self.case["grad_psi"]);
    }

    /// Whether this is a case that belongs here.
    fn check(&self) -> bool {
        match self.case["kind"].as_str() {
            Some("match_H") => self.matching(),
            Some("area_H") => self.area(),
            Some("deform_H") => self.deformation(),
            Some("geodesic_total") => self.level_sets(),
            Some("lagrangian_path") => self.start_domain(),
            _ => return false,
        }
        true
    }
}

fn check_file<const D: usize, const S: usize>(name: &str) {
    let Some(file) = oracle(name) else { return };
    let grid = Grid::<D>::cube(file["n"].as_u64().unwrap() as usize);
    let cases = file["cases"].as_array().unwrap();
    let checked = cases
        .iter()
        .filter(|case| Case::<D, S> { grid, case }.check());
    // Two areas, and one case of each of the four other kinds.
    assert_eq!(checked.count(), 6);
}

#[test]
fn oracle_energies_in_2d() {
    check_file::<2, 3>("grid2d_n5.json");
}

#[test]
fn oracle_energies_in_3d() {
    check_file::<3, 4>("grid3d_n5.json");
}
