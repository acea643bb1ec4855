"""overlay.yaml: how a rig departed from its rig.yaml at the end of a run. The rig.yaml itself is never changed.

Keys: format_version; rig (the fingerprint of the rig.yaml it belongs to); right_turn (rotation vector of the right camera
about its own axes, rad: a point p of its calibrated axes is exp(right_turn) p now); right_turn_sigma (standard uncertainty
of each, rad); right_focal (its focal length divided by the calibrated one); right_focal_sigma; features and pairs (that it
rests on); vertical_error and vertical_error_left (95th percentile over the image without and with the correction, px).
OpenCV's FileStorage and every YAML parser read it.
"""

import hashlib
import math
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError
from common.files import read_input
from common.versions import OVERLAY_FORMAT
from phone_host.model import Departure, Drift, Rig
from phone_host.output.rig_files.tree import Node
from phone_host.output.rig_files.yaml_text import read_yaml

OVERLAY_NAME: Final = "overlay.yaml"

_MOST_BYTES: Final = 1 << 16
_MOST_TURN_RAD: Final = math.radians(5.0)
_MOST_FOCUS: Final = 0.2
"""What no run writes, by far: such a file was made for something else."""

_REMEDY: Final = "give the overlay.yaml of a run with this rig.yaml, or leave --overlay out"


def fingerprint(rig: Rig) -> str:
    """Return what tells a rig from every other one: 16 hexadecimal digits of its lenses, image sizes and relative pose."""
    digest = hashlib.sha256()
    for camera in (rig.left, rig.right):
        digest.update(f"{camera.width_px} {camera.height_px} {camera.lens.value} {camera.distortion.size} ".encode())
        digest.update(np.concatenate([camera.matrix.ravel(), camera.distortion]).astype("<f8").tobytes())
    digest.update(np.concatenate([rig.R_right_left.ravel(), rig.t_right_left_m.ravel()]).astype("<f8").tobytes())
    return digest.hexdigest()[:16]


def overlay_text(rig: Rig, drift: Drift) -> str:
    """Return the content of overlay.yaml."""
    used = drift.overlay
    values = {
        "format_version": str(OVERLAY_FORMAT),
        "rig": f'"{fingerprint(rig)}"',
        "right_turn": _list(used.turn_rad),
        "right_turn_sigma": _list(drift.turn_sigma_rad),
        "right_focal": repr(used.focal),
        "right_focal_sigma": _real(drift.focal_sigma),
        "features": str(drift.features),
        "pairs": str(drift.measurements),
        "vertical_error": _real(drift.rows_px),
        "vertical_error_left": _real(drift.left_px),
    }
    return "%YAML:1.0\n---\n" + "".join(f"{key}: {value}\n" for key, value in values.items())


def read_overlay(path: Path, rig: Rig) -> Departure:
    """Read an overlay and check it.

    Raises:
        DataError: the file is missing, not valid, of a newer format, or belongs to another rig; names file and key.
    """
    try:
        text = read_input(path, _MOST_BYTES, _REMEDY).decode("utf-8")
    except UnicodeDecodeError as error:
        raise DataError(f"{path} is no overlay.yaml", _REMEDY) from error
    node = Node(str(path), "", read_yaml(text, str(path)))
    if node.has("M1"):
        raise DataError(f"{path} is a rig.yaml, no overlay.yaml", _REMEDY)
    version = node.child("format_version")
    if version.number() != OVERLAY_FORMAT:
        raise version.problem(f"is {version.tree}, this program reads {OVERLAY_FORMAT}", "update tandemscan")
    if (own := fingerprint(rig)) != (of := node.child("rig")).word():
        raise of.problem(f"is that of another rig than --calibration, which is {own}", _REMEDY)
    turn = node.child("right_turn")
    x, y, z = (float(value) for value in turn.numbers(3))
    if math.hypot(x, y, z) > _MOST_TURN_RAD:
        raise turn.problem("is more than any rig turns", _REMEDY)
    focal = node.child("right_focal")
    if abs(focal.number() - 1) > _MOST_FOCUS:
        raise focal.problem("is more than any focus changes", _REMEDY)
    return Departure(turn_rad=(x, y, z), focal=focal.number())


def _list(values: tuple[float, ...]) -> str:
    return f"[{', '.join(_real(value) for value in values)}]"


def _real(value: float) -> str:
    return ".Nan" if math.isnan(value) else repr(value)
