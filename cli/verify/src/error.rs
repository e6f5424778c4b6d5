//! Errors of experiments.

/// The reason for which an experiment failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// A law.
    #[error(transparent)]
    Law(#[from] hyperelastic::LawError),
    /// A grid or a linear system.
    #[error(transparent)]
    Grid(#[from] fe_grid::GridError),
    /// A signed distance.
    #[error(transparent)]
    Levelset(#[from] levelset::LevelsetError),
    /// A phase field.
    #[error(transparent)]
    PhaseField(#[from] phasefield::PhaseFieldError),
    /// An average.
    #[error(transparent)]
    Average(#[from] shape_average::AverageError),
    /// An analysis of an average.
    #[error(transparent)]
    Pca(#[from] shape_pca::PcaError),
    /// A geodesic.
    #[error(transparent)]
    Geodesic(#[from] geodesic::GeodesicError),
}

/// An experiment that failed.
#[derive(Debug, thiserror::Error)]
#[error("the experiment '{name}' cannot be made: {source}")]
pub struct ExperimentError {
    /// The name of its statement.
    pub name: &'static str,
    /// Why.
    pub source: VerifyError,
}

/// There is no statement of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no statement '{name}'; near it are {}", near.join(", "))]
pub struct UnknownStatement {
    /// The name.
    pub name: String,
    /// Existing names, the nearest first.
    pub near: Vec<&'static str>,
}
