"""The sequences of $SCAN_DATA as views with true poses: a street, a room by a depth camera, a rig at rest."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image, RectifiedPair, StereoGeometry
from phone_host.output.rig_files.imported import import_rig
from phone_host.scan.view import View
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier

STREET_NOISE_PX = 0.7
"""Of `tandem` on the street; measured as the spread of the disparities' errors in the sliding window."""

_STREET_DISPARITIES = 96
_KINECT = StereoGeometry(focal_px=585.0, baseline_m=0.075, cx_px=320.0, cy_px=240.0)
_KINECT_NOISE_PX = 0.11
"""2.5 mm at 1 m."""

_KINECT_PATCH_PX = 5.0

_INVALID = 65535


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Views and where they were taken."""

    views: tuple[View, ...]
    truth: tuple[SE3, ...]

    def only(self, chosen: Sequence[int]) -> "Clip":
        """Return some of the views."""
        return Clip(tuple(self.views[at] for at in chosen), tuple(self.truth[at] for at in chosen))


@dataclass(frozen=True, slots=True, eq=False)
class Street:
    """The same way as the left camera sees it, and as the right one does, in a mirror."""

    left: Clip
    mirrored: Clip
    baseline_m: float


def street_pairs(data: Path) -> list[tuple[Image, Image]]:
    """The rectified images of KITTI_sequence_1, left and right."""
    folder = data / "kitti_odometry_clips" / "KITTI_sequence_1"
    files = (sorted((folder / name).iterdir()) for name in ("image_l", "image_r"))
    return [(_grey(left), _grey(right)) for left, right in zip(*files, strict=True)]


def street(data: Path) -> Street:
    """KITTI_sequence_1: 24 rectified pairs."""
    folder = data / "kitti_odometry_clips" / "KITTI_sequence_1"
    left, right = np.loadtxt(folder / "calib.txt").reshape(-1, 3, 4)[:2]
    focal_px, cx_px, cy_px = (float(left[at]) for at in ((0, 0), (0, 2), (1, 2)))
    geometry = StereoGeometry(focal_px=focal_px, baseline_m=-float(right[0, 3]) / focal_px, cx_px=cx_px, cy_px=cy_px)
    pairs = street_pairs(data)
    truth = tuple(
        SE3(rows[:, :3], rows[:, 3]) for rows in np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)[: len(pairs)]
    )
    width = pairs[0][0].shape[1]
    turned = replace(geometry, cx_px=width - 1 - geometry.cx_px)
    mirrored = [(np.ascontiguousarray(there[:, ::-1]), np.ascontiguousarray(here[:, ::-1])) for here, there in pairs]
    return Street(
        Clip(tuple(matched(here, there, geometry) for here, there in pairs), truth),
        Clip(tuple(matched(here, there, turned) for here, there in mirrored), truth),
        geometry.baseline_m,
    )


def matched(left: Image, right: Image, geometry: StereoGeometry) -> View:
    """A rectified pair as a view."""
    matcher = create_matcher(MatchSettings(MatcherName.TANDEM, _STREET_DISPARITIES))
    disparity = matcher.match(RectifiedPair(left, right))
    product = np.float32(geometry.focal_px * geometry.baseline_m)
    depth = product / np.where(disparity > 0, disparity, np.float32(np.nan))
    return View(
        grey=left,
        colours=np.repeat(left[..., np.newaxis], 3, axis=2),
        depth_m=depth.astype(np.float32),
        geometry=geometry,
        noise_px=STREET_NOISE_PX,
    )


def rest_pairs(data: Path) -> tuple[list[RectifiedPair], StereoGeometry]:
    """The rectified images of euroc_v101_static, and their geometry."""
    folder = data / "euroc_v101_static"
    rectifier = Rectifier(import_rig((folder,)).rig)
    files = (sorted((folder / "mav0" / name / "data").iterdir()) for name in ("cam0", "cam1"))
    pairs = [rectifier.rectify(_grey(left), _grey(right)) for left, right in zip(*files, strict=True)]
    return pairs, rectifier.geometry


def at_rest(data: Path) -> Clip:
    """euroc_v101_static: 12 pairs of a rig that does not move."""
    pairs, geometry = rest_pairs(data)
    views = tuple(matched(pair.left, pair.right, geometry) for pair in pairs)
    return Clip(views, tuple(SE3.identity() for _ in views))


def unmirrored(pose: SE3, baseline_m: float) -> SE3:
    """A pose of the mirrored right camera as one of the left camera."""
    mirror, aside = np.diag([-1.0, 1.0, 1.0]), SE3(np.eye(3), np.array([baseline_m, 0.0, 0.0]))
    return aside @ SE3(mirror @ pose.R @ mirror, mirror @ pose.t_m) @ aside.inverse()


def room(data: Path) -> Clip:
    """rgbd_7scenes_clipA: 120 frames of a depth camera."""
    folder, views, truth = data / "rgbd_7scenes_clipA", [], []
    for path in sorted(folder.glob("frame-*.color.jpg")):
        stem = path.name.removesuffix(".color.jpg")
        colours = cv2.imread(str(path))
        stored = cv2.imread(str(folder / f"{stem}.depth.png"), cv2.IMREAD_UNCHANGED)
        if colours is None or stored is None:
            raise FileNotFoundError(path)
        depth = np.where((stored == 0) | (stored == _INVALID), np.float32(np.nan), stored.astype(np.float32) / 1000)
        pose = np.loadtxt(folder / f"{stem}.pose.txt")
        left, _, right = np.linalg.svd(pose[:3, :3])
        truth.append(SE3(left @ right, pose[:3, 3]))
        views.append(
            View(
                grey=cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY).astype(np.uint8),
                colours=colours.astype(np.uint8),
                depth_m=depth.astype(np.float32),
                geometry=_KINECT,
                noise_px=_KINECT_NOISE_PX,
                patch_px=_KINECT_PATCH_PX,
            )
        )
    if not views:
        raise FileNotFoundError(folder)
    return Clip(tuple(views), tuple(truth))


def _grey(path: Path) -> NDArray[np.uint8]:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise FileNotFoundError(path)
    return image.astype(np.uint8)
