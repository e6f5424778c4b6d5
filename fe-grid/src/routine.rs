//! Pointwise routines that are compiled once and entered by pointer.
//!
//! A kernel that calls a pointwise formula by its type is compiled again for every formula. A
//! [`CompiledRoutine`] holds one formula, compiled for the lanes that kernels run on, behind one
//! pointer a lane. A kernel that calls it is compiled once; the price is one indirect call for all the
//! points that are handed over together.
//!
//! **Invariant:** an entry is made by [`CompiledRoutine`] alone, for the type of its routine and for the lane
//! whose index it is stored at; lanes of other crates have no index.

use crate::lane::{Lane, LaneKernel};
use crate::simd::{COMPILED_LANES, LaneVisitor, VisitLanes};
use std::any::Any;
use std::marker::PhantomData;
use std::sync::Arc;

/// The arguments of a routine, a type for every lane.
pub trait RoutineArguments: 'static {
    /// The arguments in one lane.
    type In<'a, L: Lane>;
}

/// A pointwise routine with arguments `A`, written once for all lanes.
pub trait LaneRoutine<A: RoutineArguments>: Send + Sync + 'static {
    /// The routine; implementations are `#[inline(always)]`, as is all that they call.
    fn run<L: Lane>(&self, arguments: &mut A::In<'_, L>);
}

/// Enters a routine in one lane.
type Entry = unsafe fn(routine: *const (), arguments: *mut ());

/// A routine with arguments `A`, compiled for the lanes that kernels run on.
pub struct CompiledRoutine<A> {
    routine: Arc<dyn Any + Send + Sync>,
    entries: [Option<Entry>; COMPILED_LANES],
    arguments: PhantomData<fn(A)>,
}

impl<A> Clone for CompiledRoutine<A> {
    fn clone(&self) -> Self {
        Self {
            routine: Arc::clone(&self.routine),
            entries: self.entries,
            arguments: PhantomData,
        }
    }
}

impl<A> std::fmt::Debug for CompiledRoutine<A> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CompiledRoutine").finish_non_exhaustive()
    }
}

impl<A: RoutineArguments> CompiledRoutine<A> {
    /// Compiles a routine for lanes of `f64`, in the crate that calls this with a type of routine.
    pub fn new<R: LaneRoutine<A>>(routine: Arc<R>) -> Self {
        let mut entries = Entries::new();
        f64::visit_lanes(&mut entries);
        entries.of(routine)
    }

    /// The same for lanes of `f64` and of `f32`.
    pub fn in_both_precisions<R: LaneRoutine<A>>(routine: Arc<R>) -> Self {
        let mut entries = Entries::new();
        f64::visit_lanes(&mut entries);
        f32::visit_lanes(&mut entries);
        entries.of(routine)
    }

    /// Calls the routine.
    ///
    /// # Panics
    /// If the routine is not compiled for `L`: for lanes of `f32` unless it was made by
    /// [`CompiledRoutine::in_both_precisions`], and for numbers on which no kernel is run.
    #[inline(always)]
    pub fn call<L: Lane>(&self, arguments: &mut A::In<'_, L>) {
        let entry = L::COMPILED.and_then(|lane| self.entries[lane.index()]);
        let Some(entry) = entry else {
            panic!("the routine is not compiled for numbers of this type");
        };
        // SAFETY: the entry was made for the type of the routine and for `L`, the only lane with this
        // index. A kernel that runs in `L` was dispatched on a machine with its instruction set.
        unsafe {
            entry(
                Arc::as_ptr(&self.routine).cast(),
                std::ptr::from_mut(arguments).cast(),
            );
        }
    }
}

struct Entries<A, R> {
    entries: [Option<Entry>; COMPILED_LANES],
    routine: PhantomData<(A, R)>,
}

impl<A: RoutineArguments, R: LaneRoutine<A>> Entries<A, R> {
    fn new() -> Self {
        Self {
            entries: [None; COMPILED_LANES],
            routine: PhantomData,
        }
    }

    fn of(self, routine: Arc<R>) -> CompiledRoutine<A> {
        CompiledRoutine {
            routine,
            entries: self.entries,
            arguments: PhantomData,
        }
    }
}

impl<A: RoutineArguments, R: LaneRoutine<A>> LaneVisitor for Entries<A, R> {
    fn visit<L: Lane>(&mut self) {
        if let Some(lane) = L::COMPILED {
            self.entries[lane.index()] = Some(enter::<A, R, L>);
        }
    }
}

/// # Safety
/// `routine` points to an `R`, `arguments` to an `A::In<'_, L>` that nobody else uses, and the machine
/// has the instruction set of `L`.
unsafe fn enter<A: RoutineArguments, R: LaneRoutine<A>, L: Lane>(
    routine: *const (),
    arguments: *mut (),
) {
    // SAFETY: as the caller promises.
    let routine = unsafe { &*routine.cast::<R>() };
    L::vectorize(Body::<A, R, L> {
        routine,
        arguments,
        types: PhantomData,
    });
}

struct Body<'a, A, R, L> {
    routine: &'a R,
    arguments: *mut (),
    types: PhantomData<(A, L)>,
}

impl<A: RoutineArguments, R: LaneRoutine<A>, L: Lane> LaneKernel<L::Element> for Body<'_, A, R, L> {
    type Output = ();

    #[inline(always)]
    fn run<M: Lane<Element = L::Element>>(self) {
        // SAFETY: `M` is `L`, in which the kernel was started; see `enter`.
        let arguments = unsafe { &mut *self.arguments.cast::<A::In<'_, M>>() };
        self.routine.run::<M>(arguments);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum;

    impl RoutineArguments for Sum {
        type In<'a, L: Lane> = (&'a [L], L);
    }

    struct Times(f64);

    impl LaneRoutine<Sum> for Times {
        #[inline(always)]
        fn run<L: Lane>(&self, (terms, sum): &mut (&[L], L)) {
            for term in *terms {
                *sum = term.mul_add(L::splat(self.0), *sum);
            }
        }
    }

    #[test]
    fn a_routine_is_called_in_the_lanes_it_is_compiled_for() {
        let doubles = CompiledRoutine::new(Arc::new(Times(2.0)));
        let mut arguments = (&[1.0, 2.5][..], 1.0);
        doubles.clone().call::<f64>(&mut arguments);
        assert_eq!(arguments.1, 8.0);
        let both = CompiledRoutine::in_both_precisions(Arc::new(Times(0.5)));
        let mut arguments = (&[1.0f32, 2.5][..], 1.0f32);
        both.call::<f32>(&mut arguments);
        assert_eq!(arguments.1, 2.75);
        let call = || doubles.call::<f32>(&mut (&[1.0f32][..], 1.0f32));
        let refused = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call));
        assert!(refused.is_err());
    }
}
