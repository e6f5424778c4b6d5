"""What a ``progress`` callback hears."""

from __future__ import annotations

from typing import Callable, NamedTuple, Union


class Stage(NamedTuple):
    """A stage has begun, such as ``level 2 of 5, 65 nodes a side``."""

    name: str

    def __str__(self) -> str:
        return self.name


class Iteration(NamedTuple):
    """An iteration of a minimiser. Of many within 50 milliseconds, the last is told."""

    iteration: int
    evaluations: int
    energy: float

    def __str__(self) -> str:
        return f"iteration {self.iteration}, energy {self.energy:.6e}"


class Note(NamedTuple):
    """A note, such as the work of a finished level, or a warning."""

    text: str

    def __str__(self) -> str:
        return self.text


Event = Union[Stage, Iteration, Note]
#: ``progress=print`` is one.
Progress = Callable[[Event], object]
