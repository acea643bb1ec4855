"""phone-host doctor: everything that prevents a run of the host, each with its remedy.

What board and host share is in common/doctor. The installed packages may be broken, so nothing that needs numpy or
OpenCV is imported before both are known to work.
"""

import errno
import importlib
import os
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from common import now
from common.android import is_android
from common.camera.base import origin_words
from common.camera.v4l2_device import capture_nodes
from common.diagnostic import Diagnostic, Severity
from common.doctor import machine
from common.doctor.access import check_access
from common.doctor.camera_probe import examine_camera
from common.doctor.finding import fail, ok
from common.doctor.machine_checks import check_bluetooth, check_clocks, check_disk, check_power, check_usb_log
from common.doctor.network_probe import examine_network
from common.doctor.package_probe import missing_packages
from common.doctor.unit_check import Unit
from common.errors import SettingsError, TandemError, UnavailableError
from common.keys import KeyFolder
from common.link.factory import parse_link
from common.places import Kind, nearest
from common.stamp import HOST_CLOCK
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.camera.uris import is_browser, is_http
from phone_host.doctor.host_checks import (
    OPENCV_WHEELS,
    Answer,
    BoardReadings,
    Package,
    Phone,
    check_board,
    check_camera,
    check_native,
    check_out,
    check_package,
    check_phone,
    check_ports,
    check_python,
    check_usb,
)
from phone_host.doctor.host_checks import check_bluetooth as check_android_bluetooth
from phone_host.native.library import VARIABLE, native

_CONNECT_S: Final = 2.0

FURTHER_MODULES: Final = ("aiohttp", "rich", "segno", "yaml", *(() if is_android() else ("zeroconf",)), "cryptography")
"""Modules of every installation of the host whose versions the doctor does not judge (pyproject.toml, dependencies)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What a run would use.

    Attributes:
        camera: URI of the host camera; empty: none given.
        links: URIs of the links to the board; empty: none given.
        calibration: rig.yaml; empty: none given.
        out: folder of the results.
        wait_s: how long to wait for the board, s.
        keys: folder of this host's key and the boards that it knows.
        data: folder of this user's data, where a check of the camera's images is kept if there is no calibration.
        feed: brings browsers that give their cameras; None: there is no page.
    """

    camera: str
    links: tuple[str, ...]
    calibration: str
    out: Path
    wait_s: float
    keys: KeyFolder
    data: Path
    feed: BrowserFeed | None = None


def examine(question: Question, *, keeps: bool = True) -> Iterator[Diagnostic]:
    """Check this machine for a run.

    Yields:
        The findings, in the order in which problems arise.

    Raises:
        SettingsError: a URI is invalid.
    """
    account = machine.own_account()
    yield check_python(sys.version_info[:3], sys.platform)
    if is_android():
        yield check_phone(_phone())
    packages = [*map(check_package, _packages()), *missing_packages(FURTHER_MODULES)]
    yield from packages
    yield native_finding()
    works = all(finding.severity is not Severity.FAIL for finding in packages)
    if is_http(question.camera) or is_browser(question.camera):
        yield _far_camera(question.camera, question.feed)
    elif question.camera.startswith("v4l2:") and is_android():
        yield check_camera(question.camera)
    elif question.camera:
        yield from examine_camera(question.camera, account, Unit("phone-host"))
    else:
        yield _cameras()
    yield from _local_links(question.links)
    if not question.links:
        yield ok("board", "not asked: give --link")
    for uri in question.links:
        yield from _examine_board(uri, question.wait_s, question.keys, works=works)
    if works and (question.calibration or question.camera):
        from phone_host.doctor import rig_checks, vision_checks  # noqa: PLC0415 - numpy and OpenCV, seen to work

        if question.calibration:
            yield rig_checks.check_rig(vision_checks.read_rig_readings(question.calibration, question.camera))
        if keeps and question.camera:
            yield from vision_checks.check_kept_capture(
                question.calibration, question.camera, question.data, question.feed
            )
    yield from check_clocks(machine.read_clocks(Path(__file__).parent))
    yield from examine_out(question.out)
    if not is_android():  # which shows the kernel's log to nobody
        log = machine.read_kernel_log()
        yield check_power(log, machine.read_supply())
        yield check_usb_log(log)


def native_finding() -> Diagnostic:
    """Check the native library, with which the own matcher computes."""
    try:
        return check_native(native(), os.environ.get(VARIABLE, ""))
    except SettingsError as error:
        return check_native(error)


def examine_out(out: Path) -> list[Diagnostic]:
    """Check the folder of the results, or where it would be made, as a run would find it."""
    try:
        there, kind = nearest(out)
        disk = machine.read_disk(there)
    except OSError as error:
        return check_out(str(out), error.strerror or str(error))
    if kind is not Kind.FOLDER:
        return check_out(str(out), f"{there} is {kind.value}, not a folder")
    may_write = os.access(there, os.W_OK | os.X_OK)
    return [*check_out(str(out), "" if may_write else os.strerror(errno.EACCES)), check_disk(disk)]


def _packages() -> list[Package]:
    # Termux's own package bears the names of several wheels and is one.
    wheels = () if is_android() else tuple(name for name in OPENCV_WHEELS if _is_installed(name))
    numpy = _package("numpy", "1.24")
    # OpenCV needs numpy, and prints lines of its own where it is missing.
    opencv = [] if numpy.problem else [_package("cv2", "4.10", "5", wheels)]
    return [numpy, *opencv, _package("zmq", "24"), _package("msgpack", "1.0.3")]


def _is_installed(distribution: str) -> bool:
    try:
        metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return False
    return True


def _package(name: str, least: str, below: str = "", wheels: tuple[str, ...] = ()) -> Package:
    try:
        module = importlib.import_module(name)
    except Exception as error:  # noqa: BLE001 - a broken package may raise anything (ImportError, AttributeError, OSError)
        return Package(
            name=name, version="", problem=f"{type(error).__name__}: {error}", least=least, below=below, wheels=wheels
        )
    version = getattr(module, "__version__", None) or ".".join(map(str, getattr(module, "version", ())))
    return Package(name=name, version=str(version), problem="", least=least, below=below, wheels=wheels)


def _far_camera(uri: str, feed: BrowserFeed | None) -> Diagnostic:
    """Look at a camera whose images come over a network."""
    if is_browser(uri) and feed is None:
        remedy = "start phone-host serve, and press Check on its page"
        return ok("camera", f"{uri} comes with the page, where it is checked: {remedy}")
    try:
        camera = open_camera(uri, HOST_CLOCK, now.monotonic_ns(), feed=feed)
    except UnavailableError as error:
        return fail("camera", error.problem, error.remedy)
    shown, origin = camera.description, camera.health.origin
    camera.close()
    text = f"{shown.name}: {shown.width_px}x{shown.height_px} every {shown.period_ns / 1e6:.1f} ms"
    return ok("camera", text if origin is None else f"{text}; {origin_words(origin)}")


def _phone() -> Phone:
    maker, model = (machine.read_property(f"ro.product.{name}") for name in ("manufacturer", "model"))
    version, shop = (os.environ.get(name, "") for name in ("TERMUX_VERSION", "TERMUX_APK_RELEASE"))
    return Phone(
        model=f"{maker} {model}".strip(),
        android=machine.read_property("ro.build.version.release"),
        termux=f"{version} {shop}".strip(),
        processor=os.uname().machine,
    )


def _local_links(links: tuple[str, ...]) -> list[Diagnostic]:
    """Check what there is besides the network: USB and Bluetooth."""
    wireless = [uri for uri in links if uri.startswith("rfcomm:")]
    if is_android():
        cables = [uri for uri in links if uri.startswith("serial:")]
        return [check_usb(machine.read_cards(), cables), check_android_bluetooth(wireless)]
    return [_ports(), check_bluetooth(machine.read_bluetooth(), wanted=bool(wireless))]


def _cameras() -> Diagnostic:
    if is_android():
        return check_camera()
    nodes = capture_nodes()
    text = f"{', '.join(map(str, nodes))}; give one with --camera" if nodes else "no camera of this machine is seen"
    return ok("camera", text)


def _ports() -> Diagnostic:
    try:
        from serial.tools import list_ports  # noqa: PLC0415 - optional, and an ImportError where its platform is unknown
    except ImportError as error:
        return check_ports((), str(error))
    found = sorted(port for port in list_ports.comports() if "ttyS" not in port.device)
    return check_ports(tuple(f"{port.device} ({port.description})" for port in found), "")


def _examine_board(uri: str, wait_s: float, keys: KeyFolder, *, works: bool) -> list[Diagnostic]:
    """Check the way to the board and, if the packages work, ask the board itself."""
    link = parse_link(uri, listens_by_default=False)
    address = link.address
    findings = examine_network(link)
    if address.startswith("serial:") and (node := machine.read_node(Path(address.removeprefix("serial:")))) is not None:
        findings.append(check_access("permission", node, machine.own_account()))
    if not works:
        return [*findings, check_board(BoardReadings(uri=uri, answer=_way(address), waited_s=0.0))]
    from phone_host.doctor.vision_checks import ask_board  # noqa: PLC0415 - numpy and OpenCV, seen to work

    try:
        board = ask_board(uri, wait_s, keys)
    except TandemError as error:
        return [*findings, fail("board", error.problem, error.remedy)]
    if board.answer is Answer.BOARD:  # whatever way it came
        findings = [finding for finding in findings if finding.severity is not Severity.FAIL]
    if board.answer is Answer.SILENT:
        board = BoardReadings(uri=board.uri, answer=_way(address), waited_s=board.waited_s)
    return [*findings, check_board(board)]


def _way(address: str) -> Answer:
    """Return why a board is silent, as far as the network can tell."""
    if not address.startswith("tcp:"):
        return Answer.SILENT
    parts = urlsplit(address)
    try:
        socket.create_connection((parts.hostname, parts.port or 0), _CONNECT_S).close()
    except ConnectionRefusedError:
        return Answer.REFUSED
    except socket.gaierror:
        return Answer.UNKNOWN_NAME
    except OSError:
        return Answer.NO_WAY
    return Answer.SILENT
