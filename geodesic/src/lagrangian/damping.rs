//! The damping of the metric of a path.
//!
//! The Gauss–Newton step of a mismatch moves a boundary to its goal at once. Where limbs have to grow, that is
//! several cells, and the thin cells of the void in front of them would fold: the whole step is shortened, often to a
//! hundredth, along a direction that hardly differs from the last. As in the method of Levenberg and
//! Marquardt the elastic part of the metric is therefore multiplied by a factor, which spreads the
//! strain of a step over a wider zone. The factor follows the shares of the steps that are left.

/// Factor at the start of every level. Without damping the first steps collapse cells, and paths end in jams: of 40
/// paths between silhouettes of seven classes, 65 x 65, 29 arrived and 35 converged, and 32 and 40 do
/// with it, for 15 % fewer evaluations.
const FIRST: f64 = 64.0;
/// Share of the steps that is aimed at, as a power of two: no more than a third of a step is needed
/// where it decreases the energy, and next to folding it is of no use.
const AIM: f64 = -1.5;
/// Change of the factor per change of the share, both as powers of two, up and down. Down it is fast, as
/// shapes that are near each other need no damping.
const GAIN: [f64; 2] = [0.5, 1.0];
/// Largest change of the factor at once, as a power of two.
const LARGEST_CHANGE: f64 = 2.0;
/// Largest factor; the least is 1.
const LARGEST: f64 = 1e4;
/// Least share that is counted: steps shortened to nothing say no more.
const LEAST_SHARE: f64 = 1e-6;

/// The factor of the elastic part of the metric.
pub(super) struct Damping {
    factor: f64,
    /// Sum of the binary logarithms of the shares since the last change, and their number.
    sum: f64,
    count: f64,
}

impl Default for Damping {
    fn default() -> Self {
        Self {
            factor: FIRST,
            sum: 0.0,
            count: 0.0,
        }
    }
}

impl Damping {
    /// Remembers that a share of a step was left.
    pub fn observe(&mut self, share: f64) {
        self.sum += share.max(LEAST_SHARE).log2();
        self.count += 1.0;
    }

    /// Adapts the factor to the shares since the last call, and returns it.
    pub fn adapt(&mut self) -> f64 {
        if self.count > 0.0 {
            let excess = AIM - self.sum / self.count;
            let [up, down] = GAIN;
            let gain = if excess > 0.0 { up } else { down };
            let change = (gain * excess).clamp(-LARGEST_CHANGE, LARGEST_CHANGE);
            self.factor = (self.factor * change.exp2()).clamp(1.0, LARGEST);
            (self.sum, self.count) = (0.0, 0.0);
        }
        self.factor
    }

    /// What a resumed run needs.
    pub fn memory(&self) -> Vec<f64> {
        vec![self.factor, self.sum, self.count]
    }

    /// Takes over the memory of an earlier run.
    pub fn restore(&mut self, memory: &[f64]) {
        if let &[factor, sum, count] = memory {
            (self.factor, self.sum, self.count) = (factor, sum, count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(shares: &[f64]) -> f64 {
        let mut damping = Damping::default();
        for &share in shares {
            damping.observe(share);
        }
        damping.adapt()
    }

    /// Short shares increase the factor, whole steps decrease it, and no steps leave it.
    #[test]
    fn the_factor_follows_the_shares() {
        assert_eq!(after(&[]), FIRST);
        assert!(after(&[0.01, 0.02]) > FIRST);
        assert!(after(&[1.0, 1.0]) < FIRST);
        // The geometric mean of these is the share aimed at.
        let mean = after(&[0.5, 0.25]);
        assert!((mean - FIRST).abs() < 1e-12 * FIRST, "{mean}");
    }

    /// However the steps go, the factor stays in its range and changes fourfold at most.
    #[test]
    fn the_factor_is_bounded() {
        assert_eq!(after(&[0.0; 5]), 4.0 * FIRST);
        let mut damping = Damping::default();
        for share in [0.0, 1.0] {
            for _ in 0..40 {
                damping.observe(share);
                let factor = damping.adapt();
                assert!((1.0..=LARGEST).contains(&factor), "{factor}");
            }
        }
        assert_eq!(damping.adapt(), 1.0);
    }

    /// A run that goes on from the memory of another one has its factors.
    #[test]
    fn a_resumed_factor_is_the_same() {
        let mut one = Damping::default();
        one.observe(0.1);
        let mut other = Damping::default();
        other.restore(&one.memory());
        for damping in [&mut one, &mut other] {
            damping.observe(0.03);
        }
        assert_eq!(one.adapt().to_bits(), other.adapt().to_bits());
    }
}
