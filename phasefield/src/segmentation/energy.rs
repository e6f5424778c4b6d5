//! The density of the energy, for the pair `(u, v)` of an image and a phase field.

use super::params::Weights;
use fe_grid::{
    Assembly, CellLaw, Data, Grid, GridError, Jet, Lane, Point, Reads, compiled_once, mutant,
};
use serde::Serialize;

/// The density `alpha (u - u0)^2 + beta (v^2 + k) |grad u|^2 + nu (eps |grad v|^2 + (v - 1)^2 /
/// (4 eps))`, with coefficient 0 the image `u0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbrosioTortorelli {
    /// `alpha`, `beta` and `nu`.
    pub weights: Weights,
    /// Interface width `eps`.
    pub interface_width: f64,
    /// Conductance of an edge, `k_eps >= 0`.
    pub edge_conductance: f64,
}

/// The terms of the energy, including their weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SegmentationEnergy {
    /// Sum of the terms.
    pub total: f64,
    /// `alpha int (u - u0)^2`.
    pub fidelity: f64,
    /// `beta int (v^2 + k_eps) |grad u|^2`.
    pub smoothness: f64,
    /// `nu int eps |grad v|^2 + (v - 1)^2 / (4 eps)`.
    pub edges: f64,
}

impl AmbrosioTortorelli {
    /// Computes the terms of the energy of a state, `u` first and then `v`, for an image on a grid.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] if a value is not finite.
    ///
    /// # Panics
    /// If the state or the image does not fit the grid.
    pub fn terms<const D: usize>(
        &self,
        grid: &Grid<D>,
        image: &[f64],
        state: &[f64],
    ) -> Result<SegmentationEnergy, GridError> {
        terms(self, grid, image, state)
    }

    fn terms_in<const D: usize>(
        &self,
        grid: &Grid<D>,
        image: &[f64],
        state: &[f64],
    ) -> Result<SegmentationEnergy, GridError> {
        let coefficients = [image];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let of = |weights: Weights| {
            let law = Self { weights, ..*self };
            Assembly::<_, f64, D, 2>::new(*grid, &law, data).value(state)
        };
        let nothing = Weights {
            fidelity: 0.0,
            smoothness: 0.0,
            edges: 0.0,
        };
        let Weights {
            fidelity,
            smoothness,
            edges,
        } = self.weights;
        let fidelity = of(Weights {
            fidelity,
            ..nothing
        })?;
        let smoothness = of(Weights {
            smoothness,
            ..nothing
        })?;
        let edges = of(Weights { edges, ..nothing })?;
        Ok(SegmentationEnergy {
            total: fidelity + smoothness + edges,
            fidelity,
            smoothness,
            edges,
        })
    }
}

compiled_once! {
    fn terms<'a, D>(
        law: &'a AmbrosioTortorelli,
        grid: &'a Grid<D>,
        image: &'a [f64],
        state: &'a [f64],
    ) -> Result<SegmentationEnergy, GridError> = AmbrosioTortorelli::terms_in;
}

impl Reads for AmbrosioTortorelli {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl AmbrosioTortorelli {
    /// `v^2 + k`.
    #[inline(always)]
    fn conductance<L: Lane>(&self, v: L) -> L {
        let of_edge = mutant!(self.edge_conductance, ConductanceMissing => 0.0);
        v.mul_add(v, L::splat(of_edge))
    }
}

#[inline(always)]
fn product<L: Lane, const D: usize>(a: &[L; D], b: &[L; D]) -> L {
    let mut sum = a[0] * b[0];
    for k in 1..D {
        sum = a[k].mul_add(b[k], sum);
    }
    sum
}

impl<const D: usize> CellLaw<D, 2> for AmbrosioTortorelli {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, 2>) -> L {
        self.gradient(point).0
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, 2>) -> (L, Jet<L, D, 2>) {
        let Weights {
            fidelity,
            smoothness,
            edges,
        } = self.weights;
        let edges = mutant!(edges, EdgesHalved => 0.5 * edges);
        let (width, [u, v]) = (self.interface_width, point.value);
        let [slope, edge] = point.gradient;
        let (residual, excess) = (u - point.coefficient[0], v - L::one());
        let conductance = self.conductance(v);
        let (steepness, sharpness) = (product(&slope, &slope), product(&edge, &edge));
        let mut flux = Jet::zero();
        flux.value[0] = residual.scale(2.0 * fidelity);
        flux.value[1] = (v * steepness).scale(2.0 * smoothness) + excess.scale(0.5 * edges / width);
        for k in 0..D {
            flux.gradient[0][k] = (conductance * slope[k]).scale(2.0 * smoothness);
            flux.gradient[1][k] = edge[k].scale(2.0 * edges * width);
        }
        let value = (residual * residual).scale(fidelity)
            + (conductance * steepness).scale(smoothness)
            + sharpness.scale(edges * width)
            + (excess * excess).scale(0.25 * edges / width);
        (value, flux)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, 2>,
        direction: &Jet<L, D, 2>,
    ) -> Jet<L, D, 2> {
        let Weights {
            fidelity,
            smoothness,
            edges,
        } = self.weights;
        let edges = mutant!(edges, EdgesHalved => 0.5 * edges);
        let (width, v, slope) = (self.interface_width, point.value[1], point.gradient[0]);
        let ([du, dv], [dslope, dedge]) = (direction.value, direction.gradient);
        let conductance = self.conductance(v);
        let cross = v.scale(2.0);
        let steepness = product(&slope, &slope);
        let along = product(&slope, &dslope);
        let mut flux = Jet::zero();
        flux.value[0] = du.scale(2.0 * fidelity);
        flux.value[1] = steepness.mul_add(dv, cross * along).scale(2.0 * smoothness)
            + dv.scale(0.5 * edges / width);
        for k in 0..D {
            flux.gradient[0][k] = conductance
                .mul_add(dslope[k], cross * dv * slope[k])
                .scale(2.0 * smoothness);
            flux.gradient[1][k] = dedge[k].scale(2.0 * edges * width);
        }
        flux
    }
}
