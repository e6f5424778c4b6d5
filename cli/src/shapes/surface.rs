//! Boundaries in the coordinates of the inputs: surfaces in 3D, outlines in 2D.

use std::path::Path;

use levelset::Contour;

use super::{BoundaryRecord, Coordinates, InputRecord, SurfaceRecord};
use crate::output::outline::write_outline;
use crate::output::surface::{PointArray, write_surface};
use crate::output::{OutputError, ResultDir};
use shapespace_picture::Shape;

/// The formats of surfaces for other programs.
const EXTENSIONS: [&str; 3] = ["stl", "ply", "vtp"];

/// The coordinates in which the boundaries of a result are written ([`Coordinates::of_result`]); those of the
/// unit box where the inputs have none in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResultPlace<const D: usize> {
    coordinates: Option<Coordinates<D>>,
    record: SurfaceRecord,
}

impl<const D: usize> ResultPlace<D> {
    /// The coordinates of the box itself.
    pub const UNIT_BOX: Self = Self {
        coordinates: None,
        record: SurfaceRecord {
            coordinates: "unit_box",
            of_input: None,
        },
    };

    /// Those of the result of these inputs.
    pub fn of_inputs(inputs: &[InputRecord<D>]) -> Self {
        let found = Coordinates::of_result(inputs);
        let Some((coordinates, number)) = found.filter(|(coordinates, _)| !coordinates.is_box())
        else {
            return Self::UNIT_BOX;
        };
        let record = SurfaceRecord {
            coordinates: if inputs[number].states_place() {
                "world"
            } else {
                "input"
            },
            of_input: Some(number),
        };
        Self {
            coordinates: Some(coordinates),
            record,
        }
    }

    /// The coordinates as they are recorded.
    pub fn record(&self) -> BoundaryRecord {
        BoundaryRecord {
            surface: (D == 3).then_some(self.record),
            outline: (D == 2).then_some(self.record),
        }
    }

    /// Whether these are millimetres in the world.
    pub fn in_world(&self) -> bool {
        self.record.coordinates == "world"
    }

    /// A boundary in these coordinates.
    pub fn placed(&self, shape: &Contour<D>) -> Contour<D> {
        let coordinates = self.coordinates.as_ref();
        coordinates.map_or_else(|| shape.clone(), |coordinates| coordinates.placed(shape))
    }

    /// Writes a boundary for other programs: in 3D as a surface, `NAME.stl`, `.ply` and `.vtp`, in 2D as closed
    /// curves, `NAME_outline.csv`, `.svg` and `.geojson`.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn write(
        &self,
        directory: &ResultDir,
        name: &str,
        shape: &Contour<D>,
    ) -> Result<(), OutputError> {
        if !directory.has_files() {
            return Ok(());
        }
        let placed = Shape::of(&self.placed(shape));
        if D == 2 {
            let path = directory.file(format!("{name}_outline"));
            return write_outline(&path, &placed.closed_curves());
        }
        for extension in EXTENSIONS {
            let path = directory.file(Path::new(name).with_extension(extension));
            write_surface(&path, placed.surface(), &[], self.in_world())?;
        }
        Ok(())
    }

    /// Writes a surface with numbers at its points, `NAME.vtp`; nothing in 2D.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn write_with(
        &self,
        directory: &ResultDir,
        name: impl AsRef<Path>,
        shape: &Contour<D>,
        arrays: &[PointArray<'_>],
    ) -> Result<(), OutputError> {
        if D == 2 {
            return Ok(());
        }
        directory.with_file(name.as_ref().with_extension("vtp"), |path| {
            let placed = Shape::of(&self.placed(shape));
            write_surface(path, placed.surface(), arrays, self.in_world())
        })
    }
}
