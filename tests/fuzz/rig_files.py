"""Fuzz target: calibrations of other programs. What is read must survive being written as rig.yaml and read again."""

import tempfile
from pathlib import Path

import numpy as np

from common.errors import DataError, SettingsError
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.fuzz.target import is_one_line
from tests.support.rigs import unlike_rig

_FOLDER = tempfile.TemporaryDirectory(prefix="fuzz")
_BETWEEN = b"\n@@@@\n"
"""Parts two files of one calibration."""

_SIZE = (640, 480)


def rig_files(data: bytes) -> None:
    """One or two files. Expected: a rig that rig.yaml holds, or a one-line error."""
    paths = []
    for index, part in enumerate(data.split(_BETWEEN)[:2]):
        path = Path(_FOLDER.name) / f"{index}.txt"
        path.write_bytes(part)
        paths.append(path)
    for sizes_px in (None, (_SIZE, _SIZE)):
        try:
            rig = import_rig(tuple(paths), sizes_px=sizes_px).rig
            rectification = rectify_rig(rig)
        except (DataError, SettingsError) as error:
            is_one_line(error)
            continue
        kept = Path(_FOLDER.name) / "rig.yaml"
        write_rig(kept, rig, rectification)
        again = read_rig(kept)
        assert np.array_equal(again.left.matrix, rig.left.matrix), "another camera"
        assert np.array_equal(again.t_right_left_m, rig.t_right_left_m), "another baseline"


def rig_files_seeds() -> list[bytes]:
    """What each kind of file looks like."""
    rig = unlike_rig()
    rectification = rectify_rig(rig)
    kinds = (RigKind.ROS, RigKind.OPENCV, RigKind.OPENCV_XML, RigKind.COLMAP, RigKind.MIDDLEBURY, RigKind.KITTI)
    seeds = [
        _BETWEEN.join(each.text.encode() for each in export_texts(rig, rectification, kind, 64)[:2]) for kind in kinds
    ]
    camera = "  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [500, 500, 320, 240]\n  resolution: [640, 480]\n"
    pose = "[[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
    seeds.append(f"cam0:\n{camera}cam1:\n{camera}  T_cn_cnm1: {pose}\n".encode())
    return seeds
