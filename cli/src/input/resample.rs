//! Values of an image on the nodes of the unit box.

use fe_grid::{Grid, ScalarField};

use super::Image;
use super::fit::{FrameRule, FrameTransform};

/// Distance to the boundary of an object, in the length units of its file, positive inside.
pub trait ContourDistance<const D: usize> {
    /// Signed distance of a point given in the length units of the file.
    fn signed_distance(&self, point: [f64; D]) -> f64;
}

impl<const D: usize, F: Fn([f64; D]) -> f64> ContourDistance<D> for F {
    fn signed_distance(&self, point: [f64; D]) -> f64 {
        self(point)
    }
}

/// Signed distance to an object's boundary at the nodes of the unit box, in unit-box lengths,
/// positive inside. Exact where the distance in the image is.
pub fn distance_on_grid<const D: usize>(
    shape: &impl ContourDistance<D>,
    frame: &FrameTransform<D>,
    grid: Grid<D>,
) -> ScalarField<f64, D> {
    ScalarField::from_fn(grid, |x| {
        [frame.scale() * shape.signed_distance(frame.to_physical(x))]
    })
}

/// Weights of consecutive samples that make the value at a node along one axis.
struct Stencil {
    first: usize,
    weights: Vec<f64>,
}

/// Grey values of an image at the nodes of the unit box: where samples are coarser than the grid,
/// multilinear interpolation, else the mean over the box of one spacing about the node. Outside
/// the image the value is 0.
pub fn resample<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
    grid: Grid<D>,
) -> ScalarField<f64, D> {
    let mut field = ScalarField::zeros(grid);
    if frame.rule() == FrameRule::AsIs && image.size == grid.nodes_per_axis() {
        field.as_mut_slice().copy_from_slice(&image.values);
        return field;
    }
    let mut values = image.values.clone();
    let mut size = image.size;
    for k in 0..D {
        let stencils = stencils(image, frame, &grid, k);
        values = apply_along(&values, size, k, &stencils);
        size[k] = stencils.len();
    }
    field.as_mut_slice().copy_from_slice(&values);
    field
}

fn stencils<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
    grid: &Grid<D>,
    k: usize,
) -> Vec<Stencil> {
    let width = grid.spacing() / frame.sample_size()[k];
    (0..grid.nodes_per_axis()[k])
        .map(|i| {
            let mut point = [0.0; D];
            point[k] = i as f64 * grid.spacing();
            let centre = frame.to_sample(point)[k];
            if width <= 1.0 {
                interpolation(centre, image.size[k])
            } else {
                mean(centre, width, image.size[k])
            }
        })
        .collect()
}

/// Linear interpolation between samples; beyond the last sample the value falls to 0.
fn interpolation(centre: f64, n: usize) -> Stencil {
    window(centre - 1.0, centre + 1.0, n, |i| {
        (1.0 - (i - centre).abs()).max(0.0)
    })
}

/// Mean over `width` samples; sample `i` fills `[i - 1/2, i + 1/2]`.
fn mean(centre: f64, width: f64, n: usize) -> Stencil {
    let (low, high) = (centre - 0.5 * width, centre + 0.5 * width);
    window(low - 0.5, high + 0.5, n, |i| {
        ((i + 0.5).min(high) - (i - 0.5).max(low)).max(0.0) / width
    })
}

fn window(low: f64, high: f64, n: usize, weight: impl Fn(f64) -> f64) -> Stencil {
    let first = low.ceil().clamp(0.0, n as f64) as usize;
    let end = (high.floor() + 1.0).clamp(first as f64, n as f64) as usize;
    Stencil {
        first,
        weights: (first..end).map(|i| weight(i as f64)).collect(),
    }
}

fn apply_along<const D: usize>(
    values: &[f64],
    size: [usize; D],
    k: usize,
    stencils: &[Stencil],
) -> Vec<f64> {
    let inner: usize = size[..k].iter().product();
    let outer: usize = size[k + 1..].iter().product();
    let mut result = vec![0.0; inner * stencils.len() * outer];
    for o in 0..outer {
        for (i, stencil) in stencils.iter().enumerate() {
            let target = (o * stencils.len() + i) * inner;
            for (j, weight) in stencil.weights.iter().enumerate() {
                let source = (o * size[k] + stencil.first + j) * inner;
                for x in 0..inner {
                    result[target + x] += weight * values[source + x];
                }
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::super::fit::{fit_frames, tests::block};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_area_of_a_block_is_kept_when_downsampling() {
        let image = block([200, 160], [1.0, 1.0], [30, 40], [149, 99]);
        let frame = fit_frames(std::slice::from_ref(&image), 33)[0];
        let field = resample(&image, &frame, Grid::cube(33));
        let area: f64 = field.as_slice().iter().sum::<f64>() / (32.0 * 32.0);
        // 120 x 60 samples, the longer side becoming .7: boxes tile the plane, so no share is lost.
        assert_relative_eq!(area, 0.7 * 0.35, epsilon = 1e-12);
    }

    #[test]
    fn upsampling_reproduces_linear_images() {
        let mut image = block([5, 4, 3], [1.0, 1.0, 1.0], [1, 1, 1], [3, 2, 1]);
        let frame = fit_frames(std::slice::from_ref(&image), 33)[0];
        let linear = |s: [f64; 3]| 0.1 + 0.05 * s[0] + 0.1 * s[1] - 0.04 * s[2];
        for index in 0..image.values.len() {
            image.values[index] = linear(image.sample(index).map(|i| i as f64));
        }
        let grid = Grid::<3>::cube(33);
        let field = resample(&image, &frame, grid);
        for index in 0..grid.n_nodes() {
            let s = frame.to_sample(grid.position(grid.node(index)));
            if (0..3).all(|k| s[k] >= 0.0 && s[k] <= (image.size[k] - 1) as f64) {
                assert_relative_eq!(field.as_slice()[index], linear(s), epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn distances_come_in_unit_lengths() {
        let image = block([20, 20], [2.0, 2.0], [5, 5], [14, 14]);
        let frame = fit_frames(&[image], 65)[0];
        let half = |p: [f64; 2]| p[0] - 19.0;
        let field = distance_on_grid(&half, &frame, Grid::cube(65));
        // The block's middle is at sample 9.5, length 19, which lies at x = .5.
        assert_relative_eq!(field.sample([0.75, 0.3])[0], 0.25, epsilon = 1e-13);
    }
}
