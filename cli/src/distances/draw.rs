//! The pictures, with the shapes themselves as marks.

use std::collections::HashSet;

use fe_grid::parallel;

use super::Outcome;
use super::classes::Labels;
use super::neighbours::Neighbours;
use super::pair::PairRecord;
use super::study::Completed;
use shapespace_picture::{
    Camera, Canvas, Colour, HeatMap, Key, ScatterPlot, Shape, TileRows, TreeChart, WHITE, colour,
    mix,
};

/// Pixels of a small picture of a shape.
const SMALL: usize = 44;
/// Most shapes that are drawn with their neighbours, and most neighbours of each.
const MOST_ROWS: usize = 40;
const MOST_NEIGHBOURS: usize = 7;

/// A small picture of each shape in its colour, all at one scale, with this many pixels along the
/// longer side.
fn marks(shapes: &[Shape], colours: &[Colour], side: usize) -> Vec<Canvas> {
    let camera = Camera::around(shapes, side).with_longer_side(side);
    let line = (side as f32 / 50.0).clamp(1.0, 1.6);
    parallel::map(shapes.iter().zip(colours), &|(shape, &colour)| {
        camera.drawn(shape, mix(WHITE, colour, 0.45), line, colour)
    })
}

/// The number of each shape's group: its class, or that of most of its neighbours where it has none of
/// its own; without classes its cluster, or whether it is new.
fn groups<const D: usize>(outcome: &Outcome<D>) -> Vec<usize> {
    let completed = outcome.study.distances.completed.as_ref();
    let (n, labels) = (outcome.inputs.len(), outcome.labels.as_ref());
    match (labels, completed) {
        (Some(labels), _) => {
            let neighbours = outcome.study.neighbours.as_ref();
            let voted = |shape: usize| voted(labels, neighbours?, shape);
            let class = |shape| labels.class(shape).or_else(|| voted(shape));
            (0..n).map(|i| class(i).unwrap_or_default()).collect()
        }
        (None, Some(completed)) => completed.labels.clone(),
        (None, None) => {
            let first = outcome.scope.columns().start;
            (0..n).map(|i| usize::from(i < first)).collect()
        }
    }
}

fn voted(labels: &Labels, neighbours: &Neighbours, shape: usize) -> Option<usize> {
    let found = neighbours.of.iter().find(|of| of.shape == shape)?;
    let name = found.vote.as_ref()?;
    labels.names().iter().position(|known| known == name)
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
        let groups = groups(outcome);
        let key = outcome.labels.as_ref().map(|labels| {
            let names = labels.names().iter().enumerate();
            names
                .map(|(i, name)| Key {
                    name: name.clone(),
                    category: i,
                })
                .collect()
        });
        let colours: Vec<Colour> = groups.iter().map(|&group| colour(group)).collect();
        let map = outcome.study.map.as_ref();
        let side = map.map_or(SMALL, |map| ScatterPlot::mark_side(map.points()));
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
        let (distances, scope) = (&outcome.study.distances, &outcome.scope);
        let known = |i: usize, j: usize| distances.between.between(i, j);
        let completed = distances.completed.as_ref();
        let [rows, columns] = [scope.rows(), scope.columns()]
            .map(|side| completed.map_or_else(|| side.collect(), |c| c.tree.order().to_vec()));
        let computed: HashSet<[usize; 2]> = outcome.records.iter().map(PairRecord::pair).collect();
        let skipped =
            |i: usize, j: usize| scope.is_sparse() && !computed.contains(&[i.min(j), i.max(j)]);
        let matrix = HeatMap {
            names: &self.names,
            marks: &self.small,
            groups: &self.groups,
            rows: &rows,
            columns: &columns,
            value: &known,
            skipped: &skipped,
            title: "distance L",
        };
        let mut sheets = vec![("matrix.png", matrix.draw())];
        if let Some(completed) = completed {
            sheets.push(("dendrogram.png", self.tree(completed)));
        }
        if let Some(map) = &outcome.study.map {
            let plot = ScatterPlot {
                curves: &[],
                axes: &[],
                points: map.points(),
                marks: &self.large,
                names: &self.names,
                groups: &self.groups,
                key: &self.key,
                title: &map.quality(),
                unit: "L",
            };
            sheets.push(("embedding.png", plot.draw()));
        }
        if let Some(neighbours) = &outcome.study.neighbours {
            let contours = outcome.inputs.iter().map(|input| &input.contour);
            let shapes: Vec<Shape> = contours.map(Shape::of).collect();
            sheets.push(("neighbours.png", self.neighbours(neighbours, &shapes)));
        }
        sheets
    }

    /// Shapes, each with its nearest neighbours on its right.
    fn neighbours(&self, neighbours: &Neighbours, shapes: &[Shape]) -> Canvas {
        let columns = 1 + neighbours.count.min(MOST_NEIGHBOURS);
        let mut rows = TileRows::new(columns);
        let side = TileRows::width(columns).min(160);
        let camera = Camera::around(shapes, side).with_longer_side(side);
        let picture = |shape: usize| {
            let tone = colour(self.groups[shape]);
            camera.drawn(&shapes[shape], mix(WHITE, tone, 0.45), 1.6, tone)
        };
        for of in neighbours.of.iter().take(MOST_ROWS) {
            rows.push(self.names[of.shape].clone(), picture(of.shape));
            for neighbour in of.nearest.iter().take(columns - 1) {
                let name = &self.names[neighbour.object];
                let label = format!("{name}  {:.3}", neighbour.distance);
                rows.push(label, picture(neighbour.object));
            }
            rows.end_row();
        }
        rows.draw()
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
