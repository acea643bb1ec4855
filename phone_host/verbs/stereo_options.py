"""What verbs that still take argparse's options ask of `jobs.depth`."""

import argparse
from pathlib import Path

from common.orientation import Orientation
from common.program.request import read_request
from phone_host.jobs import depth
from phone_host.jobs.depth import LimitedDepthOptions
from phone_host.jobs.options import ImageOptions
from phone_host.model import Departure, Side
from phone_host.stereo.core import StereoCore


def output_options(options: argparse.Namespace) -> LimitedDepthOptions:
    """Read the options about depth."""
    return read_request(LimitedDepthOptions, vars(options))


def build_core(
    options: argparse.Namespace, calibration: str, matcher: str, size_px: tuple[int, int], images: Path | None = None
) -> tuple[StereoCore | None, Side | None]:
    """See `jobs.depth`."""
    return depth.build_core(output_options(options), calibration, matcher, size_px, images)


def metric_core(options: argparse.Namespace, matcher: str, size_px: tuple[int, int], images: Path) -> StereoCore:
    """See `jobs.depth`."""
    return depth.metric_core(output_options(options), matcher, size_px, images)


def require_metres(options: argparse.Namespace) -> None:
    """See `jobs.depth`."""
    depth.require_metres(output_options(options))


def overlay_of(options: argparse.Namespace, core: StereoCore | None) -> Departure:
    """See `jobs.depth`."""
    return depth.overlay_of(output_options(options), core)


def orientations(options: argparse.Namespace) -> tuple[Orientation, Orientation]:
    """Return how the left and the right images are turned upright."""
    return read_request(ImageOptions, vars(options)).mounted
