//! Compiled laws, independent of their callers.

use crate::hypotheses::Hypotheses;
use crate::moduli::LameModuli;
use crate::stored_energy::StoredEnergy;
use fe_grid::engine::{BlockGradients, MAX_CORNERS, MAX_FACE_CORNERS, face_corner};
use fe_grid::routine::{CompiledRoutine, LaneRoutine, RoutineArguments};
use fe_grid::{Jet, Lane, Tensor};
use std::sync::Arc;

/// A stored energy density behind function pointers, one each for value, stress and tangent and for
/// each instruction set. A pointer is followed once per block of points.
///
/// Energies hold a `CompiledLaw` and are not generic over laws, so a law is compiled only where its
/// `CompiledLaw` is constructed: in this crate for the named laws ([`crate::LawSpec::compile`]), in
/// the crate that calls [`CompiledLaw::new`] for other laws. The results are bitwise those of the
/// law.
#[derive(Clone, Debug)]
pub struct CompiledLaw<const D: usize> {
    value: CompiledRoutine<ValueArguments<D>>,
    gradient: CompiledRoutine<GradientArguments<D>>,
    hessian_action: CompiledRoutine<HessianArguments<D>>,
    moduli: LameModuli,
    hypotheses: Hypotheses,
    name: &'static str,
}

/// A position in an array of [`MAX_FACE_CORNERS`] entries. With this type, the compiler knows that an
/// index is in range.
#[derive(Clone, Copy)]
#[repr(usize)]
pub(crate) enum Place {
    First = 0,
    Second = 1,
    Third = 2,
    Fourth = 3,
}

const PLACES: [Place; MAX_FACE_CORNERS] =
    [Place::First, Place::Second, Place::Third, Place::Fourth];

/// Positions of the displacement gradients of a block of points: the entry of row `i` along axis
/// `k` of point `q` is stored at `[i][k][places[q][k]]`.
pub(crate) type Places<const D: usize> = [[Place; D]];

/// Returns the positions for all points of a cell among the derivatives of a multilinear field.
pub(crate) const fn places_of_faces<const D: usize>() -> [[Place; D]; MAX_CORNERS] {
    let mut places = [[Place::First; D]; MAX_CORNERS];
    let mut q = 0;
    while q < MAX_CORNERS {
        let mut k = 0;
        while k < D {
            places[q][k] = PLACES[face_corner(q, k) % MAX_FACE_CORNERS];
            k += 1;
        }
        q += 1;
    }
    places
}

/// Returns the positions for points that do not share derivatives.
pub(crate) const fn places_of_points<const D: usize>() -> [[Place; D]; MAX_FACE_CORNERS] {
    let mut places = [[Place::First; D]; MAX_FACE_CORNERS];
    let mut q = 0;
    while q < MAX_FACE_CORNERS {
        places[q] = [PLACES[q]; D];
        q += 1;
    }
    places
}

/// Input: displacement gradients and weights. Output: weighted energy densities in the place of the
/// weights.
pub(crate) struct ValueCall<'a, L, const D: usize> {
    pub strains: &'a BlockGradients<L, D, D>,
    pub places: &'a Places<D>,
    pub densities: &'a mut [L; MAX_CORNERS],
}

/// Input: displacement gradients and weights. Output: weighted energy densities in the place of the
/// weights; weighted stresses are added.
pub(crate) struct GradientCall<'a, L, const D: usize> {
    pub strains: &'a BlockGradients<L, D, D>,
    pub places: &'a Places<D>,
    pub densities: &'a mut [L; MAX_CORNERS],
    pub stresses: &'a mut BlockGradients<L, D, D>,
}

/// Input: displacement gradients, directions and weights. Weighted tangents applied to the
/// directions are added to the output.
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

/// Returns the displacement gradient of a point.
#[inline(always)]
fn tensor_at<L: Lane, const D: usize>(
    block: &BlockGradients<L, D, D>,
    place: &[Place; D],
) -> Tensor<L, D> {
    let mut h = [[L::zero(); D]; D];
    for i in 0..D {
        for k in 0..D {
            h[i][k] = block[i][k][place[k] as usize];
        }
    }
    h
}

/// Adds a stress to that of a point.
#[inline(always)]
fn add_at<L: Lane, const D: usize>(
    block: &mut BlockGradients<L, D, D>,
    place: &[Place; D],
    stress: &Tensor<L, D>,
) {
    for i in 0..D {
        for k in 0..D {
            block[i][k][place[k] as usize] += stress[i][k];
        }
    }
}

/// A law as a routine over the points of a block.
struct Pointwise<W>(W);

impl<W: StoredEnergy<D>, const D: usize> LaneRoutine<ValueArguments<D>> for Pointwise<W> {
    #[inline(always)]
    fn run<L: Lane>(&self, call: &mut ValueCall<'_, L, D>) {
        for (place, density) in call.places.iter().zip(call.densities.iter_mut()) {
            *density = self.0.value(&tensor_at(call.strains, place)) * *density;
        }
    }
}

impl<W: StoredEnergy<D>, const D: usize> LaneRoutine<GradientArguments<D>> for Pointwise<W> {
    #[inline(always)]
    fn run<L: Lane>(&self, call: &mut GradientCall<'_, L, D>) {
        for (place, density) in call.places.iter().zip(call.densities.iter_mut()) {
            let strain = tensor_at(call.strains, place);
            let (value, stress) = self.0.weighted_gradient(&strain, *density);
            *density = value;
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
    /// Compiles a law in the calling crate, for fields in double precision.
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

    /// Compiles a law in the calling crate, for fields in double and in single precision. This takes
    /// twice as long as [`CompiledLaw::new`]; with a law of the latter, the evaluation of an energy
    /// in single precision panics.
    pub fn in_both_precisions<W: StoredEnergy<D>>(law: W) -> Self {
        const { assert!(D == 2 || D == 3) };
        let routine = Arc::new(Pointwise(law));
        Self {
            value: CompiledRoutine::in_both_precisions(Arc::clone(&routine)),
            gradient: CompiledRoutine::in_both_precisions(Arc::clone(&routine)),
            hessian_action: CompiledRoutine::in_both_precisions(routine),
            moduli: law.moduli(),
            hypotheses: law.hypotheses(),
            name: law.name(),
        }
    }

    /// Returns the moduli of the linearisation.
    pub fn moduli(&self) -> LameModuli {
        self.moduli
    }

    /// Returns the hypotheses that the law satisfies.
    pub fn hypotheses(&self) -> Hypotheses {
        self.hypotheses
    }

    /// Returns the name of the law.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns `W(1 + h)` at a point; see [`StoredEnergy::value`].
    #[inline(always)]
    pub fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        let mut densities = [L::one(); MAX_CORNERS];
        self.block_value(ValueCall {
            strains: &alone(h),
            places: &places_of_points::<D>()[..1],
            densities: &mut densities,
        });
        densities[0]
    }

    /// Returns `W(1 + h)` and the first Piola-Kirchhoff stress `W_,A(1 + h)` at a point.
    #[inline(always)]
    pub fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        self.weighted_gradient(h, L::one())
    }

    /// Returns `w W(1 + h)` and `w W_,A(1 + h)` at a point.
    #[inline(always)]
    pub fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        let mut densities = [weight; MAX_CORNERS];
        let mut stresses = alone(&[[L::zero(); D]; D]);
        self.block_gradient(GradientCall {
            strains: &alone(h),
            places: &places_of_points::<D>()[..1],
            densities: &mut densities,
            stresses: &mut stresses,
        });
        (densities[0], stresses.map(|row| row.map(|entry| entry[0])))
    }

    /// Returns `W_,AA(1 + h)[b]` at a point.
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

    /// Computes `W_,AA(1 + h)[b]` at a point for several directions `b`, those of jets.
    #[inline(always)]
    pub(crate) fn hessian_actions<L: Lane>(
        &self,
        h: &Tensor<L, D>,
        directions: &[Jet<L, D, D>],
        changes: &mut [Jet<L, D, D>],
    ) {
        // The points of a block have the same strain, and a direction each.
        let strains = alone(h);
        let mut entries = alone(&[[L::zero(); D]; D]);
        for (directions, changes) in directions
            .chunks(MAX_FACE_CORNERS)
            .zip(changes.chunks_mut(MAX_FACE_CORNERS))
        {
            let mut stresses = alone(&[[L::zero(); D]; D]);
            for i in 0..D {
                for k in 0..D {
                    for (point, direction) in directions.iter().enumerate() {
                        entries[i][k][point] = direction.gradient[i][k];
                    }
                }
            }
            self.block_hessian_action(HessianCall {
                strains: &strains,
                directions: &entries,
                places: &places_of_points::<D>()[..directions.len()],
                weights: &[L::one(); MAX_CORNERS],
                stresses: &mut stresses,
            });
            for (point, change) in changes.iter_mut().enumerate() {
                change.gradient = stresses.map(|row| row.map(|entry| entry[point]));
            }
        }
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
