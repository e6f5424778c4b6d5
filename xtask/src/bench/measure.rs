//! Times of a kernel: the minimum over many repetitions.

use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};

use super::clock::thread_seconds;
use crate::outcome::Outcome;

/// Least times of a repetition, in seconds.
///
/// `cpu` is the processor time of the thread that had most of it: what the repetition would take
/// on idle cores. It is what figures are made of; wall time on a machine that does other work
/// measures the other work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Processor time of the busiest thread.
    pub cpu: f64,
    /// Wall time.
    pub wall: f64,
}

impl Seconds {
    /// Longer than anything.
    pub const NEVER: Self = Self {
        cpu: f64::INFINITY,
        wall: f64::INFINITY,
    };

    /// The lesser of each.
    pub fn least(self, other: Self) -> Self {
        Self {
            cpu: self.cpu.min(other.cpu),
            wall: self.wall.min(other.wall),
        }
    }
}

/// How often a kernel is repeated.
#[derive(Clone, Copy, Debug)]
pub struct Repetitions {
    /// At least so many times.
    pub least: usize,
    /// At most so many times.
    pub most: usize,
    /// Wall seconds after which it is enough.
    pub seconds: f64,
}

/// A pool of threads that outlives the kernels that run on it.
pub fn pool(threads: usize) -> Outcome<ThreadPool> {
    Ok(ThreadPoolBuilder::new().num_threads(threads).build()?)
}

/// Makes the pool of this process. One thread is the one that calls, so that no other waits for work
/// and counts of instructions do not vary.
pub fn use_threads(threads: usize) -> Outcome<()> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.max(1));
    let pool = if threads <= 1 {
        pool.use_current_thread()
    } else {
        pool
    };
    Ok(pool.build_global()?)
}

/// The least times of `work` on the threads of a pool, after one run that is not counted.
pub fn least_seconds(
    pool: &ThreadPool,
    repetitions: Repetitions,
    work: &mut (dyn FnMut() + Send),
) -> Seconds {
    pool.install(&mut *work);
    let start = Instant::now();
    let mut least = Seconds::NEVER;
    let mut done = 0;
    while done < repetitions.least
        || done < repetitions.most && start.elapsed().as_secs_f64() < repetitions.seconds
    {
        let before = pool.broadcast(|_| thread_seconds());
        let clock = Instant::now();
        pool.install(&mut *work);
        let wall = clock.elapsed().as_secs_f64();
        let after = pool.broadcast(|_| thread_seconds());
        let spent = after.iter().zip(&before).map(|(a, b)| a - b);
        let cpu = spent.fold(0.0, f64::max);
        least = least.least(Seconds { cpu, wall });
        done += 1;
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_run_is_not_counted_and_the_least_times_are_kept() {
        let pool = pool(2).unwrap();
        let mut runs = 0;
        let repetitions = Repetitions {
            least: 3,
            most: 9,
            seconds: 0.0,
        };
        let mut work = || {
            runs += 1;
            let start = thread_seconds();
            while thread_seconds() - start < 0.001 {
                std::hint::spin_loop();
            }
        };
        let least = least_seconds(&pool, repetitions, &mut work);
        assert_eq!(runs, 4);
        assert!(least.cpu >= 0.001 && least.wall.is_finite());
        let other = Seconds {
            cpu: 0.0,
            wall: f64::INFINITY,
        };
        assert_eq!(least.least(other), Seconds { cpu: 0.0, ..least });
    }
}
