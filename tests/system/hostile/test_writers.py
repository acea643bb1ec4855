"""Programs that write to one place at a time, or are killed while they write."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from phone_host.output.move_up import STAGED
from tests.support.numbered import write_film
from tests.support.programs import host, until
from tests.system.hostile.full_disks import write_inputs

_NO_FLOCK = Path(__file__).with_name("no_flock.c")

_WRITER = """
import os, sys
from pathlib import Path
from phone_host.output.atomic import write_bytes
from phone_host.output.result_files import replacing_results
out, number = Path(sys.argv[1]), 0
print("ready", flush=True)
while True:
    number += 1
    with replacing_results(out, r"[a-f]\\.bin", [f"{name}.bin" for name in "abcdef"]) as place:
        for name in "abcdef":
            write_bytes(place / f"{name}.bin", b"%d " % number * 20_000)
"""


_CLAIM = """
import sys
from pathlib import Path
from phone_host.output.result_files import claim
claim(Path(sys.argv[1]), "g.bin")
"""


def test_a_kill_at_any_moment_leaves_sets_that_are_whole(tmp_path: Path) -> None:
    """Twelve processes are killed while they replace six files again and again: after the next one has opened the folder all six are of one set, each whole."""
    for delay in range(12):
        with subprocess.Popen([sys.executable, "-c", _WRITER, str(tmp_path)], stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            writer.stdout.readline()
            until((tmp_path / "f.bin").exists, "the first set")
            signal.sigtimedwait([], 0.004 * delay)
            writer.kill()
        subprocess.run([sys.executable, "-c", _CLAIM, str(tmp_path)], check=True)
        contents = [(tmp_path / f"{name}.bin").read_bytes() for name in "abcdef"]
        assert len(set(contents)) == 1
        assert len(set(contents[0].split())) == 1
        assert len(contents[0]) % 20_000 == 0
        left = {path.name for path in tmp_path.iterdir()} - {STAGED}  # what was staged stays until the next one stages
        assert left == {".tandemscan", *(f"{name}.bin" for name in "abcdef")}


def test_a_second_recording_of_the_same_name_is_refused(tmp_path: Path) -> None:
    """The first program's process is named, before anything is said of the file that it just makes; a recording of another name may lie beside it."""
    film = write_film(tmp_path / "film", 4)
    words = ["record", "--alone", "--camera", f"replay:{film}?fps=30&loop=1", "--seconds", "60", "--out"]
    out = tmp_path / "a.mcap"
    with host([*words, str(out)], tmp_path, "first") as first:
        until(out.exists, "the first recording")
        with host([*words, str(out)], tmp_path, "second") as second:
            assert second.wait() == 3
        (line,) = second.stderr.strip().splitlines()
        assert f"{out} is being written by process {first.process.pid}: wait for its end" in line
        assert first.stop() == 0
    assert not list(tmp_path.glob(".*.lock"))


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_a_file_system_without_locks_is_written_to(tmp_path: Path) -> None:
    """The command does its work, says once for each lock that there is none, and leaves no lock file."""
    library, out = tmp_path / "no_flock.so", tmp_path / "out"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(_NO_FLOCK)], check=True)
    write_inputs(tmp_path)
    words = ["export", tmp_path / "cube.stl", "--unit", "mm", "--to", "stl", "--out", out]
    done = subprocess.run(
        [sys.executable, "-m", "phone_host.cli", *map(str, words)],
        env={**os.environ, "LD_PRELOAD": str(library)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "not_locked" in done.stderr
    assert "No locks available" in done.stderr
    assert sorted(path.name for path in out.iterdir()) == [".tandemscan", "cube.stl"]
