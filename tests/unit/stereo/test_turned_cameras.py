"""Cameras that are mounted turned: the option in every kind of URI, and upright images out of the pipeline."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common import now
from common.camera.base import Camera, upright_px
from common.camera.factory import parse_camera, parse_orientation
from common.camera.v4l2_stream import V4l2Settings
from common.errors import DataError, SettingsError
from common.orientation import UPRIGHT, Flip, Orientation
from common.protocol.message import FrameMessage
from phone_host.calibration.failure_modes.arrangement import composed
from phone_host.calibration.time_offset.shots import Shot
from phone_host.camera import factory as host_factory
from phone_host.camera.uris import without_orientation
from phone_host.model import FramePair, Image, Side
from phone_host.recording import footage
from phone_host.run.pipeline import Pipeline
from phone_host.stereo.core import StereoCore
from phone_host.stereo.eight_bit import upright
from phone_host.stereo.interpolate import Interpolator
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.raw_images import EncodedImage
from phone_host.stereo.rectifier import Rectifier
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, write_film
from tests.support.oriented import oriented
from tests.support.planes import plane
from tests.support.rigs import small_rig
from tests.unit.stereo.test_enlarged import halved, pair_of

_SCENE = plane(shortest_px=14.0)
QUARTER, HALF, MIRRORED = Orientation(90), Orientation(180), Orientation(270, Flip.H)


def as_mounted(image: Image, orientation: Orientation) -> Image:
    """The image as a camera gives it that is mounted so that `orientation` makes it upright."""
    match orientation.flip:
        case Flip.H:
            image = image[:, ::-1]
        case Flip.V:
            image = image[::-1]
        case Flip.NONE:
            pass
    return np.ascontiguousarray(np.rot90(image, orientation.rotate_deg // 90))  # anticlockwise


def turned_pair(
    left: Image, right: Image, board: Orientation, host: Orientation, asked_px: tuple[int, int]
) -> FramePair:
    """A pair whose two cameras are mounted turned; the board's is the left one. Sizes are the cameras' own."""
    pair = pair_of(as_mounted(left, board), as_mounted(right, host), Side.LEFT, asked_px)
    return replace(pair, board=replace(pair.board, orientation=board))


@pytest.mark.parametrize(("board", "host"), [(HALF, QUARTER), (MIRRORED, UPRIGHT), (QUARTER, Orientation(0, Flip.V))])
def test_depth_of_turned_cameras_is_that_of_upright_ones(board: Orientation, host: Orientation) -> None:
    """The pipeline's images are upright, pixel for pixel, and so is the disparity."""
    left, right = _SCENE.pair.left, _SCENE.pair.right
    core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 48)))
    pipeline = Pipeline(core, Side.LEFT, now.monotonic_ns, host_orientation=host)
    size_px = board.turned_size((left.shape[1], left.shape[0]))
    done = pipeline.process(turned_pair(left, right, board, host, size_px))
    np.testing.assert_array_equal(done.pair.left, left)
    np.testing.assert_array_equal(done.pair.right, right)
    expected = core.compute(left, right, now.monotonic_ns)
    np.testing.assert_array_equal(done.disparity, expected.disparity)


def test_a_smaller_image_of_a_turned_camera_is_enlarged_upright() -> None:
    """A board that lowered its rung sends 80x160 of 160x320; the upright image has the whole upright size, 320x160."""
    left, right = _SCENE.pair.left, _SCENE.pair.right
    pair = turned_pair(halved(left), right, QUARTER, UPRIGHT, (160, 320))
    done = Pipeline(None, Side.LEFT, now.monotonic_ns).process(pair)
    assert done.pair.left.shape == left.shape == (160, 320)
    assert float(np.abs(done.pair.left.astype(int) - left.astype(int)).mean()) < 12  # half the detail is gone
    other = Pipeline(None, Side.LEFT, now.monotonic_ns).process(pair_of(halved(left), right, Side.LEFT, (320, 160)))
    assert float(np.abs(done.pair.left.astype(int) - other.pair.left.astype(int)).mean()) < 1


def test_interpolated_images_are_upright() -> None:
    """The frame before is turned too, so that both are compared as they are seen."""
    left, right = _SCENE.pair.left, _SCENE.pair.right
    pair = turned_pair(left, right, HALF, UPRIGHT, (0, 0))
    marks = replace(pair.board.marks, exposed_ns=-40_000_000)
    pair = replace(pair, before=replace(pair.board, marks=marks), time_skew_ns=20_000_000)
    done = Pipeline(None, Side.LEFT, now.monotonic_ns, Interpolator()).process(pair)
    assert float(np.abs(done.pair.left.astype(int) - left.astype(int)).mean()) < 1


def test_a_rig_is_compared_with_the_upright_size() -> None:
    """A rig of 320x240 on the left takes a camera of 240x320 that is turned by a quarter, and refuses it unturned."""
    rig = small_rig()
    width, height = rig.left.width_px, rig.left.height_px
    left, right = np.zeros((height, width), np.uint8), np.zeros((rig.right.height_px, rig.right.width_px), np.uint8)
    core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 32)), Rectifier(rig))
    pipeline = Pipeline(core, Side.LEFT, now.monotonic_ns)
    turned = turned_pair(left, right, QUARTER, UPRIGHT, (0, 0))
    assert (turned.board.message.width_px, turned.board.message.height_px) == (height, width)
    assert pipeline.process(turned).cloud is not None
    with pytest.raises(DataError):
        pipeline.process(replace(turned, board=replace(turned.board, orientation=UPRIGHT)))


def opened(uri: str) -> Camera:
    """A camera of this machine, as the host opens it."""
    return host_factory.open_camera(uri, "host", now.monotonic_ns())


def test_a_replay_says_how_it_is_mounted_and_stays_as_it_is_otherwise(tmp_path: Path) -> None:
    """The description gains the orientation; size, frames and everything else are those of the camera itself."""
    write_film(tmp_path, 2)
    uri = f"replay:{tmp_path}?pace=demand"
    turned, plain = opened(f"{uri}&rotate=90&flip=v"), opened(uri)
    assert turned.description == replace(plain.description, orientation=Orientation(90, Flip.V))
    assert turned.description.upright_px == (HEIGHT_PX, WIDTH_PX)
    assert (turned.offers, turned.health, turned.pollable) == (plain.offers, plain.health, plain.pollable)
    turned.anchor(5, 0)
    plain.anchor(5, 0)
    assert turned.read(10) == plain.read(10)
    turned.close()
    plain.close()


def test_photographs_that_their_headers_turn_have_the_upright_size(tmp_path: Path) -> None:
    """EXIF 6 is a quarter turn; a camera address that turns by a quarter again leads back. The principal point's default follows this size."""
    (tmp_path / "1.jpg").write_bytes(oriented(".jpg", np.zeros((24, 32), np.uint8), 6))
    assert upright_px(opened(f"replay:{tmp_path}")) == (24, 32)
    assert upright_px(opened(f"replay:{tmp_path}?rotate=90")) == (32, 24)
    (tmp_path / "1.jpg").write_bytes(oriented(".jpg", np.zeros((24, 32), np.uint8), 3))
    assert upright_px(opened(f"replay:{tmp_path}")) == (32, 24)


def test_every_kind_of_uri_takes_the_options() -> None:
    """They are read before the kinds see the rest: a V4L2 camera's settings are the same with and without."""
    assert parse_orientation("v4l2:/dev/video0?rotate=270&size=640x480&flip=h") == Orientation(270, Flip.H)
    settings = parse_camera("v4l2:/dev/video0?rotate=270&size=640x480", "board")
    assert isinstance(settings, V4l2Settings)
    assert settings == parse_camera("v4l2:/dev/video0?size=640x480", "board")
    assert host_factory.camera_orientation("http://phone:8080/video?rotate=180") == HALF


@pytest.mark.parametrize(
    ("uri", "rest", "orientation"),
    [
        ("http://h/v", "http://h/v", UPRIGHT),
        ("http://h/v?rotate=90", "http://h/v", QUARTER),
        ("http://h/v?a=%20b&rotate=180&c", "http://h/v?a=%20b&c", HALF),
        ("http://me:pw@h:80/v?latency_ms=20&rotate=270&flip=h", "http://me:pw@h:80/v?latency_ms=20", MIRRORED),
    ],
)
def test_a_servers_own_query_stays_as_it_was(uri: str, rest: str, orientation: Orientation) -> None:
    """Only our two options are taken off the address."""
    assert without_orientation(uri) == (rest, orientation)


@pytest.mark.parametrize(
    "uri", ["replay:x?rotate=45", "v4l2:auto?flip=x", "http://me:secret@h/v?rotate=left", "v4l2:?rotate=&size=1x1"]
)
def test_other_values_are_refused_before_anything_is_opened(uri: str) -> None:
    """The error names the option and what it can be, and hides a password."""
    with pytest.raises(SettingsError, match=r"rotate=|flip=") as caught:
        host_factory.check_camera(uri)
    assert "secret" not in str(caught.value)


def test_kept_frames_are_read_back_with_their_orientation(tmp_path: Path) -> None:
    """`calibrate-time --keep` writes the files as they came, and beside them how they become upright."""
    pair = turned_pair(_SCENE.pair.left, _SCENE.pair.right, MIRRORED, UPRIGHT, (0, 0))

    def shot(frame: FrameMessage, orientation: Orientation) -> Shot:
        return Shot(
            7,
            EncodedImage(
                payload=bytes(frame.payload),
                pixel_format=frame.pixel_format,
                width_px=frame.width_px,
                height_px=frame.height_px,
                name="board frame 7",
                orientation=orientation,
            ),
        )

    kept = footage.Footage((shot(pair.board.message, MIRRORED),), (shot(pair.board.message, UPRIGHT),))
    footage.keep(kept, tmp_path)
    back = footage.read(tmp_path)
    assert [each.image.orientation for each in (*back.board, *back.host)] == [MIRRORED, UPRIGHT]
    (tmp_path / "board" / "orientation").write_text("rotate=10")
    with pytest.raises(DataError, match="rotate=10"):
        footage.read(tmp_path)
    footage.keep(footage.Footage(kept.host, kept.host), tmp_path)  # the next one is upright, so the file goes
    assert not (tmp_path / "board" / "orientation").exists()


@pytest.mark.parametrize("first", [Orientation(turn, flip) for turn in (0, 90) for flip in Flip])
@pytest.mark.parametrize("then", [Orientation(turn, flip) for turn in (0, 90) for flip in Flip])
def test_two_orientations_one_after_the_other_are_one(first: Orientation, then: Orientation) -> None:
    """Pixel by pixel, the picture is that of the one that is composed of them."""
    picture = np.arange(6, dtype=np.uint8).reshape(2, 3)
    assert np.array_equal(upright(upright(picture, first), then), upright(picture, composed(first, then)))
