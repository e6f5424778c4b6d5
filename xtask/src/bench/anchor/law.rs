//! The arithmetic of the anchor's elastic kernel as a law for our engine.

use fe_grid::{CellLaw, Jet, Lane, Point, Reads, tensor};

/// `W(A) = mu/2 (|A|^2 - d) - mu ln J + lambda/2 (ln J)^2`, `A = 1 + Du`, `J = det A`, with
/// `mu = 1`, `lambda = 2` and no weight: the energy that `hyper_EG` of the anchor evaluates, by
/// the same plain formulas (`|A|^2 - d`, cofactors, the logarithm of `J`).
///
/// Our laws need more operations per point: they avoid cancellation for small strains, and are
/// weighted.
#[derive(Clone, Copy, Debug)]
pub struct AnchorLaw;

const MU: f64 = 1.0;
const LAMBDA: f64 = 2.0;

impl Reads for AnchorLaw {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for AnchorLaw {
    #[inline(always)]
    fn value<L: Lane>(&self, p: &Point<L, D, D>) -> L {
        let a = tensor::add_identity(&p.gradient);
        density(
            tensor::contract(&a, &a),
            tensor::determinant(&a).ln(),
            D as f64,
        )
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, p: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let a = tensor::add_identity(&p.gradient);
        let cofactor = tensor::cofactor(&a);
        let det = tensor::determinant_with(&a, &cofactor);
        let logarithm = det.ln();
        let slope = logarithm.mul_add(L::splat(LAMBDA), L::splat(-MU)) / det;
        // mu is one, a constant that the compiler also knows in the anchor's call.
        let stress = tensor::add_scaled(&a, slope, &cofactor);
        let jet = Jet {
            value: [L::zero(); D],
            gradient: stress,
        };
        (density(tensor::contract(&a, &a), logarithm, D as f64), jet)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, p: &Point<L, D, D>, d: &Jet<L, D, D>) -> Jet<L, D, D> {
        let a = tensor::add_identity(&p.gradient);
        let cofactor = tensor::cofactor(&a);
        let inverse = L::one() / tensor::determinant_with(&a, &cofactor);
        let det = L::one() / inverse;
        let slope = det.ln().mul_add(L::splat(LAMBDA), L::splat(-MU)) * inverse;
        // d/dJ of (lambda ln J - mu) / J.
        let curvature = L::splat(LAMBDA).mul_add(inverse, -slope) * inverse;
        let along = curvature * tensor::contract(&cofactor, &d.gradient);
        let turned = tensor::cofactor_derivative(&a, &d.gradient);
        let change = tensor::add_scaled(&d.gradient, slope, &turned);
        Jet {
            value: [L::zero(); D],
            gradient: tensor::add_scaled(&change, along, &cofactor),
        }
    }
}

#[inline(always)]
fn density<L: Lane>(square: L, logarithm: L, dimension: f64) -> L {
    let volume = logarithm.mul_add(L::splat(0.5 * LAMBDA), L::splat(-MU)) * logarithm;
    (square - L::splat(dimension)).mul_add(L::splat(0.5 * MU), volume)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::engine::{MAX_CELL_DATA, MAX_COEFFICIENTS};

    fn point(h: [[f64; 3]; 3]) -> Point<f64, 3, 3> {
        Point {
            position: [0.0; 3],
            value: [0.0; 3],
            gradient: h,
            coefficient: [0.0; MAX_COEFFICIENTS],
            cell: [0.0; MAX_CELL_DATA],
        }
    }

    #[test]
    fn the_law_is_its_formula_and_its_derivatives_are_those_of_it() {
        let h = [[0.1, -0.2, 0.05], [0.0, 0.15, 0.1], [-0.1, 0.02, -0.12]];
        let b = [[0.3, 0.1, -0.2], [0.4, -0.5, 0.2], [0.1, 0.7, -0.3]];
        let at = |t: f64| {
            let moved = std::array::from_fn(|i| std::array::from_fn(|k| h[i][k] + t * b[i][k]));
            point(moved)
        };
        let a = tensor::add_identity(&h);
        let j = tensor::determinant(&a);
        let expected = 0.5 * (tensor::contract(&a, &a) - 3.0) - j.ln() + j.ln().powi(2);
        let (value, jet) = AnchorLaw.gradient(&at(0.0));
        // The lane's logarithm is accurate to about one unit in the last place.
        assert!((value - expected).abs() < 1e-14);
        assert!((AnchorLaw.value(&at(0.0)) - value).abs() < 1e-14);
        // Central differences with step 1e-5: an error of the order of 1e-10.
        let t = 1e-5;
        let slope = (AnchorLaw.value(&at(t)) - AnchorLaw.value(&at(-t))) / (2.0 * t);
        assert!((slope - tensor::contract(&jet.gradient, &b)).abs() < 1e-8);
        let direction = Jet {
            value: [0.0; 3],
            gradient: b,
        };
        let change = AnchorLaw.hessian_action(&at(0.0), &direction);
        let (high, low) = (AnchorLaw.gradient(&at(t)).1, AnchorLaw.gradient(&at(-t)).1);
        for i in 0..3 {
            for k in 0..3 {
                let difference = (high.gradient[i][k] - low.gradient[i][k]) / (2.0 * t);
                assert!((difference - change.gradient[i][k]).abs() < 1e-7);
            }
        }
    }
}
