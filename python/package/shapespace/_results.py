"""Results: arrays, a record, a verdict; they print, draw and save themselves."""

from __future__ import annotations

import html
import json
import os
import re
import tempfile
import warnings
from pathlib import Path as FilePath
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _draw
from ._shapespace import Computed


class Doubt(NamedTuple):
    """A reason to look at a result before it is used."""

    #: The shape that it is about; None where it is about the result as a whole.
    shape: Optional[str]
    #: Its cause, a word.
    what: str
    #: The figure that is in doubt; None where it is not finite.
    figure: Optional[float]
    #: The bound of a sound figure.
    limit: float
    remedy: str
    #: The component of the shape, such as ``label 3``; None where it is about all of it.
    component: Optional[str] = None

    def __str__(self) -> str:
        names = [name for name in (self.shape, self.component) if name]
        about = f"{', '.join(names)}: " if names else ""
        figure = "unknown" if self.figure is None else f"{self.figure:.4g}"
        return f"{about}{self.what} {figure} (limit {self.limit:.4g}); {self.remedy}"


class Result:
    """The result of a command: what its result directory holds, in memory.

    All arrays have x as last axis, and the components of a vector, in the order x, y, z, first.
    Coordinates are those of the unit box unless :attr:`affine` says where it lies in the world.
    """

    _word = "Result"

    def __init__(self, computed: Computed, sources: tuple[Any, ...] = ()) -> None:
        self._computed = computed
        #: Results that this one started from, whose files it may need.
        self._sources = sources
        self._saved: Optional[FilePath] = None
        self._temporary: Optional["tempfile.TemporaryDirectory[str]"] = None
        #: The arrays of the result directory, by the names of their files without ``.npy``.
        self.arrays: dict[str, np.ndarray] = computed.take_arrays()
        #: The contents of ``result.json``.
        self.record: dict[str, Any] = json.loads(computed.record())

    @property
    def status(self) -> str:
        """``converged``, ``complete``, or the reason for an earlier end."""
        return self.record["status"]

    @property
    def verdict(self) -> str:
        """``sound``, or ``doubtful`` where there are :attr:`doubts`."""
        return self.record["verdict"]

    @property
    def doubts(self) -> list[Doubt]:
        """Why the result is doubtful, and what to do about it."""
        return [
            Doubt(
                d.get("shape"),
                d["what"],
                d.get("figure"),
                d["limit"],
                d["remedy"],
                d.get("component"),
            )
            for d in self.record["doubts"]
        ]

    @property
    def names(self) -> list[str]:
        """The names of the inputs, as in tables and pictures."""
        return [entry["name"] for entry in self.record.get("input", [])]

    @property
    def options(self) -> dict[str, Any]:
        """The options with all defaults resolved."""
        return self.record["parameters"]

    @property
    def affine(self) -> Optional[np.ndarray]:
        """From the indices of an array, in the order of its axes, to the world (RAS, millimetres):
        ``nibabel.Nifti1Image(result.mask.astype("u1"), result.affine)``. None where the inputs have
        no common place in the world."""
        world = self.record.get("world")
        if world is None or len(world["origin"]) != 3:
            return None
        affine = np.eye(4)
        # The first axis of the arrays is z.
        affine[:3, :3] = (np.array(world["direction"]) * np.array(world["spacing"]))[:, ::-1]
        affine[:3, 3] = world["origin"]
        return affine

    def save(self, folder: "str | os.PathLike[str]") -> FilePath:
        """Writes the result directory of the command line, which must not exist."""
        for source in self._sources:
            if isinstance(source, Result) and source._saved is None:
                warnings.warn(
                    f"this result starts from {source!r}, which is in a temporary folder and "
                    "vanishes with it: save that first, and compute this from it",
                    stacklevel=2,
                )
        saved = FilePath(self._computed.save(os.fspath(folder), True))
        self._saved = self._saved or saved.resolve()
        return saved

    def _folder(self) -> str:
        """A folder from which other commands read this result."""
        if self._saved is not None and self._saved.is_dir():
            return str(self._saved)
        if self._temporary is None:
            self._temporary = tempfile.TemporaryDirectory(prefix="shapespace-")
            self._computed.save(os.path.join(self._temporary.name, self._word.lower()), False)
        return os.path.join(self._temporary.name, self._word.lower())

    def _numbered(self, kind: str) -> list[np.ndarray]:
        pattern = re.compile(rf"{kind}_(\d+)")
        found = [(pattern.fullmatch(name), array) for name, array in self.arrays.items()]
        numbered = [(int(match.group(1)), array) for match, array in found if match]
        return [array for _, array in sorted(numbered, key=lambda pair: pair[0])]

    def _shape_words(self) -> str:
        nodes = " x ".join(map(str, self.record.get("nodes", [])))
        n = len(self.names)
        shapes = f" of {n} shapes" if n else ""
        return shapes + (f" on {nodes} nodes" if nodes else "")

    def __repr__(self) -> str:
        doubts = len(self.record["doubts"])
        verdict = self.verdict if not doubts else f"doubtful ({doubts} doubts)"
        state = self.status.replace("_", " ")
        return f"<{self._word}{self._shape_words()}: {state}, {verdict}>"

    def __str__(self) -> str:
        return self._computed.summary()

    def _repr_html_(self) -> str:
        picture = _draw.as_html(self)
        return f"<pre>{html.escape(str(self))}</pre>{picture}"

    def plot(self, ax: Any = None) -> Any:
        """Draws the result with matplotlib, and returns the axes."""
        raise NotImplementedError(f"there is no picture of {self!r}")

    def __reduce__(self) -> Any:
        raise TypeError("a result cannot be pickled: save() it, and read its files")


class Average(Result):
    """The elastic average of shapes."""

    _word = "Average"

    @property
    def average(self) -> np.ndarray:
        """The phase field of the average's boundary: 0 there, 1 away from it."""
        return self.arrays["average"]

    @property
    def mask(self) -> np.ndarray:
        """Where the average shape is."""
        return self.arrays["average_mask"]

    @property
    def deformations(self) -> list[np.ndarray]:
        """For every input, where its points go in the unit box: ``(d, [nz,] ny, nx)``."""
        return self._numbered("deformation")

    @property
    def phase_fields(self) -> list[np.ndarray]:
        """The phase fields of the inputs."""
        return self._numbered("phasefield")

    @property
    def weights(self) -> list[np.ndarray]:
        """The elastic weights of the inputs: 1 inside, the stiffness of the void outside."""
        return self._numbered("weight")

    @property
    def dice(self) -> np.ndarray:
        """The overlap of every deformed input with the average."""
        return np.array(self.record["dice"])

    @property
    def hausdorff(self) -> list[dict[str, float]]:
        """The distance of every deformed input from the average."""
        return self.record["hausdorff"]

    @property
    def energy(self) -> dict[str, Any]:
        """The energy and its terms."""
        return self.record["energy"]

    @property
    def certified(self) -> bool:
        """Whether it is proven that no deformation folds."""
        return bool(self.record["certificate"]["certified"])

    def plot(self, ax: Any = None) -> Any:
        return _draw.average(self, ax)


class ImageAverage(Average):
    """The average of grey images, with ``joint=True``."""

    _word = "Average of images"

    @property
    def image(self) -> np.ndarray:
        """The average image."""
        return self.arrays["average_image"]

    @property
    def mask(self) -> np.ndarray:
        raise AttributeError("an average of images has no object: see .image and .average")

    def plot(self, ax: Any = None) -> Any:
        return _draw.field(self.image, ax)


class Sweep(Result):
    """Averages for all weights, with ``sweep=N``."""

    _word = "Sweep"

    @property
    def averages(self) -> list[np.ndarray]:
        """The phase fields of the averages."""
        return self._numbered("average")

    @property
    def masks(self) -> list[np.ndarray]:
        """The averages as masks."""
        return self._numbered("average_mask")

    @property
    def weights(self) -> np.ndarray:
        """The weights of every average."""
        return np.array([entry["weights"] for entry in self.record["averages"]])

    def plot(self, ax: Any = None) -> Any:
        return _draw.row(self.masks, ax)


class Path(Result):
    """A path of shapes."""

    _word = "Path"

    @property
    def shapes(self) -> list[np.ndarray]:
        """The level sets of the shapes along the path, positive inside."""
        return self._numbered("shape")

    @property
    def masks(self) -> list[np.ndarray]:
        """The shapes along the path."""
        return [shape > 0 for shape in self.shapes]

    @property
    def deformations(self) -> list[np.ndarray]:
        """Where the points of each shape go in the step to the next."""
        return self._numbered("deformation")

    @property
    def length(self) -> float:
        """The length of the path."""
        return self.record["length"]

    def plot(self, ax: Any = None) -> Any:
        return _draw.row(self.masks, ax)


class Geodesic(Path):
    """The shortest path between two shapes."""

    _word = "Geodesic"

    @property
    def end_reached(self) -> bool:
        """Whether the path reaches the end shape."""
        return bool(self.record["end_reached"])


class Extension(Path):
    """A geodesic, continued beyond its end."""

    _word = "Extension"


class Transport(Path):
    """The path from the last shape of a geodesic to the counterpart of a variation of the first."""

    _word = "Transport"

    @property
    def variations(self) -> tuple[np.ndarray, np.ndarray]:
        """The variation at the first shape and at the last, as velocities."""
        return self.arrays["variation_start"], self.arrays["variation_end"]


class Length(Path):
    """The path through given shapes."""

    _word = "Length"

    @property
    def dissipation(self) -> float:
        """The dissipation along the path, at least the square of the length."""
        return self.record["dissipation"]

    @property
    def geodesic_length(self) -> Optional[float]:
        """The length of the geodesic between the first and the last shape, where it was computed."""
        found = self.record.get("geodesic")
        return None if found is None else found["length"]


class Metric(Result):
    """The metric of a variation of a shape, and the optimal flow in it."""

    _word = "Metric"

    @property
    def metric(self) -> float:
        """The squared length of the variation: the least dissipation of a flow that causes it."""
        return self.record["metric"]

    @property
    def error(self) -> Optional[float]:
        """An estimate of the error of the metric by the spacing of the grid."""
        return self.record["discretisation"].get("error")

    @property
    def velocity(self) -> np.ndarray:
        """The velocity of the fluid at the nodes."""
        return self.arrays["velocity"]

    @property
    def dissipation(self) -> np.ndarray:
        """The dissipation of the fluid at the nodes."""
        return self.arrays["dissipation"]

    @property
    def level_set(self) -> np.ndarray:
        """The signed distance to the boundary of the shape, positive inside."""
        return self.arrays["level_set"]

    def plot(self, ax: Any = None) -> Any:
        return _draw.field(self.dissipation, ax)


class Comparison(Result):
    """Groups of shapes, compared by their modes or distances."""

    _word = "Comparison"

    def _shape_words(self) -> str:
        return f" of {len(self.names)} shapes"

    @property
    def names(self) -> list[str]:
        return list(self.record["shapes"])

    @property
    def groups(self) -> list[str]:
        """The group of every shape."""
        return list(self.record["group_of_shape"])

    @property
    def p_value(self) -> float:
        """The probability of at least this difference under random groups, of all modes or distances
        together."""
        scores = self.record.get("scores")
        return self.record["distances"]["p_value"] if scores is None else scores["p_value_overall"]

    @property
    def means(self) -> list[np.ndarray]:
        """The signed distances of the means of the groups; only from modes."""
        return self._numbered("mean")

    def plot(self, ax: Any = None) -> Any:
        return _draw.row([mean > 0 for mean in self.means], ax)


class Distances(Result):
    """The distances between all pairs of shapes, or from new to stored ones."""

    _word = "Distances"

    @property
    def matrix(self) -> np.ndarray:
        """The matrix of distances: symmetric, with zeros on the diagonal; NaN where no path of a
        pair could be used, or none was computed (``skip_far``, ``landmarks``). With ``against`` it has a row for each new shape and a column for each
        stored one. ``metric="precomputed"`` of scikit-learn takes it."""
        return self.arrays["distances"]

    def condensed(self) -> np.ndarray:
        """The distances of the pairs ``i < j`` row by row, as ``scipy.cluster`` takes them."""
        if "new_shapes" in self.record:
            raise ValueError("distances from new to stored shapes have no condensed form")
        return self.matrix[np.triu_indices(len(self.matrix), 1)]

    @property
    def neighbours(self) -> Optional[list[list[tuple[int, float]]]]:
        """The nearest shapes of every new shape, or of all with ``neighbours``: their columns in the
        matrix and their distances, nearest first."""
        found = self.record.get("neighbours")
        if found is None:
            return None
        first = self.record.get("new_shapes", 0)
        return [[(n["object"] - first, n["distance"]) for n in of["nearest"]] for of in found["of"]]

    @property
    def votes(self) -> Optional[list[Optional[str]]]:
        """The class that most of these neighbours have, where classes are given."""
        found = self.record.get("neighbours")
        return None if found is None else [of.get("vote") for of in found["of"]]

    @property
    def points(self) -> Optional[np.ndarray]:
        """The shapes as points in the plane whose distances are about those of the shapes."""
        found = self.record.get("embedding")
        return None if found is None else np.array(found["points"])

    @property
    def labels(self) -> Optional[np.ndarray]:
        """The cluster of every shape."""
        found = self.record.get("clustering")
        return None if found is None else np.array(found["labels"])

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> np.ndarray:
        return np.array(self.matrix, dtype=dtype)

    def plot(self, ax: Any = None) -> Any:
        return _draw.matrix(self, ax)


class Pca(Result):
    """The modes of variation of an average."""

    _word = "Modes"

    def _shape_words(self) -> str:
        return f" of {self.record['n_shapes']} shapes, {self.record['n_modes']} modes"

    @property
    def names(self) -> list[str]:
        return list(self.record["shapes"])

    @property
    def scores(self) -> np.ndarray:
        """The scores of the shapes of the average in the modes, in standard deviations."""
        return np.array(self.record["scores"])

    @property
    def eigenvalues(self) -> np.ndarray:
        """The variances of the modes, in descending order."""
        return np.array(self.record["eigenvalues"])[: self.record["n_modes"]]

    @property
    def ratios(self) -> np.ndarray:
        """The shares of the modes in the whole variance."""
        variances = np.clip(np.array(self.record["eigenvalues"]), 0, None)
        return self.eigenvalues / variances.sum()

    @property
    def modes(self) -> list[np.ndarray]:
        """The modes as displacements of the average, of one standard deviation."""
        return self._numbered("mode")

    @property
    def mahalanobis(self) -> np.ndarray:
        """The Mahalanobis distances of the shapes of the average."""
        return np.array(self.record["mahalanobis"])

    @property
    def object(self) -> np.ndarray:
        """The average shape: 1 inside, 0 outside."""
        return self.arrays["object"]

    def plot(self, ax: Any = None) -> Any:
        return _draw.scores(self.scores, self.names, ax)


class Scores(Result):
    """The scores of new shapes in the modes of variation."""

    _word = "Scores"

    def _shape_words(self) -> str:
        return f" of {len(self.record['scores'])} shapes"

    @property
    def scores(self) -> np.ndarray:
        """The scores, a row for each shape, in standard deviations."""
        return np.array(self.record["scores"])

    @property
    def mahalanobis(self) -> np.ndarray:
        """The Mahalanobis distances from the average."""
        return np.array(self.record["mahalanobis"])

    @property
    def p_values(self) -> np.ndarray:
        """The probabilities of at least these distances."""
        return np.array(self.record["p_value"])

    @property
    def residuals(self) -> np.ndarray:
        """The shares of the shapes that the modes do not have."""
        return np.array(self.record["residual"])

    @property
    def dice(self) -> np.ndarray:
        """The overlap of every shape, deformed onto the average, with the average."""
        return np.array(self.record["dice"])

    def plot(self, ax: Any = None) -> Any:
        n = len(self.scores)
        return _draw.scores(self.scores, [str(k) for k in range(n)], ax)


class Shape(Result):
    """A shape that is computed from its scores."""

    _word = "Shape"

    @property
    def mask(self) -> np.ndarray:
        """Where the shape is."""
        return self.arrays["shape_mask"]

    @property
    def level_set(self) -> np.ndarray:
        """The signed distance to its boundary, positive inside."""
        return self.arrays["shape"]

    @property
    def displacement(self) -> np.ndarray:
        """The displacement of the average."""
        return self.arrays["displacement"]

    def plot(self, ax: Any = None) -> Any:
        return _draw.row([self.mask], ax)


class Segmentation(Result):
    """The edges and the objects of grey images."""

    _word = "Segmentation"

    def _shape_words(self) -> str:
        return f" of {len(self.record['images'])} images"

    @property
    def names(self) -> list[str]:
        return [entry["name"] for entry in self.record["images"]]

    @property
    def masks(self) -> list[np.ndarray]:
        """The objects, in the samples of the images."""
        objects = [entry.get("object") for entry in self.record["images"]]
        return [self.arrays[found["mask"][: -len(".npy")]] for found in objects if found]

    @property
    def edges(self) -> list[np.ndarray]:
        """Where the images have edges, at the nodes of their grids."""
        return self._numbered("edges")

    @property
    def smoothed(self) -> list[np.ndarray]:
        """The images, smooth away from edges."""
        return self._numbered("smoothed")

    @property
    def phase_fields(self) -> list[np.ndarray]:
        """The phase fields of the edges: 0 there, 1 away from them."""
        return self._numbered("phasefield")

    def plot(self, ax: Any = None) -> Any:
        return _draw.row(self.masks or self.edges, ax)
