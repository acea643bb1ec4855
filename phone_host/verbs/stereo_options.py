"""The options that name a stereo core, shared by the verbs that need one, and what they make of them."""

import argparse
import math
from pathlib import Path

from common.errors import SettingsError
from phone_host.formats.rig_yaml import read_rig
from phone_host.model import Side, StereoGeometry
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatcherName, MatchSettings, create_matcher
from phone_host.stereo.rectify import Rectifier
from phone_host.stereo.reproject import disparities_for_near

_DEFAULT_NEAR_MM = 300.0


def add_stereo_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration, --rectified and what goes with them."""
    parser.add_argument(
        "--calibration", metavar="rig.yaml", help="the two cameras' calibration, from phone-host calibrate"
    )
    parser.add_argument("--rectified", action="store_true", help="the images come rectified")
    parser.add_argument(
        "--disparities", type=int, metavar="N", help="search 0 <= d < N (with a rig the default follows from --near)"
    )
    parser.add_argument(
        "--near",
        type=float,
        default=_DEFAULT_NEAR_MM,
        metavar="MM",
        help="nearest depth with --calibration (default 300)",
    )
    parser.add_argument("--focal", type=float, metavar="PX", help="focal length of rectified images")
    parser.add_argument("--baseline", type=float, metavar="MM", help="baseline of rectified images")
    parser.add_argument(
        "--doffs",
        type=float,
        default=0.0,
        metavar="PX",
        help="x of the right principal point minus the left (default 0)",
    )
    parser.add_argument("--center", metavar="CX,CY", help="left principal point of rectified images")
    parser.add_argument("--matcher", choices=[name.value for name in MatcherName], help="default sgbm")


def build_core(
    options: argparse.Namespace, calibration: str, matcher: str, size_px: tuple[int, int]
) -> tuple[StereoCore | None, Side | None]:
    """Make the core that the options name.

    Args:
        options: of add_stereo_arguments.
        calibration: path of rig.yaml; empty for none.
        matcher: the matcher's name.
        size_px: width and height of images that come rectified.

    Returns:
        The core (None when neither a rig nor rectified images are named) and the side of the board's camera as the rig has it.

    Raises:
        SettingsError: options that contradict each other.
        DataError: a bad rig.yaml.
    """
    if matcher not in {name.value for name in MatcherName}:
        raise SettingsError(
            f"matcher {matcher!r} is unknown", f"give {' or '.join(name.value for name in MatcherName)}"
        )
    if not (math.isfinite(options.near) and options.near > 0):
        raise SettingsError(f"--near {options.near:g}", "give millimetres above 0")
    if calibration and options.rectified:
        raise SettingsError("--calibration and --rectified contradict each other", "give one of them")
    if calibration:
        rig = read_rig(Path(calibration))
        rectifier = Rectifier(rig)
        disparities = options.disparities or disparities_for_near(
            rectifier.geometry, options.near / 1000, rectifier.rectification.width_px
        )
        return StereoCore(create_matcher(MatchSettings(MatcherName(matcher), disparities)), rectifier), rig.board_side
    if not options.rectified:
        return None, None
    if options.disparities is None:
        raise SettingsError(
            "--rectified without --disparities", "give the number of disparities, for example --disparities 64"
        )
    return StereoCore(
        create_matcher(MatchSettings(MatcherName(matcher), options.disparities)),
        None,
        rectified_geometry(options, size_px),
    ), None


def rectified_geometry(options: argparse.Namespace, size_px: tuple[int, int]) -> StereoGeometry | None:
    """Read --focal, --baseline, --doffs and --center; None without focal length and baseline.

    Raises:
        SettingsError: one without the other, or numbers of no use.
    """
    if (options.focal is None) != (options.baseline is None):
        raise SettingsError("--focal and --baseline belong together", "give both, or neither for no point cloud")
    if options.focal is None:
        return None
    if not (options.focal > 0 and options.baseline > 0):
        raise SettingsError(f"--focal {options.focal} --baseline {options.baseline}", "both must be above 0")
    try:
        cx_px, cy_px = (
            (float(part) for part in options.center.split(",")) if options.center else ((n - 1) / 2 for n in size_px)
        )
    except ValueError:
        raise SettingsError(f"--center {options.center!r}", "give CX,CY in px, for example 319.5,239.5") from None
    return StereoGeometry(options.focal, options.baseline / 1000, cx_px, cy_px, options.doffs)
