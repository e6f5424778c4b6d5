//! The displacements that represent all shapes of an average: processes that work together solve for some each.

use crate::average::Average;
use crate::error::PcaError;
use crate::krylov::SolveReport;
use crate::operator::{Compound, representation};
use fe_grid::VectorField;
use fe_grid::minimise::{Memory, Observer, together};

/// Numbers of a shape in a memory: whether its displacement is known, and those of its report.
const N_NUMBERS: usize = 5;

/// What is known of the displacements.
pub(crate) struct Displacements<const D: usize> {
    /// Before centring.
    pub fields: Vec<VectorField<f64, D>>,
    /// Reports on the linear solves.
    pub solves: Vec<SolveReport>,
    /// The smallest curvature that was encountered, for a rough load, too.
    pub least_curvature: f64,
}

impl<const D: usize> Displacements<D> {
    /// Solves for all displacements that the observer does not have from an earlier run. It is given those that
    /// are known after every solve, or after one on each of several processes. Collective.
    ///
    /// # Errors
    /// Those of [`representation`].
    pub fn of(
        average: &Average<D>,
        compound: &Compound<D>,
        observer: &mut dyn Observer,
    ) -> Result<Self, PcaError> {
        let distribution = average.distribution();
        let communicator = distribution.communicator();
        let (own, numbers) = together(distribution, observer, |observer| {
            solve(average, compound, observer)
        })?;
        // The last process has no more shapes than any other.
        let mut rough = [0.0];
        if communicator.rank() + 1 == communicator.size() {
            rough = [compound.look_for_curvature().least_curvature];
        }
        // All others have zero.
        communicator.sum(&mut rough);
        let solves: Vec<SolveReport> = numbers
            .iter()
            .map(|[_, report @ ..]| SolveReport::of_numbers(*report))
            .collect();
        let curvatures = solves.iter().map(|solve| solve.least_curvature);
        Ok(Self {
            fields: average.share_displacements(own)?,
            least_curvature: curvatures.fold(rough[0], f64::min),
            solves,
        })
    }
}

/// The displacements of the shapes of this process, and the numbers of all.
fn solve<const D: usize>(
    average: &Average<D>,
    compound: &Compound<D>,
    observer: &mut dyn Observer,
) -> Result<(Vec<Vec<f64>>, Vec<[f64; N_NUMBERS]>), PcaError> {
    let distribution = average.distribution();
    let (own, dim) = (distribution.own(), D * average.grid().n_nodes());
    let mut displacements = vec![Vec::new(); own.len()];
    let mut all = vec![[0.0; N_NUMBERS]; distribution.n_parts()];
    if let Some(memory) = observer.resume() {
        let (numbers, rest) = memory.objective.as_chunks();
        let fits = memory.x.len() == own.len() * dim && numbers.len() == all.len();
        // All processes go on together.
        if distribution.all(fits && rest.is_empty()) {
            let known = memory.x.chunks_exact(dim).map(<[f64]>::to_vec);
            displacements = known.collect();
            all.copy_from_slice(numbers);
        }
    }
    let is_known = |[known, ..]: &[f64; N_NUMBERS]| *known > 0.0;
    while !all.iter().all(is_known) {
        let numbers = &mut all[own.clone()];
        if let Some(i) = numbers.iter().position(|numbers| !is_known(numbers)) {
            let (u, report) = representation(compound, average.source(own.start + i))?;
            displacements[i] = u.into_vec();
            let [iterations, residual, least, largest] = report.to_numbers();
            numbers[i] = [1.0, iterations, residual, least, largest];
        }
        all = distribution.share(&all[own.clone()]);
        let is_last = all.iter().all(is_known);
        if observer.remembers(is_last) {
            let mut x = displacements.concat();
            // Those that are not known yet are the last.
            x.resize(own.len() * dim, 0.0);
            let result = Memory::of_result(&x, all.as_flattened().to_vec());
            observer.memory(&Memory {
                ended: result.ended.filter(|_| is_last),
                ..result
            });
        }
    }
    Ok((displacements, all))
}
