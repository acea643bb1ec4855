"""The booted board that all tests here share. `make test-board` builds its image; without one they are skipped."""

import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.vm.guest import Guest, Image
from tests.vm.stream import FPS, Film, Skew, webcam_skew, write_film
from tests.vm.webcam import Webcam

ROOT = Path(__file__).resolve().parents[2]
READOUT_MS = 20
CAMERA = f"v4l2:auto?size=320x240&fps={FPS}&readout_ms={READOUT_MS}"


def _image() -> Image:
    """The image that .ci/board has built from the present scripts.

    Its folder is named by them, so that a changed script never meets an old image.
    """
    named = subprocess.run([ROOT / ".ci" / "board", "folder"], capture_output=True, text=True, check=True)
    return Image(Path(named.stdout.strip()))


@pytest.fixture(scope="session")
def bare_guest() -> Iterator[Guest]:
    """A booted board without the package."""
    image = _image()
    if not shutil.which("qemu-system-x86_64"):
        pytest.skip("qemu-system-x86_64 is missing: run make test-board")
    if not image.built:
        pytest.skip(f"no image of a board in {image.folder}: run make test-board")
    # Not pytest's folder: the path of ssh's socket must be short.
    with tempfile.TemporaryDirectory(prefix="board-") as folder:
        guest = Guest(image, Path(folder))
        try:
            guest.start()
            yield guest
        finally:
            guest.stop()


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, built from the present sources."""
    built = subprocess.run(
        [ROOT / "deploy" / "board" / "build-deb", tmp_path_factory.mktemp("deb")],
        capture_output=True,
        text=True,
        check=True,
    )
    return Path(built.stdout.strip())


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Film:
    """A minute of numbered views of one plane."""
    return write_film(tmp_path_factory.mktemp("film"))


@pytest.fixture(scope="module")
def guest(bare_guest: Guest, package: Path) -> Guest:
    """The board with its package installed, its camera's settings given, and its link open to everybody."""
    bare_guest.put(package, "/root")
    bare_guest.sh(f"dpkg -i /root/{package.name}")
    configure(bare_guest, CAMERA)
    return bare_guest


@pytest.fixture(scope="module")
def webcam(guest: Guest, film: Film) -> Iterator[Webcam]:
    """The webcam, plugged in."""
    camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000)
    camera.plug(guest)
    yield camera
    camera.close()


@pytest.fixture
def skew(webcam: Webcam) -> Skew:
    """The truth about pairs: what the webcam knows of its own exposures."""
    return webcam_skew(webcam.late_ns)


def configure(guest: Guest, camera: str) -> None:
    """Set the service's camera, open its link to everybody, and restart it."""
    edits = (f'camera = "{camera}"', 'link = ["tcp://*:5555"]')
    script = " ".join(f"-e {shlex.quote(f's|^{edit.split()[0]} = .*|{_literal(edit)}|')}" for edit in edits)
    guest.sh(f"sed -i {script} /etc/tandemscan/board-agent.toml && systemctl restart board-agent")


def _literal(text: str) -> str:
    """Text as the replacement of sed's `s|…|…|`."""
    return text.replace("&", "\\&")
