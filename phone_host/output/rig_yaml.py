"""rig.yaml: a calibrated rig as OpenCV FileStorage YAML, readable by `cv2.FileStorage` anywhere.

Keys: format_version (absent: 1); left_image_width, left_image_height, right_image_width, right_image_height (px); M1 D1
M2 D2 (camera matrices and distortion, left and right); lens1, lens2 (what the distortion means: pinhole, rational or fisheye;
absent: pinhole with 4 or 5 coefficients, rational with more); R T (right from left, T in metres); R1 R2 P1 P2 Q
(rectification); rectified_image_width, rectified_image_height (the size for which P1 and P2 hold); board_side; rms_left
rms_right rms_stereo (px, .Nan = unknown); zero_sigma (standard uncertainty of the disparity of infinitely far points, px;
absent or .Nan: not measured); verdict (good, usable, reject; absent: not stated); left_camera, right_camera (see
`rig_cameras`); time_offset_ns, time_offset_uncertainty_ns (host's stamp minus board's;
absent: not measured); how well all of it is known, and views (see `rig_views`). This program reads only the rig and computes the rectification from it. R1 to Q are there for
other programs; a rig that they contradict is refused. Of a file from format 2 on nothing may be missing but verdict, cameras,
uncertainties and views: one that was cut off would lose its verdict without a word.
"""

from pathlib import Path

import cv2

from common.byte_order_mark import UTF_8_MARK
from common.versions import RIG_FORMAT
from phone_host.model import Rectification, Rig, Side, TimeOffset
from phone_host.output.atomic import write_text
from phone_host.output.rig_agreement import require_agreement, require_own_focal
from phone_host.output.rig_cameras import lens_of, write_camera
from phone_host.output.rig_reader import RigReader
from phone_host.output.rig_views import RigViews, write_sigmas, write_views


def write_rig(path: Path, rig: Rig, rectification: Rectification, views: RigViews | None = None) -> None:
    """Write a rig and its rectification.

    Args:
        path: the file; it appears whole or not at all.
        rig: the two cameras.
        rectification: computed from the same rig.
        views: what it was computed from; None: not known.

    Raises:
        OSError: the file cannot be written.
    """
    storage = cv2.FileStorage(".yaml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("format_version", RIG_FORMAT)
    storage.write("left_image_width", rig.left.width_px)
    storage.write("left_image_height", rig.left.height_px)
    storage.write("right_image_width", rig.right.width_px)
    storage.write("right_image_height", rig.right.height_px)
    storage.write("board_side", rig.board_side.value)
    storage.write("lens1", lens_of(rig.left).value)
    storage.write("lens2", lens_of(rig.right).value)
    storage.write("M1", rig.left.matrix)
    storage.write("D1", rig.left.distortion.reshape(1, -1))
    storage.write("M2", rig.right.matrix)
    storage.write("D2", rig.right.distortion.reshape(1, -1))
    storage.writeComment("a point of the left camera's axes is R p + T in the right camera's; T in metres")
    storage.write("R", rig.R_right_left)
    storage.write("T", rig.t_right_left_m.reshape(3, 1))
    storage.writeComment("rectification: rotations, projections (metres), disparity to metres, size of both images")
    storage.write("R1", rectification.R_left)
    storage.write("R2", rectification.R_right)
    storage.write("P1", rectification.P_left)
    storage.write("P2", rectification.P_right)
    storage.write("Q", rectification.Q)
    storage.write("rectified_image_width", rectification.width_px)
    storage.write("rectified_image_height", rectification.height_px)
    storage.writeComment("reprojection errors of the calibration, px")
    storage.write("rms_left", rig.rms_left_px)
    storage.write("rms_right", rig.rms_right_px)
    storage.write("rms_stereo", rig.rms_stereo_px)
    storage.writeComment("standard uncertainty of the disparity of infinitely far points, px; what the rig is good for")
    storage.write("zero_sigma", rig.zero_sigma_px)
    if rig.verdict is not None:
        storage.write("verdict", rig.verdict.value)
    for key, camera in (("left_camera", rig.left_camera), ("right_camera", rig.right_camera)):
        if camera is not None:
            write_camera(storage, key, camera)
    storage.writeComment(
        "the host camera's stamp minus the board camera's for one moment, ns, and what contains it in 99.9 %"
    )
    # Written as reals: FileStorage's integers have 32 bits, which is 2 s.
    storage.write("time_offset_ns", float(rig.time_offset.offset_ns))
    storage.write("time_offset_uncertainty_ns", float(rig.time_offset.uncertainty_ns))
    write_sigmas(storage, rig)
    if views is not None:
        storage.writeComment("what the rig was computed from: calibrate --from adds to it")
        write_views(storage, views)
    write_text(path, storage.releaseAndGetString())


def write_time_offset(path: Path, offset: TimeOffset) -> None:
    """Put a time offset into a rig.yaml; everything else in it stays as it is.

    Raises:
        OSError: the file cannot be written.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("time_offset_ns:", "time_offset_uncertainty_ns:"))]
    values = [f"time_offset_ns: {offset.offset_ns}.", f"time_offset_uncertainty_ns: {offset.uncertainty_ns}."]
    write_text(path, "\n".join([*kept, *values]) + "\n")


def read_rig(path: Path, content: bytes | None = None) -> Rig:
    """Read a rig and check it.

    Args:
        path: a rig.yaml of this program, or any FileStorage file with the same keys.
        content: what is in it, if it lies in another file; then the path only names it in errors.

    Raises:
        DataError: the file is missing or not FileStorage YAML, or a key is missing or not valid; names file and key.
    """
    reader = _opened(path, content)
    reader.require_all_keys()
    baseline_m = reader.baseline("T")
    left = reader.camera_model("left", "1")
    right = reader.camera_model("right", "2")
    side = reader.text("board_side", Side.LEFT.value)
    if side not in {choice.value for choice in Side}:
        raise reader.problem("board_side", f"is {side!r}", "write left or right")
    rotation = reader.rotation("R")
    kept = reader.rectification()
    require_agreement(kept, rotation, baseline_m, reader.problem)
    if reader.is_whole:
        require_own_focal(kept, left, right, reader.problem)
    return Rig(
        left=left,
        right=right,
        R_right_left=rotation,
        t_right_left_m=baseline_m,
        board_side=Side(side),
        rms_left_px=reader.error_px("rms_left"),
        rms_right_px=reader.error_px("rms_right"),
        rms_stereo_px=reader.error_px("rms_stereo"),
        time_offset=reader.time_offset(),
        zero_sigma_px=reader.error_px("zero_sigma"),
        verdict=reader.verdict(),
        left_camera=reader.camera("left_camera", left),
        right_camera=reader.camera("right_camera", right),
        covariance=reader.covariance(),
    )


def read_rig_views(path: Path) -> RigViews | None:
    """Read what a rig was computed from: the views; None if the file has none.

    Raises:
        DataError: the views are not valid; names file and key.
    """
    return _opened(path).views()


def _opened(path: Path, content: bytes | None = None) -> RigReader:
    reader = RigReader(path, content)
    reader.require_known_format()
    return reader


def is_rig(path: Path) -> bool:
    """Return whether a file begins like FileStorage YAML, or like a rig.yaml that lost its first line. False also for a file that cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(16).removeprefix(UTF_8_MARK).startswith((b"%YAML", b"format_version:"))
    except OSError:
        return False
