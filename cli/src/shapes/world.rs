//! The unit box in the world.

use fe_grid::Grid;
use levelset::RigidMotion;
use serde::{Deserialize, Serialize};

use super::{InputRecord, common_scale};
use shapespace_input::frame::FrameTransform;
use shapespace_input::lattice::Lattice;

/// From the unit box to the world: `world = direction (length unit) + origin`, in millimetres.
///
/// The world of results is that of the input that leads: every other one is aligned with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WorldFrame<const D: usize> {
    origin: [f64; D],
    /// An orthogonal matrix, row by row.
    direction: [[f64; D]; D],
    /// Millimetres of one length of the box.
    length: f64,
    /// Number of the input whose world this is.
    of_input: usize,
}

/// The world coordinates of the nodes, in the form in which they are written:
/// `world = direction (node spacing) + origin` for a node, counted along each axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WorldRecord {
    /// The orientation of the coordinates: to the right, to the front, upwards.
    pub space: String,
    pub unit: String,
    pub origin: Vec<f64>,
    /// Row by row; its columns are the directions of the axes of the grid.
    pub direction: Vec<Vec<f64>>,
    pub spacing: Vec<f64>,
    /// Number of the input whose coordinates these are.
    pub of_input: usize,
}

impl<const D: usize> WorldFrame<D> {
    /// The world of one input, if its frame lies in a world.
    fn of_input(
        frame: &FrameTransform<D>,
        motion: &RigidMotion<D>,
        of_input: usize,
    ) -> Option<Self> {
        if !frame.in_world() {
            return None;
        }
        let rows: [[f64; D]; D] = motion.rotation().transpose().into();
        Some(Self {
            origin: frame.to_physical(motion.map_back([0.0; D])),
            direction: transposed(rows.map(|row| frame.turned_back(row))),
            length: frame.scale().recip(),
            of_input,
        })
    }

    /// The world of inputs that all lie in one, with one scale.
    pub fn of_inputs(inputs: &[InputRecord<D>]) -> Option<Self> {
        let in_world = inputs.iter().all(|input| input.frame.in_world());
        if !in_world || common_scale(inputs.iter().map(InputRecord::scale)).is_none() {
            return None;
        }
        let number = inputs.iter().position(|input| input.leads).unwrap_or(0);
        Self::of_one(inputs, number)
    }

    /// The world of one of several inputs, if it has one.
    pub fn of_one(inputs: &[InputRecord<D>], number: usize) -> Option<Self> {
        let input = inputs.get(number)?;
        Self::of_input(&input.frame, &input.motion(), number)
    }

    /// The world coordinates of a point of the box.
    pub fn position(&self, unit: [f64; D]) -> [f64; D] {
        let turned = self.vector(unit);
        std::array::from_fn(|i| turned[i] + self.origin[i])
    }

    /// A vector of the box in the world.
    pub fn vector(&self, unit: [f64; D]) -> [f64; D] {
        let rows = self.direction;
        rows.map(|row| self.length * (0..D).map(|k| row[k] * unit[k]).sum::<f64>())
    }

    /// The point of the box at world coordinates.
    pub fn unit(&self, world: [f64; D]) -> [f64; D] {
        let relative: [f64; D] = std::array::from_fn(|i| world[i] - self.origin[i]);
        std::array::from_fn(|k| {
            let along: f64 = (0..D).map(|i| self.direction[i][k] * relative[i]).sum();
            along / self.length
        })
    }

    /// The nodes of a grid of the box; `None` in the plane.
    pub fn lattice(&self, grid: &Grid<D>) -> Option<Lattice> {
        let h = self.length * grid.spacing();
        if D != 3 {
            return None;
        }
        let step = |i: usize, j: usize| h * self.direction[i][j];
        Some(Lattice {
            size: grid.nodes_per_axis().as_slice().try_into().ok()?,
            affine: std::array::from_fn(|i| [step(i, 0), step(i, 1), step(i, 2), self.origin[i]]),
        })
    }

    /// The position of the first node.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// The directions of the axes, row by row.
    pub fn direction(&self) -> [[f64; D]; D] {
        self.direction
    }

    /// Number of the input whose world this is.
    pub fn number(&self) -> usize {
        self.of_input
    }

    /// Millimetres of one length of the box.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The form in which it is written, for a grid of this spacing in the unit box.
    pub fn record(&self, spacing: f64) -> WorldRecord {
        WorldRecord {
            space: "RAS".into(),
            unit: "mm".into(),
            origin: self.origin.to_vec(),
            direction: self.direction.iter().map(|row| row.to_vec()).collect(),
            spacing: vec![self.length * spacing; D],
            of_input: self.of_input,
        }
    }
}

fn transposed<const D: usize>(rows: [[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| rows[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SMatrix, SVector};
    use shapespace_input::block;
    use shapespace_input::place::physical_frames;
    use shapespace_input::whole::physical_views;

    #[test]
    fn an_aligned_reference_keeps_its_place_in_the_world() {
        let mut image = block([9, 9, 9], [1.0; 3], [2; 3], [6; 3]);
        image.affine = Some([
            [0.0, 0.0, -2.0, 5.0],
            [1.0, 0.0, 0.0, 6.0],
            [0.0, 3.0, 0.0, 7.0],
        ]);
        let straight = image.in_world().unwrap();
        let frame = physical_frames(&[straight])[0];
        let turn = SMatrix::from_row_slice(&[0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let motion = RigidMotion::new(turn, SVector::from([0.9, 0.2, -0.1])).unwrap();
        let world = WorldFrame::of_input(&frame, &motion, 4).unwrap();
        let sample = [1.5, 7.0, 3.0];
        let aligned = motion.map(frame.to_unit(sample));
        let expected = [-6.0 + 5.0, 1.5 + 6.0, 21.0 + 7.0];
        for (found, expected) in world.position(aligned).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let back = world.unit(world.position(aligned));
        for (found, expected) in back.into_iter().zip(aligned) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        // The same where the box is turned with an oblique image.
        image.affine = Some([
            [1.6, -0.6, 0.0, 5.0],
            [1.2, 0.8, 0.0, 6.0],
            [0.0, 0.0, -3.0, 7.0],
        ]);
        let oblique = [image.in_world().unwrap()];
        let (frames, grid) = physical_views(&oblique, 0, 9).unwrap();
        let turned = WorldFrame::of_input(&frames[0], &RigidMotion::identity(), 0).unwrap();
        let place = turned.position(frames[0].to_unit(sample));
        let expected = [2.4 - 4.2 + 5.0, 1.8 + 5.6 + 6.0, -9.0 + 7.0];
        for (found, expected) in place.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert!((turned.direction()[1][0] - 0.6).abs() < 1e-12 && turned.direction()[2][2] == 1.0);
        assert_eq!(grid.extent()[2], 1.0);
        let grid = Grid::<3>::cube(5);
        let lattice = world.lattice(&grid).unwrap();
        let (node, place) = (
            lattice.position(77),
            world.position(grid.position(grid.node(77))),
        );
        for (found, expected) in node.into_iter().zip(place) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let record = world.record(0.25);
        assert_eq!(
            (record.of_input, record.spacing[2]),
            (4, 0.25 / frame.scale())
        );
    }
}
