"""Shapes that the tests draw."""

import numpy as np


def ellipse(n=33, centre=(0.5, 0.5), axes=(0.3, 0.2), angle=0.0):
    """An ellipse in a picture of n samples a side."""
    t = (np.arange(n) + 0.5) / n
    y, x = np.meshgrid(t, t, indexing="ij")
    x, y = x - centre[0], y - centre[1]
    c, s = np.cos(angle), np.sin(angle)
    return ((c * x + s * y) / axes[0]) ** 2 + ((c * y - s * x) / axes[1]) ** 2 < 1


def ellipses(n=33):
    """Three ellipses that differ in both axes."""
    return [
        ellipse(n, axes=(0.30, 0.20)),
        ellipse(n, axes=(0.24, 0.26)),
        ellipse(n, axes=(0.33, 0.28)),
    ]


def ellipsoid(n=15, axes=(0.3, 0.25, 0.2), centre=(0.5, 0.5, 0.5)):
    """An ellipsoid; the last axis of the array is x."""
    t = (np.arange(n) + 0.5) / n
    z, y, x = np.meshgrid(t, t, t, indexing="ij")
    parts = [(p - c) / a for p, c, a in zip((x, y, z), centre, axes)]
    return sum(p**2 for p in parts) < 1


def disc_image(n=33, radius=0.3):
    """A bright disc on a dark ground, with a slope that is no edge."""
    t = (np.arange(n) + 0.5) / n
    y, x = np.meshgrid(t, t, indexing="ij")
    disc = (x - 0.5) ** 2 + (y - 0.5) ** 2 < radius**2
    return (60 + 120 * disc + 20 * x).astype(np.uint8)
