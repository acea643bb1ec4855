"""The booted board that all tests here share. `make test-board` builds its image; without one they are skipped."""

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.numbered import write_film
from tests.vm.guest import Guest, Image
from tests.vm.stream import FPS, FRAMES

ROOT = Path(__file__).resolve().parents[2]
FILM = "/var/lib/tandemscan/frames"


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
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A minute of numbered images."""
    return write_film(tmp_path_factory.mktemp("film") / "frames", FRAMES)


@pytest.fixture(scope="module")
def guest(bare_guest: Guest, package: Path, film: Path) -> Guest:
    """The board with its package installed and serving the numbered images to everybody."""
    bare_guest.put(package, "/root")
    bare_guest.sh(f"dpkg -i /root/{package.name}")
    if bare_guest.code(f"test -d {FILM}") != 0:
        bare_guest.put(film, str(Path(FILM).parent))
    configure(bare_guest, f"replay:{FILM}?fps={FPS}&loop=1")
    return bare_guest


def configure(guest: Guest, camera: str) -> None:
    """Set the service's camera, open its link to everybody, and restart it."""
    guest.sh(
        "sed -i -e 's|^camera = .*|camera = \"{camera}\"|' -e 's|^link = .*|link = [\"tcp://*:5555\"]|' "
        "/etc/tandemscan/board-agent.toml && systemctl restart board-agent".format(camera=camera.replace("&", r"\&"))
    )
