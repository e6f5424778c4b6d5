//! Parameters of averages.

use shape_average::AverageParams;

/// Parameters of averages that are minimised closely.
pub fn close() -> AverageParams {
    AverageParams {
        tolerance: 2e-4,
        max_iterations: 300,
        ..AverageParams::default()
    }
}
