"""`phone-host run` without --link finds the right board, in a network of its own."""

import json
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from phone_host.discovery.discovery import remember, remembered
from phone_host.discovery.found import SERVICE
from tests.support.numbered import write_film
from tests.support.programs import PATIENCE_S

ROOT = Path(__file__).resolve().parents[2]
_ALONE = [
    "unshare",
    "-rn",
    "sh",
    "-c",
    'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"',
    "-",
]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few images."""
    return write_film(tmp_path_factory.mktemp("discovery") / "film", 20)


def played(scene: str, film: Path, folder: Path) -> list[dict[str, Any]]:
    """Run a scene of tests/support/discovery_scenes.py in a network of its own."""
    pytest.importorskip("zeroconf")
    if not shutil.which("ip") or subprocess.run([*_ALONE, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this machine gives no network of one's own (unshare -rn, ip)")
    (folder / "film").symlink_to(film)
    command = [*_ALONE, sys.executable, "-m", "tests.support.discovery_scenes", scene, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    said: list[dict[str, Any]] = json.loads(done.stdout)
    return said


def test_a_board_that_announces_itself_is_found(film: Path, tmp_path: Path) -> None:
    """The only board that both announces itself and answers is chosen; a board that is announced but gone does not count."""
    (said,) = played("announced", film, tmp_path)
    assert said["code"] == 0, said["err"]
    assert "found tcp://127.0.0.2:6001" in said["err"]


def test_several_boards_are_listed(film: Path, tmp_path: Path) -> None:
    """With two boards the host ends with exit 3 and one line that names both and the option to choose with."""
    (said,) = played("several", film, tmp_path)
    assert said["code"] == 3
    last = said["err"].splitlines()[-1]
    for part in ("2 boards answer", "bone at tcp://127.0.0.2:6001", "pi at tcp://127.0.0.2:6002", "--link"):
        assert part in last


def test_the_last_board_comes_first(film: Path, tmp_path: Path) -> None:
    """A board that was used before is chosen even if another one announces itself; when it is gone, the other one is."""
    first, again, other = played("last", film, tmp_path)
    assert (first["code"], again["code"], other["code"]) == (0, 0, 0), (first, again, other)
    assert "found tcp://127.0.0.2:6001" in first["err"]
    assert "found tcp://127.0.0.2:6001" in again["err"]
    assert "found tcp://127.0.0.2:6002" in other["err"]


def test_a_board_on_this_machine_is_found(film: Path, tmp_path: Path) -> None:
    """Without any mDNS a board on this machine's usual port is found."""
    (said,) = played("here", film, tmp_path)
    assert said["code"] == 0, said["err"]
    assert "found tcp://127.0.0.1:5555" in said["err"]


def test_the_board_on_the_usb_cable_is_found_and_asks_for_keys(film: Path, tmp_path: Path) -> None:
    """The gadget's address is tried; if the board there is no peer yet, one line names the command that pairs."""
    (said,) = played("gadget", film, tmp_path)
    assert "found tcp://192.168.7.2:5555" in said["err"]
    assert said["code"] == 3
    assert "phone-host pair --link tcp://192.168.7.2:5555" in said["err"].splitlines()[-1]


def test_from_a_cable_to_pairs_without_an_address(film: Path, tmp_path: Path) -> None:
    """With a board on the cable, `phone-host pair` and `phone-host run` need only the code: the board is found, paired, and streams."""
    paired, said = played("cable", film, tmp_path)
    assert paired["code"] == 0, paired["err"]
    assert said["code"] == 0, said["err"]
    assert "found tcp://192.168.7.2:5555" in paired["err"]
    assert "found tcp://192.168.7.2:5555" in said["err"]


def test_what_does_not_greet_as_zeromq_is_no_board(film: Path, tmp_path: Path) -> None:
    """A foreign service on the usual port is ignored; if nothing else answers in time, one line says what was tried."""
    (said,) = played("foreign", film, tmp_path)
    assert said["code"] == 3
    last = said["err"].splitlines()[-1]
    for part in ("no board answers", "192.168.7.2", "mDNS", "--link"):
        assert part in last


def test_the_board_announces_what_the_host_looks_for() -> None:
    """The static service for avahi has the type and port that discovery expects, and uses the board's own name."""
    group = ET.parse(ROOT / "deploy" / "board" / "tandemscan.service.xml").getroot()
    assert group.findtext("service/type") == SERVICE.removesuffix(".local.")
    assert group.findtext("service/port") == "5555"
    name = group.find("name")
    assert name is not None
    assert (name.text, name.get("replace-wildcards")) == ("%h", "yes")


def test_the_package_brings_the_announcement(tmp_path: Path) -> None:
    """The board's package installs the static service where avahi-daemon reads it, as a file that its owner may change, and recommends the daemon."""
    if not shutil.which("dpkg-deb"):
        pytest.skip("dpkg-deb is missing")
    built = subprocess.run([ROOT / "deploy/board/build-deb", tmp_path], capture_output=True, text=True, check=True)
    package = built.stdout.strip()
    fields = subprocess.run(["dpkg-deb", "--field", package], capture_output=True, text=True, check=True).stdout
    assert "Recommends: avahi-daemon" in fields
    subprocess.run(["dpkg-deb", "--raw-extract", package, tmp_path / "tree"], check=True)
    announced = tmp_path / "tree" / "etc" / "avahi" / "services" / "tandemscan.service"
    assert announced.read_bytes() == (ROOT / "deploy" / "board" / "tandemscan.service.xml").read_bytes()
    assert "/etc/avahi/services/tandemscan.service" in (tmp_path / "tree/DEBIAN/conffiles").read_text().splitlines()


@pytest.mark.parametrize("text", ["", "tcp://", "tcp://x:y", "ipc:///x", "\ud800", "tcp://127.0.0.1:5555 rm"])
def test_a_spoiled_memory_is_no_board(text: str, tmp_path: Path) -> None:
    """Whatever the file of the last board contains, the result is a tcp link or nothing."""
    (tmp_path / "last-board").write_bytes(text.encode("utf-8", "surrogatepass"))
    assert remembered(tmp_path) == []
    remember(tmp_path, "tcp://192.0.2.1:5555")
    assert remembered(tmp_path) == ["tcp://192.0.2.1:5555"]


def test_the_memory_leads_nowhere(tmp_path: Path) -> None:
    """If a symbolic link or pipe replaces the file of the last board, it is neither followed nor waited for; the next board in use replaces it."""
    (tmp_path / "precious").write_text("tcp://192.0.2.7:5555")
    (tmp_path / "state").mkdir()
    for plant in (lambda path: path.symlink_to(tmp_path / "precious"), os.mkfifo):
        plant(tmp_path / "state" / "last-board")
        assert remembered(tmp_path / "state") == []
        remember(tmp_path / "state", "tcp://192.0.2.1:5555")
        assert remembered(tmp_path / "state") == ["tcp://192.0.2.1:5555"]
        (tmp_path / "state" / "last-board").unlink()
    assert (tmp_path / "precious").read_text() == "tcp://192.0.2.7:5555"
