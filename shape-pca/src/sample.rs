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
    /// The degrees of freedom of their variance, for weights that add up to one
    /// `(1 - sum w^2)^2 / (sum w^2 - 2 sum w^3 + (sum w^2)^2)`: one less than the number of shapes where their
    /// weights are equal.
    ///
    /// Source: F. E. Satterthwaite, *An approximate distribution of estimates of variance components*, Biometrics
    /// Bulletin 2 (1946).
    pub degrees_of_freedom: f64,
}

impl SampleSize {
    /// The size of a sample of shapes of equal weight.
    pub fn equal(shapes: usize) -> Self {
        Self {
            shapes,
            effective: shapes as f64,
            degrees_of_freedom: shapes.saturating_sub(1) as f64,
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
        let power = |k: i32| -> f64 { counted.iter().map(|w| (w / sum).powi(k)).sum() };
        let (squares, cubes) = (power(2), power(3));
        Self {
            shapes: counted.len(),
            effective: squares.recip(),
            degrees_of_freedom: (1.0 - squares).powi(2)
                / (squares - 2.0 * cubes + squares * squares),
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
        // (1 - 3/8)^2 / (3/8 - 5/16 + 9/64).
        assert!((sample.degrees_of_freedom - 25.0 / 13.0).abs() < 1e-14);
        assert_eq!(SampleSize::without(&weights, 0), SampleSize::equal(2));
        assert_eq!(SampleSize::without(&weights, 1), sample);
        // As the formula has it where weights are equal but for rounding.
        let sample = SampleSize::of_weights(&[0.1, 0.1, 0.1 + 1e-15]);
        assert!((sample.degrees_of_freedom - 2.0).abs() < 1e-12);
        assert_eq!(SampleSize::of_weights(&[0.0]), SampleSize::equal(0));
    }
}
