"""A phone's MJPEG server as the host's own camera, and servers that misbehave in every known way; real sockets, a real process."""

import itertools
import json
import select
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from common import now
from common.camera.base import CameraState, Grab, Skipped, Spoiled
from common.errors import UnavailableError
from common.frame import Frame, FrameFault, ImageSizeError
from phone_host.camera.factory import open_camera
from phone_host.camera.mjpeg_http import HttpCamera
from tests.support.mjpeg_server import PASSWORD, USER, MjpegServer
from tests.support.moving import write_moving_film
from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import board, free_port, host, ledgers, lines, until

FRAMES = 200
FPS = 50


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Numbered images."""
    return write_film(tmp_path_factory.mktemp("film") / "numbered", FRAMES)


@contextmanager
def serving(film: Path, manner: str, certificate: Path | None = None, fps: float = FPS) -> Iterator[MjpegServer]:
    """A server for the length of a block."""
    server = MjpegServer(film, fps, manner, certificate)
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def camera_of(uri: str) -> Iterator[HttpCamera]:
    """An open camera for the length of a block."""
    camera = open_camera(uri, "host", now.monotonic_ns())
    assert isinstance(camera, HttpCamera)
    try:
        yield camera
    finally:
        camera.close()


def grabs(camera: HttpCamera, enough: Callable[[list[Grab]], bool]) -> list[Grab]:
    """Read until the condition holds."""
    came: list[Grab] = []

    def step() -> bool:
        assert camera.pollable is not None
        select.select([camera.pollable], [], [], 0.1)
        came.extend(camera.read(now.monotonic_ns()))
        return enough(came)

    until(step, "images")
    return came


def frames(came: list[Grab]) -> list[Frame]:
    """The frames among these grabs."""
    return [grab for grab in came if isinstance(grab, Frame)]


@pytest.mark.parametrize(
    "manner",
    [
        "plain",
        "dashes",
        "no_dashes",
        "no_line_end",
        "wrong_boundary",
        "chunked",
        "early_boundary",
        "empty_parts",
        "garbage",
        "no_end",
    ],
)
def test_every_sloppy_manner(film: Path, manner: str) -> None:
    """However a server splits its images, each arrives whole and unaltered, in order, with the measured period."""
    contents = [(film / f"{number}.jpg").read_bytes() for number in range(FRAMES)]
    with serving(film, manner) as server, camera_of(server.uri) as camera:
        came = frames(grabs(camera, lambda came: len(frames(came)) >= 20))
        assert (camera.description.width_px, camera.description.height_px) == (160, 120)
        assert camera.health.faults == ()
        assert camera.health.state is CameraState.RUNNING
    numbers = [contents.index(bytes(frame.payload)) for frame in came]
    assert all((after - before) % FRAMES > 0 for before, after in itertools.pairwise(numbers))
    assert all(before.exposed < after.exposed for before, after in itertools.pairwise(came))
    assert camera.description.period_ns > 0


def test_an_image_is_stamped_with_its_own_arrival(film: Path) -> None:
    """A server that sends the next boundary together with the previous image does not make stamps early: they follow the sending, minus the latency."""
    fps = 10
    period_ns = 1_000_000_000 // fps

    def fastest_ns(came: list[Frame]) -> int:
        # Sent at k / fps, arrived later: modulo the period the stamps lie just after the grid. The fastest ones show it, on a busy machine after a while.
        return min((frame.exposed.ns + 200_000_000) % period_ns for frame in came)

    with serving(film, "early_boundary", fps=fps) as server, camera_of(f"{server.uri}?latency_ms=200") as camera:
        grabs(camera, lambda came: len(frames(came)) >= 20 and fastest_ns(frames(came)) < period_ns // 2)
        assert camera.health.latency_ns == 200_000_000


def test_truncated_images_are_told_of(film: Path) -> None:
    """A truncated image is a spoiled grab under its own number and is counted; all others arrive, or a newer one took their place."""
    with serving(film, "truncated") as server, camera_of(server.uri) as camera:
        came = grabs(camera, lambda came: sum(isinstance(grab, Spoiled) for grab in came) >= 4)
        faults = dict(camera.health.faults)
    assert {grab.fault for grab in came if isinstance(grab, Spoiled)} == {FrameFault.NO_END}
    assert faults[FrameFault.NO_END] >= 4
    assert len(frames(came)) + sum(grab.frames for grab in came if isinstance(grab, Skipped)) >= 8


@pytest.mark.parametrize("manner", ["closes", "resets", "bad_chunks", "last_chunk", "hangs", "drips", "endless"])
def test_a_server_that_goes_wrong_is_met_again(film: Path, manner: str) -> None:
    """If a server hangs up, resets, ends its answer, garbles its chunks, hangs, drips or never ends an image, it is dropped, counted and reconnected to."""
    with serving(film, manner) as server, camera_of(server.uri) as camera:
        grabs(camera, lambda _: camera.health.returned > 0)
        came = grabs(camera, lambda came: len(frames(came)) >= 5)
        health = camera.health
    assert len(frames(came)) >= 5
    assert health.failures >= 1
    assert health.stalls >= (manner in {"hangs", "drips", "endless"})
    assert health.state is CameraState.RUNNING


def test_a_server_that_is_away_is_waited_for(film: Path) -> None:
    """The host looks for a missing phone until it is back at the same address."""
    server = MjpegServer(film, FPS)
    with camera_of(server.uri) as camera:
        grabs(camera, lambda came: len(frames(came)) >= 3)
        server.stop()
        until(lambda: camera.health.state is CameraState.GONE, "the camera is gone")
        until(lambda: camera.health.failures >= 3, "several attempts")
        server = MjpegServer(film, FPS, port=server.port)
        try:
            grabs(camera, lambda came: len(frames(came)) >= 3)
            assert camera.health.returned == 1
        finally:
            server.stop()


def test_a_slow_reader_gets_the_newest(film: Path) -> None:
    """After a hundred unread images, a reader gets one frame, the newest, and the count of those it replaced."""
    with serving(film, "plain", fps=100) as server, camera_of(server.uri) as camera:
        first = frames(grabs(camera, lambda came: len(frames(came)) >= 1))[-1]
        until(lambda: camera.newest_sequence >= first.sequence + 100, "a hundred images")
        before = camera.newest_sequence
        came = camera.read(now.monotonic_ns())
    [newest] = frames(came)
    assert newest.sequence >= before
    assert len(came) <= 2
    passed = sum(grab.frames for grab in came if isinstance(grab, Skipped))
    assert first.sequence + 1 + passed == newest.sequence


REFUSALS = {
    "page": ("a web page", "IP Webcam has /video"),
    "snapshot": ("single images", "IP Webcam has /video"),
    "missing": ("404", "check the path"),
    "moved": ("http://elsewhere/video", "give the new address"),
    "moved_here": ("has moved to /other", "give the new address"),
    "busy": ("503", "busy"),
    "digest": ("by Digest authentication", "Basic"),
    "password": ("asks for a password", "USER:PASSWORD"),
    "another_tongue": ("does not speak HTTP", "port"),
    "sizeless": ("every image is spoiled (wrong length)", "look at it in a browser"),
}


@pytest.mark.parametrize("manner", REFUSALS)
def test_what_is_no_stream_is_told_with_its_remedy(film: Path, manner: str) -> None:
    """A page, a single image, a refusal or another protocol is reported as unavailable at once, in one line with its remedy."""
    problem, remedy = REFUSALS[manner]
    with serving(film, manner) as server, pytest.raises(UnavailableError) as caught:
        open_camera(server.uri, "host", 0)
    assert problem in caught.value.problem
    assert remedy in caught.value.remedy
    assert str(server.port) in caught.value.problem


def test_a_phone_that_is_turned(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Images that differ from the first size are spoiled and counted by name, the change is reported, and those of the first size keep coming."""
    mixed = write_film(tmp_path / "mixed", 20)
    upright = cv2.rotate(np.asarray(cv2.imread(str(mixed / "0.jpg"))), cv2.ROTATE_90_CLOCKWISE)
    for number in range(10, 20):
        assert cv2.imwrite(str(mixed / f"{number}.jpg"), upright)
    with serving(mixed, "plain") as server, camera_of(server.uri) as camera:
        first_px = camera.description.width_px, camera.description.height_px
        came = grabs(camera, lambda came: Spoiled in map(type, came) and isinstance(came[-1], Frame))
        assert set(dict(camera.health.faults)) == {FrameFault.OTHER_SIZE}
    assert first_px in {(160, 120), (120, 160)}
    assert {(frame.width_px, frame.height_px) for frame in frames(came)} == {first_px}
    assert {grab.fault for grab in came if isinstance(grab, Spoiled)} == {FrameFault.OTHER_SIZE}
    assert "camera_size_changed" in caplog.text


@pytest.mark.parametrize("manner", ["bombs", "turning"])
def test_images_that_claim_another_size(film: Path, manner: str, caplog: pytest.LogCaptureFixture) -> None:
    """Images whose header claims an unrequested size are spoiled by name and never handed on; the log gets a few lines, however many they are."""
    with serving(film, manner) as server, camera_of(server.uri) as camera:
        came = grabs(camera, lambda came: sum(isinstance(grab, Spoiled) for grab in came) >= 40)
        assert dict(camera.health.faults)[FrameFault.OTHER_SIZE] >= 40
    assert {(frame.width_px, frame.height_px) for frame in frames(came)} == {(160, 120)}
    assert caplog.text.count("camera_size_changed") <= 7


def test_a_phone_beyond_the_limit(tmp_path: Path) -> None:
    """A server whose images have more pixels than the limit is refused at once; the message names both."""
    film = write_film(tmp_path / "film", 20)
    with serving(film, "plain") as server, pytest.raises(ImageSizeError, match=r"160x120 px.*limit is 0.0"):
        open_camera(server.uri, "host", now.monotonic_ns(), 10_000)


def test_nobody_there_is_told(film: Path) -> None:
    """A port with no listener, and an unknown name, are reported as unavailable at once."""
    del film
    for uri in (f"http://127.0.0.1:{free_port()}/video", "http://phone.invalid/video"):
        with pytest.raises(UnavailableError, match=r"refuses|has no address|does not answer"):
            open_camera(uri, "host", 0)


@pytest.mark.parametrize(
    ("manner", "said"),
    [("no_image", "no JPEG image within 10 s"), ("mute", "does not answer"), ("drips_head", "does not answer")],
)
def test_silence_is_told(film: Path, manner: str, said: str) -> None:
    """A server that answers nothing, or sends nothing that is an image, is reported as unavailable in the end."""
    with serving(film, manner) as server, pytest.raises(UnavailableError, match=said):
        open_camera(server.uri, "host", 0)


def test_a_password_opens(film: Path) -> None:
    """Name and password in the address open a server that asks for them, whatever characters they have; wrong ones are reported without being shown."""
    with serving(film, "password") as server:
        _, _, rest = server.uri.partition("//")
        with camera_of(f"http://{USER}:a%3Ab%40c%2F%25@{rest}") as camera:
            grabs(camera, lambda came: len(frames(came)) >= 3)
        assert PASSWORD == "a:b@c/%"
        with pytest.raises(UnavailableError, match="name and password") as caught:
            open_camera(f"http://{USER}:guessed@{rest}", "host", 0)
        assert "guessed" not in str(caught.value)


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl here to make a certificate")
def test_https(film: Path, tmp_path: Path) -> None:
    """An https server with a self-signed certificate is refused unless that is accepted; http and https mixed up are reported."""
    certificate = tmp_path / "both.pem"
    key = tmp_path / "key.pem"
    request = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=phone"]
    subprocess.run([*request, "-keyout", str(key), "-out", str(certificate)], check=True, capture_output=True)
    certificate.write_bytes(certificate.read_bytes() + key.read_bytes())
    with serving(film, "plain", certificate) as server:
        with pytest.raises(UnavailableError, match="verify=0"):
            open_camera(server.uri, "host", 0)
        with camera_of(f"{server.uri}?verify=0") as camera:
            grabs(camera, lambda came: len(frames(came)) >= 3)
        with pytest.raises(UnavailableError, match="needs https"):
            open_camera(server.uri.replace("https", "http"), "host", 0)
    with serving(film, "plain") as server, pytest.raises(UnavailableError, match="http://"):
        open_camera(server.uri.replace("http", "https"), "host", 0)


def test_it_ends_at_once_and_leaves_nothing(film: Path) -> None:
    """Closing twice is harmless, is not delayed by a server that hangs, and leaves no thread."""
    with serving(film, "hangs") as server:
        camera = open_camera(server.uri, "host", 0)
        assert isinstance(camera, HttpCamera)
        until(lambda: camera.newest_sequence >= 5, "the server hangs soon")
        camera.close()
        camera.close()
        until(lambda: all(thread.name != "mjpeg" for thread in threading.enumerate()), "its thread ends")


def test_a_board_and_a_phone_are_paired(tmp_path: Path) -> None:
    """phone-host pairs a replay board with an HTTP camera that shows the same film, and its report has the camera's figures."""
    fps, out = 4, tmp_path / "out"
    film = write_film(tmp_path / "film", 100)
    link = f"ipc://{tmp_path}/board"
    known = "latency_ms=3&latency_uncertainty_ms=2"
    receiving = ["--link", link, "--out", str(out), "--save-every", "1", "--json"]
    with (
        serving(film, "plain", fps=fps) as server,
        board(["run", "--camera", f"replay:{film}?fps={fps}&loop=1", "--link", link], tmp_path),
        host(["run", "--camera", f"{server.uri}?{known}", *receiving], tmp_path) as receiver,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 20, "pairs")
        assert receiver.stop() == 0
        report = receiver.json()
    own = report["host_frames"]["camera"]
    assert own["latency_ms"] == 3
    assert own["jitter_ms"] >= 0
    assert own["stamp_uncertainty_ms"] == pytest.approx(2 + own["jitter_ms"], abs=0.002)
    assert own["period_ms"] == pytest.approx(1000 / fps, rel=0.4)
    # The server sends at the replay's moment of exposure; an image delayed by half a period gets another partner.
    agree = [left == right for left, right in saved_numbers(out)]
    assert sum(agree) > len(agree) / 2
    assert all(abs(ledger["time_skew_ns"]) <= 125_000_000 for ledger in ledgers(out))


def test_a_phone_whose_latency_nobody_measured_makes_a_warning(tmp_path: Path) -> None:
    """With a moving scene the log, the report and the summary say that stamps of an uncalibrated phone make depth wrong, and name calibrate-time."""
    fps, link = 20, f"ipc://{tmp_path}/board"
    film = write_moving_film(tmp_path / "moving", 100, 6)
    with (
        serving(film, "plain", fps=fps) as server,
        board(["run", "--camera", f"replay:{film}?fps={fps}&loop=1", "--link", link], tmp_path),
        host(["run", "--camera", server.uri, "--link", link, "--out", str(tmp_path / "out")], tmp_path) as receiver,
    ):
        until(lambda: "doubt=stamps" in receiver.stderr, "the warning")
        assert receiver.stop() == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    told = {warning["doubt"]: warning for warning in report["warnings"]}
    assert "nor was the latency of this machine's camera" in told["stamps"]["sentence"]
    assert "calibrate-time" in told["stamps"]["remedy"]
    assert (
        "warning: the time offset between the two cameras was never measured"
        in receiver.stderr + receiver.out.read_text()
    )


def test_the_doctor_looks_at_a_phone(film: Path, tmp_path: Path) -> None:
    """phone-host doctor says what a server gives, or why it gives nothing."""
    with serving(film, "plain") as server, host(["doctor", "--camera", server.uri], tmp_path, "sound") as doctor:
        doctor.wait()
        assert "160x120 every" in doctor.out.read_text()
    with serving(film, "page") as server, host(["doctor", "--camera", server.uri], tmp_path, "page") as doctor:
        assert doctor.wait() != 0
        assert "IP Webcam has /video" in doctor.out.read_text()


def test_an_absent_phone_ends_the_run(tmp_path: Path) -> None:
    """If its own camera is missing, phone-host run ends at once with exit 3 and one line that names the address but not the password."""
    uri = f"http://me:secret@127.0.0.1:{free_port()}/video"
    with host(["run", "--camera", uri, "--link", f"ipc://{tmp_path}/board"], tmp_path) as receiver:
        assert receiver.wait() == 3
        told = [line for line in receiver.stderr.splitlines() if "error" in line]
        assert len(told) == 1
        assert "refuses the connection" in told[0]
        assert "secret" not in receiver.stderr
