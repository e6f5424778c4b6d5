//! The `L^2` product on an object.

use fe_grid::{Assembly, CellLaw, Data, Jet, Lane, Point, Reads, ScalarField};

/// `chi/2 |u|^2`, whose Hessian is the mass matrix of the object.
#[derive(Clone, Copy, Debug)]
struct ObjectMass;

impl Reads for ObjectMass {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for ObjectMass {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.gradient(point).0
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let mut jet = Jet::zero();
        let mut square = L::zero();
        for k in 0..D {
            jet.value[k] = point.coefficient[0] * point.value[k];
            square = jet.value[k].mul_add(point.value[k], square);
        }
        (square.scale(0.5), jet)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = point.coefficient[0] * direction.value[k];
        }
        jet
    }
}

/// Computes `M_O u`, such that `v . M_O u = int chi u . v` for the indicator `chi` of an object.
///
/// # Panics
/// If the displacement does not fit the grid.
pub fn object_product<const D: usize>(object: &ScalarField<f64, D>, u: &[f64]) -> Vec<f64> {
    let coefficients = [object.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let assembly = Assembly::<_, f64, D, D>::new(*object.grid(), &ObjectMass, data);
    let mut out = vec![0.0; u.len()];
    assembly.hessian_action_into(u, u, &mut out);
    out
}
