//! The length and dissipation of a given path: a sequence of shapes.

use crate::between::{geodesic_between, geodesic_from};
use crate::error::GeodesicError;
use crate::level_sets::compose;
use crate::params::GeodesicParams;
use crate::result::Geodesic;
use crate::shape::Shape;
use fe_grid::minimise::{Observer, Status};
use fe_grid::{Certificate, Field, compiled_once};
use levelset::Doubt;

/// A path through given shapes, with a geodesic between every two consecutive ones.
///
/// The time between two shapes is the same for all of them, and the whole path takes unit time. With
/// `N` steps in all, `length = sum sqrt W_k` and `dissipation = N sum W_k`, which is at least the
/// square of the length, and equal to it if all steps have the same length. Neither depends on
/// rotations and translations of the shapes. The length of the geodesic between the first and the
/// last shape is a lower bound of the length, up to the discretisation.
///
/// Source: the lecture notes of Rumpf and Wirth, length and dissipation of a discrete path.
#[derive(Clone, Debug)]
pub struct GivenPath<const D: usize> {
    /// The geodesics between consecutive shapes.
    pub pieces: Vec<Geodesic<D>>,
}

compiled_once! {
    fn join<'a, D>(
        shapes: &'a [Shape<D>],
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<GivenPath<D>, GeodesicError> = GivenPath::joining;
}

impl<const D: usize> GivenPath<D> {
    /// Joins consecutive shapes by geodesics of `params.steps` steps.
    ///
    /// The observer is notified of every level and iteration; if it cancels, the pieces after the
    /// current one are missing.
    ///
    /// # Errors
    /// [`GeodesicError`] for parameters out of range and unsuitable shapes.
    pub fn new(
        shapes: &[Shape<D>],
        params: &GeodesicParams,
        observer: &mut dyn Observer,
    ) -> Result<Self, GeodesicError> {
        join(shapes, params, observer)
    }

    fn joining(
        shapes: &[Shape<D>],
        params: &GeodesicParams,
        observer: &mut dyn Observer,
    ) -> Result<Self, GeodesicError> {
        let mut pieces = Vec::with_capacity(shapes.len().saturating_sub(1));
        for pair in shapes.windows(2) {
            let piece = geodesic_between(&pair[0], &pair[1], params, observer)?;
            let last = piece.levels.last();
            let cancelled = last.is_some_and(|level| level.info.status == Status::Cancelled);
            pieces.push(piece);
            if cancelled {
                break;
            }
        }
        Ok(Self { pieces })
    }

    /// Computes the geodesic between the ends of the path in whose valley the path lies, of as many steps, on the domain
    /// of the start: its deformations `psi_1, ..., psi_N`, those of all pieces one after the other, are what the
    /// minimisation begins with. `None` for pieces without deformations, as of level sets.
    ///
    /// # Errors
    /// Those of [`geodesic_from`].
    pub fn shortened(
        &self,
        start: &Shape<D>,
        end: &Shape<D>,
        params: &GeodesicParams,
        observer: &mut dyn Observer,
    ) -> Result<Option<Geodesic<D>>, GeodesicError> {
        let grid = start.grid();
        let mut all: Vec<Field<f64, D, D>> = Vec::new();
        let mut before = Field::zeros(*grid);
        for piece in &self.pieces {
            let Some(last) = piece.motions.last() else {
                return Ok(None);
            };
            if last.grid() != grid {
                return Ok(None);
            }
            let after =
                |motion: &Field<f64, D, D>| compose(grid, &[before.clone(), motion.clone()]);
            let motions: Vec<_> = piece.motions.iter().map(after).collect();
            before = motions[motions.len() - 1].clone();
            all.extend(motions);
        }
        let params = GeodesicParams {
            steps: all.len(),
            ..params.clone()
        };
        geodesic_from(start, end, &all, &params, observer).map(Some)
    }

    /// Returns the energies `W_1, ..., W_N` of all steps.
    pub fn step_energies(&self) -> Vec<f64> {
        let energies = self.pieces.iter().map(|piece| &piece.energy.step_energies);
        energies.flatten().copied().collect()
    }

    /// Returns the length `sum sqrt W_k`.
    pub fn length(&self) -> f64 {
        self.pieces.iter().map(Geodesic::length).sum()
    }

    /// Returns the dissipation `N sum W_k`.
    pub fn dissipation(&self) -> f64 {
        let energies = self.step_energies();
        energies.len() as f64 * energies.iter().sum::<f64>()
    }

    /// Returns the worst certificate of the pieces.
    pub fn certificate(&self) -> Certificate {
        Certificate::worst(self.pieces.iter().map(|piece| piece.certificate))
    }

    /// Returns the doubts about all pieces, each about the shape at its end; `shapes` and `params`
    /// are those of the path.
    pub fn doubts(&self, params: &GeodesicParams) -> Vec<Doubt> {
        let pieces = self.pieces.iter().enumerate();
        pieces
            .flat_map(|(k, piece)| {
                let of_piece = piece.doubts(params);
                of_piece.into_iter().map(move |doubt| doubt.about(k + 1))
            })
            .collect()
    }
}
