//! A law that is compiled once, whatever calls it.

use crate::hypotheses::Hypotheses;
use crate::moduli::LameModuli;
use crate::stored_energy::StoredEnergy;
use fe_grid::engine::{BlockGradients, MAX_CORNERS, MAX_FACE_CORNERS, face_corner};
use fe_grid::routine::{CompiledRoutine, LaneRoutine, RoutineArguments};
use fe_grid::{Lane, Tensor};
use std::sync::Arc;

/// A stored energy density behind pointers, one for each of value, stress and tangent and for each
/// instruction set, which are followed once for a block of points.
///
/// Energies hold a `CompiledLaw` and are not generic over laws, so that a law is compiled where this
/// is made of it and nowhere else: in this crate for the laws that have a name
/// ([`crate::LawSpec::compile`]), in the crate that calls [`CompiledLaw::new`] for a law of its own.
/// It gives the bits that the law gives.
#[derive(Clone, Debug)]
pub struct CompiledLaw<const D: usize> {
    value: CompiledRoutine<ValueArguments<D>>,
    gradient: CompiledRoutine<GradientArguments<D>>,
    hessian_action: CompiledRoutine<HessianArguments<D>>,
    moduli: LameModuli,
    hypotheses: Hypotheses,
    name: &'static str,
}

/// Where a block of points keeps its displacement gradients: the entry of row `i` along axis `k` of
/// point `q` stands at `[i][k][places[q][k]]`.
pub type Places<const D: usize> = [[usize; D]];

/// The places of all points of a cell among the derivatives of a multilinear field.
pub(crate) const fn places_of_faces<const D: usize>() -> [[usize; D]; MAX_CORNERS] {
    let mut places = [[0; D]; MAX_CORNERS];
    let mut q = 0;
    while q < MAX_CORNERS {
        let mut k = 0;
        while k < D {
            places[q][k] = face_corner(q, k) % MAX_FACE_CORNERS;
            k += 1;
        }
        q += 1;
    }
    places
}

/// The places of points that have all their derivatives for themselves.
pub(crate) const fn places_of_points<const D: usize>() -> [[usize; D]; MAX_FACE_CORNERS] {
    let mut places = [[0; D]; MAX_FACE_CORNERS];
    let mut q = 0;
    while q < MAX_FACE_CORNERS {
        places[q] = [q; D];
        q += 1;
    }
    places
}

/// Displacement gradients in, energy densities out.
pub(crate) struct ValueCall<'a, L, const D: usize> {
    pub strains: &'a BlockGradients<L, D, D>,
    pub places: &'a Places<D>,
    pub values: &'a mut [L; MAX_CORNERS],
}

/// Displacement gradients and weights in, weighted energy densities out; weighted stresses are added.
pub(crate) struct GradientCall<'a, L, const D: usize> {
    pub strains: &'a BlockGradients<L, D, D>,
    pub places: &'a Places<D>,
    pub weights: &'a [L; MAX_CORNERS],
    pub values: &'a mut [L; MAX_CORNERS],
    pub stresses: &'a mut BlockGradients<L, D, D>,
}

/// Displacement gradients, directions and weights in; weighted tangents applied to the directions are
/// added.
pub(crate) struct HessianCall<'a, L, const D: usize> {
    pub strains: &'a BlockGradients<L, D, D>,
    pub directions: &'a BlockGradients<L, D, D>,
    pub places: &'a Places<D>,
    pub weights: &'a [L; MAX_CORNERS],
    pub stresses: &'a mut BlockGradients<L, D, D>,
}

struct ValueArguments<const D: usize>;
struct GradientArguments<const D: usize>;
struct HessianArguments<const D: usize>;

impl<const D: usize> RoutineArguments for ValueArguments<D> {
    type In<'a, L: Lane> = ValueCall<'a, L, D>;
}
impl<const D: usize> RoutineArguments for GradientArguments<D> {
    type In<'a, L: Lane> = GradientCall<'a, L, D>;
}
impl<const D: usize> RoutineArguments for HessianArguments<D> {
    type In<'a, L: Lane> = HessianCall<'a, L, D>;
}

/// The displacement gradient of a point.
#[inline(always)]
fn tensor_at<L: Lane, const D: usize>(
    block: &BlockGradients<L, D, D>,
    place: &[usize; D],
) -> Tensor<L, D> {
    let mut h = [[L::zero(); D]; D];
    for i in 0..D {
        for k in 0..D {
            h[i][k] = block[i][k][place[k] % MAX_FACE_CORNERS];
        }
    }
    h
}

/// Adds a stress to those of a point.
#[inline(always)]
fn add_at<L: Lane, const D: usize>(
    block: &mut BlockGradients<L, D, D>,
    place: &[usize; D],
    stress: &Tensor<L, D>,
) {
    for i in 0..D {
        for k in 0..D {
            block[i][k][place[k] % MAX_FACE_CORNERS] += stress[i][k];
        }
    }
}

/// A law as a routine over the points of a block.
struct Pointwise<W>(W);

impl<W: StoredEnergy<D>, const D: usize> LaneRoutine<ValueArguments<D>> for Pointwise<W> {
    #[inline(always)]
    fn run<L: Lane>(&self, call: &mut ValueCall<'_, L, D>) {
        for (place, value) in call.places.iter().zip(call.values.iter_mut()) {
            *value = self.0.value(&tensor_at(call.strains, place));
        }
    }
}

impl<W: StoredEnergy<D>, const D: usize> LaneRoutine<GradientArguments<D>> for Pointwise<W> {
    #[inline(always)]
    fn run<L: Lane>(&self, call: &mut GradientCall<'_, L, D>) {
        let results = call.weights.iter().zip(call.values.iter_mut());
        for (place, (&weight, value)) in call.places.iter().zip(results) {
            let strain = tensor_at(call.strains, place);
            let (density, stress) = self.0.weighted_gradient(&strain, weight);
            *value = density;
            add_at(call.stresses, place, &stress);
        }
    }
}

impl<W: StoredEnergy<D>, const D: usize> LaneRoutine<HessianArguments<D>> for Pointwise<W> {
    #[inline(always)]
    fn run<L: Lane>(&self, call: &mut HessianCall<'_, L, D>) {
        for (place, &weight) in call.places.iter().zip(call.weights) {
            let strain = tensor_at(call.strains, place);
            let direction = tensor_at(call.directions, place);
            let stress = self.0.hessian_action(&strain, &direction);
            let stress = fe_grid::tensor::scale(&stress, weight);
            add_at(call.stresses, place, &stress);
        }
    }
}

impl<const D: usize> CompiledLaw<D> {
    /// Compiles a law, in the crate that calls this.
    pub fn new<W: StoredEnergy<D>>(law: W) -> Self {
        const { assert!(D == 2 || D == 3) };
        let routine = Arc::new(Pointwise(law));
        Self {
            value: CompiledRoutine::new(Arc::clone(&routine)),
            gradient: CompiledRoutine::new(Arc::clone(&routine)),
            hessian_action: CompiledRoutine::new(routine),
            moduli: law.moduli(),
            hypotheses: law.hypotheses(),
            name: law.name(),
        }
    }

    /// The moduli of its linearisation.
    pub fn moduli(&self) -> LameModuli {
        self.moduli
    }

    /// What it satisfies.
    pub fn hypotheses(&self) -> Hypotheses {
        self.hypotheses
    }

    /// The name that the law gives itself.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// `W(1 + h)` at a point; see [`StoredEnergy::value`].
    #[inline(always)]
    pub fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        let mut values = [L::zero(); MAX_CORNERS];
        self.block_value(ValueCall {
            strains: &alone(h),
            places: &places_of_points::<D>()[..1],
            values: &mut values,
        });
        values[0]
    }

    /// `W(1 + h)` and the first Piola-Kirchhoff stress `W_,A(1 + h)` at a point.
    #[inline(always)]
    pub fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        self.weighted_gradient(h, L::one())
    }

    /// `w W(1 + h)` and `w W_,A(1 + h)` at a point.
    #[inline(always)]
    pub fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        let mut values = [L::zero(); MAX_CORNERS];
        let mut stresses = alone(&[[L::zero(); D]; D]);
        self.block_gradient(GradientCall {
            strains: &alone(h),
            places: &places_of_points::<D>()[..1],
            weights: &[weight; MAX_CORNERS],
            values: &mut values,
            stresses: &mut stresses,
        });
        (values[0], stresses.map(|row| row.map(|entry| entry[0])))
    }

    /// `W_,AA(1 + h)[b]` at a point.
    #[inline(always)]
    pub fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let mut stresses = alone(&[[L::zero(); D]; D]);
        self.block_hessian_action(HessianCall {
            strains: &alone(h),
            directions: &alone(b),
            places: &places_of_points::<D>()[..1],
            weights: &[L::one(); MAX_CORNERS],
            stresses: &mut stresses,
        });
        stresses.map(|row| row.map(|entry| entry[0]))
    }

    #[inline(always)]
    pub(crate) fn block_value<L: Lane>(&self, mut call: ValueCall<'_, L, D>) {
        self.value.call::<L>(&mut call);
    }

    #[inline(always)]
    pub(crate) fn block_gradient<L: Lane>(&self, mut call: GradientCall<'_, L, D>) {
        self.gradient.call::<L>(&mut call);
    }

    #[inline(always)]
    pub(crate) fn block_hessian_action<L: Lane>(&self, mut call: HessianCall<'_, L, D>) {
        self.hessian_action.call::<L>(&mut call);
    }
}

/// A block of one point.
#[inline(always)]
fn alone<L: Lane, const D: usize>(h: &Tensor<L, D>) -> BlockGradients<L, D, D> {
    h.map(|row| row.map(|entry| [entry; MAX_FACE_CORNERS]))
}
