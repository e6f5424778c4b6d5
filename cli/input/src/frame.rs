//! Transforms from samples to the box: to the unit box while shapes are placed, and then to that part
//! of it which the grid covers, whose first node is the origin ([`corner_in_unit_box`]).

use fe_grid::Grid;
use fe_grid::tensor::{determinant, inverse_transpose};
use serde::{Deserialize, Serialize};

use super::Image;

/// The rule by which an image was placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameRule {
    /// Samples are nodes.
    AsIs,
    /// One transform for all images.
    Shared,
    /// One scale for all images, each object in the middle.
    Centred,
    /// One transform from the world to the box for all images.
    Physical,
    /// The whole image in the middle of the box, in which the longest side of all is one.
    Whole,
}

/// From sample indices to the unit box:
/// `unit = scale * turn physical + offset` with `physical = direction (sample * spacing) + origin`.
/// Images that have no place in the world have no direction; their axes are those of the box. The axes of
/// the box are those of the world unless they are turned with a grey image that is oblique.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "FrameRecord", try_from = "FrameRecord")]
pub struct FrameTransform<const D: usize> {
    scale: f64,
    spacing: [f64; D],
    origin: [f64; D],
    direction: Option<[[f64; D]; D]>,
    /// An orthogonal matrix, row by row; none for the identity.
    turn: Option<[[f64; D]; D]>,
    offset: [f64; D],
    rule: FrameRule,
}

impl<const D: usize> FrameTransform<D> {
    /// The transform of an image whose lengths are scaled by a factor, and then moved.
    pub(crate) fn of_image(
        image: &Image<D>,
        scale: f64,
        offset: [f64; D],
        rule: FrameRule,
    ) -> Self {
        Self {
            scale,
            spacing: image.spacing,
            origin: image.origin,
            direction: image.direction,
            turn: None,
            offset,
            rule,
        }
    }

    /// The transform that turns the world by an orthogonal matrix before anything else.
    pub(crate) fn turned(self, turn: Option<[[f64; D]; D]>) -> Self {
        Self { turn, ..self }
    }

    /// The transform of an image that puts a point of its physical space into the middle of the
    /// box.
    pub(crate) fn around(image: &Image<D>, scale: f64, centre: [f64; D], rule: FrameRule) -> Self {
        Self::of_image(image, scale, centre.map(|c| 0.5 - scale * c), rule)
    }

    /// The transform of an image whose samples are the nodes of a grid, which lies in the middle of
    /// the unit box.
    pub(crate) fn nodal(grid: &Grid<D>) -> Self {
        Self {
            scale: grid.spacing(),
            spacing: [1.0; D],
            origin: [0.0; D],
            direction: None,
            turn: None,
            offset: corner_in_unit_box(grid),
            rule: FrameRule::AsIs,
        }
    }

    /// The frame whose box is moved by a vector.
    pub fn moved(&self, by: [f64; D]) -> Self {
        Self {
            offset: std::array::from_fn(|k| self.offset[k] + by[k]),
            ..*self
        }
    }

    /// The same transform from physical space to the box, from the samples of another image.
    pub fn for_image(&self, image: &Image<D>) -> Self {
        Self::of_image(image, self.scale, self.offset, self.rule).turned(self.turn)
    }

    /// The placement of another image that belongs to one with this frame, `size` samples, and lengths that were
    /// multiplied by a factor before: its visible part, or a variation of it. In the world it lies by its own place
    /// there; an exact boundary has coordinates of its own; all others have as many samples, at the same
    /// places. `None` for one of which the place is not known.
    pub fn beside(&self, size: &[usize], factor: f64, image: &Image<D>) -> Option<Self> {
        let scaled = |image: &Image<D>| {
            let mut frame = self.for_image(image);
            frame.spacing = frame.spacing.map(|h| factor * h);
            frame.origin = frame.origin.map(|x| factor * x);
            frame
        };
        let same = || (image.size == size && image.outline.is_none()).then_some(*self);
        if self.rule == FrameRule::AsIs {
            return same();
        }
        if self.in_world() {
            return match image.in_world() {
                Some(image) => Some(scaled(&image)),
                None => same(),
            };
        }
        match image.outline {
            Some(_) => Some(scaled(image)),
            None => same(),
        }
    }

    /// Whether the samples of an image have the same physical positions.
    pub fn has_lattice_of(&self, image: &Image<D>) -> bool {
        self.spacing == image.spacing
            && self.origin == image.origin
            && self.direction == image.direction
    }

    /// The rule that determined it.
    pub fn rule(&self) -> FrameRule {
        self.rule
    }

    /// Whether its physical space is the world, in millimetres.
    pub fn in_world(&self) -> bool {
        self.direction.is_some()
    }

    /// For every axis of the box the axis of samples that is nearest to it, and whether that has
    /// the opposite direction.
    pub fn box_axes(&self) -> [(usize, bool); D] {
        let Some(rows) = &self.direction_in_box() else {
            return std::array::from_fn(|k| (k, false));
        };
        nearest_axes(rows)
    }

    /// The directions of the axes of samples in the box, row by row.
    fn direction_in_box(&self) -> Option<[[f64; D]; D]> {
        let columns = self.direction?;
        Some(match &self.turn {
            None => columns,
            Some(turn) => product(turn, &columns),
        })
    }

    /// A direction of the box in physical space.
    pub fn turned_back(&self, direction: [f64; D]) -> [f64; D] {
        match &self.turn {
            None => direction,
            Some(turn) => std::array::from_fn(|i| (0..D).map(|k| turn[k][i] * direction[k]).sum()),
        }
    }

    /// Whether samples that are counted along the axes of the box ([`Self::box_axes`]) are reflected.
    pub fn reverses(&self) -> bool {
        let Some(rows) = &self.direction_in_box() else {
            return false;
        };
        let axes = self.box_axes();
        let counted = rows
            .map(|row| axes.map(|(axis, reversed)| if reversed { -row[axis] } else { row[axis] }));
        determinant(&counted) < 0.0
    }

    /// Whether samples are reflected.
    pub(crate) fn reflects(&self) -> bool {
        self.direction.is_some_and(|rows| determinant(&rows) < 0.0)
    }

    /// Unit-box length of one length unit of the file.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Unit-box length of one sample along each axis.
    pub fn sample_size(&self) -> [f64; D] {
        self.spacing.map(|h| self.scale * h)
    }

    /// The frame scaled towards the centre of the unit box by a factor.
    pub fn shrunk(&self, factor: f64) -> Self {
        Self {
            scale: factor * self.scale,
            offset: self.offset.map(|x| 0.5 + factor * (x - 0.5)),
            ..*self
        }
    }

    /// Whether it maps samples to the same positions as another frame, up to rounding.
    pub fn like(&self, other: &Self) -> bool {
        let axes = (0..D).map(|k| std::array::from_fn(|i| f64::from(u8::from(i == k))));
        let mut points = axes.chain([[0.0; D], [1.0; D]]);
        points.all(|sample| {
            let (a, b) = (self.to_unit(sample), other.to_unit(sample));
            (0..D).all(|k| (a[k] - b[k]).abs() < 1e-9)
        })
    }

    /// Unit-box position of a (fractional) sample index.
    pub fn to_unit(&self, sample: [f64; D]) -> [f64; D] {
        let along: [f64; D] = std::array::from_fn(|k| sample[k] * self.spacing[k]);
        let turned = match &self.direction {
            None => along,
            Some(rows) => applied(rows, along),
        };
        let mut physical = std::array::from_fn(|k| turned[k] + self.origin[k]);
        if let Some(turn) = &self.turn {
            physical = applied(turn, physical);
        }
        std::array::from_fn(|k| self.scale * physical[k] + self.offset[k])
    }

    /// Sample index of a point of the unit box.
    pub fn to_sample(&self, unit: [f64; D]) -> [f64; D] {
        let physical = self.to_physical(unit);
        let from_origin: [f64; D] = std::array::from_fn(|k| physical[k] - self.origin[k]);
        let along = match &self.direction {
            None => from_origin,
            Some(rows) => solved(rows, from_origin),
        };
        std::array::from_fn(|k| along[k] / self.spacing[k])
    }

    /// Position in the file's length units of a point of the unit box; in the world where the frame
    /// lies [there](Self::in_world).
    pub fn to_physical(&self, unit: [f64; D]) -> [f64; D] {
        self.turned_back(std::array::from_fn(|k| {
            (unit[k] - self.offset[k]) / self.scale
        }))
    }
}

/// For every row the column that is largest there, each once, and whether it is negative.
pub(crate) fn nearest_axes<const D: usize>(rows: &[[f64; D]; D]) -> [(usize, bool); D] {
    let mut free: Vec<usize> = (0..D).collect();
    std::array::from_fn(|i| {
        let nearest = (0..free.len())
            .max_by(|&a, &b| rows[i][free[a]].abs().total_cmp(&rows[i][free[b]].abs()));
        // There are as many columns as rows.
        let axis = free.remove(nearest.unwrap_or(0));
        (axis, rows[i][axis] < 0.0)
    })
}

/// A matrix times a vector.
pub(crate) fn applied<const D: usize>(rows: &[[f64; D]; D], x: [f64; D]) -> [f64; D] {
    rows.map(|row| (0..D).map(|k| row[k] * x[k]).sum())
}

fn product<const D: usize>(a: &[[f64; D]; D], b: &[[f64; D]; D]) -> [[f64; D]; D] {
    a.map(|row| std::array::from_fn(|j| (0..D).map(|k| row[k] * b[k][j]).sum()))
}

/// The corner of a grid that lies in the middle of the unit box: 0 along every axis for a grid of the
/// whole unit box, negative where the grid is longer.
pub fn corner_in_unit_box<const D: usize>(grid: &Grid<D>) -> [f64; D] {
    grid.extent().map(|side| 0.5 * (1.0 - side))
}

/// The solution of `rows x = right`.
fn solved<const D: usize>(rows: &[[f64; D]; D], right: [f64; D]) -> [f64; D] {
    let inverse = inverse_transpose(rows);
    std::array::from_fn(|k| (0..D).map(|i| inverse[i][k] * right[i]).sum())
}

/// The form in which a transform is written to files.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRecord {
    rule: FrameRule,
    scale: f64,
    spacing: Vec<f64>,
    origin: Vec<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    direction: Option<Vec<Vec<f64>>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    turn: Option<Vec<Vec<f64>>>,
    offset: Vec<f64>,
}

impl<const D: usize> From<FrameTransform<D>> for FrameRecord {
    fn from(frame: FrameTransform<D>) -> Self {
        let written = |rows: [[f64; D]; D]| rows.iter().map(|row| row.to_vec()).collect();
        Self {
            rule: frame.rule,
            scale: frame.scale,
            spacing: frame.spacing.to_vec(),
            origin: frame.origin.to_vec(),
            direction: frame.direction.map(written),
            turn: frame.turn.map(written),
            offset: frame.offset.to_vec(),
        }
    }
}

/// A written transform that cannot be one of this dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a frame transform needs a positive scale and positive spacings, one number for each axis, \
     independent directions, and a turn that keeps lengths"
)]
pub struct FrameRecordError;

impl<const D: usize> TryFrom<FrameRecord> for FrameTransform<D> {
    type Error = FrameRecordError;

    fn try_from(record: FrameRecord) -> Result<Self, FrameRecordError> {
        let axes = |numbers: Vec<f64>| <[f64; D]>::try_from(numbers).map_err(|_| FrameRecordError);
        let matrix = |rows: Vec<Vec<f64>>| {
            let rows: Result<Vec<[f64; D]>, _> = rows.into_iter().map(axes).collect();
            <[[f64; D]; D]>::try_from(rows?).map_err(|_| FrameRecordError)
        };
        let frame = Self {
            rule: record.rule,
            scale: record.scale,
            spacing: axes(record.spacing)?,
            origin: axes(record.origin)?,
            direction: record.direction.map(matrix).transpose()?,
            turn: record.turn.map(matrix).transpose()?,
            offset: axes(record.offset)?,
        };
        let positive = |x: &f64| *x > 0.0 && x.is_finite();
        let independent = frame.direction.is_none_or(|rows| {
            let size = determinant(&rows).abs();
            size > 0.0 && size.is_finite()
        });
        let orthogonal = frame.turn.is_none_or(|turn| {
            let square = product(&turn, &std::array::from_fn(|i| turn.map(|row| row[i])));
            let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
            (0..D).all(|i| (0..D).all(|j| (square[i][j] - unit(i, j)).abs() < 1e-6))
        });
        if positive(&frame.scale) && frame.spacing.iter().all(positive) && independent && orthogonal
        {
            Ok(frame)
        } else {
            Err(FrameRecordError)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;

    #[test]
    fn images_beside_one_lie_by_their_own_places() {
        let stated = |affine: [[f64; 4]; 3], size| {
            let mut image = block(size, [1.0; 3], [2; 3], [3; 3]);
            image.affine = Some(affine);
            image
        };
        let one = stated(
            [
                [2.0, 0.0, 0.0, 5.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            [9, 8, 7],
        );
        let world = one.in_world().unwrap();
        let frame = FrameTransform::around(&world, 0.05, [1.0, 2.0, 3.0], FrameRule::Physical);
        // The first axis is reversed, and begins where it ended.
        let reversed = stated(
            [
                [-2.0, 0.0, 0.0, 21.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            [9, 8, 7],
        );
        let beside = frame.beside(&one.size, 1.0, &reversed).unwrap();
        let near = |p: [f64; 3], q: [f64; 3]| (0..3).all(|k| (p[k] - q[k]).abs() < 1e-12);
        assert!(near(
            beside.to_unit([8.0, 1.0, 2.0]),
            frame.to_unit([0.0, 1.0, 2.0])
        ));
        // The same lengths after both were halved.
        let halved = frame.beside(&one.size, 0.5, &reversed).unwrap();
        let along = |frame: &FrameTransform<3>| frame.sample_size()[0];
        assert!((along(&halved) - 0.5 * along(&beside)).abs() < 1e-15);
        // Without a place it has the same samples or none.
        let mut nowhere = reversed.clone();
        nowhere.affine = None;
        assert_eq!(frame.beside(&one.size, 1.0, &nowhere), Some(frame));
        assert_eq!(frame.beside(&[9, 8, 6], 1.0, &nowhere), None);
        let flat = FrameTransform::around(&nowhere, 0.05, [1.0; 3], FrameRule::Shared);
        assert_eq!(flat.beside(&one.size, 1.0, &reversed), Some(flat));
        assert_eq!(flat.beside(&[9, 8, 6], 1.0, &reversed), None);
    }

    #[test]
    fn sheared_and_reflected_axes_invert_and_are_written() {
        let mut image = block([9, 9, 9], [1.0; 3], [2; 3], [6; 3]);
        image.spacing = [0.5, 2.0, 3.0];
        image.origin = [-4.0, 7.0, 1.0];
        image.direction = Some([[0.0, 0.6, 0.1], [-1.0, 0.0, 0.0], [0.0, 0.8, -0.9]]);
        let frame = FrameTransform::around(&image, 0.04, [1.0, 2.0, 3.0], FrameRule::Physical);
        let sample = [1.25, -3.0, 8.0];
        let unit = frame.to_unit(sample);
        // The first axis points along -y, the second has the direction (.6, 0, .8).
        let world = [
            0.6 * -6.0 + 0.1 * 24.0 - 4.0,
            -0.625 + 7.0,
            0.8 * -6.0 - 0.9 * 24.0 + 1.0,
        ];
        let back = frame.to_sample(unit);
        for k in 0..3 {
            assert!((frame.to_physical(unit)[k] - world[k]).abs() < 1e-12);
            assert!((back[k] - sample[k]).abs() < 1e-12);
        }
        assert!((determinant(&image.direction.unwrap()) + 0.62).abs() < 1e-14);
        assert_eq!(frame.box_axes(), [(1, false), (0, true), (2, true)]);
        // Reversed twice and exchanged once, the axes are right-handed.
        assert!(!frame.reverses() && frame.in_world());
        let text = serde_json::to_string(&frame).unwrap();
        assert_eq!(
            serde_json::from_str::<FrameTransform<3>>(&text).unwrap(),
            frame
        );
        image.direction = Some([[0.0, 0.6, 0.1]; 3]);
        let flat = serde_json::to_string(&frame.for_image(&image)).unwrap();
        assert!(serde_json::from_str::<FrameTransform<3>>(&flat).is_err());
    }

    #[test]
    fn frames_that_differ_in_one_axis_are_not_alike() {
        let image = block([9, 9], [1.0; 2], [2; 2], [6; 2]);
        let frame = |direction| {
            let turned = Image {
                direction: Some(direction),
                ..image.clone()
            };
            FrameTransform::around(&turned, 0.1, [4.0; 2], FrameRule::Physical)
        };
        let upright = frame([[1.0, 0.0], [0.0, 1.0]]);
        // Axes that are exchanged leave the corners on the diagonal where they are.
        assert!(!upright.like(&frame([[0.0, 1.0], [1.0, 0.0]])));
        assert!(upright.like(&frame([[1.0, 1e-12], [0.0, 1.0]])));
    }
}
