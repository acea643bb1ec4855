"""The board that each file of tests gets: of its own, and as a snapshot left it. `make test-board` builds its image; without it the tests are skipped."""

import fcntl
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.vm.guest import Guest
from tests.vm.machine import Architecture, Snapshot, image_of
from tests.vm.stream import FPS, Film, Skew, webcam_skew, write_film
from tests.vm.webcam import Webcam

ROOT = Path(__file__).resolve().parents[2]
READOUT_MS = 20
CAMERA = f"v4l2:auto?size=320x240&fps={FPS}&readout_ms={READOUT_MS}"


@contextmanager
def booted(architecture: Architecture, disk: Path | None = None, *, savable: bool = False) -> Iterator[Guest]:
    """A booted board without the package, for the length of a block; skips the test if there is no such image."""
    image = image_of(architecture)
    if not shutil.which(image.emulator):
        pytest.skip(f"{image.emulator} is missing: run make test-board")
    if not image.built:
        pytest.skip(f"no image of a board in {image.folder}: run make test-board")
    with _folder() as folder, _running(Guest(image, folder, disk, savable=savable)) as guest:
        yield guest


@contextmanager
def restored(snapshot: Snapshot) -> Iterator[Guest]:
    """A board that goes on from a snapshot, for the length of a block."""
    with _folder() as folder, _running(Guest(snapshot, folder)) as guest:
        yield guest


@contextmanager
def _folder() -> Iterator[Path]:
    # Not pytest's folder: the path of ssh's socket must be short.
    with tempfile.TemporaryDirectory(prefix="board-") as folder:
        yield Path(folder)


@contextmanager
def _running(guest: Guest) -> Iterator[Guest]:
    try:
        guest.start()
        yield guest
    finally:
        guest.stop()


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, built from the current sources."""
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


@pytest.fixture(scope="session")
def snapshot(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Snapshot]:
    """The board with its package installed, its camera configured, and its link open to everybody.

    One boot serves all workers: the first that needs it makes it, and the last that has it removes it.
    """
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "snapshot"
    made, mine = Snapshot(image_of(Architecture.AMD64), folder / "disk", folder / "memory"), folder / str(os.getpid())
    with _alone(folder):
        if not made.memory.exists():
            with booted(Architecture.AMD64, savable=True) as guest:
                guest.install(package)
                guest.configure(CAMERA)
                saved = guest.save()
                folder.mkdir(exist_ok=True)
                shutil.move(saved.disk, made.disk)
                shutil.move(saved.memory, folder / "part")
                (folder / "part").rename(made.memory)  # whole or not there
        mine.touch()
    yield made
    with _alone(folder):
        mine.unlink()
        if {path.name for path in folder.iterdir()} == {"disk", "memory"}:
            shutil.rmtree(folder)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other workers from a folder for the length of a block."""
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="module")
def guest(snapshot: Snapshot) -> Iterator[Guest]:
    """The same board, for this file alone."""
    with restored(snapshot) as board:
        yield board


@pytest.fixture(scope="module")
def webcam(guest: Guest, film: Film) -> Iterator[Webcam]:
    """The webcam, plugged in."""
    camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000)
    camera.plug(guest)
    yield camera
    camera.close()


@pytest.fixture
def skew(webcam: Webcam) -> Skew:
    """The ground truth for pairs: the webcam's record of its own exposures."""
    return webcam_skew(webcam.late_ns)
