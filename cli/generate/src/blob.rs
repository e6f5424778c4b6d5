//! Smooth random shapes, star-shaped about the origin.

use crate::implicit::Implicit;
use crate::random::Random;

const WAVES: usize = 6;

/// The shape `|x| < r(x / |x|)` with `r(d) = radius (1 + sum_k a_k sin(2 d.w_k + p_k))`, where
/// the directions `w_k`, strengths `a_k` and phases `p_k` are random and the `|a_k|` sum up to
/// the roughness.
#[derive(Clone, Debug, PartialEq)]
pub struct Blob<const D: usize> {
    radius: f64,
    roughness: f64,
    waves: [Wave<D>; WAVES],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave<const D: usize> {
    vector: [f64; D],
    strength: f64,
    phase: f64,
}

impl<const D: usize> Blob<D> {
    /// A blob of a mean radius, whose radius varies by up to the roughness (in `[0, 1)`).
    pub fn new(radius: f64, roughness: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut waves = [Wave {
            vector: [0.0; D],
            strength: 0.0,
            phase: 0.0,
        }; WAVES];
        for (k, wave) in waves.iter_mut().enumerate() {
            let number = 1.5 + 0.5 * k as f64;
            let direction = direction(&mut random);
            wave.vector = direction.map(|x| number * x);
            wave.strength = random.between(0.3, 1.0) / number;
            wave.phase = random.between(0.0, std::f64::consts::TAU);
        }
        let total: f64 = waves.iter().map(|wave| wave.strength).sum();
        for wave in &mut waves {
            wave.strength *= roughness / total;
        }
        Self {
            radius,
            roughness,
            waves,
        }
    }

    /// Radius along a direction, and the length of its gradient on the unit sphere.
    fn radius(&self, direction: [f64; D]) -> (f64, f64) {
        let (mut relative, mut gradient) = (1.0, [0.0; D]);
        for wave in &self.waves {
            let product: f64 = (0..D).map(|k| wave.vector[k] * direction[k]).sum();
            let angle = product + wave.phase;
            relative += wave.strength * angle.sin();
            for k in 0..D {
                gradient[k] += wave.strength * angle.cos() * wave.vector[k];
            }
        }
        let radial: f64 = (0..D).map(|k| gradient[k] * direction[k]).sum();
        let tangential = (0..D)
            .map(|k| (gradient[k] - radial * direction[k]).powi(2))
            .sum::<f64>()
            .sqrt();
        (self.radius * relative, self.radius * tangential)
    }
}

impl<const D: usize> Implicit<D> for Blob<D> {
    /// `(r(x / |x|) - |x|) / sqrt(1 + |grad r|^2 / r^2)`: the distance to first order.
    fn value(&self, point: [f64; D]) -> f64 {
        let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length < 1e-9 {
            return self.radius * (1.0 - self.roughness);
        }
        let (radius, slope) = self.radius(point.map(|x| x / length));
        (radius - length) / (slope / radius).hypot(1.0)
    }

    fn stretch(&self) -> f64 {
        // Slopes of r differ from place to place by at most the wave numbers times the strengths.
        let steepest: f64 = self
            .waves
            .iter()
            .map(|wave| wave.strength * wave.vector.iter().map(|x| x * x).sum::<f64>().sqrt())
            .sum();
        (steepest / (1.0 - self.roughness)).hypot(1.0)
    }
}

/// A random unit vector, by rejection from the cube.
fn direction<const D: usize>(random: &mut Random) -> [f64; D] {
    loop {
        let vector: [f64; D] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let square: f64 = vector.iter().map(|x| x * x).sum();
        if (0.01..1.0).contains(&square) {
            return vector.map(|x| x / square.sqrt());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blobs_follow_their_seed_and_stay_within_their_roughness() {
        let blob = Blob::<3>::new(0.25, 0.3, 7);
        assert_eq!(blob, Blob::new(0.25, 0.3, 7));
        assert_ne!(blob, Blob::new(0.25, 0.3, 8));
        let mut random = Random::new(1);
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for _ in 0..2000 {
            let d = direction::<3>(&mut random);
            assert!(blob.value(d.map(|x| 0.25 * 0.69 * x)) > 0.0);
            assert!(blob.value(d.map(|x| 0.25 * 1.31 * x)) < 0.0);
            let r = blob.radius(d).0;
            (low, high) = (low.min(r), high.max(r));
        }
        // It is a blob, not a ball.
        assert!(high - low > 0.03, "{low} {high}");
    }
}
