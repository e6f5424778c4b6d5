//! Results in memory: the arrays and the record of a result directory.

use std::path::Path;

use fe_grid::Field;
use serde_json::Value;

/// An array of a result.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptArray {
    /// Its name, that of its file without `.npy`.
    pub name: String,
    /// Its shape as in the file, the last axis is `x`.
    pub shape: Vec<usize>,
    /// Its numbers in memory order, the last axis fastest.
    pub numbers: KeptNumbers,
}

/// The numbers of an array.
#[derive(Clone, Debug, PartialEq)]
pub enum KeptNumbers {
    /// Numbers in double precision.
    Real(Vec<f64>),
    /// A mask.
    Mask(Vec<bool>),
}

/// The arrays and the record of a result.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    pub arrays: Vec<KeptArray>,
    pub record: Value,
}

impl Kept {
    /// Keeps numbers.
    pub fn push(&mut self, name: &Path, shape: Vec<usize>, numbers: KeptNumbers) {
        let name = name.with_extension("").to_string_lossy().into_owned();
        self.arrays.push(KeptArray {
            name,
            shape,
            numbers,
        });
    }

    /// Keeps a field, in the shape that it has in a file.
    pub fn field<const D: usize, const M: usize>(&mut self, name: &Path, field: &Field<f64, D, M>) {
        let components = (M > 1).then_some(M);
        let nodes = field.grid().nodes_per_axis();
        let shape = components.into_iter().chain(nodes.into_iter().rev());
        let numbers = KeptNumbers::Real(field.as_slice().to_vec());
        self.push(name, shape.collect(), numbers);
    }
}
