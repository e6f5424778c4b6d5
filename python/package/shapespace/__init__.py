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
    distances,
    extend,
    geodesic,
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
    Distances,
    Doubt,
    Extension,
    Geodesic,
    ImageAverage,
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
    "ComputationError",
    "Distances",
    "Doubt",
    "Extension",
    "Geodesic",
    "ImageAverage",
    "InputError",
    "Iteration",
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
    "distances",
    "extend",
    "geodesic",
    "options",
    "pca",
    "score",
    "segment",
    "synthesize",
    "transport",
    "verify",
    "warp",
]
