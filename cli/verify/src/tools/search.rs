//! Minima of functions of one number.

use crate::error::VerifyError;

/// The minimum of a function between two numbers, by golden-section search.
///
/// # Errors
/// Those of the function.
pub fn least(
    f: impl Fn(f64) -> Result<f64, VerifyError>,
    low: f64,
    high: f64,
) -> Result<f64, VerifyError> {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (low, high);
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut fc, mut fd) = (f(c)?, f(d)?);
    for _ in 0..80 {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - golden * (b - a);
            fc = f(c)?;
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + golden * (b - a);
            fd = f(d)?;
        }
    }
    Ok(0.5 * (a + b))
}
