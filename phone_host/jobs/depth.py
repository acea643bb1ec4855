"""The options about depth, and the stereo core that they ask for."""

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.imagesize.head import MOST_SIDE_PX
from common.program.quantities import decimal_number
from common.program.request import option
from phone_host.declared_settings import NEAR_M
from phone_host.jobs.units import baseline_mm, limit_mm
from phone_host.model import AS_CALIBRATED, Crop, Departure, Rig, Side, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.calib_txt import KittiCameras, is_calib_txt, read_calib_txt
from phone_host.output.overlay_yaml import read_overlay
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import AnyMatcher, MatcherName, default_words, matcher_named
from phone_host.stereo.plausible import require_plausible, require_plausible_file
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.scaled_rig import scaled_geometry

_KITTI_FOLDER: Final = re.compile(r"image_0?([0-3])")
"""KITTI's folders of images are called by the camera: 0 and 1 are grey, 2 and 3 colour, each left before right."""


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

    calibration: str | None = option(
        "--calibration",
        metavar="FILE",
        help="rig.yaml of the two cameras, made by phone-host calibrate; or, for rectified images, the calib.txt of Middlebury, ETH3D or KITTI",
    )
    use_rejected_rig: bool = option(
        "--use-rejected-rig",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong depth",
    )
    rectified: bool = option("--rectified", action="store_true", help="the images are already rectified")
    disparities: int | None = option(
        "--disparities",
        type=int,
        metavar="N",
        help="search disparities from 0 to N-1 px (default: as --near needs, where focal length and baseline are known)",
    )
    near_m: float | None = option(
        "--near",
        read=lambda text, name: limit_mm(text, name, "300mm") / 1000,
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
        "--focal", read=_focal_px, metavar="PX", help="focal length of the rectified images, px"
    )
    baseline_m: float | None = option(
        "--baseline",
        read=lambda text, _: baseline_mm(text) / 1000,
        metavar="MM",
        help="distance of the two cameras, for rectified images",
    )
    doffs_px: float | None = option(
        "--doffs", read=_pixels, metavar="PX", help="x of the right principal point minus the left, px (default 0)"
    )
    center_px: tuple[float, float] | None = option(
        "--center", read=point_px, metavar="CX,CY", help="principal point of the left rectified image"
    )
    matcher: str | None = option(
        "--matcher",
        metavar="NAME",
        help=f"stereo matcher: {' or '.join(name.value for name in MatcherName)}, onnx:PATH for a network, or one from an installed package ({default_words()})",
    )
    overlay: Path | None = option(
        "--overlay",
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
        read=lambda text, name: limit_mm(text, name, "5m") / 1000,
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


def build_core(
    options: DepthOptions,
    calibration: str,
    matcher: str,
    size_px: tuple[int, int],
    images: Path | None = None,
    *,
    rig: Rig | None = None,
) -> tuple[StereoCore | None, Side | None]:
    """Build the stereo core from the options.

    Args:
        options: about depth.
        calibration: path of rig.yaml or calib.txt; empty for none.
        matcher: name of the matcher.
        size_px: width and height of images that arrive rectified, px.
        images: an image file of either side, or its folder; None: not from files. KITTI's calib.txt holds two pairs of
            cameras, and only the folder's name tells which of them took the images.
        rig: what the calibration holds, if it is known already; None: it is read.

    Returns: The core (None if neither a rig nor rectified images are given), and the side of the board's camera in the
        rig (None without a rig).

    Raises:
        SettingsError: the options contradict each other.
        DataError: rig.yaml or calib.txt is invalid, or the rig was rejected by its calibration.
    """
    chosen = matcher_named(matcher)
    wanted = depth_wanted(options)
    of_rectified = bool(calibration) and rig is None and is_calib_txt(Path(calibration))
    if calibration and options.rectified and not of_rectified:
        raise SettingsError("--calibration and --rectified contradict each other", "give only one of the two")
    _refuse_idle_geometry(options, calibration)
    if of_rectified:
        core = _by_calib_txt(options, Path(calibration), chosen, wanted, size_px, cameras=_kitti_cameras(images))
        return core, None
    if calibration:
        rig = rig or read_own_rig(Path(calibration))
        refuse_rejected(rig, calibration, allowed=options.use_rejected_rig)
        return StereoCore(_matcher(chosen, options.disparities), Rectifier(rig), None, wanted), rig.board_side
    if not options.rectified:
        _refuse_idle_limits(options, "--calibration or --rectified", without_depth=True)
        return None, None
    geometry = rectified_geometry(options, size_px)
    if geometry is None:
        _refuse_idle_limits(options, "--focal and --baseline, so there are no metres", without_depth=False)
        if options.disparities is None:
            raise SettingsError(
                "--rectified without --disparities", "give the number of disparities, for example --disparities 64"
            )
    return StereoCore(_matcher(chosen, options.disparities), None, geometry, wanted), None


def metric_core(options: DepthOptions, matcher: str, size_px: tuple[int, int], images: Path) -> StereoCore:
    """Build the stereo core for files, corrected by --overlay, which must give metres.

    Args:
        options: about depth.
        matcher: name of the matcher.
        size_px: width and height of the images, px.
        images: one of them.

    Raises:
        SettingsError: the options contradict each other, or give no metres.
        DataError: rig.yaml or calib.txt is invalid, or the rig was rejected by its calibration.
    """
    core, _ = build_core(options, options.calibration or "", matcher, size_px, images)
    if core is None or core.geometry is None:
        raise _no_metres()
    core.correct(overlay_of(options, core))
    return core


def _no_metres() -> SettingsError:
    return SettingsError(
        "the images have neither a focal length nor a baseline, so there are no distances",
        "add --focal PX and --baseline MM, or give --calibration",
    )


def require_metres(options: DepthOptions) -> None:
    """Refuse options that name no geometry at all, before anything is read.

    Raises:
        SettingsError: there is neither --calibration nor --rectified, or no focal length and baseline with the latter.
    """
    if options.rectified and not options.calibration and options.focal_px is None and options.baseline_m is None:
        raise _no_metres()
    if not options.calibration and not options.rectified:
        raise SettingsError(
            "neither --calibration nor --rectified is given",
            "give the rig.yaml of `phone-host calibrate`, or --rectified --focal PX --baseline MM",
        )


def overlay_of(options: DepthOptions, core: StereoCore | None) -> Departure:
    """Read --overlay; no correction without it.

    Args:
        options: about depth.
        core: the stereo core; None: there is none.

    Raises:
        SettingsError: there is no rig that it could belong to.
        DataError: it is not valid, or belongs to another rig.
    """
    if options.overlay is None:
        return AS_CALIBRATED
    if core is None or core.rig is None:
        raise SettingsError("--overlay without a rig.yaml that it belongs to", "add --calibration rig.yaml")
    return read_overlay(options.overlay, core.rig)


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


def _matcher(chosen: AnyMatcher, disparities: int | None) -> MatchSettings:
    settings = MatchSettings(chosen)
    return settings if disparities is None else replace(settings, disparities=disparities)


def refuse_rejected(rig: Rig, calibration: str, *, allowed: bool) -> None:
    """Refuse a rig that its own calibration found unfit.

    Args:
        rig: as read.
        calibration: its file, for the error.
        allowed: whether the user wants it all the same.

    Raises:
        DataError: its verdict is reject, and it is not allowed.
    """
    if rig.is_rejected and not allowed:
        raise DataError(
            f"{calibration} was rejected by its own calibration (verdict reject): its depth would be wrong",
            "calibrate again, or give --use-rejected-rig",
        )


def _kitti_cameras(images: Path | None) -> KittiCameras:
    """Tell by the innermost folder that is called as KITTI calls them which pair of cameras is meant; grey if there is none."""
    parts = () if images is None else reversed(images.absolute().parts)
    camera = next((found[1] for part in parts if (found := _KITTI_FOLDER.fullmatch(part))), "0")
    return KittiCameras.COLOUR if camera in "23" else KittiCameras.GREY


def _by_calib_txt(
    options: DepthOptions,
    path: Path,
    chosen: AnyMatcher,
    wanted: DepthWanted,
    size_px: tuple[int, int],
    *,
    cameras: KittiCameras,
) -> StereoCore:
    """Build the core for rectified images from the file that their publisher gave; N is ndisp unless the user says otherwise."""
    found = read_calib_txt(path, cameras)
    geometry, disparities = found.geometry, options.disparities
    if found.size_px is not None and found.size_px != size_px:
        geometry = scaled_geometry(geometry, found.size_px, size_px, str(path))
    require_plausible_file(geometry, size_px, str(path))
    if disparities is None and options.near_m is None and found.disparities is not None:
        scale = 1.0 if found.size_px is None else size_px[0] / found.size_px[0]
        disparities = math.ceil(found.disparities * scale)
        wanted = depth_wanted(replace(options, disparities=disparities))
    return StereoCore(_matcher(chosen, disparities), None, geometry, wanted)


def _refuse_idle_geometry(options: DepthOptions, calibration: str) -> None:
    """Refuse geometry options that would have no effect, because the user expects one."""
    geometry = (options.focal_px, options.baseline_m, options.doffs_px, options.center_px)
    names = ("--focal", "--baseline", "--doffs", "--center")
    given = [name for name, value in zip(names, geometry, strict=True) if value is not None]
    if given and calibration:
        raise SettingsError(f"{given[0]} contradicts --calibration", "leave it out: the calibration has its own")
    if given and not options.rectified:
        raise SettingsError(f"{given[0]} without --rectified", "add --rectified, or leave it out")
    if given and options.focal_px is None and options.baseline_m is None:
        raise SettingsError(f"{given[0]} without --focal and --baseline", "add --focal and --baseline, or leave it out")


def _refuse_idle_limits(options: DepthOptions, missing: str, *, without_depth: bool) -> None:
    """Refuse limits that would have no effect."""
    limits: dict[str, object] = {"--near": options.near_m, "--far": options.far_m}
    if without_depth:
        limits |= {"--crop": options.crop, "--scale": options.scale}
    given = [name for name, value in limits.items() if value is not None]
    if given:
        raise SettingsError(f"{given[0]} without {missing}", "add them, or leave it out")


def rectified_geometry(options: DepthOptions, size_px: tuple[int, int]) -> StereoGeometry | None:
    """Return the geometry of --focal, --baseline, --doffs and --center; None without focal length and baseline.

    Raises:
        SettingsError: only one of focal length and baseline is given, or the two cannot be.
    """
    if (options.focal_px is None) != (options.baseline_m is None):
        raise SettingsError("only one of --focal and --baseline is given", "give both for a point cloud, or neither")
    if options.focal_px is None or options.baseline_m is None:
        return None
    cx_px, cy_px = options.center_px or ((n - 1) / 2 for n in size_px)
    geometry = StereoGeometry(
        focal_px=options.focal_px,
        baseline_m=options.baseline_m,
        cx_px=cx_px,
        cy_px=cy_px,
        doffs_px=options.doffs_px or 0.0,
    )
    require_plausible(geometry, size_px)
    return geometry
