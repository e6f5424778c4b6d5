//! Parallel loops on the threads of the current pool.
//!
//! The loops take their body as `&dyn Fn`, and all end in [`for_each_index`], which is not
//! generic: the scheduler is compiled once, in this crate, and not again for every closure of
//! every crate. A body is called once a task, through a pointer; tasks are therefore slabs of
//! cells, chunks of vectors, or shapes, and never single numbers.
//!
//! - A few large tasks: [`for_each`], [`map`], [`try_map`] and [`all`] take any iterator.
//! - Many small ones: [`for_each_index`], [`for_each_mut`] and [`for_each_chunk`] allocate nothing,
//!   and give a thread at least `min_len` tasks at a time.
//!
//! Results are in the order of the tasks, and loops may be nested. A panic in a body is propagated
//! to the caller.
//!
//! **Invariant:** each part of a slice is handed out once, no two parts overlap, and the slice is borrowed
//! until all threads are done with it.

use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Returns the number of threads of the current pool.
pub fn n_threads() -> usize {
    rayon::current_num_threads()
}

/// Calls `work` once with each number below `n`. A thread gets at least `min_len` consecutive
/// numbers; if there are not enough for two threads, or there is one only, the caller executes all.
///
/// A caller that is no thread of the pool would hand every loop over to the only thread and wait for it.
pub fn for_each_index(n: usize, min_len: usize, work: &(dyn Fn(usize) + Sync)) {
    if n / 2 < min_len || n_threads() == 1 {
        (0..n).for_each(work);
    } else {
        (0..n).into_par_iter().with_min_len(min_len).for_each(work);
    }
}

/// Calls `work(i, part)` for each part of `len` entries of `x`; the last may be shorter.
///
/// # Panics
/// If `len` is zero.
pub fn for_each_chunk<T: Send>(
    x: &mut [T],
    len: usize,
    min_len: usize,
    work: &(dyn Fn(usize, &mut [T]) + Sync),
) {
    assert!(len > 0, "parts without entries");
    let total = x.len();
    let start = Start(x.as_mut_ptr());
    for_each_index(total.div_ceil(len), min_len, &|i| {
        let first = i * len;
        // SAFETY: `first < total`, and the part ends at `total` at the latest. Each `i` comes once,
        // so that no two parts overlap, and `x` is borrowed until all are done.
        let part = unsafe {
            let first = start.get().add(first);
            std::slice::from_raw_parts_mut(first, len.min(total - i * len))
        };
        work(i, part);
    });
}

/// Where the entries of a slice start.
struct Start<T>(*mut T);

// SAFETY: threads reach entries of their own only, which may be sent to them.
unsafe impl<T: Send> Sync for Start<T> {}

impl<T> Start<T> {
    fn get(&self) -> *mut T {
        self.0
    }
}

/// Calls `work(i, x_i)` for each entry of `x`.
pub fn for_each_mut<T: Send>(x: &mut [T], min_len: usize, work: &(dyn Fn(usize, &mut T) + Sync)) {
    for_each_chunk(x, 1, min_len, &|i, part| work(i, &mut part[0]));
}

/// Calls `work` with each item.
pub fn for_each<I: Send>(items: impl IntoIterator<Item = I>, work: &(dyn Fn(I) + Sync)) {
    let mut items: Vec<Option<I>> = items.into_iter().map(Some).collect();
    for_each_mut(&mut items, 1, &|_, item| {
        if let Some(item) = item.take() {
            work(item);
        }
    });
}

/// Returns the results of `work` for each item, in their order.
pub fn map<I: Send, R: Send>(
    items: impl IntoIterator<Item = I>,
    work: &(dyn Fn(I) -> R + Sync),
) -> Vec<R> {
    let mut tasks: Vec<(Option<I>, Option<R>)> =
        items.into_iter().map(|item| (Some(item), None)).collect();
    for_each_mut(&mut tasks, 1, &|_, (item, result)| {
        *result = item.take().map(work);
    });
    tasks.into_iter().filter_map(|(_, result)| result).collect()
}

/// Returns the results of `work` for each item, in their order.
///
/// # Errors
/// The first failure in the order of the items; later items may then not be processed.
pub fn try_map<I: Send, R: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    work: &(dyn Fn(I) -> Result<R, E> + Sync),
) -> Result<Vec<R>, E> {
    let failed = AtomicUsize::new(usize::MAX);
    let results = map(items.into_iter().enumerate(), &|(i, item)| {
        if i > failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = work(item);
        if result.is_err() {
            failed.fetch_min(i, Ordering::Relaxed);
        }
        Some(result)
    });
    results.into_iter().flatten().collect()
}

/// Returns whether `test` holds for all items; once it fails for one, others may be skipped.
pub fn all<I: Send>(items: impl IntoIterator<Item = I>, test: &(dyn Fn(I) -> bool + Sync)) -> bool {
    let holds = AtomicBool::new(true);
    for_each(items, &|item| {
        if holds.load(Ordering::Relaxed) && !test(item) {
            holds.store(false, Ordering::Relaxed);
        }
    });
    holds.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_belongs_to_one_part() {
        for (total, len) in [(0, 3), (1, 3), (7, 3), (9, 3), (10, 20)] {
            let mut entries: Vec<Vec<usize>> = vec![Vec::new(); total];
            for_each_chunk(&mut entries, len, 1, &|part, chunk| {
                for entry in chunk {
                    entry.push(part);
                }
            });
            let found: Vec<usize> = entries.into_iter().flatten().collect();
            let expected: Vec<usize> = (0..total).map(|i| i / len).collect();
            assert_eq!(found, expected);
        }
    }
}
