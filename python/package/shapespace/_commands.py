"""The commands, one function each."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from typing import Any, Iterable, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _shapespace
from ._errors import InputError
from ._inputs import Gathered, Image, Images
from ._progress import Progress
from ._results import (
    Average,
    Comparison,
    Distances,
    Extension,
    Geodesic,
    ImageAverage,
    Length,
    Metric,
    Pca,
    Result,
    Scores,
    Segmentation,
    Shape,
    Sweep,
    Transport,
)

#: A result, or the folder of one.
Source = Union[Result, str, "os.PathLike[str]"]

#: A file of options, such as the ``config.toml`` beside a result.
File = Union[str, "os.PathLike[str]"]
#: The folder of checkpoints, or the folder and the minutes between two of them.
Checkpoint = Union[File, Tuple[File, float]]

#: Minutes between checkpoints, as on the command line.
_MINUTES = 10.0

#: Keys of configurations that are arguments of the functions here.
_INPUTS = {"inputs", "start", "end", "average", "pca", "geodesic", "variation", "shape"}
_INPUTS |= {"result", "groups"}


def options(command: str) -> list[str]:
    """The names of the options of a command, those of the command line with ``_`` for ``-``.

    ``shapespace config COMMAND`` prints them with their meaning and their defaults."""
    # Inputs of one command are options of another.
    own = {"average": {"start", "average"}, "pca": {"groups"}}
    inputs = _INPUTS - own.get(command, set())
    return [key for key in _shapespace.keys(command) if key not in inputs]


def _plain(value: Any) -> Any:
    """A value that JSON has."""
    if isinstance(value, Result):
        return value._folder()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value


def _checkpoint(given: Optional[Checkpoint]) -> Optional[tuple[str, float]]:
    """The folder and the minutes."""
    if given is None:
        return None
    if isinstance(given, (str, os.PathLike)):
        return os.fspath(given), _MINUTES
    folder, minutes = given
    return os.fspath(folder), float(minutes)


class _Run:
    """The file of options, and the arguments that no result depends on."""

    def __init__(
        self,
        progress: Optional[Progress] = None,
        threads: Optional[int] = None,
        memory: Union[int, str, None] = None,
        at_once: Optional[int] = None,
        trust: bool = False,
        config: Optional[File] = None,
        checkpoint: Optional[Checkpoint] = None,
    ) -> None:
        self.arguments: dict[str, Any] = {
            "config": None if config is None else os.fspath(config),
            "checkpoint": _checkpoint(checkpoint),
            "progress": progress,
            "threads": threads,
            "memory": None if memory is None else str(memory),
            "at_once": at_once,
            "trust": trust,
        }

    def __call__(
        self, command: str, given: Gathered, inputs: dict[str, Any], extra: dict[str, Any]
    ) -> _shapespace.Computed:
        values = dict(inputs)
        for key, value in extra.items():
            # `lambda_` is the option `lambda`, which is a word of Python.
            key = key.rstrip("_")
            if key in values:
                raise TypeError(f"{key} is given twice")
            values[key] = value
        values = {key: _plain(value) for key, value in values.items() if value is not None}
        try:
            text = json.dumps(values, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"an option cannot be used: {error}",
                help="options are finite numbers, texts, and lists of them",
            ) from error
        return _shapespace.run(command, text, given.arrays, **self.arguments)


def _from(source: Source, kind: type[Result], word: str) -> str:
    """The folder of a result."""
    if isinstance(source, Result) and isinstance(source, kind):
        return source._folder()
    if isinstance(source, (str, os.PathLike)):
        return os.fspath(source)
    raise TypeError(f"{word} is needed, or the folder of one, not {type(source).__name__}")


def _views(given: Gathered, valid: Any) -> Optional[list[str]]:
    """Visibility masks, None for inputs that are completely visible."""
    if valid is None:
        return None
    return [
        "all" if view is None or (isinstance(view, str) and view == "all")
        else given.image(view, f"valid_{k:03}")
        for k, view in enumerate(valid)
    ]


def average(
    masks: Optional[Images] = None,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    valid: Optional[Sequence[Optional[Image]]] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    memory: Union[int, str, None] = None,
    trust: bool = False,
    **options: Any,
) -> Union[Average, ImageAverage, Sweep]:
    """Computes the elastic average of two or more shapes in masks.

    ``config`` is a file of options as ``--config`` takes it, for example the ``config.toml`` beside a
    result; without ``masks`` those are averaged that it names. With ``checkpoint="folder"`` the
    state is stored in ``folder.partial`` every ten minutes, ``checkpoint=("folder", 2)`` every two: after
    a sudden end, or Ctrl-C, the same call resumes from there to the same result.

    ``masks`` are arrays, names of files, or images of nibabel or SimpleITK; in arrays the object is
    where the value is above 1/2, as ``shapespace average`` reads a ``.npy`` file of the same
    numbers. ``spacing`` and ``affine`` are those of all arrays, or one for each: distances of
    samples, and maps of indices to the world, in the order of the axes of the arrays.

    ``valid`` has a visibility mask, or None, for each shape. ``progress`` is called with every
    event, for example ``progress=print``. All other options are those of the command line
    (:func:`options`), with the same defaults: ``grid=65``, ``align="rigid"``, ``joint=True``."""
    given = Gathered()
    inputs = None if masks is None else given.images(masks, spacing, affine, names)
    run = _Run(progress, threads, memory, None, trust, config=config, checkpoint=checkpoint)
    views = _views(given, valid)
    computed = run("average", given, {"inputs": inputs, "valid": views}, options)
    start = options.get("start")
    kind = Average
    if options.get("joint"):
        kind = ImageAverage
    elif options.get("sweep") is not None:
        return Sweep(computed)
    return kind(computed, () if start is None else (start,))


def geodesic(
    start: Image,
    end: Image,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    valid_start: Optional[Image] = None,
    valid_end: Optional[Image] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    **options: Any,
) -> Geodesic:
    """Computes the shortest path between two shapes in masks, which :func:`average` describes."""
    given = Gathered()
    ends = ["start", "end"] if names is None else names
    first, last = given.images([start, end], spacing, affine, ends)
    views = {
        key: None if view is None else given.image(view, key)
        for key, view in [("valid_start", valid_start), ("valid_end", valid_end)]
    }
    inputs = {"start": first, "end": last, **views}
    run = _Run(progress, threads, config=config, checkpoint=checkpoint)
    return Geodesic(run("geodesic", given, inputs, options))


def length(
    shapes: Images,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    **options: Any,
) -> Length:
    """Computes the length of the path through given shapes in masks, which :func:`average` describes,
    beside that of the geodesic between the first and the last."""
    given = Gathered()
    inputs = {"inputs": given.images(shapes, spacing, affine, names, "shape")}
    run = _Run(progress, threads, config=config, checkpoint=checkpoint)
    return Length(run("length", given, inputs, options))


def metric(
    shape: Image,
    variation: Optional[Image] = None,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    **options: Any,
) -> Metric:
    """Computes the metric of a variation of a shape: the least dissipation of a viscous fluid in it whose
    boundary moves in that way.

    The boundary moves towards the shape in the mask ``variation``, or as one of the options says:
    ``dilation=True``, ``mode=2``, ``translation=[1, 0]``."""
    given = Gathered()
    images = [shape] if variation is None else [shape, variation]
    ends = ["shape", "variation"][: len(images)] if names is None else names
    found = given.images(images, spacing, affine, ends)
    inputs = dict(zip(["shape", "variation"], found))
    run = _Run(progress, threads, config=config, checkpoint=checkpoint)
    return Metric(run("metric", given, inputs, options))


def distances(
    masks: Optional[Images] = None,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    against: Optional[Images] = None,
    classes: Union[str, "os.PathLike[str]", Sequence[Any], None] = None,
    config: Optional[File] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    at_once: Optional[int] = None,
    **options: Any,
) -> Distances:
    """Computes the distances between all pairs of shapes in masks, which :func:`average` describes; with
    ``against`` those from the masks to these stored shapes, as ``scipy.spatial.distance.cdist``.

    ``classes`` are the class of each shape, of the stored ones with ``against``, or as on the command
    line. ``spacing`` and ``affine`` are of all arrays. ``at_once`` pairs are computed at the same
    time."""
    given = Gathered()
    inputs = None if masks is None else given.images(masks, spacing, affine, names)
    stored = None if against is None else given.images(against, spacing, affine, None, "stored")
    run = _Run(progress, threads, None, at_once, config=config)
    with tempfile.TemporaryDirectory(prefix="shapespace-") as folder:
        if classes is not None and not isinstance(classes, (str, os.PathLike)):
            of = inputs if stored is None else stored
            if of is None:
                raise TypeError("classes as a list need masks")
            classes = _listed(of, list(classes), os.path.join(folder, "classes.csv"))
        values = {"inputs": inputs, "against": stored, "classes": classes}
        return Distances(run("distances", given, values, options))


def _listed(inputs: list[str], classes: list[Any], path: str) -> str:
    """Classes as the file that the command line reads."""
    if len(classes) != len(inputs):
        raise InputError(f"there are {len(classes)} classes for {len(inputs)} shapes")
    with open(path, "w", encoding="utf-8") as file:
        file.write("file,class\n")
        file.writelines(f"{name},{entry}\n" for name, entry in zip(inputs, classes))
    return path


def pca(
    average: Source,
    *,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Pca:
    """Computes the principal modes of variation of the shapes of an average.

    ``average`` is the result of :func:`average`, or the folder of one. The modes of a result in
    memory are computed from a copy in a temporary folder: save the average first, if the modes are
    to be saved too."""
    source = {"average": _from(average, Average, "an average")}
    run = _Run(progress, threads, trust=trust, config=config, checkpoint=checkpoint)
    computed = run("pca", Gathered(), source, options)
    return Pca(computed, (average,))


def score(
    masks: Images,
    pca: Source,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    average: Optional[Source] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Scores:
    """Computes the scores of new shapes in masks in the modes of variation.

    ``average`` names the folder of the average if it has been moved."""
    given = Gathered()
    inputs = {
        "inputs": given.images(masks, spacing, affine, names),
        "pca": _from(pca, Pca, "the result of pca()"),
        "average": None if average is None else _from(average, Average, "an average"),
    }
    run = _Run(progress, threads, trust=trust, config=config, checkpoint=checkpoint)
    computed = run("score", given, inputs, options)
    return Scores(computed, (pca,))


def synthesize(
    pca: Source,
    scores: Any,
    *,
    average: Optional[Source] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Shape:
    """Computes the shape that has these scores in the first modes, in standard deviations."""
    inputs = {
        "pca": _from(pca, Pca, "the result of pca()"),
        "scores": np.atleast_1d(np.asarray(scores, float)).tolist(),
        "average": None if average is None else _from(average, Average, "an average"),
    }
    run = _Run(progress, threads, trust=trust, config=config, checkpoint=checkpoint)
    computed = run("synthesize", Gathered(), inputs, options)
    return Shape(computed, (pca,))


def compare(
    result: Source,
    groups: Union[str, "os.PathLike[str]", Sequence[Any], Mapping[str, Sequence[Any]]],
    *,
    average: Optional[Source] = None,
    config: Optional[File] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Comparison:
    """Tests whether groups of shapes differ, from their modes (:func:`pca`) or distances.

    ``groups`` are the group of each shape in the order of the result; or columns of that length, such
    as ``{"group": [...], "age": [...]}``, of which those of numbers are covariates; or a table or word
    as on the command line."""
    if isinstance(result, Result) and not isinstance(result, (Pca, Distances)):
        raise TypeError(f"the result of pca() or distances() is needed, not {result!r}")
    source = _from(result, Result, "the result of pca() or distances()")
    inputs: dict[str, Any] = {
        "result": source,
        "average": None if average is None else _from(average, Average, "an average"),
    }
    run = _Run(progress, threads, trust=trust, config=config)
    with tempfile.TemporaryDirectory(prefix="shapespace-") as folder:
        if not isinstance(groups, (str, os.PathLike)):
            path = os.path.join(folder, "groups.csv")
            groups = _table(_names(source, result), groups, path)
        inputs["groups"] = groups
        return Comparison(run("compare", Gathered(), inputs, options), (result,))


def _names(folder: str, result: Source) -> list[str]:
    """The names of the shapes of a result."""
    if isinstance(result, Result):
        return result.names
    try:
        with open(os.path.join(folder, "result.json"), encoding="utf-8") as file:
            record = json.load(file)
    except (OSError, ValueError) as error:
        raise InputError(f"'{folder}' is not a result: {error}") from error
    return record.get("shapes") or [entry["name"] for entry in record.get("input", [])]


def _table(names: list[str], groups: Any, path: str) -> str:
    """Groups and covariates as the table that the command line reads."""
    columns = dict(groups) if isinstance(groups, Mapping) else {"group": groups}
    columns = {str(key): list(values) for key, values in columns.items()}
    for key, values in columns.items():
        if len(values) != len(names):
            raise InputError(f"there are {len(values)} values of {key} for {len(names)} shapes")
    with open(path, "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["shape", *columns])
        table.writerows(zip(names, *columns.values()))
    return path


def segment(
    images: Images,
    *,
    spacing: Any = None,
    affine: Any = None,
    names: Optional[Iterable[str]] = None,
    truth: Optional[Sequence[Image]] = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    **options: Any,
) -> Segmentation:
    """Segments grey images: their edges, and the objects bounded by them.

    ``truth`` has masks of the true objects, with which those found are compared."""
    given = Gathered()
    inputs: dict[str, Any] = {"inputs": given.images(images, spacing, affine, names, "image")}
    if truth is not None:
        inputs["truth"] = given.images(truth, kind="truth")
    run = _Run(progress, threads, config=config, checkpoint=checkpoint)
    return Segmentation(run("segment", given, inputs, options))


def extend(
    geodesic: Source,
    *,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Extension:
    """Continues a geodesic beyond its end."""
    source = {"geodesic": _from(geodesic, Geodesic, "a geodesic")}
    run = _Run(progress, threads, trust=trust, config=config, checkpoint=checkpoint)
    computed = run("extend", Gathered(), source, options)
    return Extension(computed, (geodesic,))


def transport(
    geodesic: Source,
    variation: Image,
    *,
    spacing: Any = None,
    affine: Any = None,
    config: Optional[File] = None,
    checkpoint: Optional[Checkpoint] = None,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
    trust: bool = False,
    **options: Any,
) -> Transport:
    """Transports a variation of the first shape of a geodesic in parallel to the last.

    ``variation`` is the mask of a shape near the first one, of the same size."""
    given = Gathered()
    inputs = {
        "geodesic": _from(geodesic, Geodesic, "a geodesic"),
        "variation": given.image(variation, "variation", spacing, affine),
    }
    run = _Run(progress, threads, trust=trust, config=config, checkpoint=checkpoint)
    computed = run("transport", given, inputs, options)
    return Transport(computed, (geodesic,))


def warp(
    result: Source,
    image: Image,
    *,
    shape: Optional[int] = None,
    to_shape: Optional[int] = None,
    time: Optional[float] = None,
    from_time: Optional[float] = None,
    scores: Sequence[float] = (),
    inverse: bool = False,
    refine: int = 1,
    interpolation: Optional[str] = None,
    affine: Any = None,
    threads: Optional[int] = None,
    trust: bool = False,
) -> Any:
    """Carries an image or points from one shape of a result to another, or back (``inverse``).

    Of an average, from the input ``shape`` to the average, or to the input ``to_shape``; of a geodesic
    or of a path of given shapes, from ``from_time`` (0 unless stated) to ``time``; of modes, from the
    average to the shape of these ``scores``; of a shape of given scores, from the average to the shape.

    An array of shape ``(n, 2)``, or ``(n, 3)`` for volumes, has points: the result has where they go, in
    the world (millimetres) where the inputs have a place there, else in samples of the input or in
    coordinates of the result. Everything else is an image: of volumes with a place in the world, with its
    ``affine`` for an array, the result is an array with the axes of nibabel (x first) and its affine map.
    Other images have the samples of the input, or the nodes of the grid, between which there are
    ``refine - 1`` others; the result is an array, of which x is the last axis.

    ``interpolation`` is "nearest" for labels, which are whole numbers of which there are few or most
    neighbours are equal, and "linear" for other images, unless it is given.
    """
    folder = _from(result, Result, "a result")
    shapes = (shape, to_shape, time, from_time, [float(score) for score in scores])
    points = None if affine is not None else _points(image)
    if points is not None:
        moved = _shapespace.warp_points(
            folder, points.tolist(), shapes=shapes, inverse=inverse, trust=trust
        )
        return np.array(moved).reshape(points.shape)
    given = Gathered()
    name = given.image(image, "image", None, affine)
    values, rows = _shapespace.warp_image(
        folder,
        name,
        given.arrays,
        shapes=shapes,
        inverse=inverse,
        refine=refine,
        trust=trust,
        interpolation=interpolation,
        threads=threads,
    )
    if values.ndim == 2 or (affine is None and isinstance(image, np.ndarray)):
        return values
    return values.T, np.vstack([np.array(rows), [0.0, 0.0, 0.0, 1.0]])


def _points(image: Any) -> Optional[np.ndarray]:
    """Points as rows, if these are points and no image."""
    if isinstance(image, (np.ndarray, list, tuple)):
        array = np.asarray(image, float)
        if array.ndim == 2 and array.shape[1] in (2, 3):
            return array
    return None


class Verification:
    """The results of the experiments that check the theory."""

    def __init__(self, verified: _shapespace.Verified) -> None:
        self._verified = verified
        #: The contents of ``result.json``.
        self.record: dict[str, Any] = json.loads(verified.record())

    def __bool__(self) -> bool:
        """Whether every statement holds, or, with a broken ingredient, is refuted."""
        return self._verified.is_well()

    def __repr__(self) -> str:
        n = len(self.record["statements"])
        return f"<Verification of {n} statements: {'well' if self else 'NOT well'}>"

    def __str__(self) -> str:
        return self._verified.table()

    def save(self, folder: "str | os.PathLike[str]") -> str:
        """Writes the result directory of the command line, which must not exist."""
        return self._verified.save(os.fspath(folder))


def verify(
    *names: str,
    quick: bool = False,
    broken: bool = False,
    progress: Optional[Progress] = None,
    threads: Optional[int] = None,
) -> Verification:
    """Runs numerical experiments that check the theory: all, or those of these names or themes.

    Ctrl-C ends the wait, and no other experiment begins; those that have begun end by themselves."""
    verified = _shapespace.verify(
        list(names), quick=quick, broken=broken, threads=threads, progress=progress
    )
    return Verification(verified)
