//! Contour extraction: marching squares in 2D, marching cubes in 3D.

use std::collections::HashMap;

use fe_grid::{Field, Grid, compiled_once, mutant};

use crate::contour::{Contour, Simplex};
use crate::error::LevelsetError;
use crate::quad;
use crate::surface::{self, Edge, Fill};
use crate::vector::add_scaled;

/// Crossings lie at least this fraction of the spacing from both nodes of their edge, even where the field is at its level
/// at a node. In a node crossings of several edges would meet, and with them sheets of the surface: its edges would
/// have four triangles. Nearer ones would meet in files in single precision, and their triangles had no area.
const LEAST_SHARE: f64 = 1e-3;

/// Behaviour of a contour where the object touches the edge of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BoxEdge {
    /// It ends there, and is not closed: the edge of the box is no boundary of the object.
    #[default]
    Open,
    /// It runs along the edge: everything outside the box is background.
    Closed,
}

compiled_once! {
    /// The contour of the object `{field > level}`.
    ///
    /// Its points are the crossings of the level on the edges of the grid, by linear interpolation
    /// (for a binary mask and level 1/2: their midpoints), at least a thousandth of the spacing from the nodes: no two
    /// of them meet, and every edge of a closed surface has two triangles. In a square they are joined by straight
    /// segments; saddles are decided by the bilinear interpolant, and where that is undecided, as
    /// for a mask, the object's corners stay apart. In 3D the segments of a cell's faces are filled
    /// by triangles, and the closed surface has no holes. The contour is empty where the field
    /// never crosses the level.
    ///
    /// # Errors
    /// [`LevelsetError::NonFinite`] and, for the level, [`LevelsetError::Parameter`].
    pub fn contour<'a, D>(
        field: &'a Field<f64, D, 1>,
        level: f64,
        edge: BoxEdge,
    ) -> Result<Contour<D>, LevelsetError> = contour_in;
}

fn contour_in<const D: usize>(
    field: &Field<f64, D, 1>,
    level: f64,
    edge: BoxEdge,
) -> Result<Contour<D>, LevelsetError> {
    check_finite(field, level)?;
    let mut extraction = Extraction::new(field, level, edge);
    let lattice = extraction.lattice;
    let offsets: [usize; 8] = std::array::from_fn(|corner| {
        let strides = lattice.strides();
        (0..D).map(|k| (corner >> k & 1) * strides[k]).sum()
    });
    for cell in 0..lattice.n_cells() {
        extraction.cell(lattice.cell(cell), &offsets);
    }
    Contour::new(extraction.points, extraction.simplices)
}

/// # Errors
/// [`LevelsetError::NonFinite`] at the first bad node, [`LevelsetError::Parameter`] for the level.
pub(crate) fn check_finite<const D: usize>(
    field: &Field<f64, D, 1>,
    level: f64,
) -> Result<(), LevelsetError> {
    if !level.is_finite() {
        return Err(LevelsetError::Parameter {
            name: "level",
            value: level,
        });
    }
    match field.as_slice().iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(LevelsetError::NonFinite {
            node: field.grid().node(index).to_vec(),
            value: field.as_slice()[index],
        }),
    }
}

struct Extraction<'a, const D: usize> {
    values: &'a [f64],
    grid: Grid<D>,
    level: f64,
    /// The grid, with a layer of background around it if the contour is to be closed.
    lattice: Grid<D>,
    layer: usize,
    points: Vec<[f64; D]>,
    simplices: Vec<Simplex<D>>,
    /// Index of each point by the edge that it lies on (node and axis), or the node (axis `D`).
    known: HashMap<usize, u32>,
}

impl<'a, const D: usize> Extraction<'a, D> {
    fn new(field: &'a Field<f64, D, 1>, level: f64, edge: BoxEdge) -> Self {
        let grid = *field.grid();
        let layer = usize::from(edge == BoxEdge::Closed);
        let n_nodes = grid.nodes_per_axis().map(|n| n + 2 * layer);
        // A grid with more nodes and the same spacing is valid if the grid itself is.
        let lattice = Grid::with_nodes(n_nodes, grid.spacing()).unwrap_or(grid);
        Self {
            values: field.as_slice(),
            grid,
            level,
            lattice,
            layer,
            points: Vec::new(),
            simplices: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// Returns the value above the level at a node of the lattice.
    fn value(&self, node: [usize; D]) -> f64 {
        let n_nodes = self.grid.nodes_per_axis();
        let mut inner = node;
        for k in 0..D {
            match node[k].checked_sub(self.layer) {
                Some(i) if i < n_nodes[k] => inner[k] = i,
                _ => return f64::NEG_INFINITY,
            }
        }
        self.values[self.grid.node_index(inner)] - self.level
    }

    fn cell(&mut self, cell: [usize; D], offsets: &[usize; 8]) {
        let n_corners = 1usize << D;
        let mut values = [0.0; 8];
        if self.layer == 0 {
            let base = self.grid.node_index(cell);
            for corner in 0..n_corners {
                values[corner] = self.values[base + offsets[corner]] - self.level;
            }
        } else {
            for corner in 0..n_corners {
                values[corner] = self.value(shifted(cell, corner));
            }
        }
        let n_inside = values[..n_corners].iter().filter(|&&v| v > 0.0).count();
        if n_inside == 0 || n_inside == n_corners {
            return;
        }
        if D == 2 {
            self.square(cell, &values);
        } else {
            self.cube(cell, &values);
        }
    }

    fn square(&mut self, cell: [usize; D], values: &[f64; 8]) {
        const CORNERS: [usize; 4] = [0b00, 0b01, 0b11, 0b10];
        const SIDES: [Edge; 4] = [(0b00, 0), (0b01, 1), (0b10, 0), (0b00, 1)];
        for &(from, to) in quad::segments(CORNERS.map(|c| values[c])).as_slice() {
            let from = self.crossing(cell, SIDES[from], values);
            let to = self.crossing(cell, SIDES[to], values);
            let mut segment = [0; D];
            segment[0] = from;
            segment[1] = to;
            self.push(segment);
        }
    }

    fn cube(&mut self, cell: [usize; D], values: &[f64; 8]) {
        for ring in surface::loops(values) {
            let corners: Vec<u32> = ring
                .iter()
                .map(|&edge| self.crossing(cell, edge, values))
                .collect();
            let positions: Vec<[f64; 3]> = corners
                .iter()
                .map(|&c| std::array::from_fn(|k| self.points[c as usize][k]))
                .collect();
            match surface::fill(&ring, &positions) {
                Fill::Fan(apex) => self.fan(&corners, apex),
                Fill::Middle => self.star(&corners),
            }
        }
    }

    fn fan(&mut self, ring: &[u32], apex: usize) {
        let n = ring.len();
        for k in 1..n - 1 {
            self.triangle(ring[apex], ring[(apex + k) % n], ring[(apex + k + 1) % n]);
        }
    }

    fn star(&mut self, ring: &[u32]) {
        let mut middle = [0.0; D];
        for &c in ring {
            middle = add_scaled(&middle, 1.0 / ring.len() as f64, &self.points[c as usize]);
        }
        let apex = self.points.len() as u32;
        self.points.push(middle);
        for k in 0..ring.len() {
            self.triangle(apex, ring[k], ring[(k + 1) % ring.len()]);
        }
    }

    fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let mut corners = [0; D];
        for (corner, point) in corners.iter_mut().zip([a, b, c]) {
            *corner = point;
        }
        self.push(corners);
    }

    /// Adds a simplex unless it is degenerate because crossings on the edge of the box are the same node.
    fn push(&mut self, corners: Simplex<D>) {
        let vanishes = (1..D).any(|i| corners[..i].contains(&corners[i]));
        if !vanishes {
            self.simplices.push(corners);
        }
    }

    /// Returns the point on an edge of a cell where the level is crossed.
    fn crossing(&mut self, cell: [usize; D], edge: Edge, values: &[f64; 8]) -> u32 {
        let (corner, axis) = edge;
        let ends = [corner, corner | 1 << axis];
        let low_is_inside = values[ends[0]] > 0.0;
        let (inside, outside) = if low_is_inside {
            (ends[0], ends[1])
        } else {
            (ends[1], ends[0])
        };
        // Distance from the background node, in spacings.
        let share = -values[outside] / (values[inside] - values[outside]);
        let share = mutant!(share, ContourMiddle => 0.5);
        let (node, axis, share) = if values[outside] == f64::NEG_INFINITY {
            (shifted(cell, inside), D, 0.0)
        } else {
            let share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
            (shifted(cell, ends[0]), axis, share)
        };
        let key = self.lattice.node_index(node) * (D + 1) + axis;
        if let Some(&point) = self.known.get(&key) {
            return point;
        }
        let mut position = [0.0; D];
        for k in 0..D {
            position[k] = (node[k] as f64 - self.layer as f64) * self.grid.spacing();
        }
        if axis < D {
            let from_low = node[axis] as f64 - self.layer as f64;
            let along = if low_is_inside {
                from_low + 1.0 - share
            } else {
                from_low + share
            };
            position[axis] = along * self.grid.spacing();
        }
        let point = self.points.len() as u32;
        self.points.push(position);
        self.known.insert(key, point);
        point
    }
}

fn shifted<const D: usize>(mut cell: [usize; D], corner: usize) -> [usize; D] {
    for k in 0..D {
        cell[k] += corner >> k & 1;
    }
    cell
}
