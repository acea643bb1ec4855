"""capture.json: what the check of the host's camera found.

It lies beside the rig.yaml whose lens it was checked with, or among this user's own data as long as there is none.

Keys: format_version; camera: driver, name, serial (empty: unknown); software; width_px, height_px; pace and rigidity, with the
names and units of `model.capture`; null: not measured.
"""

import math
from dataclasses import asdict, fields
from enum import Enum
from pathlib import Path
from typing import Any, Final, TypeVar

from common.camera_identity import CameraIdentity
from common.errors import DataError
from common.files import read_whole
from common.versions import CAPTURE_FORMAT
from phone_host.model.capture import CaptureReport, CaptureSource, Pace, Rigidity, Unseen, Warping
from phone_host.output.json_text import json_text, json_value

_NAME: Final = "capture.json"
_MOST_BYTES: Final = 1 << 16
_MOST_TEXT: Final = 400
_REMEDY: Final = "delete the file, and check the camera again"
_Kind = TypeVar("_Kind", Pace, Rigidity)


def capture_path(calibration: Path | None, elsewhere: Path) -> Path:
    """Return where a check is kept.

    Args:
        calibration: rig.yaml that it belongs to; None: there is none yet.
        elsewhere: folder for a check without one.
    """
    return (elsewhere if calibration is None else calibration.parent) / _NAME


def capture_values(report: CaptureReport) -> dict[str, Any]:
    """Return a report as a JSON object."""
    source = report.source
    camera = {"driver": source.camera.driver, "name": source.camera.name, "serial": source.camera.serial}
    rigidity = {
        name: value.value if isinstance(value, Enum) else value for name, value in asdict(report.rigidity).items()
    }
    return {
        "format_version": CAPTURE_FORMAT,
        "camera": camera,
        "software": source.software,
        "width_px": source.width_px,
        "height_px": source.height_px,
        "pace": asdict(report.pace),
        "rigidity": rigidity,
    }


def capture_text(report: CaptureReport) -> str:
    """Return the content of capture.json."""
    return json_text(capture_values(report), indent=1) + "\n"


def read_capture(path: Path) -> CaptureReport | None:
    """Read capture.json and check it: the report; None: there is no such file.

    Raises:
        DataError: it is not valid, or of a newer format.
    """
    try:
        values = json_value(read_whole(path, _MOST_BYTES))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror or error})", _REMEDY) from error
    except ValueError as error:
        raise DataError(f"{path} is no capture.json", _REMEDY) from error
    version = values.get("format_version") if isinstance(values, dict) else None
    if isinstance(version, int) and version > CAPTURE_FORMAT:
        known = f"{path}: format_version is {version}, this program reads up to {CAPTURE_FORMAT}"
        raise DataError(known, "update tandemscan, or delete the file")
    try:
        return _report(values)
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"{path} is no capture.json ({type(error).__name__}: {error})", _REMEDY) from error


def _report(values: Any) -> CaptureReport:  # noqa: ANN401 - whatever the file holds
    camera = CameraIdentity(*(_text(values["camera"][name]) for name in ("driver", "name", "serial")))
    size = [values[name] for name in ("width_px", "height_px")]
    if not all(isinstance(length, int) and length > 0 for length in size):
        raise ValueError("the image size is none")
    source = CaptureSource(camera=camera, software=_text(values["software"]), width_px=size[0], height_px=size[1])
    rigidity = dict(values["rigidity"])
    rigidity["warping"] = Warping(rigidity["warping"])
    unseen = rigidity.pop("unseen")
    found = _numbers(Rigidity, rigidity, {"warping", "unseen"})
    from_file = Rigidity(
        **{**found, "warping": rigidity["warping"], "unseen": None if unseen is None else Unseen(unseen)}
    )
    return CaptureReport(source=source, pace=Pace(**_numbers(Pace, values["pace"], set())), rigidity=from_file)


def _text(value: Any) -> str:  # noqa: ANN401
    if not isinstance(value, str) or len(value) > _MOST_TEXT:
        raise ValueError("a text is none")
    return value


def _numbers(kind: type[_Kind], values: dict[str, Any], others: set[str]) -> dict[str, Any]:
    """Return the numbers of a report, null as NaN."""
    found = {}
    for each in fields(kind):
        if each.name in others:
            continue
        value = values[each.name]
        if value is not None and not isinstance(value, int | float):
            raise ValueError(f"{each.name} is no number")
        found[each.name] = math.nan if value is None else value
    return found
