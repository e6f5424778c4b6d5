//! The pictures, with the shapes themselves as marks.

use fe_grid::parallel;

use super::Outcome;
use super::study::Completed;
use crate::picture::{
    Bounds, Canvas, Colour, Curve, HeatMap, Key, Paint, ScatterPlot, TreeChart, View, WHITE,
    Window, colour, mix, solid,
};
use crate::shapes::{Input, curves, surface, triangles};

/// Height of the eye, in degrees.
const ELEVATION: f64 = 22.0;
/// Pixels of a small picture of a shape.
const SMALL: usize = 44;

/// Small pictures of shapes in `D` dimensions.
pub(super) trait Draw<const D: usize> {
    /// One of each shape in its colour, all at one scale and of one size, the longer side of so
    /// many pixels.
    fn marks(inputs: &[Input<D>], colours: &[Colour], side: usize) -> Vec<Canvas>;
}

/// Drawing in two and three dimensions.
pub(super) struct Pictures;

impl Draw<2> for Pictures {
    fn marks(inputs: &[Input<2>], colours: &[Colour], side: usize) -> Vec<Canvas> {
        let outlines: Vec<Vec<Curve>> = inputs.iter().map(|i| curves(&i.contour)).collect();
        let window = Window::around(outlines.iter().flatten(), side).with_longer_side(side);
        let line = (side as f32 / 50.0).clamp(1.0, 1.6);
        let pairs = outlines.iter().zip(colours);
        pairs
            .map(|(outline, &colour)| {
                let mut canvas = window.canvas();
                window.fill(&mut canvas, outline, mix(WHITE, colour, 0.45));
                window.outline(&mut canvas, outline, line, colour);
                canvas
            })
            .collect()
    }
}

impl Draw<3> for Pictures {
    fn marks(inputs: &[Input<3>], colours: &[Colour], side: usize) -> Vec<Canvas> {
        let meshes: Vec<_> = inputs.iter().map(|i| triangles(&i.contour)).collect();
        let surfaces: Vec<_> = inputs
            .iter()
            .zip(&meshes)
            .map(|(input, mesh)| surface(&input.contour, mesh))
            .collect();
        let view = surfaces.first().map_or(View::front(ELEVATION), |first| {
            View::broadside(*first, ELEVATION)
        });
        let bounds = Bounds::seen(view, surfaces.iter().copied());
        parallel::map(surfaces.iter().zip(colours), &|(surface, colour)| {
            surface.render(view, bounds, Paint::Plain(solid(*colour)), side)
        })
    }
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
    pub fn new<const D: usize, P: Draw<D>>(outcome: &Outcome<D>) -> Self {
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
        Self {
            names: outcome.inputs.iter().map(|i| i.name.clone()).collect(),
            small: P::marks(&outcome.inputs, &colours, SMALL),
            large: P::marks(&outcome.inputs, &colours, side),
            groups,
            key: key.unwrap_or_default(),
        }
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
