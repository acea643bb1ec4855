"""Firmware that nobody has described: after every print both heaters are off, or one sentence says that nobody can know."""

import re
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from common.errors import TandemError
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.doors import door_to
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.slicing import facts_of
from tests.support.lying_printer import lying_printer
from tests.support.marlin_printer import cube
from tests.support.strange_firmware import FIRMWARES

pytestmark = pytest.mark.xdist_group("strange firmware")  # one process begins all prints, side by side

_WARNS: Final = re.compile(r"heaters|go and look|see that it cools|see what its display says|switch it off")
_ENDS: Final = ("by itself", "cancelled")
_ENDS_DONE: Final = {"flood of ok", "flood of ok, does nothing", "unknown commands", "start twice", "split lines"}
"""What can be borne is borne: these are printed to their end."""


@dataclass(frozen=True, slots=True)
class Left:
    """A printer after its print: how that ended, in words, and whether its heaters are off."""

    phase: Phase
    words: str
    is_cold: bool


def _printed(name: str, end: str, gcode: Path) -> Left:
    firmware, wishes = FIRMWARES[name](), Wishes()

    def tell(progress: Progress) -> None:
        if end == "cancelled" and progress.phase is Phase.PRINTING and progress.share > 0.02:
            wishes.cancel()

    with lying_printer(firmware.answer, is_slow=name == "split lines") as there:
        try:
            ended: Ended | TandemError = door_to(read_uri(there.uri)).send(
                Job(gcode, gcode.name, facts_of(gcode)), wishes, tell
            )
        except TandemError as error:
            ended = error
    if isinstance(ended, TandemError):
        return Left(Phase.FAILED, str(ended), firmware.is_cold)
    words = f"{ended.problem}: {ended.remedy}" if ended.problem else "; ".join(ended.notes)
    return Left(ended.phase, words, firmware.is_cold)


@pytest.fixture(scope="module")
def prints(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[tuple[str, str], Future[Left]]]:
    """All prints, side by side: they wait for their printers, not for the machine."""
    gcodes = {end: tmp_path_factory.mktemp("strange") / "cube.gcode" for end in _ENDS}
    for end, lines in zip(_ENDS, (120, 5000), strict=True):
        gcodes[end].write_text("\n".join(cube(lines)) + "\n")
    with ThreadPoolExecutor(len(FIRMWARES) * len(_ENDS)) as pool:
        yield {(name, end): pool.submit(_printed, name, end, gcodes[end]) for name in FIRMWARES for end in _ENDS}


@pytest.mark.parametrize("end", _ENDS)
@pytest.mark.parametrize("name", FIRMWARES)
def test_a_print_ends_cold_or_says_that_nobody_knows(
    name: str, end: str, prints: dict[tuple[str, str], Future[Left]]
) -> None:
    """The firmware's own goals are zero, or the one sentence sends the user to the printer."""
    left = prints[name, end].result(timeout=300)
    assert "\n" not in left.words
    assert left.is_cold or _WARNS.search(left.words), left
    assert (left.phase is Phase.DONE) == (end == "by itself" and name in _ENDS_DONE), left
