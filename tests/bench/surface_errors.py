"""How far the surface that some poses give is from the one that the given poses give: mean and 95th percentile, after rigid registration."""

from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.mesh import Mesh, mesh_of, without_crumbs
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import LEAST_WEIGHT, VolumeSettings
from tests.bench.scan_clips import Clip

Floats = NDArray[np.float64]

_POINTS: Final = 20_000
_ROUNDS: Final = ((0.1, 10), (0.05, 30))
"""Farthest partners, m, and steps with them."""

_ROBUST_M: Final = 0.01
_KD_TREE: Final[dict[str, bool | int | float | str]] = {"algorithm": 4}
_EXACT: Final[dict[str, bool | int | float | str]] = {"checks": -1}


class Surface:
    """Points of a mesh, their normals, and which is nearest."""

    def __init__(self, mesh: Mesh) -> None:
        self.points_m = mesh.points_m.astype(np.float64)
        corners = self.points_m[mesh.triangles]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.zeros_like(self.points_m)
        for corner in range(3):
            np.add.at(normals, mesh.triangles[:, corner], faces)
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        self._packed = mesh.points_m.astype(np.float32)  # the tree does not copy them
        self._tree = cv2.flann.Index(self._packed, _KD_TREE)

    def nearest(self, points_m: Floats) -> tuple[Floats, Floats]:
        """Return the ways to the nearest points (N, 3), m, and the normals there."""
        found, _ = self._tree.knnSearch(np.ascontiguousarray(points_m, np.float32), 1, params=_EXACT)
        numbers = np.asarray(found)[:, 0]
        return self.points_m[numbers] - points_m, self.normals[numbers]

    def distances_m(self, points_m: Floats, aside_m: float) -> Floats:
        """Return how far points (N, 3), m, lie from the plane through the nearest one, or from that itself where it is farther aside than `aside_m`."""
        ways, normals = self.nearest(points_m)
        off, away = np.abs((ways * normals).sum(axis=1)), np.linalg.norm(ways, axis=1)
        aside = np.sqrt(np.maximum(away**2 - off**2, 0))
        return np.asarray(np.where(aside < aside_m, off, away), np.float64)


def surface_errors(clip: Clip, poses: Sequence[SE3], settings: VolumeSettings, threads: int) -> tuple[float, float]:
    """Compare the surface of a clip's views at some poses with that at the given ones.

    Args:
        clip: with the given poses.
        poses: others.
        settings: of both volumes.
        threads: that fuse.

    Returns:
        Mean distance, and that which 95 % of the points keep, mm: to the surface through the nearest point, where that is no farther than a voxel aside.
    """
    given, found = (Surface(mesh_at(clip, each, settings, threads)) for each in (clip.truth, poses))
    points = registered(given, found.points_m, _by_places(poses, clip.truth)).apply(found.points_m)
    distances = given.distances_m(points, settings.voxel_m)
    return 1e3 * float(distances.mean()), 1e3 * float(np.percentile(distances, 95))


def mesh_at(clip: Clip, poses: Sequence[SE3], settings: VolumeSettings, threads: int) -> Mesh:
    """Return the surface that a clip's views give at some poses."""
    volume = Volume(settings, threads)
    for view, pose in zip(clip.views, poses, strict=True):
        volume.fuse(view, pose)
    return without_crumbs(mesh_of(volume.blocks, settings.voxel_m, LEAST_WEIGHT))


def _by_places(found: Sequence[SE3], truth: Sequence[SE3]) -> SE3:
    """Return the motion that takes the found places nearest to the true ones (Umeyama, without scale)."""
    here, there = (np.array([pose.t_m for pose in poses]) for poses in (found, truth))
    left, _, right = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    return SE3(turn, there.mean(axis=0) - turn @ here.mean(axis=0))


def registered(given: Surface, points_m: Floats, start: SE3) -> SE3:
    """Return the motion that lays points on a surface, point to plane."""
    some, motion = points_m[:: max(len(points_m) // _POINTS, 1)], start
    for most_m, steps in _ROUNDS:
        for _ in range(steps):
            points = motion.apply(some)
            ways, normals = given.nearest(points)
            off = (ways * normals).sum(axis=1)
            weights = (np.linalg.norm(ways, axis=1) < most_m) / (1 + (off / _ROBUST_M) ** 2)
            slopes = np.concatenate([np.cross(points, normals), normals], axis=1)
            weighted = slopes * weights[:, np.newaxis]
            motion = SE3.of(np.linalg.solve(slopes.T @ weighted, weighted.T @ off)) @ motion
    return motion
