"""Builds the stereo core from a verb's options, which `stereo_arguments` declares."""

import argparse
import math
from pathlib import Path

from common.errors import SettingsError
from phone_host.model import Side, StereoGeometry
from phone_host.output.rig_yaml import read_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.rectify import Rectifier
from phone_host.stereo.reproject import disparities_for_near


def build_core(
    options: argparse.Namespace, calibration: str, matcher: str, size_px: tuple[int, int]
) -> tuple[StereoCore | None, Side | None]:
    """Build the stereo core from the options.

    Args:
        options: options as `add_stereo_arguments` declares them.
        calibration: path of rig.yaml; empty for none.
        matcher: name of the matcher.
        size_px: width and height of images that arrive rectified, px.

    Returns: The core (None if neither a rig nor rectified images are given), and the side of the board's camera in the
        rig (None without a rig).

    Raises:
        SettingsError: the options contradict each other.
        DataError: rig.yaml is invalid.
    """
    chosen = matcher_named(matcher)
    if not (math.isfinite(options.near) and options.near > 0):
        raise SettingsError(f"--near is {options.near:g}", "give a number of millimetres above 0")
    if calibration and options.rectified:
        raise SettingsError("--calibration and --rectified contradict each other", "give only one of the two")
    _refuse_idle_geometry(options, calibration)
    if calibration:
        rig = read_rig(Path(calibration))
        rectifier = Rectifier(rig)
        disparities = options.disparities
        if disparities is None:
            width_px = rectifier.rectification.width_px
            disparities = disparities_for_near(rectifier.geometry, options.near / 1000, width_px)
        return StereoCore(create_matcher(MatchSettings(chosen, disparities)), rectifier), rig.board_side
    if not options.rectified:
        return None, None
    if options.disparities is None:
        raise SettingsError(
            "--rectified without --disparities", "give the number of disparities, for example --disparities 64"
        )
    return StereoCore(
        create_matcher(MatchSettings(chosen, options.disparities)),
        None,
        rectified_geometry(options, size_px),
    ), None


def _refuse_idle_geometry(options: argparse.Namespace, calibration: str) -> None:
    """Refuse geometry options that would have no effect, because the user expects one."""
    given = [f"--{name}" for name in ("focal", "baseline", "doffs", "center") if getattr(options, name) is not None]
    if given and calibration:
        raise SettingsError(f"{given[0]} contradicts --calibration", "leave it out: the calibration has its own")
    if given and not options.rectified:
        raise SettingsError(f"{given[0]} without --rectified", "add --rectified, or leave it out")
    if given and options.focal is None and options.baseline is None:
        raise SettingsError(f"{given[0]} without --focal and --baseline", "add --focal and --baseline, or leave it out")


def rectified_geometry(options: argparse.Namespace, size_px: tuple[int, int]) -> StereoGeometry | None:
    """Read --focal, --baseline, --doffs and --center; None without focal length and baseline.

    Raises:
        SettingsError: only one of focal length and baseline is given, or a number is invalid.
    """
    if (options.focal is None) != (options.baseline is None):
        raise SettingsError("only one of --focal and --baseline is given", "give both for a point cloud, or neither")
    if options.focal is None:
        return None
    for name, value in (("--focal", options.focal), ("--baseline", options.baseline)):
        if not (math.isfinite(value) and value > 0):
            raise SettingsError(f"{name} {value:g}", "give a number above 0")
    doffs_px = 0.0 if options.doffs is None else options.doffs
    if not math.isfinite(doffs_px):
        raise SettingsError(f"--doffs is {doffs_px:g}", "give a number of pixels")
    cx_px, cy_px = ((n - 1) / 2 for n in size_px) if options.center is None else _center(options.center)
    return StereoGeometry(
        focal_px=options.focal, baseline_m=options.baseline / 1000, cx_px=cx_px, cy_px=cy_px, doffs_px=doffs_px
    )


def _center(text: str) -> tuple[float, float]:
    try:
        cx_px, cy_px = (float(part) for part in text.split(","))
    except ValueError:
        cx_px = cy_px = math.nan
    if not (math.isfinite(cx_px) and math.isfinite(cy_px)):
        raise SettingsError(f"--center is {text!r}", "give CX,CY in px, for example 319.5,239.5")
    return cx_px, cy_px
