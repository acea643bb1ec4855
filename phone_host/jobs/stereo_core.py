"""Builds the stereo core that the options about depth ask for."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from phone_host.jobs.depth import DepthOptions, depth_wanted
from phone_host.model import AS_CALIBRATED, Departure, Rig, Side, StereoGeometry
from phone_host.output.calib_txt import KittiCameras, is_calib_txt, read_calib_txt
from phone_host.output.overlay_yaml import read_overlay
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted, require_plausible, require_plausible_file
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import AnyMatcher, matcher_named
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.scaled_rig import scaled_geometry

_KITTI_FOLDER: Final = re.compile(r"image_0?([0-3])")
"""KITTI's folders of images are called by the camera: 0 and 1 are grey, 2 and 3 colour, each left before right."""


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


def core_for_files(
    options: DepthOptions, matcher: str, size_px: tuple[int, int], images: Path, *, needs_metres: bool = True
) -> StereoCore:
    """Build the stereo core for files that `require_cameras` lets pass, corrected by --overlay.

    Args:
        options: about depth.
        matcher: name of the matcher.
        size_px: width and height of the images, px.
        images: one of them.
        needs_metres: whether it must give metres.

    Raises:
        SettingsError: the options contradict each other, or give no metres.
        DataError: rig.yaml or calib.txt is invalid, or the rig was rejected by its calibration.
    """
    core, _ = build_core(options, options.calibration or "", matcher, size_px, images)
    assert core is not None, "--calibration and --rectified both make one"
    if needs_metres and core.geometry is None:
        raise _no_metres()
    core.correct(overlay_of(options, core))
    return core


def _no_metres() -> SettingsError:
    return SettingsError(
        "the images have neither a focal length nor a baseline, so there are no distances",
        "add --focal PX and --baseline MM, or give --calibration",
    )


def require_cameras(options: DepthOptions, *, needs_metres: bool = True) -> None:
    """Refuse options that say too little of the cameras, before anything is read.

    Args:
        options: about depth.
        needs_metres: whether focal length and baseline must be known.

    Raises:
        SettingsError: there is neither --calibration nor --rectified, or no focal length and baseline with the latter.
    """
    if not options.calibration and not options.rectified:
        remedy = (
            "give the rig.yaml of `phone-host calibrate`, or --rectified --focal PX --baseline MM"
            if needs_metres
            else "give the rig.yaml of `phone-host calibrate`, or --rectified --disparities N"
        )
        raise SettingsError("neither --calibration nor --rectified is given", remedy)
    if needs_metres and not options.calibration and options.focal_px is None and options.baseline_m is None:
        raise _no_metres()


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
