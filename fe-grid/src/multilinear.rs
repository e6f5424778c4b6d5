//! Multilinear interpolation of nodal values.
//!
//! Pictures, lattices and warps of other crates read fields at many points. Generic code would be compiled again
//! in each of these crates, and slow in those that are compiled without optimisation: for fields of one, two and
//! three components in the plane and in space it is compiled here.

use crate::lane::{Element, Numbers};

/// Evaluates the interpolant of a field of `M` components at a point; at points outside the box, at the nearest
/// point of the box.
pub fn sample<T: Element, const D: usize, const M: usize>(
    values: &[T],
    nodes_per_axis: [usize; D],
    spacing: f64,
    point: [f64; D],
) -> [f64; M] {
    let mut value = [0.0; M];
    let numbers = T::numbers(values);
    if !sample_compiled(numbers, &nodes_per_axis, spacing, &point, &mut value) {
        value = interpolate(values, nodes_per_axis, spacing, point);
    }
    value
}

/// The same where it is compiled for so many dimensions and components; otherwise false.
fn sample_compiled(
    numbers: Numbers<'_>,
    nodes: &[usize],
    spacing: f64,
    point: &[f64],
    value: &mut [f64],
) -> bool {
    match (numbers, nodes, point) {
        (Numbers::Double(values), &[m, n], &[x, y]) => {
            sample_components(values, [m, n], spacing, [x, y], value)
        }
        (Numbers::Double(values), &[l, m, n], &[x, y, z]) => {
            sample_components(values, [l, m, n], spacing, [x, y, z], value)
        }
        (Numbers::Single(values), &[m, n], &[x, y]) => {
            sample_components(values, [m, n], spacing, [x, y], value)
        }
        (Numbers::Single(values), &[l, m, n], &[x, y, z]) => {
            sample_components(values, [l, m, n], spacing, [x, y, z], value)
        }
        _ => false,
    }
}

fn sample_components<T: Element, const D: usize>(
    values: &[T],
    nodes: [usize; D],
    spacing: f64,
    point: [f64; D],
    value: &mut [f64],
) -> bool {
    if let Ok(value) = <&mut [f64; 1]>::try_from(&mut *value) {
        *value = interpolate(values, nodes, spacing, point);
    } else if let Ok(value) = <&mut [f64; 2]>::try_from(&mut *value) {
        *value = interpolate(values, nodes, spacing, point);
    } else if let Ok(value) = <&mut [f64; 3]>::try_from(&mut *value) {
        *value = interpolate(values, nodes, spacing, point);
    } else {
        return false;
    }
    true
}

fn interpolate<T: Element, const D: usize, const M: usize>(
    values: &[T],
    nodes: [usize; D],
    spacing: f64,
    point: [f64; D],
) -> [f64; M] {
    let (cell, local) = locate(nodes, spacing, point);
    let (mut strides, mut n, mut base) = ([0; D], 1, 0);
    for k in 0..D {
        strides[k] = n;
        base += cell[k] * n;
        n *= nodes[k];
    }
    let mut value = [0.0; M];
    for corner in 0..1usize << D {
        let (mut weight, mut index) = (1.0, base);
        for k in 0..D {
            if corner >> k & 1 == 1 {
                weight *= local[k];
                index += strides[k];
            } else {
                weight *= 1.0 - local[k];
            }
        }
        for (c, v) in value.iter_mut().enumerate() {
            *v += weight * values[c * n + index].to_f64();
        }
    }
    value
}

/// The cell that contains a point, and the local coordinates of the point, in `[0, 1]`; points outside the box are
/// projected onto the box first.
pub fn locate<const D: usize>(
    nodes: [usize; D],
    spacing: f64,
    point: [f64; D],
) -> ([usize; D], [f64; D]) {
    let mut cell = [0; D];
    let mut local = [0.0; D];
    for k in 0..D {
        let cells = nodes[k] - 1;
        let s = (point[k] / spacing).clamp(0.0, cells as f64);
        cell[k] = (s as usize).min(cells - 1);
        local[k] = s - cell[k] as f64;
    }
    (cell, local)
}

#[cfg(test)]
mod tests {
    use super::sample;

    /// What is compiled here for few components are those of a field of more, in both precisions.
    #[test]
    fn components_are_those_of_fields_of_more() {
        let nodes = [3, 4, 2];
        let values: Vec<f64> = (0..4 * 24).map(|i| f64::from(i * i % 31)).collect();
        let singles: Vec<f32> = values.iter().map(|&x| x as f32).collect();
        let point = [0.31, 0.52, 0.07];
        let four = sample::<f64, 3, 4>(&values, nodes, 0.25, point);
        assert_eq!(four, sample::<f32, 3, 4>(&singles, nodes, 0.25, point));
        let three = sample::<f64, 3, 3>(&values[..72], nodes, 0.25, point);
        assert_eq!(four[..3], three);
        let two = sample::<f32, 3, 2>(&singles[24..72], nodes, 0.25, point);
        assert_eq!(four[1..3], two);
        let one = sample::<f32, 3, 1>(&singles[72..], nodes, 0.25, point);
        assert_eq!(four[3..], one);
    }
}
