//! Solution of the joint problem from coarse levels to fine, round by round.

use super::params::{Edges, JointParams};
use super::result::{
    JointLevel, JointResult, edge_overlap, remaining, solid_share, unmatched_share,
};
use super::round::{Rounds, State};
use crate::collect::of_first;
use crate::error::AverageError;
use crate::quiet::Quiet;
use crate::result::{worst_certificate, worst_of_all};
use crate::solve::first_level;
use fe_grid::communicator::{Alone, Communicator};
use fe_grid::minimise::{Control, Evaluations, Iteration, Observer, Silent, Status, together};
use fe_grid::{Distribution, Field, InverseDeformation, ScalarField, compiled_once};
use levelset::signed_distance;
use phasefield::Profile;
use phasefield::segmentation::{SegmentationParams, coarser_image, segment};
use std::sync::Arc;
use std::time::Instant;

/// Drawn edges ([`Edges::Given`](super::Edges::Given)) are where the image is above this.
pub const DRAWN_EDGE: f64 = 0.5;

/// Segments images on one grid and averages their edges simultaneously.
///
/// The observer is notified of every level and every round, and may cancel; the result is then the
/// state reached so far, on the grid reached so far.
///
/// # Errors
/// [`AverageError`] for parameters out of range, images that lie on different grids or are not
/// finite, and solvers that break down. Failure to converge is not an error; it is reported in the
/// status of the levels.
pub fn joint_average<const D: usize>(
    images: &[ScalarField<f64, D>],
    params: &JointParams,
    observer: &mut dyn Observer,
) -> Result<JointResult<D>, AverageError> {
    joint_average_from(images, &[], params, observer)
}

/// Solves the joint problem from known deformations: `start` is empty, or has one displacement
/// per image on one of the grids of the hierarchy of the images' grid; coarser grids are
/// skipped.
///
/// # Errors
/// As [`joint_average`], and [`AverageError::Start`] for displacements that do not fit.
pub fn joint_average_from<const D: usize>(
    images: &[ScalarField<f64, D>],
    start: &[Field<f64, D, D>],
    params: &JointParams,
    observer: &mut dyn Observer,
) -> Result<JointResult<D>, AverageError> {
    let alone: Arc<dyn Communicator> = Arc::new(Alone);
    of_first(joint_average_distributed(
        alone, images, start, params, observer,
    )?)
}

compiled_once! {
    /// Solves the joint problem, as [`joint_average_from`] does, on several processes: each has some of the
    /// images, and the first has the result; the others have `None`.
    ///
    /// All processes call this with the same arguments, but for the observer, of which that of the first is
    /// asked. The result has the same bits on any number of processes.
    ///
    /// # Errors
    /// As [`joint_average_from`].
    pub fn joint_average_distributed<'a, D>(
        communicator: Arc<dyn Communicator>,
        images: &'a [ScalarField<f64, D>],
        start: &'a [Field<f64, D, D>],
        params: &'a JointParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<JointResult<D>>, AverageError> = joint_average_distributed_in;
}

fn joint_average_distributed_in<const D: usize>(
    communicator: Arc<dyn Communicator>,
    images: &[ScalarField<f64, D>],
    known: &[Field<f64, D, D>],
    params: &JointParams,
    observer: &mut dyn Observer,
) -> Result<Option<JointResult<D>>, AverageError> {
    let start = Instant::now();
    let first = images.first().ok_or(AverageError::NoShapes)?;
    params.check(images.len())?;
    params.average.law.compile::<D>()?;
    for (index, image) in images.iter().enumerate() {
        if image.grid() != first.grid() {
            return Err(AverageError::GridsDiffer { index });
        }
        if let Some(node) = image.as_slice().iter().position(|u| !u.is_finite()) {
            return Err(AverageError::NotFinite { index, node });
        }
    }
    let mut grids = first.grid().hierarchy(params.segmentation.coarsest_nodes);
    grids.drain(..first_level(&grids, images.len(), known)?);
    let distribution = Distribution::over(communicator, images.len());
    let own = distribution.own();
    let known = known.get(own.clone()).unwrap_or_default();
    let mut coarser: Vec<Vec<ScalarField<f64, D>>> = vec![images[own.clone()].to_vec()];
    for grid in grids.iter().rev().skip(1) {
        let finer = &coarser[coarser.len() - 1];
        let images = finer.iter().map(|image| coarser_image(grid, image));
        coarser.push(images.collect());
    }
    let drawn = match params.edges {
        Edges::Given => distances_of_edges(&images[own.clone()], own.start)?,
        Edges::Together | Edges::Separate => Vec::new(),
    };
    let mut state: Option<State<D>> = None;
    let mut levels = Vec::with_capacity(grids.len());
    for (level, (grid, images)) in grids.iter().zip(coarser.into_iter().rev()).enumerate() {
        let dim = images.len() * (D + 2) * grid.n_nodes();
        let memory = together(&distribution, observer, |observer| {
            observer.level(level, grids.len(), dim);
            observer.resume()
        });
        let mut now = State::new(*grid, images, &distribution);
        let rounds = memory.and_then(|memory| now.restore(&memory));
        let rounds = if let Some(rounds) = rounds {
            rounds
        } else {
            now.pairs = if params.edges == Edges::Given {
                given(&now, &drawn, params)?
            } else if distribution.is_first() {
                segmented(&now.images, params, observer)?
            } else {
                // Images take different numbers of steps: only the first process is asked about its own.
                segmented(&now.images, params, &mut Silent)?
            };
            match state.take() {
                Some(coarse) => now.take_deformations(&coarse),
                None => now.start_from(known),
            }
            Rounds::default()
        };
        let report = together(&distribution, observer, |observer| {
            improve(&mut now, rounds, level + 1 == grids.len(), params, observer)
        })?;
        let cancelled = report.status == Status::Cancelled;
        levels.push(report);
        state = Some(now);
        if cancelled {
            break;
        }
    }
    // There is at least one level, so the state exists.
    let state = state.ok_or(AverageError::NoShapes)?;
    finish(state, levels, start)
}

/// Computes `u_i` and `v_i` by segmenting each image separately. Every level starts from these: the
/// edges of a coarser level have its interface width and would keep that width where the phase
/// fields of all images agree.
fn segmented<const D: usize>(
    images: &[ScalarField<f64, D>],
    params: &JointParams,
    observer: &mut dyn Observer,
) -> Result<Vec<Vec<f64>>, AverageError> {
    let alone = SegmentationParams {
        interface_cells: params.average.interface_cells,
        ..params.segmentation
    };
    let pairs = images.iter().map(|image| {
        let found = segment(image, &alone, &mut Quiet(observer))?;
        // A cancelled segmentation ends on a coarser grid of the same box.
        let pair = [found.image, found.phase_field].map(|field| field.on_grid(image.grid()));
        Ok(pair.map(Field::into_vec).concat())
    });
    pairs.collect()
}

/// The distances from drawn edges: zero on them. The first image has this number.
fn distances_of_edges<const D: usize>(
    images: &[ScalarField<f64, D>],
    first: usize,
) -> Result<Vec<ScalarField<f64, D>>, AverageError> {
    let images = (first..).zip(images);
    let distances = images.map(|(index, image)| {
        let mut distance =
            signed_distance(image, DRAWN_EDGE).map_err(|_| AverageError::NoEdges { index })?;
        for d in distance.as_mut_slice() {
            *d = (-*d).max(0.0);
        }
        Ok(distance)
    });
    distances.collect()
}

/// The images themselves as `u_i`, and `v_i` by the distances from the edges.
fn given<const D: usize>(
    state: &State<D>,
    drawn: &[ScalarField<f64, D>],
    params: &JointParams,
) -> Result<Vec<Vec<f64>>, AverageError> {
    let profile = Profile::new(state.interface_width(params))?;
    let pairs = state.images.iter().zip(drawn).map(|(image, distance)| {
        let on_level = ScalarField::from_fn(state.grid, |x| distance.sample(x));
        let phase_field = profile.phase_field(&on_level);
        [image.as_slice(), phase_field.as_slice()].concat()
    });
    Ok(pairs.collect())
}

/// On the finest level the estimate of the remaining energy, relative to the elastic energy, is at most so many times
/// the tolerance at the end.
const REMAINING: f64 = 100.0;

/// After so many rounds whose decreases are below the tolerance a level ends in any case: images that show
/// different things converge slowly, and what remains is a doubt.
const PATIENCE: usize = 8;

/// Performs the rounds on one level, after those that have been performed. Collective.
fn improve<const D: usize>(
    state: &mut State<D>,
    performed: Rounds,
    is_finest: bool,
    params: &JointParams,
    observer: &mut dyn Observer,
) -> Result<JointLevel, AverageError> {
    let start = Instant::now();
    let Rounds {
        mut energies,
        count: mut rounds,
        ended,
    } = performed;
    let mut evaluations = Evaluations::default();
    let (status, terms) = loop {
        if let Some(status) = ended {
            let mut terms = state.evaluate(params)?;
            terms.remaining = remaining(&energies);
            break (status, terms);
        }
        let deformed = state.deform(params, observer)?;
        let mut terms = state.evaluate(params)?;
        let energy = terms.objective();
        energies.push(energy);
        terms.remaining = remaining(&energies);
        evaluations.gradients = 1 + state.work.steps;
        let iteration = Iteration {
            iteration: rounds,
            energy,
            gradient_norm: 0.0,
            step_length: 1.0,
            evaluations,
            x: &state.displacements,
        };
        let asked = observer.iteration(&iteration) == Control::Cancel;
        if deformed == Status::InadmissibleStart {
            break (Status::InadmissibleStart, terms);
        }
        if asked || deformed == Status::Cancelled {
            break (Status::Cancelled, terms);
        }
        let small = |round: &&[f64]| round[0] - round[2] <= params.tolerance * round[2];
        let latest = energies.windows(3).step_by(2).rev();
        let quiet = latest.take_while(small).count();
        let is_near = terms
            .remaining_share()
            .is_some_and(|share| share <= REMAINING * params.tolerance);
        if quiet > 0 && (!is_finest || is_near || quiet >= PATIENCE) {
            break (Status::EnergyTolerance, terms);
        }
        if rounds == params.max_rounds {
            break (Status::MaxIterations, terms);
        }
        if params.edges == Edges::Together {
            state.segment(params)?;
        }
        energies.push(state.evaluate(params)?.objective());
        rounds += 1;
        state.remember(&energies, rounds, None, observer);
    };
    if ended.is_none() && !matches!(status, Status::Cancelled | Status::InadmissibleStart) {
        state.remember(&energies, rounds, Some(status), observer);
    }
    Ok(JointLevel {
        nodes: state.grid.nodes_per_axis().to_vec(),
        interface_width: state.interface_width(params),
        status,
        rounds,
        steps: state.work.steps,
        system_iterations: state.work.system_iterations,
        energies,
        energy: terms,
        certificate: worst_of_all(&state.grid, &state.displacements, &state.distribution),
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The result of all images, on the first process. Collective.
fn finish<const D: usize>(
    state: State<D>,
    levels: Vec<JointLevel>,
    start: Instant,
) -> Result<Option<JointResult<D>>, AverageError> {
    let State {
        grid,
        distribution,
        pairs,
        displacements,
        average,
        ..
    } = state;
    let n = grid.n_nodes();
    let field = |values: &[f64]| Field::from_vec(grid, values.to_vec());
    let own = pairs.concat();
    drop(pairs);
    let all = [own, displacements].map(|own| {
        if distribution.is_alone() {
            Some(own)
        } else {
            distribution.gather(&own)
        }
    });
    let [Some(pairs), Some(x)] = all else {
        return Ok(None);
    };
    let pairs = || pairs.chunks_exact(2 * n);
    let images: Result<Vec<ScalarField<f64, D>>, _> =
        pairs().map(|pair| field(&pair[..n])).collect();
    let phase_fields: Result<Vec<ScalarField<f64, D>>, _> =
        pairs().map(|pair| field(&pair[n..])).collect();
    let displacements: Result<Vec<Field<f64, D, D>>, _> = x
        .chunks_exact(D * n)
        .map(|u| Field::from_vec(grid, u.to_vec()))
        .collect();
    let (images, displacements) = (images?, displacements?);
    let (average, phase_fields) = (field(&average)?, phase_fields?);
    let mut sum = ScalarField::<f64, D>::zeros(grid);
    let mut reached = vec![0.0; n];
    let mut pushed = Vec::with_capacity(images.len());
    let mut unmatched_shares = Vec::with_capacity(images.len());
    for (i, (image, displacement)) in images.iter().zip(&displacements).enumerate() {
        let inverse = InverseDeformation::new(displacement);
        let edges = inverse.push_forward(&phase_fields[i], 1.0);
        let is_reached = |node| inverse.position(node).is_some();
        unmatched_shares.push(unmatched_share(&average, edges, is_reached));
        let seen = inverse.push_forward(image, 0.0);
        for node in 0..n {
            if is_reached(node) {
                sum.as_mut_slice()[node] += seen.as_slice()[node];
                reached[node] += 1.0;
            }
        }
        pushed.push(seen);
    }
    for (sum, reached) in sum.as_mut_slice().iter_mut().zip(&reached) {
        *sum /= f64::max(*reached, 1.0);
    }
    let carried = displacements.iter().map(|u| average.compose(u.as_slice()));
    let pairs = carried.zip(&phase_fields);
    let edge_overlaps = pairs
        .map(|(carried, own)| edge_overlap(&carried, own))
        .collect();
    let width = levels
        .last()
        .map_or(grid.spacing(), |level| level.interface_width);
    let solid = |phase_field: &ScalarField<f64, D>| solid_share(phase_field, width);
    let bad = levels.iter().map(|l| l.status).find(|s| !s.converged());
    Ok(Some(JointResult {
        average,
        average_image: sum,
        images,
        solid_shares: phase_fields.iter().map(solid).collect(),
        phase_fields,
        edge_overlaps,
        unmatched_shares,
        pushed,
        certificate: worst_certificate(&grid, &x),
        displacements,
        status: bad.unwrap_or(Status::EnergyTolerance),
        levels,
        seconds: start.elapsed().as_secs_f64(),
    }))
}
