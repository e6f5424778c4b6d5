//! Nodal fields on a grid.

use crate::error::GridError;
use crate::grid::Grid;
use crate::lane::Element;
use crate::parallel;

/// A field of `M` components, one number a node and component: component by component, `x`
/// fastest. `T` is the storage type; sums over a field are taken in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T, const D: usize, const M: usize> {
    grid: Grid<D>,
    data: Vec<T>,
}

/// A field with one number a node.
pub type ScalarField<T, const D: usize> = Field<T, D, 1>;
/// A field with one vector a node, such as a deformation.
pub type VectorField<T, const D: usize> = Field<T, D, D>;

impl<T: Element, const D: usize, const M: usize> Field<T, D, M> {
    /// The zero field.
    pub fn zeros(grid: Grid<D>) -> Self {
        Self {
            grid,
            data: vec![T::default(); M * grid.n_nodes()],
        }
    }

    /// A field from its numbers.
    ///
    /// # Errors
    /// [`GridError::Length`] where there are not `M` times as many numbers as nodes.
    pub fn from_vec(grid: Grid<D>, data: Vec<T>) -> Result<Self, GridError> {
        let expected = M * grid.n_nodes();
        if data.len() != expected {
            return Err(GridError::Length {
                expected,
                found: data.len(),
            });
        }
        Ok(Self { grid, data })
    }

    /// A field from a function of the position.
    pub fn from_fn(grid: Grid<D>, f: impl Fn([f64; D]) -> [f64; M]) -> Self {
        let mut field = Self::zeros(grid);
        let n = grid.n_nodes();
        for index in 0..n {
            for (c, value) in f(grid.position(grid.node(index))).into_iter().enumerate() {
                field.data[c * n + index] = T::from_f64(value);
            }
        }
        field
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// All numbers, component by component.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All numbers, component by component.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// All numbers, component by component.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// The numbers of one component.
    pub fn component(&self, c: usize) -> &[T] {
        let n = self.grid.n_nodes();
        &self.data[c * n..(c + 1) * n]
    }

    /// The numbers of one component.
    pub fn component_mut(&mut self, c: usize) -> &mut [T] {
        let n = self.grid.n_nodes();
        &mut self.data[c * n..(c + 1) * n]
    }

    /// The value at a node.
    pub fn at(&self, index: usize) -> [f64; M] {
        let n = self.grid.n_nodes();
        std::array::from_fn(|c| self.data[c * n + index].to_f64())
    }

    /// The field in another precision.
    pub fn convert<U: Element>(&self) -> Field<U, D, M> {
        let data = self.data.iter().map(|x| U::from_f64(x.to_f64())).collect();
        Field {
            grid: self.grid,
            data,
        }
    }

    /// The multilinear interpolant at a point; points outside the box take the value at the
    /// nearest point of the box.
    pub fn sample(&self, point: [f64; D]) -> [f64; M] {
        let (cell, local) = locate(&self.grid, point);
        let strides = self.grid.strides();
        let base = self.grid.node_index(cell);
        let n = self.grid.n_nodes();
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
                *v += weight * self.data[c * n + index].to_f64();
            }
        }
        value
    }

    /// The field `f o Phi` at the nodes, where `Phi(x) = x + u(x)` with the displacement `u`, its
    /// components one after the other on the field's grid.
    ///
    /// # Panics
    /// If the displacement does not fit the grid.
    pub fn compose(&self, displacement: &[f64]) -> Field<f64, D, M> {
        let (grid, n) = (self.grid, self.grid.n_nodes());
        assert_eq!(displacement.len(), D * n, "a displacement of another grid");
        let mut values = vec![[0.0; M]; n];
        let row = grid.nodes_per_axis()[0];
        parallel::for_each_chunk(&mut values, row, 1, &|r, values| {
            for (i, value) in values.iter_mut().enumerate() {
                let node = r * row + i;
                let x = grid.position(grid.node(node));
                *value = self.sample(std::array::from_fn(|k| x[k] + displacement[k * n + node]));
            }
        });
        let mut composed = Field::zeros(grid);
        for c in 0..M {
            for (value, found) in composed.component_mut(c).iter_mut().zip(&values) {
                *value = found[c];
            }
        }
        composed
    }
}

impl<T: Element, const D: usize> Field<T, D, D> {
    /// The identity deformation: every node at its own position.
    pub fn identity(grid: Grid<D>) -> Self {
        Self::from_fn(grid, |x| x)
    }
}

/// The cell that holds a point, and the point's coordinates in it, in `[0, 1]`; points outside
/// the box are moved to its nearest point.
pub fn locate<const D: usize>(grid: &Grid<D>, point: [f64; D]) -> ([usize; D], [f64; D]) {
    let cells = grid.cells_per_axis();
    let mut cell = [0; D];
    let mut local = [0.0; D];
    for k in 0..D {
        let s = (point[k] / grid.spacing()).clamp(0.0, cells[k] as f64);
        cell[k] = (s as usize).min(cells[k] - 1);
        local[k] = s - cell[k] as f64;
    }
    (cell, local)
}
