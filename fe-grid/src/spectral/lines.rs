//! Cosine and sine transforms of many lines at once.
//!
//! The even extension of a line of `n` real numbers to `2 (n-1)` has a real Fourier transform,
//! the DCT-I; the odd one has an imaginary transform, the DST-I. So two lines go into the real
//! and the imaginary part of one complex transform and come out apart. Rounding leaks from one to the
//! other, in proportion to the larger of the two.

use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::Boundary;

/// Lines that are transformed together: two cache lines side by side where they are columns.
pub(super) const BATCH: usize = 16;

/// The transform of lines of one length.
///
/// Unnormalised: twice the transform is `2 (n-1)` times the identity (for [`Boundary::Dirichlet`]
/// on lines that vanish at both ends).
pub(super) struct LineTransform {
    n: usize,
    boundary: Boundary,
    fft: Arc<dyn Fft<f64>>,
}

/// Work space of [`LineTransform`]; it fits every length that has been used with it.
#[derive(Default)]
pub(super) struct LineScratch {
    lines: Vec<Complex<f64>>,
    fft: Vec<Complex<f64>>,
}

/// Numbers at both ends of a line are doubled on the way in, or not.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// Divide by the weights 1/2, 1, ..., 1, 1/2 of the trapezoid rule.
    Doubled,
    /// Take the numbers as they are.
    Kept,
}

impl LineTransform {
    /// Transforms of lines of `lengths` nodes.
    ///
    /// Not generic and never inlined: the planner and all its algorithms are compiled in this crate, and
    /// not again in each that makes a solver.
    #[inline(never)]
    pub(super) fn all(lengths: &[usize], boundary: Boundary) -> Vec<Self> {
        let mut planner = FftPlanner::new();
        let mut transform = |&n: &usize| Self {
            n,
            boundary,
            fft: planner.plan_fft_forward(2 * (n - 1)),
        };
        lengths.iter().map(&mut transform).collect()
    }

    /// Transforms lines that lie one after the other.
    pub(super) fn rows(&self, data: &mut [f64], ends: Ends, scratch: &mut LineScratch) {
        for batch in data.chunks_mut(BATCH * self.n) {
            let n_lines = batch.len() / self.n;
            let period = self.period();
            let buffer = self.run(n_lines.div_ceil(2), scratch, |buffer| {
                for (pair, line) in batch.chunks(2 * self.n).zip(buffer.chunks_mut(period)) {
                    let (a, b) = pair.split_at(self.n);
                    if b.is_empty() {
                        self.pack(line, ends, a.iter().map(|&re| Complex::new(re, 0.0)));
                    } else {
                        let both = a.iter().zip(b).map(|(&re, &im)| Complex::new(re, im));
                        self.pack(line, ends, both);
                    }
                }
            });
            for (pair, line) in batch.chunks_mut(2 * self.n).zip(buffer.chunks(period)) {
                let (a, b) = pair.split_at_mut(self.n);
                if b.is_empty() {
                    for (x, z) in a.iter_mut().zip(line) {
                        *x = self.parts(*z).0;
                    }
                } else {
                    for ((x, y), z) in a.iter_mut().zip(b.iter_mut()).zip(line) {
                        (*x, *y) = self.parts(*z);
                    }
                }
            }
        }
    }

    /// Transforms the columns of an array of `n` rows of `width` numbers.
    pub(super) fn columns(
        &self,
        data: &mut [f64],
        width: usize,
        ends: Ends,
        scratch: &mut LineScratch,
    ) {
        let period = self.period();
        for first in (0..width).step_by(BATCH) {
            let n_lines = BATCH.min(width - first);
            let buffer = self.run(n_lines.div_ceil(2), scratch, |buffer| {
                for (p, line) in buffer.chunks_mut(period).enumerate() {
                    let column = data[first + 2 * p..].chunks(width);
                    if 2 * p + 1 < n_lines {
                        self.pack(line, ends, column.map(|r| Complex::new(r[0], r[1])));
                    } else {
                        self.pack(line, ends, column.map(|r| Complex::new(r[0], 0.0)));
                    }
                }
            });
            for (p, line) in buffer.chunks(period).enumerate() {
                let column = &mut data[first + 2 * p..];
                let has_second = 2 * p + 1 < n_lines;
                for (row, z) in column.chunks_mut(width).zip(line) {
                    let (a, b) = self.parts(*z);
                    row[0] = a;
                    if has_second {
                        row[1] = b;
                    }
                }
            }
        }
    }

    fn period(&self) -> usize {
        2 * (self.n - 1)
    }

    /// Fills room for `n_pairs` extended lines, transforms them and hands them back.
    fn run<'s>(
        &self,
        n_pairs: usize,
        scratch: &'s mut LineScratch,
        fill: impl FnOnce(&mut [Complex<f64>]),
    ) -> &'s [Complex<f64>] {
        grow(&mut scratch.lines, n_pairs * self.period());
        grow(&mut scratch.fft, self.fft.get_inplace_scratch_len());
        let lines = &mut scratch.lines[..n_pairs * self.period()];
        fill(lines);
        self.fft.process_with_scratch(lines, &mut scratch.fft);
        lines
    }

    /// Writes the even or odd extension of two lines.
    #[inline(always)]
    fn pack(
        &self,
        line: &mut [Complex<f64>],
        ends: Ends,
        values: impl Iterator<Item = Complex<f64>>,
    ) {
        let (left, right) = line.split_at_mut(self.n);
        for (slot, value) in left.iter_mut().zip(values) {
            *slot = value;
        }
        let last = self.n - 1;
        let inner = left[1..last].iter().zip(right.iter_mut().rev());
        match self.boundary {
            Boundary::Natural => {
                inner.for_each(|(z, mirrored)| *mirrored = *z);
                if ends == Ends::Doubled {
                    left[0] *= 2.0;
                    left[last] *= 2.0;
                }
            }
            Boundary::Dirichlet => {
                inner.for_each(|(z, mirrored)| *mirrored = -*z);
                left[0] = Complex::ZERO;
                left[last] = Complex::ZERO;
            }
        }
    }

    /// The transforms of the two lines, from the one of their complex sum.
    #[inline(always)]
    fn parts(&self, z: Complex<f64>) -> (f64, f64) {
        match self.boundary {
            Boundary::Natural => (z.re, z.im),
            // The transform of an odd line `a` is `-i S`, that of `i b` is `S`.
            Boundary::Dirichlet => (-z.im, z.re),
        }
    }
}

fn grow(buffer: &mut Vec<Complex<f64>>, len: usize) {
    if buffer.len() < len {
        buffer.resize(len, Complex::ZERO);
    }
}
