"""Begins a recording: the file, and what is known before the first frame."""

from collections.abc import Mapping
from pathlib import Path

from common import now
from common.errors import SettingsError, UnavailableError
from common.protocol.message import CameraDescription
from common.recording.layout import ABOUT, About, camera_info_topic
from common.recording.recording_file import RecordingFile
from common.recording.ros_messages import CameraInfo, camera_info_message
from common.versions import all_versions
from phone_host.model import CameraModel, Lens, Rectification, Rig, Side
from phone_host.recording.recorder import Recorder
from phone_host.stereo.rectify import rectify_rig
from phone_host.stream.demand_clock import has_own_time

_LENSES = {Lens.PINHOLE: ("plumb_bob", 5), Lens.RATIONAL: ("rational_polynomial", 8), Lens.FISHEYE: ("equidistant", 4)}


def begin_recording(
    path: Path,
    camera: CameraDescription,
    board_side: Side,
    rig: Rig | None = None,
    attached: Mapping[str, bytes] | None = None,
) -> Recorder:
    """Begin a recording.

    Args:
        path: the file; it must not exist.
        camera: the host's camera.
        board_side: the side on which the board's camera stands.
        rig: for what is known of both cameras; None: nothing is.
        attached: files to be kept in it, by name.

    Raises:
        SettingsError: the host's camera has no clock.
        UnavailableError: the file exists or cannot be made.
    """
    if not has_own_time(camera.pacing):
        raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
    file = RecordingFile(path)
    try:
        return _begun(file, camera, board_side, rig, attached or {})
    except OSError as error:
        _drop(file)
        raise UnavailableError(
            f"{path} cannot be written ({error.strerror})", "make room, or name another file"
        ) from None
    except BaseException:
        _drop(file)
        raise


def _drop(file: RecordingFile) -> None:
    """Remove a recording that holds nothing yet: the next try may use its name again."""
    file.abandon()
    file.path.unlink(missing_ok=True)


def _begun(
    file: RecordingFile, camera: CameraDescription, board_side: Side, rig: Rig | None, attached: Mapping[str, bytes]
) -> Recorder:
    unix_ns = now.unix_offset_ns()
    at_ns = unix_ns + now.monotonic_ns()
    about = About(unix_ns=unix_ns, board_side=board_side.value, host_boot_id=now.boot_id(), versions=all_versions())
    file.tell(ABOUT, about.values())
    for name, data in attached.items():
        file.attach(name, "application/octet-stream", data, at_ns)
    for side, info in () if rig is None else camera_infos(rig, rectify_rig(rig), at_ns):
        data = camera_info_message(info)
        file.add(camera_info_topic(side.value), data, sequence=0, log_ns=at_ns, publish_ns=at_ns)
    recorder = Recorder(file, board_side, unix_ns)
    recorder.own_camera(camera)
    return recorder


def camera_infos(rig: Rig, rectification: Rectification, stamp_ns: int) -> tuple[tuple[Side, CameraInfo], ...]:
    """Return what ROS calls camera_info of both cameras.

    Args:
        rig: the cameras.
        rectification: how their images are rectified.
        stamp_ns: when, ns since 1970.
    """
    left = _info(Side.LEFT, rig.left, rectification, stamp_ns)
    return (Side.LEFT, left), (Side.RIGHT, _info(Side.RIGHT, rig.right, rectification, stamp_ns))


def _info(side: Side, camera: CameraModel, rectification: Rectification, stamp_ns: int) -> CameraInfo:
    is_left = side is Side.LEFT
    coefficients = [float(value) for value in camera.distortion.ravel()]
    is_rational = camera.lens is Lens.PINHOLE and len(coefficients) > _LENSES[Lens.PINHOLE][1]
    model, count = _LENSES[Lens.RATIONAL if is_rational else camera.lens]
    return CameraInfo(
        stamp_ns=stamp_ns,
        frame_id=side.value,
        size_px=(camera.width_px, camera.height_px),
        model=model,
        distortion=[*coefficients, *[0.0] * (count - len(coefficients))],
        matrix=[float(value) for value in camera.matrix.ravel()],
        rotation=[float(v) for v in (rectification.R_left if is_left else rectification.R_right).ravel()],
        projection=[float(v) for v in (rectification.P_left if is_left else rectification.P_right).ravel()],
    )
