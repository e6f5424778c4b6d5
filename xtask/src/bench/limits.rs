//! Limits of the machine: rates of fused multiply-adds, and memory bandwidth.

use std::hint::black_box;
use std::sync::{Mutex, PoisonError};

use fe_grid::{Element, Lane, LaneKernel};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};

use super::measure::{Repetitions, Seconds, least_seconds};

/// Number of independent chains of multiply-adds: enough to hide their latency on two units, and
/// few enough for the registers.
const CHAINS: usize = 12;
/// Number of steps of every chain in a repetition.
const STEPS: usize = 4_000_000;
/// Sizes of the three arrays of the triad together, in MiB: from the near caches to memory.
pub const TRIAD_MEBIBYTES: [f64; 4] = [0.5, 5.0, 50.0, 768.0];

const REPETITIONS: Repetitions = Repetitions {
    least: 5,
    most: 30,
    seconds: 0.3,
};

/// The rate of `x = x m + a`, in FLOP/s, with one such chain of lanes for every register.
pub fn fma_peak<T: Element>(pool: &ThreadPool) -> f64 {
    let mut lanes = 1;
    let threads = pool.current_num_threads();
    let work = &mut || {
        let counts = pool.broadcast(|_| T::run_kernel(Chains));
        lanes = counts[0];
    };
    let seconds = least_of(pool, work);
    2.0 * (CHAINS * STEPS * lanes * threads) as f64 / seconds.cpu
}

/// `broadcast` inside a thread of the pool also waits for that thread.
fn least_of(pool: &ThreadPool, work: &mut (dyn FnMut() + Send)) -> Seconds {
    least_seconds(pool, REPETITIONS, work)
}

struct Chains;

impl<T: Element> LaneKernel<T> for Chains {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) -> usize {
        let factor = L::splat(black_box(0.999_999));
        let summand = L::splat(black_box(1e-6));
        let mut x = [L::zero(); CHAINS];
        for (i, x) in x.iter_mut().enumerate() {
            *x = L::splat(i as f64);
        }
        for _ in 0..STEPS {
            for x in &mut x {
                *x = x.mul_add(factor, summand);
            }
        }
        let mut sum = L::zero();
        for x in x {
            sum += x;
        }
        let mut first = [T::default(); fe_grid::MAX_LANES];
        sum.store(&mut first);
        black_box(first[0]);
        L::COUNT
    }
}

/// A rate of the triad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Size of the three arrays together.
    pub mebibytes: f64,
    /// Bytes per second.
    pub bytes_per_second: f64,
}

/// The rate of `a = b + 3 c` on arrays of a size. A byte that is read or written counts once, as
/// in STREAM: reads of memory that is overwritten are not counted.
pub fn triad<T: Element>(pool: &ThreadPool, mebibytes: f64) -> Triad {
    let n = (mebibytes * 1_048_576.0 / (3 * size_of::<T>()) as f64) as usize;
    let part = n.div_ceil(pool.current_num_threads()).max(1);
    let mut a = vec![T::default(); n];
    let b = vec![T::from_f64(1.0); n];
    let c = vec![T::from_f64(2.0); n];
    // Small arrays are processed several times, so that starting threads has no influence.
    let passes = (4_000_000 / n.max(1)).max(1);
    // Every thread has its own part, so that no thread takes over that of another.
    let rest = b.chunks(part).zip(c.chunks(part));
    let parts: Vec<Mutex<Sum<'_, T>>> = a
        .chunks_mut(part)
        .zip(rest)
        .map(|(a, (b, c))| Mutex::new(Sum { a, b, c }))
        .collect();
    let seconds = least_of(pool, &mut || {
        pool.broadcast(|thread| {
            let Some(part) = parts.get(thread.index()) else {
                return;
            };
            // A part is valid even if a thread panicked while it held the lock.
            let mut part = part.lock().unwrap_or_else(PoisonError::into_inner);
            let Sum { a, b, c } = &mut *part;
            for _ in 0..passes {
                T::run_kernel(Sum { a, b, c });
                black_box(&mut **a);
            }
        });
    });
    Triad {
        mebibytes,
        bytes_per_second: (3 * size_of::<T>() * n * passes) as f64 / seconds.cpu,
    }
}

struct Sum<'a, T> {
    a: &'a mut [T],
    b: &'a [T],
    c: &'a [T],
}

impl<T: Element> LaneKernel<T> for Sum<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let factor = L::splat(3.0);
        let parts = self.a.chunks_mut(L::COUNT);
        let rest = self.b.chunks(L::COUNT).zip(self.c.chunks(L::COUNT));
        for (a, (b, c)) in parts.zip(rest) {
            L::load(c).mul_add(factor, L::load(b)).store(a);
        }
    }
}

/// Limits of the machine for one storage type and one number of threads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// `f64` or `f32`.
    pub real: String,
    /// Number of threads.
    pub threads: usize,
    /// Floating-point operations per second, two for a multiply-add.
    pub flops_per_second: f64,
    /// The triad, from small arrays to large.
    pub triads: Vec<Triad>,
}

impl Limits {
    /// Measures the limits.
    pub fn measured<T: Element>(pool: &ThreadPool, real: &str) -> Self {
        Self {
            real: real.into(),
            threads: pool.current_num_threads(),
            flops_per_second: fma_peak::<T>(pool),
            triads: TRIAD_MEBIBYTES.map(|size| triad::<T>(pool, size)).to_vec(),
        }
    }

    /// Returns the maximum of each limit.
    pub fn highest(mut self, other: &Self) -> Self {
        self.flops_per_second = self.flops_per_second.max(other.flops_per_second);
        for (own, other) in self.triads.iter_mut().zip(&other.triads) {
            own.bytes_per_second = own.bytes_per_second.max(other.bytes_per_second);
        }
        self
    }

    /// Returns the triad for arrays of about a size, in bytes: the one with the nearest ratio.
    pub fn bandwidth(&self, bytes: f64) -> f64 {
        let away = |t: &&Triad| (t.mebibytes * 1_048_576.0 / bytes).ln().abs();
        let nearest = self
            .triads
            .iter()
            .min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map_or(f64::NAN, |t| t.bytes_per_second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_is_held_against_the_triad_of_its_own_size() {
        let triads = [(0.5, 8.0), (50.0, 3.0), (768.0, 1.0)];
        let limits = Limits {
            real: "f64".into(),
            threads: 1,
            flops_per_second: 1.0,
            triads: triads
                .map(|(mebibytes, bytes_per_second)| Triad {
                    mebibytes,
                    bytes_per_second,
                })
                .to_vec(),
        };
        let mebibytes = 1_048_576.0;
        assert_eq!(limits.bandwidth(0.1 * mebibytes), 8.0);
        assert_eq!(limits.bandwidth(20.0 * mebibytes), 3.0);
        assert_eq!(limits.bandwidth(5000.0 * mebibytes), 1.0);
    }

    #[test]
    fn the_triad_adds_what_it_says() {
        let mut a = [0.0f64; 19];
        let (b, c) = ([1.0; 19], [2.0; 19]);
        let sum = Sum {
            a: &mut a,
            b: &b,
            c: &c,
        };
        f64::run_kernel(sum);
        assert_eq!(a, [7.0; 19]);
    }
}
