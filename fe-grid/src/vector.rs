//! Sums and updates of long vectors, with the same bits on any number of threads.
//!
//! A sum is taken over fixed chunks of [`CHUNK`] numbers, each in a fixed order, and the partial
//! sums are added one after the other, so that the result does not depend on which thread computes
//! a chunk. Vectors are stored in either precision; every number is computed in double precision, and rounded
//! once where the result is stored. No function allocates, except to convert vectors.

use crate::lane::{Element, Lane, LaneKernel, Numbers, NumbersMut};
use crate::parallel;
use std::borrow::Cow;

/// Number of entries in a chunk.
pub const CHUNK: usize = 4096;
/// Vectors shorter than this are processed by a single thread.
const SERIAL_BELOW: usize = 8 * CHUNK;
/// Minimal number of chunks per thread.
const MIN_CHUNKS: usize = 4;
/// Number of partial results stored on the stack at a time.
const MAX_PARTIALS: usize = 512;
/// Independent sums inside a chunk, so that the additions can overlap.
const ACCUMULATORS: usize = 8;

/// `x · y`.
///
/// # Panics
/// If the lengths differ.
pub fn dot<T: Element, U: Element>(x: &[T], y: &[U]) -> f64 {
    assert_eq!(x.len(), y.len());
    sum_of_chunks(x.len(), |from, to| dot_of_chunk(&x[from..to], &y[from..to]))
}

/// The sum of the numbers `of(from, to)` of all chunks of vectors of `n` numbers, in order.
pub(crate) fn sum_of_chunks(n: usize, of: impl Fn(usize, usize) -> f64 + Sync) -> f64 {
    reduce(n, of, |a, b| a + b)
}

/// `x · y` of a chunk.
pub(crate) fn dot_of_chunk<T: Element, U: Element>(x: &[T], y: &[U]) -> f64 {
    wide(Dot(x, y))
}

/// `y = y + a x` of a chunk.
pub(crate) fn add_chunk<T: Element, U: Element>(a: f64, x: &[T], y: &mut [U]) {
    wide(Axpy(a, x, y));
}

/// Euclidean norm of `x`.
pub fn norm<T: Element>(x: &[T]) -> f64 {
    dot(x, x).sqrt()
}

/// Sum of the entries.
pub fn sum(x: &[f64]) -> f64 {
    reduce(x.len(), |from, to| sum_chunk(&x[from..to]), |a, b| a + b)
}

/// Largest absolute value, 0 for an empty vector and NaN where any entry is NaN.
pub fn max_abs(x: &[f64]) -> f64 {
    reduce(x.len(), |from, to| wide(Largest(&x[from..to])), larger)
}

/// Largest absolute value of `x - y`, NaN where any entry is NaN.
///
/// # Panics
/// If the lengths differ.
pub fn max_abs_difference<T: Element, U: Element>(x: &[T], y: &[U]) -> f64 {
    assert_eq!(x.len(), y.len());
    reduce(
        x.len(),
        |from, to| wide(LargestDifference(&x[from..to], &y[from..to])),
        larger,
    )
}

/// `y = value` everywhere.
pub fn fill<T: Element>(value: f64, y: &mut [T]) {
    update(y, |_, part| part.fill(T::from_f64(value)));
}

/// `y = x`.
///
/// # Panics
/// If the lengths differ.
pub fn copy_into<T: Element, U: Element>(x: &[T], y: &mut [U]) {
    assert_eq!(x.len(), y.len());
    update(y, |from, part| {
        for (v, u) in part.iter_mut().zip(&x[from..]) {
            *v = U::from_f64(u.to_f64());
        }
    });
}

/// `x` in double precision: itself, or a copy.
pub fn in_double<T: Element>(x: &[T]) -> Cow<'_, [f64]> {
    if let Numbers::Double(x) = T::numbers(x) {
        return x.into();
    }
    let mut wide = vec![0.0; x.len()];
    copy_into(x, &mut wide);
    wide.into()
}

/// Calls `change` with `x` in double precision, itself or a copy, and rounds what that has become.
pub fn change_in_double<T: Element, R>(x: &mut [T], change: impl FnOnce(&mut [f64]) -> R) -> R {
    if let NumbersMut::Double(x) = T::numbers_mut(x) {
        return change(x);
    }
    let mut wide = in_double(x).into_owned();
    let result = change(&mut wide);
    copy_into(&wide, x);
    result
}

/// Rounds `x` to the precision of `T`.
pub fn round_to<T: Element>(x: &mut [f64]) {
    update(x, |_, part| {
        for v in part {
            *v = T::from_f64(*v).to_f64();
        }
    });
}

/// `y = a y`.
pub fn scale<T: Element>(a: f64, y: &mut [T]) {
    update(y, |_, part| {
        for v in part {
            *v = T::from_f64(a * v.to_f64());
        }
    });
}

/// `y = y + a x`.
///
/// # Panics
/// If the lengths differ.
pub fn axpy<T: Element, U: Element>(a: f64, x: &[T], y: &mut [U]) {
    assert_eq!(x.len(), y.len());
    update(y, |from, part| {
        add_chunk(a, &x[from..from + part.len()], part);
    });
}

/// `y = a y + x`.
///
/// # Panics
/// If the lengths differ.
pub fn aypx<T: Element, U: Element>(a: f64, x: &[T], y: &mut [U]) {
    assert_eq!(x.len(), y.len());
    update(y, |from, part| {
        for (v, u) in part.iter_mut().zip(&x[from..]) {
            *v = U::from_f64(u.to_f64() + a * v.to_f64());
        }
    });
}

/// `out = x + a y`, rounded to the precision of `x`.
///
/// # Panics
/// If the lengths differ.
pub fn add_scaled_into<T: Element, U: Element>(x: &[T], a: f64, y: &[U], out: &mut [f64]) {
    assert_eq!(x.len(), out.len());
    assert_eq!(y.len(), out.len());
    update(out, |from, part| {
        for ((v, u), w) in part.iter_mut().zip(&x[from..]).zip(&y[from..]) {
            *v = T::from_f64(u.to_f64() + a * w.to_f64()).to_f64();
        }
    });
}

/// `out = x - y`.
///
/// # Panics
/// If the lengths differ.
pub fn subtract_into(x: &[f64], y: &[f64], out: &mut [f64]) {
    assert_eq!(x.len(), out.len());
    assert_eq!(y.len(), out.len());
    update(out, |from, part| {
        for ((v, u), w) in part.iter_mut().zip(&x[from..]).zip(&y[from..]) {
            *v = u - w;
        }
    });
}

/// `out = a (x - y)`, rounded to the precision of `out`.
///
/// # Panics
/// If the lengths differ.
pub fn scaled_difference_into<T: Element, U: Element, V: Element>(
    a: f64,
    x: &[T],
    y: &[U],
    out: &mut [V],
) {
    assert_eq!(x.len(), out.len());
    assert_eq!(y.len(), out.len());
    update(out, |from, part| {
        for ((v, u), w) in part.iter_mut().zip(&x[from..]).zip(&y[from..]) {
            *v = V::from_f64(a * (u.to_f64() - w.to_f64()));
        }
    });
}

/// `out_j = x_j y_j`.
///
/// # Panics
/// If the lengths differ.
pub fn multiply_into(x: &[f64], y: &[f64], out: &mut [f64]) {
    assert_eq!(x.len(), out.len());
    assert_eq!(y.len(), out.len());
    update(out, |from, part| {
        for ((v, u), w) in part.iter_mut().zip(&x[from..]).zip(&y[from..]) {
            *v = u * w;
        }
    });
}

/// Combines the numbers `partial(from, to)` of all chunks, in order.
fn reduce(
    n: usize,
    partial: impl Fn(usize, usize) -> f64 + Sync,
    combine: impl Fn(f64, f64) -> f64,
) -> f64 {
    let of_chunk = |c: usize| partial(c * CHUNK, ((c + 1) * CHUNK).min(n));
    let n_chunks = n.div_ceil(CHUNK);
    if n < SERIAL_BELOW {
        return (0..n_chunks).map(of_chunk).fold(0.0, combine);
    }
    let mut partials = [0.0; MAX_PARTIALS];
    let mut result = 0.0;
    for first in (0..n_chunks).step_by(MAX_PARTIALS) {
        let partials = &mut partials[..MAX_PARTIALS.min(n_chunks - first)];
        parallel::for_each_mut(partials, MIN_CHUNKS, &|c, p| *p = of_chunk(first + c));
        result = partials.iter().copied().fold(result, &combine);
    }
    result
}

/// Runs `change(from, part)` on all parts of `y`, where `from` is the position of the part.
pub(crate) fn update<T: Element>(y: &mut [T], change: impl Fn(usize, &mut [T]) + Sync) {
    if y.len() < SERIAL_BELOW {
        change(0, y);
        return;
    }
    parallel::for_each_chunk(y, CHUNK, MIN_CHUNKS, &|c, part| change(c * CHUNK, part));
}

/// Runs a loop over a chunk with the widest instruction set of the machine: a plain loop, which the
/// compiler vectorises for the width that it is compiled for. Products and sums are rounded one by
/// one, so that the result does not depend on the width.
fn wide<K: LaneKernel<f64>>(kernel: K) -> K::Output {
    f64::run_kernel(kernel)
}

/// `x · y`.
struct Dot<'a, T, U>(&'a [T], &'a [U]);

impl<T: Element, U: Element> LaneKernel<f64> for Dot<'_, T, U> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> f64 {
        let mut partials = [0.0; ACCUMULATORS];
        let xs = self.0.chunks_exact(ACCUMULATORS);
        let ys = self.1.chunks_exact(ACCUMULATORS);
        let mut rest = 0.0;
        for (a, b) in xs.remainder().iter().zip(ys.remainder()) {
            rest += a.to_f64() * b.to_f64();
        }
        for (a, b) in xs.zip(ys) {
            for i in 0..ACCUMULATORS {
                partials[i] += a[i].to_f64() * b[i].to_f64();
            }
        }
        partials.iter().sum::<f64>() + rest
    }
}

/// `y += a x`.
struct Axpy<'a, T, U>(f64, &'a [T], &'a mut [U]);

impl<T: Element, U: Element> LaneKernel<f64> for Axpy<'_, T, U> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) {
        for (v, u) in self.2.iter_mut().zip(self.1) {
            *v = U::from_f64(v.to_f64() + self.0 * u.to_f64());
        }
    }
}

/// The largest absolute value of `x`.
struct Largest<'a>(&'a [f64]);

impl LaneKernel<f64> for Largest<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> f64 {
        let mut largest = [0.0; ACCUMULATORS];
        let xs = self.0.chunks_exact(ACCUMULATORS);
        for (m, u) in largest.iter_mut().zip(xs.remainder()) {
            *m = u.abs();
        }
        for x in xs {
            for i in 0..ACCUMULATORS {
                largest[i] = larger(largest[i], x[i].abs());
            }
        }
        largest.into_iter().fold(0.0, larger)
    }
}

/// The largest absolute value of `x - y`.
struct LargestDifference<'a, T, U>(&'a [T], &'a [U]);

impl<T: Element, U: Element> LaneKernel<f64> for LargestDifference<'_, T, U> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> f64 {
        let mut largest = [0.0; ACCUMULATORS];
        let xs = self.0.chunks_exact(ACCUMULATORS);
        let ys = self.1.chunks_exact(ACCUMULATORS);
        let rest = xs.remainder().iter().zip(ys.remainder());
        for (m, (u, v)) in largest.iter_mut().zip(rest) {
            *m = (u.to_f64() - v.to_f64()).abs();
        }
        for (x, y) in xs.zip(ys) {
            for i in 0..ACCUMULATORS {
                largest[i] = larger(largest[i], (x[i].to_f64() - y[i].to_f64()).abs());
            }
        }
        largest.into_iter().fold(0.0, larger)
    }
}

fn sum_chunk(x: &[f64]) -> f64 {
    let mut partials = [0.0; ACCUMULATORS];
    let xs = x.chunks_exact(ACCUMULATORS);
    let rest: f64 = xs.remainder().iter().sum();
    for a in xs {
        for i in 0..ACCUMULATORS {
            partials[i] += a[i];
        }
    }
    partials.iter().sum::<f64>() + rest
}

/// Returns the larger number, or NaN if one is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
