//! VTK image files (`.vti`) for ParaView: an XML header, then the numbers as appended raw binary,
//! little endian, each array led by its length in bytes (8 bytes).

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use fe_grid::{Element, Field, Grid, parallel};

use super::OutputError;
use super::npy::Precision;
use crate::shapes::WorldFrame;

/// Nodes whose values are in memory as bytes at a time.
const NODES_AT_ONCE: usize = 1 << 16;
/// Those of them that one thread converts at a time.
const NODES_OF_A_THREAD: usize = 1 << 10;

/// Fields on the nodes of one grid, to be written together. Nothing is copied.
pub struct VtiFile<'a, const D: usize> {
    grid: Grid<D>,
    precision: Precision,
    world: Option<WorldFrame<D>>,
    arrays: Vec<PointArray<'a>>,
}

struct PointArray<'a> {
    name: String,
    components: usize,
    /// The value of a component at a node.
    value: Box<dyn Fn(usize, usize) -> f64 + Sync + 'a>,
}

impl<'a, const D: usize> VtiFile<'a, D> {
    /// A file without fields yet.
    pub fn new(grid: Grid<D>, precision: Precision) -> Self {
        Self {
            grid,
            precision,
            world: None,
            arrays: Vec::new(),
        }
    }

    /// The same in the world: with its origin, its directions and its length unit, in which the
    /// vectors of fields that are added later are given, too.
    pub(crate) fn within(mut self, world: Option<WorldFrame<D>>) -> Self {
        self.world = world;
        self
    }

    /// Adds a field; vectors in the plane get a third component 0, as VTK vectors have three.
    ///
    /// # Panics
    /// If the field is on another grid.
    pub fn field<T: Element, const M: usize>(
        mut self,
        name: &str,
        field: &'a Field<T, D, M>,
    ) -> Self {
        assert_eq!(*field.grid(), self.grid, "a field of another grid");
        let n = self.grid.n_nodes();
        let number = move |node: usize, c: usize| field.as_slice()[c * n + node].to_f64();
        let world = self.world.filter(|_| M == D);
        self.arrays.push(PointArray {
            name: name.to_owned(),
            components: if M == 2 { 3 } else { M },
            value: Box::new(move |node, c| match world {
                _ if c >= M => 0.0,
                Some(world) => world.vector(std::array::from_fn(|k| number(node, k)))[c],
                None => number(node, c),
            }),
        });
        self
    }

    /// Adds fields as `kind_000` and so on.
    ///
    /// # Panics
    /// If a field is on another grid.
    pub fn fields<T: Element, const M: usize>(
        self,
        kind: &str,
        fields: impl IntoIterator<Item = &'a Field<T, D, M>>,
    ) -> Self {
        let fields = fields.into_iter().enumerate();
        fields.fold(self, |file, (i, field)| {
            file.field(&format!("{kind}_{i:03}"), field)
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let file = File::create(path).map_err(OutputError::at(path))?;
        let mut writer = BufWriter::new(file);
        self.write_to(&mut writer)
            .and_then(|()| writer.flush())
            .map_err(OutputError::at(path))
    }

    /// The same into any writer.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_to(&self, mut writer: impl Write) -> io::Result<()> {
        writer.write_all(self.header().as_bytes())?;
        for array in &self.arrays {
            writer.write_all(&(self.length(array) as u64).to_le_bytes())?;
            let mut bytes = vec![0; NODES_AT_ONCE * self.bytes_of_node(array)];
            for first in (0..self.grid.n_nodes()).step_by(NODES_AT_ONCE) {
                let nodes = NODES_AT_ONCE.min(self.grid.n_nodes() - first);
                let piece = &mut bytes[..nodes * self.bytes_of_node(array)];
                self.fill(piece, first, array);
                writer.write_all(piece)?;
            }
        }
        writer.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
    }

    /// The values at the nodes from `first` on.
    fn fill(&self, bytes: &mut [u8], first: usize, array: &PointArray) {
        let at_once = NODES_OF_A_THREAD * self.bytes_of_node(array);
        parallel::for_each_chunk(bytes, at_once, 1, &|chunk, bytes| {
            let nodes = first + chunk * NODES_OF_A_THREAD..;
            for (node, bytes) in nodes.zip(bytes.chunks_exact_mut(self.bytes_of_node(array))) {
                let numbers = bytes.chunks_exact_mut(self.bytes_of_number());
                for (c, bytes) in numbers.enumerate() {
                    let value = (array.value)(node, c);
                    match self.precision {
                        Precision::Single => bytes.copy_from_slice(&(value as f32).to_le_bytes()),
                        Precision::Double => bytes.copy_from_slice(&value.to_le_bytes()),
                    }
                }
            }
        });
    }

    fn bytes_of_number(&self) -> usize {
        match self.precision {
            Precision::Single => 4,
            Precision::Double => 8,
        }
    }

    fn bytes_of_node(&self, array: &PointArray) -> usize {
        self.bytes_of_number() * array.components
    }

    /// Bytes of an array.
    fn length(&self, array: &PointArray) -> usize {
        self.bytes_of_node(array) * self.grid.n_nodes()
    }

    fn header(&self) -> String {
        let nodes = self.grid.nodes_per_axis();
        let last = |k: usize| nodes.get(k).map_or(0, |n| n - 1);
        let extent = format!("0 {} 0 {} 0 {}", last(0), last(1), last(2));
        let place = self.place();
        let kind = match self.precision {
            Precision::Single => "Float32",
            Precision::Double => "Float64",
        };
        let mut offset = 0;
        let mut arrays = Vec::new();
        for array in &self.arrays {
            arrays.push(format!(
                "        <DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{}\" \
                 format=\"appended\" offset=\"{offset}\"/>\n",
                escaped(&array.name),
                array.components,
            ));
            offset += 8 + self.length(array);
        }
        let arrays = arrays.concat();
        format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n  \
             <ImageData WholeExtent=\"{extent}\" {place}>\n    \
             <Piece Extent=\"{extent}\">\n      <PointData>\n{arrays}      </PointData>\n    \
             </Piece>\n  </ImageData>\n  <AppendedData encoding=\"raw\">\n_"
        )
    }

    /// The attributes that place the grid.
    fn place(&self) -> String {
        let h = self.grid.spacing();
        let Some(world) = &self.world else {
            return format!("Origin=\"0 0 0\" Spacing=\"{h} {h} {h}\"");
        };
        let h = h * world.length();
        let (origin, rows) = (world.origin(), world.direction());
        let origin = [0, 1, 2].map(|k| origin.get(k).copied().unwrap_or(0.0));
        let number = |i: usize, j: usize| match rows.get(i).and_then(|row| row.get(j)) {
            Some(number) => *number,
            // The third axis of a picture.
            None => f64::from(u8::from(i == j)),
        };
        let direction: Vec<String> = (0..9).map(|k| number(k / 3, k % 3).to_string()).collect();
        let [x, y, z] = origin;
        format!(
            "Origin=\"{x} {y} {z}\" Spacing=\"{h} {h} {h}\" Direction=\"{}\"",
            direction.join(" ")
        )
    }
}

/// A text as the value of an attribute.
pub(super) fn escaped(name: &str) -> String {
    name.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{ScalarField, VectorField};

    #[test]
    fn arrays_lie_where_the_header_says() {
        let grid = Grid::<2>::with_nodes([4, 3], 0.5).unwrap();
        let scalar = ScalarField::<f64, 2>::from_fn(grid, |x| [x[0] - x[1]]);
        let vector = VectorField::<f64, 2>::identity(grid);
        let mut bytes = Vec::new();
        VtiFile::new(grid, Precision::Double)
            .field("a<b", &scalar)
            .field("position", &vector)
            .write_to(&mut bytes)
            .unwrap();
        let marker = b"encoding=\"raw\">\n_";
        let start = bytes
            .windows(marker.len())
            .position(|w| w == marker)
            .unwrap()
            + marker.len();
        let header = std::str::from_utf8(&bytes[..start]).unwrap();
        assert!(header.contains("WholeExtent=\"0 3 0 2 0 0\""), "{header}");
        assert!(header.contains("Name=\"a&lt;b\" NumberOfComponents=\"1\""));
        assert!(header.contains("NumberOfComponents=\"3\" format=\"appended\" offset=\"104\""));
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let length = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!(length(start), 12 * 8);
        for node in 0..12 {
            assert_eq!(number(start + 8 + 8 * node), scalar.at(node)[0]);
        }
        let second = start + 104;
        assert_eq!(length(second), 36 * 8);
        for node in 0..12 {
            let [x, y] = vector.at(node);
            for (c, value) in [x, y, 0.0].into_iter().enumerate() {
                assert_eq!(number(second + 8 + 8 * (3 * node + c)), value);
            }
        }
        assert!(bytes[second + 8 + 36 * 8..].starts_with(b"\n  </AppendedData>"));
    }
}
