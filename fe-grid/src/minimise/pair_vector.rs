//! The vectors of L-BFGS pairs: in single precision, or in bytes with a scale a block.
//!
//! A block has the power of two above its largest number as its scale, and numbers are multiples of
//! `2^-7` of it: a quarter of the memory. What matters is that products are taken of the rounded pair; on
//! hippocampi at 65^3 nodes bytes cost no iteration, and changed the elastic energy by 2e-5 of it. Numbers
//! that have been rounded once are not changed when they are rounded again, so that a pair survives being
//! stored in single precision.

use super::counted::Counted;
use super::objective::Objective;
use crate::buffer::Buffer;
use crate::distribution::Distribution;
use crate::lane::{Element, Lane, LaneKernel};
use crate::parallel;
use crate::vector::{self, CHUNK};
use std::borrow::Cow;
use std::ops::Range;

/// Numbers of a block. It divides [`CHUNK`].
const BLOCK: usize = 32;
/// Bits of a whole number besides its sign.
const BITS: u32 = 7;
/// The largest whole number.
const LARGEST: f32 = 127.0;
/// Bits of the mantissa of a number in single precision.
const MANTISSA: u32 = 23;

/// A vector of numbers of absolute value at most one.
#[derive(Debug)]
pub(super) enum PairVector {
    /// In single precision.
    Single(Buffer<f32>),
    /// In whole numbers.
    Whole(WholeNumbers),
}

/// Whole numbers and the scales of their blocks, of parts of equal length: no block is in two parts, so
/// that the numbers do not depend on which process has which part.
#[derive(Debug)]
pub(super) struct WholeNumbers {
    numbers: Buffer<i8>,
    scales: Buffer<f32>,
    part: usize,
}

impl PairVector {
    /// Zeros, in rooms of the objective.
    pub(super) fn new<O: Objective>(
        objective: &Counted<'_, O>,
        len: usize,
        compact: bool,
    ) -> Result<Self, O::Error> {
        if !compact {
            return Ok(Self::Single(objective.room(len)?));
        }
        let parts = objective.distribution().own().len().max(1);
        let part = len / parts;
        Ok(Self::Whole(WholeNumbers {
            numbers: objective.room(len)?,
            scales: objective.room(parts * part.div_ceil(BLOCK))?,
            part,
        }))
    }

    /// Becomes `factor (x - y)`, rounded.
    pub(super) fn set_difference<T: Element, U: Element>(&mut self, factor: f64, x: &[T], y: &[U]) {
        match self {
            Self::Single(numbers) => vector::scaled_difference_into(factor, x, y, numbers),
            Self::Whole(whole) => whole.set(&|range, out| {
                let (x, y) = (&x[range.clone()], &y[range]);
                for (v, (u, w)) in out.iter_mut().zip(x.iter().zip(y)) {
                    *v = (factor * (u.to_f64() - w.to_f64())) as f32;
                }
            }),
        }
    }

    /// Becomes a vector of the same length, rounded.
    pub(super) fn set(&mut self, x: &[f32]) {
        match self {
            Self::Single(numbers) => numbers.copy_from_slice(x),
            Self::Whole(whole) => whole.set(&|range, out| out.copy_from_slice(&x[range])),
        }
    }

    /// All numbers in single precision.
    pub(super) fn numbers(&self) -> Cow<'_, [f32]> {
        match self {
            Self::Single(numbers) => numbers[..].into(),
            Self::Whole(whole) => {
                let mut numbers = vec![0.0; whole.numbers.len()];
                whole.read(0, &mut numbers);
                numbers.into()
            }
        }
    }

    /// The scalar product with a vector of unknowns. Collective.
    pub(super) fn dot<T: Element>(&self, y: &[T], distribution: &Distribution) -> f64 {
        distribution.sum_of_parts(y.len(), &|part| {
            vector::sum_of_chunks(part.len(), |from, to| {
                let range = part.start + from..part.start + to;
                self.with(range.clone(), |x| vector::dot_of_chunk(x, &y[range]))
            })
        })
    }

    /// The scalar product with another one. Collective.
    pub(super) fn dot_with(&self, other: &Self, distribution: &Distribution) -> f64 {
        distribution.sum_of_parts(self.len(), &|part| {
            vector::sum_of_chunks(part.len(), |from, to| {
                let range = part.start + from..part.start + to;
                self.with(range.clone(), |x| {
                    other.with(range, |y| vector::dot_of_chunk(x, y))
                })
            })
        })
    }

    /// `y = y + a x` for this `x`.
    pub(super) fn add_to<T: Element>(&self, a: f64, y: &mut [T]) {
        assert_eq!(self.len(), y.len());
        vector::update(y, |from, y| {
            self.with_each(from..from + y.len(), y, |x, y| vector::add_chunk(a, x, y));
        });
    }

    /// The vector is not needed for a while.
    pub(super) fn rest(&self) {
        match self {
            Self::Single(numbers) => numbers.rest(),
            Self::Whole(whole) => {
                whole.numbers.rest();
                whole.scales.rest();
            }
        }
    }

    /// How many numbers there are.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Single(numbers) => numbers.len(),
            Self::Whole(whole) => whole.numbers.len(),
        }
    }

    /// Calls `work` with at most [`CHUNK`] numbers.
    fn with<R>(&self, range: Range<usize>, work: impl FnOnce(&[f32]) -> R) -> R {
        match self {
            Self::Single(numbers) => work(&numbers[range]),
            Self::Whole(whole) => {
                let mut room = [0.0; CHUNK];
                let part = &mut room[..range.len()];
                whole.read(range.start, part);
                work(part)
            }
        }
    }

    /// Calls `work` with all numbers of a range and those of `y`, chunk by chunk.
    fn with_each<T>(&self, range: Range<usize>, y: &mut [T], work: impl Fn(&[f32], &mut [T])) {
        for (k, y) in y.chunks_mut(CHUNK).enumerate() {
            let start = range.start + k * CHUNK;
            self.with(start..start + y.len(), |x| work(x, y));
        }
    }
}

impl WholeNumbers {
    /// Rounds the numbers that `read` writes for a range.
    fn set(&mut self, read: &(dyn Fn(Range<usize>, &mut [f32]) + Sync)) {
        let part = self.part.max(1);
        let blocks = part.div_ceil(BLOCK);
        let parts = self.numbers.chunks_exact_mut(part);
        let parts = parts.zip(self.scales.chunks_exact_mut(blocks)).enumerate();
        parallel::for_each(parts, &|(i, (numbers, scales))| {
            let chunks = numbers.chunks_mut(CHUNK);
            let chunks = chunks.zip(scales.chunks_mut(CHUNK / BLOCK)).enumerate();
            for (k, (numbers, scales)) in chunks {
                let start = i * part + k * CHUNK;
                let mut room = [0.0; CHUNK];
                let exact = &mut room[..numbers.len()];
                read(start..start + exact.len(), exact);
                f64::run_kernel(Round {
                    exact,
                    numbers,
                    scales,
                });
            }
        });
    }

    /// Reads the numbers from a place on.
    fn read(&self, start: usize, out: &mut [f32]) {
        let part = self.part.max(1);
        let blocks = part.div_ceil(BLOCK);
        let mut from = start;
        let mut out = out;
        // A chunk may begin within a block, and reach into the next part.
        while !out.is_empty() {
            let (i, place) = (from / part, from % part);
            let end = (place / BLOCK + 1) * BLOCK;
            let len = (end.min(part) - place).min(out.len());
            let whole = place % BLOCK == 0 && len == BLOCK;
            let many = if whole {
                (part - place).min(out.len()) / BLOCK * BLOCK
            } else {
                len
            };
            let (now, later) = out.split_at_mut(many);
            let scale = i * blocks + place / BLOCK;
            f64::run_kernel(Widen {
                numbers: &self.numbers[from..from + many],
                scales: &self.scales[scale..scale + many.div_ceil(BLOCK)],
                out: now,
            });
            out = later;
            from += many;
        }
    }
}

/// Whole numbers of blocks that begin where `exact` does.
struct Round<'a> {
    exact: &'a [f32],
    numbers: &'a mut [i8],
    scales: &'a mut [f32],
}

impl LaneKernel<f64> for Round<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) {
        let blocks = self.exact.chunks(BLOCK).zip(self.numbers.chunks_mut(BLOCK));
        for ((exact, numbers), scale) in blocks.zip(self.scales) {
            let largest = exact.iter().fold(0.0, |m: f32, x| {
                // NaN remains.
                if m.is_nan() || x.abs() <= m {
                    m
                } else {
                    x.abs()
                }
            });
            let inverse = if largest.is_finite() {
                // The power of two above the largest number, over that of the whole numbers.
                let exponent = (largest.to_bits() >> MANTISSA) + 1;
                *scale = f32::from_bits(exponent.saturating_sub(BITS) << MANTISSA);
                let inverse = 1.0 / *scale;
                if inverse.is_finite() { inverse } else { 0.0 }
            } else {
                *scale = f32::NAN;
                1.0
            };
            for (number, x) in numbers.iter_mut().zip(exact) {
                let nearest =
                    (x * inverse + f32::ROUNDING_MAGIC as f32) - f32::ROUNDING_MAGIC as f32;
                *number = nearest.clamp(-LARGEST, LARGEST) as i8;
            }
        }
    }
}

/// Numbers of blocks, the first of which may be a part of one.
struct Widen<'a> {
    numbers: &'a [i8],
    scales: &'a [f32],
    out: &'a mut [f32],
}

impl LaneKernel<f64> for Widen<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) {
        let blocks = self.numbers.chunks(BLOCK).zip(self.out.chunks_mut(BLOCK));
        for ((numbers, out), scale) in blocks.zip(self.scales) {
            for (x, number) in out.iter_mut().zip(numbers) {
                *x = f32::from(*number) * scale;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::noise;

    fn zeros(parts: usize, part: usize) -> PairVector {
        PairVector::Whole(WholeNumbers {
            numbers: Buffer::zeros(parts * part),
            scales: Buffer::zeros(parts * part.div_ceil(BLOCK)),
            part,
        })
    }

    /// Two parts that end within a block, one of more than a chunk.
    #[test]
    fn blocks_are_rounded_to_their_own_scale_and_only_once() {
        let part = CHUNK + 3 * BLOCK + 5;
        let distribution = Distribution::alone(2);
        // From block to block numbers become smaller; one block is zero.
        let size = |i: usize| match i / BLOCK % 40 {
            7 => 0.0,
            block => 0.5f64.powi(block as i32),
        };
        let exact: Vec<f64> = noise(2 * part, 5)
            .iter()
            .enumerate()
            .map(|(i, x)| x * size(i % part))
            .collect();
        let mut vector = zeros(2, part);
        vector.set_difference(0.5, &exact, &vec![0.0f32; exact.len()]);
        let rounded = vector.numbers().into_owned();
        for (i, (x, y)) in exact.iter().zip(&rounded).enumerate() {
            let error = (0.5 * x - f64::from(*y)).abs();
            // Half a step of the largest scale that the block may have; the largest number loses one.
            assert!(
                error <= 0.5 * size(i % part) * 2f64.powi(-7),
                "{i}: {x} {y}"
            );
        }
        let mut again = zeros(2, part);
        again.set(&rounded);
        assert!(again.numbers() == rounded);
        // Products and sums are those of the rounded numbers.
        let y = noise(2 * part, 6);
        let product = distribution.dot(&rounded, &y);
        assert_eq!(vector.dot(&y, &distribution), product);
        assert_eq!(
            vector.dot_with(&again, &distribution),
            distribution.dot(&rounded, &rounded)
        );
        let (mut sum, mut expected) = (y.clone(), y);
        vector.add_to(-2.5, &mut sum);
        vector::axpy(-2.5, &rounded, &mut expected);
        assert!(sum == expected);
    }

    #[test]
    fn what_is_not_a_number_stays_so() {
        let mut vector = zeros(1, 40);
        vector.set(&[f32::NAN; 40]);
        assert!(vector.numbers().iter().all(|x| x.is_nan()));
        let mut numbers = [0.25; 40];
        numbers[3] = f32::INFINITY;
        vector.set(&numbers);
        assert!(vector.numbers()[..32].iter().all(|x| x.is_nan()));
        assert!(vector.numbers()[32..].iter().all(|x| *x == 0.25));
    }
}
