"""Pairs of a textured slanted plane, rendered without interpolation: the texture is a formula, evaluated where geometry says."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image, RectifiedPair

WAVES = 60
LEVEL, CONTRAST = 128.0, 32.0


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A pair and its exact disparity at the left pixels.

    Attributes:
        pair: uint8 grey.
        disparity_px: (H, W) float64.
    """

    pair: RectifiedPair
    disparity_px: NDArray[np.float64]


def plane(
    *,
    width_px: int = 320,
    height_px: int = 160,
    near_px: float = 20.0,
    slope_x: float = 0.03,
    slope_y: float = 0.01,
    vertical_px: float = 0.0,
    shortest_px: float = 4.0,
    seed: int = 1,
) -> Plane:
    """Render the plane d(x, y) = near + slope_x x + slope_y y.

    The texture T is a sum of random waves. Left(x, y) = T(x, y). A right pixel X sees the left column x with x - d(x, y) = X,
    so x = (X + near + slope_y y) / (1 - slope_x). The right image is `vertical_px` too low.
    """
    rng = np.random.default_rng(seed)
    waves = rng.uniform(-2 * np.pi / shortest_px, 2 * np.pi / shortest_px, (WAVES, 2))
    phases = rng.uniform(0, 2 * np.pi, WAVES)

    def texture(x: NDArray[np.float64], y: NDArray[np.float64]) -> Image:
        level = sum(np.sin(a * x + b * y + p) for (a, b), p in zip(waves, phases, strict=True))
        # A sum of N waves of random phase has the standard deviation sqrt(N / 2).
        return np.asarray(np.clip(np.rint(LEVEL + CONTRAST * level / np.sqrt(WAVES / 2)), 0, 255), np.uint8)

    y, x = np.mgrid[:height_px, :width_px].astype(np.float64)
    seen_y = y - vertical_px
    right = texture((x + near_px + slope_y * seen_y) / (1 - slope_x), seen_y)
    return Plane(RectifiedPair(texture(x, y), right), near_px + slope_x * x + slope_y * y)


def noise(width_px: int, height_px: int, seed: int = 0) -> Image:
    """An image of independent random levels."""
    return np.random.default_rng(seed).integers(0, 256, (height_px, width_px), dtype=np.uint8)
