//! A problem of many equal parts, such as the shapes of an average, that are distributed to processes.
//!
//! A [`Distribution`] gives every process a run of consecutive parts. Vectors of unknowns have the parts
//! of this process, one after the other. What all parts share, such as a scalar product or the sum of
//! nodal fields, has the same bits on any number of processes:
//! - numbers of each part are exchanged, and added in the order of the parts;
//! - of fields, the terms are rounded to multiples of one power of two, so small that their sum is less
//!   than `2^53` of it: such sums are exact ([`Quantum`]), hence independent of the order.

use crate::communicator::{Alone, Communicator};
use crate::lane::Element;
use crate::parallel;
use crate::vector;
use std::ops::Range;
use std::sync::Arc;

/// Which parts of a problem this process has.
#[derive(Clone, Debug)]
pub struct Distribution {
    communicator: Arc<dyn Communicator>,
    n_parts: usize,
    own: Range<usize>,
}

impl Distribution {
    /// All parts on this process.
    pub fn alone(n_parts: usize) -> Self {
        Self::over(Arc::new(Alone), n_parts)
    }

    /// Parts in equal shares: the first processes have one more where they cannot be equal, and the
    /// last have none where there are more processes than parts.
    pub fn over(communicator: Arc<dyn Communicator>, n_parts: usize) -> Self {
        Self {
            own: Self::range(communicator.rank(), communicator.size(), n_parts),
            n_parts,
            communicator,
        }
    }

    /// The parts of a process.
    fn range(rank: usize, size: usize, n_parts: usize) -> Range<usize> {
        let (share, more) = (n_parts / size, n_parts % size);
        let start = |rank: usize| rank * share + rank.min(more);
        start(rank)..start(rank + 1)
    }

    /// The same processes with another number of parts.
    #[must_use]
    pub fn of(&self, n_parts: usize) -> Self {
        Self::over(Arc::clone(&self.communicator), n_parts)
    }

    /// Number of parts of all processes.
    pub fn n_parts(&self) -> usize {
        self.n_parts
    }

    /// The parts of this process.
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// Whether there is one process.
    pub fn is_alone(&self) -> bool {
        self.communicator.size() == 1
    }

    /// Whether this is the first process.
    pub fn is_first(&self) -> bool {
        self.communicator.rank() == 0
    }

    /// The processes.
    pub fn communicator(&self) -> &dyn Communicator {
        &*self.communicator
    }

    /// Returns the numbers of all parts on all processes, given those of the own parts, as many for each.
    /// Collective.
    ///
    /// # Panics
    /// If there is not a row of numbers for every own part.
    pub fn share<const N: usize>(&self, own: &[[f64; N]]) -> Vec<[f64; N]> {
        assert_eq!(own.len(), self.own.len());
        if self.is_alone() {
            return own.to_vec();
        }
        let mut all = vec![[0.0; N]; self.n_parts];
        all[self.own()].copy_from_slice(own);
        // All but one of the terms of each sum are zero.
        self.communicator.sum(all.as_flattened_mut());
        all
    }

    /// Returns the vectors of all parts on all processes, given those of the own parts, all of one length.
    /// Collective.
    ///
    /// # Panics
    /// If there is not a vector of this length for every own part.
    pub fn share_vectors(&self, own: Vec<Vec<f64>>, len: usize) -> Vec<Vec<f64>> {
        assert_eq!(own.len(), self.own.len());
        assert!(own.iter().all(|x| x.len() == len));
        let mut all = own;
        if self.is_alone() {
            return all;
        }
        let mut own = all.into_iter();
        all = Vec::with_capacity(self.n_parts);
        for root in 0..self.communicator.size() {
            for _ in Self::range(root, self.communicator.size(), self.n_parts) {
                let mine = root == self.communicator.rank();
                let next = if mine { own.next() } else { None };
                let mut vector = next.unwrap_or_else(|| vec![0.0; len]);
                self.communicator.broadcast(root, &mut vector);
                all.push(vector);
            }
        }
        all
    }

    /// Whether something is true on all processes. Collective.
    pub fn all(&self, own: bool) -> bool {
        let mut failures = [if own { 0.0 } else { 1.0 }];
        self.communicator.maximum(&mut failures);
        failures[0] == 0.0
    }

    /// The scalar product of two vectors of unknowns: of each part, then their sum in the order of the
    /// parts. Collective.
    ///
    /// # Panics
    /// If the lengths differ, or are no multiple of the number of own parts.
    pub fn dot<T: Element, U: Element>(&self, x: &[T], y: &[U]) -> f64 {
        assert_eq!(x.len(), y.len());
        self.sum_of_parts(x.len(), &|part| vector::dot(&x[part.clone()], &y[part]))
    }

    /// The sum of a number for each part, which `of` computes for the range of a part in vectors of `len`
    /// unknowns, in the order of the parts. Collective.
    ///
    /// # Panics
    /// If the length is no multiple of the number of own parts.
    pub(crate) fn sum_of_parts(
        &self,
        len: usize,
        of: &(dyn Fn(Range<usize>) -> f64 + Sync),
    ) -> f64 {
        let n = self.own.len();
        assert!(len == 0 || len.is_multiple_of(n.max(1)));
        let dim = len / n.max(1);
        let own = parallel::map(0..n, &|i| [of(i * dim..(i + 1) * dim)]);
        self.share(&own).iter().map(|[number]| number).sum()
    }

    /// Euclidean norm of a vector of unknowns. Collective.
    pub fn norm<T: Element>(&self, x: &[T]) -> f64 {
        self.dot(x, x).sqrt()
    }

    /// Largest absolute value of the difference of two vectors of unknowns, NaN where any entry is.
    /// Collective.
    pub fn max_abs_difference<T: Element, U: Element>(&self, x: &[T], y: &[U]) -> f64 {
        let own = vector::max_abs_difference(x, y);
        // Maxima of communicators may pass over NaN.
        let mut found = [own.max(0.0), f64::from(u8::from(own.is_nan()))];
        self.communicator.maximum(&mut found);
        if found[1] > 0.0 { f64::NAN } else { found[0] }
    }

    /// The sum of one vector for each part, exact but for the rounding of the entries to a multiple of the
    /// largest times `2^-50`. Collective.
    ///
    /// # Panics
    /// If there is not a vector for every own part, of this length.
    pub fn sum_vectors(&self, own: &[Vec<f64>], len: usize) -> Vec<f64> {
        assert_eq!(own.len(), self.own.len());
        let most = own.iter().map(|x| vector::max_abs(x));
        let mut most = [most.fold(0.0, f64::max)];
        self.communicator.maximum(&mut most);
        let quantum = Quantum::of_sums(most[0] * self.n_parts as f64);
        let mut sum = vec![0.0; len];
        for x in own {
            assert_eq!(x.len(), len);
            for (sum, x) in sum.iter_mut().zip(x) {
                *sum += quantum.round(*x);
            }
        }
        self.communicator.sum(&mut sum);
        sum
    }

    /// Returns the vector of unknowns of all parts on the first process, and nothing on the others.
    /// Collective.
    pub fn gather(&self, own: &[f64]) -> Option<Vec<f64>> {
        self.communicator.gather(own)
    }
}

/// A power of two that all terms of a sum are multiples of: as long as the sum is less than `2^53` times as
/// large, no addition rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantum {
    /// `1.5 * 2^52` times the power: numbers about this size are multiples of it.
    shift: f64,
}

impl Quantum {
    /// The power for sums whose terms have absolute values that add up to less than this. Where it is
    /// zero, or not finite, there is nothing to round.
    pub fn of_sums(most: f64) -> Self {
        if !(most > f64::MIN_POSITIVE && most < 1e290) {
            return Self { shift: 0.0 };
        }
        // The next power of two above, exactly.
        let above = f64::from_bits((most.to_bits() >> 52 << 52) + (1 << 52));
        Self { shift: 3.0 * above }
    }

    /// The nearest multiple, half way the even one.
    #[inline(always)]
    pub fn round(self, x: f64) -> f64 {
        (x + self.shift) - self.shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::communicator::on_threads;
    use crate::random::SplitMix64;

    /// Parts with entries of very different sizes.
    fn vectors(n_parts: usize, len: usize) -> Vec<Vec<f64>> {
        let mut random = SplitMix64::new(7);
        let mut entry = || {
            let size = 10f64.powi((random.between(-12.0, 3.0)) as i32);
            random.between(-1.0, 1.0) * size
        };
        let mut vector = || (0..len).map(|_| entry()).collect();
        (0..n_parts).map(|_| vector()).collect()
    }

    /// With five processes for four parts the last has none.
    #[test]
    fn all_numbers_have_the_same_bits_on_any_number_of_processes() {
        let (n, len) = (4, 1000);
        let (x, y) = (vectors(n, len), vectors(n, len));
        let on = |size: usize| {
            on_threads(size, &|communicator: Arc<dyn Communicator>| {
                let distribution = Distribution::over(communicator, n);
                let own = distribution.own();
                let [flat_x, flat_y] = [&x, &y].map(|x| x[own.clone()].concat());
                let sum = distribution.sum_vectors(&x[own.clone()], len);
                let numbers: Vec<[f64; 1]> = own.clone().map(|i| [x[i][0]]).collect();
                (
                    distribution.dot(&flat_x, &flat_y),
                    distribution.max_abs_difference(&flat_x, &flat_y),
                    sum,
                    distribution.share(&numbers),
                    distribution.share_vectors(x[own].to_vec(), len),
                )
            })
        };
        let alone = on(1).remove(0);
        assert_eq!(alone.4, x);
        assert!((0..n).all(|i| alone.3[i][0] == x[i][0]));
        let largest = x.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
        for i in 0..len {
            let plain: f64 = x.iter().map(|x| x[i]).sum();
            // Every term is rounded to a multiple of at most 2^-50 times the sum of the largest.
            let rounding = n as f64 * largest * n as f64 * f64::powi(2.0, -50);
            assert!((alone.2[i] - plain).abs() <= rounding, "{i}");
        }
        for size in [2, 3, 5] {
            for found in on(size) {
                assert!(found == alone, "{size} processes");
            }
        }
    }

    #[test]
    fn sums_of_rounded_numbers_are_exact() {
        let x = vectors(1, 4000).remove(0);
        let most: f64 = x.iter().map(|x| x.abs()).sum();
        let quantum = Quantum::of_sums(most);
        let rounded: Vec<f64> = x.iter().map(|x| quantum.round(*x)).collect();
        let forwards: f64 = rounded.iter().sum();
        let backwards: f64 = rounded.iter().rev().sum();
        assert_eq!(forwards, backwards);
        // Without being rounded they are not.
        assert_ne!(x.iter().sum::<f64>(), x.iter().rev().sum::<f64>());
        // Nothing to round, or no power of two that would do.
        for most in [0.0, f64::INFINITY, f64::NAN] {
            assert_eq!(Quantum::of_sums(most).round(0.1), 0.1);
        }
    }

    #[test]
    fn nan_is_not_passed_over() {
        let found = on_threads(2, &|communicator: Arc<dyn Communicator>| {
            let x = [1.0, [2.0, f64::NAN][communicator.rank()]];
            Distribution::over(communicator, 2).max_abs_difference(&x, &[0.0; 2])
        });
        assert!(found.iter().all(|x| x.is_nan()));
    }
}
