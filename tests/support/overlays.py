"""A rig that has turned since it was calibrated, and the overlay.yaml that knows it."""

from dataclasses import replace
from pathlib import Path

from phone_host.model import Departure, Drift, Rig
from phone_host.output.overlay_yaml import overlay_text
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectifier import corrected_rig
from phone_host.stereo.rectify import rectify_rig

_TURN_RAD = (0.002, 0.006, -0.003)


def write_turned(folder: Path, rig: Rig) -> list[str]:
    """Write rig.yaml as the rig was before it turned to where it stands, and overlay.yaml; return the options that name them."""
    x, y, z = _TURN_RAD
    before = corrected_rig(rig, Departure(turn_rad=(-x, -y, -z)))
    write_rig(folder / "before.yaml", before, rectify_rig(before))
    used = replace(Drift(), overlay=Departure(turn_rad=_TURN_RAD))
    (folder / "overlay.yaml").write_text(overlay_text(before, used))
    return ["--calibration", str(folder / "before.yaml"), "--overlay", str(folder / "overlay.yaml")]
