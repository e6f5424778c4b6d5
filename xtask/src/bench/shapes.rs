//! The shapes of the timed averages: built-in, or read from arrays.

use std::path::{Path, PathBuf};

use fe_grid::{Grid, ScalarField};
use levelset::signed_distance;
use serde::{Deserialize, Serialize};
use shapespace_generate::{Blob, Placed, area_share};
use shapespace_input::{AnyImage, LEVEL, ReadOptions, read_image};

use crate::outcome::Outcome;

/// Mean radius of the blobs, and its relative variation.
const RADIUS: f64 = 0.24;
const ROUGHNESS: f64 = 0.3;

/// Origin of shapes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// Star-shaped blobs drawn by the program, with the seeds 1, 2, …
    Blobs {
        /// 2 or 3.
        dimension: usize,
        /// Nodes along every axis.
        nodes: usize,
        /// Number of shapes.
        count: usize,
    },
    /// Arrays of nodal values between 0 and 1, as many along every axis.
    Arrays(Vec<PathBuf>),
}

impl Source {
    /// 2 or 3.
    pub fn dimension(&self) -> Outcome<usize> {
        match self {
            Self::Blobs { dimension, .. } => Ok(*dimension),
            Self::Arrays(files) => {
                let first = files.first().ok_or("no shapes are named")?;
                Ok(read_image(first, &ReadOptions::default())?.dimension())
            }
        }
    }

    /// The signed distances of all shapes.
    pub fn distances<const D: usize>(&self) -> Outcome<Vec<ScalarField<f64, D>>> {
        let inside: Vec<ScalarField<f64, D>> = match self {
            Self::Blobs { nodes, count, .. } => (1..=*count as u64)
                .map(|seed| {
                    let blob = Blob::<D>::new(RADIUS, ROUGHNESS, seed);
                    area_share(&Placed::centred(blob), Grid::cube(*nodes))
                })
                .collect(),
            Self::Arrays(files) => files
                .iter()
                .map(|file| nodal(file))
                .collect::<Outcome<_>>()?,
        };
        let distances = inside.iter().map(|field| signed_distance(field, LEVEL));
        Ok(distances.collect::<Result<_, _>>()?)
    }
}

/// Nodal values from a file.
pub fn nodal<const D: usize>(file: &Path) -> Outcome<ScalarField<f64, D>> {
    let (size, values) = match read_image(file, &ReadOptions::default())? {
        AnyImage::D2(image) => (image.size.to_vec(), image.values.into_vec()),
        AnyImage::D3(image) => (image.size.to_vec(), image.values.into_vec()),
    };
    let nodes = size[0];
    if size.len() != D || nodes < 3 || size.iter().any(|n| *n != nodes) {
        let said = "is not an array of as many values along each of the expected axes";
        return Err(format!("'{}' {said}: {size:?}", file.display()).into());
    }
    Ok(ScalarField::from_vec(Grid::cube(nodes), values)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blobs_differ_and_keep_off_the_faces_of_the_box() {
        let source = Source::Blobs {
            dimension: 2,
            nodes: 33,
            count: 3,
        };
        let shapes = source.distances::<2>().unwrap();
        assert_eq!((shapes.len(), source.dimension().unwrap()), (3, 2));
        assert_ne!(shapes[0], shapes[1]);
        for shape in shapes {
            let n = shape.grid().nodes_per_axis()[0];
            assert!((0..n).all(|i| shape.as_slice()[i] < -0.1));
        }
    }

    #[test]
    fn a_file_of_the_wrong_shape_is_named() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("flat.pgm");
        std::fs::write(&file, "P2 4 3 255\n0 0 0 0 0 255 255 0 0 0 0 0\n").unwrap();
        let error = nodal::<2>(&file).unwrap_err().to_string();
        assert!(error.contains("flat.pgm"), "{error}");
    }
}
