"""A pair as the bytes of one message: a header in JSON, then its parts. Pure.

uint32, little endian: length of the header; the header, UTF-8; the parts in the header's order. Only disparity and
pictures travel: the browser computes the points. docs/page.md describes the header.
"""

import json
import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

import numpy as np

from common.ledger import PairLedger
from phone_host.accounts.delays import DELAYS
from phone_host.model import Disparity, Processed
from phone_host.output.json_text import json_text
from phone_host.output.preview import colour_range_px
from phone_host.report.depth_data import photograph

WIDTHS: Final = (160, 320, 480, 640, 800, 960, 1280, 1920)
"""The widths of pictures. Few, so that many viewers share one encoding, and no viewer has hundreds made."""

_STEPS_PER_PX: Final = 32
"""A matcher's error is 0.2 px or more; half a step of 1/64 px does not show in it."""
_MOST_CELL: Final = 65535


class View(Enum):
    """A part of the message."""

    LEFT = "left"
    RIGHT = "right"
    DISPARITY = "disparity"


@dataclass(frozen=True, slots=True)
class Part:
    """One part, encoded.

    Attributes:
        entry: its entry in the header, but for the size in bytes.
        data: its bytes.
    """

    entry: Mapping[str, Any]
    data: bytes


def fitting_width(asked_px: int) -> int:
    """Return the least width of `WIDTHS` that is not below the one asked for, or the greatest."""
    return next((width for width in WIDTHS if width >= asked_px), WIDTHS[-1])


def picture(processed: Processed, view: View, width_px: int) -> Part:
    """Encode a rectified image as JPEG.

    Args:
        processed: the pair.
        view: LEFT or RIGHT.
        width_px: greatest width, px.
    """
    image = processed.pair.left if view is View.LEFT else processed.pair.right
    height, width = image.shape[:2]
    most_px = max(1, min(width, width_px) * max(width, height) // width)
    return Part({"name": view.value, "type": "image/jpeg"}, photograph(image, most_px))


def disparity(values: Disparity, width_px: int, *, packed: bool) -> Part:
    """Encode a disparity map as a grid of uint16, little endian: 0 = none, else d = low + (v - 1) / scale px.

    Rows and columns are left out, not averaged: every value is a measured one.

    Args:
        values: (H, W) float32, px, NaN = none.
        width_px: greatest width of the grid, px.
        packed: whether to deflate it (RFC 1950). On the same machine that takes longer than it saves.
    """
    step = max(1, math.ceil(values.shape[1] / width_px))
    small = values[::step, ::step]
    known = np.isfinite(small)
    low, high = (float(small[known].min()), float(small[known].max())) if known.any() else (0.0, 1.0)
    scale = min(_STEPS_PER_PX, (_MOST_CELL - 1) / max(high - low, 1e-3))
    with np.errstate(invalid="ignore"):
        cells = np.where(known, np.rint((small - low) * scale) + 1, 0).astype("<u2")
    data = cells.tobytes()
    kind = "u16+deflate" if packed else "u16"
    rows, columns = cells.shape
    grid = {"width": columns, "height": rows, "step": step, "low": low, "scale": scale}
    return Part({"name": "disparity", "type": kind, **grid}, zlib.compress(data, 1) if packed else data)


def message(number: int, processed: Processed, ledger: PairLedger, parts: tuple[Part, ...], begun: int = 0) -> bytes:
    """Put a message together.

    Args:
        number: of the result.
        processed: the pair.
        ledger: its delays.
        parts: its encoded parts.
        begun: number of its run.
    """
    height, width = processed.pair.left.shape[:2]
    header = {
        "kind": "pair",
        "number": number,
        "begun": begun,
        "width": width,
        "height": height,
        "parts": [{**part.entry, "bytes": len(part.data)} for part in parts],
        "way": processed.pair.epipolar.way,
        "ledger": {f"{name}_ms": getattr(ledger, f"{name}_ns") / 1e6 for name in (*DELAYS, "time_skew")},
        **_depth(processed),
    }
    text = json_text(header).encode()
    return b"".join((struct.pack("<I", len(text)), text, *(part.data for part in parts)))


def taken_apart(data: bytes) -> tuple[dict[str, object], tuple[bytes, ...]]:
    """Take a message apart; for programs that read `/ws`, and tests.

    Returns:
        The header and the parts' bytes.

    Raises:
        ValueError: it is no such message.
    """
    if len(data) < 4 or len(data) < (at := 4 + struct.unpack_from("<I", data)[0]):
        raise ValueError("the message is cut short")
    header: dict[str, object] = json.loads(data[4:at])
    entries = header["parts"]
    if not isinstance(entries, list) or at + sum(entry["bytes"] for entry in entries) != len(data):
        raise ValueError("the message's length is not that of its parts")
    parts = []
    for entry in entries:
        parts.append(data[at : at + entry["bytes"]])
        at += entry["bytes"]
    return header, tuple(parts)


def _depth(processed: Processed) -> dict[str, object]:
    """Return what turns disparity into metres and colours."""
    geometry, limits = processed.geometry, processed.limits
    near = None if limits is None or not limits.near_m else limits.near_m
    known: dict[str, object] | None = None
    if geometry is not None:
        known = {
            "focal": geometry.focal_px,
            "baseline": geometry.baseline_m,
            "doffs": geometry.doffs_px,
            "cx": geometry.cx_px,
            "cy": geometry.cy_px,
            "error": 0.0 if limits is None else limits.disparity_error_px,
        }
    return {
        "geometry": known,
        "near": near,
        "far": None if limits is None else limits.far_m,
        "range": _range_px(processed),
    }


def _range_px(processed: Processed) -> tuple[float, float] | None:
    """Return the disparities of the colours' ends: of what is shown, so that what limits cut uses up no colours."""
    disparity, cloud = processed.disparity, processed.cloud
    if disparity is None:
        return None
    if cloud is None:
        return colour_range_px(disparity)
    kept = np.where(np.isfinite(cloud[::2, ::2, 2]), disparity[::2, ::2], np.float32(np.nan))
    return colour_range_px(kept if np.isfinite(kept).any() else disparity)
