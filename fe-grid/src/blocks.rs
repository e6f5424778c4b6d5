//! Inverses of the diagonal blocks of an operator, for the smoothers of multigrid.

use crate::error::GridError;
use crate::lane::{Element, Lane, LaneKernel};
use crate::parallel;

/// Number of nodes per task.
const CHUNK: usize = 4096;
/// Rounding errors of a pivot, in units of that of its diagonal entry: each of the other rows is
/// subtracted from it once, with a few roundings.
const PIVOT_ROUNDING: f64 = 8.0;

/// The rounding error of numbers of a type, relative to them.
pub(crate) fn rounding_error<T>() -> f64 {
    if size_of::<T>() == 4 {
        f64::from(f32::EPSILON)
    } else {
        f64::EPSILON
    }
}

/// Replaces symmetric blocks `[r M + m][node]` by their inverses: Gauss-Jordan elimination, with
/// the nodes in the lanes. Pivots within the rounding errors of the block, such as where the weight of
/// one direction is so large that nothing is left of the others, are raised to them.
///
/// # Errors
/// [`GridError::NotPositiveDefinite`] if a pivot is below them, zero in a zero row, or not a number.
pub(crate) fn invert_blocks<T: Element, const M: usize>(blocks: &mut [T]) -> Result<(), GridError> {
    let n = blocks.len() / (M * M);
    let mut entries: Vec<&mut [T]> = blocks.chunks_exact_mut(n).collect();
    let mut tasks: Vec<Vec<&mut [T]>> = (0..n.div_ceil(CHUNK)).map(|_| Vec::new()).collect();
    for entry in entries.drain(..) {
        for (task, part) in tasks.iter_mut().zip(entry.chunks_mut(CHUNK)) {
            task.push(part);
        }
    }
    let pivots = parallel::map(tasks, &|entries| {
        T::run_kernel(InvertBlocks::<T, M> { entries })
    });
    match pivots
        .into_iter()
        .find(|pivot| pivot.is_nan() || *pivot <= 0.0)
    {
        Some(curvature) => Err(GridError::NotPositiveDefinite {
            curvature,
            iteration: 0,
        }),
        None => Ok(()),
    }
}

struct InvertBlocks<'a, T, const M: usize> {
    /// Entries of the blocks of some nodes, `[r M + m][node]`.
    entries: Vec<&'a mut [T]>,
}

impl<T: Element, const M: usize> LaneKernel<T> for InvertBlocks<'_, T, M> {
    /// The smallest pivot; one that is not a positive number takes precedence.
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane<Element = T>>(mut self) -> f64 {
        let n = self.entries[0].len();
        let mut smallest = f64::INFINITY;
        let mut pivots = vec![T::default(); n];
        let epsilon = L::splat(PIVOT_ROUNDING * rounding_error::<T>());
        for i in (0..n).step_by(L::COUNT) {
            let mut a: [[L; M]; M] = std::array::from_fn(|r| {
                std::array::from_fn(|m| L::load(&self.entries[r * M + m][i..]))
            });
            let rounding: [L; M] = std::array::from_fn(|p| a[p][p] * epsilon);
            let mut least = L::splat(f64::INFINITY);
            for p in 0..M {
                let pivot = a[p][p];
                let close = (-rounding[p]).less(pivot);
                let pivot = L::select(close, pivot.max(rounding[p]), pivot);
                // A comparison with NaN is false, so that NaN becomes the smallest.
                least = L::select(least.less(pivot), least, pivot);
                let inverse = L::one() / pivot;
                a[p][p] = L::one();
                for m in 0..M {
                    a[p][m] *= inverse;
                }
                for r in 0..M {
                    if r != p {
                        let factor = -a[r][p];
                        a[r][p] = L::zero();
                        for m in 0..M {
                            a[r][m] = a[p][m].mul_add(factor, a[r][m]);
                        }
                    }
                }
            }
            least.store(&mut pivots[i..]);
            for r in 0..M {
                for m in 0..M {
                    a[r][m].store(&mut self.entries[r * M + m][i..]);
                }
            }
        }
        for pivot in pivots {
            let pivot = pivot.to_f64();
            if pivot.is_nan() {
                return pivot;
            }
            smallest = smallest.min(pivot);
        }
        smallest
    }
}
