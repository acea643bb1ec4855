"""Termux's scripts and the host on a phone's stand-in: installed twice, told by doctor, served, paired with a board outside, kept by the service."""

import json
import re
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from common import now
from tests.phone.phone import PATIENCE_S, Phone, image, interrupt
from tests.support.numbered import saved_numbers, write_film
from tests.support.page_client import PageClient
from tests.support.programs import board, free_port

pytestmark = pytest.mark.timeout(3600)  # everything is emulated

INSTALL = "sh deploy/host/termux-install.sh"
RUN = "sh deploy/host/termux-run.sh"
PACKAGES = "python python-pip python-numpy python-msgpack python-cryptography opencv-python"
PAGE_PORT = 8765


@pytest.fixture(scope="module")
def phone(tmp_path_factory: pytest.TempPathFactory) -> Phone:
    """A phone with the project installed, without a compiler."""
    tree = image()
    if not tree.exists():
        pytest.skip(f"no stand-in of a phone in {tree}: run make test-arm")
    made = Phone(tree, tmp_path_factory.mktemp("phone"))
    (tmp_path_factory.getbasetemp()).chmod(0o755)
    done = made.run(f"{INSTALL} --no-compiler")
    assert done.returncode == 0, done.stdout + done.stderr + _log(made)
    return made


def _log(phone: Phone) -> str:
    path = phone.checkout / "build" / "termux-install.log"
    return path.read_text()[-4000:] if path.exists() else ""


def doctor(phone: Phone, options: str = "") -> tuple[int, dict[str, Any]]:
    """Run the doctor; return the exit code, and the checks by what they checked."""
    done = phone.run(f"phone-host doctor --json {options}")
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, {check["what"]: check for check in json.loads(done.stdout)["checks"]}


def test_it_is_installed_from_termux_and_pins_and_a_second_run_updates(phone: Phone) -> None:
    """Termux's packages come from pkg, without clang; a second run works on what is there and says what to do next."""
    assert [call for call in phone.calls() if call.startswith("pkg")][:3] == [
        "pkg install -y x11-repo",
        "pkg update",
        f"pkg install -y -o Dpkg::Options::=--force-confold {PACKAGES}",
    ]
    again = phone.run(f"{INSTALL} --no-compiler")
    assert again.returncode == 0, again.stdout + again.stderr + _log(phone)
    assert again.stdout.splitlines()[-1].startswith("Installed. Next: phone-host doctor")


def test_doctor_says_plainly_what_a_phone_is(phone: Phone) -> None:
    """Nothing fails; the platform, the cost of doing without a compiler, and what stands in for USB, Bluetooth and camera are said."""
    code, checks = doctor(phone)
    assert code == 0, checks
    assert re.search(r"Python 3\.1[4-9]\.\d+ on android", checks["python"]["finding"])
    assert checks["phone"]["finding"] == "Debian stand-in, Android 15, Termux 0.119.0 F_DROID, aarch64"
    assert checks["native"]["verdict"] == "warn"
    assert "six times the work" in checks["native"]["finding"]
    assert "pkg install clang" in checks["native"]["remedy"]
    assert "Ethernet over USB" in checks["usb"]["finding"]
    assert "needs a laptop" in checks["bluetooth"]["finding"]
    assert "browser" in checks["camera"]["finding"]
    assert {"serial", "power", "usb-log"}.isdisjoint(checks)
    assert not [name for name, check in checks.items() if check["verdict"] == "fail"]


def test_links_that_a_phone_cannot_have_fail_with_another_way(phone: Phone) -> None:
    """A serial port and Bluetooth are refused by name, and the cable without a board says where to plug it."""
    code, checks = doctor(phone, "--link serial:/dev/ttyACM0 --link rfcomm://AA:BB:CC:DD:EE:FF/1 --wait 1")
    assert code == 4
    assert "tcp://192.168.7.2:5555" in checks["usb"]["remedy"]
    assert checks["bluetooth"]["verdict"] == "fail"
    code, checks = doctor(phone, "--link tcp://192.168.7.2:5555 --wait 1")
    assert code == 4
    assert "OTG" in checks["network"]["remedy"]


@pytest.fixture
def board_outside(tmp_path: Path) -> Iterator[str]:
    """A board process outside, with numbered images; yields its link."""
    link = f"tcp://127.0.0.1:{free_port()}"
    film = write_film(tmp_path / "left", 40)
    with board(["run", "--camera", f"replay:{film}?fps=4&loop=1", "--link", link], tmp_path):
        yield link


def test_pairs_from_a_board_outside(phone: Phone, board_outside: str) -> None:
    """Five pairs come over loopback TCP, right ones, and the run ends in order."""
    _put_film(phone)
    done = phone.run(
        f"phone-host run --link {board_outside} --camera 'replay:../film?fps=4&loop=1' --pairs 5 --save-every 1 --out ../first --json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["pairs"] == 5
    shown = saved_numbers(phone.home / "first")
    assert len(shown) == 5
    assert all(left == right for left, right in shown), shown


def test_the_page_opens_keeps_the_phone_awake_and_pairs(phone: Phone, board_outside: str, tmp_path: Path) -> None:
    """termux-run.sh takes the wake lock, opens the page, whose run pairs with the board; Ctrl-C ends in order and gives the lock back."""
    _put_film(phone)
    port, log = free_port(), tmp_path / "page.log"
    before = len(phone.calls())
    with phone.running(f"{RUN} 127.0.0.1:{port}", log) as script:
        until_long(
            lambda: any(call.startswith("termux-open-url") for call in phone.calls()[before:]),
            "the page is opened",
            log,
        )
        lock, opened = phone.calls()[before:]
        assert lock.strip() == "termux-wake-lock"
        client = PageClient(opened.split()[1])
        client.do("set", link=board_outside, camera="replay:../film?fps=4&loop=1")
        assert client.do("run")["words"]
        until_long(lambda: client.pairs() >= 3, "three pairs on the page", log)
        assert client.state()["trouble"] is None
        interrupt(script, "termux-run.sh", "phone-host")
        assert script.wait(60) == 130, log.read_text()
    assert phone.calls()[-1].strip() == "termux-wake-unlock"
    assert "Traceback" not in log.read_text()


def _put_film(phone: Phone) -> None:
    film = phone.home / "film"
    if not film.exists():
        write_film(film, 40)


def test_the_service_serves_the_page_and_starts_with_the_phone(phone: Phone, tmp_path: Path) -> None:
    """--service puts the page under runit with the wake lock; termux-run.sh opens that one; a boot starts it again; --no-service ends it."""
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", PAGE_PORT)) == 0:
            pytest.skip(f"port {PAGE_PORT} of this machine is taken")
    log = tmp_path / "service.log"
    wait = "while :; do sleep 1; done"
    with phone.running(
        f"{INSTALL} --no-compiler --service && {RUN} && {INSTALL} --no-compiler --no-service; {wait}", log
    ):
        until_long(
            lambda: re.search(r"Installed\.(.|\n)*Installed\.|error:", log.read_text()), "installed, opened, ended", log
        )
        assert "error:" not in log.read_text(), log.read_text()
    calls = [call.strip() for call in phone.calls()]
    assert "pkg install -y termux-services" in calls
    assert "sv-enable phone-host-page" in calls
    assert not (phone.prefix / "var" / "service" / "phone-host-page").exists()
    with phone.running(f"{INSTALL} --no-compiler --service; {wait}", log):
        until_long(lambda: re.search(r"Installed\.|error:", log.read_text()), "the service is back", log)
        assert "error:" not in log.read_text(), log.read_text()
    before = len(phone.calls())
    with phone.running(f"~/.termux/boot/tandemscan; {wait}", log):
        until_long(_answers, "the page answers after a boot", log)
        assert [call.strip() for call in phone.calls()[before:]][:2] == ["termux-wake-lock", "start-services"]


def until_long(condition: Any, what: str, log: Path) -> None:
    """Wait for something that is emulated; fail with its log."""
    deadline = now.monotonic_ns() + round(PATIENCE_S * 1e9)
    while not condition():
        assert now.monotonic_ns() < deadline, f"not within {PATIENCE_S:.0f} s: {what}\n{log.read_text()}"
        time.sleep(0.2)


def _answers() -> bool:
    try:
        socket.create_connection(("127.0.0.1", PAGE_PORT), 1).close()
    except OSError:
        return False
    return True


def test_each_failure_is_one_line_with_its_remedy(phone: Phone) -> None:
    """A pkg that fails, another Python's environment, and no installation at all are told or mended."""
    broken = phone.prefix / "bin" / "pkg"
    sound = broken.read_text()
    broken.write_text("#!/bin/sh\necho 'E: Unable to locate package'\nexit 100\n")
    done = phone.run(INSTALL)
    broken.write_text(sound)
    assert done.returncode == 3
    assert re.fullmatch(r"error: pkg cannot install x11-repo.*: run termux-change-repo.*\n", done.stderr), done.stderr
    done = phone.run(f"mv .venv away; {RUN}; code=$?; mv away .venv; exit $code")
    assert done.returncode == 3
    assert done.stderr == "error: phone-host is not installed here: run sh deploy/host/termux-install.sh\n"


def test_the_boards_package_can_be_built_on_the_phone(phone: Phone) -> None:
    """Whoever has only a phone builds the board's Debian package there."""
    done = phone.run("SOURCE_DATE_EPOCH=1700000000 deploy/board/build-deb dist")
    assert done.returncode == 0, done.stderr
    assert (phone.checkout / "dist" / Path(done.stdout.strip()).name).stat().st_size > 50_000


def test_clang_builds_the_own_matcher(phone: Phone) -> None:
    """With the compiler the native library is built for the phone's processor, and doctor names its instructions."""
    done = phone.run(INSTALL)
    assert done.returncode == 0, done.stdout + done.stderr + _log(phone)
    assert phone.calls()[-1].endswith(f"{PACKAGES} clang") or any(call.endswith("clang") for call in phone.calls())
    _, checks = doctor(phone)
    assert checks["native"]["verdict"] == "ok", checks["native"]
    assert "NEON" in checks["native"]["finding"]


def test_nothing_but_termuxs_own_folders_may_be_written(phone: Phone) -> None:
    """The stand-in is honest: the system, /tmp and /dev/shm cannot be written, Python says android, and shared memory is not to be had."""
    done = phone.run(
        "for path in /tmp/x /usr/x /dev/shm/x /etc/x /x; do (: >$path) 2>/dev/null && echo wrote $path; done; ls /dev;"
        " python -c 'import sys; print(sys.platform); import multiprocessing.shared_memory' 2>&1 | grep -e android -e ModuleNotFound"
    )
    assert "wrote" not in done.stdout
    assert "ttyACM" not in done.stdout
    assert "android" in done.stdout
    assert "ModuleNotFoundError" in done.stdout
