//! The limits of all figures by which results are judged, with their reasons and remedies.

use serde::{Deserialize, Serialize};

/// What a figure measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Cause {
    /// Minimisers that ended before they converged.
    NotConverged,
    /// The estimated distance of the energy from its minimum.
    RemainingEnergy,
    /// The overlap of a deformed shape with the one that it should have become.
    Overlap,
    /// The distance of their boundaries.
    BoundaryDistance,
    /// Parts, holes and tunnels of a shape that another has not, which should be equal.
    Topology,
    /// The smallest determinant of a deformation.
    Determinant,
    /// An object that touches the border of its image.
    Border,
    /// An object that surrounds the rest of its image.
    Background,
    /// Grey values inside an object.
    GreyValues,
    /// Components that are much smaller than the object.
    Specks,
    /// A shape that fits better when it is reflected.
    Reflection,
    /// A shape that fits better when it is turned.
    Turned,
    /// Parts that the grid does not resolve.
    ThinParts,
    /// Samples of a mask that are far from each other for the grid.
    CoarseSamples,
    /// Gaps between parts that the grid does not resolve.
    NarrowGaps,
    /// The resultant of the boundary stresses at an average.
    StressBalance,
    /// The smallest curvature of the energy at an average.
    Indefinite,
    /// The overlap of the end of a path with the end shape.
    PathEnd,
    /// The distance of most of their boundaries.
    PathBoundary,
    /// The largest distance of their boundaries: parts that are missing or left over.
    PathParts,
    /// Merges and splits of a path beyond those in which its ends differ.
    NeedlessContacts,
    /// The overlap of a deformed shape, of which a part is hidden, with all that is visible of the other.
    HiddenPart,
    /// The part of an average that no shape shows.
    Unseen,
    /// The part of a shape that lies outside of the box of its grid.
    OutsideBox,
    /// The difference of the distances in the two directions.
    Asymmetry,
    /// Distances that are longer than a way through a third shape.
    TriangleInequality,
    /// The least p-value that groups of these sizes can have.
    GroupSizes,
    /// Inputs that equal other ones, where every input counts as an independent shape.
    Repeated,
    /// The velocity of a boundary beside the one that it should have.
    BoundaryVelocity,
    /// The estimated error of a finite grid.
    GridError,
    /// The estimated error of the samples of a mask.
    SamplingError,
    /// The energy of another minimum above the lowest one.
    Ambiguous,
    /// The length of another minimal path above that of the shortest.
    AmbiguousPath,
    /// The length of a given path relative to that of the geodesic between its ends.
    ShorterPath,
    /// The overlap of the edges of an image with those of the average that are carried to it.
    EdgeOverlap,
    /// The share of the edges of an average that no edge of an image is carried to.
    UnmatchedEdges,
    /// The share of the edges of an image that are no lines.
    SolidEdges,
    /// How much images differ after they were deformed, relative to before.
    Spread,
    /// The share of the boundary of an object that does not lie on an edge of its image.
    OffEdges,
    /// The overlap of an object with the true one.
    Truth,
    /// The fall of the energy along the direction of least curvature.
    Saddle,
    /// The distance of a shape from the modes that its scores and its p-value are of.
    Residual,
    /// How much the energy of a step beyond the end of a path differs from that of the step before.
    StepEnergy,
    /// Doubts about the result that this one is computed from.
    Source,
}

/// A bound of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Smaller figures are doubtful.
    AtLeast(f64),
    /// Larger figures are doubtful.
    AtMost(f64),
}

/// A figure of results, its limit, the reason for the limit, and what to do beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criterion {
    /// What the figure measures, in one word.
    pub cause: Cause,
    /// The definition of the figure.
    pub figure: &'static str,
    /// Its limit.
    pub limit: Limit,
    /// The reason for the limit.
    pub reason: &'static str,
    /// What to try.
    pub remedy: &'static str,
}

/// Mean distance of two boundaries, in spacings of the grid, up to which an overlap is not doubtful:
/// a boundary is known to about a quarter of a spacing, which in thin shapes and in volumes on
/// coarse grids takes away more of the overlap than [`Cause::Overlap`] allows.
pub const RESOLVED_DISTANCE: f64 = 0.25;

/// Smallest determinant that is not doubtful, as a multiple of the lower bound that the minimiser
/// enforces. Steps are damped close to that bound: a determinant below twice the bound means that
/// the bound, and not the energy, has determined the deformation.
pub const DETERMINANT_FLOOR: f64 = 2.0;

/// All criteria, in the order of [`Cause`].
const CRITERIA: [Criterion; 44] = [
    Criterion {
        cause: Cause::NotConverged,
        figure: "minimisations that ended before they converged",
        limit: Limit::AtMost(0.0),
        reason: "A state at which the minimiser was stopped is not a minimum.",
        remedy: "increase --max-iterations if the limit was reached, use a finer --grid if the minimisation \
                 stalled, or repeat the command if it was interrupted",
    },
    Criterion {
        cause: Cause::RemainingEnergy,
        figure: "estimated energy above the minimum, relative to the elastic energy",
        limit: Limit::AtMost(0.2),
        reason: "At the default tolerance averages of built-in families and of fish end within 2 % of the \
                 elastic energy above its minimum, and hands with fingers close together, where folds of \
                 the void hold the deformations back, within 20 %.",
        remedy: "decrease --tolerance",
    },
    Criterion {
        cause: Cause::Overlap,
        figure: "Dice overlap of the deformed shape with the average",
        limit: Limit::AtLeast(0.96),
        reason: "Shapes without sharp or thin parts reach .98 to 1; below .96 a part, such as a \
                 finger or a tail, is usually not covered. A mean distance of the boundaries of a \
                 quarter of a spacing or less is not doubtful at any overlap.",
        remedy: "use --align rigid, a finer --grid or a larger --mismatch-weight, or leave the \
                 shape out",
    },
    Criterion {
        cause: Cause::BoundaryDistance,
        figure: "largest distance of the boundaries, in spacings of the grid",
        limit: Limit::AtMost(3.0),
        reason: "Interfaces are two spacings wide: boundaries that were matched lie within two \
                 spacings, sharp corners included. At three spacings a part, such as a finger or \
                 a tail, was not matched, however small its share of the overlap is.",
        remedy: "use --align rigid, a finer --grid or a larger --mismatch-weight, or leave the \
                 shape out",
    },
    Criterion {
        cause: Cause::Topology,
        figure: "parts, holes and tunnels of the shape that the average or the end of the path has not, or the other way \
                 round",
        limit: Limit::AtMost(0.0),
        reason: "Deformations keep parts, holes and the tunnels of rings. One of a shape that the other has not was \
                 squeezed to less than a cell, whatever the overlap. Parts and holes count that are 1.5 spacings deep, \
                 and tunnels that are two spacings wide in matter two spacings thick.",
        remedy: "use shapes with the same parts and holes, fill holes, or compute paths with --form level-sets",
    },
    Criterion {
        cause: Cause::Determinant,
        figure: "smallest determinant of a deformation",
        limit: Limit::AtLeast(DETERMINANT_FLOOR * 1e-3),
        reason: "The minimiser keeps determinants above --min-determinant, 1e-3 by default. Below \
                 twice that bound, the bound and not the energy determines the deformation.",
        remedy: "use --align rigid, a larger --void-stiffness or a finer --grid",
    },
    Criterion {
        cause: Cause::Border,
        figure: "share of the border of the image that the object covers",
        limit: Limit::AtMost(0.0),
        reason: "An object that touches the border of its image may continue beyond it; the \
                 program closes it there.",
        remedy: "use an image that shows the whole object, and add a margin of background if it \
                 does already",
    },
    Criterion {
        cause: Cause::Background,
        figure: "share of the border of the image that the object covers",
        limit: Limit::AtMost(0.5),
        reason: "What covers most of the border surrounds the rest of the image: it is the \
                 background, and the mask is inverted.",
        remedy: "use --invert, or `segment --object dark`: the object must be bright, the background dark",
    },
    Criterion {
        cause: Cause::GreyValues,
        figure: "share of the object or of the background that is grey, two samples or more from the boundary",
        limit: Limit::AtMost(0.2),
        reason: "A mask has two levels, and others at smoothed boundaries only. Grey values deep \
                 inside the object or the background are those of a scan, of which half white is not a boundary.",
        remedy: "segment the image (`shapespace segment`), or apply a threshold to it",
    },
    Criterion {
        cause: Cause::Specks,
        figure: "components smaller than a fiftieth of the largest one",
        limit: Limit::AtMost(0.0),
        reason: "Parts of objects are larger. A deformation cannot make a component vanish, so \
                 that a speck of dirt has to be matched with something, and it determines the \
                 box in which its shape is placed.",
        remedy: "remove the specks from the mask, for example by keeping its largest component",
    },
    Criterion {
        cause: Cause::Reflection,
        figure: "mismatch after the alignment of the reflected shape, relative to that of the \
                 shape",
        limit: Limit::AtLeast(0.5),
        reason: "Alignments are rotations and translations. A shape that fits twice as well when \
                 it is reflected is the other side of a pair, or its image is reflected.",
        remedy: "reflect the image, or leave the shape out",
    },
    Criterion {
        cause: Cause::Turned,
        figure: "mismatch of the shape after a rotation, relative to that as it lies",
        limit: Limit::AtLeast(0.5),
        reason: "Rotations of whole shapes cost nothing, but minimisers find them up to some 45 degrees only. \
                 Where a shape fits twice as well after a larger one, from which the elastic energy is \
                 clearly smaller, too, it may have been deformed instead of turned.",
        remedy: "use --align rigid if positions do not matter, or --starts 4 to compare other minima",
    },
    Criterion {
        cause: Cause::ThinParts,
        figure: "share of the object in parts thinner than three cells of the grid",
        limit: Limit::AtMost(0.05),
        reason: "Both sides of a boundary are represented by an interface of one to two cells; in \
                 parts thinner than three cells the two interfaces overlap. Corners of thick \
                 objects have shares below .03.",
        remedy: "use a finer --grid",
    },
    Criterion {
        cause: Cause::CoarseSamples,
        figure: "largest distance of neighbouring samples of a mask of two values, in spacings of the grid",
        limit: Limit::AtMost(3.0),
        reason: "The boundary of such a mask is known to about half the distance of its samples: beyond three \
                 spacings its error is larger than the width of an interface, and distances between \
                 shapes are those of their slices.",
        remedy: "use an image of more samples, one with grey values along the boundary, an outline, or a coarser --grid",
    },
    Criterion {
        cause: Cause::NarrowGaps,
        figure: "share of the boundary along gaps narrower than a cell of the grid",
        limit: Limit::AtMost(0.1),
        reason: "Both sides of such a gap lie in one cell: parts that it separates look like one, and \
                 a deformation that should open it folds the background instead. Hands with open \
                 fingers have shares below .06, with closed ones .42.",
        remedy: "use a finer --grid, or leave the shape out",
    },
    Criterion {
        cause: Cause::StressBalance,
        figure: "norm of the sum of the boundary loads, relative to the sum of their norms",
        limit: Limit::AtMost(0.03),
        reason: "The loads of the shapes add up to zero at the true average; what remains is \
                 an error of the modes. `pca` continues averages until their loads add up to less, \
                 except where deformations are at the lower bound of the determinant: there the \
                 stresses of folds, and not those of the shapes, would be balanced.",
        remedy: "average without the shapes of which the average is doubtful, or on a finer --grid, or use \
                 `pca --variation displacement`",
    },
    Criterion {
        cause: Cause::Indefinite,
        figure: "smallest curvature of the energy, relative to linear elasticity",
        limit: Limit::AtLeast(0.0),
        reason: "The average is not a minimum where the energy has a negative curvature, and \
                 modes are not orthogonal in its inner product.",
        remedy: "average without the shapes of which the average is doubtful, or on a finer --grid, or use \
                 `pca --variation displacement` or --at-rest",
    },
    Criterion {
        cause: Cause::PathEnd,
        figure: "Dice overlap of the deformed start shape with the end shape",
        limit: Limit::AtLeast(0.98),
        reason: "The length of a path that does not reach the end shape is not its distance. Paths \
                 between silhouettes whose parts the grid resolves end at .98 to 1. A mean distance of \
                 the boundaries of a quarter of a spacing or less is not doubtful at any overlap.",
        remedy: "use --align rigid, a finer --grid, more steps (-K) or --form level-sets",
    },
    Criterion {
        cause: Cause::PathBoundary,
        figure: "distance, in spacings of the grid, within which 95 % of either boundary lie from the \
                 other at the end of the path",
        limit: Limit::AtMost(0.5),
        reason: "A boundary is known to a fraction of a spacing. Where parts merge or split, the two \
                 sides of a slit or film narrower than a spacing are left out.",
        remedy: "use --align rigid, a finer --grid, more steps (-K) or --form level-sets",
    },
    Criterion {
        cause: Cause::PathParts,
        figure: "largest distance of the boundaries at the end of the path, in spacings of the grid",
        limit: Limit::AtMost(2.0),
        reason: "Sharp corners are rounded by one to two spacings. A part that is shorter or longer \
                 than it should be by more is missing or left over, however small it is. Slits and \
                 films narrower than a spacing are left out.",
        remedy: "use --align rigid, a finer --grid, more steps (-K) or --form level-sets",
    },
    Criterion {
        cause: Cause::NeedlessContacts,
        figure: "merges and splits of a path beyond those in which its ends differ in topology",
        limit: Limit::AtMost(0.0),
        reason: "A path that presses parts together and separates others, though both ends have the same parts and \
                 holes, is a local minimum as a rule: fingers side by side that take each other's place, where \
                 each could bend. Such paths were up to 2.4 times as long as the shortest one that was found.",
        remedy: "use --domain better where only the ends were tried, --starts 3, a finer --grid, or shapes of which the same \
                 parts lie nearer to each other",
    },
    Criterion {
        cause: Cause::HiddenPart,
        figure: "Dice overlap of the deformed shape, of which a part is hidden, with all that is visible of the \
                 other",
        limit: Limit::AtLeast(0.98),
        reason: "A shape of which a part is hidden lacks that part under all deformations: so do all shapes of \
                 a path on its domain, though the visible parts agree. The limit is that of `path_end`.",
        remedy: "use --domain better, which deforms the shape that is visible everywhere, or --form level-sets",
    },
    Criterion {
        cause: Cause::Unseen,
        figure: "share of the average at which no shape is visible",
        limit: Limit::AtMost(0.01),
        reason: "Where all shapes are hidden nothing is known of the average: its boundary there is that of least \
                 energy. A hundredth is what masks differ by at their edges.",
        remedy: "add a shape that shows this part, or do not use it",
    },
    Criterion {
        cause: Cause::OutsideBox,
        figure: "share of the area or volume of a shape that lies outside of the box of the grid",
        limit: Limit::AtMost(1e-6),
        reason: "Shapes are level sets on the grid: what lies outside of its box is missing from them, from \
                 pictures and from volumes. Less than a millionth is rounding.",
        remedy: "continue by fewer steps (-K), use a smaller variation or smaller scores, or compute the geodesic or the average \
                 with --box cube, or with all objects of the label images",
    },
    Criterion {
        cause: Cause::Asymmetry,
        figure: "difference of the lengths of both directions, relative to their mean",
        limit: Limit::AtMost(0.1),
        reason: "In the limit of many steps both lengths are equal. Smooth shapes differ by \
                 less than 1 %; no larger difference was available to choose the limit by.",
        remedy: "use more steps (-K) or a finer --grid",
    },
    Criterion {
        cause: Cause::TriangleInequality,
        figure: "excess of a distance over the way through a third shape, relative to that way",
        limit: Limit::AtMost(0.05),
        reason: "Lengths of shortest paths satisfy the triangle inequality, up to the error \
                 of a finite number of steps. Of 4060 triangles of silhouettes 22 are violated, half of \
                 them by less than 2 %.",
        remedy: "use more rounds of --detours, more steps (-K) or a finer --grid",
    },
    Criterion {
        cause: Cause::GroupSizes,
        figure: "least p-value that relabellings of groups of these sizes can have",
        limit: Limit::AtMost(0.05),
        reason: "A permutation test of two groups of three shapes has ten different relabellings: no \
                 difference, however large, has a p-value below 1/10.",
        remedy: "add shapes: two groups of four can have 1/35, three and five 1/56",
    },
    Criterion {
        cause: Cause::Repeated,
        figure: "earlier inputs whose files have the same contents",
        limit: Limit::AtMost(0.0),
        reason: "Variances, scores and p-values count every input as a shape of its own, drawn independently of \
                 the others: three copies of six shapes have the p-values of eighteen.",
        remedy: "give every file once, and a shape that is to count for more a larger weight (`average --weights`)",
    },
    Criterion {
        cause: Cause::BoundaryVelocity,
        figure: "difference of the normal velocity of the flow from the variation, relative to it",
        limit: Limit::AtMost(0.1),
        reason: "Smooth boundaries that the grid resolves move as they should to 1 %.",
        remedy: "use a finer --grid, or a variation of fewer oscillations",
    },
    Criterion {
        cause: Cause::GridError,
        figure: "estimated error of the metric by the spacing of the grid, relative to it",
        limit: Limit::AtMost(0.1),
        reason: "On smooth shapes the error falls to a quarter with half the spacing.",
        remedy: "use a finer --grid",
    },
    Criterion {
        cause: Cause::SamplingError,
        figure: "estimated error of the metric by the samples of the mask, relative to it",
        limit: Limit::AtMost(0.1),
        reason: "The boundary of a mask of two values has steps of the size of its samples. On disks the error \
                 that they cause falls to a quarter or less with half the distance of the samples.",
        remedy: "use an image of more samples, one with grey values along the boundary, or an outline",
    },
    Criterion {
        cause: Cause::Ambiguous,
        figure: "energy of another minimum above the lowest one, relative to the elastic energy",
        limit: Limit::AtLeast(0.1),
        reason: "Energies are known to some per cent at best: errors of the grid change the order of minima that \
                 are closer than a tenth of the elastic energy. Minima with averages of the same shape, \
                 within a spacing after alignment, do not count.",
        remedy: "report both averages, or decide between them: align the shapes by what corresponds, or use \
                 unequal --weights",
    },
    Criterion {
        cause: Cause::AmbiguousPath,
        figure: "length of another path to the end shape above that of the shortest, relative to it",
        limit: Limit::AtLeast(0.05),
        reason: "Lengths are known to some per cent at best: errors of the grid and of the steps change the order of \
                 paths that are closer than a twentieth. Paths that carry the same points onto each other do not \
                 count.",
        remedy: "report both paths, or decide between them: align the shapes by what corresponds",
    },
    Criterion {
        cause: Cause::ShorterPath,
        figure: "length of the given path relative to that of the geodesic between its ends",
        limit: Limit::AtLeast(0.95),
        reason: "A geodesic is a shortest path, and lengths are known to some per cent. A given path that is clearly \
                 shorter shows that the minimisation from the coarse grid and that from the given path have both ended in other minima.",
        remedy: "take the length of the given path for the distance, or try --starts 6",
    },
    Criterion {
        cause: Cause::EdgeOverlap,
        figure: "Dice overlap of the edges of an image with those of the average at its place",
        limit: Limit::AtLeast(0.96),
        reason: "Edges count where the phase field is below one half, some spacings around a line. Those of disks, \
                 faces, chests and slices of brains reach .97 to 1, a face and a letter that are averaged .92 to .95.",
        remedy: "leave the image out, use a larger --mismatch-weight, or a finer --grid",
    },
    Criterion {
        cause: Cause::UnmatchedEdges,
        figure: "share of the edges of the average that lie more than a spacing from all that an image has there",
        limit: Limit::AtMost(0.01),
        reason: "An edge of the average that an image does not have is squeezed in it to a hair, which the overlap \
                 of the edges in the image hardly shows. Disks, slices of brains and drawings of one thing have none; an L \
                 and a disk .03 to .1, one disk and two .03 to .05, an L and a ring .02.",
        remedy: "leave images out that show other things",
    },
    Criterion {
        cause: Cause::SolidEdges,
        figure: "share of the edges of an image that is thicker than two lines beside each other",
        limit: Limit::AtMost(0.4),
        reason: "Edges are lines some spacings wide. Where they fill whole areas, the texture of the image is taken \
                 for edges, or the grid does not resolve them, and nothing but the area is matched. Disks on 33 \
                 nodes, hardly wider than their edges, have .16 to .29, slices of brains with the default contrast .65.",
        remedy: "use a larger --contrast or a finer --grid",
    },
    Criterion {
        cause: Cause::Spread,
        figure: "standard deviation of the deformed images, relative to that of the images as they are",
        limit: Limit::AtMost(1.0),
        reason: "Images that correspond to each other differ less after they were deformed onto their average: a \
                 quarter to seven tenths remains. Where edges of one were matched to other edges of another, they differ \
                 more, though the edges overlap.",
        remedy: "leave out images that do not show the same, align them first, or use a finer --grid",
    },
    Criterion {
        cause: Cause::OffEdges,
        figure: "share of the boundary of the object at which the image has no edge",
        limit: Limit::AtMost(0.2),
        reason: "The boundary of an object is an edge of its image. Of noise without an object, and of gradual \
                 changes of brightness, a threshold cuts out something, too, whose boundary has no edges.",
        remedy: "use another --threshold, --object or --classes, a smaller --contrast, or an image that shows an \
                 object",
    },
    Criterion {
        cause: Cause::Truth,
        figure: "Dice overlap of the object with the true one",
        limit: Limit::AtLeast(0.9),
        reason: "Segmentations of images whose noise is as large as the contrast reach .95 and more.",
        remedy: "see in the picture which object was found: --object dark takes the other one",
    },
    Criterion {
        cause: Cause::Saddle,
        figure: "fall of the energy along the direction of least curvature, relative to the elastic energy",
        limit: Limit::AtMost(0.01),
        reason: "At a minimum the energy falls along no direction by more than the hundredth that the \
                 minimiser may leave.",
        remedy: "use more --starts, which leave a symmetric state, or decrease --tolerance",
    },
    Criterion {
        cause: Cause::Residual,
        figure: "distance of the shape from the modes, relative to that of the training shapes from the modes of the \
                 others",
        limit: Limit::AtMost(4.0),
        reason: "Scores and p-values tell of what the modes span, and nothing of the rest. Of nine training shapes \
                 none is farther than three times the root mean square. A tenth of the deformation or less is not \
                 doubtful at any distance.",
        remedy: "look at the picture whether the shape is of the population, and is not reflected; or compute the modes \
                 of more shapes",
    },
    Criterion {
        cause: Cause::StepEnergy,
        figure: "difference of the energies of two consecutive steps beyond the end of a path, relative",
        limit: Limit::AtMost(0.1),
        reason: "The steps of a geodesic have equal energies. Where a shape on the path becomes the one whose \
                 deformations the others are, these are interpolated, and lose what they have of the size of a cell; \
                 a tenth of the energy is a twentieth of the speed.",
        remedy: "compute the geodesic with --domain end, whose deformations are continued as they are, or with a smaller --mismatch-weight, whose steps are smoother",
    },
    Criterion {
        cause: Cause::Source,
        figure: "doubts about the result that this one is computed from",
        limit: Limit::AtMost(0.0),
        reason: "A result is not better than what it is computed from.",
        remedy: "remove the doubts about that result first; its result.json lists them",
    },
];

impl Cause {
    /// All causes.
    pub const ALL: [Self; CRITERIA.len()] = {
        let mut all = [Self::NotConverged; CRITERIA.len()];
        let mut index = 0;
        while index < all.len() {
            all[index] = CRITERIA[index].cause;
            index += 1;
        }
        all
    };

    /// The figure and its limit.
    pub const fn criterion(self) -> &'static Criterion {
        &CRITERIA[self as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_its_own_criterion() {
        for cause in Cause::ALL {
            assert_eq!(cause.criterion().cause, cause);
        }
    }
}
