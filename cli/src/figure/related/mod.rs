//! Related notions of the mean and the distance of plane shapes, beside those of this program.
//!
//! `elastic` has those of this program and of linear elasticity; `landmarks`, `hausdorff`, `signed_distance`
//! and `srvf` (with `reparametrise`) each have one of the literature, in a small implementation that shows
//! what it does; `space` has means and medians in spaces with geodesics, `curve` closed polygons, `place`
//! where means without a place are drawn, and `measures` what is measured of every mean.

mod curve;
mod elastic;
mod hausdorff;
mod landmarks;
mod measures;
mod place;
mod reparametrise;
mod signed_distance;
mod space;
mod srvf;
mod text;

use std::time::Instant;

use fe_grid::ScalarField;
use levelset::{BoxEdge, LevelsetError, contour};
use shape_average::{AverageError, Mean};
use shapespace_picture::{INK, WHITE, colour, mix};
use shapespace_report::table::{Cell, Table};

use super::scene::Scene;
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;
use curve::Curve;
use landmarks::LANDMARKS;
use measures::{Measures, measure};

/// Mean distances below this are rounding errors.
const SAME: f64 = 1e-9;
/// Tiles in a row.
const COLUMNS: usize = 5;

/// A notion of mean and distance.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Notion {
    Average,
    Median,
    Linear,
    SignedDistances,
    Hausdorff,
    Landmarks,
    LandmarksMedian,
    ElasticCurves,
}

/// All of them, in the order of the rows and tiles.
const NOTIONS: [Notion; 8] = [
    Notion::Average,
    Notion::Median,
    Notion::Linear,
    Notion::SignedDistances,
    Notion::Hausdorff,
    Notion::Landmarks,
    Notion::LandmarksMedian,
    Notion::ElasticCurves,
];

/// Shapes that are compared with each other.
struct Group<'a, const D: usize> {
    /// The number of its first shape in the figure.
    first: usize,
    names: &'a [String],
    distances: &'a [ScalarField<f64, D>],
    /// The outer boundaries.
    curves: Vec<Curve>,
}

/// What a notion says of a group.
struct Found<const D: usize> {
    /// The mean as a signed distance; `None` where it is empty.
    mean: Option<ScalarField<f64, D>>,
    /// The distances of all pairs; none where they are those of another notion.
    distances: Vec<f64>,
    /// Of how many pairs a deformation arrives at its end.
    arrived: Option<usize>,
}

/// All notions on all groups of shapes.
pub(super) fn related<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    if D != 2 {
        return Err(CliError::Option {
            option: "INPUT",
            value: "with volumes".into(),
            remedy: "the figure compares plane shapes".into(),
        });
    }
    let mut table = Table::new([
        "shapes",
        "notion",
        "area",
        "thickness",
        "protrusion",
        "pieces",
        "mean distance",
        "pairs over their mean",
        "arrive",
        "seconds",
    ]);
    let mut tiles = Tiles::new(&scene.grid(), COLUMNS);
    let mut first = 0;
    for &n in &scene.groups {
        let members = first..first + n;
        let group = Group::new(
            first,
            &scene.names[members.clone()],
            &scene.distances[members],
        )?;
        let inputs = group.measures()?;
        let label = group.label();
        tiles.shapes(&label, group.distances, 0.0);
        for notion in NOTIONS {
            let begin = Instant::now();
            scene.session.progress.note(notion.name());
            let found = notion.find(scene, &group)?;
            let seconds = begin.elapsed().as_secs_f64();
            if scene.session.interrupt.asked() {
                return Err(CliError::Stopped);
            }
            table.row(row(&label, notion, &group, &found, inputs, seconds));
            tiles.push(notion.name(), tile(&tiles, &group, &found));
        }
        tiles.end_row();
        first += n;
    }
    Ok(Sheet {
        title: "Related notions of mean and distance",
        text: text::TEXT.into(),
        table,
        picture: tiles.draw(),
    })
}

impl Notion {
    fn name(self) -> &'static str {
        match self {
            Self::Average => "elastic average, viscous paths",
            Self::Median => "elastic median",
            Self::Linear => "linear elasticity",
            Self::SignedDistances => "signed distances in L2",
            Self::Hausdorff => "smoothed Hausdorff",
            Self::Landmarks => "landmarks, Procrustes",
            Self::LandmarksMedian => "landmarks, median",
            Self::ElasticCurves => "elastic curves (SRVF)",
        }
    }

    fn find<const D: usize>(
        self,
        scene: &Scene<'_, D>,
        group: &Group<'_, D>,
    ) -> Result<Found<D>, CliError> {
        let grid = scene.grid();
        let plane = |mean: &Curve, distances: Vec<f64>| Found {
            mean: Some(mean.signed_distance(grid)),
            distances,
            arrived: None,
        };
        Ok(match self {
            Self::Average => {
                let mean = elastic::average(scene, group, "average", |_| ())?;
                let (distances, arrived) = elastic::path_lengths(scene, group)?;
                Found {
                    mean: Some(mean),
                    distances,
                    arrived: Some(arrived),
                }
            }
            Self::Median => Found {
                mean: Some(elastic::average(scene, group, "median", |params| {
                    params.mean = Mean::Median;
                })?),
                distances: Vec::new(),
                arrived: None,
            },
            Self::Linear => {
                let law = elastic::linear(scene.params.law.moduli)?;
                let mean = elastic::average(scene, group, "linear average", |params| {
                    params.law = law;
                })?;
                let (distances, arrived) = elastic::linear_energies(scene, group)?;
                Found {
                    mean: Some(mean),
                    distances,
                    arrived: Some(arrived),
                }
            }
            Self::SignedDistances => Found {
                mean: match signed_distance::mean(group.distances) {
                    Ok(mean) => Some(mean),
                    Err(LevelsetError::EmptyObject { .. }) => None,
                    Err(error) => return Err(AverageError::from(error).into()),
                },
                distances: group.each_pair(group.distances, signed_distance::distance),
                arrived: None,
            },
            Self::Hausdorff => plane(
                &hausdorff::mean(&group.curves),
                group.each_pair(&group.curves, hausdorff::distance),
            ),
            Self::Landmarks | Self::LandmarksMedian => {
                let curves = group.resampled(LANDMARKS);
                let shapes = curves.iter().map(|c| landmarks::preshape(&c.points));
                let shapes: Option<Vec<_>> = shapes.collect();
                // Curves that enclose an area are no points.
                let shapes = shapes.ok_or(AverageError::from(LevelsetError::EmptyContour))?;
                let mean = landmarks::procrustes_mean(&shapes);
                if self == Self::Landmarks {
                    let distances = group.each_pair(&shapes, |a, b| {
                        landmarks::procrustes(a, &landmarks::aligned(a, b))
                    });
                    plane(&of_landmarks(&mean, &curves), distances)
                } else {
                    let median = space::geometric_median(&landmarks::SHAPES, &shapes, &mean);
                    plane(&of_landmarks(&median, &curves), Vec::new())
                }
            }
            Self::ElasticCurves => {
                let curves = group.resampled(srvf::SAMPLES);
                let functions: Vec<_> = curves.iter().map(srvf::of_closed).collect();
                let mean = srvf::mean(&functions);
                let lengths: f64 = curves.iter().map(Curve::length).sum();
                let length = lengths / curves.len() as f64;
                let shape = srvf::curve_of(&mean, length).points;
                let distances = group.each_pair(&functions, |a, b| srvf::distance(a, b));
                plane(&place::placed(&shape, length, &curves), distances)
            }
        })
    }
}

/// The outline of a shape of landmarks, of the mean size of some curves.
fn of_landmarks(shape: &[curve::Point], curves: &[Curve]) -> Curve {
    let own = Curve {
        points: shape.to_vec(),
    };
    let length = landmarks::mean_size(curves) * own.length();
    place::placed(shape, length, curves)
}

impl<'a, const D: usize> Group<'a, D> {
    fn new(
        first: usize,
        names: &'a [String],
        distances: &'a [ScalarField<f64, D>],
    ) -> Result<Self, CliError> {
        let outer = |shape| {
            let boundary = contour(shape, 0.0, BoxEdge::Closed)?;
            Curve::outer(&boundary).ok_or(LevelsetError::EmptyContour)
        };
        let curves: Result<Vec<_>, _> = distances.iter().map(outer).collect();
        Ok(Self {
            first,
            names,
            distances,
            curves: curves?,
        })
    }

    /// The shapes in words.
    fn label(&self) -> String {
        let last = self.names.len() - 1;
        format!("{} to {}", self.names[0], self.names[last])
    }

    fn pairs(&self) -> Vec<[usize; 2]> {
        let n = self.names.len();
        (0..n)
            .flat_map(|i| (i + 1..n).map(move |j| [i, j]))
            .collect()
    }

    fn each_pair<T>(&self, shapes: &[T], distance: impl Fn(&T, &T) -> f64) -> Vec<f64> {
        let pairs = self.pairs().into_iter();
        pairs
            .map(|[i, j]| distance(&shapes[i], &shapes[j]))
            .collect()
    }

    fn resampled(&self, n: usize) -> Vec<Curve> {
        self.curves.iter().map(|curve| curve.resampled(n)).collect()
    }

    /// The means of the sizes of the shapes.
    fn measures(&self) -> Result<Measures, CliError> {
        let mut mean = Measures {
            area: 0.0,
            thickness: 0.0,
            protrusion: 0.0,
            pieces: 1,
        };
        let share = 1.0 / self.names.len() as f64;
        for shape in self.distances {
            let own = measure(shape)?;
            mean.area += share * own.area;
            mean.thickness += share * own.thickness;
            mean.protrusion += share * own.protrusion;
        }
        Ok(mean)
    }
}

/// The row of the table: sizes of the mean relative to the mean of those of the shapes.
fn row<const D: usize>(
    label: &str,
    notion: Notion,
    group: &Group<'_, D>,
    found: &Found<D>,
    inputs: Measures,
    seconds: f64,
) -> Vec<Cell> {
    let none = || Cell::from(None::<String>);
    let measured = found.mean.as_ref().and_then(|mean| measure(mean).ok());
    let mut row = vec![label.into(), notion.name().into()];
    match measured {
        Some(own) => row.extend([
            (own.area / inputs.area).into(),
            (own.thickness / inputs.thickness).into(),
            (own.protrusion / inputs.protrusion).into(),
            own.pieces.into(),
        ]),
        None => row.extend([(); 4].map(|()| none())),
    }
    let distances = &found.distances;
    if distances.is_empty() {
        row.extend([none(), none()]);
    } else {
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        let words = |([i, j], distance): ([usize; 2], &f64)| {
            format!("{}-{} {:.2}", i + 1, j + 1, distance / mean)
        };
        let pairs = group.pairs().into_iter().zip(distances).map(words);
        row.push(mean.into());
        // Up to rounding all are equal.
        let same = mean < SAME;
        row.push(if same {
            none()
        } else {
            pairs.collect::<Vec<_>>().join(", ").into()
        });
    }
    let arrived = found.arrived;
    row.push(Cell::from(
        arrived.map(|n| format!("{n} of {}", distances.len())),
    ));
    row.push(seconds.into());
    row
}

/// The mean, over the pale boundaries of the shapes.
fn tile<const D: usize>(
    tiles: &Tiles<D>,
    group: &Group<'_, D>,
    found: &Found<D>,
) -> shapespace_picture::Canvas {
    let fill = mix(WHITE, INK, 0.22);
    let mut tile = match &found.mean {
        Some(mean) => {
            let spacing = mean.grid().spacing();
            // Half a spacing to both sides of the boundary the colour changes.
            let share = |x| (0.5 + mean.sample(x)[0] / spacing).clamp(0.0, 1.0) as f32;
            tiles.slice.painted(|x| mix(WHITE, fill, share(x)))
        }
        None => tiles.slice.painted(|_| WHITE),
    };
    for (i, shape) in group.distances.iter().enumerate() {
        let pale = mix(colour(i), WHITE, 0.45);
        tiles.slice.level(&mut tile, shape, 0.0, 0.8, pale);
    }
    if let Some(mean) = &found.mean {
        tiles.slice.level(&mut tile, mean, 0.0, 1.6, INK);
    }
    tile
}
