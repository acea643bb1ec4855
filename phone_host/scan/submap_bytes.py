"""A submap as bytes, and back: its part of the field, and what became of its pairs. Pure."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.imagesize.head import MOST_SIDE_PX
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.field_bytes import Arrays, KeptField, arrays_of, field_in, packed, unpacked
from phone_host.scan.mat_pose import MatSaid, MatScale
from phone_host.scan.places import Place
from phone_host.scan.scanned import ScannedPair, Submap
from phone_host.scan.tracker import TrackerState
from phone_host.scan.tracking_words import Tracking, Weakness

_HEAD: Final = b"tandemscan submap 5\n"
_MAT_VALUES: Final = 6
_RIGID: Final = 1e-4
_FARTHEST_M: Final = 1e5
"""Lengths of a pose that no scan has: how far a rotation may be from one, and 100 km."""


def submap_bytes(submap: Submap) -> bytes:
    """Return a submap as bytes."""
    pairs, places, of = submap.pairs, submap.tracker.places, submap.geometry
    own = {
        "is_whole": np.array(submap.is_whole),
        "names": np.array([pair.name for pair in pairs], np.str_),
        "states": np.array([pair.state.value for pair in pairs], np.str_),
        "weaknesses": np.array([pair.weakness.value for pair in pairs], np.str_),
        "numbers": np.array(
            [(pair.stamp_s, pair.density, pair.corners, pair.overlap, pair.off_m) for pair in pairs], np.float64
        ),
        "followed": np.array([pair.is_followed for pair in pairs], np.bool_),
        "poses": _rows([pair.world_camera for pair in pairs]),
        "mats": np.array([_mat_row(pair.mat) for pair in pairs], np.float64).reshape(-1, _MAT_VALUES),
        "geometry": np.array([of.focal_px, of.baseline_m, of.cx_px, of.cy_px, of.doffs_px], np.float64),
        "size_px": np.array(submap.size_px),
        "pose": _rows([submap.tracker.pose]),
        "usual_off_sigmas": np.array(submap.tracker.usual_off_sigmas),
        "place_poses": _rows([place.world_camera for place in places]),
        "place_sizes": np.array([len(place.points_m) for place in places], np.int64),
        "place_points": np.concatenate([np.zeros((0, 3)), *(place.points_m for place in places)]),
        "descriptors": np.concatenate([np.zeros((0, 32), np.uint8), *(place.descriptors for place in places)]),
    }
    return packed(_HEAD, arrays_of(KeptField(submap.settings, submap.blocks, submap.carved)) | own)


def submap_of(content: bytes, name: str) -> Submap:
    """Read a submap.

    Raises:
        DataError: it is damaged, or no submap.
    """
    refusal = DataError(
        f"{name} is damaged, or no submap of this version",
        "remove it and those with higher numbers, to go on from the one before; without any, begin a new scan",
    )
    return unpacked(content, _HEAD, _read, refusal)


def _read(held: Arrays) -> Submap:
    field, count = field_in(held), len(held["names"])
    focal_px, baseline_m, cx_px, cy_px, doffs_px = held["geometry"].tolist()
    width_px, height_px = held["size_px"].tolist()
    if not (np.isfinite(held["geometry"]).all() and focal_px > 0 and baseline_m > 0):
        raise ValueError("impossible geometry")
    if not (0 < int(width_px) <= MOST_SIDE_PX and 0 < int(height_px) <= MOST_SIDE_PX):
        raise ValueError("impossible size")
    numbers = held["numbers"].reshape(count, 5).tolist()
    pairs = tuple(
        ScannedPair(
            name=str(held["names"][at]),
            stamp_s=stamp_s,
            world_camera=pose,
            state=Tracking(str(held["states"][at])),
            weakness=Weakness(str(held["weaknesses"][at])),
            density=density,
            corners=int(corners),
            overlap=overlap,
            off_m=off_m,
            mat=_mat_of(held["mats"][at]),
            is_followed=bool(held["followed"][at]),
        )
        for at, ((stamp_s, density, corners, overlap, off_m), pose) in enumerate(
            zip(numbers, _poses(held["poses"]), strict=True)
        )
    )
    return Submap(
        is_whole=bool(held["is_whole"]),
        pairs=pairs,
        settings=field.settings,
        geometry=StereoGeometry(focal_px=focal_px, baseline_m=baseline_m, cx_px=cx_px, cy_px=cy_px, doffs_px=doffs_px),
        size_px=(width_px, height_px),
        blocks=field.blocks,
        tracker=TrackerState(_poses(held["pose"])[0], float(held["usual_off_sigmas"]), _places(held)),
        carved=field.carved,
    )


def _places(held: Arrays) -> tuple[Place, ...]:
    if not np.isfinite(held["place_points"]).all():
        raise ValueError("impossible points")
    ends = np.cumsum(held["place_sizes"])[:-1]
    points, descriptors = np.split(held["place_points"], ends), np.split(held["descriptors"], ends)
    poses = _poses(held["place_poses"])
    if not poses:
        return ()
    return tuple(Place(*each) for each in zip(poses, points, descriptors, strict=True))


def _mat_row(mat: MatSaid | None) -> list[float]:
    if mat is None:
        return [math.nan] * _MAT_VALUES
    return [*mat.seen, mat.rms_px, mat.sigma_m, mat.scale.value, mat.scale.sigma]


def _mat_of(row: NDArray[np.float64]) -> MatSaid | None:
    left, right, rms_px, sigma_m, value, sigma = row.tolist()
    return None if math.isnan(left) else MatSaid((int(left), int(right)), rms_px, sigma_m, MatScale(value, sigma))


def _rows(poses: list[SE3]) -> NDArray[np.float64]:
    """Return (N, 3, 4) matrices, exact to the last bit."""
    return np.array([np.column_stack([pose.R, pose.t_m]) for pose in poses], np.float64).reshape(-1, 3, 4)


def _poses(rows: NDArray[np.float64]) -> list[SE3]:
    """Return poses.

    Raises:
        ValueError: one is no rigid motion, or of a length that no scan has.
    """
    rotations = rows[:, :, :3]
    are_rigid = np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=_RIGID)
    if not (are_rigid and np.all(np.abs(rows[:, :, 3]) < _FARTHEST_M)):
        raise ValueError("impossible poses")
    return [SE3(row[:, :3].copy(), row[:, 3].copy()) for row in rows]
