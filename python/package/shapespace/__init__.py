"""Averages of 2D and 3D shapes, their modes of variation, geodesics and distances between them.

    import shapespace
    result = shapespace.average(masks, align="rigid")
    result.mask, result.verdict, result.save("average")

The functions are the commands of the program ``shapespace``, with the same options, defaults,
results and errors, on arrays in memory: the same numbers to the last bit.
"""

from ._commands import (
    Verification,
    average,
    compare,
    distances,
    extend,
    geodesic,
    length,
    metric,
    options,
    pca,
    score,
    segment,
    synthesize,
    transport,
    verify,
    warp,
)
from ._errors import ComputationError, InputError, ShapespaceError
from ._progress import Iteration, Note, Stage
from ._results import (
    Average,
    Comparison,
    Distances,
    Doubt,
    Extension,
    Geodesic,
    ImageAverage,
    Length,
    Metric,
    Path,
    Pca,
    Result,
    Scores,
    Segmentation,
    Shape,
    Sweep,
    Transport,
)
from ._shapespace import __version__
from ._sklearn import ShapePCA

__all__ = [
    "Average",
    "Comparison",
    "ComputationError",
    "Distances",
    "Doubt",
    "Extension",
    "Geodesic",
    "ImageAverage",
    "InputError",
    "Iteration",
    "Length",
    "Metric",
    "Note",
    "Path",
    "Pca",
    "Result",
    "Scores",
    "Segmentation",
    "Shape",
    "ShapePCA",
    "ShapespaceError",
    "Stage",
    "Sweep",
    "Transport",
    "Verification",
    "__version__",
    "average",
    "compare",
    "distances",
    "extend",
    "geodesic",
    "length",
    "metric",
    "options",
    "pca",
    "score",
    "segment",
    "synthesize",
    "transport",
    "verify",
    "warp",
]
