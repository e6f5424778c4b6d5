//! Displacement fields, applied as other programs apply them.

use std::io::Read;
use std::path::Path;

use shapespace_input::lattice::Lattice;

use crate::common::solid::{MIDDLE, SOLID, lattice, nifti_of};
use crate::common::{Place, Results};

/// A volume as it is stored, channel by channel.
struct Volume {
    lattice: Lattice,
    /// Components of all samples, one after the other.
    values: Vec<f64>,
}

impl Volume {
    /// Reads what the program writes: NIfTI-1 with an sform, of bytes or of single precision.
    fn read(path: &Path) -> Self {
        let mut bytes = Vec::new();
        let file = std::fs::read(path).unwrap();
        let mut unpacked = flate2::read::GzDecoder::new(&file[..]);
        unpacked.read_to_end(&mut bytes).unwrap();
        let short = |at: usize| i16::from_le_bytes(bytes[at..at + 2].try_into().unwrap());
        let single =
            |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
        let data = &bytes[single(108) as usize..];
        let values = match short(70) {
            2 => data.iter().map(|&byte| f64::from(byte)).collect(),
            16 => data
                .chunks_exact(4)
                .map(|raw| f64::from(f32::from_le_bytes(raw.try_into().unwrap())))
                .collect(),
            other => panic!("numbers of type {other}"),
        };
        let entry = |i: usize, j: usize| single(280 + 4 * (4 * i + j));
        Self {
            lattice: Lattice {
                size: [42, 44, 46].map(|at| short(at) as usize),
                affine: std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))),
            },
            values,
        }
    }

    /// The multilinear value of a component at a point of the world; zero outside.
    fn at(&self, point: [f64; 3], component: usize) -> f64 {
        let sample = self.lattice.to_sample(point);
        let [nx, ny, nz] = self.lattice.size;
        let mut sum = 0.0;
        for corner in 0..8 {
            let (mut weight, mut node) = (1.0, [0.0; 3]);
            for k in 0..3 {
                let low = sample[k].floor();
                let share = sample[k] - low;
                let up = corner >> k & 1 == 1;
                weight *= if up { share } else { 1.0 - share };
                node[k] = if up { low + 1.0 } else { low };
            }
            let inside = |k: usize| (0.0..self.lattice.size[k] as f64).contains(&node[k]);
            if weight > 1e-6 && (0..3).all(inside) {
                let [i, j, k] = node.map(|x| x as usize);
                sum += weight * self.values[i + nx * (j + ny * (k + nz * component))];
            }
        }
        sum
    }
}

/// ITK takes no way where a field has none: it has one at all samples of the average, also where an
/// alignment has turned the box against them.
#[test]
fn fields_reach_all_samples_that_are_resampled() {
    let place = Place::new();
    let size = [34; 3];
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let plain = lattice(axes, size);
    let bytes = SOLID.nifti(size, &plain);
    place.write("plain.nii", &bytes);
    // Turned by 28 degrees about the middle of the samples.
    let (sin, cos) = 28f64.to_radians().sin_cos();
    let samples = Lattice {
        size,
        affine: plain,
    };
    let numbers = (0..samples.count()).map(|index| {
        let [x, y, z] = samples.position(index);
        let (x, y) = (x - MIDDLE[0], y - MIDDLE[1]);
        let before = [
            MIDDLE[0] + cos * x + sin * y,
            MIDDLE[1] - sin * x + cos * y,
            z,
        ];
        SOLID.value(before, 1.0) as f32
    });
    let numbers: Vec<f32> = numbers.collect();
    place.write("turned.nii", &nifti_of(size, &plain, &numbers));
    let values = |numbers: &mut dyn Iterator<Item = f32>| Volume {
        lattice: samples,
        values: numbers.map(f64::from).collect(),
    };
    let straight = bytes[352..].chunks_exact(4);
    let mut straight = straight.map(|raw| f32::from_le_bytes(raw.try_into().unwrap()));
    let subjects = [values(&mut straight), values(&mut numbers.iter().copied())];
    for like in ["plain.nii", "turned.nii"] {
        place.compute(&[
            "average",
            "plain.nii",
            "turned.nii",
            "--align",
            "rigid",
            "--grid",
            "33",
            "--max-iterations",
            "3",
            "--like",
            like,
            "-o",
            "mean",
        ]);
        let found = Results::read(&place.path("mean"));
        let angle = (0..2).map(|i| found.number(&format!("/input/{i}/alignment/angle_degrees")));
        let turned_one = angle.clone().fold(0.0, f64::max);
        assert!((turned_one - 28.0).abs() < 1.0, "{turned_one}");
        let average = Volume::read(&found.path("average.nii.gz"));
        for (number, subject) in subjects.iter().enumerate() {
            let field = Volume::read(&found.path(&format!("warp_00{number}.nii.gz")));
            for corner in average.lattice.corners() {
                let sample = field.lattice.to_sample(corner);
                let inside =
                    |k: usize| (-1e-4..field.lattice.size[k] as f64 - 0.999).contains(&sample[k]);
                assert!((0..3).all(inside), "{number}: {sample:?}");
            }
            let (mut both, mut sum) = (0.0, 0.0);
            for index in 0..average.lattice.count() {
                let point = average.lattice.position(index);
                // To the left and to the back.
                let way: [f64; 3] = std::array::from_fn(|k| field.at(point, k));
                let there = [point[0] - way[0], point[1] - way[1], point[2] + way[2]];
                let carried = f64::from(u8::from(subject.at(there, 0) > 0.5));
                both += carried * average.values[index];
                sum += carried + average.values[index];
            }
            let dice = 2.0 * both / sum;
            assert!(dice > 0.97, "{like}, {number}: {dice}");
        }
        std::fs::remove_dir_all(place.path("mean")).unwrap();
    }
}
