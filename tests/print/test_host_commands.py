"""Commands within G-code that are for the host (`@pause`), and a byte order mark before it: as Cura and editors write them."""

from pathlib import Path

import pytest

from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.gcode import examine, host_command
from phone_host.printers.printer_uri import ServerKind
from phone_host.printers.sending import LineDoor
from tests.print.test_print_by_server import with_key
from tests.print.test_print_verb import done
from tests.print.test_sending import line_uri
from tests.support.marlin_printer import MarlinPrinter, cube, printer
from tests.support.print_server import print_server


def job_of(folder: Path, lines: list[str]) -> Job:
    """A file of these lines, read whole."""
    path = folder / "part.gcode"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Job(path, path.name, examine(lines, path.name))


def printed(there: MarlinPrinter, job: Job, go_on_after: int = 4) -> tuple[Ended, list[tuple[int, str]]]:
    """Print it, and go on after a pause that was seen some times; return how it ended, and what was shown while it paused."""
    wishes, shown = Wishes(), list[tuple[int, str]]()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PAUSED:
            printed_lines = sum(line != "M105" for line in there.done)  # a question for temperatures may be under way
            shown.append((printed_lines, progress.message))
            if len(shown) == go_on_after:
                wishes.go_on()

    return LineDoor(line_uri(there.uri)).send(job, wishes, watch), shown


def test_a_pause_in_the_file_begins_where_it_stands(tmp_path: Path) -> None:
    """The line behind it waits until the user goes on; the printer never sees the command, and every line is done once."""
    lines = cube(60)
    with printer() as there:
        ended, shown = printed(there, job_of(tmp_path, [*lines[:30], " @PAUSE Farbe: grün ; Cura", *lines[30:]]))
    assert ended.phase is Phase.DONE
    assert ended.share == 1.0
    assert [line for line in there.done if line != "M105"] == lines
    assert {count for count, _ in shown[1:4]} == {30}
    assert {words for _, words in shown} == {"its G-code pauses (@pause)"}


@pytest.mark.parametrize(("name", "at"), [("cancel", 30), ("abort", 60)], ids=["in the middle", "at the end"])
def test_a_file_that_cancels_itself_ends_cold(name: str, at: int, tmp_path: Path) -> None:
    """Nothing behind the command is printed, heaters are off, and a note says who ended it."""
    lines = [line for line in cube(63) if not line.endswith(" S0")][:60]
    with printer() as there:
        ended, _ = printed(there, job_of(tmp_path, [*lines[:at], f"@{name}", *lines[at:]]))
    assert (ended.phase, ended.notes) == (Phase.CANCELLED, (f"its G-code ended it (@{name})",))
    assert [line for line in there.done if line in lines] == lines[:at] or at == 60
    assert there.nozzle == there.bed == 0.0


def test_commands_of_other_hosts_are_ignored_with_a_word(tmp_path: Path) -> None:
    """They stop nothing, and one note names each once."""
    lines = cube(60)
    mixed = ["@info begins", *lines[:20], "@PAUSE_POSITION 3", "@resume", "@info again", *lines[20:]]
    with printer() as there:
        ended, shown = printed(there, job_of(tmp_path, mixed))
    assert (ended.phase, shown) == (Phase.DONE, [])
    assert ended.notes == ("its G-code has commands for another host (@info, @pause_position): they were ignored",)
    assert [line for line in there.done if line != "M105"] == lines


@pytest.mark.parametrize("text", ["@", "@ pause", "@5", "pause", "G1 @pause", "@pause\x00"])
def test_what_is_no_command_for_a_host(text: str) -> None:
    """A sign alone, or one with no name behind it, names nothing."""
    assert host_command(text) == ""


_MARKED = b"\xef\xbb\xbf"


@pytest.mark.parametrize("kind", list(ServerKind), ids=lambda kind: kind.value)
def test_a_byte_order_mark_reaches_no_server(kind: ServerKind, tmp_path: Path) -> None:
    """The server gets the file from its first command on, whole; commands for a host stay in it, which a note says."""
    content = "\n".join([*cube(300), "@pause"]).encode() + b"\n"
    gcode = tmp_path / "cube.gcode"
    gcode.write_bytes(_MARKED + content)
    with print_server(kind) as there:
        ended = done(tmp_path, str(gcode), *with_key(tmp_path, there.uri))
        assert [sent for _, sent in there.files] == [content]
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "note: its G-code has commands for a host (@pause): " in ended.stdout


def test_a_byte_order_mark_reaches_no_card(tmp_path: Path) -> None:
    """What is written begins with the first command."""
    content = "\n".join(cube(50)).encode() + b"\n"
    (tmp_path / "cube.gcode").write_bytes(_MARKED + content)
    ended = done(tmp_path, str(tmp_path / "cube.gcode"), "--printer", f"file:{tmp_path}/out.gcode")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert (tmp_path / "out.gcode").read_bytes() == content
