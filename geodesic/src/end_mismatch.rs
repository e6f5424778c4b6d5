//! The mismatch at points of the end domain.
//!
//! The mismatch on the start domain `int (H(u_B o psi) - H(u_A))^2` is measured at points that move
//! with the deformation. Where the void is stretched over a part of the end shape, these points are
//! far apart there: a limb of the end shape that lies between them is not seen. Here the points are
//! fixed in the end domain,
//!
//! ```text
//! sum_q w (H(u_B(y_q)) - m(y_q))^2,    m(y) = sum over x with psi(x) = y of H(u_A(x)),
//! ```
//!
//! on a lattice of `2^D` points a cell. `m` is the coverage of `y` by the deformed start shape: void
//! has none, so that the preimages are needed in the cells that touch the shape only, and matter that
//! overlaps covers twice. The step `H` has a transition of finite width: a perfect match has no
//! mismatch, and exerts no force, wherever the boundaries are.

use crate::shape::{KnownEnds, ShapeOnGrid, union_of};
use fe_grid::{Grid, Lattice, Preimage, ScalarField, parallel, preimages, tensor};
use levelset::Compact;
use std::cmp::Ordering;

/// Points of the lattice per cell and axis.
const PARTS: usize = 2;
/// Distance from a face, in cells, within which a point may be found in both cells.
const FACE: f64 = 1e-8;
/// Corners of a cell in three dimensions.
const MAX_CORNERS: usize = 8;

/// The mismatch of two shapes on a grid under deformations of the first.
pub(crate) struct EndMismatch<const D: usize> {
    grid: Grid<D>,
    lattice: Lattice<D>,
    step: Compact,
    /// The level sets of the components of the start shape.
    start: Vec<ScalarField<f64, D>>,
    /// Visibility weight of the start shape; `None` if it is one everywhere.
    start_weight: Option<ScalarField<f64, D>>,
    /// For every component `H(u_B)` at the points.
    targets: Vec<Vec<f64>>,
    /// Visibility weight of the end shape at the points; empty if it is one everywhere.
    end_weight: Vec<f64>,
    /// Weights of too little and of too much coverage.
    sides: [f64; 2],
    /// The cells to be searched, by layers.
    cells: Vec<Vec<usize>>,
}

/// The state at a deformation.
struct Covered<const D: usize> {
    found: Vec<Vec<Preimage<D>>>,
    /// For every component the coverage of the points.
    coverage: Vec<Vec<f64>>,
    /// Visibility weight of the start shape at the points; empty if it is one everywhere.
    start_weight: Vec<f64>,
}

/// Overlap of a component with the end shape.
pub(crate) struct LatticeOverlap {
    /// Volume of the visible part that exactly one of both shapes covers.
    pub difference: f64,
    /// Visible volumes of the deformed start shape and of the end shape.
    pub volumes: [f64; 2],
}

impl<const D: usize> EndMismatch<D> {
    /// Creates the mismatch of two shapes on the same grid.
    pub fn new(start: &ShapeOnGrid<D>, end: &ShapeOnGrid<D>, step: Compact) -> Self {
        let grid = *start.components[0].grid();
        let lattice = Lattice::midpoints(&grid, PARTS);
        let h = grid.spacing();
        let sampled = |field: &ScalarField<f64, D>| -> Vec<f64> {
            let points = 0..lattice.n_points();
            points
                .map(|q| field.sample(lattice.point(q).map(|y| y * h))[0])
                .collect()
        };
        let targets = end.components.iter().map(|v| {
            let mut target = sampled(v);
            for v in &mut target {
                *v = step.value(*v);
            }
            target
        });
        let union = union_of(&start.components);
        let lowest = -step.half_width();
        let sides = KnownEnds::new(start, end).in_step(1, 1).sides;
        Self {
            lattice,
            targets: targets.collect(),
            end_weight: end.weight.as_ref().map(&sampled).unwrap_or_default(),
            sides,
            cells: cells_by_layer(&grid, |node| {
                // Hidden void counts differently from the void outside the box.
                start.weight.is_some() || union.as_slice()[node] > lowest
            }),
            start: start.components.clone(),
            start_weight: start.weight.clone(),
            step,
            grid,
        }
    }

    /// Computes the mismatch at a displacement, and adds its gradient times a factor to `gradient`
    /// unless that is empty.
    pub fn value_or_gradient_add(
        &self,
        displacement: &[f64],
        factor: f64,
        gradient: &mut [f64],
    ) -> f64 {
        let at = self.covered(displacement);
        if !gradient.is_empty() {
            self.add_gradient(&at, displacement, factor, gradient);
        }
        let mut sum = 0.0;
        for (target, coverage) in self.targets.iter().zip(&at.coverage) {
            for (q, (t, m)) in target.iter().zip(coverage).enumerate() {
                let residual = t - m;
                sum += self.weight(&at, q, residual) * residual * residual;
            }
        }
        sum * self.point_volume()
    }

    /// Computes the overlap of every component at a displacement.
    pub fn overlaps(&self, displacement: &[f64]) -> Vec<LatticeOverlap> {
        let at = self.covered(displacement);
        let pairs = self.targets.iter().zip(&at.coverage);
        let found = pairs.map(|(target, coverage)| {
            let mut overlap = LatticeOverlap {
                difference: 0.0,
                volumes: [0.0; 2],
            };
            for (q, (t, m)) in target.iter().zip(coverage).enumerate() {
                let weight = self.weight(&at, q, t - m) * self.point_volume();
                overlap.difference += weight * (t - m).abs();
                overlap.volumes[0] += weight * m;
                overlap.volumes[1] += weight * t;
            }
            overlap
        });
        found.collect()
    }

    /// The volume that a point of the lattice stands for.
    fn point_volume(&self) -> f64 {
        self.grid.cell_volume() / PARTS.pow(D as u32) as f64
    }

    /// The weight of a residual, by its sign.
    fn side(&self, residual: f64) -> f64 {
        match residual.partial_cmp(&0.0) {
            Some(Ordering::Less) => self.sides[0],
            Some(Ordering::Greater) => self.sides[1],
            _ => 1.0,
        }
    }

    /// The weight of a point, by the sign of its residual.
    fn weight(&self, at: &Covered<D>, q: usize, residual: f64) -> f64 {
        let side = self.side(residual);
        let [start, end] = [&at.start_weight, &self.end_weight].map(|w| w.get(q));
        side * start.unwrap_or(&1.0) * end.unwrap_or(&1.0)
    }

    /// Computes the preimages of all points and their coverage.
    fn covered(&self, displacement: &[f64]) -> Covered<D> {
        let mut found = preimages(&self.grid, displacement, &self.cells, &self.lattice);
        let n = self.lattice.n_points();
        let mut on_face = vec![false; n];
        for layer in &mut found {
            layer.retain(|p| {
                let near = p.local.iter().any(|&x| !(FACE..=1.0 - FACE).contains(&x));
                !(near && std::mem::replace(&mut on_face[p.point], true))
            });
        }
        let mut coverage = vec![vec![0.0; n]; self.start.len()];
        let mut start_weight = match &self.start_weight {
            Some(_) => vec![1.0; n],
            None => Vec::new(),
        };
        for preimage in found.iter().flatten() {
            let corners = Corners::new(&self.grid, preimage);
            for (u, coverage) in self.start.iter().zip(&mut coverage) {
                coverage[preimage.point] += self.step.value(corners.value(u.as_slice()));
            }
            if let Some(weight) = &self.start_weight {
                start_weight[preimage.point] = corners.value(weight.as_slice());
            }
        }
        Covered {
            found,
            coverage,
            start_weight,
        }
    }

    /// With `psi(x) = y` fixed, `dx = -(Dpsi)^-1 dpsi(x)`.
    fn add_gradient(
        &self,
        at: &Covered<D>,
        displacement: &[f64],
        factor: f64,
        gradient: &mut [f64],
    ) {
        let (grid, n) = (&self.grid, self.grid.n_nodes());
        let per_layer = n / grid.nodes_per_axis()[D - 1];
        let scale = factor * self.point_volume() / grid.spacing();
        let layers = parallel::map(at.found.iter().enumerate(), &|(layer, found)| {
            // The nodes below and above the layer.
            let mut local = vec![
                0.0;
                if found.is_empty() {
                    0
                } else {
                    2 * D * per_layer
                }
            ];
            for preimage in found {
                let corners = Corners::new(grid, preimage);
                let Some(force) = self.force(at, preimage, &corners) else {
                    continue;
                };
                let inverse = corners.inverse_transpose(displacement, n, grid.spacing());
                for i in 0..D {
                    let along: f64 = (0..D).map(|k| inverse[i][k] * force[k]).sum();
                    for c in 0..1 << D {
                        let node = corners.nodes[c] - layer * per_layer;
                        local[2 * i * per_layer + node] += scale * along * corners.shape[c];
                    }
                }
            }
            local
        });
        for (layer, local) in layers.iter().enumerate() {
            for (i, part) in local.chunks_exact(2 * per_layer).enumerate() {
                let first = i * n + layer * per_layer;
                for (g, l) in gradient[first..].iter_mut().zip(part) {
                    *g += l;
                }
            }
        }
    }

    /// The derivative of the mismatch with respect to the position of the preimage, in cells and
    /// with the sign reversed; none where it vanishes.
    fn force(
        &self,
        at: &Covered<D>,
        preimage: &Preimage<D>,
        corners: &Corners<D>,
    ) -> Option<[f64; D]> {
        let q = preimage.point;
        let mut force = [0.0; D];
        let mut any = false;
        for (u, (target, coverage)) in self.start.iter().zip(self.targets.iter().zip(&at.coverage))
        {
            let residual = target[q] - coverage[q];
            if residual == 0.0 {
                continue;
            }
            let weight = self.weight(at, q, residual);
            let slope = self.step.derivative(corners.value(u.as_slice()));
            if slope > 0.0 {
                let along = 2.0 * weight * residual * slope;
                let direction = corners.slope(u.as_slice());
                (0..D).for_each(|k| force[k] += along * direction[k]);
                any = true;
            }
            if let Some(start_weight) = &self.start_weight {
                let of_end = self.end_weight.get(q).unwrap_or(&1.0);
                let along = residual * residual * self.side(residual) * of_end;
                let direction = corners.slope(start_weight.as_slice());
                (0..D).for_each(|k| force[k] -= along * direction[k]);
                any = true;
            }
        }
        any.then_some(force)
    }
}

/// The shape functions of a cell at a point.
struct Corners<const D: usize> {
    nodes: [usize; MAX_CORNERS],
    shape: [f64; MAX_CORNERS],
    /// Derivatives along the axes, in cells.
    slopes: [[f64; D]; MAX_CORNERS],
}

impl<const D: usize> Corners<D> {
    fn new(grid: &Grid<D>, preimage: &Preimage<D>) -> Self {
        let strides = grid.strides();
        let first = grid.node_index(grid.cell(preimage.cell));
        let mut corners = Self {
            nodes: [first; MAX_CORNERS],
            shape: [1.0; MAX_CORNERS],
            slopes: [[1.0; D]; MAX_CORNERS],
        };
        for c in 0..1 << D {
            for k in 0..D {
                let (upper, x) = (c >> k & 1, preimage.local[k]);
                let (value, slope) = [(1.0 - x, -1.0), (x, 1.0)][upper];
                corners.nodes[c] += upper * strides[k];
                corners.shape[c] *= value;
                for (j, s) in corners.slopes[c].iter_mut().enumerate() {
                    *s *= if j == k { slope } else { value };
                }
            }
        }
        corners
    }

    /// Interpolates a nodal array.
    fn value(&self, nodal: &[f64]) -> f64 {
        (0..1 << D)
            .map(|c| self.shape[c] * nodal[self.nodes[c]])
            .sum()
    }

    /// Differentiates a nodal array along the axes, in cells.
    fn slope(&self, nodal: &[f64]) -> [f64; D] {
        std::array::from_fn(|k| {
            let corners = 0..1 << D;
            corners
                .map(|c| self.slopes[c][k] * nodal[self.nodes[c]])
                .sum()
        })
    }

    /// `(Dpsi)^-T` of the deformation with a displacement.
    fn inverse_transpose(&self, displacement: &[f64], n: usize, h: f64) -> [[f64; D]; D] {
        let mut gradient = [[0.0; D]; D];
        for i in 0..D {
            let slope = self.slope(&displacement[i * n..(i + 1) * n]);
            gradient[i] = slope.map(|s| s / h);
        }
        tensor::inverse_transpose(&tensor::add_identity(&gradient))
    }
}

/// Returns the cells with a corner that satisfies a predicate, by layers along the last axis.
fn cells_by_layer<const D: usize>(
    grid: &Grid<D>,
    holds: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let marked = crate::cells::cells_with_corner(grid, holds);
    let layers = grid.cells_per_axis()[D - 1];
    let per_layer = marked.len() / layers;
    let cells = (0..layers).map(|layer| layer * per_layer..(layer + 1) * per_layer);
    cells
        .map(|cells| cells.filter(|&cell| marked[cell]).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Field;

    fn ball<const D: usize>(grid: Grid<D>, radius: f64, shift: f64) -> ScalarField<f64, D> {
        ScalarField::from_fn(grid, |x| {
            let squares = x.map(|c| (c - 0.5).powi(2));
            let first = (x[0] - 0.5 - shift).powi(2) - squares[0];
            [radius - (squares.iter().sum::<f64>() + first).sqrt()]
        })
    }

    fn shape<const D: usize>(components: Vec<ScalarField<f64, D>>) -> ShapeOnGrid<D> {
        ShapeOnGrid {
            components,
            weight: None,
            only_covered: false,
        }
    }

    /// A smooth displacement of a few cells.
    fn bend<const D: usize>(grid: Grid<D>, size: f64) -> Field<f64, D, D> {
        Field::from_fn(grid, |x| {
            let bump: f64 = x.iter().map(|x| (3.0 * x).sin()).product();
            std::array::from_fn(|k| size * bump * (0.3 + x[(k + 1) % D]))
        })
    }

    fn check_gradient<const D: usize>(hidden: bool) {
        let grid = Grid::<D>::cube(17);
        let weight = || ScalarField::from_fn(grid, |x| [0.5 + 0.4 * (2.0 * x[0] + x[1]).sin()]);
        let mut start = shape(vec![ball(grid, 0.25, 0.0), ball(grid, 0.15, 0.1)]);
        let mut end = shape(vec![ball(grid, 0.3, 0.03), ball(grid, 0.1, 0.15)]);
        if hidden {
            start.weight = Some(weight());
            end.weight = Some(weight());
        }
        let step = Compact::new(2.0 * grid.spacing()).unwrap();
        let mismatch = EndMismatch::new(&start, &end, step);
        let at = bend(grid, 0.06);
        let along = bend(grid, 1.0);
        let mut gradient = vec![0.0; at.as_slice().len()];
        mismatch.value_or_gradient_add(at.as_slice(), 1.0, &mut gradient);
        let pairs = gradient.iter().zip(along.as_slice());
        let slope: f64 = pairs.map(|(g, d)| g * d).sum();
        let moved = |t: f64| {
            let pairs = at.as_slice().iter().zip(along.as_slice());
            let x: Vec<f64> = pairs.map(|(u, d)| u + t * d).collect();
            mismatch.value_or_gradient_add(&x, 1.0, &mut [])
        };
        let t = 1e-6;
        let difference = (moved(t) - moved(-t)) / (2.0 * t);
        // Preimages cross faces of cells within the difference, where the level sets have kinks.
        assert!(
            (difference / slope - 1.0).abs() < 1e-4,
            "{difference} {slope}"
        );
    }

    #[test]
    fn the_gradient_is_the_derivative() {
        check_gradient::<2>(false);
        check_gradient::<3>(false);
        check_gradient::<2>(true);
        check_gradient::<3>(true);
    }

    #[test]
    fn a_limb_between_the_points_of_a_stretched_void_is_seen() {
        let grid = Grid::<2>::cube(33);
        let arm = |end: f64| {
            ScalarField::from_fn(grid, |[x, y]| {
                [(0.05 - (y - 0.5).abs()).min(end - x).min(x - 0.2)]
            })
        };
        let step = Compact::new(1.5 * grid.spacing()).unwrap();
        let mismatch = EndMismatch::new(&shape(vec![arm(0.4)]), &shape(vec![arm(0.8)]), step);
        // The void beyond the arm is stretched over the whole length that is missing.
        let stretched = Field::<f64, 2, 2>::from_fn(grid, |[x, _]| {
            [(8.0 * (x - 0.5)).clamp(0.0, 0.4) * (1.0 - x).min(0.3), 0.0]
        });
        let still = mismatch.value_or_gradient_add(&vec![0.0; 2 * grid.n_nodes()], 1.0, &mut []);
        let found = mismatch.value_or_gradient_add(stretched.as_slice(), 1.0, &mut []);
        assert!((found / still - 1.0).abs() < 1e-12, "{found} {still}");
    }

    #[test]
    fn overlaps_are_volumes() {
        let grid = Grid::<3>::cube(65);
        let sharp = Compact::new(1e-3 * grid.spacing()).unwrap();
        let [start, end] = [0.2, 0.3].map(|r| shape(vec![ball(grid, r, 0.0)]));
        let mismatch = EndMismatch::new(&start, &end, sharp);
        let found = &mismatch.overlaps(&vec![0.0; 3 * grid.n_nodes()])[0];
        let volume = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
        let exact = [volume(0.2), volume(0.3)];
        for (found, exact) in found.volumes.iter().zip(exact) {
            // The interpolated distance is too low by h^2 / (6 r) or so, 3 h^2 / (6 r^2) of the volume.
            assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
        }
        let shell = found.volumes[1] - found.volumes[0];
        assert!((found.difference / shell - 1.0).abs() < 1e-12);
    }

    #[test]
    fn matter_that_overlaps_covers_twice() {
        let grid = Grid::<2>::cube(33);
        let two =
            ScalarField::from_fn(
                grid,
                |[x, y]| [0.1 - ((x - 0.5).abs() - 0.2).hypot(y - 0.5)],
            );
        let one = ball(grid, 0.1, 0.0);
        let sharp = Compact::new(1e-3 * grid.spacing()).unwrap();
        let mismatch = EndMismatch::new(&shape(vec![two]), &shape(vec![one]), sharp);
        // Both disks are moved onto the same place.
        let folded =
            Field::<f64, 2, 2>::from_fn(grid, |[x, _]| [if x < 0.5 { 0.2 } else { -0.2 }, 0.0]);
        let found = &mismatch.overlaps(folded.as_slice())[0];
        assert!((found.difference / found.volumes[1] - 1.0).abs() < 0.02);
    }
}
