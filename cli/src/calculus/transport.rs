//! `shapespace transport`: parallel transport of a variation along a geodesic.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path as FilePath;
use std::time::Instant;

use ::geodesic::calculus::{
    CalculusParams, Extension, Ladder, SolveReport, SolveStatus, at_end, logarithm, shoot,
    transport as carry_along,
};
use ::geodesic::{GeodesicError, GeodesicParams};
use fe_grid::{Field, ScalarField};
use levelset::{BoxEdge, Contour, ContourDistance, Moments, contour};

use super::args::{TransportArgs, TransportConfig};
use super::read::{AnyGeodesic, StoredGeodesic, read};
use super::record::{TransportRecord, Transported};
use crate::error::{CliError, Exit};
use crate::geodesic::draw::portraits;
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::write_path;
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::output::ResultDir;
use crate::output::npy::{Precision, write_field};
use crate::picture::{analogy, colour};
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::report::{certified, word};
use crate::shapes::{labels, place_like};
use crate::watch::{Interrupt, ProgressObserver, level_nodes};

/// Runs `shapespace transport`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_transport(args: &TransportArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config: TransportConfig| {
        ResultDir::create(&args.run.output).map(drop)?;
        progress.stage("reading the geodesic");
        let given = read(&config.geodesic)?;
        let options = ReadOptions {
            label: config.label,
        };
        let images = read_images(std::slice::from_ref(&config.variation), &options)?;
        let run = Run {
            config,
            output: &args.run.output,
            progress: &progress,
            interrupt,
            start,
        };
        match (given, images) {
            (AnyGeodesic::D2(given), AnyImages::D2(images)) => run.with(&given, &images[0]),
            (AnyGeodesic::D3(given), AnyImages::D3(images)) => run.with(&given, &images[0]),
            (AnyGeodesic::D2(_), _) => Err(run.unfit("is a volume; the shapes are flat".into())),
            (AnyGeodesic::D3(_), _) => Err(run.unfit("is flat; the shapes are volumes".into())),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

struct Run<'a> {
    config: TransportConfig,
    output: &'a FilePath,
    progress: &'a Progress,
    interrupt: Interrupt,
    start: Instant,
}

/// The variation relative to the first shape.
struct Variation<const D: usize> {
    /// Its boundary.
    outline: Contour<D>,
    /// The displacement in unit time that leads to it.
    velocity: Field<f64, D, D>,
    /// Length of the geodesic to it.
    length: f64,
    /// Its overlap with the end shape of that geodesic.
    dice: f64,
}

/// The last shape and its counterpart of the variation.
struct Counterpart<const D: usize> {
    end: ScalarField<f64, D>,
    /// The variation on the domain of the last shape.
    velocity: Field<f64, D, D>,
    shot: Extension<D>,
    /// For the rungs, then for the steps.
    reports: Vec<SolveReport>,
}

impl Run<'_> {
    fn unfit(&self, reason: String) -> CliError {
        CliError::Variation {
            path: self.config.variation.clone(),
            reason,
        }
    }

    fn with<const D: usize>(
        &self,
        given: &StoredGeodesic<D>,
        image: &Image<D>,
    ) -> Result<Exit, CliError> {
        let params = given.calculus_params(self.config.solver);
        // After Ctrl-C before the first shape there is nothing to write.
        let Some(variation) = self.variation(given, image)? else {
            return Ok(Exit::Interrupted);
        };
        let Some(counterpart) = self.counterpart(given, &variation.velocity, &params)? else {
            return Ok(Exit::Interrupted);
        };
        self.progress.stage("writing");
        self.interrupt.writing();
        let directory = ResultDir::create(self.output)?;
        let record = self.write(&directory, given, &variation, &counterpart, &params)?;
        let target = directory.commit()?;
        self.progress.finish();
        print(&record, &target);
        Ok(if record.cancelled() {
            Exit::Interrupted
        } else {
            Exit::Success
        })
    }

    /// Computes the logarithm of the variation at the first shape; `None` if interrupted on a
    /// coarser grid.
    fn variation<const D: usize>(
        &self,
        given: &StoredGeodesic<D>,
        image: &Image<D>,
    ) -> Result<Option<Variation<D>>, CliError> {
        let frame = &given.frame;
        if image.size != frame.size {
            return Err(self.unfit(format!(
                "has {:?} samples, the first shape of the geodesic {:?} (x first)",
                image.size, frame.size
            )));
        }
        let first = &given.level_sets[0];
        let grid = *first.grid();
        let (outline, near) = place_like(image, frame.frame, frame.motion, grid)?;
        let params = GeodesicParams {
            steps: self.config.steps,
            ..given.params.clone()
        };
        self.progress.stage("finding the variation");
        let grids = level_nodes(&grid.hierarchy(params.coarsest_nodes));
        let mut watch = ProgressObserver::new(self.progress, self.interrupt, grids);
        let found = logarithm(first, &near, &params, &mut watch)?;
        watch.finish();
        let (Some(last), Some(level)) = (found.path.displacements.last(), found.path.levels.last())
        else {
            return Ok(None);
        };
        if *last.grid() != grid {
            return Ok(None);
        }
        Ok(Some(Variation {
            dice: overlap(first, last, &near)?,
            length: level.energy.length(),
            velocity: found.velocity,
            outline,
        }))
    }

    /// Transports a velocity along the path and applies the exponential map at its end; `None` if
    /// interrupted before.
    fn counterpart<const D: usize>(
        &self,
        given: &StoredGeodesic<D>,
        velocity: &Field<f64, D, D>,
        params: &CalculusParams,
    ) -> Result<Option<Counterpart<D>>, CliError> {
        let (first, path) = (&given.level_sets[0], &given.motions);
        let watch = || ProgressObserver::of_equations(self.progress, self.interrupt, given.nodes());
        let mut watching = watch();
        let ladder = Ladder::default();
        let carried = carry_along(first, path, velocity, ladder, params, &mut watching)?;
        watching.finish();
        let (Some(velocity), Some(last)) = (&carried.variation, path.last()) else {
            if carried.status() == SolveStatus::Cancelled {
                return Ok(None);
            }
            return Err(CliError::Computation {
                message: "the variation cannot be carried along the geodesic: a rung of the \
                          ladder was not found"
                    .into(),
                remedy: "compute the geodesic with more steps (-K), or give a variation that is \
                         nearer to its first shape"
                    .into(),
            });
        };
        let (end, velocity) = at_end(first, last, velocity, params)?;
        let mut watching = watch();
        let steps = self.config.steps;
        let shot = shoot(&end, &velocity, steps, params, &mut watching)?;
        watching.finish();
        let mut reports = carried.reports;
        reports.extend_from_slice(&shot.reports);
        Ok(Some(Counterpart {
            end,
            velocity,
            shot,
            reports,
        }))
    }

    fn write<'c, const D: usize>(
        &self,
        directory: &ResultDir,
        given: &StoredGeodesic<D>,
        variation: &Variation<D>,
        counterpart: &'c Counterpart<D>,
        params: &CalculusParams,
    ) -> Result<TransportRecord<'c, D>, CliError> {
        let (config, shot) = (&self.config, &counterpart.shot);
        let steps = config.steps;
        let name = labels(&[&config.variation]).swap_remove(0);
        let [first_name, last_name] = &given.names;
        let (shapes, displacements) = shot.shapes()?;
        let steps_found = displacements.len();
        let mut level_sets = vec![counterpart.end.clone()];
        level_sets.extend(shapes);
        let names = (0..=steps_found).map(|k| match k {
            0 => last_name.clone(),
            _ if k == steps => format!("{last_name} + ({name} - {first_name})"),
            _ => format!("{k} of {steps}"),
        });
        let parts = Parts {
            level_sets,
            displacements,
            energies: shot.step_energies.clone(),
            steps,
            names: names.collect(),
            target: None,
        };
        let path = Path::of(parts, &params.law)?;
        write_path(directory, &[], &path)?;
        let velocities = [
            ("start", &variation.velocity),
            ("end", &counterpart.velocity),
        ];
        for (place, velocity) in velocities {
            let file = directory.file(format!("variation_{place}.npy"));
            write_field(&file, velocity, Precision::Double)?;
        }
        let level_set = &given.level_sets[0];
        let first = contour(level_set, 0.0, BoxEdge::Closed).map_err(GeodesicError::from)?;
        let ends = [
            &first,
            &path.contours[0],
            &variation.outline,
            &path.contours[steps_found],
        ];
        let words = [first_name, last_name, &name, &path.names[steps_found]].map(Clone::clone);
        let hues = [0, 0, 1, 1].map(colour);
        let tiles: Vec<_> = ends.into_iter().zip(hues).collect();
        let picture = analogy(&words, &portraits(&tiles));
        picture.write_png(&directory.file("analogy.png"))?;
        let transported = Transported {
            given_steps: given.motions.len(),
            steps_found,
            dice_variation: variation.dice,
            length_variation: variation.length,
            length: path.energies.iter().map(|w| w.max(0.0).sqrt()).sum(),
            volumes: [
                size(ends[0])?,
                size(ends[2])?,
                size(ends[1])?,
                size(ends[3])?,
            ],
            step_energies: path.energies,
            certificate: shot.certificate,
            equations: &counterpart.reports,
        };
        let nodes = level_set.grid().nodes_per_axis();
        let status = word(&shot.status());
        let record = TransportRecord::new(status, &nodes, config, transported, self.start);
        record.write(directory.path())?;
        Ok(record)
    }
}

/// Prints the summary on standard output; the last line names the picture.
fn print<const D: usize>(record: &TransportRecord<'_, D>, target: &FilePath) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &TransportRecord<'_, D>,
    target: &FilePath,
) -> std::fmt::Result {
    let found = &record.body;
    writeln!(
        text,
        "Variation carried over {} steps, {} of {} steps to its counterpart: {} in {:.1} s",
        found.given_steps,
        found.steps_found,
        record.parameters.steps,
        record.status,
        record.seconds
    )?;
    writeln!(
        text,
        "  variation    Dice {:.4} of the mask and the first shape deformed onto it",
        found.dice_variation
    )?;
    writeln!(
        text,
        "  lengths      {:.4e} at the start, {:.4e} at the end",
        found.length_variation, found.length
    )?;
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        certified(&found.certificate),
        found.certificate.min_det
    )?;
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("analogy.png"))
}

fn size<const D: usize>(shape: &Contour<D>) -> Result<f64, CliError> {
    let moments = Moments::of_contour(shape).map_err(GeodesicError::from)?;
    Ok(moments.volume)
}

/// Overlap of a shape with the deformation of another.
fn overlap<const D: usize>(
    first: &ScalarField<f64, D>,
    displacement: &Field<f64, D, D>,
    shape: &ScalarField<f64, D>,
) -> Result<f64, CliError> {
    let measured = || {
        let moved = contour(first, 0.0, BoxEdge::Open)?.map(|p| {
            let u = displacement.sample(p);
            std::array::from_fn(|k| p[k] + u[k])
        });
        let moved = ContourDistance::new(&moved)?.sample(*shape.grid());
        levelset::dice(&moved, 0.0, shape, 0.0)
    };
    Ok(measured().map_err(GeodesicError::from)?)
}
