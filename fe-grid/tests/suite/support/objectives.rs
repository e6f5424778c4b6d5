//! Small problems for the minimisers.

use std::convert::Infallible;

use fe_grid::minimise::{Evaluation, Objective, SecondOrder};
use fe_grid::vector;

/// `1/2 Σ a_j (x_j - c_j)^2`, with the identity or the exact inverse as metric.
pub struct Quadratic {
    pub curvatures: Vec<f64>,
    pub minimum: Vec<f64>,
    pub exact_metric: bool,
}

impl Objective for Quadratic {
    type Error = Infallible;

    fn dim(&self) -> usize {
        self.curvatures.len()
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        for j in 0..x.len() {
            g[j] = self.curvatures[j] * (x[j] - self.minimum[j]);
        }
        let mut offset = vec![0.0; x.len()];
        vector::subtract_into(x, &self.minimum, &mut offset);
        Ok(Evaluation::Value(0.5 * vector::dot(g, &offset)))
    }

    fn apply_inverse_metric(&mut self, g: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for j in 0..g.len() {
            out[j] = if self.exact_metric {
                g[j] / self.curvatures[j]
            } else {
                g[j]
            };
        }
        Ok(())
    }
}

impl SecondOrder for Quadratic {
    fn hessian_action(&mut self, _: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        vector::multiply_into(&self.curvatures, d, out);
        Ok(())
    }
}

/// `Σ 100 (x_{2j+1} - x_{2j}^2)^2 + (1 - x_{2j})^2`, minimum 0 at ones, indefinite far away.
pub struct Rosenbrock {
    pub dim: usize,
}

impl Objective for Rosenbrock {
    type Error = Infallible;

    fn dim(&self) -> usize {
        self.dim
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        let mut value = 0.0;
        for (x, g) in x.chunks(2).zip(g.chunks_mut(2)) {
            let (valley, along) = (x[1] - x[0] * x[0], 1.0 - x[0]);
            value += 100.0 * valley * valley + along * along;
            g[0] = -400.0 * valley * x[0] - 2.0 * along;
            g[1] = 200.0 * valley;
        }
        Ok(Evaluation::Value(value))
    }
}

impl SecondOrder for Rosenbrock {
    fn hessian_action(&mut self, x: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for ((x, d), out) in x.chunks(2).zip(d.chunks(2)).zip(out.chunks_mut(2)) {
            let diagonal = 1200.0 * x[0] * x[0] - 400.0 * x[1] + 2.0;
            out[0] = diagonal * d[0] - 400.0 * x[0] * d[1];
            out[1] = -400.0 * x[0] * d[0] + 200.0 * d[1];
        }
        Ok(())
    }
}

/// `Σ (x_j^2 - 1)^2 / 4`, concave around 0.
pub struct DoubleWells {
    pub dim: usize,
}

impl Objective for DoubleWells {
    type Error = Infallible;

    fn dim(&self) -> usize {
        self.dim
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        let mut value = 0.0;
        for (x, g) in x.iter().zip(g) {
            let well = x * x - 1.0;
            value += 0.25 * well * well;
            *g = x * well;
        }
        Ok(Evaluation::Value(value))
    }
}

impl SecondOrder for DoubleWells {
    fn hessian_action(&mut self, x: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for j in 0..d.len() {
            out[j] = (3.0 * x[j] * x[j] - 1.0) * d[j];
        }
        Ok(())
    }
}

/// `Σ c_j x_j - w ln x_j`, finite for `x > 0` only, minimum at `w / c_j`; the metric is the
/// inverse Hessian at the state where it was made.
pub struct Barrier {
    pub slopes: Vec<f64>,
    pub weight: f64,
    pub metric: Vec<f64>,
    pub inadmissible_trials: usize,
}

impl Barrier {
    pub fn new(slopes: Vec<f64>, weight: f64) -> Self {
        let metric = vec![1.0; slopes.len()];
        Self {
            slopes,
            weight,
            metric,
            inadmissible_trials: 0,
        }
    }
}

impl Objective for Barrier {
    type Error = Infallible;

    fn dim(&self) -> usize {
        self.slopes.len()
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        if x.iter().any(|&x| x <= 0.0) {
            self.inadmissible_trials += 1;
            return Ok(Evaluation::Inadmissible);
        }
        let mut value = 0.0;
        for j in 0..x.len() {
            value += self.slopes[j] * x[j] - self.weight * x[j].ln();
            g[j] = self.slopes[j] - self.weight / x[j];
        }
        Ok(Evaluation::Value(value))
    }

    fn apply_inverse_metric(&mut self, g: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        vector::multiply_into(&self.metric, g, out);
        Ok(())
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), Infallible> {
        for (p, x) in self.metric.iter_mut().zip(x) {
            *p = x * x / self.weight;
        }
        Ok(())
    }
}

impl SecondOrder for Barrier {
    fn hessian_action(&mut self, x: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for j in 0..d.len() {
            out[j] = self.weight / (x[j] * x[j]) * d[j];
        }
        Ok(())
    }
}
