"""A run and its rig's two cameras, over a real link: turned images, locks that are restored, other cameras that are refused."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest

from common import now
from common.camera.factory import turned
from common.camera.replay import ReplayCamera, ReplaySettings
from common.camera_identity import CameraIdentity, Lock, RememberedCamera
from common.errors import DataError
from common.link.factory import open_link, parse_link
from common.orientation import Orientation
from common.protocol.message import Locks
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.run_rules import concerns
from phone_host.model import CameraModel, Rig
from phone_host.output.cameras_json import read_cameras
from phone_host.output.rig_yaml import write_rig
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_rig
from tests.support.board_thread import board_of
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, write_film
from tests.support.planes import plane
from tests.support.point_files import read_pfm
from tests.support.programs import board, host

LEFT = CameraIdentity("uvcvideo", "HD Pro Webcam C920", "A1")
RIGHT = CameraIdentity("uvcvideo", "USB Camera", "")


def level_rig(width_px: int, height_px: int) -> Rig:
    """Two equal cameras side by side, 100 mm apart, without distortion: their images are rectified already."""
    centre = (width_px - 1) / 2, (height_px - 1) / 2
    matrix = np.array([[300.0, 0, centre[0]], [0, 300.0, centre[1]], [0, 0, 1]])
    model = CameraModel(width_px=width_px, height_px=height_px, matrix=matrix, distortion=np.zeros(4))
    return Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))


def test_turned_cameras_and_a_rig_give_the_depth_of_upright_ones(tmp_path: Path) -> None:
    """The board's camera hangs on its head, the host's lies on its side: both programs are told so, and the disparity is the plane's."""
    scene = plane(shortest_px=14.0)
    for name, image, quarters in (("board", scene.pair.left, 2), ("host", scene.pair.right, 1)):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "0.png"), np.ascontiguousarray(np.rot90(image, quarters)))
    rig, link = level_rig(320, 160), f"ipc://{tmp_path}/link"
    write_rig(tmp_path / "rig.yaml", rig, rectify_rig(rig))
    out = tmp_path / "out"
    own = f"replay:{tmp_path}/host?pace=demand&rotate=90"
    options = ["--calibration", str(tmp_path / "rig.yaml"), "--disparities", "48", "--pairs", "1", "--out", str(out)]
    theirs = f"replay:{tmp_path}/board?pace=demand&rotate=180"
    with (
        board(["run", "--camera", theirs, "--link", link], tmp_path),
        host(["run", "--camera", own, "--link", link, *options], tmp_path) as running,
    ):
        assert running.wait() == 0, running.stderr
    error = np.abs(read_pfm(out / "pair-000000" / "disparity.pfm") - scene.disparity_px)[20:-20, 60:-20]
    assert np.isfinite(error).mean() > 0.8
    assert np.nanmedian(error) < 0.1
    left, right = read_cameras(out / "cameras.json")
    assert (left.orientation, right.orientation) == (Orientation(180), Orientation(90))
    assert (left.upright_px, right.upright_px) == ((320, 160), (320, 160))
    assert (right.width_px, right.height_px) == (160, 320)


class StudioCamera(ReplayCamera):
    """A film that says it comes from a certain device, whose focus and zoom can be held. The zoom ends at 300.

    Args:
        folder: the film.
        identity: of the device.
    """

    def __init__(self, folder: Path, identity: CameraIdentity) -> None:
        settings = ReplaySettings(path=str(folder), fps=Fraction(30), loop=True, clock="any")
        super().__init__(settings, now.monotonic_ns())
        controls = ((Lock.FOCUS, 0), (Lock.ZOOM, 100))
        self.description = replace(self.description, identity=identity, controls=controls)
        self.held_locks: Locks = ()

    def hold(self, locks: Locks, now_ns: int) -> None:
        """Hold what the device has."""
        del now_ns
        least_most = {Lock.FOCUS: (0, 250), Lock.ZOOM: (100, 300)}
        self.held_locks = tuple(
            (lock, min(max(value, least_most[lock][0]), least_most[lock][1]))
            for lock, value in locks
            if lock in least_most
        )


def calibrated(left: RememberedCamera, right: RememberedCamera) -> StereoCore:
    """A core whose rig states its cameras."""
    rig = replace(level_rig(WIDTH_PX, HEIGHT_PX), left_camera=left, right_camera=right)
    return StereoCore(create_matcher(MatchSettings(MatcherName.BLOCK, 16)), Rectifier(rig))


def studio_run(tmp_path: Path, core: StereoCore, until: Callable[[Host], bool]) -> tuple[Host, EndReason]:
    """Run the board's left and this machine's right camera until a condition holds."""
    film, link = write_film(tmp_path / "film", 30), f"ipc://{tmp_path}/link"
    with board_of(turned(StudioCamera(film, LEFT), Orientation(180)), link):
        settings = HostSettings(out=tmp_path / "out", save_every=0)
        running = Host(
            settings, StudioCamera(film, RIGHT), [open_link(parse_link(link, listens_by_default=False))], core
        )
        try:
            ended = running.run(lambda: until(running))
        finally:
            running.write_report({})
    return running, ended


def state(identity: CameraIdentity, orientation: Orientation = Orientation(), **locks: int) -> RememberedCamera:  # noqa: B008
    """A camera of the rig."""
    return RememberedCamera(identity, WIDTH_PX, HEIGHT_PX, orientation, tuple(locks.items()))


def test_a_run_restores_what_the_rig_was_calibrated_with(tmp_path: Path) -> None:
    """Both cameras are held as the rig says; what a camera cannot do is a concern that names it; cameras.json tells what is held."""
    core = calibrated(state(LEFT, Orientation(180), focus=20, zoom=400), state(RIGHT, focus=30, exposure_us=8000))

    def answered(running: Host) -> bool:
        return len(running.snapshot().missed_locks) == 2

    running, ended = studio_run(tmp_path, core, answered)
    assert ended is EndReason.STOPPED
    (concern,) = [each for each in concerns(running.snapshot("stopped")) if each.code == Code.CAMERA_SETTINGS]
    assert "the left camera's zoom is 300 instead of 400" in concern.message
    assert "the right camera's exposure_us is not held instead of 8000" in concern.message
    left, right = read_cameras(tmp_path / "out" / "cameras.json")
    assert left == state(LEFT, Orientation(180), focus=20, zoom=300)
    assert right == state(RIGHT, focus=30)


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (state(CameraIdentity("uvcvideo", "HD Pro Webcam C920", "B2")), state(RIGHT), "the rig's left camera was"),
        (state(LEFT), state(RIGHT), "with rotate=180, but the rig was calibrated with neither"),
        (state(LEFT, Orientation(180)), state(LEFT), "this machine's camera is USB Camera"),
    ],
)
def test_other_cameras_end_the_run(left: RememberedCamera, right: RememberedCamera, said: str, tmp_path: Path) -> None:
    """Another serial number, another mounting, or another camera of this machine: bad data, said in one line."""
    with pytest.raises(DataError) as caught:
        studio_run(tmp_path, calibrated(left, right), lambda _: False)
    assert said in str(caught.value)
