//! Implicit shapes: functions whose sign distinguishes inside from outside.

/// A shape given by a function: positive inside, zero on the boundary, negative outside.
pub trait Implicit<const D: usize>: Sync {
    /// The function. Near the boundary it is the signed distance to first order.
    fn value(&self, point: [f64; D]) -> f64;

    /// The function is nowhere larger in size than this multiple of the distance to the boundary.
    fn stretch(&self) -> f64 {
        1.0
    }
}

impl<S: Implicit<D> + ?Sized, const D: usize> Implicit<D> for &S {
    fn value(&self, point: [f64; D]) -> f64 {
        (**self).value(point)
    }

    fn stretch(&self) -> f64 {
        (**self).stretch()
    }
}
