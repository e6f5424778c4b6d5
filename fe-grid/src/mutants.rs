//! Built-in errors, one of which can be switched on at run time, to see whether a check finds it.
//!
//! Only with the feature `mutants`, which tests of checks enable and the program never does. Without
//! it `mutant!` is its first argument and this module does not exist. With it, and while no error
//! is switched on, all results are bit by bit the same: a formula takes the same value by a branch.
//!
//! All errors of the workspace are listed here, because the formulas of every crate refer to this
//! one switch; the text of each says what is wrong, and which statement of the verification claims to
//! find it.

use std::sync::atomic::{AtomicUsize, Ordering};

/// The number of the error that is switched on, counted from one; zero for none.
static ACTIVE: AtomicUsize = AtomicUsize::new(0);

/// Declares the errors: name, crate, what is wrong, and the statement that claims to find it.
macro_rules! mutants {
    ($($name:ident: $krate:literal, $error:literal, $statement:literal;)*) => {
        /// A built-in error.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Mutant {
            $(#[doc = $error] $name,)*
        }

        impl Mutant {
            /// All errors, crate by crate.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Returns its name.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name),)* }
            }

            /// Returns the crate that contains it.
            pub fn in_crate(self) -> &'static str {
                match self { $(Self::$name => $krate,)* }
            }

            /// Returns what is wrong.
            pub fn error(self) -> &'static str {
                match self { $(Self::$name => $error,)* }
            }

            /// Returns the statement that claims to find it.
            pub fn claimed_by(self) -> &'static str {
                match self { $(Self::$name => $statement,)* }
            }
        }
    };
}

mutants! {
    CompositionCorners: "fe-grid", "v∘φ takes the corners of a cell in the wrong order", "discretisation-composition";
    CompositionSlope: "fe-grid", "the derivative of v∘φ is halved", "discretisation-composition-gradient";
    ScatterWeight: "fe-grid", "normal equations ignore the weight of a source", "phase-best-field";
    InverseMirrored: "fe-grid", "φ⁻¹ is mirrored in its cell", "discretisation-inverse";
    CertificateScale: "fe-grid", "the bound of det Dφ is 5 % too large", "discretisation-certificate";
    UniformMass: "fe-grid", "the mass beside the diagonal is h/5 in place of h/6", "discretisation-linear-problem";
    SpectralStiffness: "fe-grid", "the symbol of the stiffness is halved", "discretisation-linear-problem";
    PullbackWeight: "fe-grid", "energies of a further deformation lose their weight", "linear-dilation";

    LogdetLambda: "hyperelastic", "λ of logdet is 1.1 times too large", "laws-consistency";
    LogdetSlope: "hyperelastic", "the volume term of logdet has the slope −0.9μ at rest", "laws-rest";
    LogdetStress: "hyperelastic", "the stress of logdet lacks the term of D²", "laws-derivatives";
    PowerExpansion: "hyperelastic", "the coefficient of D^r is halved", "laws-consistency";
    CofactorTangent: "hyperelastic", "the tangent of |cof A|^q is halved", "laws-derivatives";
    VolumeSecondOrder: "hyperelastic", "det A lacks its terms of second order in space", "laws-isotropy";
    Barrier: "hyperelastic", "W is finite where det A < 0", "laws-rest";
    InverseVolume: "hyperelastic", "the inverse model lacks det A", "laws-inverse";
    InverseStress: "hyperelastic", "the stress of the inverse model lacks the term W cof A", "laws-derivatives";
    InverseTangent: "hyperelastic", "the tangent of the inverse model has the wrong sign of (A⁻¹)′", "laws-derivatives";
    CauchyVolume: "hyperelastic", "Cauchy's stress lacks 1/det A", "laws-cauchy";
    ViscousTrace: "hyperelastic", "the dissipation has λ in place of λ/2", "laws-viscous-stress";
    ViscousShear: "hyperelastic", "the viscous stress has μ in place of 2μ", "laws-viscous-stress";
    VoidWeight: "hyperelastic", "the void has no stiffness", "phase-elastic-domain";

    CompactWidth: "levelset", "the compact step is half as wide", "phase-elastic-domain";
    ArctanSlope: "levelset", "the derivative of the arctangent step is doubled", "level-steps";
    ContourMiddle: "levelset", "contours cross edges of the grid in their middle", "level-distance";
    DistanceScale: "levelset", "signed distances are 2 % too large", "level-distance";
    MomentsFactor: "levelset", "second moments have the factor of first ones", "level-moments";
    CentroidFactor: "levelset", "first moments have the factor of volumes", "level-moments";
    DiceFactor: "levelset", "the overlap counts nodes of the union once", "level-overlap";
    HausdorffDirected: "levelset", "the Hausdorff distance is that of one direction", "level-hausdorff";
    ComponentsByCorners: "levelset", "parts that touch at a corner are one", "level-components";

    ProfileWidth: "phasefield", "the profile decays with ε in place of 2ε", "phase-length-limit";
    LengthHalved: "phasefield", "L^ε has the factor ½", "phase-length-limit";
    MismatchDoubled: "phasefield", "F^ε is doubled", "phase-mismatch-limit";
    MismatchSurplus: "phasefield", "F^ε counts missing edges only", "phase-mismatch-flat";
    MismatchLoad: "phasefield", "the load of the average's equation is halved", "phase-best-field";
    MismatchSlope: "phasefield", "the derivative of F^ε lacks a factor 2", "phase-mismatch-gradient";
    LeastMismatch: "phasefield", "the least mismatch is that of F^ε against itself", "phase-mismatch-flat";
    ElasticWidth: "phasefield", "the elastic weight is three times as wide", "phase-elastic-domain";
    EdgesHalved: "phasefield", "edges of E_AT cost half", "phase-edge-cost";
    ConductanceMissing: "phasefield", "k_ε is left out", "existence-joint";

    MismatchNotShared: "shape-average", "γ in place of γ/n", "average-repeated";
    WeightsIgnored: "shape-average", "the weights of shapes are ignored", "average-weights";
    MedianSlope: "shape-average", "the shares of a median are 1/e in place of 1/√e", "median-shares";
    MedianMismatch: "shape-average", "the shares of a median leave out the mismatch", "median-shares";
    LengthPotential: "shape-average", "the potential of L^ε is halved in the average's equation", "average-field-equation";
    StressSpacing: "shape-average", "stresses at nodes come from differences over half the distance", "average-stress";
    BoundaryFree: "shape-average", "the faces of the box are not held", "average-fixed-faces";
    StrainRoot: "shape-average", "the strain maps have |Dφ|² in place of |Dφ|", "average-bars";
    StateSize: "shape-average", "distances of states are not relative to the size of the average", "average-not-unique";
    CascadeForgotten: "shape-average", "a finer level starts from the identity", "average-cascade";
    FollowersPull: "shape-average", "shapes of weight zero keep their share of γ", "average-weight-zero";

    GramHalved: "shape-pca", "products of displacements are halved", "modes-dilation";
    LoadDoubled: "shape-pca", "stresses are counted twice", "linear-dilation";
    RigidFree: "shape-pca", "rigid motions are not removed", "linear-rigid-motions";
    ModesWeight: "shape-pca", "modes lack the root of the weight", "modes-orthonormal";
    CentringMissing: "shape-pca", "displacements are not centred", "modes-centred";
    HessianMetric: "shape-pca", "the Hessian product is that of L²", "modes-orthonormal";
    ScoresVariance: "shape-pca", "scores are divided by variances", "modes-mahalanobis";
    MahalanobisCount: "shape-pca", "d_M divides by n − 1", "modes-mahalanobis";
    PrestressMissing: "shape-pca", "the compound object is at rest", "linear-dilation";
    ImbalanceKept: "shape-pca", "the forces of the average stay in the nonlinear problem", "linear-perturbed";

    StepVolume: "geodesic", "a step of a path is not multiplied by its volume", "path-step-energy";
    StepGradient: "geodesic", "the gradient of a step is not pulled back", "path-step-energy";
    StepStress: "geodesic", "the force at the start of a step lacks W 1", "path-step-forces";
    AreaHalved: "geodesic", "E_area is halved", "level-area-limit";
    AreaSlope: "geodesic", "the derivative of E_area lacks the step's second derivative", "level-gradients";
    MatchHalved: "geodesic", "E_match is halved", "level-match-limit";
    MatchOwnSlope: "geodesic", "the derivative of E_match by the own level set has the wrong sign", "level-gradients";
    StepCount: "geodesic", "the energy of a path of level sets lacks 1/τ", "level-path-energy";
    AreaCount: "geodesic", "μ in place of μτ", "level-path-energy";
    StepShape: "geodesic", "a step dissipates in its end shape", "level-path-energy";
    SidesSwapped: "geodesic", "a hidden shape has to be covered where it is not", "occlusion-volume";
    UnionFirst: "geodesic", "several components dissipate as the first one", "components-dissipation";
    LengthOfSum: "geodesic", "the length is the root of the sum", "length-dissipation";
    DissipationCount: "geodesic", "the dissipation lacks the number of steps", "dissipation-balls-2d";
    MetricCutWhole: "geodesic", "cells at the boundary dissipate as a whole in the metric", "metric-disk";
    MetricPenalty: "geodesic", "the normal velocity of the metric is held by its penalty alone", "metric-disk";
    SphereMetric: "geodesic", "the metric of the chart has the first power of 1 + |x|²", "finite-sphere";
    BallVolume: "geodesic", "a ball has the volume of a cylinder", "dissipation-balls-3d";
    DashpotFactor: "geodesic", "dashpots dissipate half", "finite-springs-dashpots";
    ExponentialNeighbour: "geodesic", "every step of exp extends the first one", "calculus-exponential";
    LogarithmScale: "geodesic", "the logarithm is not in unit time", "calculus-logarithm";
    TransportRung: "geodesic", "a rung of the ladder starts at its own side", "calculus-transport";
    PathHessianSign: "geodesic", "the Hessian of a path has the wrong sign", "path-not-unique";
    DirectionsNotMeant: "geodesic", "a distance is the length of one direction", "distances-both-directions";
    TransportWithin: "geodesic", "the transport of the volume ignores distances within the shapes", "path-raised-arm";
    MiddleWeight: "geodesic", "a shape between both ends is carried to each with the weight of one", "path-middle";
    NearWeight: "geodesic", "a path from that of fewer steps ends with a third of its weight", "path-doubled";
    RichardsonOrder: "geodesic", "the extrapolation assumes one order less", "distances-both-directions";
}

impl Mutant {
    /// Returns the error of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|m| m.name() == name)
    }

    /// Returns whether it is switched on.
    #[inline(always)]
    pub fn is_on(self) -> bool {
        ACTIVE.load(Ordering::Relaxed) == self as usize + 1
    }
}

/// Switches one error on, and all others off; `None` switches off the one that is on.
pub fn switch(mutant: Option<Mutant>) {
    ACTIVE.store(mutant.map_or(0, |m| m as usize + 1), Ordering::Relaxed);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_error_at_most_is_on() {
        switch(Mutant::named("LengthHalved"));
        assert!(Mutant::LengthHalved.is_on() && !Mutant::ProfileWidth.is_on());
        assert_eq!(crate::mutant!(1.0, LengthHalved => 0.5), 0.5);
        switch(None);
        assert!(Mutant::ALL.iter().all(|m| !m.is_on()));
        assert_eq!(crate::mutant!(1.0, LengthHalved => 0.5), 1.0);
    }

    #[test]
    fn names_are_told_apart() {
        for mutant in Mutant::ALL {
            assert_eq!(Mutant::named(mutant.name()), Some(*mutant));
        }
    }
}
