"""Exceptions, with the text of the reports of the command line."""

from __future__ import annotations

from typing import Any, Sequence

_COMPUTATION = 1


class ShapespaceError(Exception):
    """What went wrong, its causes, and in the last line what to do about it."""

    def __init__(self, message: str = "", causes: Sequence[str] = (), help: str = "") -> None:
        #: The error in one line.
        self.message = message
        #: What caused it, outermost first.
        self.causes = tuple(causes)
        #: What to do about it.
        self.help = help
        lines = [message, *self.causes]
        if help:
            lines.append(f"help: {help}")
        super().__init__("\n".join(lines))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.causes, self.help)


class InputError(ShapespaceError, ValueError):
    """An input or an option that cannot be used."""


class ComputationError(ShapespaceError, RuntimeError):
    """A computation that failed."""


def of_report(causes: Sequence[str], help: str, exit_code: int) -> ShapespaceError:
    """The exception for a report of the command line, which ends with this code."""
    kind = ComputationError if exit_code == _COMPUTATION else InputError
    message, *rest = causes
    return kind(message, rest, help)
