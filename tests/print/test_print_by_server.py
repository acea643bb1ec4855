"""phone-host print by a server, into a file, and with other slicers: as its user meets it."""

import json
import shutil
import signal
import socket
import subprocess
from contextlib import closing
from pathlib import Path

import pytest
from zeroconf import ServiceInfo, Zeroconf

from common.errors import SettingsError
from common.program.settings import read_file
from phone_host.discovery.found import Announcement
from phone_host.printers.doors import key_of
from phone_host.printers.gcode import examine
from phone_host.printers.printer_uri import FoundPrinter, ServerKind, printers_of, read_uri
from phone_host.printers.server_door import name_there
from tests.print.test_print_verb import command, cube_file, done, environment
from tests.support.marlin_printer import Faults, cube, printer
from tests.support.print_server import KEY, ServerFaults, print_server
from tests.support.programs import until


@pytest.fixture
def gcode(tmp_path: Path) -> Path:
    """A print of 300 lines."""
    path = tmp_path / "cube.gcode"
    path.write_text("\n".join(cube(300)) + "\n")
    return path


def with_key(home: Path, uri: str, key: str = KEY) -> list[str]:
    """The options of a print with a settings file of its own."""
    file = home / "host.toml"
    file.write_text(f'fifo = "2:block"\n\n[page]\nnear = "300"\n\n[printers]\n"{uri}" = "{key}"\n')
    return ["--printer", uri, "--config", str(file), "--yes"]


@pytest.mark.parametrize("kind", list(ServerKind), ids=lambda kind: kind.value)
def test_a_print_by_a_server(kind: ServerKind, gcode: Path, tmp_path: Path) -> None:
    """The key comes from the settings file; a sentence at the end, or one JSON object; nothing is left in the journal."""
    with print_server(kind) as there:
        ended = done(tmp_path, str(gcode), *with_key(tmp_path, there.uri))
        assert (ended.returncode, ended.stdout, ended.stderr) == (0, "printed: 300 lines\n", "")
        told = json.loads(done(tmp_path, str(gcode), *with_key(tmp_path, there.uri), "--json").stdout)
    assert (told["ended"], told["share"], told["printer"]) == ("done", 1.0, there.uri)
    assert [content for _, content in there.files] == [gcode.read_bytes()] * 2
    assert not list(tmp_path.rglob("printing/*.json"))


def test_ctrl_c_and_a_kill(gcode: Path, tmp_path: Path) -> None:
    """Ctrl-C ends the print and cools; after a kill the next start says that the server may still be printing."""
    with print_server(ServerKind.OCTOPRINT, ServerFaults(rate=0.001)) as there:
        asked = command(tmp_path, str(gcode), *with_key(tmp_path, there.uri))
        with subprocess.Popen(asked, env=environment(tmp_path), stdout=subprocess.PIPE, text=True) as process:
            until(lambda: there.condition == "printing", "it prints")
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "heaters are off" in said
        assert there.goal == 0.0
        with subprocess.Popen(asked, env=environment(tmp_path), stdout=subprocess.DEVNULL) as killed:
            until(
                lambda: there.condition == "printing" and bool(list(tmp_path.rglob("printing/*.json"))),
                "it prints again",
            )
            killed.kill()
            killed.wait(60)
        there.condition = "ready"
        again = done(tmp_path, str(gcode), *with_key(tmp_path, there.uri)[:-1])
        assert again.returncode == 2
        assert "may still be printing it" in again.stderr
        assert len(there.files) == 2


def test_keys_are_asked_for_and_never_shown(gcode: Path, tmp_path: Path) -> None:
    """A wrong one, none, one in the address, a broken table: exit 2, one line, and the key is nowhere."""
    secret = "5ec4e7"
    with print_server(ServerKind.OCTOPRINT) as there:
        cases = [
            (with_key(tmp_path, there.uri, secret), "does not take the key"),
            (["--printer", there.uri, "--yes"], "wants a key"),
            (["--printer", there.uri.replace("//", f"//{secret}@"), "--yes"], "holds a name or key"),
        ]
        for arguments, words in cases:
            ended = done(tmp_path, str(gcode), *arguments)
            assert ended.returncode == 2, ended.stderr
            assert words in ended.stderr
            assert len(ended.stderr.splitlines()) == 1
            assert secret not in ended.stderr + ended.stdout
    for table in (f'"{there.uri}" = "{secret}', f'"usb" = "{secret}"', f'"{there.uri}" = ["{secret}"]'):
        (tmp_path / "host.toml").write_text(f"[printers]\n{table}\n")
        ended = done(tmp_path, str(gcode), "--printer", there.uri, "--config", str(tmp_path / "host.toml"), "--yes")
        assert ended.returncode == 2
        assert secret not in ended.stderr, table
        assert len(ended.stderr.splitlines()) == 1


def test_refusals_come_before_the_slicing(tmp_path: Path) -> None:
    """Offline, busy and in error: exit 3 in one line, though the model is no mesh and there may be no slicer."""
    model = tmp_path / "empty.stl"
    model.touch()
    assert done(tmp_path, str(model), "--printer", "octoprint://127.0.0.1:9", "--yes").returncode == 3
    for faults, words in ((ServerFaults(condition="printing", rate=0.0), "is busy"), (ServerFaults(condition="error", words="Thermal runaway"), "Thermal runaway")):  # fmt: skip
        with print_server(ServerKind.MOONRAKER, faults) as there:
            ended = done(tmp_path, str(model), *with_key(tmp_path, there.uri))
        assert ended.returncode == 3
        assert words in ended.stderr
        assert len(ended.stderr.splitlines()) == 1


def test_a_file_takes_the_gcode(gcode: Path, tmp_path: Path) -> None:
    """Nobody is asked; what is there stays, and a folder that is not there is named."""
    out = tmp_path / "out.gcode"
    ended = done(tmp_path, str(gcode), "--printer", f"file:{out}")
    assert (ended.returncode, ended.stdout) == (0, f"written to {out}\n")
    assert out.read_bytes() == gcode.read_bytes()
    assert done(tmp_path, str(gcode), "--printer", f"file:{out}").returncode == 2
    assert "is no folder" in done(tmp_path, str(gcode), "--printer", f"file:{tmp_path}/no/x.gcode").stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_disk_that_is_full_is_told(gcode: Path, tmp_path: Path) -> None:
    """One line, exit 3; no half of a file is left."""
    limited = ["prlimit", "--fsize=4096", *command(tmp_path, str(gcode), "--printer", f"file:{tmp_path}/out.gcode")]
    ended = subprocess.run(limited, env=environment(tmp_path), capture_output=True, text=True, check=False, timeout=60)
    assert ended.returncode == 3
    assert "cannot be written" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert not (tmp_path / "out.gcode").exists()


CURA = Path(__file__).resolve().parents[2] / "build/printers/cura/usr/share/cura/resources"
SLICERS = [
    pytest.param("prusa", marks=pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="needs prusa-slicer")),
    pytest.param(
        "cura",
        marks=pytest.mark.skipif(
            shutil.which("CuraEngine") is None or not CURA.exists(),
            reason="needs cura-engine, and cura unpacked: make printers",
        ),
    ),
]


@pytest.mark.parametrize("slicer", SLICERS)
def test_each_slicer_puts_a_cube_into_the_middle_of_the_bed(slicer: str, tmp_path: Path) -> None:
    """In its size, hot while it prints and cold at the end; what the slicer refuses is one line."""
    stl, out = cube_file(tmp_path / "cube.stl", 20), tmp_path / "cube.gcode"
    more = {"CURA_ENGINE_SEARCH_PATH": f"{CURA}/definitions:{CURA}/extruders"} if slicer == "cura" else {}
    asked = command(
        tmp_path, str(stl), "--unit", "mm", "--slicer", slicer, "--bed", "100,120,90", "--printer", f"file:{out}"
    )
    given = {**environment(tmp_path), **more}
    ended = subprocess.run(asked, env=given, capture_output=True, text=True, check=False, timeout=60)
    assert (ended.returncode, ended.stderr) == (0, "")
    with out.open() as file:
        found = examine(file, "cube.gcode")
    middle = [(low + high) / 2 for low, high in zip(found.low_mm, found.high_mm, strict=True)]
    assert middle[:2] == pytest.approx([50, 60], abs=1.5)
    assert found.high_mm[2] == pytest.approx(20, abs=0.3)
    assert found.heats
    assert not found.leaves_hot
    (tmp_path / "bad.ini").write_text("layer_height = many\n")
    bad = subprocess.run([*asked[:-1], f"file:{tmp_path}/no.gcode", "--profile", str(tmp_path / "bad.ini")], env=given, capture_output=True, text=True, check=False, timeout=60)  # fmt: skip
    assert bad.returncode in {2, 4}
    assert len(bad.stderr.splitlines()) == 1


def test_printers_that_announce_themselves_are_found(tmp_path: Path) -> None:
    """A real announcement on the loopback; those that are only web pages are known by their name."""
    service = "_octoprint._tcp.local."
    info = ServiceInfo(service, f"OctoPrint test.{service}", port=5055, addresses=[socket.inet_aton("127.0.0.1")], server="octotest.local.")  # fmt: skip
    with closing(Zeroconf(interfaces=["127.0.0.1"])) as network:
        network.register_service(info)
        told = json.loads(done(tmp_path, "--find", "--json").stdout)
    assert {"printer": "octoprint://127.0.0.1:5055", "name": "OctoPrint test"} in told["printers"]
    web, prusa = "_http._tcp.local.", "_prusalink._tcp.local."
    heard = [
        Announcement(web, "PrusaLink\n [buddy-mk4]", "10.0.0.5", 80),
        Announcement(prusa, "mk4", "10.0.0.5", 80),
        Announcement(web, "NAS", "10.0.0.6", 80),
        Announcement("_moonraker._tcp.local.", "voron", "[fd00::7]", 7125),
    ]
    assert [each.uri for each in printers_of(heard)] == ["moonraker://[fd00::7]:7125", "prusalink://10.0.0.5:80"]
    assert printers_of(heard)[1] == FoundPrinter("prusalink://10.0.0.5:80", "PrusaLink  [buddy-mk4]")


def test_the_longest_time_for_one_line_is_a_setting(gcode: Path, tmp_path: Path) -> None:
    """A printer that is busy for ever is given up after it, and cooled; what is no number of minutes is refused."""
    file = tmp_path / "host.toml"
    with printer(Faults(busy=frozenset({"G28"})), on_socket=True) as there:
        options = ["--printer", there.uri, "--config", str(file), "--yes"]
        for bad in ("0", "true", "nan"):
            file.write_text(f"[printers]\nmax_busy_minutes = {bad}\n")
            ended = done(tmp_path, str(gcode), *options)
            assert (ended.returncode, len(ended.stderr.splitlines())) == (2, 1), ended.stderr
            assert "max_busy_minutes" in ended.stderr
        assert there.done == []
        file.write_text("[printers]\nmax_busy_minutes = 0.1\n")
        ended = done(tmp_path, str(gcode), *options)
        until(lambda: there.is_cold and "M107" in there.done, "it is cooled")
    assert ended.returncode == 3
    assert "within 0.1 min" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_names_on_a_server_are_plain() -> None:
    """Whatever the file is called here."""
    assert name_there("my cup.GCODE") == "tandemscan-my_cup.gcode"
    assert name_there("../../etc/passwd") == "tandemscan-etc_passwd.gcode"
    assert name_there('"\r\nX: y.g') == "tandemscan-X_y.gcode"
    assert name_there("Tasse-ä.gcode") == "tandemscan-Tasse-.gcode"
    assert name_there(".gcode") == "tandemscan-print.gcode"


def test_the_key_of_a_printer_is_found_by_its_place(tmp_path: Path) -> None:
    """However its address is written; the rest of the settings stays as it is."""
    file = tmp_path / "host.toml"
    file.write_text('[printers]\n"octoprint://Octopi.local:80/" = "A"\n"moonraker://10.0.0.2" = "B"\n')
    table = read_file(file)["printers"]
    assert key_of(read_uri("octoprint://octopi.LOCAL"), table, file) == "A"
    assert key_of(read_uri("moonraker://10.0.0.2:7125"), table, file) == "B"
    assert not key_of(read_uri("prusalink://10.0.0.2"), table, file)
    with pytest.raises(SettingsError, match="is no table"):
        key_of(read_uri("prusalink://10.0.0.2"), "x", file)
