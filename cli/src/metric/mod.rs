//! `shapespace metric`: the length of a variation of a shape in the metric of shape space, and the
//! velocity of least dissipation that carries it out.

mod args;
mod draw;
mod record;

use ::geodesic::boundary_metric::{
    Estimate, Variation, estimate, estimate_of_mask, memory_estimate,
};
use fe_grid::ScalarField;
use levelset::{BoxEdge, Contour, Doubt, Moments, contour};

use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::memory::announce;
use crate::options::Align;
use crate::output::ResultDir;
use crate::output::npy::Precision;
use crate::output::vti::VtiFile;
use crate::session::{Command, PlanOf, Session};
use crate::shapes::{Input, Placed, WorldFrame, doubts_of, prepare, records_of};
use crate::summary::Summary;
use shapespace_input::Image;
use shapespace_input::dimension::per_dimension;

pub use args::MetricConfig;

/// Inputs that are read, placed and validated.
pub(crate) struct MetricPlan<const D: usize> {
    placed: Placed<D>,
    /// Whether the shape is given by a mask of two values, whose boundary has steps.
    steps: bool,
    /// With all defaults resolved.
    config: MetricConfig,
    fingerprint: Fingerprint,
}

/// The metric of a variation.
pub(crate) struct Outcome<const D: usize> {
    config: MetricConfig,
    /// The shape, and the one that the variation leads to if there is one.
    inputs: Vec<Input<D>>,
    distance: ScalarField<f64, D>,
    outline: Contour<D>,
    found: Estimate<D>,
    doubts: Vec<Doubt>,
    /// Whether the user stopped the computation.
    interrupted: bool,
}

impl Command for MetricConfig {
    type Plan<const D: usize> = MetricPlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        let paths: Vec<_> = std::iter::once(&self.shape)
            .chain(&self.variation)
            .cloned()
            .collect();
        let count = paths.len();
        session.progress.stage(match count {
            1 => "reading a mask".into(),
            _ => format!("reading {count} masks"),
        });
        let images = session.sources.read_images(&paths, &self.masks.reading())?;
        Ok(per_dimension!(images, images => plan(images, self.clone())?))
    }

    fn compute<const D: usize>(
        &self,
        plan: MetricPlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let MetricPlan {
            placed,
            steps,
            config,
            fingerprint,
        } = plan;
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let (inputs, distances) = prepare(placed, &[], &session.progress, &session.processes)?;
        let mut distances = distances.into_iter();
        let (Some(distance), Some(input)) = (distances.next(), inputs.first()) else {
            return Err(CliError::Missing {
                command: "metric",
                what: "a mask, SHAPE",
            });
        };
        let variation = match (distances.next(), config.mode) {
            (Some(end), _) => Variation::towards(&distance, &end)?,
            (None, Some(degree)) => Variation::Harmonic {
                degree,
                centre: centroid(input)?,
            },
            (None, None) if config.dilation => Variation::Growth,
            (None, None) => {
                // The number of coordinates was checked in the plan.
                Variation::Translation(std::array::from_fn(|k| config.translation[k]))
            }
        };
        announce(
            memory_estimate(&distance),
            distance.grid(),
            &session.progress,
        )?;
        session.progress.stage("computing the optimal velocity");
        let mut watch = checkpointer.observe(session.equation_observer(distance.grid()));
        let params = &config.params;
        let found = if steps {
            let samples = input.frame.sample_size().into_iter().fold(0.0, f64::max);
            estimate_of_mask(&distance, samples, &variation, params, &mut watch)?
        } else {
            estimate(&distance, &variation, params, &mut watch)?
        };
        watch.finish();
        session.ended(checkpointer);
        let outline = contour(&distance, 0.0, BoxEdge::Closed);
        Ok(Outcome {
            doubts: [doubts_of(&inputs), found.doubts()].concat(),
            outline: outline?,
            config,
            inputs,
            distance,
            found,
            interrupted: session.interrupt.asked(),
        })
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        let flow = &outcome.found.flow;
        directory.array("level_set.npy", &outcome.distance)?;
        directory.array("velocity.npy", &flow.velocity)?;
        directory.array("dissipation.npy", &flow.density)?;
        directory.with_file("metric.vti", |file| {
            VtiFile::new(*outcome.distance.grid(), Precision::Single)
                .within(WorldFrame::of_inputs(&records_of(&outcome.inputs)))
                .field("level_set", &outcome.distance)
                .field("velocity", &flow.velocity)
                .field("dissipation", &flow.density)
                .write(file)
        })?;
        directory.picture(record::PICTURE, || draw::picture(outcome))?;
        let record = record::record(outcome, session.start);
        record.write(directory)?;
        Ok(record::summary(&record))
    }
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    mut config: MetricConfig,
) -> Result<MetricPlan<D>, CliError> {
    let coordinates = config.translation.len();
    if coordinates != 0 && coordinates != D {
        return Err(CliError::Option {
            option: "--translation",
            value: format!("with {coordinates} coordinates"),
            remedy: format!("the shape has {D} dimensions"),
        });
    }
    if images.len() == 1 {
        config.masks.align.get_or_insert(Align::None);
    }
    let steps = images.first().is_some_and(has_steps);
    let hashes = images.iter().map(hash).collect();
    let placed = Placed::new(images, &mut config.masks)?;
    let mut fingerprint = Fingerprint::new(&config, hashes);
    for key in ["shape", "variation"] {
        fingerprint.leave_out(key);
    }
    Ok(MetricPlan {
        placed,
        steps,
        config,
        fingerprint,
    })
}

/// Whether an image has two values only, and no exact boundary: the boundary then has steps of the size of the
/// samples.
fn has_steps<const D: usize>(image: &Image<D>) -> bool {
    if image.outline.is_some() {
        return false;
    }
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let ends = image.values.iter();
    let ends = ends.fold(nothing, |[low, high], v| [low.min(v), high.max(v)]);
    image.values.iter().all(|value| ends.contains(&value))
}

/// The centroid of an input in the unit box.
fn centroid<const D: usize>(input: &Input<D>) -> Result<[f64; D], CliError> {
    let moments = Moments::of_contour(&input.contour).map_err(|source| CliError::Shape {
        path: input.path.clone(),
        source,
    })?;
    Ok(moments.centroid.into())
}
