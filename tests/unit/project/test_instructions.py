"""Counting executed instructions under qemu-user."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.bench.instructions import Emulated, executed, missing, of_one_repetition, per_pixel_and_disparity

_LOOP = """
#include <stdlib.h>
int main(int count, char **words) {
    long turns = atol(words[count - 1]) * 100;
    for (long turn = 0; turn < turns; turn++) __asm__ volatile("nop\\n\\tnop\\n\\tnop\\n\\tnop\\n\\tnop");
    return 0;
}
"""


@pytest.mark.parametrize(
    ("compiler", "machine", "cpu"),
    [("aarch64-linux-gnu-gcc", "aarch64", ""), ("x86_64-linux-gnu-gcc", "x86_64", "Nehalem")],
)
def test_a_loop_has_the_instructions_that_were_written(compiler: str, machine: str, cpu: str, tmp_path: Path) -> None:
    """100 turns of five instructions and of what turns the loop, two or three, are 700 or 800 on every architecture."""
    program = tmp_path / "loop"
    what = Emulated(program, machine, cpu)
    if shutil.which(compiler) is None or missing([what]):
        pytest.skip(f"{compiler} or qemu-{machine} is not installed")
    (tmp_path / "loop.c").write_text(_LOOP, encoding="ascii")
    subprocess.run([compiler, "-O2", "-static", "-o", program, tmp_path / "loop.c"], check=True)
    found = of_one_repetition(what)
    assert 700 <= found <= 810
    assert per_pixel_and_disparity(what, 10, 10) == pytest.approx(found / 100, abs=0.1)


def test_what_does_not_run_is_told(tmp_path: Path) -> None:
    """An architecture without an emulator, and a file that is no program."""
    with pytest.raises(FileNotFoundError, match="qemu-nothing"):
        executed(Emulated(tmp_path / "x", "nothing"), 1)
    assert missing([Emulated(tmp_path / "x", "nothing")]) == ["qemu-nothing"]
    what = Emulated(tmp_path / "x", "aarch64")
    if missing([what]):
        pytest.skip("qemu-aarch64 is not installed")
    with pytest.raises(RuntimeError, match="ended with"):
        executed(what, 1)
