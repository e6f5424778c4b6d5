"""The compiled module; its functions are called by those of the package."""

from typing import Any, Callable, Optional, Sequence

import numpy as np

__version__: str

_Given = tuple[str, np.ndarray, Optional[Sequence[float]], Optional[Sequence[Sequence[float]]]]

class Computed:
    def take_arrays(self) -> dict[str, np.ndarray]: ...
    def record(self) -> str: ...
    def summary(self) -> str: ...
    def save(self, folder: str, drawn: bool) -> str: ...

class Verified:
    def record(self) -> str: ...
    def table(self) -> str: ...
    def is_well(self) -> bool: ...
    def save(self, folder: str) -> str: ...

def run(
    command: str,
    options: str,
    arrays: Sequence[_Given],
    *,
    config: Optional[str],
    checkpoint: Optional[tuple[str, float]],
    threads: Optional[int],
    memory: Optional[str],
    at_once: Optional[int],
    trust: bool,
    progress: Optional[Callable[[Any], object]],
) -> Computed: ...
def verify(
    names: Sequence[str],
    *,
    quick: bool,
    broken: bool,
    threads: Optional[int],
    progress: Optional[Callable[[Any], object]],
) -> Verified: ...
def check_size(name: str, shape: Sequence[int]) -> None: ...
def commands() -> list[str]: ...
def keys(command: str) -> list[str]: ...
_Shapes = tuple[
    Optional[int], Optional[int], Optional[float], Optional[float], Sequence[float]
]

def warp_points(
    result: str,
    points: Sequence[Sequence[float]],
    *,
    shapes: _Shapes,
    inverse: bool,
    trust: bool,
) -> list[list[float]]: ...
def warp_image(
    result: str,
    name: str,
    arrays: Sequence[_Given],
    *,
    shapes: _Shapes,
    inverse: bool,
    refine: int,
    trust: bool,
    interpolation: Optional[str],
    threads: Optional[int],
) -> tuple[np.ndarray, list[list[float]]]: ...
