//! A solid without symmetries, given in the world and sampled on any lattice.

use super::Place;

/// An affine map from samples to the world, row by row.
pub type Affine = [[f64; 4]; 3];

/// Four balls of different radii along a winding path, joined smoothly: no rotation or reflection maps them to
/// themselves. `swelling` changes the radius of the second, in millimetres.
#[derive(Clone, Copy)]
pub struct Solid {
    pub swelling: f64,
    /// Reflects the solid at the plane `x = 12`.
    pub reflected: bool,
}

pub const SOLID: Solid = Solid {
    swelling: 0.0,
    reflected: false,
};

/// Length over which the balls are joined, in millimetres.
const JOINT: f64 = 2.5;

impl Solid {
    /// Approximate signed distance to the boundary, positive inside.
    fn distance(&self, mut p: [f64; 3]) -> f64 {
        if self.reflected {
            p[0] = 24.0 - p[0];
        }
        let balls = [
            ([10.0, -34.0, 40.0], 5.5),
            ([19.0, -34.0, 40.0], 4.5 + self.swelling),
            ([19.0, -25.0, 40.0], 4.5),
            ([19.0, -25.0, 49.0], 4.0),
        ];
        let sum: f64 = balls
            .iter()
            .map(|(c, r)| {
                let square: f64 = (0..3).map(|k| (p[k] - c[k]).powi(2)).sum();
                ((r - square.sqrt()) / JOINT).exp()
            })
            .sum();
        JOINT * sum.ln()
    }

    /// The share of a sample of about this length that lies inside, over a ramp of two lengths.
    pub fn value(&self, p: [f64; 3], length: f64) -> f64 {
        (0.5 + self.distance(p) / (2.0 * length)).clamp(0.0, 1.0)
    }

    /// Writes the solid as a volume of single precision on a lattice with this affine map.
    pub fn write(&self, place: &Place, name: &str, size: [usize; 3], affine: &Affine) {
        place.write(name, &self.nifti(size, affine));
    }

    /// The same as bytes.
    pub fn nifti(&self, size: [usize; 3], affine: &Affine) -> Vec<u8> {
        let length = longest(affine);
        let mut values = Vec::new();
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    let p = mapped(affine, [i, j, k].map(|n| n as f64));
                    values.push(self.value(p, length) as f32);
                }
            }
        }
        nifti_of(size, affine, &values)
    }
}

/// The length of the longest step between samples.
pub fn longest(affine: &Affine) -> f64 {
    let step = |j: usize| (0..3).map(|i| affine[i][j].powi(2)).sum::<f64>().sqrt();
    (0..3).map(step).fold(0.0, f64::max)
}

/// The world position of a sample.
pub fn mapped(affine: &Affine, sample: [f64; 3]) -> [f64; 3] {
    affine.map(|row| row[3] + (0..3).map(|j| row[j] * sample[j]).sum::<f64>())
}

/// The middle of the solid.
pub const MIDDLE: [f64; 3] = [14.0, -30.0, 44.0];

/// A lattice whose axes are these vectors, and whose middle is that of the solid.
pub fn lattice(axes: [[f64; 3]; 3], size: [usize; 3]) -> Affine {
    std::array::from_fn(|i| {
        let half: f64 = (0..3)
            .map(|j| axes[j][i] * 0.5 * (size[j] - 1) as f64)
            .sum();
        [axes[0][i], axes[1][i], axes[2][i], MIDDLE[i] - half]
    })
}

/// A NIfTI-1 file of numbers of single precision with an sform.
pub fn nifti_of(size: [usize; 3], affine: &Affine, values: &[f32]) -> Vec<u8> {
    let mut bytes = vec![0u8; 352];
    bytes[..4].copy_from_slice(&348i32.to_le_bytes());
    let dims = [3, size[0], size[1], size[2], 1, 1, 1, 1];
    for (k, n) in dims.iter().enumerate() {
        bytes[40 + 2 * k..42 + 2 * k].copy_from_slice(&(*n as i16).to_le_bytes());
    }
    bytes[70..72].copy_from_slice(&16i16.to_le_bytes());
    bytes[72..74].copy_from_slice(&32i16.to_le_bytes());
    for k in 0..4 {
        let length = |j: usize| (0..3).map(|i| affine[i][j].powi(2)).sum::<f64>().sqrt();
        let h = if k == 0 { 1.0 } else { length(k - 1) };
        bytes[76 + 4 * k..80 + 4 * k].copy_from_slice(&(h as f32).to_le_bytes());
    }
    bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
    bytes[123] = 2;
    bytes[254..256].copy_from_slice(&1i16.to_le_bytes());
    for (k, number) in affine.iter().flatten().enumerate() {
        bytes[280 + 4 * k..284 + 4 * k].copy_from_slice(&(*number as f32).to_le_bytes());
    }
    bytes[344..348].copy_from_slice(b"n+1\0");
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}
