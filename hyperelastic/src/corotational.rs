//! The corotational quadratic form: linear elasticity in the frame of each deformed cell.
//!
//! The Hessian of a frame-indifferent density at a rotation `R` is `W_,AA(R)[B]:B =
//! 2 diss[R^T B]`. Taken at the rotation of the polar decomposition of the mean deformation
//! gradient of a cell, it is a positive semidefinite approximation of the Hessian at that gradient,
//! exact for rigid motions and accurate for moderate strains, with `1 + D^2` numbers per cell. With
//! an additional term `1/2 d . G d`, a symmetric matrix `G` per cell, it is the metric of
//! minimisers for elastic energies with a further term in the deformation itself.
//!
//! At large strains the second derivatives of energies with a barrier against folding are those of the
//! strain relative to the deformed cell, `Dd F^-1`. [`Corotational::from_deformed_means`] takes this into
//! account by another matrix per cell in place of the rotation.

use crate::moduli::LameModuli;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::multigrid::CoefficientLaw;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, Tensor, tensor};

/// The quadratic law `k diss[Dd M^T] + 1/2 d . G d + r/2 (|d|^2 + |Dd|^2)` of a direction `d`, where `M`
/// is the rotation `R` of a cell, or [another matrix](Self::from_deformed_means); for a rotation,
/// `diss[Dd R^T] = diss[R^T Dd]`.
///
/// Data of a cell: the stiffness `k`, the matrix `k M` row by row, and the upper triangle of `G`
/// row by row.
#[derive(Clone, Copy, Debug)]
pub struct Corotational<const D: usize> {
    /// Lamé moduli at stiffness 1.
    pub moduli: LameModuli,
    /// Coefficient `r` of the regularisation, which makes the form definite.
    pub regularisation: f64,
    /// Whether `M` is a rotation in all cells; then it is one in the cells of coarser grids, too.
    pub rotations: bool,
    /// Whether the data have the transpose of a factor `L` of `G = L L^T`, lower triangular, in place of
    /// `G`. Where a mismatch has a large weight along one direction, what the rounding of `L` changes in the
    /// others is of second order, and never negative: see [`CoefficientLaw::packed`].
    pub factored: bool,
}

impl<const D: usize> Corotational<D> {
    /// Numbers per cell: the stiffness, `k R`, and `G`.
    pub const CELL_DATA: usize = 1 + D * D + D * (D + 1) / 2;

    /// Regularisation of a metric, as a fraction of the stiffness of its void.
    pub const REGULARISATION: f64 = 1e-3;

    /// Lower bound of the stiffness of the void in a metric, relative to the object. The void has
    /// almost no energy, but must deform without folding: with this stiffness the metric
    /// distributes its strain, whereas with the void's own stiffness every step would end at a
    /// fold. Between 0.03 and 0.3 the number of iterations hardly changes; at 1 bending bars need
    /// 1.5 times as many.
    pub const LEAST_VOID_STIFFNESS: f64 = 0.1;

    /// Returns the contribution of a point to the cell means that [`Self::from_means`] converts:
    /// its stiffness and displacement gradient, with `G = 0`.
    #[inline(always)]
    pub fn at_point<L: Lane>(stiffness: L, gradient: &Tensor<L, D>) -> [L; MAX_CELL_DATA] {
        let mut data = [L::zero(); MAX_CELL_DATA];
        data[0] = stiffness;
        Self::set_matrix(&mut data, gradient);
        data
    }

    /// Adds `curvature slope (x) slope` to `G`.
    #[inline(always)]
    pub fn add_outer<L: Lane>(data: &mut [L; MAX_CELL_DATA], curvature: L, slope: &[L; D]) {
        for i in 0..D {
            for j in i..D {
                let entry = &mut data[Self::mass_entry(i, j)];
                *entry = (curvature * slope[i]).mul_add(slope[j], *entry);
            }
        }
    }

    /// Returns the data of an undeformed cell, with `R = 1` and `G = 0`.
    #[inline(always)]
    pub fn undeformed<L: Lane>(stiffness: L) -> [L; MAX_CELL_DATA] {
        Self::at_point(stiffness, &tensor::diagonal(stiffness))
    }

    #[inline(always)]
    fn matrix<L: Lane>(data: &[L; MAX_CELL_DATA]) -> Tensor<L, D> {
        let mut matrix = tensor::zero::<L, D>();
        for i in 0..D {
            for k in 0..D {
                matrix[i][k] = data[1 + i * D + k];
            }
        }
        matrix
    }

    #[inline(always)]
    fn set_matrix<L: Lane>(data: &mut [L; MAX_CELL_DATA], matrix: &Tensor<L, D>) {
        for i in 0..D {
            for k in 0..D {
                data[1 + i * D + k] = matrix[i][k];
            }
        }
    }

    /// Converts cell means to the data of a cell: of the stiffness, of the displacement gradient,
    /// which is replaced by `k R`, and of `G`. The rotation is that of the mean deformation
    /// gradient.
    #[inline(always)]
    pub fn from_means<L: Lane>(mut means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        let rotation = polar_rotation(&tensor::add_identity(&Self::matrix(&means)));
        let scaled = tensor::scale(&rotation, means[0]);
        Self::set_matrix(&mut means, &scaled);
        means
    }

    /// Converts cell means like [`Self::from_means`], for strains that are in part relative to the
    /// deformed cell: with `M = (R + F^-T)/2` for the mean deformation gradient `F = R U`, a singular
    /// value `s` of which gives `M` the value `(1 + 1/s)/2`. Directions in which a cell is flat become
    /// stiff, so that a step does not fold it; those in which it is stretched do not become soft.
    ///
    /// `stiffness` computes the stiffness of the cell from `det F`, at least .02. The form does not have
    /// [`Self::rotations`].
    #[inline(always)]
    pub fn from_deformed_means<L: Lane>(
        mut means: [L; MAX_CELL_DATA],
        stiffness: impl FnOnce(L) -> L,
    ) -> [L; MAX_CELL_DATA] {
        let gradient = tensor::add_identity(&Self::matrix(&means));
        let cofactor = tensor::cofactor(&gradient);
        let det = tensor::determinant_with(&gradient, &cofactor).max(L::splat(LEAST_DETERMINANT));
        let relative = tensor::scale(&cofactor, L::one() / det);
        let twice = tensor::add(&polar_rotation(&gradient), &relative);
        let stiffness = stiffness(det);
        means[0] = stiffness;
        Self::set_matrix(&mut means, &tensor::scale(&twice, stiffness.scale(0.5)));
        means
    }

    /// Adds `L L^T d`.
    #[inline(always)]
    fn add_factored<L: Lane>(point: &Point<L, D, D>, direction: &Jet<L, D, D>, value: &mut [L; D]) {
        for j in 0..D {
            let mut along = L::zero();
            for i in j..D {
                along = point.cell[Self::mass_entry(j, i)].mul_add(direction.value[i], along);
            }
            for i in j..D {
                value[i] = point.cell[Self::mass_entry(j, i)].mul_add(along, value[i]);
            }
        }
    }

    /// Returns the position of entry `(i, j)`, `i <= j`, of `G` among the data of a cell.
    #[inline(always)]
    pub const fn mass_entry(i: usize, j: usize) -> usize {
        1 + D * D + i * D + j - i * (i + 1) / 2
    }
}

/// Computes the rotation of the polar decomposition of a matrix; the identity if the matrix does
/// not preserve orientation.
#[inline(always)]
pub fn polar_rotation<L: Lane, const D: usize>(a: &Tensor<L, D>) -> Tensor<L, D> {
    let det = tensor::determinant(a);
    let identity = tensor::add_identity(&tensor::zero::<L, D>());
    let usable = L::splat(1e-6).less(det);
    if D == 2 {
        // The nearest rotation is given by (a00 + a11, a10 - a01), normalised, without iteration.
        let (c, s) = (a[0][0] + a[1][1], a[1][0] - a[0][1]);
        let inverse = L::one() / c.mul_add(c, s * s).sqrt();
        let (c, s) = (
            L::select(usable, c * inverse, L::one()),
            L::select(usable, s * inverse, L::zero()),
        );
        let mut r = identity;
        (r[0][0], r[0][1], r[1][0], r[1][1]) = (c, -s, s, c);
        return r;
    }
    // Newton's iteration R <- (R + R^-T)/2 (Higham 1986), scaled once by the determinant to start
    // close to the solution.
    let mut r = *a;
    for i in 0..D {
        for k in 0..D {
            r[i][k] = L::select(usable, r[i][k], identity[i][k]);
        }
    }
    for _ in 0..NEWTON_STEPS {
        let inverse = tensor::inverse_transpose(&r);
        r = tensor::scale(&tensor::add(&r, &inverse), L::splat(0.5));
    }
    r
}

/// Lower bound of the determinant of the mean deformation gradient of a cell.
const LEAST_DETERMINANT: f64 = 0.02;

/// Sufficient for singular values between 1/50 and 50: the first steps halve the larger ones, the
/// last steps double the number of digits.
const NEWTON_STEPS: usize = 11;

impl<const D: usize> Reads for Corotational<D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = Self::CELL_DATA;
}

impl<const D: usize> CellLaw<D, D> for Corotational<D> {
    const UNIFORM_HESSIAN: bool = true;

    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.gradient(point).0
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let state = Jet {
            value: point.value,
            gradient: point.gradient,
        };
        let flux = self.hessian_action(point, &state);
        let mut twice = tensor::contract(&flux.gradient, &state.gradient);
        for k in 0..D {
            twice = flux.value[k].mul_add(state.value[k], twice);
        }
        (twice.scale(0.5), flux)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let stiffness = point.cell[0];
        let scaled = Self::matrix(&point.cell);
        // k sigma(B M^T) M = sigma(B (kM)^T) (kM) / k; for a rotation also k R sigma(R^T B), which
        // is the rounding of the averages on record.
        let turned = if self.rotations {
            tensor::transposed_product(&scaled, &direction.gradient)
        } else {
            tensor::product_transposed(&direction.gradient, &scaled)
        };
        let inverse = L::one() / stiffness;
        let pressure = tensor::trace(&turned) * inverse.scale(self.moduli.lambda);
        let shear = inverse.scale(self.moduli.mu);
        let mut stress = tensor::zero::<L, D>();
        for i in 0..D {
            for k in 0..D {
                stress[i][k] = (turned[i][k] + turned[k][i]) * shear;
            }
            stress[i][i] += pressure;
        }
        let regularisation = L::splat(self.regularisation);
        let mut gradient = if self.rotations {
            tensor::product(&scaled, &stress)
        } else {
            tensor::product(&stress, &scaled)
        };
        gradient = tensor::add_scaled(&gradient, regularisation, &direction.gradient);
        let mut value = [L::zero(); D];
        for i in 0..D {
            value[i] = direction.value[i] * regularisation;
        }
        if self.factored {
            Self::add_factored(point, direction, &mut value);
        } else {
            for i in 0..D {
                for j in 0..D {
                    let entry = Self::mass_entry(i.min(j), i.max(j));
                    value[i] = point.cell[entry].mul_add(direction.value[j], value[i]);
                }
            }
        }
        Jet { value, gradient }
    }
}

impl<const D: usize> CoefficientLaw<D, D> for Corotational<D> {
    /// The mean of `k M` over the children is weighted by stiffness. The rotation of a mean of rotations
    /// is that of the coarse cell, so that children with different rotations do not soften it.
    fn coarsen(&self, means: &mut [f64; MAX_CELL_DATA]) {
        if !self.rotations {
            return;
        }
        let stiffness = means[0];
        let mean = Self::matrix(means).map(|row| row.map(|entry| entry / stiffness));
        let rotation = polar_rotation(&mean);
        Self::set_matrix(means, &tensor::scale(&rotation, stiffness));
    }

    /// Cholesky's factor of `G`. Pivots within the rounding errors of single precision are zero: `G` is the
    /// mean of a few products `n n^T`.
    fn pack(&self, data: &mut [f64; MAX_CELL_DATA]) {
        const ROUNDING: f64 = 1e-6;
        for j in 0..D {
            let diagonal = data[Self::mass_entry(j, j)];
            let mut column: [f64; D] = std::array::from_fn(|i| {
                if i < j {
                    return 0.0;
                }
                let known = |k: usize| data[Self::mass_entry(k, i)] * data[Self::mass_entry(k, j)];
                data[Self::mass_entry(j, i)] - (0..j).map(known).sum::<f64>()
            });
            let pivot = column[j];
            if pivot <= ROUNDING * diagonal.abs() {
                column = [0.0; D];
            } else {
                column = column.map(|entry| entry / pivot.sqrt());
            }
            for i in j..D {
                data[Self::mass_entry(j, i)] = column[i];
            }
        }
    }

    fn packed(&self) -> Self {
        Self {
            factored: true,
            ..*self
        }
    }
}
