"""Maps points of a rectified pair to the cameras' own images and back, so that mistakes can be tried out on points. Pure.

A camera that is turned or exchanged is turned or exchanged before the rectification. A test of such a mistake takes the
points back to the camera's own image, undoes the mistake there and rectifies them again.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import project
from phone_host.model import CameraModel, Rectification, Rig, Side
from phone_host.stereo.rectify import rectify_points

Points = NDArray[np.float64]
"""(N, 2) float64: x, y, px."""


class PointMaps(Protocol):
    """The way of a point from a camera's own image to the rectified one."""

    def size_px(self, side: Side) -> tuple[int, int]:
        """Return width and height of a camera's own image, px."""

    def own(self, points_px: Points, side: Side) -> Points:
        """Take points of a rectified image to the camera's own image."""

    def rectified(self, points_px: Points, side: Side) -> Points:
        """Take points of a camera's own image to the rectified image."""


@dataclass(frozen=True, slots=True)
class Unmoved:
    """For images that came rectified: the camera's own image is the rectified one.

    Attributes:
        width_px: width of both images, px.
        height_px: height of both images, px.
    """

    width_px: int
    height_px: int

    def size_px(self, side: Side) -> tuple[int, int]:
        """See PointMaps."""
        del side  # both are alike
        return self.width_px, self.height_px

    def own(self, points_px: Points, side: Side) -> Points:
        """See PointMaps."""
        del side
        return points_px

    def rectified(self, points_px: Points, side: Side) -> Points:
        """See PointMaps."""
        del side
        return points_px


@dataclass(frozen=True, slots=True, eq=False)
class ThroughRig:
    """For images that a rig has rectified.

    Attributes:
        rig: the two cameras.
        rectification: how their images are rotated and cropped.
    """

    rig: Rig
    rectification: Rectification

    def size_px(self, side: Side) -> tuple[int, int]:
        """See PointMaps."""
        model, _ = self._camera(side)
        return model.width_px, model.height_px

    def own(self, points_px: Points, side: Side) -> Points:
        """See PointMaps."""
        model, rotation = self._camera(side)
        geometry = self.rectification.geometry
        slopes = (points_px - np.array([geometry.cx_px, geometry.cy_px])) / geometry.focal_px
        rays = np.column_stack([slopes, np.ones(len(slopes))]) @ rotation  # rows: rotation.T @ ray
        return project(rays, model)

    def rectified(self, points_px: Points, side: Side) -> Points:
        """See PointMaps."""
        model, rotation = self._camera(side)
        if not len(points_px):
            return points_px
        return rectify_points(points_px, model, rotation, self.rectification.geometry)

    def _camera(self, side: Side) -> tuple[CameraModel, NDArray[np.float64]]:
        if side is Side.LEFT:
            return self.rig.left, self.rectification.R_left
        return self.rig.right, self.rectification.R_right


def turned_back(points_px: Points, size_px: tuple[int, int], quarters: int) -> Points:
    """Turn points about the middle of the image, counter-clockwise by a number of quarters.

    Args:
        points_px: (N, 2), px.
        size_px: width and height of the image, px.
        quarters: 0 to 3.
    """
    middle = (np.array(size_px, np.float64) - 1) / 2
    x, y = (points_px - middle).T
    turned: list[tuple[Any, Any]] = [(x, y), (y, -x), (-x, -y), (-y, x)]
    return np.column_stack(turned[quarters % 4]) + middle


def mirrored(points_px: Points, size_px: tuple[int, int]) -> Points:
    """Mirror points left to right.

    Args:
        points_px: (N, 2), px.
        size_px: width and height of the image, px.
    """
    return np.column_stack([size_px[0] - 1 - points_px[:, 0], points_px[:, 1]])
