//! The number of shapes that an average and its modes are of.

/// The size of a sample of shapes with weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleSize {
    /// Number of shapes whose weight is not zero.
    pub shapes: usize,
    /// The number of shapes of equal weight whose mean varies as much, `(sum w)^2 / sum w^2`: the number of shapes
    /// where their weights are equal.
    ///
    /// Source: L. Kish, *Survey sampling* (1965).
    pub effective: f64,
}

impl SampleSize {
    /// The size of a sample of shapes of equal weight.
    pub fn equal(shapes: usize) -> Self {
        Self {
            shapes,
            effective: shapes as f64,
        }
    }

    /// The size of a sample with these weights.
    pub fn of_weights(weights: &[f64]) -> Self {
        let counted: Vec<f64> = weights.iter().copied().filter(|w| *w > 0.0).collect();
        let first = counted.first().copied().unwrap_or(0.0);
        // Without rounding where it is a whole number.
        if counted.iter().all(|w| *w == first) {
            return Self::equal(counted.len());
        }
        let sum: f64 = counted.iter().sum();
        let squares: f64 = counted.iter().map(|w| w * w).sum();
        Self {
            shapes: counted.len(),
            effective: sum * sum / squares,
        }
    }

    /// The size of the sample without one of the shapes.
    pub fn without(weights: &[f64], shape: usize) -> Self {
        let others = weights.iter().enumerate().filter(|(i, _)| *i != shape);
        let others: Vec<f64> = others.map(|(_, w)| *w).collect();
        Self::of_weights(&others)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_shapes_count_less() {
        assert_eq!(SampleSize::of_weights(&[0.2; 5]), SampleSize::equal(5));
        let weights = [0.5, 0.0, 0.25, 0.25];
        let sample = SampleSize::of_weights(&weights);
        assert_eq!(sample.shapes, 3);
        assert!((sample.effective - 8.0 / 3.0).abs() < 1e-15);
        assert_eq!(SampleSize::without(&weights, 0), SampleSize::equal(2));
        assert_eq!(SampleSize::without(&weights, 1), sample);
        assert_eq!(SampleSize::of_weights(&[0.0]), SampleSize::equal(0));
    }
}
