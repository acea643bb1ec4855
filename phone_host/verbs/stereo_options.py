"""Builds the stereo core from a verb's options, which `stereo_arguments` declares."""

import argparse
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.imagesize.head import MOST_SIDE_PX
from phone_host.declared_settings import NEAR_M
from phone_host.model import AS_CALIBRATED, Departure, Rig, Side, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.calib_txt import KittiCameras, is_calib_txt, read_calib_txt
from phone_host.output.overlay_yaml import read_overlay
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import AnyMatcher, matcher_named
from phone_host.stereo.plausible import require_plausible, require_plausible_file
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.scaled_rig import scaled_geometry
from phone_host.verbs.stereo_numbers import crop_of, pixels, point_px, scale_of
from phone_host.verbs.units import baseline_mm, limit_mm

_KITTI_FOLDER: Final = re.compile(r"image_0?([0-3])")
"""KITTI's folders of images are called by the camera: 0 and 1 are grey, 2 and 3 colour, each left before right."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputOptions:
    """How results are written.

    Attributes:
        axes: of the points in files.
    """

    axes: Axes = Axes.CAMERA


def output_options(options: argparse.Namespace) -> OutputOptions:
    """Read the options that only concern files."""
    return OutputOptions(axes=Axes(options.axes))


def build_core(
    options: argparse.Namespace,
    calibration: str,
    matcher: str,
    size_px: tuple[int, int],
    images: Path | None = None,
    *,
    rig: Rig | None = None,
) -> tuple[StereoCore | None, Side | None]:
    """Build the stereo core from the options.

    Args:
        options: options as `add_stereo_arguments` declares them.
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
        _refuse_idle_limits(options, ("near", "far", "crop", "scale"), "--calibration or --rectified")
        return None, None
    geometry = rectified_geometry(options, size_px)
    if geometry is None:
        _refuse_idle_limits(options, ("near", "far"), "--focal and --baseline, so there are no metres")
        if options.disparities is None:
            raise SettingsError(
                "--rectified without --disparities", "give the number of disparities, for example --disparities 64"
            )
    return StereoCore(_matcher(chosen, options.disparities), None, geometry, wanted), None


def metric_core(options: argparse.Namespace, matcher: str, size_px: tuple[int, int], images: Path) -> StereoCore:
    """Build the stereo core for files, corrected by --overlay, which must give metres.

    Args:
        options: options as `add_core_arguments` and `add_overlay_argument` declare them.
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


def require_metres(options: argparse.Namespace) -> None:
    """Refuse options that name no geometry at all, before anything is read.

    Raises:
        SettingsError: there is neither --calibration nor --rectified, or no focal length and baseline with the latter.
    """
    if options.rectified and not options.calibration and options.focal is None and options.baseline is None:
        raise _no_metres()
    if not options.calibration and not options.rectified:
        raise SettingsError(
            "neither --calibration nor --rectified is given",
            "give the rig.yaml of `phone-host calibrate`, or --rectified --focal PX --baseline MM",
        )


def overlay_of(options: argparse.Namespace, core: StereoCore | None) -> Departure:
    """Read --overlay; no correction without it.

    Args:
        options: options as `add_overlay_argument` declares it.
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


def depth_wanted(options: argparse.Namespace) -> DepthWanted:
    """Read --near, --far, --crop and --scale, and check --disparities.

    Raises:
        SettingsError: one of them is invalid, or nothing is left between the two limits.
    """
    if options.disparities is not None and options.disparities > MOST_SIDE_PX:
        raise SettingsError(
            f"--disparities {options.disparities} is more than any image is wide",
            f"give 1 to {MOST_SIDE_PX} (64 suits most 640 px wide pairs)",
        )
    near_m = 0.0 if options.near is None else limit_mm(options.near, "--near", "300mm") / 1000
    far_m = math.nan if options.far is None else limit_mm(options.far, "--far", "5m") / 1000
    if near_m >= far_m:
        raise SettingsError(f"--near {options.near} is not nearer than --far {options.far}", "give a larger --far")
    return DepthWanted(
        search_from_m=(near_m or NEAR_M) if options.disparities is None else math.nan,
        near_m=near_m,
        far_m=far_m,
        crop=None if options.crop is None else crop_of(options.crop),
        scale=math.nan if options.scale is None else scale_of(options.scale),
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
    options: argparse.Namespace,
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
    if disparities is None and options.near is None and found.disparities is not None:
        scale = 1.0 if found.size_px is None else size_px[0] / found.size_px[0]
        disparities = math.ceil(found.disparities * scale)
        wanted = depth_wanted(argparse.Namespace(**{**vars(options), "disparities": disparities}))
    return StereoCore(_matcher(chosen, disparities), None, geometry, wanted)


def _refuse_idle_geometry(options: argparse.Namespace, calibration: str) -> None:
    """Refuse geometry options that would have no effect, because the user expects one."""
    given = [f"--{name}" for name in ("focal", "baseline", "doffs", "center") if getattr(options, name) is not None]
    if given and calibration:
        raise SettingsError(f"{given[0]} contradicts --calibration", "leave it out: the calibration has its own")
    if given and not options.rectified:
        raise SettingsError(f"{given[0]} without --rectified", "add --rectified, or leave it out")
    if given and options.focal is None and options.baseline is None:
        raise SettingsError(f"{given[0]} without --focal and --baseline", "add --focal and --baseline, or leave it out")


def _refuse_idle_limits(options: argparse.Namespace, names: tuple[str, ...], missing: str) -> None:
    """Refuse limits that would have no effect."""
    given = [f"--{name}" for name in names if getattr(options, name) not in {None, False}]
    if given:
        raise SettingsError(f"{given[0]} without {missing}", "add them, or leave it out")


def rectified_geometry(options: argparse.Namespace, size_px: tuple[int, int]) -> StereoGeometry | None:
    """Read --focal, --baseline, --doffs and --center; None without focal length and baseline.

    Raises:
        SettingsError: only one of focal length and baseline is given, or a number is invalid.
    """
    if (options.focal is None) != (options.baseline is None):
        raise SettingsError("only one of --focal and --baseline is given", "give both for a point cloud, or neither")
    if options.focal is None:
        return None
    focal_px = pixels(options.focal, "--focal")
    if focal_px <= 0:
        raise SettingsError(f"--focal is {options.focal!r}", "give a number of pixels above 0")
    cx_px, cy_px = ((n - 1) / 2 for n in size_px) if options.center is None else point_px(options.center, "--center")
    geometry = StereoGeometry(
        focal_px=focal_px,
        baseline_m=baseline_mm(options.baseline) / 1000,
        cx_px=cx_px,
        cy_px=cy_px,
        doffs_px=0.0 if options.doffs is None else pixels(options.doffs, "--doffs"),
    )
    require_plausible(geometry, size_px)
    return geometry
