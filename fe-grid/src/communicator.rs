//! Processes that work on one problem together.
//!
//! A [`Communicator`] passes messages between them: over MPI where a program provides that, or
//! between threads of one process ([`on_threads`]), which is what tests use. Every process runs the same
//! program; a collective function returns when all processes have called it.
//!
//! Sums are requested only of numbers whose sum is exact, see [`crate::Distribution`]: a communicator may
//! add in any order.

use std::collections::VecDeque;
use std::fmt::Debug;
use std::sync::{Arc, Barrier, Mutex, PoisonError};

/// Messages between processes.
///
/// A process that cannot go on ends the others, too: no function reports an error.
pub trait Communicator: Debug + Send + Sync {
    /// The number of this process, from 0.
    fn rank(&self) -> usize;

    /// The number of processes.
    fn size(&self) -> usize;

    /// Replaces numbers by their sums over all processes. Collective.
    fn sum(&self, values: &mut [f64]);

    /// Replaces numbers by their largest over all processes. Collective.
    fn maximum(&self, values: &mut [f64]);

    /// Overwrites numbers by those of one process. Collective.
    fn broadcast(&self, root: usize, values: &mut [f64]);

    /// Returns the numbers of all processes, one process after the other, on the first process, and
    /// nothing on the others. Collective.
    fn gather(&self, values: &[f64]) -> Option<Vec<f64>>;

    /// Sends bytes to another process, which receives those of one sender in their order.
    fn send(&self, to: usize, message: &[u8]);

    /// Returns bytes that have arrived, with the sender; `None` where there are none yet.
    fn receive(&self) -> Option<(usize, Vec<u8>)>;
}

/// One process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Communicator for Alone {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn sum(&self, _values: &mut [f64]) {}

    fn maximum(&self, _values: &mut [f64]) {}

    fn broadcast(&self, _root: usize, _values: &mut [f64]) {}

    fn gather(&self, values: &[f64]) -> Option<Vec<f64>> {
        Some(values.to_vec())
    }

    fn send(&self, _to: usize, _message: &[u8]) {}

    fn receive(&self) -> Option<(usize, Vec<u8>)> {
        None
    }
}

/// Runs work on several threads, each with a communicator as if it were a process; returns the results
/// in the order of the ranks.
///
/// Even ranks add in their order, odd ranks in the opposite one: a sum that is not exact differs.
///
/// # Panics
/// If the work panics.
pub fn on_threads<R: Send>(
    size: usize,
    work: &(dyn Fn(Arc<dyn Communicator>) -> R + Sync),
) -> Vec<R> {
    let board = Arc::new(Board {
        posted: Mutex::new(vec![Vec::new(); size]),
        barrier: Barrier::new(size),
        messages: (0..size).map(|_| Mutex::default()).collect(),
    });
    std::thread::scope(|scope| {
        let start = |rank| {
            let board = Arc::clone(&board);
            scope.spawn(move || work(Arc::new(OfThread { rank, size, board })))
        };
        let threads: Vec<_> = (0..size).map(start).collect();
        let join = |thread: std::thread::ScopedJoinHandle<'_, R>| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        threads.into_iter().map(join).collect()
    })
}

/// Where threads post their numbers.
#[derive(Debug)]
struct Board {
    posted: Mutex<Vec<Vec<f64>>>,
    barrier: Barrier,
    /// For every thread what has arrived.
    messages: Vec<Mutex<VecDeque<(usize, Vec<u8>)>>>,
}

/// The communicator of one thread.
#[derive(Debug)]
struct OfThread {
    rank: usize,
    size: usize,
    board: Arc<Board>,
}

impl OfThread {
    /// Posts numbers, and reads those of all threads.
    fn exchange(&self, values: &[f64], read: impl FnOnce(&[Vec<f64>])) {
        let lock = || {
            self.board
                .posted
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        lock()[self.rank] = values.to_vec();
        self.board.barrier.wait();
        read(&lock());
        self.board.barrier.wait();
    }

    fn reduce(&self, values: &mut [f64], join: impl Fn(f64, f64) -> f64) {
        let own = values.to_vec();
        self.exchange(&own, |all| {
            let mut order: Vec<&Vec<f64>> = all.iter().collect();
            if self.rank % 2 == 1 {
                order.reverse();
            }
            for (i, value) in values.iter_mut().enumerate() {
                let mut numbers = order.iter().map(|posted| posted[i]);
                let first = numbers.next().unwrap_or(*value);
                *value = numbers.fold(first, &join);
            }
        });
    }
}

impl Communicator for OfThread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn sum(&self, values: &mut [f64]) {
        self.reduce(values, |a, b| a + b);
    }

    fn maximum(&self, values: &mut [f64]) {
        self.reduce(values, f64::max);
    }

    fn broadcast(&self, root: usize, values: &mut [f64]) {
        let own = values.to_vec();
        self.exchange(&own, |all| values.copy_from_slice(&all[root]));
    }

    fn gather(&self, values: &[f64]) -> Option<Vec<f64>> {
        let mut gathered = None;
        self.exchange(values, |all| {
            gathered = (self.rank == 0).then(|| all.concat());
        });
        gathered
    }

    fn send(&self, to: usize, message: &[u8]) {
        let mut arrived = self.board.messages[to]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        arrived.push_back((self.rank, message.to_vec()));
    }

    fn receive(&self) -> Option<(usize, Vec<u8>)> {
        let arrived = self.board.messages[self.rank].lock();
        arrived.unwrap_or_else(PoisonError::into_inner).pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_sum_compare_broadcast_and_gather() {
        let found = on_threads(3, &|communicator| {
            let rank = communicator.rank() as f64;
            let (mut sum, mut most, mut second) = ([rank, 1.0], [rank, -rank], [10.0 + rank]);
            communicator.sum(&mut sum);
            communicator.maximum(&mut most);
            communicator.broadcast(1, &mut second);
            // Of different lengths.
            let own = vec![rank; communicator.rank() + 1];
            (sum, most, second, communicator.gather(&own))
        });
        for (sum, most, second, _) in &found {
            assert_eq!((*sum, *most, *second), ([3.0, 3.0], [2.0, 0.0], [11.0]));
        }
        assert_eq!(found[0].3, Some(vec![0.0, 1.0, 1.0, 2.0, 2.0, 2.0]));
        assert!(found[1].3.is_none() && found[2].3.is_none());
    }

    #[test]
    fn threads_send_and_receive() {
        let found = on_threads(2, &|communicator: Arc<dyn Communicator>| {
            let rank = communicator.rank();
            communicator.send(1 - rank, &[rank as u8]);
            communicator.send(1 - rank, b"last");
            let next = || loop {
                if let Some(message) = communicator.receive() {
                    return message;
                }
            };
            [next(), next()]
        });
        for (rank, messages) in found.into_iter().enumerate() {
            let other = 1 - rank;
            let expected = [vec![other as u8], b"last".to_vec()];
            assert_eq!(messages, expected.map(|message| (other, message)));
        }
    }

    #[test]
    fn one_process_has_its_own_numbers() {
        let mut numbers = [1.0, 2.0];
        Alone.sum(&mut numbers);
        Alone.maximum(&mut numbers);
        Alone.broadcast(0, &mut numbers);
        assert_eq!(Alone.gather(&numbers), Some(vec![1.0, 2.0]));
    }
}
