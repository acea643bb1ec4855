"""Measures points of one pair of image files. The root of `measure`."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from common.orientation import Orientation
from phone_host.measure.trust import Concern
from phone_host.run.seen_pair import MissedPoint, Outcome, Point, SeenPair, seen_pair
from phone_host.run.stereo_job import Watcher
from phone_host.run.stereo_trust import judge_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, open_image, require_same_size
from phone_host.stereo.rectify import rectify_points
from phone_host.stereo.rig_errors import Known

Size = tuple[int, int]

ELSEWHERE: Final = "choose a point on a surface with texture, away from its edges and not too far"
"""What helps a point that cannot be measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointJob:
    """What to measure.

    Attributes:
        left: image file of the left camera.
        right: image file of the right camera.
        points_px: x and y of points in the upright left image, px.
        make_core: makes the stereo core for images of this size (width and height of the left one, px).
        most_pixels: an image that claims more is refused.
        mounted: by which turns the images become upright, after what their EXIF headers say.
    """

    left: Path
    right: Path
    points_px: tuple[Point, ...]
    make_core: Callable[[Size], StereoCore]
    most_pixels: int
    mounted: tuple[Orientation, Orientation]


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """What was measured.

    Attributes:
        points: one for each point asked for, in their order; one at least was found.
        known: what of the rig's own uncertainty was reckoned with.
        doubts: reasons not to trust it that do not rule it out.
    """

    points: tuple[Outcome, ...]
    known: Known
    doubts: tuple[Concern, ...]


def measure_points(job: PointJob, watcher: Watcher) -> Measured:
    """Measure points.

    Args:
        job: what to measure.
        watcher: is told how far it is.

    Raises:
        SettingsError: a point lies outside the left image.
        DataError: the pair cannot be computed, cannot be right, or none of the points can be measured.
    """
    watcher.say("reading")
    opened = tuple(
        open_image(path, job.most_pixels, turn) for path, turn in zip((job.left, job.right), job.mounted, strict=True)
    )
    left_px, right_px = (image.size_px for image in opened)
    for point in job.points_px:
        if not all(0 <= at <= size - 1 for at, size in zip(point, left_px, strict=True)):
            raise SettingsError(
                f"--points {point_text(point)} lies outside the left image of {size_text(left_px)} px",
                "give X,Y inside it; the centre of the first pixel is 0,0",
            )
    core = job.make_core(left_px)
    if core.rig is None:
        require_same_size(left_px, right_px, str(job.left), str(job.right))
    core.require_sizes(left_px, right_px)
    images = decode_files(opened[0], opened[1], core.reductions(left_px, right_px))
    watcher.say("matching")
    processed = core.compute(*images, now.monotonic_ns, whole_px=(left_px, right_px))
    seen = seen_pair(core, processed)
    if seen is None:
        raise SettingsError("there are no millimetres without focal length and baseline", "give --calibration")
    watcher.say("checking")
    concerns = judge_pair(core, processed, job.mounted).concerns
    blocking = next((concern for concern in concerns if concern.doubt.blocks), None)
    if blocking is not None:
        why = f"these images cannot be measured, because {blocking.sentence} ({blocking.remedy})"
        raise DataError(why, "mend that, then measure again")
    watcher.say("measuring")
    points = tuple(_measured(point, seen) for point in job.points_px)
    _require_one(job.points_px, points)
    return Measured(points, seen.errors.known, concerns)


def _require_one(asked_px: tuple[Point, ...], points: tuple[Outcome, ...]) -> None:
    """Raise unless a point was measured."""
    missed = [each.problem for each in points if isinstance(each, MissedPoint)]
    if len(missed) == len(points):
        said = "; ".join(f"{point_text(at_px)} {why}" for at_px, why in zip(asked_px, missed, strict=True))
        raise DataError(f"--points {said}", ELSEWHERE)


def point_text(point_px: Point) -> str:
    """Return a point as the user writes it: X,Y."""
    return f"{point_px[0]:g},{point_px[1]:g}"


def _measured(asked_px: Point, seen: SeenPair) -> Outcome:
    rectifier = seen.rectifier
    if rectifier is None:
        return seen.measured(asked_px)
    turn = rectifier.rectification.R_left
    [(x, y)] = rectify_points(np.array([asked_px]), rectifier.rig.left, turn, seen.geometry).tolist()
    return seen.measured((x, y))
