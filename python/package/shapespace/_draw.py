"""Pictures of results with matplotlib, which is imported only here, when it is asked for."""

from __future__ import annotations

import base64
import io
from typing import Any, Sequence

import numpy as np

_BLUE, _INK = "#0072b2", "#222222"


def _axes(ax: Any, size: tuple[float, float] = (4, 4)) -> Any:
    if ax is not None:
        return ax
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("plot() draws with matplotlib: pip install matplotlib") from error
    return plt.figure(figsize=size, layout="constrained").add_subplot()


def _bare(ax: Any) -> Any:
    ax.set_aspect("equal")
    ax.set_xticks([])
    ax.set_yticks([])
    return ax


def _flat(array: np.ndarray) -> np.ndarray:
    """A volume is shown by the plane through the middle."""
    return array if array.ndim == 2 else array[array.shape[0] // 2]


def average(result: Any, ax: Any) -> Any:
    """The average, filled, and the outlines of the inputs in their places."""
    ax = _bare(_axes(ax))
    mask = _flat(result.mask)
    ax.imshow(np.where(mask, 0.75, 1.0), cmap="gray", vmin=0, vmax=1)
    for k, weight in enumerate(result.weights):
        ax.contour(_flat(weight), levels=[0.5], colors=[f"C{k % 10}"], linewidths=0.8)
    ax.contour(mask.astype(float), levels=[0.5], colors=[_INK], linewidths=1.6)
    ax.set_title(f"average of {len(result.names)} shapes, {result.verdict}", fontsize=9)
    return ax


def field(array: np.ndarray, ax: Any) -> Any:
    ax = _bare(_axes(ax))
    ax.imshow(_flat(array), cmap="gray")
    return ax


def row(masks: Sequence[np.ndarray], ax: Any) -> Any:
    """Shapes beside each other."""
    flat = [_flat(mask).astype(float) for mask in masks]
    height = max(shape.shape[0] for shape in flat)
    gap = max(2, height // 20)
    padded = [np.pad(shape, ((0, height - shape.shape[0]), (gap, gap))) for shape in flat]
    ax = _bare(_axes(ax, (2 * len(flat), 2)))
    ax.imshow(1.0 - 0.75 * np.hstack(padded), cmap="gray", vmin=0, vmax=1)
    return ax


def matrix(result: Any, ax: Any) -> Any:
    """The matrix of distances."""
    ax = _axes(ax, (5, 4))
    image = ax.imshow(result.matrix, cmap="viridis")
    new = result.record.get("new_shapes")
    rows = result.names[:new]
    columns = result.names[new or 0 :]
    ax.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    ax.set_yticks(range(len(rows)), rows, fontsize=7)
    ax.figure.colorbar(image, ax=ax, label="distance")
    return ax


def scores(values: np.ndarray, names: Sequence[str], ax: Any) -> Any:
    """The scores in the first two modes."""
    ax = _axes(ax, (5, 4))
    first = values[:, 0]
    second = values[:, 1] if values.shape[1] > 1 else np.zeros(len(values))
    ax.axhline(0, color="0.8", linewidth=0.8)
    ax.axvline(0, color="0.8", linewidth=0.8)
    ax.plot(first, second, "o", color=_BLUE)
    for name, x, y in zip(names, first, second):
        ax.annotate(name, (x, y), textcoords="offset points", xytext=(4, 4), fontsize=7)
    ax.set_xlabel("mode 0 (standard deviations)")
    ax.set_ylabel("mode 1 (standard deviations)")
    return ax


def as_html(result: Any) -> str:
    """The picture for a notebook; nothing without matplotlib."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    figure = Figure(figsize=(5, 4), layout="constrained")
    FigureCanvasAgg(figure)
    try:
        result.plot(figure.add_subplot())
    except NotImplementedError:
        return ""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=90, bbox_inches="tight")
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{result._word}" src="data:image/png;base64,{data}">'
