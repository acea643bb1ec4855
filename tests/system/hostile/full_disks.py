"""Every verb that writes results, on a disk that is full: `python -m tests.system.hostile.full_disks FOLDER SCENES` does it in a mount namespace.

Each verb runs once with room. Then the same command runs while the disk has only so many bytes left. It must end with one line that names a file or
folder on the disk and says what to do; everything that was on the disk must be there as before, byte by byte, and nothing else. With room again, the same
command must work. All runs are in one process, because starting a program takes longer than most of these runs.
"""

import contextlib
import io
import json
import random
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from phone_host.cli import main
from phone_host.model import CameraModel, Rig
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.planes import noise
from tests.support.recorded import recording_file
from tests.system.hostile.attack import Attack, Outcome, Rounds

DISK_BYTES: Final = 24 << 20
_MOST_S: Final = 3600.0
_LEFT_BYTES: Final = (0, 12288)
"""Nothing fits; or the first file fits, and not the second one."""

_LIST: Final = ".tandemscan"
_ENDINGS: Final = {3, 4}


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb with its command line.

    Attributes:
        name: for the test.
        words: makes the command line: of the folder with the inputs, and of the disk.
        makes_new: name of what it makes on the disk and never replaces; empty: it replaces what it has made before.
    """

    name: str
    words: Callable[[Path, Path], list[object]]
    makes_new: str = ""


def _of_pair(verb: str, *more: object) -> Callable[[Path, Path], list[object]]:
    def words(given: Path, disk: Path) -> list[object]:
        pair = given / "left" / "0.png", given / "right" / "0.png"
        return [verb, *pair, "--calibration", given / "rig.yaml", *more, "--out", disk / "out"]

    return words


def _of_pairs(verb: str, *more: object) -> Callable[[Path, Path], list[object]]:
    def words(given: Path, disk: Path) -> list[object]:
        sides = given / "left", given / "right"
        return [verb, *sides, "--calibration", given / "rig.yaml", *more, "--out", disk / "out"]

    return words


def _of_session(task: str, out: str) -> Callable[[Path, Path], list[object]]:
    def words(given: Path, disk: Path) -> list[object]:
        source = given / "images" if task == "import" else given / "session.mcap"
        return ["sessions", task, source, "--out", disk / out]

    return words


VERBS: Final = (
    Verb("stereo of one pair", _of_pair("stereo")),
    Verb("stereo of pairs", _of_pairs("stereo")),
    Verb("quality", _of_pairs("quality")),
    Verb("scan", _of_pairs("scan", "--voxel", "20mm")),
    Verb("relief", _of_pair("relief")),
    Verb(
        "export",
        lambda given, disk: [
            "export",
            given / "cube.stl",
            "--unit",
            "mm",
            "--to",
            "stl,obj,ply",
            "--out",
            disk / "out",
        ],
    ),
    Verb("printcheck", lambda given, disk: ["printcheck", given / "cube.stl", "--unit", "mm", "--out", disk / "out"]),
    Verb("target", lambda _, disk: ["target", "chessboard", "--out", disk / "out"]),
    Verb(
        "calibrate --import",
        lambda given, disk: ["calibrate", "--import", given / "rig.yaml", "--out", disk / "out" / "rig.yaml"],
    ),
    Verb(
        "run",
        lambda given, disk: [
            "run",
            "--replay",
            given / "session.mcap",
            "--pairs",
            "4",
            "--save-every",
            "1",
            "--out",
            disk / "out",
        ],
    ),
    Verb("sessions cut", _of_session("cut", "cut.mcap"), "cut.mcap"),
    Verb("sessions repair", _of_session("repair", "whole.mcap"), "whole.mcap"),
    Verb("sessions export", _of_session("export", "images"), "images"),
    Verb("sessions import", _of_session("import", "new.mcap"), "new.mcap"),
)


def write_inputs(folder: Path, *, is_other: bool = False) -> None:
    """Write what the verbs read: two equal pairs of noise, a rig for them, a cube, a recording and the folders of one.

    Args:
        folder: for them.
        is_other: whether they are other ones, which have the same names and give other results.
    """
    for number in range(2):
        wide = np.flip(noise(328, 96)) if is_other else noise(328, 96)
        for side, shift_px in (("left", 0), ("right", 8)):
            (folder / side).mkdir(exist_ok=True)
            cv2.imwrite(str(folder / side / f"{number}.png"), wide[:, shift_px : shift_px + 320])
    camera = np.array([[200.0, 0, 159.5], [0, 200, 47.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=96, matrix=camera, distortion=np.zeros(5))
    rig = Rig(
        left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.12 if is_other else -0.1, 0, 0])
    )
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    (folder / "cube.stl").write_text(_cube_mm(30.0 if is_other else 20.0))
    recording_file(folder, 6 if is_other else 8)
    assert main(["sessions", "export", str(folder / "session.mcap"), "--out", str(folder / "images")]) == 0


def _cube_mm(side: float) -> str:
    """Return an ASCII STL of a closed cube."""
    faces = []
    for axis in range(3):
        for at, order in ((0.0, (0, 2, 1, 0, 3, 2)), (side, (0, 1, 2, 0, 2, 3))):
            corners = [np.roll([at, a, b], axis) for a, b in ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side))]
            faces += [[corners[place] for place in order[:3]], [corners[place] for place in order[3:]]]
    lines = ["solid cube"]
    for face in faces:
        points = "".join(f"vertex {x} {y} {z}\n" for x, y, z in face)
        lines.append(f"facet normal 0 0 0\nouter loop\n{points}endloop\nendfacet")
    return "\n".join([*lines, "endsolid cube\n"])


def _ended(words: list[object]) -> tuple[int, str]:
    """Run a command in this process; return its exit code and what it wrote to stderr."""
    told = io.StringIO()
    with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
        code = main([str(word) for word in words])
    return code, told.getvalue()


def _tree(disk: Path) -> dict[str, bytes]:
    """Everything on the disk, but for the lists of our own files, which may name what was never made."""
    return {
        str(path.relative_to(disk)): path.read_bytes() if path.is_file() else b"a folder"
        for path in sorted(disk.rglob("*"))
        if path.name != _LIST
    }


@contextlib.contextmanager
def filled(disk: Path, left_bytes: int) -> Iterator[None]:
    """Fill the disk; where nothing is left, somebody else takes at once whatever becomes free."""
    filler, is_over = disk / "filler", threading.Event()
    with filler.open("wb", buffering=0) as file:

        def fill(size: int) -> None:
            with contextlib.suppress(OSError):
                while file.write(b"x" * size) == size:
                    pass

        def take_all() -> None:
            while not is_over.wait(0.0005):
                fill(1 << 12)

        fill(1 << 20)
        fill(1 << 12)
        file.truncate(max(0, file.tell() - left_bytes))
        other = threading.Thread(target=(lambda: None) if left_bytes else take_all)
        other.start()
        try:
            yield
        finally:
            is_over.set()
            other.join()
            filler.unlink()


def faults_of(verb: Verb, given: Path, disk: Path, left_bytes: int) -> list[str]:
    """Run a verb with room, without, and with room again; return what was wrong."""
    for path in disk.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    words, faults = verb.words(given, disk), []
    good, told = _ended(words)
    if good not in {0, 4} or "cannot be" in told:
        return [f"with room it ended with {good}: {told}"]
    if verb.makes_new:
        path = disk / verb.makes_new
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    before = _tree(disk)
    with filled(disk, left_bytes):
        code, told = _ended(words)
        after = _tree(disk)
    del after["filler"]
    said = [line for line in told.splitlines() if "No space left" in line or "not written" in line]
    if code == good and not said and after.keys() >= before.keys():
        return [] if left_bytes else ["it ended well on a full disk"]
    if code not in _ENDINGS:
        faults.append(f"ended with {code}: {told}")
    if after != before:
        changed = sorted(name for name in {*before, *after} if before.get(name) != after.get(name))
        faults.append(f"changed with a full disk: {', '.join(changed)}")
    if not said or not all("room" in line for line in said) or "Traceback" in told:
        faults.append(f"no line with the remedy: {told}")
    again, told = _ended(words)
    if again != good:
        faults.append(f"with room again it ended with {again}: {told}")
    hidden = [name for name in _tree(disk) if "/." in f"/{name}"]
    if hidden:
        faults.append(f"left behind: {', '.join(hidden)}")
    return faults


_MOUNTED: Final = 'mount -t tmpfs -o size="$1" tmpfs "$2" && shift 2 && exec "$@"'


def on_full_disks(folder: Path, left_bytes: tuple[int, ...] = _LEFT_BYTES) -> dict[str, list[str]]:
    """Do it for all verbs on a small disk of our own.

    Args:
        folder: for inputs, and where the disk is mounted.
        left_bytes: room on the disk, one after another.

    Returns:
        What was wrong, by the name of the verb and the room.
    """
    found: dict[str, list[str]] = in_namespace(folder, __spec__.name, *map(str, left_bytes))
    return found


def in_namespace(folder: Path, module: str, *words: str) -> Any:
    """Run a module where a small disk is mounted in a folder, as `disk`; return what it prints last, which is JSON.

    Args:
        folder: its first argument.
        module: that is run.
        words: its further arguments.
    """
    (folder / "disk").mkdir(exist_ok=True)
    command = [sys.executable, "-m", module, str(folder), *words]
    inner = ["unshare", "-rm", "sh", "-c", _MOUNTED, "sh", str(DISK_BYTES), str(folder / "disk"), *command]
    root = Path(__file__).parents[3]
    done = subprocess.run(inner, capture_output=True, text=True, timeout=_MOST_S, check=False, cwd=root)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def can_mount() -> bool:
    """Whether a small disk is available here: a tmpfs in a mount namespace of our own."""
    try:
        probe = ["unshare", "-rm", "sh", "-c", "mount -t tmpfs tmpfs /mnt"]
        return subprocess.run(probe, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def _attack(folder: Path, rounds: Rounds) -> Outcome:
    """Again and again with other room on the disk."""
    outcome, draw = Outcome(), random.Random(33)
    if not can_mount():
        return Outcome(figures=["not run: no mount namespace can be made here"])
    for number in rounds:
        room = tuple(draw.choice((0, 4096, 8192, 16384, 65536, 262144, 1 << 20)) for _ in range(4))
        place = folder / str(number)
        place.mkdir()
        for name, faults in on_full_disks(place, room).items():
            for fault in faults:
                outcome.expect(holds=False, otherwise=f"{name}: {fault}")
    return outcome


LONG: Final = (Attack("full disks", "every verb that writes, on a disk with no or little room", _attack),)


def _main(folder: Path, left_bytes: list[int]) -> None:
    given = folder / "given"
    given.mkdir()
    write_inputs(given)
    found = {
        f"{verb.name}, {room} bytes": faults_of(verb, given, folder / "disk", room)
        for verb in VERBS
        for room in left_bytes
    }
    print(json.dumps(found))


if __name__ == "__main__":
    _main(Path(sys.argv[1]), [int(word) for word in sys.argv[2:]])
