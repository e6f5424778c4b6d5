"""Inputs of any kind as what the library takes: paths, and named arrays whose last axis is x.

An affine map sends the indices of an array, in the order of its axes, to the world: millimetres to
the right, to the front, and upwards (RAS), as in nibabel.
"""

from __future__ import annotations

import os
import sys
from typing import Any, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from ._errors import InputError
from ._shapespace import check_size

#: An image: an array, the name of a file, or an image of nibabel or SimpleITK.
Image = Any
#: Several images, or one array of them, or a dictionary that names them.
Images = Union[Sequence[Image], Mapping[str, Image], np.ndarray]
#: Name, array, spacing and affine map, both x first.
Given = Tuple[str, np.ndarray, Optional[List[float]], Optional[List[List[float]]]]

#: Array with x last, spacing and affine map with x first.
_Taken = Tuple[np.ndarray, Optional[List[float]], Optional[List[List[float]]]]

_LENGTHS = {"meter": 1e3, "micron": 1e-3}
#: SimpleITK counts to the left and to the back.
_TO_RAS = np.diag([-1.0, -1.0, 1.0])


class Gathered:
    """The inputs of one call."""

    def __init__(self) -> None:
        self.arrays: list[Given] = []

    def images(
        self,
        images: Images,
        spacing: Any = None,
        affine: Any = None,
        names: Optional[Iterable[str]] = None,
        kind: str = "mask",
    ) -> list[str]:
        """The names of several inputs."""
        if isinstance(images, Mapping):
            if names is not None:
                raise TypeError("a dictionary names its images: leave out names")
            names, images = list(images.keys()), list(images.values())
        elif isinstance(images, (str, os.PathLike)):
            raise TypeError("give a list of images; one path is not a list")
        images = list(images)
        named = [f"{kind}_{k:03}" for k in range(len(images))] if names is None else list(names)
        if len(named) != len(images):
            raise InputError(f"there are {len(named)} names for {len(images)} images")
        if len(set(map(str, named))) != len(named):
            raise InputError("the names of the images must differ", help="rename one of two")
        spacings = _for_each(spacing, len(images), 1, "spacing")
        affines = _for_each(affine, len(images), 2, "affine")
        return [
            self.image(image, str(name), s, a)
            for image, name, s, a in zip(images, named, spacings, affines)
        ]

    def image(self, image: Image, name: str, spacing: Any = None, affine: Any = None) -> str:
        """The name of one input."""
        if isinstance(image, (str, os.PathLike)):
            if spacing is not None or affine is not None:
                raise InputError(
                    f"'{os.fspath(image)}' is a file, which states its own spacing and place",
                    help="leave out spacing and affine, or read the file and give its array",
                )
            return os.fspath(image)
        array, own_spacing, own_affine = _taken_apart(image, spacing, affine)
        array = np.asarray(array)
        check_size(name, array.shape)
        if array.dtype == np.float16:
            array = array.astype(np.float32)
        if not array.dtype.isnative:
            array = array.astype(array.dtype.newbyteorder("="))
        self.arrays.append((name, np.ascontiguousarray(array), own_spacing, own_affine))
        return name


def _for_each(value: Any, n: int, axes: int, what: str) -> List[Any]:
    """One value for all images, or one for each."""
    if value is None:
        return [None] * n
    single = isinstance(value, (int, float)) or np.ndim(value[0]) == axes - 1
    if single:
        return [value] * n
    values = list(value)
    if len(values) != n:
        raise InputError(f"there are {len(values)} values of {what} for {n} images")
    return values


def _taken_apart(image: Any, spacing: Any, affine: Any) -> _Taken:
    """The array with x last, its spacing with x first, its affine map with x first."""
    module = type(image).__module__.split(".")[0]
    if hasattr(image, "dataobj") and hasattr(image, "affine"):
        return _of_nibabel(image)
    if module == "SimpleITK":
        return _of_simpleitk(image)
    array = np.asarray(image)
    if spacing is not None:
        spacing = _along_axes(spacing, array.ndim)
    if affine is None:
        # The axes of a plain array: the last is x.
        return array, spacing[::-1] if spacing is not None else None, None
    # The axes of a volume with an affine map: the first is x.
    return array.T, spacing, _rows(affine)


def _along_axes(spacing: Any, axes: int) -> List[float]:
    """The distances of samples along all axes, of one for all or one for each."""
    distances = np.asarray(spacing, float)
    if distances.ndim > 0 and distances.shape != (axes,):
        raise InputError(
            f"a spacing of {distances.size} numbers cannot be used for an array of {axes} axes",
            help="give one number for all axes, or one for each, in their order",
        )
    found: List[float] = np.broadcast_to(distances, (axes,)).tolist()
    return found


def _of_nibabel(image: Any) -> _Taken:
    array = np.asanyarray(image.dataobj)
    affine: Optional[np.ndarray] = np.array(image.affine, float)
    header = image.header
    zooms = [float(z) for z in header.get_zooms()]
    unit = 1.0
    if hasattr(header, "get_xyzt_units"):
        unit = _LENGTHS.get(header.get_xyzt_units()[0], 1.0)
        if int(header["sform_code"]) <= 0 and int(header["qform_code"]) <= 0:
            # nibabel makes one up.
            affine = None
    while array.ndim > 2 and array.shape[-1] == 1:
        array = array[..., 0]
    spacing = [unit * zoom for zoom in zooms[: array.ndim]]
    return array.T, spacing, None if affine is None else _rows(np.array(affine) * unit)


def _of_simpleitk(image: Any) -> _Taken:
    itk = sys.modules["SimpleITK"]
    array = itk.GetArrayViewFromImage(image)
    n, spacing = image.GetDimension(), [float(h) for h in image.GetSpacing()]
    if n != 3:
        return array, spacing, None
    direction = np.array(image.GetDirection()).reshape(3, 3)
    affine = np.empty((3, 4))
    affine[:, :3] = _TO_RAS @ direction @ np.diag(spacing)
    affine[:, 3] = _TO_RAS @ np.array(image.GetOrigin())
    return array, spacing, _rows(affine)


def _rows(affine: Any) -> List[List[float]]:
    rows = np.asarray(affine, float)
    if rows.shape not in [(4, 4), (3, 4)]:
        raise InputError(
            f"an affine map of shape {rows.shape} cannot be used",
            help="give a matrix of four rows and four columns, or its first three rows",
        )
    # No zero with a sign.
    found: List[List[float]] = (rows[:3] + 0.0).tolist()
    return found
