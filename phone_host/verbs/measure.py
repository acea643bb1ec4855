"""phone-host measure: the distance of points, and between them."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.errors import SettingsError
from common.places import Kind, kind_of
from common.program.commandline import CHECK_FAILED
from common.program.request import Request, option, part
from common.program.terminal import say
from common.versions import REPORT_FORMAT
from phone_host.jobs.depth import DEFAULT_NEAR_MM, OnePairDepthOptions, near_of, point_px
from phone_host.jobs.options import ImageOptions
from phone_host.jobs.picture_pairs import matching_of
from phone_host.output.json_text import json_number, json_text
from phone_host.run.progress_bar import step_bar
from phone_host.run.seen_pair import (
    ELSEWHERE,
    FoundPoint,
    Measured,
    MissedPoint,
    Outcome,
    Point,
    measure_points,
    point_text,
)
from phone_host.stereo.measured_point import Known, Within, distance_between

EXAMPLES = """  phone-host measure left.png right.png --calibration rig.yaml --points 220,220
  phone-host measure left.png right.png --calibration rig.yaml --points 220,220 310,230.5    # and the distance between the two
  phone-host measure im0.png im1.png --calibration calib.txt --points 350,200 --json
"""


_NOISE: Final = "noise of both images"
_RIG: Final = "the rig's calibration (covariance)"
_ZERO: Final = "the rig's zero (zero_sigma)"
_SQUARES: Final = "the size of the board's squares"
_PICKED: Final = "how exactly the points were picked"
_OVERLAY: Final = "how well the overlay is known"
_PARTS: Final = {
    Known.ALL: ([_NOISE, _RIG], [_SQUARES, _PICKED]),
    Known.ZERO: ([_NOISE, _ZERO], ["the baseline's own uncertainty", _PICKED]),
    Known.NOTHING: ([_NOISE], ["the rig's own uncertainty", _PICKED]),
}
"""What the stated uncertainty includes and what it leaves out, by what is known of the rig."""

_EVEN: Final = 0.05
"""Limits that differ by less than this share of themselves are written as one number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureDepthOptions(OnePairDepthOptions):
    """How the pair is matched. Limits and crops would only hide the points that are asked for."""

    near_m: float | None = option(
        "--near",
        read=near_of,
        metavar="MM",
        help=f"look for nothing nearer; 20cm and 0.2m work, too (default: {DEFAULT_NEAR_MM:g} mm)",
    )
    disparities: int | None = option(
        "--disparities", type=int, metavar="N", help="search disparities from 0 to N-1 px (default: as --near needs)"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureRequest(Request):
    """What measure can be told."""

    left: str = option(metavar="LEFT", help="image of the left camera")
    right: str = option(metavar="RIGHT", help="image of the right camera, taken at the same moment")
    depth: MeasureDepthOptions = part(MeasureDepthOptions)
    points_px: tuple[Point, ...] = option(
        "--points",
        read=lambda text, name: point_px(text, name, "X,Y in px, for example 312,240"),
        nargs="+",
        required=True,
        metavar="X,Y",
        help="points of the left image, px, as it is taken and upright; the centre of the first pixel is 0,0. Of several, the distance"
        " from each to the next is told, too. A point that cannot be measured is named, the others are told; the exit code is then 4",
    )
    pictures: ImageOptions = part(ImageOptions, group="pictures")


def run(request: MeasureRequest) -> int:
    """Match the pair, intersect the rays of each point, and print what came of it."""
    for path in (request.left, request.right):
        _require_image(path)
    left, right = Path(request.left), Path(request.right)
    with step_bar("reading", None) as watcher:
        matching = matching_of(request.depth, request.pictures, left)
        found = measure_points(matching, left, right, request.points_px, watcher)
    if request.as_json:
        print(json_text(_report(request, found)))
    else:
        say(_lines(request, found))
    return CHECK_FAILED if any(isinstance(each, MissedPoint) for each in found.points) else 0


def _require_image(path: str) -> None:
    """Refuse a folder, which other commands take.

    Raises:
        SettingsError: it is one.
    """
    with suppress(OSError):  # whoever reads it says what is wrong
        if kind_of(path) is Kind.FOLDER:
            raise SettingsError(
                f"{path} is a folder, and distances are measured in one pair of images",
                "name one left and one right image",
            )


def _parts(request: MeasureRequest, found: Measured) -> tuple[list[str], list[str]]:
    """Return which parts of the uncertainty are included, and which are not."""
    included, left_out = _PARTS[found.known]
    return included, left_out if request.depth.overlay is None else [*left_out, _OVERLAY]


def _report(request: MeasureRequest, found: Measured) -> dict[str, Any]:
    included, left_out = _parts(request, found)
    return {
        "format_version": REPORT_FORMAT,
        "command": "measure",
        "left": request.left,
        "right": request.right,
        "calibration": request.depth.calibration,
        "points": [_point(at_px, outcome) for at_px, outcome in zip(request.points_px, found.points, strict=True)],
        "between": [
            {
                "from_point": number,
                "to_point": number + 1,
                "length_mm": None if length is None else _values(length),
            }
            for number, length in enumerate(_path(found.points), start=1)
        ],
        "uncertainty": {"level": 0.95, "includes": included, "leaves_out": left_out},
        "doubts": [{"sentence": concern.message, "remedy": concern.remedy} for concern in found.doubts],
    }


def _point(at_px: Point, outcome: Outcome) -> dict[str, Any]:
    if isinstance(outcome, MissedPoint):
        return {"at_px": list(at_px), "problem": outcome.problem}
    point = outcome.point
    sigma_m = np.sqrt(np.diag(point.covariance_m2) + np.square(point.rig_m).sum(axis=0))
    return {
        "at_px": list(at_px),
        "distance_mm": _values(point.distance),
        "point_mm": [round(float(value) * 1e3, 3) for value in point.point_m],
        "sigma_mm": [round(float(value) * 1e3, 3) for value in sigma_m],
        "rays_miss_px": round(point.miss_px, 3),
        "noise_factor": round(point.noise_factor, 3),
        "wide_because": None if outcome.wide is None else outcome.wide.value,
    }


def _path(outcomes: Sequence[Outcome]) -> list[Within | None]:
    """Return the distance from each point to the next; None where one of the two is missing."""
    return [
        distance_between(one.point, other.point)
        if isinstance(one, FoundPoint) and isinstance(other, FoundPoint)
        else None
        for one, other in pairwise(outcomes)
    ]


def _values(length: Within) -> dict[str, float | None]:
    limits = {"value": length.value_m, "low": length.low_m, "high": length.high_m}
    return {name: json_number(value * 1e3, 3) for name, value in limits.items()}


def _lines(request: MeasureRequest, found: Measured) -> list[str]:
    included, left_out = _parts(request, found)
    lines = [_line(*each) for each in enumerate(zip(request.points_px, found.points, strict=True), start=1)]
    lines += [
        f"{number} to {number + 1}   {'not measured' if length is None else _text(length)}"
        for number, length in enumerate(_path(found.points), start=1)
    ]
    if any(isinstance(each, MissedPoint) for each in found.points):
        lines.append(f"remedy   {ELSEWHERE}")
    lines += [f"doubt    {concern.message} {concern.remedy}" for concern in found.doubts]
    lines.append(f"95 % of the cases lie between these limits; they include {' and '.join(included)}")
    lines.append(f"not included: {', '.join(left_out)}")
    return lines


def _line(number: int, asked: tuple[Point, Outcome]) -> str:
    at_px, outcome = asked
    head = f"point {number}  at {point_text(at_px)} px"
    if isinstance(outcome, MissedPoint):
        return f"{head}: not measured: it {outcome.problem}"
    x, y, z = outcome.point.point_m * 1e3
    wide = "" if outcome.wide is None else f"; uncertain, because {outcome.wide.value}"
    return f"{head}: {_text(outcome.point.distance)} away; x {x:.1f}, y {y:.1f}, z {z:.1f} mm{wide}"


def _text(length: Within) -> str:
    """Return a length with its limits: as one number where they lie evenly."""
    value, low, high = (each * 1e3 for each in (length.value_m, length.low_m, length.high_m))
    digits = 2 if value - low < 0.1 else 1 if value - low < 10 else 0
    below, above = value - low, high - value
    if above - below <= _EVEN * above:
        return f"{value:.{digits}f} +- {max(below, above):.{digits}f} mm"
    upper = f"{high:.{digits}f} mm" if math.isfinite(high) else "infinity"
    return f"{value:.{digits}f} mm ({low:.{digits}f} mm to {upper})"
