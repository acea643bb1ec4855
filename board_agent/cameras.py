"""The cameras of this machine: formats, sizes, rates and controls, as a table for people or as plain values for JSON."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from common.camera.v4l2_controls import Control
from common.camera.v4l2_device import Device, Identity, capture_nodes, serial_number
from common.camera.v4l2_formats import PREFERENCE, FormatOffer, Rates, rate_text
from common.errors import UnavailableError

_KNOWN = {letters: kind.value for letters, kind in PREFERENCE}


@dataclass(frozen=True, slots=True, kw_only=True)
class Listed:
    """One camera.

    Attributes:
        path: its persistent name.
        node: the node behind that name.
        identity: what the node says about itself.
        serial: serial number of the USB device; empty if it has none.
        formats: each encoding, with the rates of each of its sizes.
        controls: each control with its value; None if it cannot be read.
    """

    path: Path
    node: Path
    identity: Identity
    formats: tuple[tuple[FormatOffer, tuple[tuple[tuple[int, int], Rates], ...]], ...]
    controls: tuple[tuple[Control, int | None], ...]
    serial: str = ""


def list_cameras() -> list[Listed]:
    """Query every capture node of this machine. Metadata nodes are left out, as are cameras that vanish meanwhile."""
    found = []
    for path in capture_nodes():
        try:
            with Device(path) as device:
                found.append(_ask(device))
        except (UnavailableError, OSError):
            continue
    return found


def table(cameras: list[Listed]) -> str:
    """The cameras as text."""
    if not cameras:
        return "no camera was found: plug one in"
    return "\n\n".join("\n".join(_lines(camera)) for camera in cameras)


def values(cameras: list[Listed]) -> dict[str, Any]:
    """The cameras as one JSON object."""
    return {"cameras": [_values(camera) for camera in cameras]}


def _ask(device: Device) -> Listed:
    formats = []
    for offer in device.formats():
        sizes = offer.sizes_px or _ends(offer)
        formats.append((offer, tuple((size_px, device.rates(offer.letters, size_px)) for size_px in sizes)))
    controls = tuple((control, _read(device, control)) for control in device.controls())
    return Listed(
        path=device.path,
        node=device.path.resolve(),
        identity=device.identity,
        serial=serial_number(device.path),
        formats=tuple(formats),
        controls=controls,
    )


def _ends(offer: FormatOffer) -> tuple[tuple[int, int], ...]:
    """Smallest and largest size of a scaling camera."""
    if offer.size_range is None:
        return ()
    (w0, w1, _), (h0, h1, _) = offer.size_range.width_px, offer.size_range.height_px
    return (w0, h0), (w1, h1)


def _read(device: Device, control: Control) -> int | None:
    if not control.can_be_read:
        return None
    try:
        return device.control(control.id)
    except OSError:
        return None


def _lines(camera: Listed) -> list[str]:
    said = camera.identity
    known = [said.driver, said.bus, *([f"serial {camera.serial}"] if camera.serial else [])]
    lines = [f"{camera.path}", f"  {said.card} ({', '.join(known)}) {camera.node}"]
    lines += ["", f"  {'format':8} {'as':8} {'size':>11}  frames per second"]
    for offer, sizes in camera.formats:
        if (name := _KNOWN.get(offer.letters)) is None:
            continue
        for width, height, rates in ((*size, rates) for size, rates in sizes):
            lines.append(f"  {offer.letters:8} {name:8} {f'{width}x{height}':>11}  {rates}")
    if unused := [offer.letters for offer, _ in camera.formats if offer.letters not in _KNOWN]:
        lines.append(f"  not used: {', '.join(unused)}")
    if camera.controls:
        lines += ["", f"  {'control':32} {'value':>8} {'default':>8}  range"]
    for control, value in camera.controls:
        shown = "-" if value is None else str(value)
        lines.append(f"  {control.name[:32]:32} {shown:>8} {control.default:>8}  {_range(control)}")
    return lines


def _range(control: Control) -> str:
    if control.menu:
        return ", ".join(f"{index} {name}" for index, name in control.menu)
    step = f" by {control.step}" if control.step > 1 else ""
    return f"{control.minimum} to {control.maximum}{step}"


def _values(camera: Listed) -> dict[str, Any]:
    return {
        "path": str(camera.path),
        "node": str(camera.node),
        "driver": camera.identity.driver,
        "card": camera.identity.card,
        "bus": camera.identity.bus,
        "serial": camera.serial,
        "formats": [
            {
                "letters": offer.letters,
                "format": _KNOWN.get(offer.letters),
                "scales": offer.size_range is not None,
                "sizes": [
                    {
                        "size": f"{size_px[0]}x{size_px[1]}",
                        "fps": [float(rate_text(rate)) for rate in rates.named_hz],
                        "fps_range": [float(rate) for rate in rates.between_hz or ()],
                    }
                    for size_px, rates in sizes
                ],
            }
            for offer, sizes in camera.formats
        ],
        "controls": [
            {
                "name": control.name,
                "id": control.id,
                "value": value,
                "default": control.default,
                "minimum": control.minimum,
                "maximum": control.maximum,
                "step": control.step,
                "menu": {str(index): name for index, name in control.menu},
            }
            for control, value in camera.controls
        ],
    }
