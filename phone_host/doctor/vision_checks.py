"""The doctor's checks that need numpy and OpenCV: ask a board as a run does, and read a rig.

Imported only once both packages are known to work.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from common import now
from common.camera.factory import parse_camera
from common.camera.v4l2_stream import V4l2Settings
from common.diagnostic import Diagnostic
from common.doctor.finding import fail, warn
from common.errors import AbsentBoardError, BusyBoardError, DataError, OtherVersionError, TandemError
from common.keys import KeyFolder
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import camera_orientation, open_camera
from phone_host.camera.uris import is_browser, is_http
from phone_host.doctor.camera_check.words import holds_for, stored_finding
from phone_host.doctor.capture import source_of
from phone_host.doctor.host_checks import Answer, BoardReadings
from phone_host.doctor.rig_checks import RigReadings
from phone_host.model import Side
from phone_host.output.capture_json import capture_path, read_capture
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.rectifier import Rectifier
from phone_host.stream.await_board import BoardPatience, await_board
from phone_host.stream.frame_sink import NoFrames
from phone_host.stream.receiver import Receiver


def ask_board(uri: str, wait_s: float, keys: KeyFolder) -> BoardReadings:
    """Say hello to a board as a host does, and leave again.

    Raises:
        TandemError: the link cannot be opened, or it failed.
    """
    link = open_link(parse_link(uri, listens_by_default=False), keys)
    receiver = Receiver([link], now.random_id(), NoFrames())
    patience = BoardPatience(round(wait_s * 1e9), now.monotonic_ns())
    said = BoardReadings(uri=uri, answer=Answer.BOARD, waited_s=wait_s)
    receiver.start()
    try:
        await_board(receiver, patience, lambda: receiver.hello is not None and receiver.estimate is not None)
    except AbsentBoardError:
        said = replace(said, answer=Answer.SILENT)
    except BusyBoardError:
        said = replace(said, answer=Answer.BUSY)
    except OtherVersionError as error:
        said = replace(said, answer=Answer.OTHER_VERSION, problem=error.problem, remedy=error.remedy)
    finally:
        hello, estimate = receiver.hello, receiver.estimate
        receiver.stop()
    if receiver.failure is not None:
        raise receiver.failure
    if hello is None or estimate is None:
        return said
    size, turn = f"{hello.camera.width_px}x{hello.camera.height_px}", str(hello.camera.orientation)
    serial = hello.camera.identity.serial
    camera = f"{hello.camera.name}{f', serial {serial}' if serial else ''} {size}{f' {turn}' if turn else ''}"
    return BoardReadings(
        uri=uri,
        answer=Answer.BOARD,
        waited_s=0.0,
        camera=camera,
        round_trip_ns=estimate.round_trip_ns,
        uncertainty_ns=estimate.uncertainty_ns,
    )


def read_rig_readings(calibration: str, camera: str) -> RigReadings:
    """Read a rig and compute its rectification.

    Raises:
        SettingsError: the URI is invalid.
    """
    try:
        rig = read_own_rig(Path(calibration))
        Rectifier(rig)
    except TandemError as error:
        return RigReadings(calibration, fail("rig", error.problem, error.remedy))
    own = rig.right if rig.board_side is Side.LEFT else rig.left
    is_ours = is_http(camera) or is_browser(camera)
    asked = parse_camera(camera, "") if camera and not is_ours else None
    asked_px = asked.wanted.size_px if isinstance(asked, V4l2Settings) else None
    return RigReadings(
        path=calibration,
        rms_px=rig.rms_stereo_px,
        baseline_m=float(np.linalg.norm(rig.t_right_left_m)),
        host_size_px=(own.width_px, own.height_px),
        is_rejected=rig.is_rejected,
        asked_size_px=asked_px if asked_px is None else camera_orientation(camera).turned_size(asked_px),
    )


def check_kept_capture(calibration: str, camera: str, data: Path, feed: BrowserFeed | None) -> list[Diagnostic]:
    """Look for the check of a camera's images that is kept beside a calibration, else the one from before it, and whether it holds for this camera.

    Phones stabilise their images, other cameras hardly: of a camera of this machine nothing is said if it was never checked.

    Args:
        calibration: rig.yaml; empty: there is none.
        camera: URI of the host camera.
        data: folder where a check without a calibration is kept.
        feed: brings browsers that give their cameras; None: there is no page.
    """
    may_warp = is_http(camera) or is_browser(camera)
    try:
        beside = read_capture(capture_path(Path(calibration), data)) if calibration else None
        kept = beside or read_capture(capture_path(None, data))
        if kept is None and not may_warp:
            return []
        opened = open_camera(camera, HOST_CLOCK, now.monotonic_ns(), feed=feed)
    except DataError as error:
        return [warn("capture", error.problem, error.remedy)]
    except TandemError:
        return []  # the camera's own finding says so
    opened.close()
    source = source_of(opened)
    if beside is None and kept is not None and not may_warp and not holds_for(kept.source, source):
        return []
    return [stored_finding(kept, source, has_lens=bool(calibration))]
