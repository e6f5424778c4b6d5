//! Richardson extrapolation of lengths in the number of steps.

use fe_grid::mutant;

/// Computes the limit of a quantity whose error decreases as `1 / K^order`, from its values for
/// `K / 2` and `K` steps: `fine + (fine - coarse) / (2^order - 1)`.
///
/// For the length of a discrete path from `A` to `B` the order is one in general: the third
/// derivative of the stored energy, and the evaluation of each step's metric at its start, cause an
/// error `c / K`. The reversed path has the same length in the limit and the error `-c / K`, since
/// both causes are odd in the velocity, and the error of the minimiser enters squared. **The mean
/// of both directions therefore has order two**, and has to be extrapolated as such; extrapolation
/// with order one would double its error. (Disks in 2D are an exception: there each direction has
/// order two.)
///
/// ```
/// use geodesic::distances::richardson;
/// let length = |steps: f64| 0.25 + 0.1 / steps;
/// assert!((richardson(length(2.0), length(4.0), 1) - 0.25).abs() < 1e-15);
/// ```
pub fn richardson(coarse: f64, fine: f64, order: u32) -> f64 {
    let order = mutant!(order, RichardsonOrder => order - 1);
    fine + (fine - coarse) / (f64::from(order).exp2() - 1.0)
}
