"""The options about depth. `stereo_core` builds what they ask for."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.imagesize.head import MOST_SIDE_PX
from common.program.quantities import decimal_number
from common.program.request import option, option_of
from phone_host.declared_settings import NEAR_M, PhoneHostSettings
from phone_host.jobs.units import baseline_mm, limit_mm
from phone_host.model import Crop
from phone_host.output.axes import Axes
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.matcher_names import default_words

DEFAULT_NEAR_MM: Final = NEAR_M * 1000
"""Default nearest depth, mm: the near limit of hand-held scanners (Structure Sensor 350 mm, RealSense D435 280 mm).

A nearer limit costs time: the number of disparities is proportional to 1 / z."""

_LEAST_SCALE: Final = 0.1
"""At a tenth of the size a disparity is known ten times worse: the smallest scale that still shows something."""


def _number(text: str) -> float:
    """Return a number, or NaN if the text is none."""
    try:
        return decimal_number(text)
    except ValueError:
        return math.nan


def _pixels(text: str, option: str) -> float:
    value = _number(text.strip().removesuffix("px"))
    if not math.isfinite(value):
        raise SettingsError(f"{option} is {text!r}", "give a number of pixels, for example 994.978")
    return value


def _focal_px(text: str, option: str) -> float:
    value = _pixels(text, option)
    if value <= 0:
        raise SettingsError(f"{option} is {text!r}", "give a number of pixels above 0")
    return value


def point_px(text: str, option: str, example: str = "CX,CY in px, for example 319.5,239.5") -> tuple[float, float]:
    """Read a place in an image: X,Y.

    Args:
        text: what the user wrote.
        option: the option, for errors.
        example: what would be right, for errors.

    Raises:
        SettingsError: it is not two numbers.
    """
    values = [_number(part) for part in text.split(",")]
    if len(values) != 2 or not all(math.isfinite(value) for value in values):
        raise SettingsError(f"{option} is {text!r}", f"give {example}")
    return values[0], values[1]


def crop_of(text: str, option: str) -> Crop:
    """Read a rectangle: X,Y,W,H in whole pixels.

    Args:
        text: what the user wrote.
        option: the option, for errors.

    Raises:
        SettingsError: it is not four whole numbers, or it is empty.
    """
    values = [_number(part) for part in text.split(",")]
    whole = len(values) == 4 and all(math.isfinite(value) and value == int(value) for value in values)
    if not whole or min(values[:2]) < 0 or min(values[2:]) < 1:
        raise SettingsError(
            f"{option} is {text!r}", "give X,Y,W,H in whole px of the rectified left image, for example 200,100,640,480"
        )
    x_px, y_px, width_px, height_px = (int(value) for value in values)
    return Crop(x_px=x_px, y_px=y_px, width_px=width_px, height_px=height_px)


def near_of(text: str, option: str) -> float:
    """Read the nearest depth, m."""
    return limit_mm(text, option, "300mm") / 1000


def far_of(text: str, option: str) -> float:
    """Read the farthest depth, m."""
    return limit_mm(text, option, "5m") / 1000


def _scale(text: str, option: str) -> float:
    value = _number(text)
    if not _LEAST_SCALE <= value <= 1:
        raise SettingsError(f"{option} is {text!r}", f"give a number from {_LEAST_SCALE:g} to 1")
    return value


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthOptions:
    """What a stereo core needs to know: the cameras, or what is known of rectified images, and how to match.

    Attributes:
        far_m: cut points with a coordinate beyond this, m; None: as the rig can tell.
        crop: the part of the rectified left image that gets depth; None: all.
        axes: of the points in files.
    """

    calibration: str | None = option_of(PhoneHostSettings, "calibration", often=True)
    use_rejected_rig: bool = option(
        "--use-rejected-rig",
        group="calibration",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong depth",
    )
    rectified: bool = option(
        "--rectified", group="calibration", action="store_true", help="the images are already rectified"
    )
    disparities: int | None = option(
        "--disparities",
        type=int,
        metavar="N",
        help="search disparities from 0 to N-1 px (default: as --near needs, where focal length and baseline are known)",
    )
    near_m: float | None = option(
        "--near",
        often=True,
        read=near_of,
        metavar="MM",
        help=f"cut what is nearer, and look for nothing nearer; 20cm and 0.2m work, too (default: look from {DEFAULT_NEAR_MM:g} mm on, cut nothing)",
    )
    scale: float | None = option(
        "--scale",
        read=_scale,
        metavar="S",
        help="match images of this share of the size, 0.1 to 1; results keep the full size (default: 1, less for large images)",
    )
    focal_px: float | None = option(
        "--focal", group="calibration", read=_focal_px, metavar="PX", help="focal length of the rectified images, px"
    )
    baseline_m: float | None = option(
        "--baseline",
        group="calibration",
        read=lambda text, _: baseline_mm(text) / 1000,
        metavar="MM",
        help="distance of the two cameras, for rectified images",
    )
    doffs_px: float | None = option(
        "--doffs",
        group="calibration",
        read=_pixels,
        metavar="PX",
        help="x of the right principal point minus the left, px (default 0)",
    )
    center_px: tuple[float, float] | None = option(
        "--center",
        group="calibration",
        read=point_px,
        metavar="CX,CY",
        help="principal point of the left rectified image",
    )
    matcher: str | None = option_of(PhoneHostSettings, "matcher")
    overlay: Path | None = option(
        "--overlay",
        group="calibration",
        type=Path,
        metavar="FILE",
        help="overlay.yaml that a run saved: how the cameras had turned against each other since the calibration",
    )
    far_m: float | None = None
    crop: Crop | None = None
    axes: Axes = Axes.CAMERA


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitedDepthOptions(DepthOptions):
    """The same, and which points are written, and how."""

    far_m: float | None = option(
        "--far",
        often=True,
        read=far_of,
        metavar="MM",
        help="cut points with a coordinate beyond this (default: where an error of 0.25 px, or the rig's own, makes the depth wrong by 20 %%)",
    )
    crop: Crop | None = option(
        "--crop",
        read=crop_of,
        metavar="X,Y,W,H",
        help="only this part of the rectified left image gets depth, px of the full size",
    )
    axes: Axes = option(
        "--axes",
        read=lambda text, _: Axes(text),
        choices=("camera", "y-up"),
        default="camera",
        help="axes of the points in files: the camera's (x right, y down, z forward), or y up and z backward as many viewers expect",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OnePairDepthOptions(DepthOptions):
    """What a verb needs to know that measures the only pair of calibrated cameras."""

    calibration: str = option(  # required here
        "--calibration",
        often=True,
        required=True,
        metavar="FILE",
        help="rig.yaml of the two cameras; or, for rectified images, the calib.txt of Middlebury, ETH3D or KITTI",
    )
    use_rejected_rig: bool = option(
        "--use-rejected-rig",
        group="calibration",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong lengths",
    )
    matcher: str | None = option("--matcher", metavar="NAME", help=f"as for phone-host stereo ({default_words()})")
    rectified: bool = False
    scale: float | None = None
    focal_px: float | None = None
    baseline_m: float | None = None
    doffs_px: float | None = None
    center_px: tuple[float, float] | None = None


def depth_wanted(options: DepthOptions) -> DepthWanted:
    """Check --disparities and the limits; return the limits.

    Raises:
        SettingsError: there are more disparities than an image has columns, or nothing is left between the two limits.
    """
    if options.disparities is not None and options.disparities > MOST_SIDE_PX:
        raise SettingsError(
            f"--disparities {options.disparities} is more than any image is wide",
            f"give 1 to {MOST_SIDE_PX} (64 suits most 640 px wide pairs)",
        )
    near_m = options.near_m or 0.0
    far_m = math.nan if options.far_m is None else options.far_m
    if near_m >= far_m:
        raise SettingsError(f"--near {near_m:g}m is not nearer than --far {far_m:g}m", "give a larger --far")
    return DepthWanted(
        search_from_m=(near_m or NEAR_M) if options.disparities is None else math.nan,
        near_m=near_m,
        far_m=far_m,
        crop=options.crop,
        scale=math.nan if options.scale is None else options.scale,
    )
