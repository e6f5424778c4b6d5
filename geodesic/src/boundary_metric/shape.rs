//! The shape functions of a cell: the first `2^D` of eight entries are used.

/// The values of the shape functions of a cell's corners at a position from 0 to 1 along every axis.
pub(super) fn corner_weights<const D: usize>(local: &[f64; D]) -> [f64; 8] {
    std::array::from_fn(|c| (0..D).map(|k| along(local[k], c >> k & 1)).product())
}

/// Their gradients, in a cell of this side.
pub(super) fn corner_gradients<const D: usize>(local: &[f64; D], spacing: f64) -> [[f64; D]; 8] {
    std::array::from_fn(|c| {
        std::array::from_fn(|i| {
            let sign = if c >> i & 1 == 1 { 1.0 } else { -1.0 };
            let others = (0..D).filter(|&k| k != i);
            let others: f64 = others.map(|k| along(local[k], c >> k & 1)).product();
            sign / spacing * others
        })
    })
}

fn along(local: f64, side: usize) -> f64 {
    if side == 1 { local } else { 1.0 - local }
}

/// The node of a corner, counted from the first of its cell.
pub(super) fn offset<const D: usize>(strides: &[usize; D], corner: usize) -> usize {
    (0..D).map(|k| (corner >> k & 1) * strides[k]).sum()
}
