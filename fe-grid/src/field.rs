//! Nodal fields on a grid.

use crate::error::GridError;
use crate::grid::Grid;
use crate::lane::Element;
use crate::{multilinear, parallel};

/// A field of `M` components with one number per node and component, stored component by component,
/// `x` fastest. `T` is the storage type; sums over a field are taken in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T, const D: usize, const M: usize> {
    grid: Grid<D>,
    data: Vec<T>,
}

/// A field with one number per node.
pub type ScalarField<T, const D: usize> = Field<T, D, 1>;
/// A field with one vector per node, such as a displacement.
pub type VectorField<T, const D: usize> = Field<T, D, D>;

impl<T: Element, const D: usize, const M: usize> Field<T, D, M> {
    /// Creates the zero field.
    pub fn zeros(grid: Grid<D>) -> Self {
        Self {
            grid,
            data: vec![T::default(); M * grid.n_nodes()],
        }
    }

    /// Creates a field from its values, component by component.
    ///
    /// # Errors
    /// [`GridError::Length`] unless there are `M` values per node.
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

    /// Creates a field from a function of the position.
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

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns all values, component by component.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// Returns all values, component by component, for modification.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Returns all values, component by component, without copying.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Returns the values of one component.
    pub fn component(&self, c: usize) -> &[T] {
        let n = self.grid.n_nodes();
        &self.data[c * n..(c + 1) * n]
    }

    /// Returns the values of one component, for modification.
    pub fn component_mut(&mut self, c: usize) -> &mut [T] {
        let n = self.grid.n_nodes();
        &mut self.data[c * n..(c + 1) * n]
    }

    /// Returns the value at a node.
    pub fn at(&self, index: usize) -> [f64; M] {
        let n = self.grid.n_nodes();
        std::array::from_fn(|c| self.data[c * n + index].to_f64())
    }

    /// Converts the field to another precision.
    pub fn convert<U: Element>(&self) -> Field<U, D, M> {
        let data = self.data.iter().map(|x| U::from_f64(x.to_f64())).collect();
        Field {
            grid: self.grid,
            data,
        }
    }

    /// Evaluates the multilinear interpolant at a point; at points outside the box, at the nearest
    /// point of the box.
    pub fn sample(&self, point: [f64; D]) -> [f64; M] {
        let (nodes, spacing) = (self.grid.nodes_per_axis(), self.grid.spacing());
        multilinear::sample(&self.data, nodes, spacing, point)
    }

    /// Computes the field `f o Phi` at the nodes for the deformation `Phi(x) = x + u(x)`. The
    /// displacement `u` is given at the nodes of the field's grid, component by component.
    ///
    /// # Panics
    /// If the displacement does not have `D` components of the grid.
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

impl<const D: usize, const M: usize> Field<f64, D, M> {
    /// Evaluates the multilinear interpolant at the nodes of a grid of the same box.
    pub fn on_grid(&self, grid: &Grid<D>) -> Field<f64, D, M> {
        if grid == &self.grid {
            return self.clone();
        }
        Field::from_fn(*grid, |x| self.sample(x))
    }
}

impl<T: Element, const D: usize> Field<T, D, D> {
    /// Returns the identity deformation: the position of every node.
    pub fn identity(grid: Grid<D>) -> Self {
        Self::from_fn(grid, |x| x)
    }
}

impl<T: Element, const D: usize> Field<T, D, D> {
    /// Returns the position of a node after the deformation `Phi(x) = x + u(x)` with this displacement.
    pub fn deformed(&self, index: usize) -> [f64; D] {
        let (position, u) = (self.grid.position(self.grid.node(index)), self.at(index));
        std::array::from_fn(|k| position[k] + u[k])
    }

    /// Returns the position of any point after the deformation, by the multilinear interpolant of the displacement.
    pub fn image(&self, point: [f64; D]) -> [f64; D] {
        let u = self.sample(point);
        std::array::from_fn(|k| point[k] + u[k])
    }
}

/// Returns the cell that contains a point, and the local coordinates of the point, in `[0, 1]`;
/// points outside the box are projected onto the box first.
pub fn locate<const D: usize>(grid: &Grid<D>, point: [f64; D]) -> ([usize; D], [f64; D]) {
    multilinear::locate(grid.nodes_per_axis(), grid.spacing(), point)
}
