//! Parallel loops: every task once, results in order, on any number of threads.

use fe_grid::parallel::{all, for_each, for_each_chunk, for_each_index, for_each_mut};
use fe_grid::parallel::{map, n_threads, try_map};
use fe_grid::random::noise;
use proptest::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use test_support::on_threads;

proptest! {
    #[test]
    fn every_index_comes_once(n in 0usize..300, min_len in 0usize..400, threads in 1usize..4) {
        let counts: Vec<AtomicUsize> = (0..n).map(|_| AtomicUsize::new(0)).collect();
        on_threads(threads, || {
            for_each_index(n, min_len, &|i| {
                counts[i].fetch_add(1, Ordering::Relaxed);
            });
        });
        prop_assert!(counts.into_iter().all(|count| count.into_inner() == 1));
    }

    #[test]
    fn chunks_are_those_of_the_standard_library(
        n in 0usize..300,
        len in 1usize..40,
        min_len in 1usize..20,
        threads in 1usize..4,
    ) {
        let mut expected = vec![(0, 0, 0); n];
        for (i, part) in expected.chunks_mut(len).enumerate() {
            let size = part.len();
            for (k, entry) in part.iter_mut().enumerate() {
                *entry = (i, k, size);
            }
        }
        let mut found = vec![(0, 0, 0); n];
        on_threads(threads, || {
            for_each_chunk(&mut found, len, min_len, &|i, part| {
                let size = part.len();
                for (k, entry) in part.iter_mut().enumerate() {
                    *entry = (i, k, size);
                }
            });
        });
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn results_come_in_the_order_of_the_items(
        items in prop::collection::vec(".*", 0..100),
        threads in 1usize..4,
    ) {
        let expected: Vec<String> = items.iter().map(|item| item.repeat(2)).collect();
        let found = on_threads(threads, || map(items, &|item: String| item.repeat(2)));
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn the_first_failure_in_order_is_returned(
        good in prop::collection::vec(prop::bool::weighted(0.9), 0..100),
        threads in 1usize..4,
    ) {
        let work = |(i, good): (usize, &bool)| good.then_some(i).ok_or(i);
        let expected: Result<Vec<usize>, usize> = good.iter().enumerate().map(work).collect();
        let found = on_threads(threads, || try_map(good.iter().enumerate(), &work));
        prop_assert_eq!(found, expected);
        let holds = on_threads(threads, || all(&good, &|good| *good));
        prop_assert_eq!(holds, good.iter().all(|good| *good));
    }
}

#[test]
fn slices_can_be_cut_side_by_side() {
    let (mut x, mut y, z) = (noise(60, 1), noise(60, 2), noise(60, 3));
    let expected: Vec<f64> = (0..60).map(|i| x[i] + y[i] * z[i]).collect();
    on_threads(2, || {
        let parts = x.chunks_exact_mut(20).zip(y.chunks_exact_mut(20));
        for_each(parts.zip(z.chunks_exact(20)), &|((x, y), z)| {
            for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
                *y *= z;
                *x += *y;
            }
        });
    });
    assert_eq!(x, expected);
}

#[test]
fn entries_are_changed_in_place() {
    let mut squares: Vec<usize> = vec![1; 100];
    on_threads(2, || {
        for_each_mut(&mut squares, 3, &|i, entry| *entry += i * i);
    });
    assert!(squares.iter().enumerate().all(|(i, x)| *x == 1 + i * i));
}

#[test]
fn two_tasks_run_on_two_threads() {
    let both = Barrier::new(2);
    on_threads(2, || {
        assert_eq!(n_threads(), 2);
        for_each_index(2, 1, &|_| {
            both.wait();
        });
    });
}

/// A thread without outer tasks takes part in the inner loop of another.
#[test]
fn nested_loops_share_the_threads() {
    let both = Barrier::new(2);
    let found = on_threads(2, || {
        map(0..2, &|outer| {
            map(0..2 * outer, &|inner| {
                both.wait();
                inner
            })
        })
    });
    assert_eq!(found, [vec![], vec![0, 1]]);
}

/// Too few tasks for two threads stay with the caller, and in order.
#[test]
fn short_loops_are_serial() {
    let done = on_threads(3, || {
        let caller = std::thread::current().id();
        let next = AtomicUsize::new(0);
        for_each_index(7, 4, &|i| {
            assert_eq!(std::thread::current().id(), caller);
            assert_eq!(next.fetch_add(1, Ordering::Relaxed), i);
        });
        next.into_inner()
    });
    assert_eq!(done, 7);
}

#[test]
fn panics_reach_the_caller() {
    for threads in [1, 2] {
        let panic = catch_unwind(AssertUnwindSafe(|| {
            on_threads(threads, || {
                map(0..20, &|i| {
                    assert!(i != 13, "task {i}");
                    vec![i; 10]
                })
            })
        }));
        let message = panic.expect_err("the task panics");
        let message = message.downcast_ref::<String>().map(String::as_str);
        assert_eq!(message, Some("task 13"));
    }
}

#[test]
#[should_panic(expected = "parts without entries")]
fn parts_need_entries() {
    for_each_chunk(&mut [1.0], 0, 1, &|_, _| ());
}
