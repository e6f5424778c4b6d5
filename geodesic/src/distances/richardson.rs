//! Lengths in the limit of infinitely many steps.

/// The limit of a number of which the error falls as `1 / K^order`, from its values for `K / 2`
/// and `K` steps: `fine + (fine - coarse) / (2^order - 1)`.
///
/// For the length of a discrete path from `A` to `B` the order is one in general: the third
/// derivative of the stored energy, and that each step is measured at its start, leave an error
/// `c / K`. A path run backwards has the same length in the limit and the error `-c / K`, since both
/// causes are odd in the velocity, and that of the minimiser enters squared. **The mean of both
/// directions therefore has order two**, and is to be extrapolated as such; to take it for first
/// order would double its error. (Disks in 2D are an exception: there already one direction has
/// order two.)
///
/// ```
/// use geodesic::distances::richardson;
/// let length = |steps: f64| 0.25 + 0.1 / steps;
/// assert!((richardson(length(2.0), length(4.0), 1) - 0.25).abs() < 1e-15);
/// ```
pub fn richardson(coarse: f64, fine: f64, order: u32) -> f64 {
    fine + (fine - coarse) / (f64::from(order).exp2() - 1.0)
}
