//! Times of a kernel: the minimum over many repetitions.

use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};

use super::clock::thread_seconds;
use crate::outcome::Outcome;

/// Minimal times of a repetition, in seconds.
///
/// `cpu` is the largest processor time of a thread: the time of a repetition on idle cores. Figures
/// are based on it, as the wall time depends on the other load of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Processor time of the busiest thread.
    pub cpu: f64,
    /// Wall time.
    pub wall: f64,
}

impl Seconds {
    /// Infinite times.
    pub const NEVER: Self = Self {
        cpu: f64::INFINITY,
        wall: f64::INFINITY,
    };

    /// Returns the minimum of each time.
    pub fn least(self, other: Self) -> Self {
        Self {
            cpu: self.cpu.min(other.cpu),
            wall: self.wall.min(other.wall),
        }
    }
}

/// Number of repetitions of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct Repetitions {
    /// Minimal number of repetitions.
    pub least: usize,
    /// Maximal number of repetitions.
    pub most: usize,
    /// Wall time in seconds after which no further repetition starts.
    pub seconds: f64,
}

/// A pool of threads that outlives the kernels that run on it.
pub fn pool(threads: usize) -> Outcome<ThreadPool> {
    Ok(ThreadPoolBuilder::new().num_threads(threads).build()?)
}

/// Creates the pool of this process. A pool of one thread is the calling thread, so that no other
/// thread waits for work and counts of instructions do not vary.
pub fn use_threads(threads: usize) -> Outcome<()> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.max(1));
    let pool = if threads <= 1 {
        pool.use_current_thread()
    } else {
        pool
    };
    Ok(pool.build_global()?)
}

/// Measures the minimal times of `work` on the threads of a pool, after one run that is not
/// counted.
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
