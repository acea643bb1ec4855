"""What holds of every door to a printer: the file arrives whole, a wish is obeyed, the printer ends cold or that is said, and a refusal begins nothing."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from common.errors import TandemError
from phone_host.printers.door import Job, Phase, PrinterDoor, Progress, Wishes
from phone_host.printers.doors import door_to
from phone_host.printers.printer_uri import ServerKind, read_uri
from phone_host.printers.server_door import ServerPatience
from phone_host.printers.slicing import facts_of
from tests.support.marlin_printer import Faults, cube, printer
from tests.support.print_server import KEY, ServerFaults, print_server

LINES = cube(600)
LINE_KINDS = ("serial", "socket")
PRINTER_KINDS = (*LINE_KINDS, *(kind.value for kind in ServerKind))
every_printer = pytest.mark.parametrize("kind", PRINTER_KINDS)
every_door = pytest.mark.parametrize("kind", [*PRINTER_KINDS, "file"])


@dataclass(frozen=True, slots=True)
class Stand:
    """A printer behind its door.

    Attributes:
        door: to it.
        arrived: the commands that it got, in order.
        is_cold: whether its heaters are off.
    """

    door: PrinterDoor
    arrived: Callable[[], list[str]]
    is_cold: Callable[[], bool]


@contextmanager
def stand_of(kind: str, folder: Path, *, slow: bool = False) -> Iterator[Stand]:
    """A printer of a kind that is on while the block runs; a slow one takes seconds for a print."""
    if kind == "file":
        out = folder / "for a card.gcode"
        door = door_to(read_uri(f"file:{out}"))
        yield Stand(door, lambda: out.read_text().splitlines() if out.exists() else [], lambda: False)
    elif kind in LINE_KINDS:
        own = set(LINES)  # the host says some of its own, too
        with printer(Faults(delay_s=0.003 if slow else 0.0, greets=True), on_socket=kind == "socket") as line:
            door = door_to(read_uri(line.uri))
            yield Stand(door, lambda: [each for each in line.done if each in own], lambda: line.is_cold)
    else:
        with print_server(ServerKind(kind), ServerFaults(rate=0.5 if slow else 2.0)) as server:
            door = door_to(read_uri(server.uri), KEY, patience=ServerPatience(ask_s=0.1))
            yield Stand(
                door,
                lambda: [each for _, content in server.files for each in content.decode().splitlines()],
                lambda: (server.goal, server.bed) == (0.0, 0.0),
            )


def job_of(folder: Path, lines: list[str]) -> Job:
    """A print of these lines."""
    path = folder / "my cup.gcode"
    path.write_text("\n".join(lines) + "\n")
    return Job(path, path.name, facts_of(path))


@every_door
def test_a_file_arrives_whole(kind: str, tmp_path: Path) -> None:
    """Every command once and in order; the share only grows, up to 1, and what was on is off."""
    told: list[Progress] = []
    with stand_of(kind, tmp_path) as stand:
        stand.door.require_ready()
        ended = stand.door.send(job_of(tmp_path, LINES), Wishes(), told.append)
        assert stand.arrived() == LINES
        assert stand.is_cold() or kind == "file"
    assert (ended.phase, ended.share, ended.notes) == (Phase.DONE, 1.0, ())
    shares = [each.share for each in told if each.phase is Phase.PRINTING]
    assert shares == sorted(shares)


@every_printer
def test_cancelling_leaves_the_heaters_off(kind: str, tmp_path: Path) -> None:
    """In the middle of the print, which is not done to its end."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING and progress.share > 0:
            wishes.cancel()

    with stand_of(kind, tmp_path, slow=True) as stand:
        ended = stand.door.send(job_of(tmp_path, LINES), wishes, watch)
        assert stand.is_cold()
        assert kind not in LINE_KINDS or len(stand.arrived()) < len(LINES)
    assert ended.phase is Phase.CANCELLED
    assert ended.share < 1.0


@every_printer
def test_a_pause_is_passed_on_and_ended(kind: str, tmp_path: Path) -> None:
    """The print goes on after it, to its end, and is whole."""
    wishes, phases = Wishes(), list[Phase]()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING and Phase.PAUSED not in phases:
            wishes.pause()
        elif progress.phase is Phase.PAUSED:
            wishes.go_on()
        phases.append(progress.phase)

    with stand_of(kind, tmp_path, slow=True) as stand:
        ended = stand.door.send(job_of(tmp_path, LINES), wishes, watch)
        assert stand.arrived() == LINES
    assert Phase.PAUSED in phases
    assert ended.phase is Phase.DONE


@every_door
def test_a_file_that_leaves_heaters_on_is_cooled_or_noted(kind: str, tmp_path: Path) -> None:
    """Where the printer cannot be asked to cool, one note says that it stays hot."""
    hot = [line for line in cube(100) if line not in {"M104 S0", "M140 S0", "M84"}]
    with stand_of(kind, tmp_path) as stand:
        ended = stand.door.send(job_of(tmp_path, hot), Wishes(), lambda _: None)
        is_cold = stand.is_cold()
    assert ended.phase is Phase.DONE
    [note] = ended.notes
    assert "leaves heaters on" in note
    assert ("were switched off" in note) == (kind not in {"prusalink", "file"})
    assert is_cold or "were switched off" not in note


@pytest.mark.parametrize(
    "uri", ["serial:/dev/ttyNOPE9", "socket://127.0.0.1:9", *(f"{kind.value}://127.0.0.1:9" for kind in ServerKind), "file:/dev/null"]
)  # fmt: skip
def test_what_is_not_there_or_taken_is_refused_with_a_remedy(uri: str, tmp_path: Path) -> None:
    """Before anything is told of a print."""
    told: list[Progress] = []
    with pytest.raises(TandemError) as refused:
        door_to(read_uri(uri), KEY).send(job_of(tmp_path, LINES), Wishes(), told.append)
    assert refused.value.remedy
    assert not any(each.phase is Phase.PRINTING for each in told)
