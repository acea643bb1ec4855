"""Queries a camera, streams from it for a moment, and lets the checks judge. Uses the same code as `run`."""

import select
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from common import now
from common.camera.factory import open_camera, parse_camera, parse_orientation
from common.camera.v4l2_device import Device, capture_nodes, lasting_name, serial_number, video_nodes
from common.camera.v4l2_formats import Wanted, choose
from common.camera.v4l2_stamps import Tally
from common.camera.v4l2_stream import Stream, V4l2Settings
from common.diagnostic import Diagnostic, Severity
from common.doctor import machine
from common.doctor.access import Account, Node, check_access
from common.doctor.camera_checks import (
    Offered,
    Sample,
    check_absence,
    check_bus,
    check_format,
    check_stream,
    check_taken,
    raw_frame_bytes,
)
from common.doctor.finding import fail, ok
from common.doctor.unit_check import Unit
from common.errors import TakenError, TandemError
from common.frame import Frame
from common.orientation import UPRIGHT, Orientation

_SAMPLE_NS: Final = 1_000_000_000
"""How long frames are taken, starting with the first one."""

_FEW: Final = 9
"""Number of frames to wait for from a slow camera: enough to give a rate."""

_LONGEST_NS: Final = 6_000_000_000
"""Webcams start within 2 s; nine frames at the slowest useful rate take 4 s more."""


def examine_camera(uri: str, account: Account, unit: Unit) -> list[Diagnostic]:
    """Check a camera from its node to its frames.

    Returns:
        The findings, without those that depend on a failed one.

    Raises:
        SettingsError: the URI makes no sense.
    """
    settings = parse_camera(uri, "")
    if not isinstance(settings, V4l2Settings):
        return [_opened(uri)]
    nodes = video_nodes()
    if settings.path:
        path = lasting_name(Path(settings.path))
    elif found := capture_nodes():
        path = lasting_name(found[0])
    else:
        absent = check_absence(len(nodes), machine.read_usb_cameras())
        return [absent, *_denied(nodes, account)]
    return list(_examine(path, settings, _turn_text(parse_orientation(uri)), account, unit))


def _opened(uri: str) -> Diagnostic:
    try:
        camera = open_camera(uri, "", now.monotonic_ns())
    except TandemError as error:
        return fail("camera", error.problem, error.remedy)
    camera.close()
    said = camera.description
    turn = _turn_text(said.orientation)
    return ok("camera", f"{uri} shows images of {said.width_px}x{said.height_px}{turn}")


def _turn_text(orientation: Orientation) -> str:
    return f", to be turned ({orientation})" if orientation != UPRIGHT else ""


def _denied(nodes: list[Path], account: Account) -> Iterator[Diagnostic]:
    """What prevents access to nodes that gave nothing."""
    for path in nodes:
        node = machine.read_node(path)
        if node is not None and (finding := check_access("permission", node, account)).severity is Severity.FAIL:
            yield finding


def _examine(path: Path, settings: V4l2Settings, turn: str, account: Account, unit: Unit) -> Iterator[Diagnostic]:
    node = machine.read_node(path)
    if node is None:
        yield fail(
            "camera", f"{path} is not there", "plug it in, or give one of those that `board-agent cameras` lists"
        )
        return
    access = check_access("permission", node, account)
    try:
        with Device(path) as device:
            device.require_capture()
            offered = _ask(device, settings.wanted)
            identity = device.identity
    except TandemError as error:
        yield fail("camera", error.problem, error.remedy)
        yield access
        return
    except OSError as error:
        yield fail("camera", f"{path} failed ({error.strerror})", "unplug it and plug it in again")
        return
    serial = serial_number(path)
    yield ok("camera", f"{identity.card} ({identity.driver}){f', serial {serial}' if serial else ''} at {path}{turn}")
    yield access
    possible = check_format(str(path), offered, settings.wanted)
    yield possible
    if possible.severity is not Severity.FAIL:
        yield from _streamed(path, node, settings, offered, unit)


def _streamed(path: Path, node: Node, settings: V4l2Settings, offered: Offered, unit: Unit) -> Iterator[Diagnostic]:
    """What streaming shows: it proves that the bus carries what is requested."""
    try:
        sample = _stream(path, settings)
    except TakenError:
        holders, all_seen = machine.holders_of(node.path)
        yield check_taken(holders, unit.pid, unit.status, all_seen=all_seen)
        return
    except TandemError as error:
        yield fail("stream", error.problem, error.remedy)
        return
    except OSError as error:
        remedy = "no room on the USB bus, or a bad cable: another port, format=mjpeg, a smaller size"
        yield fail("stream", f"{path} does not stream ({error.strerror})", remedy)
        return
    frame_bytes = sample.frame_bytes or raw_frame_bytes(offered, settings.wanted)
    bus = machine.read_usb_bus(path)
    if bus is not None and frame_bytes:
        yield check_bus(bus, frame_bytes, 1e9 / sample.nominal_ns)
    yield from check_stream(sample)


def _ask(device: Device, wanted: Wanted) -> Offered:
    """The driver's formats, and the rates of the one that would be chosen."""
    formats = device.formats()
    try:
        choice = choose(formats, wanted, "")
    except TandemError:
        return Offered(formats, {})
    where = choice.letters, choice.size_px
    return Offered(formats, {where: device.rates(*where)})


def _stream(path: Path, settings: V4l2Settings) -> Sample:
    """Stream for a second, starting with the first frame.

    Raises:
        TandemError: the camera cannot be had.
        OSError: the driver failed.
    """
    tally = Tally()
    # Nothing is locked: a moment is too short for the automatic modes, and the next program to open the camera starts afresh anyway.
    stream = Stream(path, settings, replace(settings.wishes, lock=False), tally)
    frames = total_bytes = first_ns = 0
    try:
        stream.start()
        started_ns = now.monotonic_ns()
        poller = select.poll()
        poller.register(stream.fd, select.POLLIN)
        while (elapsed_ns := now.monotonic_ns() - started_ns) < _LONGEST_NS:
            if first_ns and elapsed_ns - first_ns >= _SAMPLE_NS and frames >= _FEW:
                break
            poller.poll((_LONGEST_NS - elapsed_ns) // 1_000_000 + 1)
            for grab in stream.take():
                if isinstance(grab, Frame):  # the tally counts the spoiled ones; a skipped one is no fault
                    frames += 1
                    total_bytes += len(grab.payload)
                    first_ns = first_ns or now.monotonic_ns() - started_ns
        stream.controls.read_exposure()
    finally:
        stream.close()
    return Sample(
        frames=frames,
        spoiled=tuple((fault.value, count) for fault, count in tally.faults.items()),
        missed=tally.missed,
        distrusted=tally.distrusted,
        nominal_ns=stream.period_ns,
        period_ns=tally.rate.period_ns,
        frame_bytes=total_bytes // frames if frames else 0,
        first_ns=first_ns,
        stamps=tally.stamps,
        driver=stream.driver,
        refused=tally.refused,
        exposure_ns=stream.controls.exposure_ns,
    )
