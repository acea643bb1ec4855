"""The programs that others use: the real OctoPrint and Moonraker take our prints; Printrun and OctoPrint judge our simulated printer.

They run in environments of their own (`make printers`); where they are not installed these tests are skipped.
"""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from common.errors import SettingsError, UnavailableError
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.doors import door_to
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.slicing import facts_of
from tests.support import real_print_servers as real
from tests.support.marlin_printer import Faults, cube, printer
from tests.support.programs import until

pytestmark = pytest.mark.xdist_group("real servers")  # they share one OctoPrint

needs_octoprint = pytest.mark.skipif(not real.OCTOPRINT.exists(), reason=f"OctoPrint is {real.HOW}")
needs_moonraker = pytest.mark.skipif(not real.MOONRAKER.exists(), reason=f"Moonraker is {real.HOW}")
needs_printrun = pytest.mark.skipif(not real.PRINTRUN.exists(), reason=f"Printrun is {real.HOW}")

SENDER = """
import sys, time
from printrun import gcoder
from printrun.printcore import printcore
print_core = printcore(sys.argv[1], 115200)
while not print_core.online:
    time.sleep(0.05)
print_core.startprint(gcoder.LightGCode(open(sys.argv[2])))
while print_core.printing:
    time.sleep(0.05)
time.sleep(0.5)
print_core.disconnect()
"""


def job(folder: Path, lines: int, *, ends: bool = True) -> Job:
    """A print of so many lines; its moves are fast, because OctoPrint's printer takes a tenth of their real time."""
    path = folder / "cup.gcode"
    wanted = [line.replace("F3000", "F60000") for line in cube(lines)]
    path.write_text("\n".join(wanted if ends else wanted[:-3]) + "\n")
    return Job(path, path.name, facts_of(path))


def printed(
    uri: str, key: str, what: Job, wishes: Wishes | None = None, tell: Callable[[Progress], None] = lambda _: None
) -> Ended:
    """Print by a server."""
    return door_to(read_uri(uri), key).send(what, wishes or Wishes(), tell)


@pytest.fixture(scope="module")
def octoprint(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """OctoPrint with its own simulated printer."""
    with real.octoprint(tmp_path_factory.mktemp("octoprint")) as there:
        yield there


@needs_octoprint
def test_octoprint_prints_our_file(octoprint: str, tmp_path: Path) -> None:
    """To its end, with growing shares; what it has stored is what we gave."""
    shares: list[float] = []
    what = job(tmp_path, 120)

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING:
            shares.append(progress.share)

    ended = printed(f"octoprint://{octoprint}", real.KEY, what, tell=watch)
    assert (ended.phase, ended.share) == (Phase.DONE, 1.0)
    assert shares == sorted(shares)
    stored = real.asked(f"http://{octoprint}/api/files/local/tandemscan-cup.gcode", real.KEY)
    assert stored["size"] == what.gcode.stat().st_size


@needs_octoprint
def test_octoprint_pauses_cancels_and_cools(octoprint: str, tmp_path: Path) -> None:
    """The targets are 0 after the wish, and a second print is refused meanwhile."""
    wishes, seen = Wishes(), set[Phase]()
    uri, what = f"octoprint://{octoprint}", job(tmp_path, 4000)
    refused: list[str] = []

    def watch(progress: Progress) -> None:
        seen.add(progress.phase)
        if progress.phase is Phase.PRINTING and progress.heat.nozzle[1] > 0 and not refused:
            with pytest.raises(UnavailableError, match="is busy") as error:
                door_to(read_uri(uri), real.KEY).require_ready()
            refused.append(error.value.problem)
            wishes.pause()
        elif progress.phase is Phase.PAUSED:
            wishes.cancel()

    ended = printed(uri, real.KEY, what, wishes, watch)
    assert ended.phase is Phase.CANCELLED
    assert Phase.PAUSED in seen
    now = real.asked(f"http://{octoprint}/api/printer?exclude=sd", real.KEY)
    assert now["state"]["flags"]["operational"]
    assert all(heater["target"] == 0 for heater in now["temperature"].values())


@needs_octoprint
def test_octoprint_with_a_wrong_key_or_without_its_printer(octoprint: str, tmp_path: Path) -> None:
    """One line each."""
    with pytest.raises(SettingsError, match="does not take the key"):
        printed(f"octoprint://{octoprint}", "ffff", job(tmp_path, 20))
    with pytest.raises(SettingsError, match="wants a key"):
        printed(f"octoprint://{octoprint}", "", job(tmp_path, 20))
    connection = f"http://{octoprint}/api/connection"
    real.asked(connection, real.KEY, "POST", {"command": "disconnect"})
    until(lambda: real.asked(connection, real.KEY)["current"]["state"].startswith("Offline") or real.asked(connection, real.KEY)["current"]["state"] == "Closed", "closed")  # fmt: skip
    with pytest.raises(UnavailableError, match="has no printer"):
        printed(f"octoprint://{octoprint}", real.KEY, job(tmp_path, 20))


@needs_octoprint
def test_octoprint_judges_our_simulated_printer(tmp_path: Path) -> None:
    """Over its pseudo terminal, with 1 % of the lines changed on the way: the drawing arrives whole and in order."""
    what = job(tmp_path, 400)
    with printer(Faults(corrupted=0.01)) as there, real.octoprint(tmp_path, there.path) as address:
        ended = printed(f"octoprint://{address}", real.KEY, what)
    assert ended.phase is Phase.DONE
    drawn = [line for line in there.done if line.startswith("G1 X")]
    assert drawn == [line for line in what.gcode.read_text().splitlines() if line.startswith("G1 X")]
    assert there.resends > 0


@needs_moonraker
def test_moonraker_prints_our_file(tmp_path: Path) -> None:
    """To its end; a print that leaves heaters on is cooled; another that is cancelled in the middle is cold, too."""
    with real.moonraker(tmp_path) as (address, key, klipper):
        uri = f"moonraker://{address}"
        ended = printed(uri, key, job(tmp_path, 200))
        assert (ended.phase, ended.notes) == (Phase.DONE, ())
        assert klipper.scripts == ['SDCARD_PRINT_FILE FILENAME="tandemscan-cup.gcode"']
        stored = tmp_path / "moonraker/gcodes/tandemscan-cup.gcode"
        assert stored.read_bytes() == (tmp_path / "cup.gcode").read_bytes()
        hot = printed(uri, key, job(tmp_path, 200, ends=False))
        assert "were switched off" in hot.notes[0]
        klipper.rate = 0.01
        wishes, seen = Wishes(), set[Phase]()

        def watch(progress: Progress) -> None:
            seen.add(progress.phase)
            if progress.phase is Phase.PRINTING and Phase.PAUSED not in seen:
                wishes.pause()
            elif progress.phase is Phase.PAUSED:
                wishes.cancel()

        assert printed(uri, key, job(tmp_path, 200), wishes, watch).phase is Phase.CANCELLED
        assert (klipper.state, klipper.nozzle) == ("cancelled", 0.0)
        assert klipper.share < 1.0


@needs_moonraker
def test_moonraker_with_a_wrong_key_or_without_klipper(tmp_path: Path) -> None:
    """One line each."""
    with real.moonraker(tmp_path) as (address, key, klipper):
        uri = f"moonraker://{address}"
        with pytest.raises(SettingsError, match="does not take the key"):
            printed(uri, "ffff", job(tmp_path, 20))
        klipper.stop()
        until(
            lambda: real.asked(f"http://{address}/server/info", key)["result"]["klippy_state"] != "ready", "it is gone"
        )
        with pytest.raises(UnavailableError, match="has no printer"):
            printed(uri, key, job(tmp_path, 20))


@needs_printrun
@pytest.mark.parametrize("corrupted", [0.0, 0.02], ids=["clean", "corrupted"])
def test_printrun_judges_our_simulated_printer(tmp_path: Path, corrupted: float) -> None:
    """Its sender brings every line over our pseudo terminal, in order."""
    what = job(tmp_path, 400)
    with printer(Faults(corrupted=corrupted)) as there:
        asked = [str(real.PRINTRUN), "-c", SENDER, there.path, str(what.gcode)]
        ended = subprocess.run(asked, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr
    lines = what.gcode.read_text().splitlines()
    assert [line for line in there.done if line in set(lines)] == lines
    assert (there.resends > 0) == (corrupted > 0)
