//! The shapes at their scores in the first two modes.

use fe_grid::parallel;
use levelset::Contour;
use shape_pca::ModeSpace;
use shape_pca::groups::mean_ellipse;
use shapespace_picture::{
    Axis, Camera, Canvas, GroupCurve, Key, ScatterPlot, Shape, WHITE, colour, mix,
};
use shapespace_report::palette::GREY;

/// Ellipses contain the mean of a group with this probability.
const LEVEL: f64 = 0.95;
/// Points of an ellipse.
const AROUND: usize = 96;

/// A map of scores.
pub(crate) struct ScoreMap<'a, const D: usize> {
    /// The boundary of the average.
    pub average: &'a Contour<D>,
    pub space: &'a ModeSpace<D>,
    /// Of every shape, in standard deviations, two or more.
    pub scores: &'a [Vec<f64>],
    pub names: &'a [String],
    /// The number of the group of every shape.
    pub groups: &'a [usize],
    /// Names of the groups; none of shapes that are not grouped.
    pub group_names: &'a [String],
    /// Scores at the ends of the axes.
    pub amplitude: f64,
}

impl<const D: usize> ScoreMap<'_, D> {
    fn shape(&self, scores: &[f64]) -> Option<Shape> {
        let displacement = self.space.synthesise(scores).ok()?;
        Some(Shape::of(&self.average.displaced(&displacement, -1.0)))
    }

    /// Every shape at its scores, shapes of single modes at the ends of the axes, and ellipses around the
    /// means of groups; `None` for scores of other modes than there are.
    pub fn draw(&self) -> Option<Canvas> {
        let points: Vec<[f64; 2]> = self.scores.iter().map(|s| [s[0], s[1]]).collect();
        let side = ScatterPlot::mark_side(&points);
        let shapes: Option<Vec<Shape>> = self.scores.iter().map(|s| self.shape(s)).collect();
        let shapes = shapes?;
        let a = self.amplitude;
        let ends = [[-a, 0.0], [a, 0.0], [0.0, -a], [0.0, a]];
        let extremes: Option<Vec<Shape>> = ends.iter().map(|scores| self.shape(scores)).collect();
        let extremes = extremes?;
        let all: Vec<Shape> = shapes.iter().chain(&extremes).cloned().collect();
        let camera = Camera::around(&all, side).with_longer_side(side);
        let marks = parallel::map(shapes.iter().zip(self.groups), &|(shape, &group)| {
            let tone = colour(group);
            camera.drawn(shape, mix(WHITE, tone, 0.45), 1.2, tone)
        });
        let grey = |shape: &Shape| camera.drawn(shape, mix(WHITE, GREY, 0.15), 1.0, GREY);
        let axis = |mode: usize| Axis {
            points: [ends[2 * mode], ends[2 * mode + 1]],
            marks: [grey(&extremes[2 * mode]), grey(&extremes[2 * mode + 1])],
            names: [-a, a].map(|score| format!("mode {mode}: {score:+}")),
        };
        let curves: Vec<GroupCurve> = (0..self.group_names.len())
            .filter_map(|group| {
                let own = points.iter().zip(self.groups).filter(|(_, g)| **g == group);
                let own: Vec<[f64; 2]> = own.map(|(p, _)| *p).collect();
                Some((mean_ellipse(&own, LEVEL)?.points(AROUND), group))
            })
            .collect();
        let names = self.group_names.iter().enumerate();
        let key: Vec<Key> = names
            .map(|(category, name)| Key {
                name: name.clone(),
                category,
            })
            .collect();
        let title = if curves.is_empty() {
            "scores in the first two modes, in standard deviations"
        } else {
            "scores in the first two modes, in standard deviations; 95 % ellipses of the means"
        };
        let map = ScatterPlot {
            points: &points,
            marks: &marks,
            names: self.names,
            groups: self.groups,
            key: &key,
            curves: &curves,
            axes: &[axis(0), axis(1)],
            title,
            unit: "score",
        };
        Some(map.draw())
    }
}
