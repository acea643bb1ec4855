"""phone-host calibrate --export: rig.yaml becomes files of other programs."""

import argparse
from itertools import groupby
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.imagesize.head import size_text
from common.places import resolved
from phone_host.declared_settings import NEAR_M
from phone_host.jobs.output_folders import written_together
from phone_host.model import Rectification, Rig
from phone_host.output.atomic import write_text
from phone_host.output.rig_files.imported import RigKind, export_texts
from phone_host.stereo.reproject import disparities_for_near
from phone_host.verbs.calibrate.report import Exported

_OF_RECTIFIED: Final = frozenset({RigKind.MIDDLEBURY, RigKind.KITTI})


def write_exports(
    options: argparse.Namespace, rig: Rig, rectification: Rectification, inputs: tuple[Path, ...] = ()
) -> tuple[Exported, ...]:
    """Write a rig as files of the programs that --export names, into a folder for each beside --out.

    Args:
        options: as parsed.
        rig: two cameras.
        rectification: computed from the same rig.
        inputs: files that must stay as they are.

    Returns:
        The files of each kind; empty without --export.

    Raises:
        DataError: a program cannot hold the rig.
        SettingsError: an input would be replaced.
        UnavailableError: a file cannot be written, or is not ours.
    """
    along_px = rectification.height_px if rectification.epipolar.is_vertical else rectification.width_px
    disparities = disparities_for_near(rectification.geometry, NEAR_M, along_px)
    kinds = [RigKind(name) for name in dict.fromkeys(options.exports)]
    texts = [
        (kind, export_texts(rig, rectification, kind, disparities)) for kind in kinds
    ]  # all, before one is written
    kept = {resolved(path) for path in inputs}
    written = []
    for kind, made in texts:
        folder = options.out.parent / kind.value
        for path in (folder / each.name for each in made):
            if resolved(path) in kept:
                raise SettingsError(
                    f"--export {kind.value} would replace {path}, which is imported", "name another --out"
                )
        paths = {folder / each.name: each.text for each in made}
        for inner, group in groupby(paths, lambda path: path.parent):  # EuRoC's lie in a folder for each camera
            names = [path.name for path in group]
            with written_together(inner, *names) as place:
                for name in names:
                    write_text(place / name, paths[inner / name])
        written.append(Exported(kind, tuple(paths)))
    return tuple(written)


def export_lines(exported: tuple[Exported, ...], rectification: Rectification | None) -> list[str]:
    """Return a line for each exported kind, and which images a calib.txt is for; nothing was exported of a rig that cannot be rectified."""
    lines = [f"exported {each.kind.value}: {', '.join(map(str, each.files))}" for each in exported]
    if rectification is not None and not _OF_RECTIFIED.isdisjoint(each.kind for each in exported):
        size = size_text((rectification.width_px, rectification.height_px))
        lines.append(
            f"         calib.txt is for rectified images of {size} px, not for images as the cameras take them"
        )
    return lines
