//! The pictures, with the shapes themselves as marks.

use fe_grid::parallel;

use super::Outcome;
use super::study::Completed;
use shapespace_picture::{
    Camera, Canvas, Colour, HeatMap, Key, ScatterPlot, Shape, TreeChart, WHITE, colour, mix,
};

/// Pixels of a small picture of a shape.
const SMALL: usize = 44;

/// A small picture of each shape in its colour, all at one scale, with this many pixels along the
/// longer side.
fn marks(shapes: &[Shape], colours: &[Colour], side: usize) -> Vec<Canvas> {
    let camera = Camera::around(shapes, side).with_longer_side(side);
    let line = (side as f32 / 50.0).clamp(1.0, 1.6);
    parallel::map(shapes.iter().zip(colours), &|(shape, &colour)| {
        camera.drawn(shape, mix(WHITE, colour, 0.45), line, colour)
    })
}

/// What all pictures have in common.
pub(super) struct Sheets {
    names: Vec<String>,
    /// Of each shape: its class, or its cluster where there are no classes.
    groups: Vec<usize>,
    key: Vec<Key>,
    small: Vec<Canvas>,
    large: Vec<Canvas>,
}

impl Sheets {
    pub fn new<const D: usize>(outcome: &Outcome<D>) -> Self {
        let n = outcome.inputs.len();
        let completed = outcome.study.distances.completed.as_ref();
        let groups: Vec<usize> = match (&outcome.classes, completed) {
            (Some(classes), _) => classes.of_input.clone(),
            (None, Some(completed)) => completed.labels.clone(),
            (None, None) => vec![0; n],
        };
        let key = outcome.classes.as_ref().map(|classes| {
            let names = classes.names.iter().enumerate();
            names
                .map(|(i, name)| Key {
                    name: name.clone(),
                    category: i,
                })
                .collect()
        });
        let colours: Vec<Colour> = groups.iter().map(|&group| colour(group)).collect();
        let embedded = outcome.study.groups.as_ref();
        let side = embedded.map_or(SMALL, |g| ScatterPlot::mark_side(&g.refined.points));
        let contours = outcome.inputs.iter().map(|input| &input.contour);
        let shapes: Vec<Shape> = contours.map(Shape::of).collect();
        Self {
            names: outcome.inputs.iter().map(|i| i.name.clone()).collect(),
            small: marks(&shapes, &colours, SMALL),
            large: marks(&shapes, &colours, side),
            groups,
            key: key.unwrap_or_default(),
        }
    }

    /// The small pictures of the shapes.
    pub fn into_marks(self) -> Vec<Canvas> {
        self.small
    }

    /// All pictures with the names of their files. Without distances between all shapes there is
    /// only the matrix.
    pub fn draw<const D: usize>(&self, outcome: &Outcome<D>) -> Vec<(&'static str, Canvas)> {
        let distances = &outcome.study.distances;
        let n = self.names.len();
        let known = |i: usize, j: usize| distances.between.between(i, j);
        let completed = distances.completed.as_ref();
        let order = completed.map_or_else(|| (0..n).collect(), |c| c.tree.order().to_vec());
        let matrix = HeatMap {
            names: &self.names,
            marks: &self.small,
            groups: &self.groups,
            order: &order,
            value: &known,
            title: "distance L",
        };
        let mut sheets = vec![("matrix.png", matrix.draw())];
        if let Some(completed) = completed {
            sheets.push(("dendrogram.png", self.tree(completed)));
        }
        if let Some(groups) = &outcome.study.groups {
            let plot = ScatterPlot {
                curves: &[],
                axes: &[],
                points: &groups.refined.points,
                marks: &self.large,
                names: &self.names,
                groups: &self.groups,
                key: &self.key,
                title: &format!(
                    "stress {:.3}, {:.2} of the variance in classical scaling",
                    groups.refined.stress, groups.classical.explained
                ),
                unit: "L",
            };
            sheets.push(("embedding.png", plot.draw()));
        }
        sheets
    }

    fn tree(&self, completed: &Completed) -> Canvas {
        let merges: Vec<(usize, usize, f64)> = completed
            .tree
            .merges()
            .iter()
            .map(|merge| (merge.left, merge.right, merge.height))
            .collect();
        TreeChart {
            names: &self.names,
            marks: &self.small,
            groups: &self.groups,
            order: completed.tree.order(),
            merges: &merges,
            labels: &completed.labels,
            key: &self.key,
            title: "distance L",
        }
        .draw()
    }
}
