"""phone-host stereo: compute disparity and point cloud of one pair of images."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from common import now
from common.errors import SettingsError
from common.ledger import StageTimes
from common.versions import REPORT_FORMAT
from phone_host.model import CloudImage, Disparity, RectifiedPair
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.listed import ListedFolder
from phone_host.output.pfm import write_pfm
from phone_host.output.ply import write_ply
from phone_host.output.preview import write_preview
from phone_host.settings import most_pixels
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, open_image, require_same_size, size_text
from phone_host.stereo.reproject import disparities_for_near, nearest_depth_m
from phone_host.verbs.output_folders import keep_other_report, require_folder, unwritable
from phone_host.verbs.stereo_options import build_core

_DEFAULT_MATCHER = "sgbm"
# In a textured scene that both cameras see, more than 90 % of the pixels are matched. Below a third, a wrong pair is
# far more likely than a scene without texture.
_LOW_DENSITY = 0.33


def run(options: argparse.Namespace) -> int:
    """Read, rectify if needed, match, reproject and write."""
    if not options.calibration and not options.rectified:
        raise SettingsError(
            "neither --calibration nor --rectified is given",
            "give the rig.yaml of `phone-host calibrate`, or --rectified --disparities N",
        )
    require_folder(options.out)
    watch = _StopWatch()
    limit = most_pixels(None, options.max_megapixels)
    files = open_image(options.left, limit), open_image(options.right, limit)
    if options.rectified:
        require_same_size(files[0].size_px, files[1].size_px, files[0].name, files[1].name)
    matcher = options.matcher or _DEFAULT_MATCHER
    core, _ = build_core(options, options.calibration or "", matcher, files[0].size_px)
    if core is None:  # cannot happen: one of the two options was checked above
        raise SettingsError("no stereo core", "give --calibration or --rectified")
    core.require_sizes(files[0].size_px, files[1].size_px)
    watch.lap("prepare")
    left, right = decode_files(*files)
    keep_other_report(options.out, "stereo")
    _clear(
        options.out, has_cloud=core.geometry is not None
    )  # only once the images are known to be sound, or an earlier result would be lost for nothing
    watch.lap("read")
    processed = core.compute(left, right, now.monotonic_ns)
    pair, disparity, cloud = processed.pair, processed.disparity, processed.cloud
    assert disparity is not None  # `compute` always returns one
    watch.take_over(processed.stages)
    points = _write(options.out, pair, disparity, cloud)
    watch.lap("write")
    report: dict[str, Any] = {
        "format_version": REPORT_FORMAT,
        "left": {"file": str(options.left), "size": size_text(left)},
        "right": {"file": str(options.right), "size": size_text(right)},
        "size": size_text(pair.left),
        "matcher": matcher,
        **_figures(options, core, disparity),
        "points": points,
        "times_ms": watch.times_ms(),
        "files": ["disparity.pfm", "disparity.png", *(["cloud.ply"] if cloud is not None else []), "report.json"],
    }
    _write_report(options.out, report)
    print(json_text(report) if options.json else _summary(report, options.out))
    return 0


class _StopWatch:
    """Times the stages, one after the other."""

    def __init__(self) -> None:
        self._laps_ns: list[tuple[str, int]] = []
        self._start_ns = self._last_ns = now.monotonic_ns()

    def lap(self, stage: str) -> None:
        at_ns = now.monotonic_ns()
        self._laps_ns.append((stage, at_ns - self._last_ns))
        self._last_ns = at_ns

    def take_over(self, stages: StageTimes) -> None:
        """Add the stages that the core has timed meanwhile."""
        self._laps_ns += [(stage, getattr(stages, stage)) for stage in ("rectify", "match", "reproject")]
        self._last_ns = now.monotonic_ns()

    def times_ms(self) -> dict[str, float]:
        laps = [*self._laps_ns, ("total", self._last_ns - self._start_ns)]
        return {stage: round(ns / 1e6, 3) for stage, ns in laps}


def _figures(options: argparse.Namespace, core: StereoCore, disparity: Disparity) -> dict[str, Any]:
    """Return geometry, number of disparities, density and warnings about them."""
    geometry, width_px = core.geometry, disparity.shape[1]
    count = options.disparities
    warnings = []
    if count is None and geometry is not None:
        count = disparities_for_near(geometry, options.near / 1000, width_px)
        nearest_mm = nearest_depth_m(geometry, count) * 1000
        if nearest_mm > options.near:
            warnings.append(
                f"nothing nearer than {nearest_mm:.0f} mm is found: at {options.near:g} mm the two views of this rig"
                " share less than half of their width"
            )
    density = float(np.isfinite(disparity).mean())
    if density < _LOW_DENSITY:
        warnings.append(
            f"only {density:.0%} of the pixels have depth: check that LEFT and RIGHT are not swapped, that both show the same scene,"
            " that --calibration or --rectified fits them, and that the scene has texture and is not nearer than --near"
        )
    if geometry is None:
        warnings.append("no cloud.ply: focal length and baseline are unknown; give --focal PX --baseline MM")
    return {
        "disparities": count,
        "geometry": None if geometry is None else asdict(geometry),
        "density": round(density, 5),
        "warnings": warnings,
    }


def _clear(out: Path, *, has_cloud: bool) -> None:
    """Remove an earlier run's results, which could be mistaken for this run's."""
    try:
        folder = ListedFolder(out, r"disparity\.(pfm|png)|cloud\.ply|report\.json")
        folder.add("disparity.pfm", "disparity.png", *(["cloud.ply"] if has_cloud else []), "report.json")
        folder.close()
    except OSError as error:
        raise unwritable(out, error) from error


def _write(out: Path, pair: RectifiedPair, disparity: Disparity, cloud: CloudImage | None) -> int | None:
    """Write everything but the report. Return the number of points, or None without a cloud."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_pfm(out / "disparity.pfm", disparity)
        write_preview(out / "disparity.png", disparity)
        if cloud is None:
            return None
        return write_ply(out / "cloud.ply", cloud, pair.left)
    except OSError as error:
        raise unwritable(out, error) from error


def _write_report(out: Path, report: dict[str, Any]) -> None:
    try:
        write_text(out / "report.json", json_text(report, indent=2) + "\n")
    except OSError as error:
        raise unwritable(out, error) from error


def _summary(report: dict[str, Any], out: Path) -> str:
    geometry = report["geometry"]
    found = f"{report['density']:.1%} of the pixels have one ({report['times_ms']['total']:.0f} ms)"
    lines = [
        f"{report['size']} px, {report['matcher']}, {report['disparities']} disparities: {found}",
        *(f"warning: {warning}" for warning in report["warnings"]),
    ]
    if geometry is not None:
        lines.insert(
            1,
            f"{report['points']} points; f = {geometry['focal_px']:.1f} px, b = {geometry['baseline_m'] * 1e3:.2f} mm",
        )
    return "\n".join([*lines, f"written to {out}: {', '.join(report['files'])}"])
