//! Generic code, compiled once.
//!
//! Code that is generic over the dimension is compiled again in every crate, and in every test
//! program, that calls it. A [`Routine`] forwards to two functions that are not generic, one for 2D
//! and one for 3D: they are compiled with the crate that defines them, and callers of [`run`] only
//! link them. [`compiled_once!`](crate::compiled_once) generates both.
//!
//! **Invariant:** `D` is 2 or 3, checked when the code is compiled; then a type with `D` in it and the same
//! type with the number in its place are one type, and a value passes from one name to the other once.

use std::mem::ManuallyDrop;

/// A function of arguments that depend on the dimension, with a version for each dimension.
pub trait Routine {
    /// Arguments of the function.
    type Arguments<const D: usize>;
    /// Result of the function.
    type Output<const D: usize>;

    /// The function for `D = 2`.
    fn in_the_plane(arguments: Self::Arguments<2>) -> Self::Output<2>;

    /// The function for `D = 3`.
    fn in_space(arguments: Self::Arguments<3>) -> Self::Output<3>;
}

/// Runs the version for `D` dimensions, which have to be two or three.
pub fn run<R: Routine, const D: usize>(arguments: R::Arguments<D>) -> R::Output<D> {
    const { assert!(D == 2 || D == 3) };
    if D == 2 {
        // SAFETY: D is 2, so that both pairs of types are the same.
        unsafe {
            let arguments = renamed::<R::Arguments<D>, R::Arguments<2>>(arguments);
            renamed(R::in_the_plane(arguments))
        }
    } else {
        // SAFETY: D is 3, so that both pairs of types are the same.
        unsafe {
            let arguments = renamed::<R::Arguments<D>, R::Arguments<3>>(arguments);
            renamed(R::in_space(arguments))
        }
    }
}

/// A value by another name of its type.
///
/// # Safety
/// Both have to be the same type.
unsafe fn renamed<A, B>(value: A) -> B {
    debug_assert_eq!(size_of::<A>(), size_of::<B>());
    let value = ManuallyDrop::new(value);
    // SAFETY: the value is of type B, and is not used again.
    unsafe { std::mem::transmute_copy::<A, B>(&value) }
}

/// Writes a function that is generic over the dimension and calls another, private one, which
/// is compiled here for both dimensions and nowhere else.
///
/// All references that the function is given live as long as the lifetime that stands before the
/// dimension.
///
/// ```
/// use fe_grid::{Grid, compiled_once};
///
/// compiled_once! {
///     /// Some multiple of the numbers of nodes.
///     pub fn nodes<'a, D>(grid: &'a Grid<D>, factor: usize) -> [usize; D] = nodes_of;
/// }
///
/// fn nodes_of<const D: usize>(grid: &Grid<D>, factor: usize) -> [usize; D] {
///     grid.nodes_per_axis().map(|n| factor * n)
/// }
///
/// assert_eq!(nodes(&Grid::<2>::dyadic(2), 3), [15, 15]);
/// assert_eq!(nodes(&Grid::<3>::dyadic(1), 1), [3, 3, 3]);
/// ```
#[macro_export]
macro_rules! compiled_once {
    (
        $(#[$documentation:meta])*
        $visible:vis fn $name:ident<$life:lifetime, $D:ident>(
            $($argument:ident: $type:ty),+ $(,)?
        ) = $function:path;
    ) => {
        $crate::compiled_once! {
            $(#[$documentation])*
            $visible fn $name<$life, $D>($($argument: $type),+) -> () = $function;
        }
    };
    (
        $(#[$documentation:meta])*
        $visible:vis fn $name:ident<$life:lifetime, $D:ident>(
            $($argument:ident: $type:ty),+ $(,)?
        ) -> $output:ty = $function:path;
    ) => {
        $(#[$documentation])*
        $visible fn $name<$life, const $D: usize>($($argument: $type),+) -> $output {
            struct Once<$life>(std::marker::PhantomData<&$life ()>);

            impl<$life> $crate::dimension::Routine for Once<$life> {
                type Arguments<const $D: usize> = ($($type,)+);
                type Output<const $D: usize> = $output;

                #[inline(never)]
                fn in_the_plane(($($argument,)+): Self::Arguments<2>) -> Self::Output<2> {
                    $function($($argument),+)
                }

                #[inline(never)]
                fn in_space(($($argument,)+): Self::Arguments<3>) -> Self::Output<3> {
                    $function($($argument),+)
                }
            }

            $crate::dimension::run::<Once<$life>, $D>(($($argument,)+))
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Owned;

    impl Routine for Owned {
        type Arguments<const D: usize> = ([Vec<usize>; D], Arc<()>);
        type Output<const D: usize> = ([Vec<usize>; D], Arc<()>, usize);

        fn in_the_plane((all, counted): Self::Arguments<2>) -> Self::Output<2> {
            (all, counted, 2)
        }

        fn in_space((all, counted): Self::Arguments<3>) -> Self::Output<3> {
            (all, counted, 3)
        }
    }

    fn passes<const D: usize>() {
        let counted = Arc::new(());
        let all: [Vec<usize>; D] = std::array::from_fn(|k| vec![k; k + 1]);
        let (back, shared, dimension) = run::<Owned, D>((all.clone(), Arc::clone(&counted)));
        assert_eq!((back, dimension), (all, D));
        assert_eq!(Arc::strong_count(&counted), 2);
        drop(shared);
        assert_eq!(Arc::strong_count(&counted), 1);
    }

    /// What is passed on is neither dropped twice nor lost.
    #[test]
    fn values_pass_once() {
        passes::<2>();
        passes::<3>();
    }
}
